//! Places the UAVs at the start: as listed, or by a seeded draw.
//!
//! Never depends on anything but the scenario, so that every process and every check gets the same states.

use crate::{
    IntruderSection, LeaderStart, ObstacleSection, Problem, Scenario, ScenarioError, ShapeName, StartState,
};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{direction, draw::Draws};

/// Separates these draws from all others of the seed. Other values would draw other starts.
const PURPOSE: [u64; 3] = [0; 3];
/// The moment of these draws; see [`PURPOSE`].
const MOMENT: u64 = 1;
/// Positions to try for one UAV. Fewer would refuse boxes that have room; more would only delay the refusal of one that
/// has none.
const TRIES: u32 = 10_000;

/// The start state of each UAV: the listed ones, or states drawn with the scenario's seed.
///
/// A draw takes a position from a box around the leader, and takes another one while that is too close to a UAV already
/// placed or to an intruder, or within the braking distance of an obstacle.
///
/// # Errors
/// The box has no room for a UAV; the message names the keys to change.
pub fn states(scenario: &Scenario) -> Result<Vec<StartState>, ScenarioError> {
    // Validation has checked that these collide with nothing.
    if !scenario.start.uavs.is_empty() {
        return Ok(scenario.start.uavs.clone());
    }
    let mut start_box = StartBox::new(scenario);
    let mut placed = Vec::new();
    for uav in 1..=scenario.formation.uavs {
        let state = start_box.free_state(&placed).ok_or_else(|| no_room(scenario, uav))?;
        placed.push(state);
    }
    Ok(placed)
}

fn no_room(scenario: &Scenario, uav: u32) -> Problem {
    let message = format!(
        "found no free position for UAV {uav} of {} in {TRIES} tries: give a smaller separation_m, a larger \
         length_radii or width_radii, or an ahead_radii that keeps the box clear of obstacles",
        scenario.formation.uavs
    );
    Problem { key: Some("start.draw".into()), ..Problem::of_scenario(&scenario.name, message) }
}

/// The box that start positions are drawn from.
struct StartBox<'s> {
    scenario: &'s Scenario,
    leader: LeaderStart,
    obstacles: Vec<ObstacleSection>,
    draws: Draws,
    middle: Point2<f64>,
    /// The long side, from end to end: along the leader's heading, or leaning towards the line of an echelon.
    along: Vector2<f64>,
    /// The side across the heading, from end to end.
    across: Vector2<f64>,
    /// Smallest distance between two UAVs; at least the collision distance.
    separation_m: f64,
}

impl<'s> StartBox<'s> {
    fn new(scenario: &'s Scenario) -> Self {
        let draw = &scenario.start.draw;
        let radius = scenario.formation().radius_m();
        let leader = scenario.leader_start();
        let ahead = direction(leader.heading_deg.to_radians());
        let left = Vector2::new(-ahead.y, ahead.x);
        let keyed =
            Sides { length_m: draw.length_radii * radius, width_m: draw.width_radii * radius, lean: 0.0 };
        let Sides { length_m, width_m, lean } = match scenario.formation.shape {
            ShapeName::Echelon => {
                let line = scenario.start_slot(scenario.formation.uavs) - scenario.start_slot(1);
                keyed.around(line.dot(&ahead), line.dot(&left))
            }
            _ => keyed,
        };
        Self {
            scenario,
            leader,
            obstacles: scenario.all_obstacles(),
            draws: Draws::new(scenario.seed, PURPOSE, MOMENT),
            middle: leader.position + ahead * (draw.ahead_radii * radius),
            along: (ahead + left * lean) * length_m,
            across: left * width_m,
            // With a smaller separation, a flight could begin with a collision.
            separation_m: draw.separation_m.max(scenario.airframe.collision_distance_m),
        }
    }

    /// A drawn state that keeps clear of obstacles and of the UAVs already placed.
    fn free_state(&mut self, placed: &[StartState]) -> Option<StartState> {
        (0..TRIES).find_map(|_| {
            let state = self.draw_state();
            self.is_free(state.position_m.into(), placed).then_some(state)
        })
    }

    /// Takes three numbers from the stream in every try, so that each try sees the same numbers, whatever the tries
    /// before led to.
    fn draw_state(&mut self) -> StartState {
        let position = self.middle
            + self.along * (self.draws.uniform() - 0.5)
            + self.across * (self.draws.uniform() - 0.5);
        let leader = &self.leader;
        let deviation_deg = self.scenario.start.draw.heading_spread_deg * (2.0 * self.draws.uniform() - 1.0);
        StartState {
            position_m: position.into(),
            // Within one turn, as validation requires of listed starts.
            heading_deg: (leader.heading_deg + deviation_deg) % 360.0,
            speed_m_s: leader.speed_m_s,
        }
    }

    fn is_free(&self, position: Point2<f64>, placed: &[StartState]) -> bool {
        let apart =
            |other: &StartState| (position - Point2::from(other.position_m)).norm() >= self.separation_m;
        // Within the braking distance an obstacle would repel the UAV from the first tick on.
        let clear = |obstacle: &ObstacleSection| {
            (position - Point2::from(obstacle.position_m)).norm() > obstacle.braking_distance_m
        };
        let away = |intruder: &IntruderSection| {
            (position - Point2::from(intruder.position_m)).norm() >= self.separation_m
        };
        placed.iter().all(apart)
            && self.obstacles.iter().all(clear)
            && self.scenario.intruders.iter().all(away)
    }
}

/// The sides of a start box.
#[derive(Debug, Clone, Copy)]
struct Sides {
    /// Along the leader's heading.
    length_m: f64,
    /// Across the heading.
    width_m: f64,
    /// How far the box leans to the left for each metre ahead, in m.
    lean: f64,
}

impl Sides {
    /// These sides, leaning and longer as far as needed to start around a line that reaches `ahead_m` and `left_m`.
    ///
    /// An upright box would hold UAVs far ahead of their slots, and a UAV falls back slowly: at `v_d - v_min`. The lean is the
    /// slope with which the line's places and the box's length give the least squares, so a line straight across leaves the
    /// box upright. What the lean leaves of the line's width is the least width.
    fn around(self, ahead_m: f64, left_m: f64) -> Self {
        let length_m = self.length_m.max(ahead_m.abs());
        let share = ahead_m / length_m;
        let width_m = self.width_m.max(left_m.abs() * (1.0 - share * share).sqrt());
        Self { length_m, width_m, lean: share * left_m / length_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drawn(uavs: u32, seed: u64) -> Scenario {
        let mut scenario = Scenario { seed, ..Scenario::default() };
        scenario.formation.uavs = uavs;
        scenario
    }

    fn distance(a: &StartState, b: &StartState) -> f64 {
        (Point2::from(a.position_m) - Point2::from(b.position_m)).norm()
    }

    fn assert_apart(states: &[StartState], separation_m: f64) {
        for (index, state) in states.iter().enumerate() {
            assert!(states[..index].iter().all(|other| distance(state, other) >= separation_m));
        }
    }

    #[test]
    fn listed_states_are_returned_unchanged() {
        let state = StartState { position_m: [1.0, 2.0], heading_deg: 3.0, speed_m_s: 14.0 };
        let mut scenario = drawn(3, 1);
        scenario.start.uavs = vec![state; 3];
        assert_eq!(states(&scenario).unwrap(), [state; 3]);
    }

    #[test]
    fn the_default_box_has_room_for_every_swarm() {
        for uavs in [3, 4, 6, 30, 200, 1024] {
            let placed = states(&drawn(uavs, 1)).unwrap();
            assert_eq!(placed.len(), uavs as usize);
            assert_apart(&placed, 10.0);
        }
    }

    #[test]
    fn a_draw_is_the_same_on_every_machine_and_in_every_version() {
        let first = states(&drawn(6, 1)).unwrap()[0];
        assert_eq!(
            first,
            StartState {
                position_m: [-47.576_023_362_150_91, 25.439_330_668_616_996],
                heading_deg: 7.901_582_327_830_758,
                speed_m_s: 15.0
            }
        );
    }

    #[test]
    fn a_box_without_room_is_refused_with_the_keys_to_change() {
        let mut scenario = drawn(6, 1);
        scenario.start.draw.separation_m = 100.0;
        assert_eq!(
            states(&scenario).unwrap_err().to_string(),
            "scenario \"unnamed\": start.draw: found no free position for UAV 3 of 6 in 10000 tries: give a smaller \
             separation_m, a larger length_radii or width_radii, or an ahead_radii that keeps the box clear of obstacles"
        );
    }

    #[test]
    fn the_box_lies_ahead_of_the_leader_and_along_its_heading() {
        let mut scenario = drawn(40, 9);
        scenario.leader.start_m = [500.0, -200.0];
        scenario.leader.heading_deg = 90.0;
        scenario.start.draw.ahead_radii = 2.0;
        let radius = scenario.formation().radius_m();
        for state in states(&scenario).unwrap() {
            let [x, y] = state.position_m;
            assert!((x - 500.0).abs() <= radius && (y + 200.0 - 2.0 * radius).abs() <= 1.5 * radius);
            assert!((state.heading_deg - 90.0).abs() <= 28.6);
        }
    }

    #[test]
    fn the_box_of_an_echelon_leans_along_its_line() {
        let mut scenario = drawn(200, 3);
        scenario.formation.shape = ShapeName::Echelon;
        scenario.leader.heading_deg = 90.0;
        let radius = scenario.formation().radius_m();
        let farthest = |is: &dyn Fn(f64, f64) -> f64| {
            // Ahead and to the left of a leader that heads north.
            let seen = states(&scenario)
                .unwrap()
                .into_iter()
                .map(|at| is(at.position_m[1], -at.position_m[0]).abs());
            seen.fold(0.0, f64::max)
        };
        // A line of 199 spacings. Its left end is ahead of an eastbound leader, and of this one, for which the line stays as it
        // is, its right end.
        let half_line_m = 199.0 * 40.0 / 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        assert!((0.9..=1.0).contains(&(farthest(&|ahead, _| ahead) / half_line_m)));
        assert!((0.9..=1.0).contains(&(farthest(&|ahead, left| left + ahead) / radius)));
    }

    #[test]
    fn sides_lean_no_farther_than_the_line_is_long() {
        let upright = Sides { length_m: 100.0, width_m: 60.0, lean: 0.0 };
        let around = |ahead_m, left_m| {
            let Sides { length_m, width_m, lean } = upright.around(ahead_m, left_m);
            [length_m, width_m, lean]
        };
        assert_eq!(around(0.0, 50.0), [100.0, 60.0, 0.0]);
        assert_eq!(around(0.0, 300.0), [100.0, 300.0, 0.0]);
        assert_eq!(around(-200.0, 100.0), [200.0, 60.0, -0.5]);
        // The middle of the box follows a share of 0.6 of the line, and four fifths of its width are left.
        assert_eq!(around(60.0, 100.0), [100.0, 80.0, 0.6]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_draw_depends_on_the_seed_alone(uavs in 3_u32..40, seed: u64) {
            let drawn_states = states(&drawn(uavs, seed)).unwrap();
            prop_assert_eq!(&drawn_states, &states(&drawn(uavs, seed)).unwrap());
            prop_assert_ne!(&drawn_states, &states(&drawn(uavs, seed ^ 1)).unwrap());
            assert_apart(&drawn_states, 10.0);
        }

        #[test]
        fn more_uavs_do_not_move_the_first_ones_in_a_box_of_the_same_size(seed: u64) {
            let few = drawn(6, seed);
            let mut many = drawn(7, seed);
            let ratio = few.formation().radius_m() / many.formation().radius_m();
            many.start.draw.length_radii *= ratio;
            many.start.draw.width_radii *= ratio;
            for (a, b) in states(&few).unwrap().iter().zip(&states(&many).unwrap()) {
                prop_assert!(distance(a, b) < 1e-6);
            }
        }

        #[test]
        fn no_uav_starts_where_an_obstacle_repels(seed: u64, x in -60.0..60.0, y in -40.0..40.0) {
            let mut scenario = drawn(6, seed);
            scenario.obstacles = vec![ObstacleSection::standing("mast", [x, y], 5.0, 20.0)];
            for state in states(&scenario).unwrap() {
                prop_assert!((Point2::from(state.position_m) - Point2::new(x, y)).norm() > 20.0);
            }
        }
    }
}
