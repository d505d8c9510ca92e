//! What one tick does to the flight: what each UAV senses, which commands the airframes take, and the report on it.
//!
//! The world's process and the simulation both drive a flight through [`Airspace`], so both run the same code and get
//! the same payload hash. The rules of a flight in lockstep, for tick k:
//!
//! 1. [`Airspace::open_tick`] senses for every UAV in the sky. All of it is published before the tick opens.
//! 2. Every running agent and the leader answer tick k, agents with a [`Command`] of tick k. A running agent answers
//!    every tick: if it does not know where its UAV is, it withholds its command, which is an answer too. The world
//!    waits for all of them, also for the agent of a UAV that has vanished.
//! 3. [`Airspace::take`] offers each command to its airframe when it arrives. The order does not matter, because no
//!    airframe depends on another one's command.
//! 4. [`Airspace::end_tick`] hashes the answers to tick k, UAV 1 first, whether or not the airframes took them.
//! 5. Unless tick k was the last one, [`Airspace::step`] flies all airframes to tick k + 1.
//!
//! Process faults of tick k + 1 happen between steps 5 and 1. An agent that is thawed there first answers the tick that
//! was open while it was frozen. That command is one tick late: it is offered to the airframe, whose own check decides,
//! but it is not an answer to the open tick and is not hashed.
//!
//! Never knows processes, services or clocks: the same commands give the same flight and the same hash, to the bit.

use crate::{Refusal, Sky, flight_hash::FlightHash};
use ringwing_flight::{Collision, Command, Event, Sensed, Tick, Traffic, Truth, UavId, WorldReport};
use ringwing_scenario::{Scenario, StartState, fault::schedule::AirframeFault};
use std::collections::BTreeSet;

/// The sky, and the account of the flight through it.
#[derive(Clone)]
pub struct Airspace {
    sky: Sky,
    /// The answer of each UAV to the open tick, UAV 1 first.
    answers: Vec<Option<Command>>,
    /// The UAVs whose controllers have wished for a number that is not finite.
    not_finite: BTreeSet<UavId>,
    /// What the answers of the tick that ended last say.
    news: Vec<Event>,
    hash: FlightHash,
    collisions: Vec<Collision>,
    failsafes: u32,
    refused_commands: u64,
    reused_commands: u64,
    rate_hz: u32,
    last_tick: Tick,
    /// The last tick that has ended.
    flown: Tick,
}

/// What one UAV senses in a tick, to be sent to its agent, and what only the log is told of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensing<'a> {
    /// Itself and the obstacles near it.
    pub sensed: &'a Sensed,
    /// The other aircraft near it, if it has a collision filter.
    pub traffic: Option<&'a Traffic>,
    /// How it truly flies. Nobody senses it.
    pub truth: &'a Truth,
}

/// How many airframes fly through a tick on a command of that tick, and how many on an older one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CommandCounts {
    /// Airframes that fly on a command of this tick. An answer without a command is not counted.
    pub answered: u32,
    /// Airframes that fly on an older command because none of this tick arrived, or because it was withheld.
    pub reused: u32,
}

impl Airspace {
    /// The airspace of `scenario` one tick before the flight begins, with UAVs on their way to `starts`.
    pub fn new(scenario: &Scenario, starts: &[StartState]) -> Self {
        let sky = Sky::new(scenario, starts);
        Self {
            answers: vec![None; sky.airframes().len()],
            sky,
            not_finite: BTreeSet::new(),
            news: Vec::new(),
            hash: FlightHash::new(),
            collisions: Vec::new(),
            failsafes: 0,
            refused_commands: 0,
            reused_commands: 0,
            rate_hz: scenario.time.rate_hz,
            last_tick: Tick(scenario.last_tick()),
            flown: Tick(Tick::APPROACH.0 - 1),
        }
    }

    /// The airframes and obstacles.
    pub fn sky(&self) -> &Sky {
        &self.sky
    }

    /// The open tick, or the next one to open.
    pub fn now(&self) -> Tick {
        self.sky.now()
    }

    /// The last tick that has ended; one before the approach if none has. A flight that is stopped between two ticks has
    /// [`now`](Self::now) at a tick that never opens.
    pub fn flown(&self) -> Tick {
        self.flown
    }

    /// Whether the scenario's last tick has come.
    pub fn is_over(&self) -> bool {
        self.now() >= self.last_tick
    }

    /// Hands over what each UAV in the sky senses, UAV 1 first, to be sent to its agent: itself, and the traffic if it has a
    /// collision filter. To be called once a tick, because all of it becomes part of the hash.
    pub fn open_tick(&mut self, mut publish: impl FnMut(Sensing<'_>)) {
        // By reference, because these are large, and a large swarm would copy hundreds of them in each tick.
        let Self { sky, hash, .. } = self;
        for airframe in sky.airframes() {
            let Some(sensed) = sky.senses(airframe.uav()) else { continue };
            let traffic = sky.traffic(airframe.uav());
            publish(Sensing { sensed: &sensed, traffic: traffic.as_ref(), truth: &airframe.truth() });
            sensed.for_hashed_bytes(|bytes| hash.take(bytes));
            if let Some(traffic) = &traffic {
                hash.take(bytemuck::bytes_of(traffic));
            }
        }
    }

    /// Hashes what was sensed and answered so far. The hash is the same without this call; a process makes it when it would
    /// only wait otherwise.
    pub fn catch_up(&mut self) {
        self.hash.catch_up();
    }

    /// Replaces the faults of airframes, those of the scenario included.
    pub fn set_airframe_faults(&mut self, faults: Vec<AirframeFault>) {
        self.sky.set_airframe_faults(faults);
    }

    /// Takes the command that arrived from the agent of UAV `to`, in time or late.
    ///
    /// A refused command leaves the airframe as it was. It still is the answer to its tick, unless another UAV sent it.
    pub fn take(&mut self, to: UavId, command: &Command) -> Result<(), Refusal> {
        let taken = self.sky.accept(to, command);
        self.refused_commands += u64::from(taken.is_err());
        if taken != Err(Refusal::NotItsOwn) && command.tick == self.now() {
            // An agent has one answer to each tick. The airframe refuses a second one as stale.
            self.answers[to.index()].get_or_insert(*command);
        }
        taken
    }

    /// Closes the tick: hashes its answers and counts which commands the airframes fly on.
    pub fn end_tick(&mut self) -> CommandCounts {
        // In the order of UAVs, not of arrival: the hash must not depend on scheduling.
        for command in self.answers.iter_mut().filter_map(Option::take) {
            self.hash.take(bytemuck::bytes_of(&command));
            // Once in a flight: a controller that is broken may do it in every tick.
            if command.is_not_finite() && self.not_finite.insert(command.uav) {
                self.news.push(Event::WishNotFinite { uav: command.uav });
            }
        }
        self.flown = self.now();
        let counts = self.count_commands();
        self.reused_commands += u64::from(counts.reused);
        counts
    }

    fn count_commands(&self) -> CommandCounts {
        let mut counts = CommandCounts::default();
        // An airframe in its failsafe flies on no command, neither new nor old.
        for airframe in self.sky.airframes().iter().filter(|airframe| airframe.is_commanded()) {
            if airframe.newest_command() == Some(self.now()) {
                counts.answered += 1;
            } else {
                counts.reused += 1;
            }
        }
        counts
    }

    /// Flies all airframes to the next tick. Returns what happened, in a fixed order, as of that tick.
    pub fn step(&mut self) -> Vec<Event> {
        let mut events = self.sky.step();
        if self.is_over() {
            // No later tick can end an encounter that still lasts, and its near miss would go unreported.
            events.extend(self.sky.end_encounters());
        }
        events.append(&mut self.news);
        let time_s = self.now().seconds(self.rate_hz);
        for event in &events {
            match *event {
                Event::Collision { uav, with, position_m } => {
                    self.collisions.push(Collision { time_s, uav, with, position_m });
                }
                Event::Failsafe { .. } => self.failsafes += 1,
                _ => {}
            }
        }
        events
    }

    /// The flight so far. The fields that need a wall clock are zero or empty: the world's process fills them in.
    pub fn report(&self) -> WorldReport {
        WorldReport {
            // Before the first tick ends, `flown` is a tick that does not exist.
            last_tick: self.flown.0.max(Tick::APPROACH.0),
            complete: self.is_over(),
            payload_hash: self.hash.digits(),
            collisions: self.collisions.clone(),
            failsafes: self.failsafes,
            refused_commands: self.refused_commands,
            reused_commands: self.reused_commands,
            missed_deadlines: 0,
            unanswered_ticks: 0,
            late_max_us: 0.0,
            latency: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::Failsafe;

    const UAVS: u32 = 3;

    fn scenario() -> Scenario {
        let mut scenario = Scenario::default();
        scenario.formation.uavs = UAVS;
        scenario
    }

    fn airspace_of(scenario: &Scenario) -> Airspace {
        let start = |x: f64| StartState { position_m: [x, 0.0], heading_deg: 0.0, speed_m_s: 15.0 };
        Airspace::new(scenario, &[start(0.0), start(1000.0), start(2000.0)])
    }

    fn airspace() -> Airspace {
        airspace_of(&scenario())
    }

    fn command(uav: u32, tick: Tick) -> Command {
        Command::new(tick, UavId(uav), 20.0, 0.1)
    }

    fn answer_all(airspace: &mut Airspace, uavs: impl Iterator<Item = u32>) {
        let now = airspace.now();
        for uav in uavs {
            airspace.take(UavId(uav), &command(uav, now)).unwrap();
        }
    }

    fn hash(airspace: &Airspace) -> String {
        airspace.report().payload_hash
    }

    #[test]
    fn the_hash_does_not_depend_on_the_order_in_which_commands_arrive() {
        let (mut one, mut other) = (airspace(), airspace());
        answer_all(&mut one, 1..=UAVS);
        answer_all(&mut other, (1..=UAVS).rev());
        assert_eq!(one.end_tick(), other.end_tick());
        assert_eq!(hash(&one), hash(&other));
    }

    #[test]
    fn the_hash_is_that_of_senses_and_answers_in_the_order_of_the_uavs() {
        let mut airspace = airspace();
        let mut expected = xxhash_rust::xxh3::Xxh3::new();
        for _ in 0..2 {
            let mut sensed: Vec<Sensed> = Vec::new();
            airspace.open_tick(|sensing| sensed.push(*sensing.sensed));
            for one in &sensed {
                // No obstacle moves here, and no reading is old: neither is hashed.
                let bytes = bytemuck::bytes_of(one);
                expected.update(&bytes[..64]);
                bytes[64..448].chunks(48).for_each(|obstacle| expected.update(&obstacle[..32]));
            }
            for uav in 1..=UAVS {
                expected.update(bytemuck::bytes_of(&command(uav, airspace.now())));
            }
            answer_all(&mut airspace, 1..=UAVS);
            airspace.end_tick();
            airspace.step();
        }
        assert_eq!(hash(&airspace), format!("{:032x}", expected.digest128()));
    }

    #[test]
    fn a_late_command_flies_but_is_not_hashed() {
        let (mut one, mut other) = (airspace(), airspace());
        let late = command(2, one.now());
        for airspace in [&mut one, &mut other] {
            answer_all(airspace, [1, 3].into_iter());
            airspace.end_tick();
            airspace.step();
        }
        one.take(UavId(2), &late).unwrap();
        assert_eq!(one.end_tick(), CommandCounts { answered: 0, reused: 3 });
        assert_eq!(hash(&one), hash(&other));
        let rates = |airspace: &Airspace| airspace.sky().airframes()[1].rates();
        assert_eq!([rates(&one), rates(&other)], [(20.0, 0.1), (15.0, 0.0)]);
    }

    #[test]
    fn a_withheld_command_is_an_answer_that_changes_nothing_in_the_sky() {
        let (mut one, mut silent) = (airspace(), airspace());
        one.take(UavId(2), &Command::withheld(one.now(), UavId(2))).unwrap();
        assert_eq!(one.end_tick(), silent.end_tick());
        assert_eq!(one.sky().airframes(), silent.sky().airframes());
        assert_ne!(hash(&one), hash(&silent));
        assert_eq!(one.report().refused_commands, 0);
    }

    #[test]
    fn a_wish_that_is_not_finite_is_named_once_and_in_the_order_of_the_uavs() {
        let mut airspace = airspace();
        let mut named = Vec::new();
        for _ in 0..3 {
            let now = airspace.now();
            for uav in [UavId(3), UavId(1)] {
                airspace.take(uav, &Command::not_finite(now, uav)).unwrap();
            }
            airspace.end_tick();
            named.extend(airspace.step());
        }
        assert_eq!(named, [1, 3].map(|uav| Event::WishNotFinite { uav: UavId(uav) }));
    }

    #[test]
    fn the_agent_of_a_vanished_uav_still_answers() {
        let mut scenario = scenario();
        scenario.airframe.failsafe = Failsafe::Vanish;
        let mut airspace = airspace_of(&scenario);
        while airspace.report().failsafes == 0 {
            airspace.end_tick();
            airspace.step();
        }
        airspace.open_tick(|sensing| panic!("{sensing:?}"));
        let before = hash(&airspace);
        let command = command(1, airspace.now());
        assert_eq!(airspace.take(UavId(1), &command), Err(Refusal::Vanished));
        assert_eq!(airspace.end_tick(), CommandCounts::default());
        assert_ne!(hash(&airspace), before);
    }

    #[test]
    fn only_the_first_answer_of_a_uav_counts_and_no_other_uav_can_give_it() {
        let (mut one, mut other) = (airspace(), airspace());
        answer_all(&mut one, 1..=UAVS);
        assert_eq!(other.take(UavId(1), &command(2, other.now())), Err(Refusal::NotItsOwn));
        answer_all(&mut other, 1..=UAVS);
        let second = Command { speed_m_s: 13.0, ..command(1, other.now()) };
        assert_eq!(other.take(UavId(1), &second), Err(Refusal::Stale));
        for airspace in [&mut one, &mut other] {
            assert_eq!(airspace.end_tick(), CommandCounts { answered: 3, reused: 0 });
        }
        assert_eq!(hash(&one), hash(&other));
        assert_eq!(other.report().refused_commands, 2);
    }

    #[test]
    fn an_airframe_in_its_failsafe_reuses_no_command() {
        let mut airspace = airspace();
        while airspace.report().failsafes == 0 {
            answer_all(&mut airspace, [1, 2].into_iter());
            assert_eq!(airspace.end_tick(), CommandCounts { answered: 2, reused: 1 });
            airspace.step();
        }
        answer_all(&mut airspace, [1, 2].into_iter());
        assert_eq!(airspace.end_tick(), CommandCounts { answered: 2, reused: 0 });
        assert_eq!(airspace.report().reused_commands, 51, "half a second of silence, from tick -1 on");
    }

    #[test]
    fn a_flight_is_complete_at_its_last_tick() {
        let mut scenario = scenario();
        scenario.time.duration_s = 0.1;
        let mut airspace = airspace_of(&scenario);
        while !airspace.is_over() {
            assert!(!airspace.report().complete);
            airspace.step();
        }
        assert_eq!((airspace.now(), airspace.report().complete), (Tick(10), true));
    }
}
