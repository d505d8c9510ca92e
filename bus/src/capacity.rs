//! What the machine has for a run, and whether that is enough: asked before anything starts, because a run that runs out of
//! shared memory later is killed by a signal.
//!
//! Must never change anything, and never guess: what cannot be found out limits nothing.

use crate::{Demand, domain::SHARED_MEMORY, journal};
use rustix::{
    fs::statvfs,
    process::{Resource, getrlimit, getuid},
    thread::{CapabilitySet, capabilities},
};
use std::{
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

/// Sizes that are suggested are multiples of this many bytes: nobody wants to type an odd number.
const ROUND_BYTES: u64 = 16 << 20;
/// Shared memory with less space than this counts as full. More blames it for processes that were killed otherwise; less
/// overlooks that a process that has just ended gave some back.
const FULL_BYTES: u64 = 1 << 18;
const MB: f64 = 1e6;

/// What the machine has at this moment. `None` means that nothing is limited, or that the limit is not readable.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Capacity {
    /// Shared memory.
    pub memory: Option<MemorySpace>,
    /// Files that can still be made in shared memory.
    pub files: Option<u64>,
    /// Open files that a process may have: the hard limit, because each process raises its own.
    pub descriptors: Option<u64>,
    /// The size of the largest file that a process may write, in bytes.
    pub file_bytes: Option<u64>,
    /// Processes and threads that can still be started.
    pub tasks: Option<TaskSpace>,
}

/// The size of `/dev/shm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemorySpace {
    /// Bytes that are free.
    pub free: u64,
    /// All bytes.
    pub total: u64,
}

/// How many processes and threads can be started, and what limits them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskSpace {
    /// How many more.
    pub left: u64,
    /// What sets the limit.
    pub limit: TaskLimit,
}

/// What limits the number of processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskLimit {
    /// `ulimit -u`, for all processes of the user.
    User,
    /// `pids.max`, for all processes of a control group, such as a container.
    Group,
}

/// What the machine lacks for a run: each as what is needed, what there is, and how to get more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("; "))]
pub struct Shortage(Vec<String>);

impl MemorySpace {
    /// Looks at `/dev/shm`; `None` if it has no limit, or does not say.
    pub fn look() -> Option<Self> {
        // A file system of no size at all has no limit.
        let space = statvfs(SHARED_MEMORY).ok().filter(|space| space.f_blocks > 0)?;
        Some(Self { free: space.f_bavail * space.f_frsize, total: space.f_blocks * space.f_frsize })
    }
}

impl Shortage {
    /// For `what`, which needs `needed` bytes of shared memory that are not free.
    pub(crate) fn of_memory(what: &str, needed: u64, MemorySpace { free, total }: MemorySpace) -> Self {
        Self(vec![format!(
            "{what} needs {} of shared memory, and {SHARED_MEMORY} has {} free of {}: {}, or end other runs",
            megabytes(needed),
            megabytes(free),
            megabytes(total),
            enlarge((total + needed).saturating_sub(free))
        )])
    }

    /// Says so if shared memory is full: then a process that was killed by SIGBUS found no page to write to.
    pub fn of_full_memory() -> Option<Self> {
        let MemorySpace { free, total } = MemorySpace::look()?;
        (free < FULL_BYTES).then(|| Self(vec![format!("{SHARED_MEMORY} is full: {}", enlarge(2 * total))]))
    }
}

impl Capacity {
    /// Looks at the machine.
    pub fn look() -> Self {
        let space = statvfs(SHARED_MEMORY).ok();
        Self {
            memory: MemorySpace::look(),
            files: space.filter(|space| space.f_files > 0).map(|space| space.f_favail),
            descriptors: getrlimit(Resource::Nofile).maximum,
            // The soft limit: unlike the one of open files, no process of a run raises it.
            file_bytes: getrlimit(Resource::Fsize).current,
            tasks: least_left([user_tasks(), group_tasks()]),
        }
    }

    /// Decides how many ticks the journal of a run keeps, or says what the run lacks.
    pub fn admit(&self, demand: &Demand) -> Result<usize, Shortage> {
        let depth = self.journal_depth(demand);
        let lacks = [
            self.lacks_memory(demand, depth),
            self.lacks_files(demand),
            self.lacks_descriptors(demand),
            self.lacks_file_size(demand, depth),
            self.lacks_tasks(demand),
        ];
        // Name all shortages together, so that the user does not fix one and then run into the next.
        let lacks: Vec<String> = lacks.into_iter().flatten().collect();
        if lacks.is_empty() { Ok(depth) } else { Err(Shortage(lacks)) }
    }

    /// As many ticks as the run would like, but at most what fits into half of the memory that it leaves: a recorder seldom
    /// lags that far, and other runs need memory, too.
    fn journal_depth(&self, demand: &Demand) -> usize {
        let [most, least] = demand.journal_depths;
        let Some(MemorySpace { free, .. }) = self.memory else { return most };
        let left = free.saturating_sub(demand.memory_bytes(0)) / 2;
        let fits = left / journal::sample_bytes(demand.uavs) as u64;
        // Never below what the run must have. If that does not fit, `lacks_memory` refuses the run.
        usize::try_from(fits).unwrap_or(usize::MAX).clamp(least, most)
    }

    fn lacks_memory(&self, demand: &Demand, depth: usize) -> Option<String> {
        let (needed, space) = (demand.memory_bytes(depth), self.memory?);
        (needed > space.free).then(|| {
            let what = format!("a run of {} UAVs", demand.uavs);
            format!("{}, or fly fewer UAVs", Shortage::of_memory(&what, needed, space))
        })
    }

    fn lacks_files(&self, demand: &Demand) -> Option<String> {
        let (needed, free) = (demand.files, self.files?);
        (needed > free).then(|| {
            format!(
                "a run of {} UAVs makes {needed} files in shared memory, and {SHARED_MEMORY} has room for {free}: \
                 `mount -o remount,nr_inodes=0 {SHARED_MEMORY}` as root, or fly fewer UAVs",
                demand.uavs
            )
        })
    }

    fn lacks_descriptors(&self, demand: &Demand) -> Option<String> {
        let (needed, allowed) = (demand.descriptors, self.descriptors?);
        (needed > allowed).then(|| {
            format!(
                "a run of {} UAVs needs {needed} open files in one process, and `ulimit -n` allows {allowed}: raise the \
                 hard limit (`docker run --ulimit nofile={needed}`, or nofile in /etc/security/limits.conf), or fly fewer \
                 UAVs",
                demand.uavs
            )
        })
    }

    fn lacks_file_size(&self, demand: &Demand, depth: usize) -> Option<String> {
        let (needed, allowed) = (demand.largest_file_bytes(depth), self.file_bytes?);
        (needed > allowed).then(|| {
            format!(
                "a run of {} UAVs makes files of up to {} in shared memory, and `ulimit -f` allows {}: \
                 `ulimit -f unlimited`, or fly fewer UAVs",
                demand.uavs,
                megabytes(needed),
                megabytes(allowed)
            )
        })
    }

    fn lacks_tasks(&self, demand: &Demand) -> Option<String> {
        let (needed, TaskSpace { left, limit }) = (demand.tasks, self.tasks?);
        (needed > left).then(|| {
            let (what, remedy) = match limit {
                TaskLimit::User => ("`ulimit -u` leaves this user", "raise it, end other processes"),
                TaskLimit::Group => {
                    ("the control group (pids.max) leaves", "`docker run --pids-limit=-1`, end other processes")
                }
            };
            format!(
                "a run of {} UAVs starts {needed} processes and threads, and {what} {left}: {remedy}, or fly fewer UAVs",
                demand.uavs
            )
        })
    }
}

/// How to make `/dev/shm` hold `bytes`.
fn enlarge(bytes: u64) -> String {
    let size = bytes.next_multiple_of(ROUND_BYTES) >> 20;
    format!(
        "enlarge it (`docker run --shm-size={size}m`, or `mount -o remount,size={size}M {SHARED_MEMORY}` as root)"
    )
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / MB)
}

fn least_left(spaces: [Option<TaskSpace>; 2]) -> Option<TaskSpace> {
    spaces.into_iter().flatten().min_by_key(|space| space.left)
}

/// What `ulimit -u` leaves this user.
fn user_tasks() -> Option<TaskSpace> {
    let limit = getrlimit(Resource::Nproc).current?;
    let powerful = CapabilitySet::SYS_RESOURCE | CapabilitySet::SYS_ADMIN;
    // The kernel does not hold such a process to the limit.
    if getuid().is_root() || capabilities(None).is_ok_and(|sets| sets.effective.intersects(powerful)) {
        return None;
    }
    // Counting is slow on a large machine, and is needed only if all tasks together could reach the limit.
    let all = fs::read_to_string("/proc/loadavg").ok().and_then(|text| all_tasks(&text))?;
    let used = if all * 2 < limit { all } else { tasks_of(getuid().as_raw()) };
    Some(TaskSpace { left: limit.saturating_sub(used), limit: TaskLimit::User })
}

/// The tasks of the whole machine: the number after the slash in `/proc/loadavg`.
fn all_tasks(loadavg: &str) -> Option<u64> {
    loadavg.split_whitespace().nth(3)?.split_once('/')?.1.parse().ok()
}

fn tasks_of(user: u32) -> u64 {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let own = processes.filter(|entry| entry.metadata().is_ok_and(|meta| meta.uid() == user));
    // Only processes have this folder. One that ends meanwhile has no tasks.
    own.map(|entry| fs::read_dir(entry.path().join("task")).map_or(0, |tasks| tasks.count() as u64)).sum()
}

/// What the control groups of this process leave.
fn group_tasks() -> Option<TaskSpace> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let number = |path: PathBuf| fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let left = |folder: &PathBuf| {
        // Without a limit, `pids.max` is the word "max".
        let (limit, used) = (number(folder.join("pids.max"))?, number(folder.join("pids.current"))?);
        Some(limit.saturating_sub(used))
    };
    let left = group_folders(&groups).iter().filter_map(left).min()?;
    Some(TaskSpace { left, limit: TaskLimit::Group })
}

/// The folders of the control groups that count processes, in both versions of control groups, and of all groups above.
fn group_folders(groups: &str) -> Vec<PathBuf> {
    let folders = |line: &str| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        let root = match controllers {
            "" => Path::new("/sys/fs/cgroup"),
            "pids" => Path::new("/sys/fs/cgroup/pids"),
            _ => return None,
        };
        let group = Path::new(path.trim_start_matches('/'));
        Some(group.ancestors().map(|above| root.join(above)).collect::<Vec<_>>())
    };
    groups.lines().filter_map(folders).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::Scenario;

    fn demand(uavs: u32) -> Demand {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = uavs;
        Demand::of(&scenario, true)
    }

    fn with_memory(free: u64, total: u64) -> Capacity {
        Capacity { memory: Some(MemorySpace { free, total }), ..Capacity::default() }
    }

    #[test]
    fn a_machine_without_limits_admits_every_run_with_the_longest_journal() {
        assert_eq!(Capacity::default().admit(&demand(6)), Ok(1024));
        assert_eq!(with_memory(1 << 40, 1 << 40).admit(&demand(6)), Ok(1024));
    }

    #[test]
    fn little_memory_makes_the_journal_shorter_before_it_refuses_the_run() {
        let docker = with_memory(64 << 20, 64 << 20);
        assert_eq!(docker.admit(&demand(30)), Ok(1024));
        for uavs in [300, 500] {
            let depth = docker.admit(&demand(uavs)).unwrap();
            assert!((50..400).contains(&depth), "{uavs} UAVs: {depth} ticks");
        }
        let refused = docker.admit(&demand(1000)).unwrap_err().to_string();
        assert!(
            refused.contains("a run of 1000 UAVs needs ") && refused.contains("free of 67.1 MB"),
            "{refused}"
        );
        assert!(refused.contains("--shm-size=112m"), "{refused}");
    }

    #[test]
    fn the_suggested_size_counts_what_others_use() {
        let busy = with_memory(1 << 20, 65 << 20).admit(&demand(6)).unwrap_err().to_string();
        assert!(busy.contains("remount,size=80M /dev/shm"), "{busy}");
    }

    #[test]
    fn everything_that_is_lacking_is_said_with_a_remedy() {
        let poor = Capacity {
            memory: None,
            files: Some(10),
            descriptors: Some(100),
            file_bytes: Some(1 << 20),
            tasks: Some(TaskSpace { left: 5, limit: TaskLimit::User }),
        };
        let said = poor.admit(&demand(6)).unwrap_err().to_string();
        for part in [
            "nr_inodes=0",
            "`ulimit -n` allows 100",
            "`ulimit -f` allows 1.0 MB",
            "`ulimit -u` leaves this user 5",
        ] {
            assert!(said.contains(part), "{said}");
        }
        let group = TaskSpace { left: 5, limit: TaskLimit::Group };
        let said = Capacity { tasks: Some(group), ..Capacity::default() }.admit(&demand(6)).unwrap_err();
        assert!(said.to_string().contains("pids-limit"), "{said}");
    }

    #[test]
    fn the_tighter_limit_of_processes_counts() {
        let [user, group] = [(9, TaskLimit::User), (4, TaskLimit::Group)]
            .map(|(left, limit)| Some(TaskSpace { left, limit }));
        assert_eq!(least_left([user, group]), group);
        assert_eq!(least_left([user, None]), user);
    }

    #[test]
    fn the_groups_above_a_group_count_as_well() {
        let folders = group_folders("12:cpu,cpuacct:/x\n4:pids:/docker/a\n0::/b.slice\n");
        let expected = ["pids/docker/a", "pids/docker", "pids/", "b.slice", ""];
        assert_eq!(folders, expected.map(|path| Path::new("/sys/fs/cgroup").join(path)));
        assert_eq!(all_tasks("0.20 0.18 0.12 1/80 11206"), Some(80));
    }

    #[test]
    fn this_machine_can_be_looked_at() {
        let MemorySpace { free, total } = Capacity::look().memory.unwrap();
        assert!(free <= total && total > 0);
        assert!(tasks_of(getuid().as_raw()) > 0);
    }
}
