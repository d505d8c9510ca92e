//! A process that answers ticks: it waits for each, does its work, and answers, until the run ends.
//!
//! Must never decide what an answer says.

use crate::{BusError, Gate, Member, StopFlag, Wait, Waker};
use ringwing_flight::{Part, Tick};

/// The place of an agent or of the leader in the rhythm of ticks.
#[derive(Debug)]
pub struct Answerer {
    part: Part,
    gate: Gate,
    waker: Waker,
    stop: StopFlag,
    last: Option<Tick>,
}

impl Answerer {
    /// Announces that `member` is ready to answer. All ports that it needs must be open before.
    pub fn join(member: &Member) -> Result<Self, BusError> {
        // Listen before announcing readiness: the world may open a tick right after, and an event that nobody listens
        // to is lost.
        let waker = Waker::of_answerer(member)?;
        let gate = member.announce_ready()?;
        Ok(Self { part: member.part(), last: gate.missed(), gate, waker, stop: member.stop().clone() })
    }

    /// Waits for the next tick; `None` when the flight is over or the process is asked to stop.
    ///
    /// In real time a process stands by, awake, shortly before a tick is due. Then it has time to `rehearse` the tick, given
    /// the last one: whatever that touches is in the caches when the tick opens.
    pub fn next_tick(&mut self, mut rehearse: impl FnMut(Tick)) -> Result<Option<Tick>, BusError> {
        let rehearse_next = || self.last.into_iter().for_each(&mut rehearse);
        match self.waker.wait_for_tick(&self.gate, self.last, &self.stop, rehearse_next)? {
            Wait::Tick(tick) => Ok(Some(tick)),
            Wait::Closed | Wait::Stopped => Ok(None),
        }
    }

    /// Answers `tick`. Everything that this process sends for it must be published before.
    pub fn answer(&mut self, tick: Tick) -> Result<(), BusError> {
        // Count the answer before the event goes out: the event only makes the world look at the count.
        self.gate.answer(self.part, tick);
        self.last = Some(tick);
        self.waker.notify()
    }

    /// The gate, for everything that it tells besides the tick.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }
}
