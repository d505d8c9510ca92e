//! End-to-end tests: real processes, signals, shared memory and files. Each module tests one behaviour.

#![expect(clippy::unwrap_used, reason = "a missing value fails the test")]
#![expect(clippy::print_stderr, reason = "the output of a test is for its reader")]
#![expect(
    unreachable_pub,
    reason = "the harness is written like a library, although it is part of one binary"
)]

mod harness;

mod baseline;
mod bench;
mod c_controllers;
mod cluster;
mod command_line;
mod conform;
mod controllers;
mod defaults;
mod dependencies;
mod determinism;
mod endings;
mod faults;
mod hunt;
mod live;
mod logs;
mod losses;
mod machines;
mod manual;
mod margin;
mod pauses;
mod presets;
mod printing;
mod real_time;
mod shrink;
mod simulated;
mod simulation;
mod sizes;
mod stepping;
mod sweep;
mod tools;
mod watch;
mod wiring;
