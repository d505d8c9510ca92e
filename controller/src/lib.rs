//! Your own control law in a ringwing flight.
//!
//! Implement [`Controller`] and call [`main`]. The program then is the agent of a UAV: `ringwing run --agent "3=./my-controller"`
//! starts it, and restarts, kills and times it like the built-in agent. Links and their faults, membership, slots, the collision
//! filter and the log are the same. In a simulated flight the program only answers situations with wishes.
//!
//! Never decides anything about the flight: the controller does.

use clap::{Args, Command};
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
use ringwing_programs::{
    SIMULATED_MARKER,
    guest::{GuestError, SeatArgs, serve},
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
    /// The program cannot take part in the simulated flight.
    #[error(transparent)]
    Simulated(#[from] GuestError),
}

impl RunError {
    /// Writes the reason to stderr. Returns the exit code: 2 for arguments that name no run, 1 for a run that cannot be joined.
    pub fn tell(&self) -> u8 {
        let (text, code) = match self {
            // A message of clap already says that it is an error, so add nothing.
            Self::Usage(why) => (why.clone(), 2),
            Self::Agent(error) => (format!("error: agent: {error}"), 1),
            Self::Simulated(error) => (format!("error: {error}"), 1),
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
    let (own, role) = split(arguments).map_err(RunError::Usage)?;
    match role {
        Role::Agent(member) => run_controller(&member, |start| {
            make(&Start { uav: start.uav, scenario: start.scenario, arguments: own })
        })?,
        Role::Simulated(seat) => {
            let uav = UavId(seat.uav);
            serve(&seat, |scenario| make(&Start { uav, scenario, arguments: own }))?;
        }
    }
    Ok(())
}

/// What a program is in a flight.
enum Role {
    /// The agent of a UAV, in a run.
    Agent(AgentArgs),
    /// The controller of a UAV whose agent is in another process, in a simulated flight.
    Simulated(SeatArgs),
}

/// The arguments of the controller, and what those that ringwing added ask for.
fn split(arguments: &[OsString]) -> Result<(&[OsString], Role), String> {
    // The last such word is ringwing's, whatever the controller's own arguments are.
    let is_marker = |argument: &OsString| argument == MARKER || argument == SIMULATED_MARKER;
    let Some(place) = arguments.iter().rposition(is_marker) else {
        return Err(NO_RUN.into());
    };
    let (own, added) = arguments.split_at(place);
    let role =
        if added[0] == MARKER { parsed(added).map(Role::Agent) } else { parsed(added).map(Role::Simulated) };
    Ok((own, role?))
}

/// The arguments after the marker `added[0]`, which takes the place of the program's name that clap expects first.
fn parsed<A: Args>(added: &[OsString]) -> Result<A, String> {
    let matches = A::augment_args(Command::new(MARKER)).try_get_matches_from(added);
    matches.and_then(|matches| A::from_arg_matches(&matches)).map_err(|error| error.to_string())
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
        let (own, role) = split(&arguments).unwrap();
        assert_eq!(own, words("--gain 2 agent smith"));
        assert!(matches!(role, Role::Agent(AgentArgs { uav: 3, member }) if member.launcher == Some(17)));
    }

    #[test]
    fn a_program_in_a_simulated_flight_is_a_controller_and_no_agent() {
        let arguments = words("--gain 2 simulated-agent --uav 3 --launcher 17");
        let (own, role) = split(&arguments).unwrap();
        assert_eq!(own, words("--gain 2"));
        assert!(matches!(role, Role::Simulated(SeatArgs { uav: 3, launcher: 17 })));
    }

    fn error_of(line: &str) -> String {
        split(&words(line)).err().unwrap()
    }

    #[test]
    fn a_program_that_is_started_without_a_run_says_how_to_start_it() {
        assert!(error_of("--gain 2").contains("ringwing run"));
        assert!(error_of("agent --uav 0 --domain k3x9ab").contains("--uav"));
        assert!(error_of("agent --uav 3").contains("--domain"));
    }
}
