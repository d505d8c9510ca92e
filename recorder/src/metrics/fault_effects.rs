//! Which faults had an effect, measured: of links from what their receivers report, of processes from the events.
//!
//! Must never guess: a fault counts as having acted only if something says that it did. A fault without effect is listed
//! with the reason, as far as the flight shows one.

use super::{Frame, LinkTotals, MeasuredFlight};
use ringwing_flight::{Event, LinkSource, Part, ProcessAction, ProcessState, Tick, TimedEvent, UavId};
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{
        ProcessFault, SensorDrift, Targets, idle_reason,
        schedule::{AirframeFailure, AirframeFault, LinkFault, SlowAnswers},
    },
};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// What became of the faults of a flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FaultEffects {
    /// Number of faults asked for, in the scenario and during the flight.
    pub asked: u64,
    /// Number of those that had an effect.
    pub acted: u64,
    /// The others.
    pub without_effect: Vec<IdleFault>,
}

/// A fault without any effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct IdleFault {
    /// The fault as a sentence, with its time.
    pub fault: String,
    /// Why it had no effect.
    pub reason: String,
}

/// The violation of a requirement that every fault acts, if one did not.
pub(super) fn judge(is_required: bool, effects: &FaultEffects) -> Option<String> {
    let idle = effects.without_effect.first().filter(|_| is_required)?;
    let IdleFault { fault, reason } = idle;
    let more = effects.without_effect.len() - 1;
    let others = if more > 0 { format!(", and {more} more") } else { String::new() };
    Some(format!("without effect: {fault} ({reason}){others}; required that every fault acts"))
}

/// Watches what the faults of a flight do.
#[derive(Debug, Clone)]
pub(super) struct EffectWatch {
    /// Its faults grow during the flight: those that are asked for live come last.
    scenario: Scenario,
    /// The sentences of the faults, in the order of their numbers.
    sentences: Vec<String>,
    acted: BTreeSet<u32>,
    /// The planned actions of each process and sentence that no event has reported yet, in order of ticks: the numbers of
    /// their faults.
    planned: BTreeMap<(Part, String), Vec<(Tick, u32)>>,
    /// Why actions were refused, by fault.
    refusals: BTreeMap<u32, Vec<String>>,
    /// Processes that do not run now.
    absent: BTreeMap<Part, ProcessState>,
    links: Vec<LinkFault>,
    slow: Vec<SlowAnswers>,
    airframes: Vec<AirframeFault>,
    /// What the sensors of each UAV said in the tick before, UAV 1 first.
    measured: Vec<Option<MeasuredFlight>>,
    /// Link faults during which both ends of one of their links ran in some tick.
    crossed: BTreeSet<u32>,
    last_tick: Option<Tick>,
}

impl EffectWatch {
    /// The faults of `scenario`, before the flight.
    pub(super) fn new(scenario: &Scenario) -> Self {
        let mut watch = Self {
            scenario: scenario.clone(),
            sentences: scenario.faults.iter().map(Fault::to_string).collect(),
            acted: BTreeSet::new(),
            planned: BTreeMap::new(),
            refusals: BTreeMap::new(),
            absent: BTreeMap::new(),
            links: Vec::new(),
            slow: Vec::new(),
            airframes: Vec::new(),
            measured: vec![None; scenario.formation.uavs as usize],
            crossed: BTreeSet::new(),
            last_tick: None,
        };
        // Events name a process and a sentence, not a fault. Two faults with the same sentence act in the order of their ticks.
        for scheduled in scenario.schedule().scheduled_actions() {
            let key = (scheduled.part, scheduled.sentence);
            watch.planned.entry(key).or_default().push((scheduled.tick, scheduled.number));
        }
        watch.renew_schedule();
        watch
    }

    fn renew_schedule(&mut self) {
        let schedule = self.scenario.schedule();
        self.links = schedule.link_faults();
        self.slow = schedule.slow_answers();
        self.airframes = schedule.airframe_faults();
        // What an airframe cannot do anyway, no failure takes away.
        for fault in &mut self.airframes {
            fault.failure = fault.failure.within(&self.scenario.airframe);
        }
    }

    /// Takes an event.
    pub(super) fn on_event(&mut self, timed: &TimedEvent) {
        match &timed.event {
            Event::FaultRequested { sentence } => self.add_fault(sentence),
            Event::ProcessFault { part, action, sentence } => {
                let number = self.reported(*part, sentence);
                self.acted.extend(number);
                self.note_state(*part, state_after(*action));
            }
            Event::FaultRefused { part: Some(part), why, sentence } => {
                if let Some(number) = self.reported(*part, sentence) {
                    self.refusals.entry(number).or_default().push(format!("{part} {why}"));
                }
            }
            Event::ProcessLost { part, .. } => self.note_state(*part, ProcessState::Gone),
            Event::ProcessFrozen { part } => self.note_state(*part, ProcessState::Frozen),
            Event::ProcessReady { part } | Event::ProcessThawed { part } => {
                self.note_state(*part, ProcessState::Running);
            }
            _ => {}
        }
    }

    /// Adds a fault that was asked for during the flight.
    fn add_fault(&mut self, sentence: &str) {
        self.sentences.push(sentence.to_owned());
        // A sentence that was too long for its event cannot be read. A fault of no process keeps its number.
        let nobody = Targets::Uavs(Vec::new());
        let action = Action::Process { fault: ProcessFault::Thaw, targets: nobody };
        let unknown = || Fault { at_s: f64::INFINITY, action };
        let fault = sentence.parse().unwrap_or_else(|_| unknown());
        let number = self.sentences.len() as u32;
        let alone = self.scenario.schedule_of(std::slice::from_ref(&fault)).scheduled_actions();
        for scheduled in alone {
            let planned = self.planned.entry((scheduled.part, scheduled.sentence)).or_default();
            planned.push((scheduled.tick, number));
            planned.sort_by_key(|(tick, _)| *tick);
        }
        self.scenario.faults.push(fault);
        self.renew_schedule();
    }

    /// The number of the fault whose action of `part` an event reports next.
    fn reported(&mut self, part: Part, sentence: &str) -> Option<u32> {
        let planned = self.planned.get_mut(&(part, sentence.to_owned()))?;
        (!planned.is_empty()).then(|| planned.remove(0).1)
    }

    fn note_state(&mut self, part: Part, state: ProcessState) {
        if state == ProcessState::Running {
            self.absent.remove(&part);
        } else {
            self.absent.insert(part, state);
        }
    }

    /// Takes the next frame, after the events of its tick.
    pub(super) fn observe(&mut self, frame: &Frame) {
        let now = Tick(frame.tick);
        self.last_tick = Some(now);
        // A link on which no fault has acted says 0, which is the number of no fault.
        self.acted.extend(frame.links.iter().map(|counts| counts.acted));
        for slow in self.slow.iter().filter(|slow| slow.is_on(now)) {
            // A process that does not run is not slow.
            if !self.absent.contains_key(&slow.part) {
                self.acted.insert(slow.number);
            }
        }
        let acts = |fault: &&AirframeFault| match fault.failure {
            AirframeFailure::Drifting(drift) => {
                misleads(fault, drift, frame, self.measured[fault.uav.index()].as_ref())
            }
            _ => hinders(fault, frame),
        };
        let broken = self.airframes.iter().filter(|fault| fault.is_on(now)).filter(acts);
        self.acted.extend(broken.map(|fault| fault.number));
        for (measured, uav) in self.measured.iter_mut().zip(&frame.uavs) {
            *measured = uav.state.and_then(|state| state.measured);
        }
        let uavs = self.scenario.formation.uavs;
        for fault in self.links.iter().filter(|fault| fault.is_on(now)) {
            // Once is enough, so the search through all pairs is rare.
            if !self.crossed.contains(&fault.number) && has_live_link(fault, uavs, &self.absent) {
                self.crossed.insert(fault.number);
            }
        }
    }

    /// What became of the faults; `totals` are the counts of all links with faults.
    pub(super) fn effects(&self, totals: &[LinkTotals]) -> FaultEffects {
        let idle_healings = self.scenario.schedule().idle_healings();
        let mut effects = FaultEffects { asked: self.sentences.len() as u64, ..FaultEffects::default() };
        for ((number, fault), sentence) in (1..).zip(&self.scenario.faults).zip(&self.sentences) {
            let has_healed = matches!(fault.action, Action::Heal(_))
                && !idle_healings.contains(&number)
                && self.is_reached(fault);
            if self.acted.contains(&number) || has_healed {
                effects.acted += 1;
            } else {
                let reason = self.reason(number, fault, totals);
                effects.without_effect.push(IdleFault { fault: sentence.clone(), reason });
            }
        }
        effects
    }

    fn is_reached(&self, fault: &Fault) -> bool {
        self.last_tick.is_some_and(|last| self.scenario.schedule().tick(fault.at_s) <= last)
    }

    /// Why the fault with this number had no effect.
    fn reason(&self, number: u32, fault: &Fault, totals: &[LinkTotals]) -> String {
        if !fault.at_s.is_finite() {
            return "its sentence is too long for the log, so its effect is not measured".into();
        }
        if !self.is_reached(fault) {
            let last_s = self.last_tick.unwrap_or(Tick(0)).seconds(self.scenario.time.rate_hz);
            return format!("it begins after the end of the flight at {last_s:.2} s");
        }
        match &fault.action {
            Action::Heal(_) => "there was nothing to heal".into(),
            Action::Process { .. } => match self.refusals.get(&number) {
                Some(refusals) => refusals.join(", "),
                None if matches!(fault.action, Action::Process { fault: ProcessFault::Drift { .. }, .. }) => {
                    "no agent flew with what the sensor said".into()
                }
                None if self.airframes.iter().any(|broken| broken.number == number) => {
                    "no agent asked its airframe for what it could not do".into()
                }
                None if self.slow.iter().any(|slow| slow.number == number) => {
                    "no such agent was running".into()
                }
                None => "the flight ended before it was applied".into(),
            },
            Action::Link { impairment, .. } => idle_reason(impairment, self.scenario.time.rate_hz)
                .unwrap_or_else(|| self.link_reason(number, totals)),
        }
    }

    fn link_reason(&self, number: u32, totals: &[LinkTotals]) -> String {
        let Some(fault) = self.links.iter().find(|fault| fault.number == number) else {
            return "it altered no sample".into();
        };
        let listened: BTreeSet<&str> = totals.iter().map(|total| total.link.as_str()).collect();
        if !has_link(fault, self.scenario.formation.uavs, |link| listened.contains(link)) {
            return "nobody listened on such a link".into();
        }
        // The most general reason comes last: each one before it explains why no sample could be altered.
        if !self.crossed.contains(&number) {
            return "the sender or the receiver was not running".into();
        }
        "it altered no sample while it lasted".into()
    }
}

/// Whether the agent asks its airframe in `frame` for something that it cannot do. Without a command there is nothing to hinder: a
/// failsafe flies slowly, and its circle counts as one.
fn hinders(fault: &AirframeFault, frame: &Frame) -> bool {
    let Some(uav) = frame.uavs.get(fault.uav.index()) else { return false };
    match (fault.failure, &uav.control, &uav.state) {
        (AirframeFailure::Weak(most_m_s), Some(control), Some(_)) => control.speed_command_m_s > most_m_s,
        // To the bit: a jam at just the rate that is commanded changes nothing.
        (AirframeFailure::Jammed(rate_rad_s), Some(control), Some(_)) => {
            control.turn_rate_command_rad_s != rate_rad_s
        }
        (AirframeFailure::Jammed(_), None, Some(_)) => true,
        _ => false,
    }
}

/// Whether an agent commands in `frame` with a reading that was taken while the sensor drifted; `before` is what the sensors said in the
/// tick before. A receiver may be slower than the flight, and a fix from before the fault has no error.
fn misleads(
    fault: &AirframeFault,
    drift: SensorDrift,
    frame: &Frame,
    before: Option<&MeasuredFlight>,
) -> bool {
    let of_uav = frame.uavs.get(fault.uav.index()).filter(|uav| uav.control.is_some());
    let Some(now) = of_uav.and_then(|uav| uav.state?.measured) else { return false };
    let is_new = match drift {
        SensorDrift::Position { .. } => before.is_none_or(|before| before.position_m != now.position_m),
        SensorDrift::Heading { rate_rad_s } => {
            rate_rad_s != 0.0 && before.is_none_or(|before| before.heading_rad != now.heading_rad)
        }
    };
    // The error begins at zero.
    is_new && frame.tick > fault.begin.0
}

/// What `action` leaves of an agent or of the leader. No link or slow answer depends on the recorder.
fn state_after(action: ProcessAction) -> ProcessState {
    match action {
        ProcessAction::Start | ProcessAction::Thaw => ProcessState::Running,
        ProcessAction::Freeze => ProcessState::Frozen,
        ProcessAction::Kill { .. } | ProcessAction::Stop => ProcessState::Gone,
    }
}

/// Whether both ends of a link of `fault` run, when the processes in `absent` do not.
fn has_live_link(fault: &LinkFault, uavs: u32, absent: &BTreeMap<Part, ProcessState>) -> bool {
    let runs = |part: Part| !absent.contains_key(&part);
    links(fault, uavs).any(|(from, to)| {
        let sends = match from {
            LinkSource::LEADER => runs(Part::Leader),
            LinkSource::OWN => true,
            uav => runs(Part::Agent(UavId(uav.number()))),
        };
        sends && runs(Part::Agent(to))
    })
}

fn has_link(fault: &LinkFault, uavs: u32, is_wanted: impl Fn(&str) -> bool) -> bool {
    links(fault, uavs).any(|(from, to)| is_wanted(&format!("{from}->{}", to.0)))
}

/// The links of `fault` in a swarm of `uavs`, whether anybody listens on them or not.
fn links(fault: &LinkFault, uavs: u32) -> impl Iterator<Item = (LinkSource, UavId)> {
    let sources = move || UavId::all(uavs).map(LinkSource::uav).chain([LinkSource::LEADER, LinkSource::OWN]);
    let pairs = UavId::all(uavs).flat_map(move |to| sources().map(move |from| (from, to)));
    pairs.filter(|(from, to)| fault.concerns(*from, *to))
}

#[cfg(test)]
mod tests;
