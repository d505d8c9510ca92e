//! Your own control law in a ringwing flight.
//!
//! Implement [`Controller`] and call [`main`]. The program then is the agent of a UAV: `ringwing run --agent "3=./my-controller"`
//! starts it, and restarts, kills and times it like the built-in agent. Links and their faults, membership, slots, the collision
//! filter and the log are the same.
//!
//! Never decides anything about the flight: the controller does.

use clap::{Args, Command, FromArgMatches};
pub use nalgebra::{Point2, Vector2};
pub use ringwing_agent::AgentError;
use ringwing_agent::{AgentArgs, run_controller};
pub use ringwing_agent::{
    controller::{Controller, Wish},
    law::Limits,
    pilot::{EstimatedLeader, Membership, PeerTrack, RingNeighbour, Situation, SlotMotion},
};
pub use ringwing_flight::{
    Aircraft, FlightMode, FormationFrame, MAX_NOTE_NAME, MAX_NOTES, NoteRefusal, Notes, Pose, Sensed,
    SensedAircraft, SensedObstacle, Tick, UavId, direction, wrap,
};
pub use ringwing_scenario::Scenario;
use std::{
    ffi::OsString,
    io::{Write, stderr},
    process::ExitCode,
};

/// The word that separates the arguments of the controller from those that ringwing adds.
const MARKER: &str = "agent";

/// What a program says that was started without a run.
const NO_RUN: &str = "error: this program flies a UAV of ringwing: start it with `ringwing run SCENARIO --agent \"UAVS=PROGRAM\"`";

/// What a controller may know before the flight.
#[derive(Debug, Clone, Copy)]
pub struct Start<'s> {
    /// The UAV that it will fly.
    pub uav: UavId,
    /// The scenario of the run.
    pub scenario: &'s Scenario,
    /// The arguments of the program that are its own: those that `command` has after the program's name.
    pub arguments: &'s [OsString],
}

/// Flies a UAV with the controller that `make` makes until the flight ends; to be returned from `main`.
///
/// The arguments of the program name the run and the UAV. If they do not, this prints how to start the program, and the exit
/// code is 2; it is 1 if the program cannot take part in the run.
pub fn main<C: Controller>(make: impl FnOnce(&Start<'_>) -> C) -> ExitCode {
    // `args` panics at an argument that is not UTF-8, and a controller's own arguments may be such paths.
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    match run(&arguments, make) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(error.tell()),
    }
}

/// Why a controller cannot fly.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The arguments do not name a run and a UAV.
    #[error("{0}")]
    Usage(String),
    /// The program cannot take part in the run.
    #[error(transparent)]
    Agent(#[from] AgentError),
}

impl RunError {
    /// Writes the reason to stderr. Returns the exit code: 2 for arguments that name no run, 1 for a run that cannot be joined.
    pub fn tell(&self) -> u8 {
        let (text, code) = match self {
            // A message of clap already says that it is an error, so add nothing.
            Self::Usage(why) => (why.clone(), 2),
            Self::Agent(error) => (format!("error: agent: {error}"), 1),
        };
        // Nobody can be told that nobody reads it.
        let _ = writeln!(stderr(), "{text}");
        code
    }
}

/// Flies a UAV with the controller that `make` makes until the flight ends. `arguments` are those of the program, without its
/// name. Meant for programs whose entry point is in another language; others call [`main`].
///
/// # Errors
/// The arguments do not name a run and a UAV, or the program cannot take part in the run.
pub fn run<C: Controller>(
    arguments: &[OsString],
    make: impl FnOnce(&Start<'_>) -> C,
) -> Result<(), RunError> {
    let (own, member) = split(arguments).map_err(RunError::Usage)?;
    run_controller(&member, |start| {
        make(&Start { uav: start.uav, scenario: start.scenario, arguments: own })
    })?;
    Ok(())
}

/// The arguments of the controller, and those that ringwing added.
fn split(arguments: &[OsString]) -> Result<(&[OsString], AgentArgs), String> {
    // The last such word is ringwing's, whatever the controller's own arguments are.
    let Some(place) = arguments.iter().rposition(|argument| argument == MARKER) else {
        return Err(NO_RUN.into());
    };
    let (own, added) = arguments.split_at(place);
    // The marker takes the place of the program's name, which clap expects first.
    let parsed = AgentArgs::augment_args(Command::new(MARKER)).try_get_matches_from(added);
    let member = parsed.and_then(|matches| AgentArgs::from_arg_matches(&matches));
    Ok((own, member.map_err(|error| error.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn the_last_marker_separates_the_arguments() {
        let arguments = words("--gain 2 agent smith agent --uav 3 --domain k3x9ab --launcher 17");
        let (own, member) = split(&arguments).unwrap();
        assert_eq!(own, words("--gain 2 agent smith"));
        assert_eq!((member.uav, member.member.launcher), (3, Some(17)));
    }

    #[test]
    fn a_program_that_is_started_without_a_run_says_how_to_start_it() {
        assert!(split(&words("--gain 2")).unwrap_err().contains("ringwing run"));
        assert!(split(&words("agent --uav 0 --domain k3x9ab")).unwrap_err().contains("--uav"));
        assert!(split(&words("agent --uav 3")).unwrap_err().contains("--domain"));
    }
}
