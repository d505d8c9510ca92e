//! End to end: real processes, real signals, real shared memory, real files; one file for each behaviour.

#![expect(clippy::unwrap_used, reason = "what is not there fails the test")]
#![expect(unreachable_pub, reason = "the harness is a library of its own, though within one binary")]

mod harness;

mod bench;
mod command_line;
mod dependencies;
mod determinism;
mod endings;
mod faults;
mod losses;
mod presets;
mod real_time;
mod simulation;
mod sizes;
mod tools;
mod wiring;
