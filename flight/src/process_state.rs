//! Whether a process of the run is running, frozen or gone, and what a process fault makes of that.
//!
//! The launcher and the simulation both judge faults by these rules. Never knows what a process does, only whether it
//! runs.

use crate::ProcessAction;

/// Whether a process takes part in the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcessState {
    /// Answers every tick.
    Running,
    /// Stopped by SIGSTOP: keeps its memory and answers nothing.
    Frozen,
    /// Has ended, or was never started.
    Gone,
}

impl ProcessState {
    /// The state after `action`, or why the action is refused, as the rest of a sentence: "uav 3" + "is gone already".
    pub fn after(self, action: ProcessAction) -> Result<Self, &'static str> {
        use ProcessAction::{Freeze, Kill, Start, Stop, Thaw};
        match (action, self) {
            (Start, Self::Gone) | (Thaw, Self::Frozen) => Ok(Self::Running),
            (Start, _) => Err("is there already"),
            // All other actions need a process.
            (_, Self::Gone) => Err("is gone already"),
            (Thaw, Self::Running) => Err("is not frozen"),
            (Freeze, Self::Frozen) => Err("is frozen already"),
            // A frozen process does not handle the signal until it is thawed.
            (Stop, Self::Frozen) => Err("is frozen: thaw or kill it"),
            (Freeze, Self::Running) => Ok(Self::Frozen),
            // SIGKILL ends a frozen process as well.
            (Kill { .. } | Stop, _) => Ok(Self::Gone),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frozen_process_can_be_killed_and_thawed_but_not_stopped() {
        let frozen = ProcessState::Running.after(ProcessAction::Freeze).unwrap();
        assert_eq!(frozen.after(ProcessAction::Thaw), Ok(ProcessState::Running));
        assert_eq!(frozen.after(ProcessAction::Kill { returns: true }), Ok(ProcessState::Gone));
        assert!(frozen.after(ProcessAction::Stop).is_err());
        assert!(frozen.after(ProcessAction::Start).is_err());
    }

    #[test]
    fn a_process_that_is_gone_can_only_be_started() {
        let gone = ProcessState::Gone;
        assert_eq!(gone.after(ProcessAction::Start), Ok(ProcessState::Running));
        for action in [ProcessAction::Stop, ProcessAction::Freeze, ProcessAction::Thaw] {
            assert_eq!(gone.after(action), Err("is gone already"));
        }
    }
}
