//! Applies faults to a run: takes what is due from the [queue](super::fault_queue), sends the signals through each
//! process's state machine, and publishes and logs the results.
//!
//! Must never decide which fault is due or what is answered: the queue does.

use super::{
    LaunchError,
    fault_queue::{Announcement, LiveRequest},
    inbox::Reply,
    lifecycle::{Input, RunStage},
    supervisor::Supervisor,
};
use ringwing_bus::{OBSERVE, report};
use ringwing_flight::{Event, Pace, Part, ProcessAction, Tick};
use ringwing_scenario::fault::schedule::ScheduledAction;

/// The request for the list of faults instead of a fault.
const LIST: &str = "list";

impl Supervisor<'_> {
    /// Applies the faults that are due, as far as that is possible at this moment.
    pub(super) fn apply_faults(&mut self) -> Result<(), LaunchError> {
        self.log_announcements(self.gate.tick())?;
        self.janitor.on_tick(self.gate.tick(), self.gate.recorded());
        let Some(now) = self.fault_tick() else { return Ok(()) };
        self.decide_requests(now)?;
        // In lockstep before the tick is released, so that the log has them in their own tick.
        self.log_announcements(Some(now))?;
        // One batch at a time. While a batch has not taken effect, return, and come back after the next notice.
        while let Some(events) = self.finish_batch() {
            events.into_iter().try_for_each(|event| self.log_event_at(now, event))?;
            let processes = &self.processes;
            let is_refused = |part, action| processes.get(part).refusal(action).is_some();
            let batch = self.faults.take_batch(now, is_refused);
            let late = self.faults.take_late();
            late.into_iter().try_for_each(|event| self.log_event_at(now, event))?;
            if batch.is_empty() {
                return self.release(now);
            }
            batch.into_iter().try_for_each(|scheduled| self.apply(scheduled, now))?;
        }
        Ok(())
    }

    /// The tick before which faults can be applied now: in lockstep the one that the world holds.
    fn fault_tick(&self) -> Option<Tick> {
        let now = match self.plan.scenario.pace() {
            Pace::Lockstep => self.gate.held(),
            Pace::RealTime => self.gate.tick(),
        };
        now.filter(|now| self.faults.is_open(*now))
    }

    fn finish_batch(&mut self) -> Option<Vec<Event>> {
        let (processes, gate, pace) = (&self.processes, &self.gate, self.plan.scenario.pace());
        let has_settled = |part, action| {
            let process = processes.get(part);
            // A thawed process first answers the tick that was open while it was frozen. In lockstep, wait for that
            // answer before the next action: otherwise scheduling would decide which of the two comes first.
            let has_caught_up = pace == Pace::RealTime
                || part == Part::Recorder
                || !process.is_running()
                || gate.has_answered(part);
            !process.has_pending_action() && (action != ProcessAction::Thaw || has_caught_up)
        };
        self.faults.finish_batch(has_settled)
    }

    fn apply(&mut self, scheduled: ScheduledAction, now: Tick) -> Result<(), LaunchError> {
        let (part, action) = (scheduled.part, scheduled.action);
        if let Some(why) = self.processes.get(part).refusal(action) {
            let event = self.faults.note_refused(scheduled, why);
            return self.log_event_at(now, event);
        }
        self.faults.note_applied(scheduled);
        self.report(part, Input::Asked(action))
    }

    /// Answers the requests whose faults are applied, and lets the world go on.
    fn release(&mut self, now: Tick) -> Result<(), LaunchError> {
        let answers = self.faults.release(now);
        // In real time nothing is ever paused, so the tick that is open counts for nothing here.
        let steps = self.stepper.on_held(now);
        for (reply, answer) in answers.into_iter().chain(steps) {
            reply.send(&answer);
        }
        match self.plan.scenario.pace() {
            Pace::Lockstep => self.publish_roster(),
            Pace::RealTime => Ok(()),
        }
    }

    /// Logs what is announced for the ticks up to `now`.
    fn log_announcements(&mut self, now: Option<Tick>) -> Result<(), LaunchError> {
        let Some(now) = now else { return Ok(()) };
        for Announcement { event, is_live } in self.faults.take_announcements(now) {
            if is_live {
                self.log_event_at(event.tick, event.event)?;
            } else {
                self.progress.print_event(&event);
            }
        }
        Ok(())
    }

    /// Handles a request for a fault, for the list of faults, or for a pause.
    pub(super) fn on_request(&mut self, request: LiveRequest<Reply>) -> Result<(), LaunchError> {
        if request.sentence == LIST {
            let now = self.gate.tick().unwrap_or(Tick(0));
            request.reply.send(&self.faults.list(now));
            return Ok(());
        }
        if request.sentence == OBSERVE {
            self.on_observer(request.reply);
            return Ok(());
        }
        if self.stage() != RunStage::Flying {
            request.reply.refuse("the flight has not begun, or is over");
            return Ok(());
        }
        if let Ok(pause) = request.sentence.parse() {
            return self.on_pause_request(pause, request.reply);
        }
        // A flight that stands for the user has not opened the tick that was released, so the fault can still act before it.
        if self.stepper.is_standing() {
            self.faults.reopen();
        }
        self.faults.submit(request);
        // In lockstep this roster makes the world hold the next tick.
        self.publish_roster()
    }

    /// Makes room for an observer, and removes those that were killed.
    fn on_observer(&mut self, reply: Reply) {
        self.janitor.clean();
        match self.domain.make_room_for_observer(self.plan.scenario.formation.uavs) {
            Ok(()) => reply.send("there is room"),
            Err(lack) => reply.refuse(&lack.to_string()),
        }
    }

    fn decide_requests(&mut self, now: Tick) -> Result<(), LaunchError> {
        for request in self.faults.take_requests() {
            match self.faults.decide(request, now) {
                Ok(event) => {
                    self.log_event_at(now, event)?;
                    self.share_added_faults()?;
                }
                Err((LiveRequest { sentence, reply }, why)) => {
                    reply.refuse(&why);
                    self.log_event_at(now, Event::FaultRefused { part: None, why, sentence })?;
                }
            }
        }
        Ok(())
    }

    /// Lets agents, world and recorder read the faults that were added. Agents and world look when the count at the gate
    /// grows, so the report must be written first.
    fn share_added_faults(&self) -> Result<(), LaunchError> {
        let added = self.faults.added();
        self.domain.write_report(report::FAULTS, &added)?;
        self.gate.set_faults(added.len() as u32);
        Ok(())
    }
}
