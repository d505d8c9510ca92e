//! Reception: what an agent makes of the samples that its inputs hand over.
//!
//! [`Arrivals`] decides in which tick a sample can be used, [`ImpairedLink`] what the faults of its link do to it,
//! and a [`LinkReceiver`] joins the two. [`Inputs`] is where the samples come from: ports, or plain arrays.
//!
//! Never knows how samples travel: no port, no service, no clock.

mod active_fault;
pub mod arrivals;
pub mod impairment;
mod route;
pub mod sample;

pub use arrivals::Arrivals;
pub use impairment::ImpairedLink;
pub use route::Route;
pub use sample::Sample;

use ringwing_flight::{LeaderState, LinkCounts, Pace, Sensed, Tick, UavId, UavState};
use ringwing_scenario::{Scenario, fault::schedule::LinkFault};

/// Takes one sample; returns whether it is the newest that can be used now, so that polling for more is useless.
pub type Take<'t, T> = dyn FnMut(&T) -> bool + 't;

/// Where an agent's samples come from.
///
/// A poll hands over the samples that are available from one sender, oldest first and each of them once, until `take`
/// returns `true` or there are no more. What is left then is handed over by the next poll. Samples of the present
/// tick may be among them: the agent keeps those until it can use them.
pub trait Inputs {
    /// Why an input cannot be read.
    type Error;

    /// Polls what the UAV senses of itself and of obstacles.
    fn sensed(&mut self, take: &mut Take<Sensed>) -> Result<(), Self::Error>;

    /// Polls what UAV `from` tells its neighbours.
    fn state(&mut self, from: UavId, take: &mut Take<UavState>) -> Result<(), Self::Error>;

    /// Polls what the leader sends.
    fn leader(&mut self, take: &mut Take<LeaderState>) -> Result<(), Self::Error>;

    /// Starts to listen to `from`, so that what it sends from the next tick on is available. Returns false if that is
    /// impossible at the moment; the agent then tries again in its next tick.
    fn open_state(&mut self, from: UavId) -> Result<bool, Self::Error>;

    /// Stops listening to `from`.
    fn close_state(&mut self, from: UavId);
}

/// What all links of one receiver have in common.
#[derive(Debug, Clone, Copy)]
pub struct LinkSettings {
    /// Seed of the draws for faults.
    pub seed: u64,
    /// Ticks a second.
    pub rate_hz: u32,
    /// Whether all processes step through time together.
    pub pace: Pace,
}

impl LinkSettings {
    /// The settings of `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        Self { seed: scenario.seed, rate_hz: scenario.time.rate_hz, pace: scenario.pace() }
    }
}

/// The receiving end of one link.
#[derive(Debug, Clone)]
pub struct LinkReceiver<T> {
    is_open: bool,
    arrivals: Arrivals<T>,
    link: ImpairedLink<T>,
    /// The tick of the newest sample that has arrived, before any fault applies.
    newest_arrived: Option<Tick>,
}

impl<T: Sample> LinkReceiver<T> {
    /// The open end of `route` with its share of `faults`. It is a newcomer in the next tick.
    pub fn new(route: Route, settings: LinkSettings, faults: &[LinkFault]) -> Self {
        let mut link = ImpairedLink::new(route, settings.seed, settings.rate_hz);
        link.set_faults(faults);
        let arrivals = Arrivals::new(route.latency_ticks, settings.pace);
        Self { is_open: true, arrivals, link, newest_arrived: None }
    }

    /// Whether it listens.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Listens again, as a newcomer in the next tick.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// Stops listening. What is in flight is lost; the counts stay.
    pub fn close(&mut self) {
        self.is_open = false;
        self.arrivals.reset();
        self.link.drop_all();
    }

    /// Replaces the link's faults by those of `faults` that concern it.
    pub fn set_faults(&mut self, faults: &[LinkFault]) {
        self.link.set_faults(faults);
    }

    /// Passes on the samples that can be used in `now`. It calls `poll` only if the newest of them has not arrived yet.
    pub fn receive<E>(
        &mut self,
        now: Tick,
        poll: impl FnOnce(&mut Take<T>) -> Result<(), E>,
        mut take: impl FnMut(&T),
    ) -> Result<(), E> {
        if !self.is_open {
            return Ok(());
        }
        let Self { arrivals, link, newest_arrived, .. } = self;
        // Most links never have a fault. Their samples bypass the impairment, which would copy and sort them.
        let is_clear = link.is_clear();
        let mut pass = |sample: &T| if is_clear { take(sample) } else { link.offer(*sample) };
        if !arrivals.begin(now, &mut pass) {
            poll(&mut |sample| {
                *newest_arrived = (*newest_arrived).max(Some(sample.tick()));
                arrivals.sort(sample, &mut pass)
            })?;
        }
        if !is_clear {
            link.deliver(now, |sample| take(&sample));
        }
        Ok(())
    }

    /// The tick of the newest sample that has arrived, whatever a fault then does to it.
    pub fn newest_arrived(&self) -> Option<Tick> {
        self.newest_arrived
    }

    /// The link's counts as of `now`; `None` for a link without faults.
    pub fn counts(&self, now: Tick) -> Option<LinkCounts> {
        (!self.link.is_clear()).then(|| self.link.counts(now))
    }
}

#[cfg(test)]
mod tests;
