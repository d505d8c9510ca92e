//! A whole flight from the pilots alone: airframes and leader are a few lines here, so that links can be as bad as is
//! wanted, and hundreds of flights take seconds.

use nalgebra::Point2;
use ringwing_agent::Pilot;
use ringwing_flight::{
    Account, FlightMode, LeaderState, Pose, Sensed, SensedObstacle, Tick, UavId, UavState,
    payload::MAX_SENSED_OBSTACLES,
};
use ringwing_scenario::{Obstacle, Scenario, Setting, Source, StartState, start};
use std::collections::BTreeMap;

/// What all links between neighbours do to messages.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Weather {
    /// Beyond the one tick that processes cost.
    pub(crate) delay_ticks: i64,
    /// At most so much more, by chance: messages overtake each other.
    pub(crate) jitter_ticks: i64,
    /// Of 100 messages so many are lost.
    pub(crate) loss: i64,
    /// Of 100 messages so many come twice.
    pub(crate) duplicates: i64,
    /// Mean length of outages, and of the times between them; none when 0.
    pub(crate) outage_ticks: i64,
    pub(crate) between_ticks: i64,
}

/// A swarm in flight.
pub(crate) struct Flight {
    pub(crate) scenario: Scenario,
    pub(crate) weather: Weather,
    pub(crate) now: Tick,
    /// Those whose agent runs.
    pub(crate) pilots: Vec<Option<Pilot>>,
    pub(crate) airframes: Vec<Airframe>,
    /// Own senses come so much later.
    pub(crate) senses_late_ticks: usize,
    /// The leader says nothing.
    pub(crate) is_leader_silent: bool,
    leader: Vec<LeaderState>,
    sensed: Vec<Vec<Sensed>>,
    accounts: Vec<Option<Account>>,
    /// Receiver and message, by when they arrive.
    under_way: BTreeMap<Tick, Vec<(usize, UavState)>>,
    /// Whether the link from one to another is out.
    out: Vec<Vec<bool>>,
    chance: u64,
}

/// One UAV's body: Eq. (1), and the failsafe of an agent that is silent.
#[derive(Debug, Clone)]
pub(crate) struct Airframe {
    pub(crate) pose: Pose,
    pub(crate) speed_m_s: f64,
    pub(crate) turn_rate_rad_s: f64,
    commanded: Tick,
}

/// `control.law=resilient` and `settings`, on the paper's first scenario.
pub(crate) fn scenario(law: &str, settings: &[&str]) -> Scenario {
    let texts = [format!("control.law={law}")].into_iter().chain(settings.iter().map(ToString::to_string));
    let settings: Vec<_> = texts.map(|text| Setting::parse(&text).expect("a setting")).collect();
    let mut scenario = preset("paper-4.1", &settings);
    scenario.start.uavs.clear();
    scenario
}

impl Flight {
    /// From drawn starts.
    pub(crate) fn new(scenario: Scenario, weather: Weather) -> Self {
        let starts = start::places(&scenario).expect("room for all");
        let airframe = |start: &StartState| {
            let pose =
                Pose { position: start.position_m.into(), heading_rad: start.heading_deg.to_radians() };
            let pose = pose.after(start.speed_m_s, 0.0, -scenario.period_s());
            Airframe { pose, speed_m_s: start.speed_m_s, turn_rate_rad_s: 0.0, commanded: Tick::APPROACH }
        };
        let count = scenario.formation.uavs;
        Self {
            weather,
            now: Tick::APPROACH,
            pilots: UavId::all(count).map(|uav| Some(Pilot::new(&scenario, uav))).collect(),
            airframes: starts.iter().map(airframe).collect(),
            senses_late_ticks: 0,
            is_leader_silent: false,
            leader: Vec::new(),
            sensed: vec![Vec::new(); count as usize],
            accounts: vec![None; count as usize],
            under_way: BTreeMap::new(),
            out: vec![vec![false; count as usize]; count as usize],
            chance: scenario.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
            scenario,
        }
    }

    /// From the formation at rest.
    pub(crate) fn at_rest(mut scenario: Scenario, weather: Weather) -> Self {
        let (formation, centre) = (scenario.formation(), Point2::from(scenario.leader.start_m));
        let state = |number| StartState {
            position_m: formation.slot(number, centre).into(),
            heading_deg: 0.0,
            speed_m_s: scenario.leader.speed_m_s,
        };
        scenario.start.uavs = (1..=formation.count()).map(state).collect();
        Self::new(scenario, weather)
    }

    pub(crate) fn kill(&mut self, numbers: &[u32]) {
        for number in numbers {
            self.pilots[*number as usize - 1] = None;
        }
    }

    pub(crate) fn restart(&mut self, numbers: &[u32]) {
        for number in numbers {
            self.pilots[*number as usize - 1] = Some(Pilot::new(&self.scenario, UavId(*number)));
        }
    }

    pub(crate) fn step(&mut self) {
        let leader = self.leader_at(self.now);
        self.deliver();
        for index in 0..self.pilots.len() {
            let senses = self.senses(index);
            self.sensed[index].push(senses);
            let Some(pilot) = &mut self.pilots[index] else { continue };
            if let Some(senses) = self.sensed[index].iter().rev().nth(self.senses_late_ticks) {
                pilot.receive_sensed(senses);
            }
            if let (Some(state), false) = (self.leader.last(), self.is_leader_silent) {
                pilot.receive_leader(state);
            }
            if let Some(decision) = pilot.fly(self.now) {
                let airframe = &mut self.airframes[index];
                airframe.speed_m_s = decision.command.speed_m_s;
                airframe.turn_rate_rad_s = decision.command.turn_rate_rad_s;
                airframe.commanded = self.now;
                self.accounts[index] = Some(decision.account);
                self.send(index, decision.state);
            }
        }
        self.leader.push(leader);
        self.move_on();
    }

    fn deliver(&mut self) {
        let now = self.now;
        for (receiver, state) in self.under_way.remove(&now).unwrap_or_default() {
            if let Some(pilot) = &mut self.pilots[receiver] {
                pilot.receive_state(&state, now);
            }
        }
    }

    fn send(&mut self, from: usize, state: UavState) {
        for to in 0..self.pilots.len() {
            let listens = self.pilots[to].as_ref().is_some_and(|pilot| pilot.listened().contains(&state.uav));
            let is_out = self.is_out(from, to);
            let copies = 1 + u32::from(self.draw(100) < self.weather.duplicates);
            for _ in 0..copies {
                let late = self.weather.delay_ticks + self.draw(self.weather.jitter_ticks + 1);
                if listens && !is_out && self.draw(100) >= self.weather.loss {
                    self.under_way.entry(Tick(self.now.0 + 1 + late)).or_default().push((to, state));
                }
            }
        }
    }

    /// Gilbert and Elliott's two states.
    fn is_out(&mut self, from: usize, to: usize) -> bool {
        let Weather { outage_ticks, between_ticks, .. } = self.weather;
        if outage_ticks > 0 {
            let mean = if self.out[from][to] { outage_ticks } else { between_ticks };
            self.out[from][to] ^= self.draw(mean) == 0;
        }
        self.out[from][to]
    }

    fn draw(&mut self, below: i64) -> i64 {
        self.chance ^= self.chance << 13;
        self.chance ^= self.chance >> 7;
        self.chance ^= self.chance << 17;
        (self.chance >> 11).cast_signed() % below
    }

    fn move_on(&mut self) {
        let (period_s, timeout_s) = (self.scenario.period_s(), self.scenario.airframe.command_timeout_s);
        for airframe in &mut self.airframes {
            if self.now.since(airframe.commanded) as f64 * period_s >= timeout_s {
                (airframe.speed_m_s, airframe.turn_rate_rad_s) = (12.0, 0.25);
            }
            airframe.pose = airframe.pose.after(airframe.speed_m_s, airframe.turn_rate_rad_s, period_s);
        }
        self.now = self.now.next();
    }

    fn senses(&self, index: usize) -> Sensed {
        let airframe = &self.airframes[index];
        let mut obstacles = [SensedObstacle::default(); MAX_SENSED_OBSTACLES];
        for (place, obstacle) in obstacles.iter_mut().zip(&self.scenario.obstacles) {
            let Obstacle { position_m, radius_m, braking_distance_m, .. } = *obstacle;
            *place = SensedObstacle { position_m, radius_m, braking_distance_m };
        }
        Sensed {
            tick: self.now,
            position_m: airframe.pose.position.into(),
            heading_rad: airframe.pose.heading_rad,
            speed_m_s: airframe.speed_m_s,
            turn_rate_rad_s: airframe.turn_rate_rad_s,
            uav: UavId(index as u32 + 1),
            mode: FlightMode::COMMANDED,
            obstacle_count: self.scenario.obstacles.len() as u32,
            obstacles_omitted: 0,
            obstacles,
        }
    }

    fn leader_at(&self, tick: Tick) -> LeaderState {
        let time_s = tick.0 as f64 * self.scenario.period_s();
        let ringwing_scenario::Leader { start_m, speed_m_s, .. } = self.scenario.leader;
        LeaderState {
            tick,
            position_m: [start_m[0] + speed_m_s * time_s, start_m[1]],
            heading_rad: 0.0,
            speed_m_s,
            turn_rate_rad_s: 0.0,
        }
    }

    /// Flies for `duration_s`, showing each moment on the way to `see`.
    pub(crate) fn fly(&mut self, duration_s: f64, mut see: impl FnMut(&Self)) {
        for _ in 0..(duration_s / self.scenario.period_s()).round() as i64 {
            self.step();
            see(self);
        }
    }

    /// Each living UAV's distance from its slot in the ring of those who live in truth.
    pub(crate) fn slot_errors_m(&self) -> Vec<f64> {
        let mut ring = self.scenario.whole_ring();
        ring.reform(|number| self.pilots[number as usize - 1].is_some());
        let centre = Point2::from(self.leader_at(self.now).position_m);
        let error = |index: usize| {
            let slot = centre + ring.slot(index as u32 + 1).offset();
            (self.airframes[index].pose.position - slot).norm()
        };
        self.living().map(error).collect()
    }

    pub(crate) fn slot_error_max_m(&self) -> f64 {
        self.slot_errors_m().into_iter().fold(0.0, f64::max)
    }

    pub(crate) fn living(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.pilots.len()).filter(|index| self.pilots[*index].is_some())
    }

    /// How far the two are apart that are closest, of those that live, or of all.
    pub(crate) fn closest_m(&self, living_only: bool) -> f64 {
        let counts = |index: &usize| !living_only || self.pilots[*index].is_some();
        let places: Vec<_> =
            (0..self.pilots.len()).filter(counts).map(|index| self.airframes[index].pose.position).collect();
        let pairs = places
            .iter()
            .enumerate()
            .flat_map(|(index, one)| places[..index].iter().map(move |other| one - other));
        pairs.map(|apart| apart.norm()).fold(f64::INFINITY, f64::min)
    }

    /// Flies for `duration_s`, and tells when all errors were below `bound_m` for good.
    pub(crate) fn recovery(&mut self, duration_s: f64, bound_m: f64) -> Recovery {
        let (began, mut broken) = (self.now, self.now);
        let mut recovery =
            Recovery { whole_s: 0.0, closest_m: f64::INFINITY, closest_of_all_m: f64::INFINITY };
        self.fly(duration_s, |flight| {
            if flight.slot_error_max_m() >= bound_m {
                broken = flight.now;
            }
            recovery.closest_m = recovery.closest_m.min(flight.closest_m(true));
            recovery.closest_of_all_m = recovery.closest_of_all_m.min(flight.closest_m(false));
        });
        recovery.whole_s = broken.since(began) as f64 * self.scenario.period_s();
        recovery
    }

    /// The root of the mean of the squared slot errors.
    pub(crate) fn slot_error_rms_m(&self) -> f64 {
        let errors = self.slot_errors_m();
        (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
    }

    /// How far the nearest of the living is from an obstacle's edge.
    pub(crate) fn clearance_m(&self) -> f64 {
        let to_edge = |obstacle: &Obstacle, index: usize| {
            (self.airframes[index].pose.position - Point2::from(obstacle.position_m)).norm()
                - obstacle.radius_m
        };
        let all = self
            .scenario
            .obstacles
            .iter()
            .flat_map(|one| self.living().map(move |index| to_edge(one, index)));
        all.fold(f64::INFINITY, f64::min)
    }

    /// Whether each of the living holds just the living for living.
    pub(crate) fn all_agree_with_the_truth(&self) -> bool {
        let number = self.living().count() as u32;
        let said: Vec<_> = self
            .living()
            .map(|index| self.accounts[index].map(|account| (account.living, account.lost_fingerprint)))
            .collect();
        said.iter().all(|one| one.is_some_and(|(living, _)| living == number) && *one == said[0])
    }

    /// Whether all of the living say that they hear no leader.
    pub(crate) fn says_that_the_leader_is_silent(&self) -> bool {
        self.living().all(|index| self.accounts[index].is_some_and(|account| account.leader_silent == 1))
    }
}

/// How a swarm came to be whole again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recovery {
    pub(crate) whole_s: f64,
    /// The closest two of the living.
    pub(crate) closest_m: f64,
    /// The closest two of all that fly, those that loiter without an agent among them.
    pub(crate) closest_of_all_m: f64,
}

/// The two of the paper's Section 4.2.
pub(crate) fn obstacles_of_the_paper() -> Vec<Obstacle> {
    preset("paper-4.2", &[]).obstacles
}

fn preset(name: &str, settings: &[Setting]) -> Scenario {
    Scenario::read(&Source::find(name).expect("a preset"), settings).expect("a sound scenario")
}
