use super::*;

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
fn margins_of_own_data_are_those_of_an_independent_prototype() {
    // The prototype's steps were a tenth of a millisecond. Roots by Newton's method: 79.97 ms for the heading of six.
    for (uavs, state_ms, heading_ms) in [(3, 74.5, 78.4), (6, 78.0, 79.9), (8, 76.3, 78.7), (12, 74.3, 77.2)]
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

#[test]
fn trust_that_fades_leaves_no_margin_and_no_bound() {
    let swarm = Linearised { trust_time_s: Some(0.5), ..swarm(3) };
    assert_eq!(swarm.margin_s(Late::NeighboursReckoned), None);
    assert_eq!(swarm.bound_s(Late::NeighboursReckoned), None);
}
