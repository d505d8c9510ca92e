//! Does to the run what was asked for: by the scenario, or by somebody while the run goes on.
//!
//! In lockstep the world holds each tick before which something is to be done, until it is: so it is done at exactly that
//! tick, whatever the scheduling. In real time it is done as soon as the tick has come.

use super::{LaunchError, Launcher, notice::Request};
use ringwing_bus::report;
use ringwing_flight::{Event, Part, ProcessAction, Roster, Tick, TimedEvent};
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{Delay, Links, Trouble, schedule::ScheduledAction},
};
use std::collections::VecDeque;

/// In real time, how long before it holds a fault of links is told to the agents.
const NOTICE_S: f64 = 0.1;
/// Ticks after a death until what it left is cleaned up: by then everybody has read what the dead one sent.
const READ_BY_ALL: i64 = 3;

/// What is to be done, and what is being done.
pub(super) struct Agenda {
    /// Who is still to be met, in order of ticks.
    due: VecDeque<ScheduledAction>,
    /// What was done and does not show yet.
    under_way: Vec<ScheduledAction>,
    /// What is to be told of links, in order of ticks; of the scenario's the recorder knows by itself.
    announcements: VecDeque<(TimedEvent, Author)>,
    /// Every fault so far; those added while the run goes on come last.
    faults: Vec<Fault>,
    added: Vec<Fault>,
    /// Waiting for the world to hold.
    requests: Vec<Request>,
    /// Waiting for what they asked for to be done: with what was refused of it.
    asking: Vec<(Request, Fault, Vec<String>)>,
    /// The tick that was set free last.
    released: Option<Tick>,
    clean_from: Option<Tick>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Author {
    Scenario,
    Request,
}

impl Agenda {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let schedule = scenario.schedule();
        Self {
            due: schedule.scheduled_actions().into(),
            under_way: Vec::new(),
            announcements: schedule.announcements().into_iter().map(|one| (one, Author::Scenario)).collect(),
            faults: scenario.faults.clone(),
            added: Vec::new(),
            requests: Vec::new(),
            asking: Vec::new(),
            released: None,
            clean_from: None,
        }
    }

    /// Whether something is being done that should show within moments.
    pub(super) fn is_busy(&self) -> bool {
        !(self.under_way.is_empty() && self.requests.is_empty() && self.asking.is_empty())
    }

    /// Whether something is being done to `part`.
    pub(super) fn is_meeting(&self, part: Part) -> bool {
        self.under_way.iter().any(|one| one.part == part)
    }

    /// Leaves what a process left behind to its readers for some ticks more.
    pub(super) fn clean_later(&mut self, now: Option<Tick>) {
        self.clean_from = now.map(|now| Tick(now.0 + READ_BY_ALL));
    }

    /// Takes those who are due at `now` and may be met together: the same is done to each.
    fn take_due(&mut self, now: Tick) -> Vec<ScheduledAction> {
        let kind = self.due.front().map(|first| std::mem::discriminant(&first.action));
        let together =
            |one: &&ScheduledAction| one.tick <= now.0 && Some(std::mem::discriminant(&one.action)) == kind;
        let count = self.due.iter().take_while(together).count();
        self.due.drain(..count).collect()
    }
}

impl Launcher<'_> {
    fn is_real_time(&self) -> bool {
        self.plan.scenario.time.real_time
    }

    /// The tick before which something can be done now.
    fn moment(&self) -> Option<Tick> {
        if self.is_real_time() { self.gate.tick() } else { self.gate.held() }
    }

    /// No tick from this one on may be opened yet.
    pub(super) fn free_before(&self) -> Tick {
        if self.is_real_time() {
            return Roster::empty().free_before;
        }
        if !self.agenda.requests.is_empty() {
            return Tick(i64::MIN);
        }
        self.agenda.due.front().map_or(Roster::empty().free_before, |first| Tick(first.tick))
    }

    /// Does what is due, as far as it can be done at this moment.
    pub(super) fn meet_faults(&mut self) -> Result<(), LaunchError> {
        self.tell_announcements()?;
        self.clean_up();
        let Some(now) = self.moment().filter(|now| self.agenda.released != Some(*now) || self.is_real_time())
        else {
            return Ok(());
        };
        self.consider_requests(now)?;
        while self.finish_batch(now)? {
            let batch = self.agenda.take_due(now);
            if batch.is_empty() {
                return self.set_free(now);
            }
            for one in batch {
                self.meet(one, now)?;
            }
        }
        Ok(())
    }

    /// Tells of what was done and shows by now; false while something does not.
    fn finish_batch(&mut self, now: Tick) -> Result<bool, LaunchError> {
        let crew = &self.crew;
        if !self.agenda.under_way.iter().all(|one| crew.has_met(one.part, one.action)) {
            return Ok(false);
        }
        for ScheduledAction { part, action, sentence, .. } in std::mem::take(&mut self.agenda.under_way) {
            self.log_event_at(now, Event::ProcessFault { part, action, sentence })?;
        }
        Ok(true)
    }

    fn meet(&mut self, one: ScheduledAction, now: Tick) -> Result<(), LaunchError> {
        let part = one.part;
        let Some(why) = self.crew.refusal(part, one.action) else {
            self.crew.meet(part, one.action)?;
            self.agenda.under_way.push(one);
            return Ok(());
        };
        for (_, fault, refused) in &mut self.agenda.asking {
            if fault.action.to_string() == one.sentence {
                refused.push(format!("{part} {why}"));
            }
        }
        self.log_event_at(
            now,
            Event::FaultRefused { part: Some(part), why: why.into(), sentence: one.sentence },
        )
    }

    /// Everything is done that is to be before `now`: answers those who asked, and lets the world go on.
    fn set_free(&mut self, now: Tick) -> Result<(), LaunchError> {
        let schedule = self.plan.scenario.schedule();
        let done = |(_, fault, _): &mut (Request, Fault, Vec<String>)| schedule.tick(fault.at_s) <= now.0;
        for (request, fault, refused) in self.agenda.asking.extract_if(.., done).collect::<Vec<_>>() {
            request.answer(&self.answer(&fault, &refused));
        }
        if self.is_real_time() {
            return Ok(());
        }
        self.agenda.released = Some(now);
        self.crew.set_free_before(self.free_before());
        self.publish_roster()
    }

    fn answer(&self, fault: &Fault, refused: &[String]) -> String {
        let tick = self.plan.scenario.schedule().tick(fault.at_s);
        let done = format!("tick {tick}, {:.2} s: {}", fault.at_s, fault.action);
        match refused {
            [] => done,
            some => format!("refused: {} ({done})", some.join(", ")),
        }
    }

    /// A process is gone because somebody asked for that.
    pub(super) fn note_asked_end(&mut self, part: Part, act: ProcessAction) -> Result<(), LaunchError> {
        match (part, act) {
            (Part::World, _) => {
                self.failures.push("the world was ended as asked: the flight did not come to its end".into());
            }
            // Without a log, nothing would be known of the flight.
            (Part::Recorder, ProcessAction::Kill { returns: false } | ProcessAction::Stop) => {
                self.crew.forget_asked(part);
                self.crew.respawn(part)?;
            }
            _ => {}
        }
        self.publish_roster()
    }

    fn clean_up(&mut self) {
        let now = self.gate.tick();
        if self.agenda.clean_from.is_some_and(|from| now.is_none_or(|now| now >= from)) {
            self.agenda.clean_from = None;
            self.janitor.call();
        }
    }

    fn tell_announcements(&mut self) -> Result<(), LaunchError> {
        let Some(now) = self.gate.tick() else { return Ok(()) };
        while self.agenda.announcements.front().is_some_and(|(first, _)| first.tick <= now) {
            let Some((announced, author)) = self.agenda.announcements.pop_front() else { break };
            match author {
                Author::Scenario => self.progress.log_event(&announced),
                Author::Request => self.log_event_at(announced.tick, announced.event)?,
            }
        }
        Ok(())
    }

    /// Somebody wants something done.
    pub(super) fn take_request(&mut self, request: Request) -> Result<(), LaunchError> {
        if request.text == "list" {
            request.answer(&self.list());
            return Ok(());
        }
        if !self.crew.is_flying() || self.is_over() {
            request.answer("refused: the flight has not begun, or is over");
            return Ok(());
        }
        self.agenda.requests.push(request);
        self.crew.set_free_before(self.free_before());
        self.publish_roster()
    }

    /// The faults that are in force, and those to come.
    fn list(&self) -> String {
        let now = self.gate.tick().unwrap_or(Tick(0)).0;
        let schedule = self.plan.scenario.schedule_of(&self.agenda.faults);
        let mut lines: Vec<String> = Vec::new();
        for fault in schedule.link_faults().iter().filter(|fault| fault.end.is_none_or(|end| end > now)) {
            let when = if fault.is_on(now) { "since" } else { "from" };
            let time_s = Tick(fault.begin).seconds(schedule.rate_hz);
            lines.push(format!("{when} {time_s:.2} s: {}", fault.sentence));
        }
        for one in &self.agenda.due {
            let time_s = Tick(one.tick).seconds(schedule.rate_hz);
            let (part, action, sentence) = (one.part, one.action, one.sentence.clone());
            let text = self.plan.scenario.event_text(&Event::ProcessFault { part, action, sentence });
            lines.push(format!("at {time_s:.2} s: {text}"));
        }
        if lines.is_empty() { "none".into() } else { lines.join("\n") }
    }

    /// Takes what was asked for as faults from `now` on, or refuses it.
    fn consider_requests(&mut self, now: Tick) -> Result<(), LaunchError> {
        for request in std::mem::take(&mut self.agenda.requests) {
            match self.understand(&request.text) {
                Ok(action) => self.add(request, action, now)?,
                Err(why) => {
                    let sentence = request.text.clone();
                    request.answer(&format!("refused: {why}"));
                    self.log_event_at(now, Event::FaultRefused { part: None, why, sentence })?;
                }
            }
        }
        Ok(())
    }

    fn understand(&self, text: &str) -> Result<Action, String> {
        let action: Action =
            text.parse().map_err(|error: ringwing_scenario::fault::Misunderstanding| error.to_string())?;
        if let Some(why) = action.refusal(self.plan.scenario.formation.uavs) {
            return Err(why);
        }
        let now = self.moment().unwrap_or(Tick(0)).0;
        match &action {
            Action::Heal(links) if !self.is_healable(links, now) => Err("there is nothing to heal".into()),
            Action::Link { trouble: Trouble::Delay(Delay::File(_)), .. } => {
                Err("a file of delays is read by `ringwing fault`, not by the run".into())
            }
            _ => Ok(action),
        }
    }

    fn is_healable(&self, links: &Links, now: i64) -> bool {
        let schedule = self.plan.scenario.schedule_of(&self.agenda.faults);
        let mut on = schedule.link_faults().into_iter().filter(|fault| fault.is_on(now));
        on.any(|fault| *links == Links::All || *links == fault.links)
    }

    fn add(&mut self, request: Request, action: Action, now: Tick) -> Result<(), LaunchError> {
        let rate_hz = self.plan.scenario.time.rate_hz;
        let ahead = if self.is_real_time() { (NOTICE_S * f64::from(rate_hz)).ceil() as i64 + 1 } else { 0 };
        let fault = Fault { at_s: Tick(now.0 + ahead).seconds(rate_hz), action };
        self.log_event_at(now, Event::FaultRequested { sentence: fault.to_string() })?;
        self.agenda.faults.push(fault.clone());
        self.agenda.added.push(fault.clone());
        self.domain.leave_report(report::FAULTS, &self.agenda.added)?;
        self.gate.set_faults(self.agenda.added.len() as u32);
        self.enter(&fault, now.0 + ahead);
        self.agenda.asking.push((request, fault, Vec::new()));
        Ok(())
    }

    /// Puts a new fault among what is to be done and told.
    fn enter(&mut self, fault: &Fault, tick: i64) {
        let schedule = self.plan.scenario.schedule_of(&self.agenda.faults);
        let one = self.plan.scenario.schedule_of(std::slice::from_ref(fault));
        let mut told = one.announcements();
        if let Action::Heal(_) = fault.action {
            told.extend(
                schedule
                    .announcements()
                    .into_iter()
                    .filter(|one| one.tick.0 == tick && matches!(one.event, Event::FaultHealed { .. })),
            );
        }
        self.agenda.due.extend(one.scheduled_actions());
        self.agenda.due.make_contiguous().sort_by_key(|one| one.tick);
        self.agenda.announcements.extend(told.into_iter().map(|one| (one, Author::Request)));
        self.agenda.announcements.make_contiguous().sort_by_key(|(one, _)| one.tick);
    }
}
