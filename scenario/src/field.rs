//! The obstacles of a scenario: the listed ones, and those that its seed draws.
//!
//! Never depends on anything but the scenario, so that the world, the recorder and every reader of a log get the same ones.

use crate::{LeaderStart, ObstacleFieldSection, ObstacleSection, Scenario};
use nalgebra::Vector2;
use ringwing_flight::{direction, draw::Draws};

/// Separates these draws from all others of the seed ("field" in ASCII). Another value gives other fields.
const PURPOSE: [u64; 3] = [0x66_6965_6c64, 0, 0];

/// What the names of drawn obstacles begin with; their number follows.
pub(crate) const CIRCLE_NAME: &str = "Circle ";

impl Scenario {
    /// Every obstacle: the listed ones first, then the circles of the field.
    pub fn all_obstacles(&self) -> Vec<ObstacleSection> {
        let mut all = self.obstacles.clone();
        all.extend(self.field());
        all
    }

    /// The circles that the seed draws.
    fn field(&self) -> impl Iterator<Item = ObstacleSection> {
        let ObstacleFieldSection {
            circles,
            ahead_m,
            length_m,
            width_m,
            radius_min_m,
            radius_max_m,
            braking_m,
        } = self.obstacle_field;
        let LeaderStart { position, heading_deg, .. } = self.leader_start();
        let along = direction(heading_deg.to_radians());
        let across = Vector2::new(-along.y, along.x);
        let corner = position + along * ahead_m - across * (width_m / 2.0);
        // Each circle takes three numbers, in this order: a larger field begins with the circles of a smaller one.
        let mut draws = Draws::new(self.seed, PURPOSE, 0);
        (1..=circles).map(move |number| {
            let radius_m = radius_min_m + (radius_max_m - radius_min_m) * draws.uniform();
            let centre = corner + along * (length_m * draws.uniform()) + across * (width_m * draws.uniform());
            ObstacleSection::standing(
                format!("{CIRCLE_NAME}{number}"),
                centre.into(),
                radius_m,
                radius_m + braking_m,
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn field(circles: u32, seed: u64) -> Scenario {
        let mut scenario = Scenario { seed, ..Scenario::default() };
        scenario.obstacle_field.circles = circles;
        scenario
    }

    #[test]
    fn a_scenario_without_a_field_has_the_listed_obstacles_alone() {
        let mast = ObstacleSection::standing("mast", [1.0, 2.0], 3.0, 4.0);
        let mut scenario = Scenario { obstacles: vec![mast.clone()], ..Scenario::default() };
        assert_eq!(scenario.all_obstacles(), std::slice::from_ref(&mast));
        scenario.obstacle_field.circles = 2;
        let all = scenario.all_obstacles();
        assert_eq!((all.len(), &all[0], &*all[2].name), (3, &mast, "Circle 2"));
    }

    #[test]
    fn the_field_lies_on_the_leaders_way() {
        let mut scenario = field(200, 5);
        scenario.leader.start_m = [100.0, 50.0];
        scenario.leader.heading_deg = 90.0;
        let centres: Vec<[f64; 2]> = scenario.all_obstacles().iter().map(|one| one.position_m).collect();
        // North of the leader's start, 200 m ahead and 1000 m long; 80 m to each side.
        assert!(centres.iter().all(|[x, y]| (x - 100.0).abs() <= 80.0 && (250.0..=1250.0).contains(y)));
        let reach = |along: fn(&[f64; 2]) -> f64| {
            let all = centres.iter().map(along);
            all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
        };
        assert!(reach(|[x, _]| *x) > 150.0 && reach(|[_, y]| *y) > 950.0, "it fills its rectangle");
    }

    proptest! {
        #[test]
        fn a_field_depends_on_the_seed_alone_and_grows_at_its_end(seed: u64, circles in 1_u32..40) {
            let all = field(circles, seed).all_obstacles();
            prop_assert_eq!(&all[..], &field(circles + 3, seed).all_obstacles()[..circles as usize]);
            prop_assert_ne!(&all, &field(circles, seed ^ 1).all_obstacles());
            for one in all {
                prop_assert!((5.0..=20.0).contains(&one.radius_m));
                prop_assert!((one.braking_distance_m - one.radius_m - 20.0).abs() < 1e-9);
            }
        }
    }
}
