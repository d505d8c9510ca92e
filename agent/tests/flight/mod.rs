//! A whole flight from the pilots alone: airframes and leader are a few lines here, so that links can be as bad as is
//! wanted, and hundreds of flights take seconds.

use nalgebra::Point2;
use ringwing_agent::Pilot;
use ringwing_messages::{
    FlightMode, LeaderState, Sensed, SensedObstacle, Tick, UavId, UavState, payload::MAX_SENSED_OBSTACLES,
};
use ringwing_scenario::{LivingRing, Pose, Scenario, Setting, Source, start};

/// What all links between neighbours do to messages.
#[derive(Debug, Clone, Copy, Default)]
pub struct Weather {
    /// Beyond the one tick that processes cost.
    pub delay_ticks: i64,
    /// At most so much more, by chance: messages overtake each other.
    pub jitter_ticks: i64,
    /// Of 100 messages so many are lost.
    pub loss: u64,
    /// Of 100 messages so many come twice.
    pub duplicates: u64,
    /// Mean length of outages, and of the times between them; none when 0.
    pub outage_ticks: u64,
    pub between_ticks: u64,
}

/// A swarm in flight.
pub struct Flight {
    pub scenario: Scenario,
    pub weather: Weather,
    pub now: Tick,
    /// Those whose agent runs.
    pub pilots: Vec<Option<Pilot>>,
    pub airframes: Vec<Airframe>,
    /// The leader says nothing.
    pub is_leader_silent: bool,
    leader: Vec<LeaderState>,
    /// Arrival, receiver, message.
    under_way: Vec<(Tick, usize, UavState)>,
    /// Whether the link from one to another is out.
    out: Vec<Vec<bool>>,
    chance: u64,
}

/// One UAV's body: Eq. (1), and the failsafe of an agent that is silent.
#[derive(Debug, Clone)]
pub struct Airframe {
    pub pose: Pose,
    pub speed_m_s: f64,
    pub turn_rate_rad_s: f64,
    commanded: Tick,
}

/// `control.law=resilient` and `settings`, on the paper's first scenario.
pub fn scenario(law: &str, settings: &[&str]) -> Scenario {
    let texts = [format!("control.law={law}")].into_iter().chain(settings.iter().map(ToString::to_string));
    let settings: Vec<_> = texts.map(|text| Setting::parse(&text).unwrap()).collect();
    let mut scenario = Scenario::read(&Source::find("paper-4.1").unwrap(), &settings).unwrap();
    scenario.start.uavs.clear();
    scenario
}

impl Flight {
    /// From drawn starts.
    pub fn new(scenario: Scenario, weather: Weather) -> Self {
        let starts = start::places(&scenario).unwrap();
        let airframe = |start: &ringwing_scenario::StartState| {
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
            is_leader_silent: false,
            leader: Vec::new(),
            under_way: Vec::new(),
            out: vec![vec![false; count as usize]; count as usize],
            chance: scenario.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
            scenario,
        }
    }

    /// From the formation at rest.
    pub fn at_rest(mut scenario: Scenario, weather: Weather) -> Self {
        let (formation, centre) = (scenario.formation(), Point2::from(scenario.leader.start_m));
        let state = |number| ringwing_scenario::StartState {
            position_m: formation.slot(number, centre).into(),
            heading_deg: 0.0,
            speed_m_s: scenario.leader.speed_m_s,
        };
        scenario.start.uavs = (1..=formation.count()).map(state).collect();
        Self::new(scenario, weather)
    }

    pub fn kill(&mut self, number: u32) {
        self.pilots[number as usize - 1] = None;
    }

    pub fn restart(&mut self, number: u32) {
        self.pilots[number as usize - 1] = Some(Pilot::new(&self.scenario, UavId(number)));
    }

    pub fn step(&mut self) {
        let leader = self.leader_at(self.now);
        self.deliver();
        for index in 0..self.pilots.len() {
            let senses = self.senses(index);
            let Some(pilot) = &mut self.pilots[index] else { continue };
            pilot.sense(&senses);
            if let (Some(state), false) = (self.leader.last(), self.is_leader_silent) {
                pilot.hear_leader(state);
            }
            if let Some(decision) = pilot.fly(self.now) {
                let airframe = &mut self.airframes[index];
                airframe.speed_m_s = decision.command.speed_m_s;
                airframe.turn_rate_rad_s = decision.command.turn_rate_rad_s;
                airframe.commanded = self.now;
                self.send(index, decision.state);
            }
        }
        self.leader.push(leader);
        self.move_on();
    }

    fn deliver(&mut self) {
        let now = self.now;
        let (arrived, under_way): (Vec<_>, _) =
            std::mem::take(&mut self.under_way).into_iter().partition(|(at, ..)| *at <= now);
        self.under_way = under_way;
        for (_, receiver, state) in arrived {
            if let Some(pilot) = &mut self.pilots[receiver] {
                pilot.hear(&state, now);
            }
        }
    }

    fn send(&mut self, from: usize, state: UavState) {
        for to in 0..self.pilots.len() {
            let listens = self.pilots[to].as_ref().is_some_and(|pilot| pilot.listened().contains(&state.uav));
            let is_out = self.is_out(from, to);
            let copies = 1 + u32::from(self.draw(100) < self.weather.duplicates);
            for _ in 0..copies {
                let late = self.weather.delay_ticks + self.draw(self.weather.jitter_ticks as u64 + 1) as i64;
                if listens && !is_out && self.draw(100) >= self.weather.loss {
                    self.under_way.push((Tick(self.now.0 + 1 + late), to, state));
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

    fn draw(&mut self, below: u64) -> u64 {
        self.chance ^= self.chance << 13;
        self.chance ^= self.chance >> 7;
        self.chance ^= self.chance << 17;
        (self.chance >> 11) % below
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
            let ringwing_scenario::Obstacle { position_m, radius_m, braking_distance_m, .. } = *obstacle;
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
    pub fn fly(&mut self, duration_s: f64, mut see: impl FnMut(&Self)) {
        for _ in 0..(duration_s / self.scenario.period_s()).round() as i64 {
            self.step();
            see(self);
        }
    }

    /// Each living UAV's distance from its slot in the ring of those who live in truth.
    pub fn slot_errors_m(&self) -> Vec<f64> {
        let mut ring = LivingRing::whole(&self.scenario);
        if self.scenario.control.ring_closes {
            ring.reform(|number| self.pilots[number as usize - 1].is_some());
        }
        let centre = Point2::from(self.leader_at(self.now).position_m);
        let error = |index: usize| {
            let slot = centre + ring.slot(index as u32 + 1).offset();
            (self.airframes[index].pose.position - slot).norm()
        };
        self.living().map(error).collect()
    }

    pub fn slot_error_max_m(&self) -> f64 {
        self.slot_errors_m().into_iter().fold(0.0, f64::max)
    }

    pub fn living(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.pilots.len()).filter(|index| self.pilots[*index].is_some())
    }

    /// How far the two are apart that are closest, of those that live, or of all.
    pub fn closest_m(&self, living_only: bool) -> f64 {
        let counts = |index: &usize| !living_only || self.pilots[*index].is_some();
        let places: Vec<_> =
            (0..self.pilots.len()).filter(counts).map(|index| self.airframes[index].pose.position).collect();
        let pairs = places
            .iter()
            .enumerate()
            .flat_map(|(index, one)| places[..index].iter().map(move |other| one - other));
        pairs.map(|apart| apart.norm()).fold(f64::INFINITY, f64::min)
    }

    /// From `since` on: when all errors are below `bound_m` for good.
    pub fn whole_after(&mut self, duration_s: f64, bound_m: f64) -> (f64, f64, f64) {
        let (began, mut whole, mut closest, mut closest_of_all) =
            (self.now, self.now, f64::INFINITY, f64::INFINITY);
        self.fly(duration_s, |flight| {
            if flight.slot_error_max_m() >= bound_m {
                whole = flight.now;
            }
            closest = flight.closest_m(true).min(closest);
            closest_of_all = flight.closest_m(false).min(closest_of_all);
        });
        (whole.since(began) as f64 * self.scenario.period_s(), closest, closest_of_all)
    }
}
