use super::*;
use crate::testing::{leader, ring_of};
use ringwing_scenario::{ManoeuvreSection, ShapeName};

/// A ring of six at 10 Hz that these manoeuvres change at 1 s, 2 s, ...
fn planned(changes: &[ManoeuvreSection]) -> FlownRing {
    let mut scenario = ring_of(6, 40.0);
    scenario.time.rate_hz = 10;
    scenario.control.ring_closes = true;
    let timed = (1..).zip(changes).map(|(second, change)| ManoeuvreSection {
        at_s: f64::from(second),
        over_s: 0.5,
        ..change.clone()
    });
    scenario.manoeuvres = timed.collect();
    FlownRing::new(&scenario)
}

fn spaced(spacing_m: f64) -> ManoeuvreSection {
    ManoeuvreSection { spacing_m: Some(spacing_m), ..ManoeuvreSection::default() }
}

fn shaped(shape: ShapeName) -> ManoeuvreSection {
    ManoeuvreSection { shape: Some(shape), ..ManoeuvreSection::default() }
}

fn is_near(value: Option<f64>, expected: f64) -> bool {
    value.is_some_and(|value| (value - expected).abs() < 1e-9)
}

#[test]
fn a_manoeuvre_gives_the_ring_its_final_size_from_its_own_tick_on() {
    let mut ring = planned(&[spaced(60.0), spaced(80.0)]);
    for tick in 0..30 {
        ring.follow(tick, |_| true);
        let (begun, spacing_m) = [(0, 40.0), (1, 60.0), (2, 80.0)][tick as usize / 10];
        assert_eq!(ring.begun(), begun, "{tick}");
        assert!(is_near(ring.spacing_m(), spacing_m), "{tick}: {:?}", ring.spacing_m());
        // The radius of a hexagon is its side.
        assert!(is_near(ring.radius_m(), spacing_m), "{tick}: {:?}", ring.radius_m());
    }
}

#[test]
fn manoeuvres_whose_ticks_were_missed_are_made_up_for() {
    let mut ring = planned(&[spaced(60.0), spaced(80.0)]);
    ring.follow(25, |_| true);
    assert!(ring.begun() == 2 && is_near(ring.spacing_m(), 80.0));
}

#[test]
fn a_ring_is_closed_and_a_vee_is_an_open_line_without_a_radius() {
    let mut ring = planned(&[shaped(ShapeName::Vee), shaped(ShapeName::Ellipse)]);
    let (slots, is_closed) = ring.outline();
    assert!(slots.len() == 6 && is_closed);
    ring.follow(10, |_| true);
    let (slots, is_closed) = ring.outline();
    assert!(slots.len() == 6 && !is_closed);
    assert_eq!(ring.radius_m(), None);
    ring.follow(20, |_| true);
    assert!(ring.outline().1);
    assert_eq!((ring.radius_m(), ring.spacing_m()), (None, None), "the gaps of an ellipse differ");
}

#[test]
fn a_ring_has_no_spacing_with_one_uav_and_no_radius_with_nobody() {
    let mut ring = planned(&[]);
    ring.follow(0, |number| number == 2);
    assert!(ring.radius_m().is_some() && ring.spacing_m().is_none());
    ring.follow(1, |_| false);
    assert_eq!((ring.radius_m(), ring.spacing_m()), (None, None));
}

#[test]
fn a_ring_closes_if_the_scenario_says_so() {
    assert!(planned(&[]).closes());
    let mut open = FlownRing::new(&ring_of(6, 40.0));
    open.follow(0, |number| number != 2);
    assert!(!open.closes() && is_near(open.radius_m(), 40.0));
}

#[test]
fn a_formation_turns_with_its_leader_only_in_the_leaders_frame() {
    let north = LeaderState { heading_rad: 1.5, ..leader(0, [0.0, 0.0]) };
    let mut scenario = ring_of(6, 40.0);
    for (frame, turned_rad) in [(FormationFrame::Fixed, 0.0), (FormationFrame::Leader, 1.5)] {
        scenario.formation.frame = frame;
        assert_eq!(FlownRing::new(&scenario).frame_rad(&north), turned_rad);
    }
}
