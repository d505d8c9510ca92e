//! On which cores the processes of a run fly.
//!
//! Must never slow down a program of the user's, nor give a process of a flight in real time one core for good: there the user
//! decides.

use ringwing_bus::{Cores, IdleCores, Placement};
use ringwing_scenario::{Scenario, Wake};

/// The largest swarm that leaves a core to the recorder. A larger one would start later, because its processes start on
/// one core, and would fly no faster. A smaller limit gives the gain away in swarms that have it.
const UAVS_MAX: u32 = 16;

/// Where the world, the leader and the agents of a recorded flight of `scenario` run on a machine with so many usable
/// `cores`, if the user has `asked` for this placement.
///
/// A recorder needs about as much processor time per tick as a small swarm. If both share two cores, it keeps some of the
/// agents waiting in each tick, and the world waits for those. If the swarm keeps to one core, both work at full speed. The
/// recorder itself stays free to move: beside a busy program, the kernel then finds the better core for it.
pub(super) fn beside_a_recorder(scenario: &Scenario, asked: Placement, cores: u32) -> Placement {
    if keeps_together(scenario, asked, cores) {
        // By the number of this process, so that runs beside one another tend to use different cores.
        Placement { cores: Cores::Same(std::process::id() as usize), priority: None }
    } else {
        asked
    }
}

/// How many threads help idle cores to take over processes from busy ones in a flight of `scenario` on a machine with so many
/// usable `cores`, if the user has `asked` for this placement.
pub(super) fn idle_core_threads(scenario: &Scenario, asked: Placement, cores: u32) -> u32 {
    // Pinned processes have the core that the user wants. Linux moves those of the real-time class by itself, and at once.
    if asked == Placement::default() { IdleCores::count(scenario, cores) } else { 0 }
}

/// Whether the swarm keeps to one core.
fn keeps_together(scenario: &Scenario, asked: Placement, cores: u32) -> bool {
    let is_lockstep = !scenario.time.real_time && scenario.ipc.wake != Wake::Spin;
    let is_light = scenario.formation.uavs <= UAVS_MAX && scenario.first_own_agent().is_none();
    cores == 2 && asked == Placement::default() && is_lockstep && is_light
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::AgentSection;

    const NOTHING: Placement = Placement { cores: Cores::All, priority: None };

    #[test]
    fn a_small_swarm_of_built_in_agents_in_lockstep_keeps_together_on_two_cores() {
        let scenario = Scenario::default();
        assert!(keeps_together(&scenario, NOTHING, 2));
        assert!(!keeps_together(&scenario, NOTHING, 1) && !keeps_together(&scenario, NOTHING, 3));
    }

    #[test]
    fn what_the_user_asks_for_comes_first() {
        let pinned = Placement { cores: Cores::OneEach, ..NOTHING };
        let urgent = Placement { priority: Some(1), ..NOTHING };
        for asked in [pinned, urgent] {
            assert_eq!(beside_a_recorder(&Scenario::default(), asked, 2), asked);
        }
    }

    #[test]
    fn a_crowd_shares_idle_cores_unless_the_user_asks_for_another_placement() {
        let mut crowd = Scenario::default();
        (crowd.formation.uavs, crowd.time.real_time) = (100, true);
        assert_eq!(idle_core_threads(&crowd, NOTHING, 2), 2);
        assert_eq!(idle_core_threads(&Scenario::default(), NOTHING, 2), 0);
        for asked in
            [Placement { cores: Cores::OneEach, ..NOTHING }, Placement { priority: Some(1), ..NOTHING }]
        {
            assert_eq!(idle_core_threads(&crowd, asked, 2), 0, "{asked:?}");
        }
    }

    #[test]
    fn all_others_use_all_cores() {
        let changes: [fn(&mut Scenario); 4] = [
            |scenario| scenario.time.real_time = true,
            |scenario| scenario.ipc.wake = Wake::Spin,
            |scenario| scenario.formation.uavs = UAVS_MAX + 1,
            |scenario| scenario.agents.push(AgentSection::parse("1=own").unwrap()),
        ];
        for (number, change) in changes.iter().enumerate() {
            let mut scenario = Scenario::default();
            change(&mut scenario);
            assert!(!keeps_together(&scenario, NOTHING, 2), "change {number}");
        }
    }
}
