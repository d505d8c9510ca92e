//! The run's viewer: a process that shows the flight to Foxglove and takes no part in it.
//!
//! Must never wait for the viewer during the flight, and must never let the run fail because of it.

use super::{
    LaunchError, inbox::ProcessChange, lifecycle::ProcessSignal, spawner::send_signal, supervisor::Supervisor,
};
use ringwing_bus::Patience;
use std::time::Duration;

/// How long the viewer may take to leave after the flight, while its last messages reach the people who watch. Longer delays the
/// result if it hangs; shorter cuts it off.
const LEAVE_LIMIT: Duration = Duration::from_millis(500);
/// Longest wait for the notice of its end. Longer delays the end of the run; shorter burns CPU.
const NOTICE_WAIT: Duration = Duration::from_millis(5);

impl Supervisor<'_> {
    /// Starts the viewer if the run is to have one. Without a viewer the flight is the same, so a failure is only told.
    pub(super) fn start_viewer(&mut self) -> Result<(), LaunchError> {
        let Some(address) = self.plan.live else { return Ok(()) };
        match self.spawner.spawn_viewer(&address) {
            Ok((pid, lines)) => {
                self.viewer = Some(pid);
                self.inbox.watch_viewer(lines)?;
            }
            Err(error) => self.progress.print_warning(&format!("{error}: the flight goes on without it")),
        }
        Ok(())
    }

    /// Takes note of a change of a process that has no part in the run: the viewer, or one that is forgotten.
    pub(super) fn on_other_change(&mut self, pid: u32, change: ProcessChange) {
        let ProcessChange::Ended(end) = change else { return };
        if self.viewer != Some(pid) {
            return;
        }
        self.viewer = None;
        if !self.gate.is_closed() {
            self.progress.print_warning(&format!("the viewer {end}: the flight goes on without it"));
            // Its places at the services are for the next observer.
            self.janitor.clean();
        }
    }

    /// Waits a moment until the viewer has left, and kills it if it has not.
    pub(super) fn end_viewer(&mut self) -> Result<(), LaunchError> {
        for signal in [None, Some(ProcessSignal::Kill)] {
            let Some(pid) = self.viewer else { return Ok(()) };
            if let Some(signal) = signal {
                send_signal(pid, signal, false);
            }
            let mut patience = Patience::of(LEAVE_LIMIT);
            while self.viewer.is_some() && !patience.is_over() {
                self.wait(NOTICE_WAIT)?;
            }
        }
        Ok(())
    }
}
