//! A run that stands still as a whole: stopped by Ctrl-Z, by a paused container, by a closed laptop, or paused by the user.
//!
//! Must never change the flight: in lockstep it goes on to the bit as if nothing had happened.

use super::{
    LaunchError,
    inbox::Reply,
    lifecycle::{ProcessSignal, RunStage},
    stepper::PauseRequest,
    supervisor::Supervisor,
};
use ringwing_bus::stop_self;
use ringwing_flight::{Event, Pace, Tick};
use std::time::Duration;

/// The shortest pause that the run mentions. Shorter ones are everyday on a busy machine.
const PAUSE_MIN: Duration = Duration::from_secs(1);
/// The launcher alone stood still if the flight has come this share of the pause further meanwhile.
const FLOWN_SHARE_MAX: f64 = 0.5;

impl Supervisor<'_> {
    /// Stops all processes and then the launcher, until somebody lets the launcher go on. The processes do not get the
    /// terminal's Ctrl-Z themselves, because each is in a process group of its own.
    pub(super) fn suspend(&mut self) {
        self.progress.print("stopped; `fg` or SIGCONT continues the run");
        // The processes stop first: once the launcher stands, nobody else would stop them.
        self.signal_awake(ProcessSignal::Stop);
        stop_self();
        self.signal_awake(ProcessSignal::Continue);
    }

    /// Sends `signal` to all processes that no fault keeps frozen. The world is the first, because it waits for the others.
    fn signal_awake(&self, signal: ProcessSignal) {
        for part in self.processes.living() {
            let process = self.processes.get(part);
            if let Some(pid) = process.pid().filter(|_| !process.is_kept_frozen()) {
                self.send_to(part, pid, signal);
            }
        }
    }

    /// Handles a request to pause, to step or to resume the flight.
    pub(super) fn on_pause_request(
        &mut self,
        request: PauseRequest,
        reply: Reply,
    ) -> Result<(), LaunchError> {
        // Deadlines of a flight in real time pass by the wall clock, so nothing could hold its ticks.
        if self.plan.scenario.pace() == Pace::RealTime {
            reply.refuse("a flight in real time follows the wall clock: fly in lockstep to pause it");
            return Ok(());
        }
        // The flight has begun, but its first tick may not be open yet.
        let now = self.gate.tick().unwrap_or(Tick(0));
        for (reply, answer) in self.stepper.submit(request, reply, now) {
            reply.send(&answer);
        }
        self.progress.set_paused(self.stepper.is_paused());
        self.publish_roster()
    }

    /// Tells whoever waits for a step that the flight is over.
    pub(super) fn end_steps(&mut self) {
        for (reply, answer) in self.stepper.on_end(self.progress.last_tick()) {
            reply.send(&answer);
        }
    }

    /// Looks at the clock, and says for how long the run stood still if it did.
    pub(super) fn note_sleep(&mut self) -> Result<(), LaunchError> {
        // No process is late while the user looks at a flight that stands.
        if self.stepper.is_standing() {
            self.clock.skip();
            return Ok(());
        }
        let asleep = self.clock.look();
        // A flight in lockstep, and its log, are the same however long it took.
        let is_news = asleep >= PAUSE_MIN && self.plan.scenario.pace() == Pace::RealTime;
        if is_news && self.stage() == RunStage::Flying && !self.flew_on(asleep) {
            self.log_event(Event::RunPaused { seconds: asleep.as_secs_f64() })?;
        }
        Ok(())
    }

    /// Whether the flight went on while the launcher slept.
    fn flew_on(&self, asleep: Duration) -> bool {
        let Some(now) = self.gate.tick() else { return false };
        let flown_s = now.since(self.progress.last_tick()) as f64 * self.plan.scenario.period_s();
        flown_s > FLOWN_SHARE_MAX * asleep.as_secs_f64()
    }
}
