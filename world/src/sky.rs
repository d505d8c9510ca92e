//! All airframes among the obstacles: what they sense, and what happens when time moves on.
//!
//! Knows nothing of processes, services or clocks; the same commands give the same flight, to the bit.

use crate::{Airframe, Refusal, collisions::Collisions};
use ringwing_flight::{Command, Event, Sensed, SensedObstacle, Tick, UavId, payload::MAX_SENSED_OBSTACLES};
use ringwing_scenario::{Obstacle, Scenario, StartState};

/// The world's truth.
#[derive(Debug, Clone)]
pub struct Sky {
    now: Tick,
    airframes: Vec<Airframe>,
    obstacles: Vec<Obstacle>,
    sensing_range_m: f64,
    collisions: Collisions,
}

impl Sky {
    /// The sky of `scenario` one tick before the flight begins, with UAVs on their way to `starts`.
    pub fn new(scenario: &Scenario, starts: &[StartState]) -> Self {
        let airframes: Vec<_> = UavId::all(scenario.formation.uavs)
            .zip(starts)
            .map(|(uav, start)| Airframe::new(scenario, uav, start))
            .collect();
        let distance_m = scenario.airframe.collision_distance_m;
        Self {
            now: Tick::APPROACH,
            collisions: Collisions::new(distance_m, &scenario.obstacles, airframes.len()),
            airframes,
            obstacles: scenario.obstacles.clone(),
            sensing_range_m: scenario.sensing.range_m,
        }
    }

    /// The moment it shows.
    pub fn now(&self) -> Tick {
        self.now
    }

    /// Every airframe, UAV 1 first.
    pub fn airframes(&self) -> &[Airframe] {
        &self.airframes
    }

    /// What `uav` senses now; `None` once it has left the sky.
    pub fn senses(&self, uav: UavId) -> Option<Sensed> {
        let airframe = &self.airframes[uav.index()];
        if !airframe.is_flying() {
            return None;
        }
        let (obstacles, obstacle_count, obstacles_omitted) = self.obstacles_near(airframe);
        let (speed_m_s, turn_rate_rad_s) = airframe.rates();
        Some(Sensed {
            tick: self.now,
            position_m: airframe.pose().position.into(),
            heading_rad: airframe.pose().heading_rad,
            speed_m_s,
            turn_rate_rad_s,
            uav,
            mode: airframe.mode(),
            obstacle_count,
            obstacles_omitted,
            obstacles,
        })
    }

    /// The nearest obstacles whose edge is in range, how many they are, and how many more there were.
    fn obstacles_near(&self, airframe: &Airframe) -> ([SensedObstacle; MAX_SENSED_OBSTACLES], u32, u32) {
        let own = airframe.pose().position;
        let to_edge_m = |one: &Obstacle| (own - nalgebra::Point2::from(one.position_m)).norm() - one.radius_m;
        let mut near: Vec<(f64, &Obstacle)> = self
            .obstacles
            .iter()
            .map(|obstacle| (to_edge_m(obstacle), obstacle))
            .filter(|(distance_m, _)| *distance_m <= self.sensing_range_m)
            .collect();
        near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut sensed = [SensedObstacle::default(); MAX_SENSED_OBSTACLES];
        for (place, (_, obstacle)) in sensed.iter_mut().zip(&near) {
            let Obstacle { position_m, radius_m, braking_distance_m, .. } = **obstacle;
            *place = SensedObstacle { position_m, radius_m, braking_distance_m };
        }
        let count = near.len().min(MAX_SENSED_OBSTACLES);
        (sensed, count as u32, (near.len() - count) as u32)
    }

    /// Takes the command that UAV `to`'s agent sent.
    pub fn accept(&mut self, to: UavId, command: &Command) -> Result<(), Refusal> {
        self.airframes[to.index()].accept(command, self.now)
    }

    /// Flies everybody on to the next tick.
    pub fn step(&mut self) -> Vec<Event> {
        let mut events = Vec::new();
        for airframe in self.airframes.iter_mut().filter(|airframe| airframe.is_flying()) {
            if airframe.step(self.now) {
                events.push(Event::Failsafe { uav: airframe.uav(), mode: airframe.mode() });
            }
        }
        self.now = self.now.next();
        for (uav, with) in self.collisions.begun(&self.airframes) {
            let position_m = self.airframes[uav.index()].pose().position.into();
            events.push(Event::Collision { uav, with, position_m });
        }
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::Collider;

    fn mast(number: u32, x: f64) -> Obstacle {
        Obstacle {
            name: format!("mast {number}"),
            position_m: [x, 0.0],
            radius_m: 1.0,
            braking_distance_m: 5.0,
        }
    }

    fn sky_at_origin(obstacles: Vec<Obstacle>) -> Sky {
        let mut scenario = Scenario { obstacles, ..Scenario::default() };
        scenario.formation.uavs = 3;
        let at = |x: f64| StartState { position_m: [x, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[at(0.0), at(1000.0), at(2000.0)]);
        sky.step();
        sky
    }

    #[test]
    fn obstacles_in_range_are_sensed_nearest_first_and_the_rest_is_counted() {
        let sky = sky_at_origin((1..=12).rev().map(|n| mast(n, f64::from(n) * 10.0)).collect());
        let senses = sky.senses(UavId(1)).unwrap();
        let x: Vec<f64> = senses.obstacles().iter().map(|obstacle| obstacle.position_m[0]).collect();
        assert_eq!(x, [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0]);
        assert_eq!(senses.obstacles_omitted, 4);
    }

    #[test]
    fn what_is_out_of_range_is_not_sensed() {
        let sky = sky_at_origin(vec![mast(1, 150.9), mast(2, 151.1)]);
        assert_eq!(sky.senses(UavId(1)).unwrap().obstacles().len(), 1);
    }

    #[test]
    fn a_uav_that_has_vanished_senses_nothing_and_meets_nobody() {
        let mut scenario = Scenario { obstacles: vec![mast(1, 15.0)], ..Scenario::default() };
        scenario.formation.uavs = 3;
        scenario.airframe.failsafe = ringwing_scenario::Failsafe::Vanish;
        let at = |x: f64| StartState { position_m: [x, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[at(0.0), at(1000.0), at(2000.0)]);
        let events: Vec<_> = (0..200).flat_map(|_| sky.step()).collect();
        assert_eq!(events.len(), 3, "{events:?}");
        assert!(events.iter().all(|one| matches!(one, Event::Failsafe { .. })));
        assert_eq!(sky.senses(UavId(1)), None);
    }

    #[test]
    fn a_collision_says_who_met_what_and_where() {
        let mut sky = sky_at_origin(vec![mast(1, 4.0)]);
        let events: Vec<_> = (0..40).flat_map(|_| sky.step()).collect();
        let [Event::Collision { uav, with, position_m }] = events.as_slice() else {
            panic!("{events:?}");
        };
        assert_eq!((*uav, *with), (UavId(1), Collider::Obstacle(0)));
        assert!((position_m[0] - 3.0).abs() < 0.15 + 1e-9);
    }
}
