//! The limit of the formation's force: with it, swarms form no later than under the paper's law, wherever they start.

use crate::support::{scenario, slot_error_max_m};
use ringwing_scenario::Scenario;
use ringwing_simulation::Simulation;

/// Formed is when every slot error stays below this.
const FORMED_M: f64 = 1.0;
/// How long it has to stay so.
const STAYS_S: f64 = 5.0;

/// How long the swarm of `scenario` takes to form; infinite if it does not.
fn forming_time_s(scenario: &Scenario) -> f64 {
    let mut simulation = Simulation::new(scenario).unwrap();
    let mut broken_s = 0.0;
    while simulation.step() {
        let now_s = simulation.now().0 as f64 * scenario.period_s();
        if slot_error_max_m(&simulation) >= FORMED_M {
            broken_s = now_s;
        } else if now_s - broken_s > STAYS_S {
            return broken_s;
        }
    }
    f64::INFINITY
}

/// The median of the times that swarms with these settings take to form, over `draws` of their starts. A period of 0.05 s is
/// short enough for the law, and five times as fast to fly as the usual one.
fn median_forming_time_s(law: &str, settings: &[&str], draws: u32) -> f64 {
    let forming_time_s = |seed: u32| {
        let seed = format!("seed={seed}");
        forming_time_s(&scenario(law, &[&["rate_hz=20", seed.as_str()], settings].concat()))
    };
    let mut times: Vec<f64> = (600_001..=600_000 + draws).map(forming_time_s).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[test]
fn no_swarm_takes_longer_to_form_than_under_the_papers_law() {
    let near_v_min = ["leader.speed_m_s=13"];
    let near_v_max = ["leader.speed_m_s=22"];
    let (ahead, far_ahead) = (["ahead_radii=10"], ["ahead_radii=50"]);
    let cases: [(&[&str], u32); 7] = [
        (&[], 21),
        (&near_v_min, 11),
        (&near_v_max, 11),
        (&ahead, 11),
        (&far_ahead, 11),
        (&["uavs=12"], 11),
        (&["uavs=24"], 5),
    ];
    for (settings, draws) in cases {
        let [paper_s, limited_s] =
            ["paper", "resilient"].map(|law| median_forming_time_s(law, settings, draws));
        assert!(limited_s <= paper_s, "{settings:?}: {limited_s} s instead of {paper_s} s");
    }
}

#[test]
fn a_swarm_far_behind_catches_up_as_soon_as_under_the_papers_law() {
    // Whoever is far behind flies straight at its largest speed under both laws. Only the last metres differ, because G fades. The
    // collision filter would add to them, as UAVs with slots by number cross.
    let settings = ["ahead_radii=-20", "collision_filter=false"];
    let [paper_s, limited_s] = ["paper", "resilient"].map(|law| median_forming_time_s(law, &settings, 11));
    assert!(limited_s < 1.02 * paper_s, "{limited_s} s instead of {paper_s} s");
}
