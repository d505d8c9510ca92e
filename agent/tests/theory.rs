//! What the paper proves, and what its figures show, of the law alone: ideal exchange, no processes.

use nalgebra::Point2;
use proptest::prelude::*;
use ringwing_agent::law::{
    Bond, ControlInput, Field, Flyer, Limits, formation_control, lyapunov_candidate, lyapunov_rate,
    potential_forces, saturated_control, speed_force,
};
use ringwing_flight::{Formation, Pose, wrap};
use std::f64::consts::PI;

const SPEED: f64 = 15.0;
const GAIN: f64 = 2.0;

/// A swarm that flies by the law with everybody's state known to everybody who needs it, at this moment.
struct Ideal {
    formation: Formation,
    leader: Pose,
    uavs: Vec<Pose>,
    limits: Option<Limits>,
}

impl Ideal {
    fn flyers(&self) -> Vec<Flyer> {
        let count = self.uavs.len();
        let bond = |point: Point2<f64>, rest_m: f64| Bond { point, rest_m, gain: GAIN };
        let flyer = |(index, pose): (usize, &Pose)| {
            let neighbour = |offset: usize| {
                Some(bond(self.uavs[(index + offset) % count].position, self.formation.spacing_m()))
            };
            let field = Field {
                previous: neighbour(count - 1),
                next: neighbour(1),
                centre: bond(self.leader.position, self.formation.radius_m()),
                slot: self.formation.slot(index as u32 + 1, self.leader.position),
                slot_gain: 1.0,
            };
            Flyer { position: pose.position, heading_rad: pose.heading_rad, field }
        };
        self.uavs.iter().enumerate().map(flyer).collect()
    }

    fn control(&self, flyer: &Flyer) -> ControlInput {
        let force = speed_force(SPEED, self.leader.heading_rad)
            - potential_forces(&flyer.field, &flyer.position).total();
        let wish = formation_control(&force, flyer.heading_rad, 1.0);
        self.limits.map_or(wish, |limits| saturated_control(&wish, &limits))
    }

    fn step(&mut self, period_s: f64) {
        let controls: Vec<ControlInput> = self.flyers().iter().map(|flyer| self.control(flyer)).collect();
        for (pose, control) in self.uavs.iter_mut().zip(controls) {
            *pose = pose.after(control.speed_m_s, control.turn_rate_rad_s, period_s);
        }
        self.leader = self.leader.after(SPEED, 0.0, period_s);
    }

    fn slot_error_max(&self) -> f64 {
        let errors = self.flyers().into_iter().map(|flyer| (flyer.position - flyer.field.slot).norm());
        errors.fold(0.0, f64::max)
    }

    fn lyapunov(&self) -> (f64, f64) {
        let (flyers, heading) = (self.flyers(), self.leader.heading_rad);
        (lyapunov_candidate(&flyers, SPEED, heading), lyapunov_rate(&flyers, SPEED, heading))
    }
}

fn leader() -> Pose {
    Pose { position: Point2::new(5.0, -2.0), heading_rad: 0.3 }
}

/// A swarm of `count` at rest in its formation, each UAV then moved and turned a little.
fn disturbed(count: u32, by: &[(f64, f64, f64)]) -> Ideal {
    let formation = Formation::new(count, 40.0, PI);
    let leader = leader();
    let uavs = (1..=count).zip(by.iter().cycle()).map(|(number, (x, y, turn))| Pose {
        position: formation.slot(number, leader.position) + nalgebra::Vector2::new(*x, *y),
        heading_rad: wrap(leader.heading_rad + turn),
    });
    Ideal { formation, leader, uavs: uavs.collect(), limits: None }
}

#[test]
fn the_standard_formation_is_at_rest() {
    for count in [3, 4, 5, 6, 12, 50] {
        let mut swarm = disturbed(count, &[(0.0, 0.0, 0.0)]);
        assert!(swarm.lyapunov().0 < 1e-18, "V is zero in the formation");
        for _ in 0..1000 {
            swarm.step(0.01);
        }
        assert!(swarm.slot_error_max() < 1e-6, "n = {count}: {}", swarm.slot_error_max());
    }
}

#[test]
fn the_limits_do_not_keep_the_swarm_from_its_formation() {
    let places: Vec<(f64, f64, f64)> = (0..6)
        .map(|i| {
            (
                f64::from(i * 17 % 11) * 6.0 - 30.0,
                f64::from(i * 7 % 5) * 9.0 - 18.0,
                f64::from(i) * 0.15 - 0.4,
            )
        })
        .collect();
    let mut swarm = disturbed(6, &places);
    swarm.limits = Some(Limits::new(12.0, 25.0, 0.5).unwrap());
    assert!(swarm.slot_error_max() > 20.0);
    for _ in 0..9000 {
        swarm.step(0.01);
    }
    assert!(swarm.slot_error_max() < 1e-3, "{}", swarm.slot_error_max());
}

fn disturbance() -> impl Strategy<Value = Vec<(f64, f64, f64)>> {
    proptest::collection::vec((-8.0..8.0, -8.0..8.0, -0.5..0.5), 6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_lyapunov_value_does_not_rise_while_unsaturated(by in disturbance(), count in 3_u32..8) {
        let mut swarm = disturbed(count, &by);
        let (mut value, _) = swarm.lyapunov();
        for _ in 0..2000 {
            swarm.step(0.001);
            let (next, _) = swarm.lyapunov();
            // A step of 1 ms follows the flow up to an error of second order in the step.
            prop_assert!(next <= value + 1e-4 * (1.0 + value), "{value} -> {next}");
            value = next;
        }
    }

    #[test]
    fn equation_10_is_the_rate_of_equation_7(by in disturbance()) {
        const STEP_S: f64 = 1e-6;
        let mut swarm = disturbed(6, &by);
        let (before, rate) = swarm.lyapunov();
        swarm.step(STEP_S);
        let measured = (swarm.lyapunov().0 - before) / STEP_S;
        prop_assert!(rate <= 0.0);
        prop_assert!((measured - rate).abs() < 1e-2 * (1.0 + rate.abs()), "{measured} {rate}");
    }

    #[test]
    fn no_finite_input_gives_a_number_that_is_not(
        x in any::<f64>(), y in any::<f64>(), other_x in any::<f64>(), other_y in any::<f64>(), heading in any::<f64>(),
    ) {
        prop_assume!([x, y, other_x, other_y, heading].iter().all(|number| number.is_finite()));
        let (own, other) = (Point2::new(x, y), Point2::new(other_x, other_y));
        let bond = Bond { point: other, rest_m: 40.0, gain: GAIN };
        let field = Field { previous: Some(bond), next: Some(bond), centre: bond, slot: other, slot_gain: 1.0 };
        let obstacle = ringwing_agent::law::RepulsiveObstacle { centre: other, radius_m: 10.0, braking_distance_m: 20.0 };
        let force = potential_forces(&field, &own).total();
        let repulsion = ringwing_agent::law::repulsion(100.0, &obstacle, &own);
        let control = formation_control(&(speed_force(SPEED, heading) - force + repulsion), heading, 1.0);
        let potential = ringwing_agent::law::potential(&field, &own);
        for number in [force.x, force.y, repulsion.x, repulsion.y, control.speed_m_s, control.turn_rate_rad_s, potential] {
            prop_assert!(number.is_finite(), "{number}");
        }
    }
}
