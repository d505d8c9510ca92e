//! What processes use, as the kernel counts it: sums and differences.
//!
//! Must never read anything: [`proc_files`](crate::proc_files) does.

use serde::{Deserialize, Serialize};
use std::{
    iter::Sum,
    ops::{Add, Sub},
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
    /// Seconds in user mode and in the kernel: the exact CPU time, split in the ratio of the timer ticks.
    pub(crate) fn user_and_system_s(&self) -> (f64, f64) {
        let (user, system) = (self.user_ticks as f64, self.system_ticks as f64);
        let total_s = self.run_ns as f64 / 1e9;
        // Processes that no timer tick has found at work used next to nothing: count it as user time.
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

/// The usage between two readings. The figures of a process that ended in between are gone, so a difference is never
/// below 0.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figures_of_a_process_that_ended_do_not_become_negative() {
        let before = ProcessUsage { run_ns: 5, ..ProcessUsage::default() };
        assert_eq!(ProcessUsage::default() - before, ProcessUsage::default());
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
