//! Which faults had an effect, measured: of links from what their receivers report, of processes from the events.
//!
//! Must never guess: a fault counts as having acted only if something says that it did. A fault without effect is listed
//! with the reason, as far as the flight shows one.

use super::{Frame, LinkTotals};
use ringwing_flight::{Event, LinkSource, Part, ProcessAction, ProcessState, Tick, TimedEvent, UavId};
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{
        ProcessFault, Targets, idle_reason,
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
                self.note_state(*part, state_after(*part, *action));
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
        self.acted.extend(frame.links.iter().map(|counts| counts.acted).filter(|number| *number > 0));
        for slow in self.slow.iter().filter(|slow| slow.is_on(now)) {
            // A process that does not run is not slow.
            if !self.absent.contains_key(&slow.part) {
                self.acted.insert(slow.number);
            }
        }
        let broken = self.airframes.iter().filter(|fault| fault.is_on(now) && hinders(fault, frame));
        self.acted.extend(broken.map(|fault| fault.number));
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

/// What `action`, which was applied to `part`, leaves.
fn state_after(part: Part, action: ProcessAction) -> ProcessState {
    match action {
        ProcessAction::Start | ProcessAction::Thaw => ProcessState::Running,
        ProcessAction::Freeze => ProcessState::Frozen,
        // The launcher replaces a recorder at once, and only agents and the leader matter here.
        ProcessAction::Kill { .. } | ProcessAction::Stop if part == Part::Recorder => ProcessState::Running,
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
mod tests {
    use super::*;
    use crate::testing;

    fn scenario(sentences: &[&str]) -> Scenario {
        let mut scenario = testing::ring_of(6, 40.0);
        scenario.time.rate_hz = 100;
        scenario.faults = sentences.iter().map(|text| text.parse().unwrap()).collect();
        scenario
    }

    /// What became of the faults of a flight of `ticks` in which these `events` happened, and in which the links reported
    /// the effects of the faults in `acted`.
    fn effects(sentences: &[&str], ticks: i64, events: &[(i64, Event)], acted: &[u32]) -> FaultEffects {
        let scenario = scenario(sentences);
        let mut watch = EffectWatch::new(&scenario);
        for tick in 0..ticks {
            let of_tick = events.iter().filter(|(at, _)| *at == tick);
            of_tick.for_each(|(at, event)| {
                watch.on_event(&TimedEvent { tick: Tick(*at), event: event.clone() });
            });
            let mut frame = testing::at_rest(&scenario, tick);
            let report = |number| LinkTotals { link: "2->3".into(), acted: number, ..LinkTotals::default() };
            frame.links = acted.iter().map(|number| report(*number)).collect();
            watch.observe(&frame);
        }
        watch.effects(&[LinkTotals { link: "2->3".into(), ..LinkTotals::default() }])
    }

    fn applied(part: Part, action: ProcessAction, sentence: &str) -> Event {
        Event::ProcessFault { part, action, sentence: sentence.into() }
    }

    const UAV_3: Part = Part::Agent(UavId(3));
    const KILL: ProcessAction = ProcessAction::Kill { returns: false };

    fn reasons(effects: &FaultEffects) -> Vec<&str> {
        effects.without_effect.iter().map(|idle| idle.reason.as_str()).collect()
    }

    #[test]
    fn a_process_fault_acts_if_an_event_says_so() {
        let refused = |why: &str| Event::FaultRefused {
            part: Some(UAV_3),
            why: why.into(),
            sentence: "kill uav 3".into(),
        };
        let faults = ["at 0.01 s kill uav 3", "at 0.05 s kill uav 3", "at 9 s kill uav 2"];
        let events = [(1, applied(UAV_3, KILL, "kill uav 3")), (5, refused("is gone already"))];
        let effects = effects(&faults, 10, &events, &[]);
        assert_eq!((effects.asked, effects.acted), (3, 1));
        assert_eq!(
            reasons(&effects),
            ["uav 3 is gone already", "it begins after the end of the flight at 0.09 s"]
        );
        assert_eq!(effects.without_effect[0].fault, "at 50 ms kill uav 3");
    }

    #[test]
    fn a_link_fault_acts_if_its_receiver_says_so() {
        let faults = [
            "at 0 s link 2->3 loss 1 %",
            "at 0 s link 2->3 loss 5 %",
            "at 0 s link 2->5 blackout",
            "at 0 s link 2->3 delay 4 ms",
        ];
        let effects = effects(&faults, 10, &[], &[0, 2]);
        assert_eq!((effects.asked, effects.acted), (4, 1));
        assert_eq!(
            reasons(&effects),
            [
                "it altered no sample while it lasted",
                "nobody listened on such a link",
                "4 ms rounds to no tick at 100 Hz"
            ]
        );
    }

    #[test]
    fn a_link_whose_end_is_gone_is_told_from_one_that_lost_nothing() {
        let events = [(1, applied(UAV_3, KILL, "kill uav 3"))];
        let faults = ["at 0.01 s kill uav 3", "at 0.05 s link 2->3 blackout"];
        assert_eq!(
            reasons(&effects(&faults, 10, &events, &[])),
            ["the sender or the receiver was not running"]
        );
    }

    #[test]
    fn a_healing_acts_if_there_is_something_to_heal_and_a_slow_fault_if_its_agent_runs() {
        let faults = [
            "at 0 s link 2->3 blackout",
            "at 0.05 s heal all",
            "at 0.06 s heal all",
            "at 0 s slow uav 3 by 1 ms",
        ];
        let result = effects(&faults, 10, &[], &[1]);
        assert_eq!((result.acted, reasons(&result)), (3, vec!["there was nothing to heal"]));
        let gone = [(0, applied(UAV_3, KILL, "kill uav 3"))];
        let late = ["at 0 s kill uav 3", "at 0.05 s slow uav 3 by 1 ms"];
        assert_eq!(reasons(&effects(&late, 10, &gone, &[])), ["no such agent was running"]);
    }

    #[test]
    fn a_failure_of_an_airframe_acts_if_the_agent_asks_for_what_it_cannot_do() {
        // At rest every agent asks for 15 m/s, straight on.
        let faults = [
            "at 0 s weaken uav 3 to 14 m/s",
            "at 0 s weaken uav 3 to 16 m/s",
            "at 0 s jam uav 2 turn at 5 deg/s",
            "at 0 s jam uav 2 turn at 0 deg/s",
        ];
        let result = effects(&faults, 10, &[], &[]);
        assert_eq!((result.asked, result.acted), (4, 2));
        assert_eq!(reasons(&result), ["no agent asked its airframe for what it could not do"; 2]);
    }

    #[test]
    fn a_failure_takes_nothing_from_an_airframe_that_flies_at_its_limits() {
        let acted = |sentence: &str, speed_m_s: f64, turn_rate_rad_s: f64| {
            let scenario = scenario(&[sentence]);
            let mut watch = EffectWatch::new(&scenario);
            let mut frame = testing::at_rest(&scenario, 0);
            let control = frame.uavs[2].control.as_mut().unwrap();
            (control.speed_command_m_s, control.turn_rate_command_rad_s) = (speed_m_s, turn_rate_rad_s);
            watch.observe(&frame);
            watch.effects(&[]).acted == 1
        };
        // The airframe flies at 12 m/s at least, and turns at 0.5 rad/s at most.
        assert!(!acted("at 0 s weaken uav 3 to 5 m/s", 12.0, 0.0));
        assert!(acted("at 0 s weaken uav 3 to 5 m/s", 12.1, 0.0));
        assert!(!acted("at 0 s jam uav 3 turn at 40 deg/s", 15.0, 0.5));
        assert!(acted("at 0 s jam uav 3 turn at 40 deg/s", 15.0, 0.4));
    }

    #[test]
    fn a_fault_that_is_asked_for_live_counts_like_one_of_the_scenario() {
        let requested = |sentence: &str| Event::FaultRequested { sentence: sentence.into() };
        // The scenario's fault with the same words comes later, so the event belongs to the live one.
        let events = [
            (2, requested("at 20 ms kill uav 3")),
            (2, applied(UAV_3, KILL, "kill uav 3")),
            (3, requested("at 30 ms link 2->3 delay trace {1")),
            (4, requested("at 40 ms link 2->3 blackout")),
        ];
        let effects = effects(&["at 5 s kill uav 3"], 10, &events, &[4]);
        assert_eq!((effects.asked, effects.acted), (4, 2));
        let idle: Vec<&str> = effects.without_effect.iter().map(|idle| idle.fault.as_str()).collect();
        assert_eq!(idle, ["at 5 s kill uav 3", "at 30 ms link 2->3 delay trace {1"]);
        assert!(reasons(&effects)[1].starts_with("its sentence is too long"));
    }

    #[test]
    fn a_requirement_that_every_fault_acts_names_the_first_that_did_not() {
        let idle = IdleFault { fault: "at 9 s kill uav 3".into(), reason: "uav 3 is gone already".into() };
        let effects = FaultEffects { asked: 3, acted: 1, without_effect: vec![idle.clone(), idle] };
        assert_eq!(judge(false, &effects), None);
        assert_eq!(judge(true, &FaultEffects::default()), None);
        assert_eq!(
            judge(true, &effects).unwrap(),
            "without effect: at 9 s kill uav 3 (uav 3 is gone already), and 1 more; required that every fault acts"
        );
    }
}
