//! Reads from `/proc` what processes have used so far.
//!
//! Must never fail: a process that is gone, or whose figures are unreadable, counts as having used nothing.

use crate::usage::ProcessUsage;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// What `process` has used so far, in all its threads.
pub(crate) fn usage_of(process: u32) -> ProcessUsage {
    let folder = Path::new("/proc").join(process.to_string());
    let (user_ticks, system_ticks) = timer_ticks(&folder);
    // `stat` counts all threads of the process, but `schedstat` and `status` only one: add those up.
    let threads = fs::read_dir(folder.join("task")).into_iter().flatten().flatten();
    let of_threads: ProcessUsage = threads.map(|thread| of_thread(&thread.path())).sum();
    ProcessUsage { user_ticks, system_ticks, ..of_threads }
}

/// The proportional set size of `process` in bytes: its private memory, and its share of memory that others map, too.
pub(crate) fn pss_bytes(process: u32) -> u64 {
    let path: PathBuf = ["/proc", &process.to_string(), "smaps_rollup"].iter().collect();
    number_after(&fs::read_to_string(path).unwrap_or_default(), "Pss:") * 1024
}

/// The process that started `process`, or took it over; `None` if it is gone.
pub(crate) fn parent_of(process: u32) -> Option<u32> {
    let text = fs::read_to_string(Path::new("/proc").join(process.to_string()).join("stat")).ok()?;
    fields_of(&text).nth(1)?.parse().ok()
}

/// The fields of a process's `stat` from the third one on.
fn fields_of(stat: &str) -> impl Iterator<Item = &str> {
    // Field 2 is the program's name in parentheses, and may itself contain spaces and parentheses.
    stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace()
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

/// The number after `key` in the line of `text` that begins with it; 0 if no line does.
fn number_after(text: &str, key: &str) -> u64 {
    let value = text.lines().find_map(|line| line.strip_prefix(key));
    value.and_then(|value| value.split_whitespace().next()?.parse().ok()).unwrap_or_default()
}

/// Timer ticks in user mode and in the kernel: fields 14 and 15 of `stat`.
fn timer_ticks(folder: &Path) -> (u64, u64) {
    let text = fs::read_to_string(folder.join("stat")).unwrap_or_default();
    // Field 14 comes after eleven others.
    let mut ticks = fields_of(&text).skip(11).map(|field| field.parse().unwrap_or_default());
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
    fn the_work_of_a_process_is_counted() {
        // A process of its own: threads of this one end with other tests, and their figures with them.
        let mut worker =
            Command::new("sh").args(["-c", "while :; do sleep 0.001; done"]).spawn().expect("a shell starts");
        let before = usage_of(worker.id());
        let (begin, mut used) = (Instant::now(), ProcessUsage::default());
        while (used.run_ns == 0 || used.voluntary_switches == 0) && begin.elapsed().as_secs() < 30 {
            thread::sleep(Duration::from_millis(5));
            used = usage_of(worker.id()) - before;
        }
        let pss_bytes = pss_bytes(worker.id());
        worker.kill().unwrap();
        worker.wait().unwrap();
        assert!(used.run_ns > 0 && used.voluntary_switches > 0, "{used:?}");
        assert!(pss_bytes > 4096, "{pss_bytes}");
    }

    #[test]
    fn a_process_that_is_gone_counts_as_having_used_nothing() {
        assert_eq!(usage_of(u32::MAX), ProcessUsage::default());
    }
}
