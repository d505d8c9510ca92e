//! The checks that a controller has to pass: what each asks, in which flight, and what the flight has to show.
//!
//! Never knows the controller: every check is the same for all of them.

use super::findings::Findings;
use ringwing_scenario::{Fault, Reading, Scenario, ScenarioError, Setting, Source};

/// Largest slot error at the end of a flight that counts as in formation. More lets a controller pass that never forms the ring;
/// less fails laws that end with a small constant error.
const IN_FORMATION_M: f64 = 1.0;

/// What a flight has to show, besides answers: finite numbers in each tick, from each controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Demand {
    /// Answers, whatever the UAVs fly.
    Answers,
    /// In formation, no wish is cut to the airframe's limits.
    Limits,
    /// A second flight is the same to the bit.
    Repeats,
    /// All six UAVs are in their slots at the end, and none has collided.
    Ring,
    /// This number of UAVs is in their slots again at the end.
    Recovers(usize),
}

/// One question about a controller, and the flight that answers it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Check {
    /// Names the check, its flight and its folder.
    pub(super) name: &'static str,
    /// What it asks, as the end of "whether a controller ...".
    pub(super) asks: &'static str,
    /// What the flight has to show.
    pub(super) demand: Demand,
    /// Length of the flight.
    duration_s: f64,
    /// Keys of the scenario that differ from their defaults.
    settings: &'static [&'static str],
    /// What happens to the swarm.
    faults: &'static [&'static str],
}

/// The checks, in the order in which they are flown. The first one decides whether the others are flown.
pub(super) const CHECKS: [Check; 14] = [
    Check::of("answers", "decides in every tick", Demand::Answers, 20.0),
    Check::of("limits", "wishes nothing in formation that the airframe cannot fly", Demand::Limits, 45.0),
    Check::of("repeats", "decides the same in a second flight", Demand::Repeats, 20.0),
    Check::of("ring", "forms the ring without a collision", Demand::Ring, 45.0),
    Check::of("delayed", "recovers from neighbours half a second late", Demand::Recovers(6), 45.0)
        .fault(&["at 15 s link all->all delay 500 ms for 10 s"]),
    Check::of("lossy", "recovers from the loss of 60 % of all states", Demand::Recovers(6), 45.0)
        .fault(&["at 15 s link all loss 60 % for 10 s"]),
    Check::of("frozen", "recovers from a neighbour frozen for 3 s", Demand::Recovers(6), 50.0)
        .fault(&["at 15 s freeze uav 2 for 3 s"]),
    Check::of("restarted", "recovers from a neighbour that is killed and returns", Demand::Recovers(6), 60.0)
        .fault(&["at 15 s restart uav 2 after 2 s"]),
    Check::of("killed", "closes the ring after a neighbour is lost", Demand::Recovers(5), 50.0)
        .fault(&["at 15 s kill uav 3"]),
    Check::of("silence", "decides while nothing is heard of anybody", Demand::Answers, 10.0)
        .fault(&["at 0 s link all blackout"]),
    Check::of("alone", "decides after all other UAVs are lost", Demand::Answers, 10.0)
        .fault(&["at 2 s kill uav 2,3,4,5,6"]),
    Check::of("far", "decides a thousand kilometres from its slot", Demand::Answers, 5.0)
        .with(&["start.draw.ahead_radii=-25000"]),
    Check::of("crowd", "decides among more aircraft than it senses", Demand::Answers, 10.0)
        .with(&["formation.uavs=12", "control.collision_filter=true"]),
    Check::of("inside", "decides inside an obstacle that comes over the swarm", Demand::Answers, 15.0).with(&[
        "obstacles=[{ name = \"Cloud\", position_m = [400.0, 0.0], radius_m = 150.0, braking_distance_m = 200.0, \
         velocity_m_s = [-20.0, 0.0] }]",
    ]),
];

impl Check {
    const fn of(name: &'static str, asks: &'static str, demand: Demand, duration_s: f64) -> Self {
        Self { name, asks, demand, duration_s, settings: &[], faults: &[] }
    }

    const fn with(self, settings: &'static [&'static str]) -> Self {
        Self { settings, ..self }
    }

    const fn fault(self, faults: &'static [&'static str]) -> Self {
        Self { faults, ..self }
    }

    /// What to fly.
    pub(super) fn scenario(&self) -> Result<Scenario, ScenarioError> {
        let source = Source {
            name: format!("check {}", self.name),
            text: format!(
                // The ring closes after a loss, as users of several UAVs expect, and data are predicted.
                "name = {:?}\ntime.duration_s = {:?}\ncontrol.law = \"resilient\"\n",
                self.name, self.duration_s
            ),
        };
        let settings: Vec<Setting> =
            self.settings.iter().filter_map(|text| Setting::parse(text).ok()).collect();
        let faults: Vec<Fault> = self.faults.iter().filter_map(|sentence| sentence.parse().ok()).collect();
        Ok(Reading::read(&source, &settings)?.with_faults(&faults)?.scenario)
    }

    /// Why the flight does not show what it has to; empty if it does.
    pub(super) fn reasons(&self, found: &Findings) -> Vec<String> {
        let mut reasons = found.failures.clone();
        match self.demand {
            Demand::Answers => {}
            Demand::Limits => reasons.extend(found.cut.clone()),
            Demand::Repeats => reasons.extend(found.difference.clone()),
            Demand::Ring => {
                reasons.extend(found.collisions.iter().cloned());
                reasons.extend(out_of_formation(found, 6));
            }
            Demand::Recovers(flying) => reasons.extend(out_of_formation(found, flying)),
        }
        reasons
    }
}

/// Why the UAVs are not in formation at the end, if as many as `flying` have to be.
fn out_of_formation(found: &Findings, flying: usize) -> Option<String> {
    if found.commanded < flying {
        return Some(format!("at the end, {} of {flying} UAVs fly on command", found.commanded));
    }
    match found.slot_error_max_m {
        None => Some("at the end, no UAV knows its slot".into()),
        Some(error_m) if error_m <= IN_FORMATION_M => None,
        Some(error_m) => {
            Some(format!("at the end, a UAV is {error_m:.1} m from its slot; {IN_FORMATION_M} m is allowed"))
        }
    }
}
