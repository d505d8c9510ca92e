//! The program's end: it receives situations, and sends back what its controller wishes.
//!
//! Never knows the flight: what is not in a situation does not exist here.

use crate::socket::{LONGEST_TO_PROGRAM, greeting, receive, send};
use ringwing_agent::controller::{
    Controller,
    message::{ReceivedSituation, wish_bytes},
};
use ringwing_bus::{BusError, die_with};
use ringwing_scenario::{Scenario, ScenarioError};
use rustix::{
    io::fcntl_dupfd_cloexec,
    stdio::{dup2_stdin, stdin},
};
use std::{fs::File, io, os::unix::net::UnixStream};

/// The first descriptor after standard input, output and error.
const FIRST_FREE: i32 = 3;

/// Why a program cannot be the controller of a UAV in a simulated flight.
#[derive(Debug, thiserror::Error)]
pub enum GuestError {
    /// It cannot be tied to the process that flies.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Nobody is at the other end of its standard input.
    #[error("no simulated flight is at the other end of standard input: {0}")]
    Socket(#[from] io::Error),
    /// The scenario cannot be read.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A message is not what a flight sends.
    #[error("the flight sent something that is not a {0}: it was built with another version of ringwing")]
    Foreign(&'static str),
}

/// The UAV to fly, and the process that flies the others.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct SeatArgs {
    /// The UAV to fly, from 1.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub uav: u32,
    /// Process id of the process that flies; this process ends with it.
    #[arg(long, value_name = "PID", hide = true)]
    pub launcher: u32,
}

/// Answers with the wishes of the controller that `make` makes until the flight ends.
///
/// # Errors
/// The process was not started by a flight, or their versions differ.
pub fn serve<C: Controller>(seat: &SeatArgs, make: impl FnOnce(&Scenario) -> C) -> Result<(), GuestError> {
    die_with(seat.launcher)?;
    let mut socket = take_stdin()?;
    let text = receive(&mut socket, LONGEST_TO_PROGRAM)?.ok_or(GuestError::Foreign("scenario"))?;
    let text = String::from_utf8(text).map_err(|_| GuestError::Foreign("scenario"))?;
    let mut controller = make(&Scenario::resolved(&text)?);
    send(&mut socket, greeting().as_bytes())?;
    while let Some(bytes) = receive(&mut socket, LONGEST_TO_PROGRAM)? {
        let received = ReceivedSituation::of_bytes(&bytes).ok_or(GuestError::Foreign("situation"))?;
        let wish = controller.step(&received.situation());
        send(&mut socket, &wish_bytes(&wish))?;
    }
    Ok(())
}

/// Takes the socket from standard input, which is empty afterwards: neither the controller nor a process that it starts may read
/// what is not meant for it.
fn take_stdin() -> io::Result<UnixStream> {
    let socket = fcntl_dupfd_cloexec(stdin(), FIRST_FREE)?;
    dup2_stdin(File::open("/dev/null")?)?;
    Ok(UnixStream::from(socket))
}
