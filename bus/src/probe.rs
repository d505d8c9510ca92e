//! What a benchmark hooks into the loop that opens ticks.
//!
//! Must never change what a tick does: without a probe, and with one, the same samples fly.

use crate::{BusError, Gate, Stamps};
use ringwing_flight::{Tick, UavId};

/// Observes every tick of the process that opens them; the methods are called in the order in which they stand here.
///
/// Every method does nothing by default. [`NoProbe`] keeps all defaults, so a flight without a measurement pays nothing.
pub trait TickProbe {
    /// Called between two ticks; says how to go on.
    fn before_tick(&mut self, _gate: &Gate) -> Proceed {
        Proceed::Fly
    }

    /// `tick` was opened at `opened_ns`.
    fn tick_opened(&mut self, _tick: Tick, _opened_ns: u64) {}

    /// Everything that the agents need for the tick was sent.
    fn inputs_published(&mut self) {}

    /// The process begins to look for answers; it may do so several times in a tick.
    fn collecting_answers(&mut self) {}

    /// An answer of `uav` was read at `seen_ns`, to this tick or an earlier one.
    fn answer_seen(&mut self, _uav: UavId, _tick: Tick, _stamps: &Stamps, _seen_ns: u64) {}

    /// All answers that had come were read.
    fn answers_collected(&mut self) {}

    /// The tick is over. `reused` airframes flew on an older command; `paced` is when the next tick is due, in real time.
    fn tick_finished(&mut self, _reused: u32, _paced: Option<PacedTick>) {}

    /// Whether the probe has seen all that it wants to see.
    fn is_done(&self) -> bool {
        false
    }

    /// No further tick will come; all processes of the run are still there.
    fn run_ended(&mut self, _gate: &Gate) -> Result<(), BusError> {
        Ok(())
    }
}

/// How to go on between two ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proceed {
    /// Open the next tick.
    Fly,
    /// Restart the deadlines, because the probe has just taken some time; then open the next tick.
    RestartDeadlines,
    /// End the run.
    End,
}

/// When the next tick is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacedTick {
    /// Its deadline, by the monotonic clock.
    pub due_ns: u64,
    /// How many deadlines after that one have passed, too, and have no tick of their own.
    pub skipped: u32,
}

/// Observes nothing.
#[derive(Debug, Clone, Copy)]
pub struct NoProbe;

impl TickProbe for NoProbe {}
