//! What was sent, as each receiver finds it: in place of the services.
//!
//! Never delays or loses a sample: that is what the receivers do.

use ringwing_agent::reception::{Inputs, Sample, Take};
use ringwing_flight::{LeaderState, Sensed, Tick, UavId, UavState};
use std::{collections::VecDeque, convert::Infallible};

/// Samples kept of each sender. A thawed agent needs the newest two; more are only copied.
const KEPT: usize = 2;

/// The newest samples of one sender, oldest first.
#[derive(Debug, Clone)]
pub(crate) struct Sent<T>(VecDeque<T>);

impl<T: Sample> Sent<T> {
    pub(crate) fn nothing() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }

    pub(crate) fn push(&mut self, sample: T) {
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    pub(crate) fn newest(&self) -> Option<&T> {
        self.0.back()
    }

    /// The tick of the newest sample: whoever begins to listen now has missed everything up to it.
    fn missed(&self) -> Tick {
        self.newest().map_or(Tick(i64::MIN), Sample::tick)
    }

    /// Hands over what was sent after `cursor`, which moves along.
    fn hand_over(&self, cursor: &mut Tick, take: &mut Take<T>) {
        for sample in self.0.iter().skip_while(|sample| sample.tick() <= *cursor) {
            *cursor = sample.tick();
            if take(sample) {
                return;
            }
        }
    }
}

/// Everything that was sent in the flight lately.
#[derive(Debug, Clone)]
pub(crate) struct Air {
    /// To each UAV from its own airframe, UAV 1 first.
    pub(crate) sensed: Vec<Sent<Sensed>>,
    /// By each UAV to those who listen.
    pub(crate) states: Vec<Sent<UavState>>,
    /// By the leader to all.
    pub(crate) leader: Sent<LeaderState>,
}

impl Air {
    pub(crate) fn new(uavs: u32) -> Self {
        let count = uavs as usize;
        Self {
            sensed: vec![Sent::nothing(); count],
            states: vec![Sent::nothing(); count],
            leader: Sent::nothing(),
        }
    }
}

/// How far one agent has received from each sender: the tick of the last sample handed over.
#[derive(Debug, Clone)]
pub(crate) struct Cursors {
    sensed: Tick,
    leader: Tick,
    /// Only those UAVs that it listens to: few, so that a search is faster than a map.
    states: Vec<(UavId, Tick)>,
}

impl Cursors {
    /// Those of an agent of `uav` that starts now and listens to `listened`: it has missed all that was sent before.
    pub(crate) fn of_newcomer(air: &Air, uav: UavId, listened: &[UavId]) -> Self {
        let missed = |from: &UavId| (*from, air.states[from.index()].missed());
        Self {
            sensed: air.sensed[uav.index()].missed(),
            leader: air.leader.missed(),
            states: listened.iter().map(missed).collect(),
        }
    }
}

/// What one agent receives.
pub(crate) struct AgentInputs<'a> {
    pub(crate) uav: UavId,
    pub(crate) air: &'a Air,
    pub(crate) cursors: &'a mut Cursors,
}

impl Inputs for AgentInputs<'_> {
    type Error = Infallible;

    fn sensed(&mut self, take: &mut Take<Sensed>) -> Result<(), Infallible> {
        self.air.sensed[self.uav.index()].hand_over(&mut self.cursors.sensed, take);
        Ok(())
    }

    fn state(&mut self, from: UavId, take: &mut Take<UavState>) -> Result<(), Infallible> {
        if let Some((_, cursor)) = self.cursors.states.iter_mut().find(|(uav, _)| *uav == from) {
            self.air.states[from.index()].hand_over(cursor, take);
        }
        Ok(())
    }

    fn leader(&mut self, take: &mut Take<LeaderState>) -> Result<(), Infallible> {
        self.air.leader.hand_over(&mut self.cursors.leader, take);
        Ok(())
    }

    fn open_state(&mut self, from: UavId) -> Result<bool, Infallible> {
        self.cursors.states.push((from, self.air.states[from.index()].missed()));
        Ok(true)
    }

    fn close_state(&mut self, from: UavId) {
        self.cursors.states.retain(|(uav, _)| *uav != from);
    }
}
