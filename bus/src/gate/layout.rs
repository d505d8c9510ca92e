//! Where each value of the tick gate is on its page, who writes it, and what it means.
//!
//! A tick is on the page as its *round*: the tick + 2, so that 0 means that no tick was opened yet.
//!
//! Must never read or write a value: the methods of the gate do.

use crate::page::{Number, Word};
use ringwing_flight::{Part, Tick, payload::MAX_UAVS};

/// World: the round that is open; 0 before the first, [`CLOSED`] at the end.
///
/// On its line is all else that an answering process has to look at in every tick. The world writes it at the same time,
/// so that a waiting process gets all of it with the line that it waits for.
pub(super) const ROUND: Word = Word::on(0);
/// World: how many answers it waits for.
pub(super) const EXPECTED: Word = ROUND.beside(1);
/// World: 1 if the open tick goes into the journal, so that agents have to account for their commands.
pub(super) const RECORDS: Word = ROUND.beside(2);
/// Launcher, seldom: how many faults were added during the run.
pub(super) const FAULTS: Word = ROUND.beside(3);
/// World: when the next tick is due, in ns of the monotonic clock; 0 in lockstep.
pub(super) const DUE_AT_NS: Number = Number::on(0);
/// World: how long before that a waiting process should be awake, in ns; 0 in lockstep.
pub(super) const DUE_LEAD_NS: Number = DUE_AT_NS.beside(1);
/// Answering processes: how many answers this round has.
pub(super) const ANSWERS: Word = Word::on(1);
/// World: 1 while it sleeps on [`ANSWERS`]. It is on the same line, because who answers has to look at it right after.
pub(super) const WORLD_SLEEPS: Word = ANSWERS.beside(1);
/// Answering processes: how many of them sleep on [`ROUND`].
pub(super) const SLEEPERS: Word = Word::on(2);
/// Launcher and recorder: grows when the world has to look at more than the answers.
pub(super) const NUDGES: Word = Word::on(3);
/// World: grows with each batch of ticks that the recorder should read.
pub(super) const BATCH: Word = Word::on(4);
/// Recorder: the last tick that it has read.
pub(super) const RECORDED: Number = Number::on(5);
/// Launcher: 1 when the user wants the run to end.
pub(super) const STOP: Word = Word::on(6);
/// Launcher, once: how many cores the processes that step through time share.
pub(super) const CORES: Word = STOP.beside(1);
/// World: the tick that it does not open before the launcher has applied the faults due, or [`NOT_HELD`].
pub(super) const HELD: Number = Number::on(7);
/// World: grows each time that it begins to hold.
pub(super) const HOLDS: Word = Word::on(8);
/// The line of the first part: its process id, and how far it has answered.
const FIRST_READY: usize = 9;

/// How many parts a run can have.
const PARTS: usize = 3 + MAX_UAVS as usize;
/// The line of the first part's incarnation. These lines are apart from those above, which their processes write in
/// every tick: readers of the one must not wait for the cache line of the other.
const FIRST_INCARNATION: usize = FIRST_READY + PARTS;
/// How many lines the page has.
pub(super) const LINES: usize = FIRST_INCARNATION + PARTS;

/// In [`ROUND`]: the flight is over.
pub(super) const CLOSED: u32 = u32::MAX;
/// In [`HELD`]: the world holds no tick.
pub(super) const NOT_HELD: i64 = i64::MIN;

/// `part` itself or, when it has ended, the launcher: the id of its process once that is ready, else 0.
pub(super) fn ready(part: Part) -> Word {
    Word::on(FIRST_READY + part.index())
}

/// `part` itself, while it answers ticks: the last tick that it has answered, or that it has no part in.
pub(super) fn answered(part: Part) -> Number {
    Number::on(FIRST_READY + part.index())
}

/// Launcher: which process of `part` is the newest, counted from 1; 0 before the first.
pub(super) fn incarnation(part: Part) -> Word {
    Word::on(FIRST_INCARNATION + part.index())
}

/// The round of `tick`.
///
/// # Panics
/// If `tick` is before [`Tick::APPROACH`], or 2^32 - 3 or later: that is more than a year of flight at 100 Hz.
pub(super) fn round_of(tick: Tick) -> u32 {
    u32::try_from(tick.0 + 2)
        .ok()
        .filter(|round| *round != CLOSED)
        .expect("a run has fewer than 2^32 - 3 ticks")
}

/// The tick of `round`, which is neither 0 nor [`CLOSED`].
pub(super) fn tick_of(round: u32) -> Tick {
    Tick(i64::from(round) - 2)
}
