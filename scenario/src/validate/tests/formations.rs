//! Shapes that are listed or steep, and manoeuvres from one formation to another.

use super::*;

/// A manoeuvre to a vee from 30 s on.
fn to_a_vee(scenario: &mut Scenario, over_s: f64) {
    scenario.manoeuvres = vec![ManoeuvreSection {
        at_s: 30.0,
        over_s,
        shape: Some(ShapeName::Vee),
        ..ManoeuvreSection::default()
    }];
}

#[test]
fn a_manoeuvre_that_airframes_cannot_follow_is_refused_with_the_time_that_they_need() {
    assert_eq!(messages(|s| to_a_vee(s, 10.0)), [""; 0]);
    let refusals = messages(|s| to_a_vee(s, 1.0));
    let [refusal] = &refusals[..] else { panic!("{refusals:?}") };
    assert_eq!(
        refusal,
        "manoeuvres.0.over_s: in 1 s, the slot of uav 1 needs speeds outside 12 to 25 m/s: give 3.7 s or more"
    );
    // The advice is right, and not more careful than it has to be.
    assert_eq!(messages(|s| to_a_vee(s, 3.7)), [""; 0]);
    assert_eq!(blamed(|s| to_a_vee(s, 3.6)), ["manoeuvres.0.over_s"]);
    let slow = |s: &mut Scenario| {
        to_a_vee(s, 100.0);
        s.leader.speed_m_s = 12.0;
    };
    assert!(
        messages(slow)[0].ends_with("no time is long enough at a leader's speed of 12 m/s"),
        "{:?}",
        messages(slow)
    );
}

#[test]
fn a_manoeuvre_in_a_turn_needs_the_speeds_that_the_turn_leaves_over() {
    let in_a_turn = |s: &mut Scenario, frame, over_s| {
        to_a_vee(s, over_s);
        s.manoeuvres[0].shape = None;
        s.manoeuvres[0].spacing_m = Some(50.0);
        s.formation.frame = frame;
        (s.leader.path.kind, s.leader.path.radius_m) = (PathKind::Circle, 300.0);
    };
    // A slot 40 m to the left rests at 15 (1 - 40 / 300) = 13 m/s, and at 12.5 m/s when it is 50 m away. A slot that moves
    // 10 m backwards in a fixed frame may lose 3 m/s.
    assert_eq!(blamed(|s| in_a_turn(s, FormationFrame::Fixed, 3.4)), [""; 0]);
    assert_eq!(blamed(|s| in_a_turn(s, FormationFrame::Leader, 3.4)), ["manoeuvres.0.over_s"]);
    // The larger formation itself may be too large for the turn.
    let wide = |s: &mut Scenario| {
        in_a_turn(s, FormationFrame::Leader, 100.0);
        s.manoeuvres[0].spacing_m = Some(70.0);
    };
    assert_eq!(blamed(wide), ["leader.path.radius_m"]);
}

#[test]
fn manoeuvres_follow_one_another_and_have_the_bounds_of_the_formation() {
    let two = |s: &mut Scenario, at_s| {
        to_a_vee(s, 10.0);
        s.manoeuvres.push(ManoeuvreSection {
            at_s,
            over_s: 20.0,
            shape: Some(ShapeName::Ring),
            ..ManoeuvreSection::default()
        });
    };
    assert_eq!(messages(|s| two(s, 40.0)), [""; 0]);
    assert_eq!(
        messages(|s| two(s, 39.0)),
        ["manoeuvres.1.at_s: begins at 39 s, but manoeuvres.0 ends at 40 s: begin it later"]
    );
    let steep = |s: &mut Scenario| {
        to_a_vee(s, 10.0);
        s.manoeuvres[0].sweep_deg = Some(70.0);
    };
    assert_eq!(blamed(steep), ["manoeuvres.0.sweep_deg"]);
    let listed = |s: &mut Scenario| {
        to_a_vee(s, 10.0);
        s.manoeuvres[0].shape = Some(ShapeName::Offsets);
    };
    assert_eq!(blamed(listed), ["formation.offsets"], "no offsets are listed");
}

#[test]
fn slots_that_would_meet_on_the_way_are_refused() {
    let turned = |s: &mut Scenario, order| {
        let (shape, bearing_deg) = (Some(ShapeName::Echelon), Some(0.0));
        s.formation.shape = ShapeName::Echelon;
        s.manoeuvres = vec![ManoeuvreSection {
            at_s: 1.0,
            over_s: 200.0,
            shape,
            bearing_deg,
            order,
            ..ManoeuvreSection::default()
        }];
    };
    assert_eq!(messages(|s| turned(s, SlotOrder::Nearest)), [""; 0]);
    let refusals = messages(|s| turned(s, SlotOrder::Keep));
    assert!(refusals[0].contains("come within 0.00 m of each other"), "{refusals:?}");
}

/// Six offsets in a line, 20 m apart.
fn in_a_line(scenario: &mut Scenario) {
    scenario.formation.shape = ShapeName::Offsets;
    let offset = |place: u32| OffsetSection { ahead_m: -20.0 * f64::from(place), left_m: 0.0 };
    scenario.formation.offsets = (0..6).map(offset).collect();
}

#[test]
fn listed_offsets_are_one_for_each_uav_and_farther_apart_than_a_collision() {
    assert_eq!(messages(in_a_line), [""; 0]);
    let fewer = |s: &mut Scenario| {
        in_a_line(s);
        s.formation.offsets.pop();
    };
    assert_eq!(
        messages(fewer),
        ["formation.offsets: 5 offsets are listed, but formation.uavs is 6: list one for each UAV"]
    );
    let close = |s: &mut Scenario| {
        in_a_line(s);
        s.formation.offsets[4].ahead_m = -21.5;
    };
    assert_eq!(
        messages(close),
        ["formation.offsets.4: slots 2 and 5 are 1.50 m apart, which is not above \
          airframe.collision_distance_m 2 m: move one of them"]
    );
    let unused = |s: &mut Scenario| {
        in_a_line(s);
        s.formation.shape = ShapeName::Grid;
    };
    assert_eq!(
        messages(unused),
        [
            "formation.offsets: 6 offsets in the list, but formation.shape is \"grid\": give shape = \"offsets\", or an \
          empty list"
        ]
    );
}

#[test]
fn a_vee_is_not_too_steep_and_has_no_radius_to_keep() {
    let steep = |s: &mut Scenario, sweep_deg| {
        s.formation.shape = ShapeName::Vee;
        s.formation.sweep_deg = sweep_deg;
    };
    assert_eq!(blamed(|s| steep(s, 60.0)), [""; 0]);
    assert_eq!(
        messages(|s| steep(s, 61.0)),
        [
            "formation.sweep_deg: at 61 degrees, the arms of a vee are nearer to each other than L: give -60 to 60"
        ]
    );
    let keeps = |s: &mut Scenario, shape| {
        s.control.ring_closes = true;
        s.membership.on_loss = OnLoss::KeepRadius;
        s.formation.shape = shape;
    };
    assert_eq!(blamed(|s| keeps(s, ShapeName::Star)), [""; 0]);
    assert_eq!(
        messages(|s| keeps(s, ShapeName::Vee)),
        [
            "membership.on_loss: the shape \"vee\" has no radius to keep: give \"keep_spacing\" or \"keep_slots\""
        ]
    );
}
