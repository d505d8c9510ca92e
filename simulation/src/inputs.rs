//! What was sent, as each receiver finds it: in place of the services.
//!
//! Never delays or loses a sample: that is what the receivers do.

use ringwing_agent::reception::{Inputs, Sample, Take};
use ringwing_flight::{LeaderState, Sensed, Tick, Traffic, UavId, UavState};
use std::{collections::VecDeque, convert::Infallible, ops::RangeInclusive};

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

    /// Hands over what was sent in `ticks`.
    fn hand_over(&self, ticks: &RangeInclusive<Tick>, take: &mut Take<T>) {
        self.0.iter().filter(|sample| ticks.contains(&sample.tick())).for_each(take);
    }
}

/// Everything that was sent in the flight lately.
#[derive(Debug, Clone)]
pub(crate) struct Air {
    /// To each UAV from its own airframe, UAV 1 first.
    pub(crate) sensed: Vec<Sent<Sensed>>,
    /// The traffic near each UAV, UAV 1 first; nothing without collision filters.
    pub(crate) traffic: Vec<Sent<Traffic>>,
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
            traffic: vec![Sent::nothing(); count],
            states: vec![Sent::nothing(); count],
            leader: Sent::nothing(),
        }
    }
}

/// What one agent receives.
pub(crate) struct AgentInputs<'a> {
    pub(crate) uav: UavId,
    pub(crate) air: &'a Air,
}

impl Inputs for AgentInputs<'_> {
    type Error = Infallible;

    fn sensed(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Sensed>) -> Result<(), Infallible> {
        self.air.sensed[self.uav.index()].hand_over(&ticks, take);
        Ok(())
    }

    fn traffic(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Traffic>) -> Result<(), Infallible> {
        self.air.traffic[self.uav.index()].hand_over(&ticks, take);
        Ok(())
    }

    fn state(
        &mut self,
        from: UavId,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<UavState>,
    ) -> Result<(), Infallible> {
        self.air.states[from.index()].hand_over(&ticks, take);
        Ok(())
    }

    fn leader(
        &mut self,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<LeaderState>,
    ) -> Result<(), Infallible> {
        self.air.leader.hand_over(&ticks, take);
        Ok(())
    }

    // All that was sent is in one place, so there is nothing to open or close.

    fn open_state(&mut self, _from: UavId) -> Result<(), Infallible> {
        Ok(())
    }

    fn close_state(&mut self, _from: UavId) {}
}
