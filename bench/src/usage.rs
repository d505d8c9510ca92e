//! What processes have used so far, as the kernel counts it.
//!
//! Must never fail: a process that is gone, or whose figures are unreadable, counts as having used nothing.

use serde::{Deserialize, Serialize};
use std::{
    fs,
    iter::Sum,
    ops::{Add, Sub},
    path::{Path, PathBuf},
};

/// What processes used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ProcessUsage {
    /// CPU time, exact to the nanosecond.
    pub(crate) run_ns: u64,
    /// Timer ticks that found the process in user mode: a sample of how its CPU time splits.
    pub(crate) user_ticks: u64,
    /// Timer ticks that found the process in the kernel.
    pub(crate) system_ticks: u64,
    /// Context switches because the process waited for something.
    pub(crate) voluntary_switches: u64,
    /// Context switches that the kernel forced.
    pub(crate) involuntary_switches: u64,
}

impl ProcessUsage {
    /// What `process` has used so far, in all its threads.
    pub(crate) fn of(process: u32) -> Self {
        let folder = Path::new("/proc").join(process.to_string());
        let (user_ticks, system_ticks) = timer_ticks(&folder);
        let threads = fs::read_dir(folder.join("task")).into_iter().flatten().flatten();
        let of_threads: Self = threads.map(|thread| of_thread(&thread.path())).sum();
        Self { user_ticks, system_ticks, ..of_threads }
    }

    /// What all `processes` together have used so far.
    pub(crate) fn of_all(processes: impl Iterator<Item = u32>) -> Self {
        processes.map(Self::of).sum()
    }

    /// Seconds in user mode and in the kernel: the exact CPU time, split in the ratio of the timer ticks.
    pub(crate) fn user_and_system_s(&self) -> (f64, f64) {
        let (user, system) = (self.user_ticks as f64, self.system_ticks as f64);
        let total_s = self.run_ns as f64 / 1e9;
        let user_share = if user + system > 0.0 { user / (user + system) } else { 1.0 };
        (total_s * user_share, total_s * (1.0 - user_share))
    }
}

impl Add for ProcessUsage {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            run_ns: self.run_ns + other.run_ns,
            user_ticks: self.user_ticks + other.user_ticks,
            system_ticks: self.system_ticks + other.system_ticks,
            voluntary_switches: self.voluntary_switches + other.voluntary_switches,
            involuntary_switches: self.involuntary_switches + other.involuntary_switches,
        }
    }
}

/// What was used in between. The figures of a process that ended meanwhile are gone, so differences stop at 0.
impl Sub for ProcessUsage {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            run_ns: self.run_ns.saturating_sub(before.run_ns),
            user_ticks: self.user_ticks.saturating_sub(before.user_ticks),
            system_ticks: self.system_ticks.saturating_sub(before.system_ticks),
            voluntary_switches: self.voluntary_switches.saturating_sub(before.voluntary_switches),
            involuntary_switches: self.involuntary_switches.saturating_sub(before.involuntary_switches),
        }
    }
}

impl Sum for ProcessUsage {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// The proportional set size of `process` in bytes: its private memory, and its share of memory that others map, too.
pub(crate) fn pss_bytes(process: u32) -> u64 {
    let path: PathBuf = ["/proc", &process.to_string(), "smaps_rollup"].iter().collect();
    number_after(&fs::read_to_string(path).unwrap_or_default(), "Pss:") * 1024
}

fn of_thread(folder: &Path) -> ProcessUsage {
    let run = fs::read_to_string(folder.join("schedstat")).unwrap_or_default();
    let status = fs::read_to_string(folder.join("status")).unwrap_or_default();
    ProcessUsage {
        run_ns: run.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or_default(),
        voluntary_switches: number_after(&status, "voluntary_ctxt_switches:"),
        involuntary_switches: number_after(&status, "nonvoluntary_ctxt_switches:"),
        ..ProcessUsage::default()
    }
}

/// The number after `key` in the line of `text` that begins with it; 0 if there is none.
fn number_after(text: &str, key: &str) -> u64 {
    let value = text.lines().find_map(|line| line.strip_prefix(key));
    value.and_then(|value| value.split_whitespace().next()?.parse().ok()).unwrap_or_default()
}

/// Timer ticks in user mode and in the kernel: fields 14 and 15 of `stat`.
fn timer_ticks(folder: &Path) -> (u64, u64) {
    let text = fs::read_to_string(folder.join("stat")).unwrap_or_default();
    // Field 2 is the program's name in parentheses, and may itself contain spaces and parentheses.
    let fields = text.rsplit_once(')').map_or("", |(_, rest)| rest);
    let mut ticks = fields.split_whitespace().skip(11).map(|field| field.parse().unwrap_or_default());
    (ticks.next().unwrap_or_default(), ticks.next().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        process::Command,
        thread,
        time::{Duration, Instant},
    };

    #[test]
    fn work_counts() {
        // A process of its own: threads of this one end with other tests, and their figures with them.
        let mut worker =
            Command::new("sh").args(["-c", "while :; do sleep 0.001; done"]).spawn().expect("a shell starts");
        let before = ProcessUsage::of(worker.id());
        let (begin, mut used) = (Instant::now(), ProcessUsage::default());
        while (used.run_ns == 0 || used.voluntary_switches == 0) && begin.elapsed().as_secs() < 30 {
            thread::sleep(Duration::from_millis(5));
            used = ProcessUsage::of(worker.id()) - before;
        }
        let pss_bytes = pss_bytes(worker.id());
        worker.kill().unwrap();
        worker.wait().unwrap();
        assert!(used.run_ns > 0 && used.voluntary_switches > 0, "{used:?}");
        assert!(pss_bytes > 4096, "{pss_bytes}");
    }

    #[test]
    fn a_process_that_is_gone_counts_as_having_used_nothing() {
        assert_eq!(ProcessUsage::of(u32::MAX), ProcessUsage::default());
        assert_eq!(
            ProcessUsage::default() - ProcessUsage { run_ns: 5, ..ProcessUsage::default() },
            ProcessUsage::default()
        );
    }

    #[test]
    fn exact_time_is_split_in_the_ratio_of_timer_ticks() {
        let used =
            ProcessUsage { run_ns: 4_000_000_000, user_ticks: 1, system_ticks: 3, ..ProcessUsage::default() };
        assert_eq!(used.user_and_system_s(), (1.0, 3.0));
        assert_eq!(
            ProcessUsage { run_ns: 1_000_000_000, ..ProcessUsage::default() }.user_and_system_s(),
            (1.0, 0.0)
        );
    }
}
