//! How the processes of a run find each other, exchange payloads, and step through time together.
//!
//! The only crate that knows iceoryx2, futexes and shared memory.
//!
//! - [`domain`] is a run's place in shared memory, and [`report`] names the files that processes leave there.
//! - [`services`] is the table of a run's services: a `blackboard` shows the values of the last ticks (`senses` is the
//!   one with two payloads), the `journal` carries everything to the log, and a `channel` carries rare messages.
//! - `gate` is the page at which all processes step through time, made of [`page`] and [`futex`]; `waker` and
//!   `wait_strategy` are how they wait for it.
//! - `member` is a process that takes part in a run, `answerer` one that answers ticks, and `observer` one that only
//!   looks. `fault_watch` tells them which faults a run has, and `request` asks the launcher of a run for something.
//!   `process`, `node` and `stop` are what they need of the operating system and of iceoryx2.
//! - `demand` is what a run takes of the machine, and `capacity` what the machine has.
//! - `awake` holds time limits that a stopped run does not use up, and `files` writes files that are whole or not there.
//! - `deadlines` says when ticks are due in real time, `placement` on which core a process runs, and `idle_cores` moves
//!   processes from busy cores to idle ones.
//! - `ballast` carries bytes for benchmarks, and `probe` is what a benchmark hooks into the loop that opens ticks.
//!
//! Must never decide anything about the flight: no law, no physics.

mod answerer;
mod awake;
mod ballast;
mod blackboard;
mod capacity;
mod channel;
mod deadlines;
mod demand;
pub mod domain;
mod error;
mod fault_watch;
mod files;
pub mod futex;
mod gate;
mod idle_cores;
pub mod journal;
mod member;
mod node;
mod observer;
pub mod page;
mod placement;
mod probe;
mod process;
pub mod report;
mod request;
mod retry;
mod senses;
pub mod services;
mod stamp;
mod starter;
mod stop;
mod wait_strategy;
mod waker;
mod wire;

pub use answerer::Answerer;
pub use awake::{AwakeClock, Patience};
pub use ballast::Ballast;
pub use blackboard::{Board, BoardAccess, BoardReader, BoardWriter};
pub use capacity::{Capacity, MemorySpace, Shortage, TaskLimit, TaskSpace};
pub use channel::{Channel, Publisher, Subscriber, failed_connections};
pub use deadlines::{Deadlines, Lateness};
pub use demand::Demand;
pub use domain::{Domain, DomainId, DomainOwner};
pub use error::BusError;
pub use fault_watch::FaultWatch;
pub use files::{copy_whole, write_whole, write_whole_by};
pub use gate::{Gate, Wait};
pub use idle_cores::IdleCores;
pub use journal::{JournalReader, JournalWriter};
pub use member::{Member, MemberArgs};
pub use node::{BusNode, create_node};
pub use observer::{OBSERVE, Observer};
pub use placement::{Cores, Placement, PlacementError};
pub use probe::{NoProbe, PacedTick, Proceed, TickProbe};
pub use process::{
    close_files_on_spawn, die_with, heeded, is_running, raise_open_files_limit, stop_self,
    survive_file_size_limit, without_restartable_sequences,
};
pub use request::{Answer, REFUSED};
pub use senses::{SensesReader, SensesWriter};
pub use services::Services;
pub use stamp::{Stamps, monotonic_ns};
pub use starter::Starter;
pub use stop::{StopFlag, SuspendFlag};
pub use wait_strategy::{Due, WaitStrategy, processes_per_core, usable_cores};
pub use waker::Waker;
pub use wire::Wire;
