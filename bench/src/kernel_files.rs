//! Parses what the kernel's files say about a machine.
//!
//! Must never open a file itself, only through the function that it is given; must never trust the format of a text.

use std::fmt;

/// Reads a file of the kernel; returns `None` if it does not exist or may not be read.
pub(crate) type ReadFile<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Processor flaws that the kernel works around at a cost.
const FLAWS: [&str; 8] =
    ["spectre_v2", "spectre_v1", "meltdown", "mds", "retbleed", "spec_store_bypass", "srso", "l1tf"];
/// What container engines put into the names of their control groups, and what the engines are called.
const ENGINES: [(&str, &str); 6] = [
    ("docker", "Docker"),
    ("libpod", "Podman"),
    ("kubepods", "Kubernetes"),
    ("containerd", "containerd"),
    ("lxc", "LXC"),
    ("machine.slice", "systemd-nspawn"),
];

/// How the cores spent their time, as shares of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Activity {
    /// Working.
    pub(crate) busy: f64,
    /// Taken by the host of this virtual machine.
    pub(crate) stolen: f64,
    /// Taken by the host since this machine booted.
    pub(crate) stolen_since_boot: f64,
}

impl fmt::Display for Activity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [busy, now, ever] = [self.busy, self.stolen, self.stolen_since_boot].map(|share| 100.0 * share);
        write!(f, "{busy:.0} % before the benchmark; stolen by a host {now:.1} %, since boot {ever:.1} %")
    }
}

/// The activity between two readings of `/proc/stat`; `None` if no time has passed.
pub(crate) fn activity(before: &str, after: &str) -> Option<Activity> {
    let (before, after) = (CpuTimes::parse(before)?, CpuTimes::parse(after)?);
    let all = after.all.checked_sub(before.all).filter(|all| *all > 0)? as f64;
    let share = |from: u64, to: u64| to.saturating_sub(from) as f64 / all;
    Some(Activity {
        busy: 1.0 - share(before.idle, after.idle) - share(before.stolen, after.stolen),
        stolen: share(before.stolen, after.stolen),
        stolen_since_boot: after.stolen as f64 / after.all as f64,
    })
}

/// Timer ticks of all cores since boot.
struct CpuTimes {
    all: u64,
    idle: u64,
    stolen: u64,
}

impl CpuTimes {
    /// Parses `cpu user nice system idle iowait irq softirq steal guest guest_nice`.
    fn parse(stat: &str) -> Option<Self> {
        // With the space, the line of all cores together; without it, `cpu0` would match as well.
        let line = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
        // The time of guests, in the last two columns, is part of the user time already.
        let numbers = line.split_whitespace().take(8).map(str::parse);
        let numbers: Vec<u64> = numbers.collect::<Result<_, _>>().ok()?;
        let [_, _, _, idle, waiting, _, _, stolen] = numbers.as_slice() else { return None };
        Some(Self { all: numbers.iter().sum(), idle: idle + waiting, stolen: *stolen })
    }
}

/// The first line of a file, unless it is empty.
pub(crate) fn first_line(read: ReadFile, path: &str) -> Option<String> {
    let text = read(path)?;
    let line = text.lines().next()?.trim();
    (!line.is_empty()).then(|| line.to_owned())
}

/// The value of `name` among lines like `name : value`.
fn value<'t>(text: &'t str, name: &str) -> Option<&'t str> {
    let of_line = |line: &'t str| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == name).then(|| value.trim())
    };
    text.lines().find_map(of_line)
}

/// The processor's name, from `/proc/cpuinfo`.
pub(crate) fn processor(cpuinfo: &str) -> Option<String> {
    // ARM processors have no name there, but at least a part number.
    let name = value(cpuinfo, "model name").or_else(|| value(cpuinfo, "Hardware"));
    name.or_else(|| value(cpuinfo, "CPU part")).map(str::to_owned)
}

/// The number of cores that this process may use, from `/proc/self/status`.
pub(crate) fn usable_cores(status: &str) -> Option<usize> {
    value(status, "Cpus_allowed_list")?.split(',').map(cores_in_range).sum()
}

/// The number of cores in a range like `3` or `0-7`.
fn cores_in_range(range: &str) -> Option<usize> {
    let (first, last) = range.split_once('-').unwrap_or((range, range));
    let (first, last): (usize, usize) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
    Some(last.checked_sub(first)? + 1)
}

/// The hypervisor that this machine runs on, as far as it shows itself.
pub(crate) fn virtual_machine(read: ReadFile) -> Option<String> {
    let cpuinfo = read("/proc/cpuinfo")?;
    let flags = value(&cpuinfo, "flags").unwrap_or_default();
    let is_guest = flags.split_whitespace().any(|flag| flag == "hypervisor");
    // WSL describes no board; only the name of its kernel gives it away.
    let kernel = first_line(read, "/proc/sys/kernel/osrelease").unwrap_or_default();
    if kernel.to_lowercase().contains("microsoft") {
        return Some("yes: WSL".into());
    }
    let hypervisor = first_line(read, "/sys/hypervisor/type");
    if !is_guest && hypervisor.is_none() {
        return Some("no sign of one".into());
    }
    let board =
        ["sys_vendor", "product_name"].map(|name| first_line(read, &format!("/sys/class/dmi/id/{name}")));
    let names: Vec<String> = board.into_iter().chain([hypervisor]).flatten().collect();
    Some(if names.is_empty() {
        "yes, of an unknown kind".into()
    } else {
        format!("yes: {}", names.join(" "))
    })
}

/// The container that this process runs in, as far as it shows itself.
pub(crate) fn container(read: ReadFile) -> String {
    // systemd writes down the engine that it was told, so no guessing is needed.
    if let Some(engine) = first_line(read, "/run/systemd/container") {
        return engine;
    }
    let groups = read("/proc/self/cgroup").unwrap_or_default() + &read("/proc/1/cgroup").unwrap_or_default();
    let named = ENGINES.iter().find(|(mark, _)| groups.contains(mark)).map(|(_, name)| *name);
    // With control groups of version 2, a container may see no name at all; these files remain.
    let docker = || read("/.dockerenv").map(|_| "Docker");
    let podman = || read("/run/.containerenv").map(|_| "Podman");
    named.or_else(docker).or_else(podman).unwrap_or("no sign of one").into()
}

/// The files that may limit the CPU time of this process, from `/proc/self/cgroup`: of its group and all groups above.
pub(crate) fn quota_files(groups: &str) -> Vec<String> {
    // The line `0::` is that of version 2. Version 1 has no `cpu.max`.
    let path = groups.lines().find_map(|line| line.strip_prefix("0::")).unwrap_or("/");
    let mut files = vec!["/sys/fs/cgroup/cpu.max".to_owned()];
    let mut folder = String::from("/sys/fs/cgroup");
    for name in path.split('/').filter(|name| !name.is_empty()) {
        folder = format!("{folder}/{name}");
        files.push(format!("{folder}/cpu.max"));
    }
    files
}

/// The limit in a `cpu.max`, in cores: `150000 100000` is 1.5, `max 100000` is no limit.
pub(crate) fn quota_cores(limit: &str) -> Option<f64> {
    let (quota, period) = limit.trim().split_once(' ')?;
    let (quota, period): (f64, f64) = (quota.parse().ok()?, period.parse().ok()?);
    (period > 0.0).then_some(quota / period)
}

/// The flaws that the kernel works around, `none`, or `None` if the kernel does not say.
pub(crate) fn mitigations(read: ReadFile) -> Option<String> {
    let state = |flaw: &str| first_line(read, &format!("/sys/devices/system/cpu/vulnerabilities/{flaw}"));
    let known: Vec<(&str, String)> =
        FLAWS.into_iter().filter_map(|flaw| Some((flaw, state(flaw)?))).collect();
    let is_mitigated = |(_, state): &&(&str, String)| state.starts_with("Mitigation");
    let mitigated: Vec<&str> = known.iter().filter(is_mitigated).map(|(flaw, _)| *flaw).collect();
    match (known.is_empty(), mitigated.is_empty()) {
        (true, _) => None,
        (false, true) => Some("none".into()),
        (false, false) => Some(mitigated.join(", ")),
    }
}

/// The choice in brackets: `madvise` of `always [madvise] never`.
pub(crate) fn bracketed(choices: &str) -> Option<String> {
    let (_, rest) = choices.split_once('[')?;
    Some(rest.split_once(']')?.0.to_owned())
}

/// The amount of memory called `name` in `/proc/meminfo`.
pub(crate) fn memory(meminfo: &str, name: &str) -> Option<String> {
    let kib: f64 = value(meminfo, name)?.strip_suffix("kB")?.trim().parse().ok()?;
    Some(format!("{:.1} GiB", kib / 1024.0 / 1024.0))
}

/// The three averages in `/proc/loadavg`.
pub(crate) fn load_average(loadavg: &str) -> Option<String> {
    let three: Vec<&str> = loadavg.split_whitespace().take(3).collect();
    let is_complete = three.len() == 3 && three.iter().all(|one| one.parse::<f64>().is_ok());
    is_complete.then(|| format!("{} (1, 5, 15 min)", three.join(" ")))
}

/// A limit from `/proc/self/limits`: the soft one, the hard one if it differs, and the unit if there is one.
pub(crate) fn limit(limits: &str, name: &str) -> Option<String> {
    let rest = limits.lines().find_map(|line| line.strip_prefix(name))?;
    let mut words = rest.split_whitespace();
    let (soft, hard) = (words.next()?, words.next()?);
    let unit =
        words.next().filter(|_| hard != "unlimited").map(|unit| format!(" {unit}")).unwrap_or_default();
    Some(if soft == hard { format!("{soft}{unit}") } else { format!("{soft}, at most {hard}{unit}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elapsed_time_is_divided_into_shares() {
        // 100 ticks pass: 20 user, 10 system, 50 idle, 10 waiting for a disk, 10 stolen.
        let before = "cpu  100 0 100 700 50 0 0 50 0 0\ncpu0 1 2 3\n";
        let after = "cpu  120 0 110 750 60 0 0 60 0 0\n";
        let seen = activity(before, after).unwrap();
        assert!((seen.busy - 0.3).abs() < 1e-12, "{seen:?}");
        assert!((seen.stolen - 0.1).abs() < 1e-12, "{seen:?}");
        assert!((seen.stolen_since_boot - 60.0 / 1100.0).abs() < 1e-12, "{seen:?}");
        assert_eq!(activity(before, before), None);
        assert_eq!(activity("cpu  1 2\n", after), None);
        assert_eq!(activity("", after), None);
    }

    #[test]
    fn cores_are_counted_in_lists_of_ranges() {
        let cores = |list: &str| usable_cores(&format!("Name:\tx\nCpus_allowed_list:\t{list}\n"));
        assert_eq!([cores("0"), cores("0-1"), cores("0-3,8,10-11")], [Some(1), Some(2), Some(7)]);
        assert_eq!([cores(""), cores("3-1"), cores("a-b")], [None; 3]);
    }

    #[test]
    fn a_processor_is_named_by_what_the_kernel_knows() {
        assert_eq!(processor("processor\t: 0\nmodel name\t: Fast 9\n").unwrap(), "Fast 9");
        assert_eq!(processor("CPU part\t: 0xd0c\n").unwrap(), "0xd0c");
        assert_eq!(processor("nothing"), None);
    }

    #[test]
    fn limits_are_shown_soft_and_hard() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max open files            1024                 524288               files     \n\
                      Max locked memory         unlimited            unlimited            bytes     \n\
                      Max realtime priority     0                    0                    \n";
        assert_eq!(limit(limits, "Max open files").unwrap(), "1024, at most 524288 files");
        assert_eq!(limit(limits, "Max locked memory").unwrap(), "unlimited");
        assert_eq!(limit(limits, "Max realtime priority").unwrap(), "0");
        assert_eq!(limit(limits, "Max cheese"), None);
    }

    #[test]
    fn quotas_of_all_groups_above_count() {
        let files = quota_files("1:cpu:/old\n0::/a.slice/b.scope\n");
        let expected = ["cpu.max", "a.slice/cpu.max", "a.slice/b.scope/cpu.max"];
        assert_eq!(files, expected.map(|file| format!("/sys/fs/cgroup/{file}")));
        assert_eq!(quota_cores("150000 100000\n"), Some(1.5));
        assert_eq!([quota_cores("max 100000\n"), quota_cores("1 0"), quota_cores("")], [None; 3]);
    }

    /// Asks about a machine that has exactly these `files`.
    fn on<T>(files: &[(&str, &str)], ask: fn(ReadFile) -> T) -> T {
        ask(&|path| files.iter().find(|(known, _)| *known == path).map(|(_, text)| (*text).into()))
    }

    #[test]
    fn virtual_machines_are_recognized_by_their_flag_and_their_board() {
        let guest = ("/proc/cpuinfo", "flags\t\t: fpu hypervisor lm\n");
        let kvm =
            [guest, ("/sys/class/dmi/id/sys_vendor", "QEMU\n"), ("/sys/class/dmi/id/product_name", "q35\n")];
        assert_eq!(on(&kvm, virtual_machine).unwrap(), "yes: QEMU q35");
        assert_eq!(on(&[guest], virtual_machine).unwrap(), "yes, of an unknown kind");
        let metal = [("/proc/cpuinfo", "flags\t\t: fpu lm\n"), ("/sys/class/dmi/id/sys_vendor", "Dell\n")];
        assert_eq!(on(&metal, virtual_machine).unwrap(), "no sign of one");
        let wsl = [guest, ("/proc/sys/kernel/osrelease", "5.15-microsoft-standard-WSL2\n")];
        assert_eq!(on(&wsl, virtual_machine).unwrap(), "yes: WSL");
        assert_eq!(on(&[], virtual_machine), None);
    }

    #[test]
    fn containers_are_recognized_by_what_their_engines_leave() {
        assert_eq!(on(&[], container), "no sign of one");
        assert_eq!(on(&[("/.dockerenv", "")], container), "Docker");
        assert_eq!(on(&[("/run/.containerenv", "")], container), "Podman");
        assert_eq!(on(&[("/proc/self/cgroup", "0::/kubepods.slice/x\n")], container), "Kubernetes");
        assert_eq!(on(&[("/run/systemd/container", "lxc\n")], container), "lxc");
    }

    #[test]
    fn mitigations_are_listed_if_the_kernel_knows_any() {
        const SPECTRE: &str = "/sys/devices/system/cpu/vulnerabilities/spectre_v2";
        const MELTDOWN: &str = "/sys/devices/system/cpu/vulnerabilities/meltdown";
        let some = [(SPECTRE, "Mitigation: Retpolines\n"), (MELTDOWN, "Not affected\n")];
        assert_eq!(on(&some, mitigations).unwrap(), "spectre_v2");
        assert_eq!(on(&[(SPECTRE, "Vulnerable\n")], mitigations).unwrap(), "none");
        assert_eq!(on(&[], mitigations), None);
    }

    #[test]
    fn unusual_lines_are_parsed() {
        assert_eq!(bracketed("always [madvise] never\n").unwrap(), "madvise");
        assert_eq!(bracketed("never"), None);
        assert_eq!(memory("MemTotal: 2621440 kB\n", "MemTotal").unwrap(), "2.5 GiB");
        assert_eq!(memory("MemTotal: 2621440 kB\n", "MemAvailable"), None);
        assert_eq!(load_average("0.10 0.20 0.30 1/99 4711\n").unwrap(), "0.10 0.20 0.30 (1, 5, 15 min)");
        assert_eq!(load_average("0.10 x 0.30"), None);
    }
}
