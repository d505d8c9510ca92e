//! All airframes among obstacles and intruders: what they sense, and what happens from one tick to the next.
//!
//! Never knows processes, services or clocks: the same commands give the same flight, to the bit.

use crate::{
    Airframe, Refusal,
    by_x::ByX,
    collisions::Collisions,
    encounters::Encounters,
    intruder::{Intruder, Radar},
    obstacle::Obstacle,
    sensors::{Sensors, drifted},
};
use ringwing_flight::{
    Aircraft, AircraftId, Command, Event, IntruderId, Pose, Sensed, SensedAircraft, SensedObstacle, Tick,
    Traffic, UavId,
    payload::{MAX_SENSED_AIRCRAFT, MAX_SENSED_OBSTACLES},
};
use ringwing_scenario::{Scenario, StartState, fault::schedule::AirframeFault};

/// The true state of the flight: every airframe, every obstacle and every intruder.
#[derive(Debug, Clone)]
pub struct Sky {
    now: Tick,
    airframes: Vec<Airframe>,
    by_x: ByX,
    /// Those of each UAV, UAV 1 first; empty if all are perfect.
    sensors: Vec<Sensors>,
    airframe_faults: Vec<AirframeFault>,
    obstacles: Vec<Obstacle>,
    intruders: Vec<Intruder>,
    radar: Radar,
    rate_hz: u32,
    sensing_range_m: f64,
    /// How far a UAV senses other aircraft; `None` while nobody uses that.
    traffic_range_m: Option<f64>,
    collisions: Collisions,
    encounters: Encounters,
}

impl Sky {
    /// The sky of `scenario` one tick before the flight begins, with UAVs on their way to `starts`, UAV 1 first.
    pub fn new(scenario: &Scenario, starts: &[StartState]) -> Self {
        let airframes: Vec<_> = UavId::all(scenario.formation.uavs)
            .zip(starts)
            .map(|(uav, start)| Airframe::new(scenario, uav, start))
            .collect();
        let distance_m = scenario.airframe.collision_distance_m;
        let near_miss_m = scenario.airframe.near_miss_distance_m;
        // Everything that moves begins at the same moment as the airframes, one tick before time 0.
        let approach_s = Tick::APPROACH.seconds(scenario.time.rate_hz);
        Self {
            now: Tick::APPROACH,
            collisions: Collisions::new(distance_m, near_miss_m),
            encounters: Encounters::new(near_miss_m, distance_m),
            sensors: airframes
                .iter()
                .filter_map(|airframe| Sensors::new(scenario, airframe.uav(), airframe.pose()))
                .collect(),
            by_x: ByX::new(&airframes),
            airframes,
            airframe_faults: scenario.schedule().airframe_faults(),
            obstacles: scenario.all_obstacles().iter().map(|one| Obstacle::new(one, approach_s)).collect(),
            intruders: (1..)
                .zip(&scenario.intruders)
                .map(|(number, section)| Intruder::new(number, section, approach_s))
                .collect(),
            radar: Radar::new(scenario),
            rate_hz: scenario.time.rate_hz,
            sensing_range_m: scenario.sensing.range_m,
            traffic_range_m: scenario.control.collision_filter.then_some(scenario.sensing.traffic_range_m),
        }
    }

    /// The tick that the airframes have reached.
    pub fn now(&self) -> Tick {
        self.now
    }

    /// Every airframe, UAV 1 first.
    pub fn airframes(&self) -> &[Airframe] {
        &self.airframes
    }

    /// What `uav` senses now, `None` once it has left the sky.
    pub fn senses(&self, uav: UavId) -> Option<Sensed> {
        let airframe = &self.airframes[uav.index()];
        if !airframe.is_flying() {
            return None;
        }
        let (obstacles, obstacle_count, obstacles_omitted) = self.obstacles_near(airframe);
        let rates = airframe.rates();
        let (pose, (speed_m_s, turn_rate_rad_s), [position_age_ticks, heading_age_ticks]) =
            match self.sensors.get(uav.index()) {
                None => (self.apparent_pose(airframe), rates, [0; 2]),
                Some(one) => (one.pose(), one.rates(self.now, rates), one.ages_ticks(self.now)),
            };
        Some(Sensed {
            tick: self.now,
            position_m: pose.position.into(),
            heading_rad: pose.heading_rad,
            speed_m_s,
            turn_rate_rad_s,
            uav,
            mode: airframe.mode(),
            obstacle_count,
            obstacles_omitted,
            obstacles,
            position_age_ticks,
            heading_age_ticks,
        })
    }

    /// Where `airframe` seems to be, to sensors that may drift.
    fn apparent_pose(&self, airframe: &Airframe) -> Pose {
        let period_s = 1.0 / f64::from(self.rate_hz);
        drifted(airframe.pose(), &self.airframe_faults, airframe.uav(), self.now, period_s)
    }

    /// Reads the sensors of every UAV.
    fn read_sensors(&mut self) {
        // Taken out for the loop, because each UAV's pose comes from the rest of the sky.
        let mut sensors = std::mem::take(&mut self.sensors);
        for (one, airframe) in sensors.iter_mut().zip(&self.airframes) {
            one.advance(self.now, &self.apparent_pose(airframe));
        }
        self.sensors = sensors;
    }

    /// The obstacles whose edge is in range, nearest first; their count; and the count of those that did not fit.
    fn obstacles_near(&self, airframe: &Airframe) -> ([SensedObstacle; MAX_SENSED_OBSTACLES], u32, u32) {
        let own = airframe.pose().position;
        // An empty list, the usual case, allocates nothing. The distance is negative inside an obstacle, which sorts first.
        let mut near: Vec<(f64, &Obstacle)> = self
            .obstacles
            .iter()
            .map(|obstacle| (obstacle.to_edge_m(&own), obstacle))
            .filter(|(distance_m, _)| *distance_m <= self.sensing_range_m)
            .collect();
        // A stable sort: at equal distances the scenario's order decides.
        near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut sensed = [SensedObstacle::default(); MAX_SENSED_OBSTACLES];
        for (place, (_, obstacle)) in sensed.iter_mut().zip(&near) {
            *place = obstacle.sensed();
        }
        let count = near.len().min(MAX_SENSED_OBSTACLES);
        (sensed, count as u32, (near.len() - count) as u32)
    }

    /// The other aircraft near `uav` now; `None` once it has left the sky, and while no UAV has a collision filter.
    pub fn traffic(&self, uav: UavId) -> Option<Traffic> {
        let range_m = self.traffic_range_m.filter(|_| self.airframes[uav.index()].is_flying())?;
        let own = self.airframes[uav.index()].pose().position;
        let mut nearest = Nearest::none();
        for other in self.by_x.others(uav, range_m) {
            // Squares are enough to compare, and this runs for every pair of UAVs that are near in x, in every tick.
            let squared_m2 = (other.position - own).norm_squared();
            if squared_m2 <= range_m * range_m && self.airframes[other.uav.index()].is_flying() {
                nearest.add(squared_m2, Aircraft::Uav(other.uav));
            }
        }
        for intruder in &self.intruders {
            let (squared_m2, range_m) =
                ((intruder.position() - own).norm_squared(), intruder.range_m(range_m, &self.radar));
            if squared_m2 <= range_m * range_m {
                nearest.add(squared_m2, Aircraft::Intruder(intruder.id()));
            }
        }
        Some(self.report_of(uav, &nearest))
    }

    fn report_of(&self, uav: UavId, nearest: &Nearest) -> Traffic {
        let mut traffic = Traffic {
            tick: self.now,
            uav,
            aircraft_count: nearest.count as u32,
            aircraft_omitted: nearest.omitted,
            reserved: 0,
            aircraft: [SensedAircraft::default(); MAX_SENSED_AIRCRAFT],
        };
        for (place, (_, other)) in traffic.aircraft_mut().iter_mut().zip(&nearest.found) {
            *place = match *other {
                Aircraft::Uav(other) => self.sensed_aircraft(other),
                Aircraft::Intruder(IntruderId(number)) => {
                    // Intruders are numbered from 1 in the order of the list.
                    self.intruders[number as usize - 1].sensed(uav, self.now, &self.radar)
                }
            };
        }
        traffic
    }

    fn sensed_aircraft(&self, uav: UavId) -> SensedAircraft {
        let airframe = &self.airframes[uav.index()];
        let (speed_m_s, turn_rate_rad_s) = airframe.rates();
        // A transponder tells whether somebody flies the aircraft. Only the path of one that nobody flies is an arc.
        let is_answering = airframe.is_answering(self.now);
        SensedAircraft {
            position_m: airframe.pose().position.into(),
            heading_rad: airframe.pose().heading_rad,
            speed_m_s,
            turn_rate_rad_s: if is_answering { 0.0 } else { turn_rate_rad_s },
            who: AircraftId::uav(uav),
            is_answering: u32::from(is_answering),
        }
    }

    /// Replaces the faults of airframes, those of the scenario included.
    pub fn set_airframe_faults(&mut self, faults: Vec<AirframeFault>) {
        self.airframe_faults = faults;
    }

    /// Offers a command to the airframe of UAV `to`.
    pub fn accept(&mut self, to: UavId, command: &Command) -> Result<(), Refusal> {
        self.airframes[to.index()].accept(command, self.now)
    }

    /// Flies all airframes to the next tick. Returns failsafes that took over, UAV 1 first, then collisions that began
    /// and near misses that are over, each in the order of UAVs.
    pub fn step(&mut self) -> Vec<Event> {
        let mut events = Vec::new();
        for airframe in self.airframes.iter_mut().filter(|airframe| airframe.is_flying()) {
            // Hardly any flight has such faults, and every tick comes here for every UAV.
            if !self.airframe_faults.is_empty() {
                airframe.break_as(&self.airframe_faults, self.now);
            }
            if airframe.step(self.now) {
                events.push(Event::Failsafe { uav: airframe.uav(), mode: airframe.mode() });
            }
        }
        self.now = self.now.next();
        let time_s = self.now.seconds(self.rate_hz);
        self.obstacles.iter_mut().for_each(|obstacle| obstacle.move_to(time_s));
        self.intruders.iter_mut().for_each(|intruder| intruder.move_to(time_s));
        self.read_sensors();
        // Only now is everything at the same tick.
        self.by_x.update(&self.airframes);
        let near = self.collisions.near(&self.airframes, &self.by_x, &self.intruders);
        for (uav, with) in self.collisions.begun(&self.airframes, &self.obstacles, &near) {
            let position_m = self.airframes[uav.index()].pose().position.into();
            events.push(Event::Collision { uav, with, position_m });
        }
        events.extend(self.encounters.observe(self.now, &near));
        events
    }

    /// The near misses that are not over yet, because the flight ends here.
    pub fn end_encounters(&mut self) -> Vec<Event> {
        self.encounters.end()
    }
}

/// The nearest aircraft so far, nearest first. Each tick builds one for each UAV, so it never allocates.
struct Nearest {
    /// Squared distance, and who it is.
    found: [(f64, Aircraft); MAX_SENSED_AIRCRAFT],
    count: usize,
    omitted: u32,
}

impl Nearest {
    fn none() -> Self {
        // No UAV has number 0. Entries from `count` on are never read.
        Self { found: [(f64::INFINITY, Aircraft::Uav(UavId(0))); MAX_SENSED_AIRCRAFT], count: 0, omitted: 0 }
    }

    /// Puts `who` in its place. At equal distances the lower number is the nearer, and a UAV is nearer than an intruder: the report
    /// must not depend on the order in which they are added.
    fn add(&mut self, squared_m2: f64, who: Aircraft) {
        let place = self.found[..self.count].partition_point(|known| *known <= (squared_m2, who));
        if self.count == MAX_SENSED_AIRCRAFT {
            self.omitted += 1;
            if place == MAX_SENSED_AIRCRAFT {
                return;
            }
        } else {
            self.count += 1;
        }
        // In a full list this brings the farthest one to `place`, where the newcomer takes its entry.
        self.found[place..self.count].rotate_right(1);
        self.found[place] = (squared_m2, who);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::Collider;
    use ringwing_scenario::{IntruderSection, ObstacleSection, fault::schedule::AirframeFailure};

    fn mast(number: u32, x: f64) -> ObstacleSection {
        ObstacleSection::standing(format!("mast {number}"), [x, 0.0], 1.0, 5.0)
    }

    fn sky_at_origin(obstacles: Vec<ObstacleSection>) -> Sky {
        let mut scenario = Scenario { obstacles, ..Scenario::default() };
        scenario.formation.uavs = 3;
        let at = |x: f64| StartState { position_m: [x, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[at(0.0), at(1000.0), at(2000.0)]);
        sky.step();
        sky
    }

    #[test]
    fn the_nearest_obstacles_in_range_are_sensed_and_the_others_counted() {
        let sky = sky_at_origin((1..=12).rev().map(|n| mast(n, f64::from(n) * 10.0)).collect());
        let senses = sky.senses(UavId(1)).unwrap();
        let x: Vec<f64> = senses.obstacles().iter().map(|obstacle| obstacle.position_m[0]).collect();
        assert_eq!(x, [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0]);
        assert_eq!(senses.obstacles_omitted, 4);
    }

    #[test]
    fn an_obstacle_that_moves_is_sensed_where_it_is_with_its_velocity() {
        let drifting = ObstacleSection { velocity_m_s: [0.0, 2.0], ..mast(1, 40.0) };
        let mut sky = sky_at_origin(vec![drifting]);
        (0..100).for_each(|_| drop(sky.step()));
        let senses = sky.senses(UavId(1)).unwrap();
        let [sensed] = senses.obstacles() else { panic!("one obstacle") };
        assert!((sensed.position_m[1] - 2.0).abs() < 1e-9 && (sensed.position_m[0] - 40.0).abs() < 1e-9);
        assert!((sensed.velocity_m_s[1] - 2.0).abs() < 1e-9);
    }

    #[test]
    fn an_obstacle_that_moves_can_run_into_a_uav() {
        // It comes from the side and reaches the UAV's path as the UAV does, after 0.4 s.
        let crossing = ObstacleSection {
            waypoints_m: vec![[6.0, 0.0]],
            waypoint_speed_m_s: 10.0,
            position_m: [6.0, 4.0],
            ..mast(1, 6.0)
        };
        let mut sky = sky_at_origin(vec![crossing]);
        let events: Vec<_> = (0..45).flat_map(|_| sky.step()).collect();
        let hit = |one: &Event| matches!(one, Event::Collision { with: Collider::Obstacle(0), .. });
        assert!(events.iter().any(hit), "{events:?}");
    }

    #[test]
    fn an_obstacle_is_sensed_once_its_edge_is_in_range() {
        let sky = sky_at_origin(vec![mast(1, 150.9), mast(2, 151.1)]);
        assert_eq!(sky.senses(UavId(1)).unwrap().obstacles().len(), 1);
    }

    /// A sky with UAVs at these places on the x axis, whose filters are on.
    fn sky_with_traffic(x_m: &[f64]) -> Sky {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = x_m.len() as u32;
        scenario.control.collision_filter = true;
        let at = |x: &f64| StartState { position_m: [*x, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &x_m.iter().map(at).collect::<Vec<_>>());
        sky.step();
        sky
    }

    /// A UAV's number; 100 and more for an intruder.
    fn number(who: AircraftId) -> u32 {
        match who.who() {
            Aircraft::Uav(uav) => uav.0,
            Aircraft::Intruder(intruder) => 100 + intruder.0,
        }
    }

    fn sensed_numbers(sky: &Sky, uav: u32) -> Vec<u32> {
        sky.traffic(UavId(uav)).unwrap().aircraft().iter().map(|aircraft| number(aircraft.who)).collect()
    }

    #[test]
    fn the_nearest_aircraft_in_range_are_sensed_and_the_others_counted() {
        let places: Vec<f64> = (0..12).rev().map(|number| f64::from(number) * 10.0).collect();
        let sky = sky_with_traffic(&places);
        assert_eq!(sensed_numbers(&sky, 12), [11, 10, 9, 8, 7, 6, 5, 4]);
        assert_eq!(sky.traffic(UavId(12)).unwrap().aircraft_omitted, 3);
        assert_eq!(sensed_numbers(&sky_with_traffic(&[0.0, 119.9, -120.1]), 1), [2]);
    }

    #[test]
    fn intruders_are_sensed_among_the_others_each_in_the_range_of_its_kind() {
        let mut scenario = Scenario::default();
        scenario.control.collision_filter = true;
        scenario.sensing.radar_range_m = 50.0;
        let intruder = |x_m: f64, cooperative| IntruderSection {
            position_m: [x_m, 0.0],
            heading_deg: 0.0,
            speed_m_s: 15.0,
            cooperative,
            turn_rate_rad_s: 0.0,
            waypoints_m: Vec::new(),
            repeat: false,
        };
        scenario.intruders =
            vec![intruder(100.0, true), intruder(49.0, false), intruder(51.0, false), intruder(121.0, true)];
        let at = |x_m: f64| StartState { position_m: [x_m, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[0.0, 80.0, 400.0, 800.0, 900.0, 1000.0].map(at));
        sky.step();
        assert_eq!(sensed_numbers(&sky, 1), [102, 2, 101]);
    }

    #[test]
    fn a_uav_collides_with_an_intruder() {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        scenario.intruders = vec![IntruderSection {
            position_m: [30.0, 0.0],
            heading_deg: 180.0,
            speed_m_s: 15.0,
            cooperative: false,
            turn_rate_rad_s: 0.0,
            waypoints_m: Vec::new(),
            repeat: false,
        }];
        let at = |x_m: f64| StartState { position_m: [x_m, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[0.0, 500.0, 1000.0].map(at));
        let events: Vec<_> = (0..150).flat_map(|_| sky.step()).collect();
        let hits: Vec<_> = events
            .iter()
            .filter_map(|event| match event {
                Event::Collision { uav, with, .. } => Some((*uav, *with)),
                _ => None,
            })
            .collect();
        assert_eq!(hits, [(UavId(1), Collider::Intruder(IntruderId(1)))]);
    }

    #[test]
    fn without_a_filter_nobody_senses_traffic() {
        assert_eq!(sky_at_origin(Vec::new()).traffic(UavId(1)), None);
    }

    #[test]
    fn the_turn_rate_of_an_aircraft_is_sensed_once_its_agent_is_silent() {
        let mut sky = sky_with_traffic(&[0.0, 50.0, 500.0]);
        let turn = Command::new(sky.now(), UavId(2), 15.0, 0.3);
        sky.accept(UavId(2), &turn).unwrap();
        let sensed = |sky: &Sky| sky.traffic(UavId(1)).unwrap().aircraft()[0];
        sky.step();
        assert_eq!((sensed(&sky).is_answering, sensed(&sky).turn_rate_rad_s), (1, 0.0));
        (0..10).for_each(|_| drop(sky.step()));
        assert_eq!((sensed(&sky).is_answering, sensed(&sky).turn_rate_rad_s), (0, 0.3), "it flies on");
    }

    #[test]
    fn a_vanished_uav_senses_nothing_and_collides_with_nothing() {
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
    fn a_failure_of_an_airframe_that_is_added_in_flight_acts_on_its_own_uav_while_it_lasts() {
        let mut sky = sky_at_origin(Vec::new());
        let begin = Tick(sky.now().0 + 2);
        let failure = AirframeFailure::Weak(13.0);
        sky.set_airframe_faults(vec![AirframeFault {
            number: 1,
            uav: UavId(2),
            begin,
            end: Some(begin.next()),
            failure,
        }]);
        let speeds = [(); 4].map(|()| {
            sky.step();
            [0, 1].map(|index: usize| sky.airframes()[index].rates().0)
        });
        assert_eq!(speeds, [[15.0, 15.0], [15.0, 15.0], [15.0, 13.0], [15.0, 15.0]]);
    }

    #[test]
    fn a_near_miss_that_lasts_to_the_end_of_the_flight_is_reported_there() {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        let at = |y: f64| StartState { position_m: [0.0, y], heading_deg: 0.0, speed_m_s: 15.0 };
        let mut sky = Sky::new(&scenario, &[at(0.0), at(5.0), at(100.0)]);
        assert_eq!((0..10).flat_map(|_| sky.step()).count(), 0);
        let events = sky.end_encounters();
        let [Event::NearMiss { uav, with, distance_m, .. }] = events.as_slice() else {
            panic!("{events:?}");
        };
        assert_eq!((*uav, *with, *distance_m), (UavId(1), Collider::Uav(UavId(2)), 5.0));
    }

    #[test]
    fn a_collision_event_has_the_uav_the_obstacle_and_the_position() {
        let mut sky = sky_at_origin(vec![mast(1, 4.0)]);
        let events: Vec<_> = (0..40).flat_map(|_| sky.step()).collect();
        let [Event::Collision { uav, with, position_m }] = events.as_slice() else {
            panic!("{events:?}");
        };
        assert_eq!((*uav, *with), (UavId(1), Collider::Obstacle(0)));
        assert!((position_m[0] - 3.0).abs() < 0.15 + 1e-9);
    }
}
