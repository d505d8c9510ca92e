//! Stops a case with all its processes, and lets them go on: for the terminal's Ctrl-Z, which reaches the benchmark alone.
//!
//! Must never end a process. A case that stood still says nothing about the transport, so it has to be measured again.

use crate::proc_files::parent_of;
use rustix::process::{Pid, Signal, kill_process};
use std::fs;

/// The processes of a case that stand still, in the order in which they were stopped.
pub(crate) struct StoppedCase(Vec<u32>);

impl StoppedCase {
    /// Stops the process `case`, and whatever it has started.
    pub(crate) fn stop(case: u32) -> Self {
        let mut stopped = Vec::new();
        loop {
            // A process may have started another one before it was stopped itself, so look again until there is no new one.
            let running: Vec<u32> =
                family(case).into_iter().filter(|process| !stopped.contains(process)).collect();
            if running.is_empty() {
                return Self(stopped);
            }
            for process in &running {
                send(*process, Signal::STOP);
            }
            stopped.extend(running);
        }
    }

    /// Lets them go on: the last one first, so that whoever waits for another finds it running.
    pub(crate) fn go_on(self) {
        for process in self.0.into_iter().rev() {
            send(process, Signal::CONT);
        }
    }
}

/// `root` and all its descendants, parents before their children.
fn family(root: u32) -> Vec<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let processes = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let parents: Vec<(u32, u32)> =
        processes.filter_map(|process| Some((process, parent_of(process)?))).collect();
    let mut family = vec![root];
    let mut next = 0;
    while let Some(parent) = family.get(next).copied() {
        family.extend(parents.iter().filter(|(_, its)| *its == parent).map(|(process, _)| *process));
        next += 1;
    }
    family
}

fn send(process: u32, signal: Signal) {
    if let Some(pid) = Pid::from_raw(process.cast_signed()) {
        // It may have ended meanwhile.
        let _ = kill_process(pid, signal);
    }
}
