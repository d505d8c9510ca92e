//! A run that stands still as a whole: stopped by Ctrl-Z, by a paused container, by a closed laptop.
//!
//! Must never change the flight: in lockstep it goes on to the bit as if nothing had happened.

use super::{
    LaunchError,
    lifecycle::{ProcessSignal, RunStage},
    spawner::send_signal,
    supervisor::Supervisor,
};
use ringwing_bus::stop_self;
use ringwing_flight::{Event, Pace};
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
        self.signal_awake(ProcessSignal::Stop);
        stop_self();
        self.signal_awake(ProcessSignal::Continue);
    }

    /// Sends `signal` to all processes that no fault keeps frozen. The world is the first, because it waits for the others.
    fn signal_awake(&self, signal: ProcessSignal) {
        for part in self.processes.living() {
            let process = self.processes.get(part);
            if let Some(pid) = process.pid().filter(|_| !process.is_kept_frozen()) {
                send_signal(pid, signal);
            }
        }
    }

    /// Looks at the clock, and says for how long the run stood still if it did.
    pub(super) fn note_pause(&mut self) -> Result<(), LaunchError> {
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
