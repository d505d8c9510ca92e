//! Measures the flight: a fold over its frames and events, on plain numbers.
//!
//! The same flight gives the same numbers to the bit, whether live, simulated or read from a log. Only UAVs that fly
//! on command count as members of the formation; every airframe in the sky counts for distances between UAVs and to
//! obstacles.
//!
//! Must never know a log, a clock or a process, and must never use what the log does not hold.

mod agreement;
mod avoidance;
mod chance;
mod coherence;
mod deviation;
mod envelope;
mod errors;
mod estimation;
mod fault_effects;
mod frame;
mod hold;
mod intruders;
mod keeping;
mod links;
mod lyapunov;
mod obstacles;
mod pairs;
mod recovery;
mod ring;
mod settling;
mod summary;
mod verdict;

pub use avoidance::Avoidance;
pub use chance::{ChanceEvent, UnplannedLoss};
pub use coherence::Coherence;
pub use deviation::{Deviation, Deviations, OFF_COURSE_M, UavDeviation, deviation_m};
pub use fault_effects::{FaultEffects, IdleFault};
pub use frame::{
    AirframeSample, AvoidedThing, ControlTerms, Frame, MeasuredFlight, TickSamples, TrueState, UavFrame,
};
pub use links::LinkTotals;
pub use pairs::{Pairs, UavPair};
pub use recovery::FaultRecovery;
pub use ring::FlownRing;
pub use summary::{ClosestPair, FlightSummary, IntruderSummary, ObstacleSummary, UavSummary};
pub use verdict::{Verdict, judge};

use agreement::AgreementWatch;
use avoidance::AvoidanceWatch;
use chance::ChanceWatch;
use envelope::Envelope;
use errors::FormationErrors;
use estimation::EstimationWatch;
use fault_effects::EffectWatch;
use hold::Wholeness;
use intruders::IntruderWatch;
use keeping::KeepingWatch;
use links::LinkTally;
use lyapunov::LyapunovWatch;
use nalgebra::Point2;
use obstacles::ObstacleWatch;
use pairs::ClosestSoFar;
use recovery::{Disturbance, Recoveries, RecoveryWatch};
use ringwing_flight::{Event, FlightMode, Tick, TimedEvent};
use ringwing_scenario::{ManoeuvreSection, Scenario};
use settling::Settling;

/// The swarm at one moment. A value that does not exist is absent, never 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moment {
    /// The tick.
    pub tick: i64,
    /// Number of UAVs that fly on command.
    pub commanded: u32,
    /// The largest slot error among them.
    pub slot_error_max_m: Option<f64>,
    /// The root mean square of their slot errors.
    pub slot_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours that both fly on command. As for all errors here, neighbours and
    /// slots are those of the frame's ring, which may have closed after a loss.
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |`.
    pub radius_error_max_m: Option<f64>,
    /// The UAVs that are closest to each other.
    pub closest: Pairs,
    /// The smallest distance to the edge of an obstacle; negative inside.
    pub clearance_m: Option<f64>,
    /// The smallest distance of a UAV from an intruder.
    pub intruder_distance_m: Option<f64>,
    /// What the collision filters do.
    pub avoidance: Avoidance,
    /// Number of near misses so far.
    pub near_misses: u64,
    /// How well the swarm holds together.
    pub coherence: Coherence,
    /// V of Eq. (7), from the true states of the UAVs that fly on command.
    pub lyapunov_m2: Option<f64>,
    /// Number of different views of who is alive: 1 where all agents agree.
    pub views: u32,
    /// Number of ticks so far in which V rose although no UAV was saturated or repelled.
    pub lyapunov_rises: u64,
}

/// Everything measured of a flight so far.
#[derive(Debug, Clone)]
pub struct Metrics {
    rate_hz: u32,
    moment: Moment,
    settling: Settling,
    recovery: RecoveryWatch,
    effects: EffectWatch,
    chance: ChanceWatch,
    /// Disturbances whose tick has not come yet.
    disturbances: Vec<Disturbance>,
    agreement: AgreementWatch,
    closest: ClosestSoFar,
    keeping: KeepingWatch,
    estimation: EstimationWatch,
    obstacles: Vec<ObstacleWatch>,
    intruders: Vec<IntruderWatch>,
    avoidance: AvoidanceWatch,
    near_misses: u64,
    lyapunov: LyapunovWatch,
    commands: Commands,
    envelope: Option<Envelope>,
    links: LinkTally,
    ticks: u64,
    lost: u64,
    uavs: Vec<UavSummary>,
    /// The positions of all airframes in the sky, with their UAVs' numbers; kept to reuse its memory.
    sky: Vec<(u32, Point2<f64>)>,
}

/// Counts of commands.
#[derive(Debug, Clone, Copy, Default)]
struct Commands {
    all: u64,
    speed_saturated: u64,
    turn_rate_saturated: u64,
}

impl Metrics {
    /// The metrics of a flight of `scenario`, before its first frame.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            rate_hz: scenario.time.rate_hz,
            moment: Moment::default(),
            settling: Settling::new(scenario.time.rate_hz),
            recovery: RecoveryWatch::new(scenario.time.rate_hz),
            chance: ChanceWatch::new(scenario),
            effects: EffectWatch::new(scenario),
            disturbances: manoeuvres(scenario),
            agreement: AgreementWatch::default(),
            closest: ClosestSoFar::default(),
            keeping: KeepingWatch::new(scenario),
            estimation: EstimationWatch::new(scenario),
            obstacles: scenario
                .all_obstacles()
                .iter()
                .map(|one| ObstacleWatch::new(one, scenario.time.rate_hz))
                .collect(),
            intruders: (1..)
                .zip(&scenario.intruders)
                .map(|(number, one)| IntruderWatch::new(number, one, scenario.time.rate_hz))
                .collect(),
            avoidance: AvoidanceWatch::new(scenario),
            near_misses: 0,
            lyapunov: LyapunovWatch::new(scenario),
            commands: Commands::default(),
            envelope: None,
            links: LinkTally::default(),
            ticks: 0,
            lost: 0,
            uavs: Vec::new(),
            sky: Vec::new(),
        }
    }

    /// Takes an event. It counts from its own tick on, whether it comes before or after the frame of that tick.
    pub fn on_event(&mut self, event: &TimedEvent) {
        self.effects.on_event(event);
        self.chance.on_event(event);
        self.near_misses += u64::from(matches!(event.event, Event::NearMiss { .. }));
        if !event.event.is_disturbance() {
            return;
        }
        // No disturbance involves an obstacle, so its text needs no obstacle's name.
        let text = event.event.text(|_| String::new());
        self.disturbances.push(Disturbance { tick: event.tick.0, text, is_fault: true });
        // An event may be reported after the frame of its tick. Apply it now, because the flight may have no further
        // frame.
        if let Some(last) = self.last_tick() {
            self.apply_disturbances(last);
        }
    }

    /// Measures recovery from the disturbances up to `tick`, in order of time.
    fn apply_disturbances(&mut self, tick: i64) {
        // Reports do not come in order: the schedule announces faults ahead of time, and a loss may be noticed late.
        self.disturbances.sort_by_key(|disturbance| disturbance.tick);
        let due = self.disturbances.partition_point(|disturbance| disturbance.tick <= tick);
        for disturbance in self.disturbances.drain(..due) {
            self.recovery.on_disturbance(&disturbance);
        }
    }

    /// The tick of the last frame.
    fn last_tick(&self) -> Option<i64> {
        (self.ticks > 0).then_some(self.moment.tick)
    }

    /// Takes the next frame; frames come in order.
    pub fn observe(&mut self, frame: &Frame) {
        self.ticks += 1;
        // Before the errors of this tick, which already belong to the recovery from its faults.
        self.apply_disturbances(frame.tick);
        self.note_airframes(frame);
        // Before `measure`, which uses the views.
        self.agreement.observe(frame);
        self.moment = self.measure(frame);
        self.moment.lyapunov_m2 = self.lyapunov.observe(frame, self.moment.commanded);
        self.moment.lyapunov_rises = self.lyapunov.rises();
        let wholeness = Wholeness::of(self.moment.commanded, self.moment.slot_error_max_m);
        self.settling.observe(frame.tick, wholeness);
        self.recovery.observe(frame.tick, wholeness);
        self.closest.observe(frame.tick, &self.moment.closest);
        for control in frame.uavs.iter().filter_map(|uav| uav.control.as_ref()) {
            self.commands.observe(control);
        }
        frame.links.iter().for_each(|counts| self.links.observe(counts));
        self.effects.observe(frame);
    }

    /// Notes the position, speed and turn rate of every airframe in the sky.
    fn note_airframes(&mut self, frame: &Frame) {
        self.sky.clear();
        self.uavs.clear();
        // In one loop, because a frame of 200 UAVs does not fit into the fastest cache: each loop loads it again.
        for state in in_the_sky(frame) {
            self.sky.push((state.uav, state.position()));
            self.envelope.get_or_insert_with(|| Envelope::of(state)).widen(state);
            self.uavs.push(UavSummary::of(state));
        }
    }

    /// Sets the number of ticks so far whose frames are missing.
    pub fn set_lost(&mut self, ticks: u64) {
        self.lost = ticks;
    }

    /// The swarm in the last frame.
    pub fn moment(&self) -> &Moment {
        &self.moment
    }

    fn measure(&mut self, frame: &Frame) -> Moment {
        let mut errors = FormationErrors::default();
        frame.all_commanded().for_each(|state| errors.observe(state, frame));
        self.keeping.observe(frame.tick, &errors);
        self.estimation.observe(frame);
        let (tick, sky) = (frame.tick, &mut self.sky);
        Moment {
            tick,
            commanded: errors.commanded,
            slot_error_max_m: errors.slot_max_m,
            slot_error_rms_m: errors.slot_rms_m(),
            neighbour_error_max_m: errors.neighbour_max_m,
            radius_error_max_m: errors.radius_max_m,
            closest: Pairs::among(sky, &frame.ring),
            clearance_m: self.obstacles.iter_mut().filter_map(|one| one.observe(tick, sky)).reduce(f64::min),
            intruder_distance_m: self
                .intruders
                .iter_mut()
                .filter_map(|one| one.observe(tick, sky))
                .reduce(f64::min),
            avoidance: self.avoidance.observe(frame),
            near_misses: self.near_misses,
            coherence: Coherence::of(frame, self.agreement.views()),
            views: self.agreement.views(),
            // V depends on the tick before, so `observe` adds it and its rises.
            ..Moment::default()
        }
    }

    /// The flight in numbers, up to the last frame.
    pub fn summary(&self) -> FlightSummary {
        let share = |part: u64| (self.commands.all > 0).then(|| part as f64 / self.commands.all as f64);
        let seconds = |tick: i64| Tick(tick).seconds(self.rate_hz);
        let Recoveries { faults, moments, cut_short, longest_s, listed } = self.recovery.recoveries();
        FlightSummary {
            settling_s: self.settling.settled_at().map(seconds),
            whole_since_s: self.settling.unfinished_since().map(seconds),
            commanded: self.moment.commanded,
            slot_error_max_m: self.moment.slot_error_max_m,
            slot_error_rms_m: self.moment.slot_error_rms_m,
            keeping_error_rms_m: self.keeping.rms_m(),
            estimate_error_rms_m: self.estimation.rms_m(),
            neighbour_error_max_m: self.moment.neighbour_error_max_m,
            radius_error_max_m: self.moment.radius_error_max_m,
            closest_pair: self.closest.pair(self.rate_hz),
            closest_adjacent: self.closest.adjacent(self.rate_hz),
            closest_other: self.closest.other(self.rate_hz),
            obstacles: self.obstacles.iter().filter_map(ObstacleWatch::summary).collect(),
            intruders: self.intruders.iter().filter_map(IntruderWatch::summary).collect(),
            near_misses: self.near_misses,
            filter_share: self.avoidance.share(),
            filter_episodes: self.avoidance.episodes(),
            filter_longest_s: self
                .avoidance
                .longest_ticks()
                .map(|ticks| ticks as f64 / f64::from(self.rate_hz)),
            filter_turn_mean_deg: self.avoidance.turn_rad().mean().map(f64::to_degrees),
            filter_turn_max_deg: self.avoidance.turn_rad().max().map(f64::to_degrees),
            filter_speed_mean_m_s: self.avoidance.speed_m_s().mean(),
            filter_speed_max_m_s: self.avoidance.speed_m_s().max(),
            speed_saturated_share: share(self.commands.speed_saturated),
            turn_rate_saturated_share: share(self.commands.turn_rate_saturated),
            speed_min_m_s: self.envelope.map(|flown| flown.speed_min_m_s),
            speed_max_m_s: self.envelope.map(|flown| flown.speed_max_m_s),
            turn_rate_max_rad_s: self.envelope.map(|flown| flown.turn_rate_max_rad_s),
            views: self.moment.views,
            disagreed_until_s: self.agreement.disagreed_at().map(seconds),
            faults,
            fault_moments: moments,
            recoveries: listed,
            recoveries_cut_short: cut_short,
            recovery_max_s: longest_s,
            unplanned_losses: self.chance.losses(),
            unplanned_loss_list: self.chance.listed_losses(),
            chance_events: self.chance.chances(),
            chance_event_list: self.chance.listed_chances(),
            broke_lockstep: self.chance.broke_lockstep(),
            fault_effects: self.effects.effects(&self.links.totals()),
            ticks: self.ticks,
            ticks_lost: self.lost,
            last_tick: self.last_tick(),
            links: self.links.totals(),
            uavs: self.uavs.clone(),
        }
    }
}

/// The manoeuvres of `scenario`, from which the formation has to recover as from a fault.
fn manoeuvres(scenario: &Scenario) -> Vec<Disturbance> {
    let numbered = (1..).zip(&scenario.manoeuvres);
    let disturbance = |(number, manoeuvre): (u32, &ManoeuvreSection)| Disturbance {
        tick: scenario.tick_at(manoeuvre.at_s).0,
        text: format!("manoeuvre {number}: {}", manoeuvre.text()),
        is_fault: false,
    };
    numbered.map(disturbance).collect()
}

impl Commands {
    fn observe(&mut self, control: &ControlTerms) {
        self.all += 1;
        self.speed_saturated += u64::from(control.speed_saturated);
        self.turn_rate_saturated += u64::from(control.turn_rate_saturated);
    }
}

/// The airframes that can come close to something. An airframe with a number that is not finite has no position and is
/// left out.
fn in_the_sky(frame: &Frame) -> impl Iterator<Item = &TrueState> {
    let is_somewhere = |state: &&TrueState| {
        let numbers = [state.x_m, state.y_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s];
        state.mode != FlightMode::VANISHED && numbers.iter().all(|number| number.is_finite())
    };
    frame.uavs.iter().filter_map(|uav| uav.state.as_ref()).filter(is_somewhere)
}

#[cfg(test)]
mod tests;
