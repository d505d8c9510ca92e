//! What the paper proves of its law at a single moment. `simulation/tests/theory.rs` shows the rest in flights.

use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use ringwing_agent::law::{
    Bond, Field, Flyer, RepulsiveObstacle, formation_control, lyapunov_candidate, lyapunov_rate, potential,
    potential_forces, repulsion, speed_force,
};
use ringwing_flight::{Formation, Pose, wrap};
use std::f64::consts::PI;

const SPEED: f64 = 15.0;
const GAIN: f64 = 2.0;

/// A swarm at a moment, with everyone's state known to everyone.
struct Swarm {
    formation: Formation,
    leader: Pose,
    uavs: Vec<Pose>,
}

impl Swarm {
    /// A swarm of `count` in its formation, each UAV moved and turned a little.
    fn disturbed(count: u32, by: &[(f64, f64, f64)]) -> Self {
        let formation = Formation::new(count, 40.0, PI);
        let leader = Pose { position: Point2::new(5.0, -2.0), heading_rad: 0.3 };
        let uavs = (1..=count).zip(by.iter().cycle()).map(|(number, (x, y, turn))| Pose {
            position: formation.slot(number, leader.position) + Vector2::new(*x, *y),
            heading_rad: wrap(leader.heading_rad + turn),
        });
        Self { uavs: uavs.collect(), formation, leader }
    }

    fn flyers(&self) -> Vec<Flyer> {
        let count = self.uavs.len();
        let bond = |point: Point2<f64>, rest_m: f64| Bond { point, rest_m, gain: GAIN };
        let neighbour =
            |place: usize| Some(bond(self.uavs[place % count].position, self.formation.spacing_m()));
        let flyer = |(index, pose): (usize, &Pose)| {
            let field = Field {
                previous: neighbour(index + count - 1),
                next: neighbour(index + 1),
                centre: bond(self.leader.position, self.formation.radius_m()),
                slot: self.formation.slot(index as u32 + 1, self.leader.position),
                slot_gain: 1.0,
            };
            Flyer { position: pose.position, heading_rad: pose.heading_rad, field }
        };
        self.uavs.iter().enumerate().map(flyer).collect()
    }

    /// The swarm `step_s` later along the flow of the unsaturated law, for a finite difference.
    fn after(&self, step_s: f64) -> Self {
        let along_flow = |flyer: Flyer| {
            let force = speed_force(SPEED, self.leader.heading_rad)
                - potential_forces(&flyer.field, &flyer.position).total();
            let control = formation_control(&force, flyer.heading_rad, 1.0);
            let pose = Pose { position: flyer.position, heading_rad: flyer.heading_rad };
            pose.after(control.speed_m_s, control.turn_rate_rad_s, step_s)
        };
        let uavs = self.flyers().into_iter().map(along_flow).collect();
        Self { formation: self.formation.clone(), leader: self.leader.after(SPEED, 0.0, step_s), uavs }
    }

    fn lyapunov(&self) -> f64 {
        lyapunov_candidate(&self.flyers(), SPEED, self.leader.heading_rad)
    }
}

proptest! {
    #[test]
    fn equation_10_is_the_rate_of_equation_7_and_never_positive(
        by in proptest::collection::vec((-8.0..8.0, -8.0..8.0, -0.5..0.5), 6),
    ) {
        const STEP_S: f64 = 1e-6;
        let swarm = Swarm::disturbed(6, &by);
        let rate = lyapunov_rate(&swarm.flyers(), SPEED, swarm.leader.heading_rad);
        let measured = (swarm.after(STEP_S).lyapunov() - swarm.lyapunov()) / STEP_S;
        prop_assert!(rate <= 0.0);
        prop_assert!((measured - rate).abs() < 1e-2 * (1.0 + rate.abs()), "{measured} {rate}");
    }

    #[test]
    fn finite_inputs_give_finite_outputs(
        x in any::<f64>(), y in any::<f64>(), other_x in any::<f64>(), other_y in any::<f64>(), heading in any::<f64>(),
    ) {
        prop_assume!([x, y, other_x, other_y, heading].iter().all(|number| number.is_finite()));
        let (own, other) = (Point2::new(x, y), Point2::new(other_x, other_y));
        let bond = Bond { point: other, rest_m: 40.0, gain: GAIN };
        let field = Field { previous: Some(bond), next: Some(bond), centre: bond, slot: other, slot_gain: 1.0 };
        let obstacle = RepulsiveObstacle { centre: other, radius_m: 10.0, braking_distance_m: 20.0 };
        let force = potential_forces(&field, &own).total();
        let repulsion = repulsion(100.0, &obstacle, &own);
        let control = formation_control(&(speed_force(SPEED, heading) - force + repulsion), heading, 1.0);
        let potential = potential(&field, &own);
        let outputs = [force.x, force.y, repulsion.x, repulsion.y, control.speed_m_s, control.turn_rate_rad_s, potential];
        for number in outputs {
            prop_assert!(number.is_finite(), "{number}");
        }
    }
}
