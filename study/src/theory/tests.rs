use super::*;
use nalgebra::Vector2;
use ringwing_flight::UavId;
use ringwing_scenario::StartState;
use ringwing_simulation::{Frames, Simulation};

/// The swarm of the paper's Section 4 with n UAVs, in continuous time.
fn swarm(uavs: u32) -> Linearised {
    let mut scenario = Scenario::default();
    scenario.formation.uavs = uavs;
    Linearised { tick_s: 0.0, ..Linearised::of(&scenario) }
}

/// Whether the swarm is stable at this delay; the rest is followed there from short delays.
fn stands(swarm: &Linearised, late: Late, delay_s: f64) -> bool {
    let mut at = Vec::new();
    for part in 1..=20 {
        match rest(swarm, late, delay_s * f64::from(part) / 20.0, &at) {
            Some(found) => at = found,
            None => return false,
        }
    }
    is_stable(swarm, &Stiffness::new(swarm, late, delay_s, &at), late, delay_s)
}

// The margins of an independent prototype. Tolerances are what its rounding leaves open.

#[test]
fn margins_of_late_neighbours_are_those_of_an_independent_prototype() {
    for (uavs, held_s, reckoned_s, tolerance_s, bound_s) in [
        (3, 1.2, 0.4, 0.05, 0.47),
        (6, 1.1, 0.36, 0.005, 0.45),
        (8, 1.4, 0.3, 0.05, 0.41),
        (12, 1.0, 0.3, 0.05, 0.35),
    ] {
        let swarm = swarm(uavs);
        let near = |late, margin_s: f64, tolerance_s: f64| {
            assert!(stands(&swarm, late, margin_s - tolerance_s), "{uavs} UAVs, {late:?}: unstable below");
            assert!(!stands(&swarm, late, margin_s + tolerance_s), "{uavs} UAVs, {late:?}: stable above");
        };
        near(Late::NeighboursHeld, held_s, 0.05);
        near(Late::NeighboursReckoned, reckoned_s, tolerance_s);
        let bound = swarm.bound_s(Late::NeighboursReckoned).unwrap();
        assert!((bound - bound_s).abs() < 0.005, "{uavs} UAVs: {bound}");
    }
}

#[test]
fn margins_of_own_data_are_those_of_independent_calculations() {
    // Headings: a prototype with steps of a tenth of a millisecond; roots by Newton's method: 79.97 ms for six. States: the
    // turns of the determinant in NumPy, to 0.02 ms.
    for (uavs, state_ms, heading_ms) in
        [(3, 69.94, 78.4), (6, 74.82, 79.9), (8, 72.38, 78.7), (12, 69.43, 77.2)]
    {
        let swarm = swarm(uavs);
        for (late, margin_ms) in [(Late::OwnState, state_ms), (Late::OwnHeading, heading_ms)] {
            assert!(stands(&swarm, late, 1e-3 * (margin_ms - 0.15)), "{uavs} UAVs, {late:?}: unstable below");
            assert!(!stands(&swarm, late, 1e-3 * (margin_ms + 0.15)), "{uavs} UAVs, {late:?}: stable above");
        }
    }
}

#[test]
fn a_margin_is_where_stability_ends() {
    let swarm = swarm(3);
    for late in Late::ALL {
        let margin_s = swarm.margin_s(late).unwrap();
        assert!(
            stands(&swarm, late, 0.999 * margin_s) && !stands(&swarm, late, 1.001 * margin_s),
            "{late:?}"
        );
    }
}

#[test]
fn one_late_heading_has_the_margin_of_a_loop_that_is_known() {
    // Without a formation, the heading obeys s + v_d e^(-sT) = 0 as soon as the slots pull weakly: T = pi / (2 v_d).
    let swarm = Linearised { formation_gain: 1e-3, slot_gain: 1e-3, ..swarm(3) };
    let margin_s = swarm.margin_s(Late::OwnHeading).unwrap();
    assert!((margin_s - std::f64::consts::PI / 30.0).abs() < 1e-4, "{margin_s}");
}

#[test]
fn a_command_that_is_held_for_a_tick_is_half_a_tick_late() {
    let (continuous, held) = (swarm(3), Linearised { tick_s: 0.01, ..swarm(3) });
    let margin_s = |swarm: Linearised| swarm.margin_s(Late::OwnState).unwrap();
    let lost_s = margin_s(continuous) - margin_s(held);
    // A little more, because what the neighbours say acts late, too.
    assert!(lost_s > 0.0045 && lost_s < 0.006, "{lost_s}");
}

/// `uavs` UAVs that fly where they rest if their own states are late by `delay_s`, but for 2 cm of one of them.
fn late_at_rest(uavs: u32, delay_s: f64) -> Scenario {
    let mut scenario = Scenario::default();
    scenario.formation.uavs = uavs;
    (scenario.time.rate_hz, scenario.time.duration_s) = (1000, 24.0);
    let speed_m_s = scenario.leader.speed_m_s;
    let (formation, leader) = (scenario.formation(), scenario.leader_start());
    let start = |uav: UavId| {
        let off = Vector2::new(speed_m_s * delay_s, if uav.0 == 1 { 0.02 } else { 0.0 });
        let position_m = (formation.slot(uav.0, leader.position) + off).into();
        StartState { position_m, heading_deg: leader.heading_deg, speed_m_s }
    };
    scenario.start.uavs = UavId::all(uavs).map(start).collect();
    let delay_ms = delay_s * 1e3;
    scenario.faults = vec![format!("at 0 s link own->all delay {delay_ms:.0} ms").parse().unwrap()];
    scenario
}

/// How far the slot error of UAV 1 swings from 8 s to 10 s, and in the last two seconds.
fn swings_m(scenario: &Scenario) -> [f64; 2] {
    let (mut simulation, mut frames) = (Simulation::new(scenario).unwrap(), Frames::new(scenario));
    let mut errors_m = Vec::new();
    while simulation.step() {
        let state = frames.take(&simulation).map(|frame| frame.uavs[0].state.unwrap());
        errors_m.extend(state.map(|state| state.slot_error_m.unwrap()));
    }
    [8_000..10_000, 22_000..24_000].map(|ticks| {
        let of = |most: fn(f64, f64) -> f64| errors_m[ticks.clone()].iter().copied().reduce(most).unwrap();
        of(f64::max) - of(f64::min)
    })
}

#[test]
fn flights_with_late_own_states_keep_swinging_above_the_margin_and_settle_below_it() {
    for uavs in [3, 8] {
        let swarm = Linearised { tick_s: 1e-3, ..swarm(uavs) };
        let margin_ms = swarm.margin_s(Late::OwnState).unwrap() * 1e3;
        // A flight rounds its delay to whole ticks of a millisecond.
        let [below, above] = [(margin_ms - 2.0).floor(), (margin_ms + 2.0).ceil()]
            .map(|delay_ms| swings_m(&late_at_rest(uavs, delay_ms / 1e3)));
        assert!(below[1] < 0.5 * below[0], "{uavs} UAVs, {margin_ms} ms: {below:?}");
        // The limit of the turn rate holds a growing swing, for three UAVs at 13 mm.
        assert!(above[1] > 0.9 * above[0], "{uavs} UAVs, {margin_ms} ms: {above:?}");
    }
}

#[test]
fn trust_that_fades_leaves_no_margin_and_no_bound() {
    let swarm = Linearised { trust_time_s: Some(0.5), ..swarm(3) };
    assert_eq!(swarm.margin_s(Late::NeighboursReckoned), None);
    assert_eq!(swarm.bound_s(Late::NeighboursReckoned), None);
}
