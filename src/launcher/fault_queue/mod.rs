//! Queues the faults of a run: which are due, which are being applied, and how the requests for them are answered.
//!
//! Must never touch a process, a socket, a clock or the bus: the supervisor applies what this queue hands out.
//!
//! Actions due before the same tick are applied in the order of their faults, and within a fault in the order of its
//! targets. Each action is checked against the state that the previous one left. To save time, consecutive actions
//! that do the same thing to different processes form a batch and are applied together. The next batch waits until
//! every action of this one has taken effect. So `kill uav 1` and `kill uav 2` cost one wait, and a second
//! `kill uav 1` is refused.
//!
//! In lockstep the world holds each tick that has actions due before it, so an action takes effect at exactly its
//! tick. In real time an action takes effect as soon as its tick has come.

#[cfg(test)]
mod tests;

use ringwing_bus::REFUSED;
use ringwing_flight::{Event, Pace, Part, ProcessAction, Roster, Tick, TimedEvent};
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{Delay, LinkImpairment, Links, schedule::ScheduledAction},
};
use std::{
    collections::{BTreeSet, VecDeque},
    mem,
    str::FromStr,
};

/// In real time, how long after its announcement a requested fault begins, so that every agent has read it by then.
/// With less time a busy agent learns of the fault too late; more only delays what the user asked for.
const NOTICE_S: f64 = 0.1;
/// In real time, how much later than asked an action has to be before an event says so and the rest of its fault moves with
/// it. A shorter time reports the launcher's usual rhythm; a longer one cuts short faults in silence.
const LATE_S: f64 = 0.1;
/// Earlier than every tick: while this is the limit, the world holds the next tick, whichever that is.
const BEFORE_ALL_TICKS: Tick = Tick(i64::MIN);

/// The faults of a run. `R` carries the answer to a request for a fault back to whoever sent the request.
#[derive(Debug)]
pub(super) struct FaultQueue<'a, R> {
    scenario: &'a Scenario,
    /// Every fault so far: the scenario's, then those added during the run.
    faults: Vec<Fault>,
    /// The actions that are still to be applied, in order.
    due: VecDeque<ScheduledAction>,
    /// The batch that is being applied.
    under_way: Vec<ScheduledAction>,
    /// Events about links and slow processes that are still to be logged, in order of ticks.
    announcements: VecDeque<Announcement>,
    /// Requests that wait for the world to hold.
    waiting: Vec<LiveRequest<R>>,
    /// Requests that have become faults. Each is answered once its fault is applied.
    accepted: Vec<AcceptedRequest<R>>,
    /// Events about actions that came late, which are still to be logged.
    late: Vec<Event>,
    /// The last tick that was released.
    released: Option<Tick>,
    /// The world may open only ticks before this one.
    free_before: Tick,
}

/// A request for a fault, made during the run.
#[derive(Debug)]
pub(super) struct LiveRequest<R> {
    /// What is asked for, as `ringwing fault` sends it.
    pub(super) sentence: String,
    /// Who asked.
    pub(super) reply: R,
}

/// A request that has become a fault.
#[derive(Debug)]
struct AcceptedRequest<R> {
    reply: R,
    /// The number of the fault among those of the run.
    number: u32,
    fault: Fault,
    /// What the user should know about it.
    warning: Option<String>,
    /// One reason for each of its actions that was refused.
    refusals: Vec<String>,
}

/// An event about links or slow processes that is logged when its tick comes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Announcement {
    /// The event with its tick.
    pub(super) event: TimedEvent,
    /// Whether the fault was added during the run. The recorder knows the scenario's faults by itself.
    pub(super) is_live: bool,
}

impl<'a, R> FaultQueue<'a, R> {
    /// The faults of `scenario`, none of them applied.
    pub(super) fn new(scenario: &'a Scenario) -> Self {
        let schedule = scenario.schedule();
        let announcement = |event| Announcement { event, is_live: false };
        let mut queue = Self {
            scenario,
            faults: scenario.faults.clone(),
            due: schedule.scheduled_actions().into(),
            under_way: Vec::new(),
            announcements: schedule.announcements().into_iter().map(announcement).collect(),
            waiting: Vec::new(),
            accepted: Vec::new(),
            late: Vec::new(),
            released: None,
            free_before: BEFORE_ALL_TICKS,
        };
        queue.free_before = queue.next_limit();
        queue
    }

    /// Whether the launcher should check for notices often: an action or a request is still in progress.
    pub(super) fn is_busy(&self) -> bool {
        !(self.under_way.is_empty() && self.waiting.is_empty() && self.accepted.is_empty())
    }

    /// The world may open only ticks before this one: something has to be applied first.
    ///
    /// The limit stays the same while the actions of a tick are applied, so that a roster published in between does
    /// not let the world go on. It moves when that tick is released.
    pub(super) fn free_before(&self) -> Tick {
        self.free_before
    }

    fn next_limit(&self) -> Tick {
        let unbounded = Roster::empty().free_before;
        match self.scenario.pace() {
            Pace::RealTime => unbounded,
            Pace::Lockstep if !self.waiting.is_empty() => BEFORE_ALL_TICKS,
            Pace::Lockstep => {
                // The end of a requested fault is logged before its tick too, so that a repeated flight has the same log.
                let live = self.announcements.iter().find(|one| one.is_live).map(|one| one.event.tick);
                let due = self.due.front().map(|first| first.tick);
                due.into_iter().chain(live).min().unwrap_or(unbounded)
            }
        }
    }

    /// Whether faults may be applied before `now`. In lockstep a tick that was released is past.
    pub(super) fn is_open(&self, now: Tick) -> bool {
        self.released != Some(now)
    }

    /// Takes back that a tick was released. The world must hold it still, for another reason than faults.
    pub(super) fn reopen(&mut self) {
        self.released = None;
    }

    /// The faults that were added during the run.
    pub(super) fn added(&self) -> &[Fault] {
        &self.faults[self.scenario.faults.len()..]
    }

    /// Hands over the announcements that are due by `now`.
    pub(super) fn take_announcements(&mut self, now: Tick) -> Vec<Announcement> {
        // They are in the order of their ticks, so the first later one ends the search.
        let count = self.announcements.iter().take_while(|one| one.event.tick <= now).count();
        self.announcements.drain(..count).collect()
    }

    // --- applying ---

    /// Finishes the batch under way once `has_settled` holds for each of its actions. Returns the events to log, or
    /// `None` while an action has not taken effect yet.
    pub(super) fn finish_batch(
        &mut self,
        has_settled: impl Fn(Part, ProcessAction) -> bool,
    ) -> Option<Vec<Event>> {
        if !self.under_way.iter().all(|scheduled| has_settled(scheduled.part, scheduled.action)) {
            return None;
        }
        Some(mem::take(&mut self.under_way).into_iter().map(applied).collect())
    }

    /// Takes the next batch that is due at `now`, which is empty if nothing is due. The previous batch must be
    /// finished. An action that `is_refused` is a batch of its own, so that its refusal is logged in the right order.
    pub(super) fn take_batch(
        &mut self,
        now: Tick,
        is_refused: impl Fn(Part, ProcessAction) -> bool,
    ) -> Vec<ScheduledAction> {
        assert!(self.under_way.is_empty(), "the batch before is not finished: {:?}", self.under_way);
        let Some(first) = self.due.front() else { return Vec::new() };
        if first.tick > now {
            return Vec::new();
        }
        let kind = mem::discriminant(&first.action);
        let mut parts = BTreeSet::new();
        let joins = |scheduled: &&ScheduledAction| {
            scheduled.tick <= now
                && mem::discriminant(&scheduled.action) == kind
                && !is_refused(scheduled.part, scheduled.action)
                // A second action on the same process has to see the effect of the first one.
                && parts.insert(scheduled.part)
        };
        // At least the first one, even if it is refused: the refusal has to be logged, and the queue has to move on.
        let count = self.due.iter().take_while(joins).count().max(1);
        let batch: Vec<_> = self.due.drain(..count).collect();
        for scheduled in &batch {
            self.postpone_rest(scheduled, now);
        }
        batch
    }

    /// If `scheduled` comes late, moves what its fault does to the same process later by as much, so that it lasts for as
    /// long as asked.
    fn postpone_rest(&mut self, scheduled: &ScheduledAction, now: Tick) {
        let late_ticks = now.since(scheduled.tick);
        let late_s = Tick(late_ticks).seconds(self.scenario.time.rate_hz);
        // In lockstep the world waits, so nothing is late.
        if late_s < LATE_S {
            return;
        }
        let is_rest =
            |other: &&mut ScheduledAction| other.number == scheduled.number && other.part == scheduled.part;
        self.due.iter_mut().filter(is_rest).for_each(|other| other.tick.0 += late_ticks);
        // The sort is stable, so actions of the same tick stay in the order of their faults.
        self.due.make_contiguous().sort_by_key(|scheduled| scheduled.tick);
        let (part, sentence) = (scheduled.part, scheduled.sentence.clone());
        self.late.push(Event::FaultLate { part, late_s, sentence });
    }

    /// Hands over the events about actions that came late.
    pub(super) fn take_late(&mut self) -> Vec<Event> {
        mem::take(&mut self.late)
    }

    /// Notes that `scheduled` is being applied.
    pub(super) fn note_applied(&mut self, scheduled: ScheduledAction) {
        self.under_way.push(scheduled);
    }

    /// Notes that `scheduled` is refused. `why` is a predicate of its process, such as "is gone already". Returns the
    /// event to log.
    pub(super) fn note_refused(&mut self, scheduled: ScheduledAction, why: &str) -> Event {
        let ScheduledAction { number, part, sentence, .. } = scheduled;
        // Two requests may have the same sentence, so only the number tells whose action this is.
        for request in self.accepted.iter_mut().filter(|request| request.number == number) {
            request.refusals.push(format!("{part} {why}"));
        }
        Event::FaultRefused { part: Some(part), why: why.into(), sentence }
    }

    /// Notes that everything due before `now` is done. Returns the requests that this completes, each with its answer.
    pub(super) fn release(&mut self, now: Tick) -> Vec<(R, String)> {
        // In real time the world never waits, so no tick is ever closed to faults.
        if self.scenario.pace() == Pace::Lockstep {
            self.released = Some(now);
        }
        self.free_before = self.next_limit();
        let scenario = self.scenario;
        let is_done = |request: &mut AcceptedRequest<R>| tick_of(scenario, &request.fault) <= now;
        let done: Vec<_> = self.accepted.extract_if(.., is_done).collect();
        let answered = |request: AcceptedRequest<R>| {
            let text = answer(scenario, &request);
            (request.reply, text)
        };
        done.into_iter().map(answered).collect()
    }

    // --- live requests ---

    /// Takes in a request. It is decided once faults can be applied.
    pub(super) fn submit(&mut self, request: LiveRequest<R>) {
        self.waiting.push(request);
        self.free_before = self.next_limit();
    }

    /// Hands over the waiting requests. The caller decides each of them with [`FaultQueue::decide`].
    pub(super) fn take_requests(&mut self) -> Vec<LiveRequest<R>> {
        mem::take(&mut self.waiting)
    }

    /// Turns `request`, decided at `now`, into a fault and returns the event to log; if it cannot be a fault, returns
    /// the request with the reason.
    pub(super) fn decide(
        &mut self,
        request: LiveRequest<R>,
        now: Tick,
    ) -> Result<Event, (LiveRequest<R>, String)> {
        let begin = Tick(now.0 + self.notice_ticks());
        let fault = match self.parse(&request.sentence, now, begin) {
            Ok(fault) => fault,
            Err(why) => return Err((request, why)),
        };
        let warning = self.so_far().warning_about(&fault);
        let event = Event::FaultRequested { sentence: fault.to_string() };
        self.faults.push(fault.clone());
        self.enqueue(&fault);
        let (number, refusals) = (self.newest_number(), Vec::new());
        self.accepted.push(AcceptedRequest { reply: request.reply, number, fault, warning, refusals });
        Ok(event)
    }

    /// How many ticks after the decision a fault begins.
    fn notice_ticks(&self) -> i64 {
        match self.scenario.pace() {
            // The world holds the tick, and every agent reads the new faults before it answers that tick.
            Pace::Lockstep => 0,
            Pace::RealTime => (NOTICE_S * f64::from(self.scenario.time.rate_hz)).ceil() as i64 + 1,
        }
    }

    /// The scenario with all faults so far.
    fn so_far(&self) -> Scenario {
        Scenario { faults: self.faults.clone(), ..self.scenario.clone() }
    }

    /// The fault that `sentence` asks for at `now`, which begins at `begin`; or why it cannot be.
    fn parse(&self, sentence: &str, now: Tick, begin: Tick) -> Result<Fault, String> {
        let action: Action = sentence.parse().map_err(|error: <Action as FromStr>::Err| error.to_string())?;
        let fault = Fault { at_s: begin.seconds(self.scenario.time.rate_hz), action };
        if let Some(why) = self.so_far().refusal_of(&fault) {
            return Err(why);
        }
        match &fault.action {
            Action::Heal(links) if !self.is_healable(links, now) => Err("there is nothing to heal".into()),
            Action::Link { impairment: LinkImpairment::Delay(Delay::File(_)), .. } => Err(
                "a live run reads no files: `ringwing fault` reads the file of delays and sends its content"
                    .into(),
            ),
            _ => Ok(fault),
        }
    }

    /// Whether a fault of `links` is on at `now`.
    fn is_healable(&self, links: &Links, now: Tick) -> bool {
        let faults = self.scenario.schedule_of(&self.faults).link_faults();
        faults.iter().any(|fault| fault.is_on(now) && (*links == Links::All || *links == fault.links))
    }

    /// The announcements that the newest fault, a healing, adds. A healed fault no longer ends later, so the announcement
    /// of that is taken back.
    ///
    /// A healing ends other faults, so what it changes appears only in the schedule of all faults together.
    fn announce_healing(&mut self) -> Vec<TimedEvent> {
        let all = self.faults.as_slice();
        let without = all.split_last().map_or(all, |(_, before)| before);
        let announcements = |faults| self.scenario.schedule_of(faults).announcements();
        let (before, after) = (announcements(without), announcements(all));
        for gone in difference(&before, &after) {
            if let Some(place) = self.announcements.iter().position(|one| one.event == gone) {
                self.announcements.remove(place);
            }
        }
        difference(&after, &before)
    }

    /// Puts the actions and announcements of a new fault behind those of the same ticks.
    fn enqueue(&mut self, fault: &Fault) {
        let alone = self.scenario.schedule_of(std::slice::from_ref(fault));
        let mut events = alone.announcements();
        if let Action::Heal(_) = fault.action {
            events.extend(self.announce_healing());
        }
        let number = self.newest_number();
        let actions = alone.scheduled_actions().into_iter();
        self.due.extend(actions.map(|scheduled| ScheduledAction { number, ..scheduled }));
        self.due.make_contiguous().sort_by_key(|scheduled| scheduled.tick);
        self.announcements.extend(events.into_iter().map(|event| Announcement { event, is_live: true }));
        self.announcements.make_contiguous().sort_by_key(|one| one.event.tick);
    }

    /// The number of the fault that was added last. Faults are numbered from 1, so it is their count.
    fn newest_number(&self) -> u32 {
        self.faults.len() as u32
    }

    /// A line for each fault that is in force at `now` or still to come.
    pub(super) fn list(&self, now: Tick) -> String {
        let rate_hz = self.scenario.time.rate_hz;
        let links = self.scenario.schedule_of(&self.faults).link_faults();
        let lasting = links.iter().filter(|fault| fault.end.is_none_or(|end| end > now));
        let link_lines = lasting.map(|fault| {
            let when = if fault.is_on(now) { "since" } else { "from" };
            format!("{when} {:.2} s: {}", fault.begin.seconds(rate_hz), fault.sentence)
        });
        let process_lines = self.due.iter().map(|scheduled| {
            let text = self.scenario.event_text(&applied(scheduled.clone()));
            format!("at {:.2} s: {text}", scheduled.tick.seconds(rate_hz))
        });
        let list = link_lines.chain(process_lines).collect::<Vec<String>>().join("\n");
        if list.is_empty() { "none".into() } else { list }
    }
}

/// The events of `some` that are not in `others`, of equal ones as many as there are more.
fn difference(some: &[TimedEvent], others: &[TimedEvent]) -> Vec<TimedEvent> {
    let mut left = others.to_vec();
    let is_missing = |event: &&TimedEvent| match left.iter().position(|other| other == *event) {
        Some(place) => {
            left.swap_remove(place);
            false
        }
        None => true,
    };
    some.iter().filter(is_missing).cloned().collect()
}

/// The event that logs `scheduled` as applied.
fn applied(scheduled: ScheduledAction) -> Event {
    let ScheduledAction { part, action, sentence, .. } = scheduled;
    Event::ProcessFault { part, action, sentence }
}

/// The tick at which `fault` begins.
fn tick_of(scenario: &Scenario, fault: &Fault) -> Tick {
    scenario.schedule().tick(fault.at_s)
}

/// The answer to `request`.
fn answer<R>(scenario: &Scenario, request: &AcceptedRequest<R>) -> String {
    let AcceptedRequest { fault, warning, refusals, .. } = request;
    let done = format!("tick {}, {:.2} s: {}", tick_of(scenario, fault).0, fault.at_s, fault.action);
    if !refusals.is_empty() {
        return format!("{REFUSED}{} ({done})", refusals.join(", "));
    }
    warning.as_ref().map_or(done.clone(), |warning| format!("{done}\nwarning: {warning}"))
}
