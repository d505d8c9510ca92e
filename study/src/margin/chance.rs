//! Whether the seed of a scenario has any influence on its flight.
//!
//! Never claims that a flight is the same under all seeds unless it is: whatever is not known here counts as drawn.

use ringwing_scenario::{
    Scenario,
    fault::{Action, Delay, LinkImpairment, ProcessFault, Targets},
};

/// Whether flights of `scenario` with different seeds may differ.
pub(super) fn depends_on_seed(scenario: &Scenario) -> bool {
    scenario.start.uavs.is_empty()
        || !scenario.obstacle_field.is_empty()
        || scenario.wind.turbulence_m_s > 0.0
        || scenario.sensors.are_random()
        || has_noisy_senses(scenario)
        || scenario.faults.iter().any(|fault| draws(&fault.action))
}

/// Whether reports of other aircraft have errors or get lost. Only a collision filter uses them.
fn has_noisy_senses(scenario: &Scenario) -> bool {
    let sensing = &scenario.sensing;
    let draws =
        [sensing.traffic_loss, sensing.traffic_noise_m, sensing.traffic_noise_deg, sensing.radar_noise_m];
    scenario.control.collision_filter && draws != [0.0; 4]
}

fn draws(action: &Action) -> bool {
    match action {
        Action::Link { impairment, .. } => !matches!(
            impairment,
            LinkImpairment::Delay(Delay::Constant { .. } | Delay::Trace(_))
                | LinkImpairment::Blackout
                | LinkImpairment::Hold
                | LinkImpairment::Stuck
                | LinkImpairment::Bias { .. }
        ),
        Action::Process { fault, targets } => {
            matches!(targets, Targets::Random(_)) || matches!(fault, ProcessFault::Flap { .. })
        }
        Action::Heal(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::fly;
    use ringwing_scenario::{Source, preset};

    #[test]
    fn presets_whose_flights_do_not_depend_on_the_seed_are_known() {
        for name in preset::all().iter().map(|preset| preset.name) {
            let mut scenario = Scenario::read(&Source::find(name).unwrap(), &[]).unwrap();
            scenario.time.duration_s = 35.0;
            let hash = |seed: u64| {
                fly(&Scenario { seed, ..scenario.clone() }).unwrap().payload_hash().unwrap().to_owned()
            };
            // A flight that depends on chance need not differ, but one that does not must not.
            if !depends_on_seed(&scenario) {
                assert_eq!(hash(1), hash(2), "{name}");
            }
        }
    }

    #[test]
    fn drawn_starts_and_fields_gusts_noisy_senses_and_lossy_links_depend_on_the_seed() {
        let mut scenario = Scenario::read(&Source::find("paper-4.1").unwrap(), &[]).unwrap();
        assert!(!depends_on_seed(&scenario));
        scenario.faults = vec!["at 1 s link all->all loss 1 %".parse().unwrap()];
        assert!(depends_on_seed(&scenario));
        scenario.faults = vec!["at 1 s link all->all delay 1 s".parse().unwrap()];
        assert!(!depends_on_seed(&scenario));
        let changed = |change: fn(&mut Scenario)| {
            let mut changed = scenario.clone();
            change(&mut changed);
            depends_on_seed(&changed)
        };
        assert!(changed(|s| s.start.uavs.clear()));
        assert!(changed(|s| s.obstacle_field.circles = 1));
        assert!(changed(|s| s.wind.turbulence_m_s = 7.7), "the seed decides the gusts");
        assert!(changed(|s| s.sensors.heading_noise_deg = 1.0));
        assert!(!changed(|s| s.sensors.heading_rate_hz = 10.0));
        assert!(!changed(|s| s.sensing.radar_noise_m = 1.0), "nobody looks");
        assert!(changed(|s| (s.control.collision_filter, s.sensing.radar_noise_m) = (true, 1.0)));
    }
}
