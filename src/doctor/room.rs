//! What the machine has for swarms: room, cores, and what the kernel permits.

use super::{Check, Grade};
use crate::real_time::may_lock_memory;
use ringwing_bus::{Capacity, Demand, Placement};
use ringwing_scenario::Scenario;
use std::{num::NonZero, thread};

/// The largest swarm that ringwing flies.
const UAVS_MAX: u32 = 1024;
/// The swarm of the paper. A machine without room for it is unfit.
const UAVS_OF_PAPER: u32 = 6;
/// A machine should have room for this many UAVs, the largest swarm of a whole benchmark. With more, machines that suffice
/// for nearly everybody are called limited; with fewer, the benchmark's last cases fail without a warning.
const UAVS_WANTED: u32 = 200;
/// With fewer cores, the processes of a swarm cannot even alternate with anything else that runs.
const CORES_WANTED: usize = 2;

/// How large a swarm may be, by shared memory, open files, processes and file sizes.
pub(super) fn check() -> Check {
    let capacity = Capacity::look();
    let uavs = largest_swarm(|uavs| lacks(&capacity, uavs).is_none());
    let grade = match uavs {
        0..UAVS_OF_PAPER => Grade::Unfit,
        UAVS_OF_PAPER..UAVS_WANTED => Grade::Limited,
        UAVS_WANTED.. => Grade::Fit,
    };
    let more = lacks(&capacity, uavs + 1).filter(|_| uavs < UAVS_MAX);
    let more = more.map(|lack| format!("; for more: {lack}")).unwrap_or_default();
    Check { name: "room", grade, finding: format!("for swarms of up to {uavs} UAVs, recorded{more}") }
}

/// What the machine lacks for a recorded flight of `uavs`.
fn lacks(capacity: &Capacity, uavs: u32) -> Option<String> {
    let mut scenario = Scenario::default();
    scenario.formation.uavs = uavs;
    capacity.admit(&Demand::of(&scenario, true)).err().map(|shortage| shortage.to_string())
}

/// The largest number of UAVs that fits, if each smaller one does, too; 0 if not even one fits.
fn largest_swarm(fits: impl Fn(u32) -> bool) -> u32 {
    let (mut most, mut least_refused) = (0, UAVS_MAX + 1);
    while least_refused - most > 1 {
        let middle = most.midpoint(least_refused);
        if fits(middle) {
            most = middle;
        } else {
            least_refused = middle;
        }
    }
    most
}

/// How many cores there are for the processes.
pub(super) fn check_cores() -> Check {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let (grade, advice) = if cores < CORES_WANTED {
        (Grade::Limited, ": any other program delays every tick, so fly in lockstep, not in real time")
    } else {
        (Grade::Fit, "")
    };
    Check { name: "cores", grade, finding: format!("{cores} usable{advice}") }
}

/// Whether `run --real-time --priority` gets what it asks for. Nothing else needs it, so the machine is fit without.
pub(super) fn check_real_time() -> Check {
    let refused = Placement { priority: Some(1), ..Placement::default() }.check().err();
    let priority = match &refused {
        None => "priorities are permitted".into(),
        Some(refusal) => {
            format!("priorities are not permitted ({}): raise `ulimit -r` for --priority", refusal.source)
        }
    };
    let memory = if may_lock_memory() {
        "memory can be locked"
    } else {
        "memory cannot be locked: set `ulimit -l unlimited` for --priority"
    };
    Check { name: "real time", grade: Grade::Fit, finding: format!("{priority}; {memory}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_bus::MemorySpace;

    #[test]
    fn the_largest_swarm_that_fits_is_found() {
        for limit in [0, 1, 5, 178, UAVS_MAX, UAVS_MAX + 7] {
            assert_eq!(largest_swarm(|uavs| uavs <= limit), limit.min(UAVS_MAX));
        }
    }

    #[test]
    fn a_small_shared_memory_limits_the_swarm_and_the_remedy_is_named() {
        let space = |megabytes: u64| MemorySpace { free: megabytes << 20, total: megabytes << 20 };
        let capacity = |megabytes| Capacity { memory: Some(space(megabytes)), ..Capacity::default() };
        let of_docker = largest_swarm(|uavs| lacks(&capacity(64), uavs).is_none());
        let of_more = largest_swarm(|uavs| lacks(&capacity(128), uavs).is_none());
        assert!(
            (UAVS_OF_PAPER..UAVS_MAX).contains(&of_docker) && of_docker < of_more,
            "{of_docker} {of_more}"
        );
        assert!(lacks(&capacity(64), of_docker + 1).unwrap().contains("--shm-size"));
    }
}
