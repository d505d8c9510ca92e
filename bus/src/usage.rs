//! What processes have used so far, as the kernel counts it.
//!
//! Never fails: of a process that is gone, or whose figures are not readable, nothing is known and nothing added.

use serde::{Deserialize, Serialize};
use std::{
    fs,
    iter::Sum,
    ops::{Add, Sub},
    path::{Path, PathBuf},
};

/// What processes used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Used {
    /// Time on a processor, to the nanosecond.
    pub run_ns: u64,
    /// Timer ticks that found it in user mode: a sample of where the time went.
    pub user_ticks: u64,
    /// Timer ticks that found it in the kernel.
    pub system_ticks: u64,
    /// Context switches that it asked for by waiting.
    pub voluntary_switches: u64,
    /// Context switches that the kernel forced.
    pub involuntary_switches: u64,
}

impl Used {
    /// What `process` has used so far, in all its threads.
    pub fn by(process: u32) -> Self {
        let folder = Path::new("/proc").join(process.to_string());
        let (user_ticks, system_ticks) = ticks(&folder);
        let threads = fs::read_dir(folder.join("task")).into_iter().flatten().flatten();
        let of_threads: Self = threads.map(|thread| of_thread(&thread.path())).sum();
        Self { user_ticks, system_ticks, ..of_threads }
    }

    /// What all `processes` have used so far.
    pub fn by_all(processes: &[u32]) -> Self {
        processes.iter().map(|process| Self::by(*process)).sum()
    }

    /// Time in user mode and in the kernel: the exact time, shared out as the timer's ticks say.
    pub fn user_and_system_s(&self) -> (f64, f64) {
        let (user, system) = (self.user_ticks as f64, self.system_ticks as f64);
        let total_s = self.run_ns as f64 / 1e9;
        let share = if user + system > 0.0 { user / (user + system) } else { 1.0 };
        (total_s * share, total_s * (1.0 - share))
    }
}

impl Add for Used {
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

/// What was used since; a process that has ended meanwhile counts as one that used nothing.
impl Sub for Used {
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

impl Sum for Used {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// The proportional set size of `process`: what it has for itself, and its share of what it shares.
pub fn pss_bytes(process: u32) -> u64 {
    let path: PathBuf = ["/proc", &process.to_string(), "smaps_rollup"].iter().collect();
    number_after(&fs::read_to_string(path).unwrap_or_default(), "Pss:") * 1024
}

fn of_thread(folder: &Path) -> Used {
    let run = fs::read_to_string(folder.join("schedstat")).unwrap_or_default();
    let status = fs::read_to_string(folder.join("status")).unwrap_or_default();
    Used {
        run_ns: run.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or_default(),
        voluntary_switches: number_after(&status, "voluntary_ctxt_switches:"),
        involuntary_switches: number_after(&status, "nonvoluntary_ctxt_switches:"),
        ..Used::default()
    }
}

/// The number in the line of `text` that begins with `key`.
fn number_after(text: &str, key: &str) -> u64 {
    let value = text.lines().find_map(|line| line.strip_prefix(key));
    value.and_then(|value| value.split_whitespace().next()?.parse().ok()).unwrap_or_default()
}

/// Fields 14 and 15 of `stat`; the name in field 2 may have spaces and brackets in it.
fn ticks(folder: &Path) -> (u64, u64) {
    let text = fs::read_to_string(folder.join("stat")).unwrap_or_default();
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
    fn work_shows() {
        // Another process: threads of this one come and go with other tests, and take what they used along.
        let mut worker = Command::new("sh")
            .args(["-c", "while :; do sleep 0.001; done"])
            .spawn()
            .expect("there is a shell");
        let before = Used::by(worker.id());
        let (begin, mut used) = (Instant::now(), Used::default());
        while (used.run_ns == 0 || used.voluntary_switches == 0) && begin.elapsed().as_secs() < 30 {
            thread::sleep(Duration::from_millis(5));
            used = Used::by(worker.id()) - before;
        }
        let pss_bytes = pss_bytes(worker.id());
        worker.kill().unwrap();
        worker.wait().unwrap();
        assert!(used.run_ns > 0 && used.voluntary_switches > 0, "{used:?}");
        assert!(pss_bytes > 4096, "{pss_bytes}");
    }

    #[test]
    fn a_process_that_is_gone_used_nothing() {
        assert_eq!(Used::by(u32::MAX), Used::default());
        assert_eq!(Used::default() - Used { run_ns: 5, ..Used::default() }, Used::default());
    }

    #[test]
    fn exact_time_is_shared_out_by_the_ticks() {
        let used = Used { run_ns: 4_000_000_000, user_ticks: 1, system_ticks: 3, ..Used::default() };
        assert_eq!(used.user_and_system_s(), (1.0, 3.0));
        assert_eq!(Used { run_ns: 1_000_000_000, ..Used::default() }.user_and_system_s(), (1.0, 0.0));
    }
}
