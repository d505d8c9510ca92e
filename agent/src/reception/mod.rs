//! Reception: what an agent makes of the samples that its inputs hand over.
//!
//! [`Arrivals`] decides in which tick a sample can be used, [`ImpairedLink`] what the faults of its link do to it,
//! and a [`LinkReceiver`] joins the two. [`Inputs`] is where the samples come from: ports, or plain arrays.
//!
//! Never knows how samples travel: no port, no service, no clock.

mod active_fault;
pub mod arrivals;
mod capacity;
pub mod impairment;
mod route;
pub mod sample;
mod sensor_limits;

pub use arrivals::Arrivals;
pub use impairment::ImpairedLink;
pub use route::Route;
pub use sample::Sample;
pub use sensor_limits::sensor_limits;

use ringwing_flight::{LeaderState, LinkCounts, Pace, Sensed, Tick, Traffic, UavId, UavState};
use ringwing_scenario::{Scenario, fault::schedule::LinkFault};
use std::ops::RangeInclusive;

/// Takes one sample.
pub type Take<'t, T> = dyn FnMut(&T) + 't;

/// Where an agent's samples come from.
///
/// A read hands over the samples of one sender that were sent in the given ticks, oldest first, as far as they have
/// come and are still kept. It does not change them: the same read may be repeated.
pub trait Inputs {
    /// Why an input cannot be read.
    type Error;

    /// Reads what the UAV senses of itself and of obstacles.
    fn sensed(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Sensed>) -> Result<(), Self::Error>;

    /// Reads which other aircraft the UAV senses. Called only by an agent with a collision filter.
    fn traffic(&mut self, ticks: RangeInclusive<Tick>, take: &mut Take<Traffic>) -> Result<(), Self::Error>;

    /// Reads what UAV `from` tells its neighbours. Its input is open.
    fn state(
        &mut self,
        from: UavId,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<UavState>,
    ) -> Result<(), Self::Error>;

    /// Reads what the leader sends.
    fn leader(
        &mut self,
        ticks: RangeInclusive<Tick>,
        take: &mut Take<LeaderState>,
    ) -> Result<(), Self::Error>;

    /// Starts to listen to `from`, so that what it sends from the next tick on can be read.
    fn open_state(&mut self, from: UavId) -> Result<(), Self::Error>;

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
    arrivals: Arrivals,
    link: ImpairedLink<T>,
}

impl<T: Sample> LinkReceiver<T> {
    /// The open end of `route` with its share of `faults`. It is a newcomer in the next tick.
    pub fn new(route: Route, settings: LinkSettings, faults: &[LinkFault]) -> Self {
        let mut link = ImpairedLink::new(route, settings.seed, settings.rate_hz);
        link.set_faults(faults);
        let arrivals = Arrivals::new(route.latency_ticks, settings.pace);
        Self { is_open: true, arrivals, link }
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

    /// Passes on the samples that can be used in `now`, which it reads with `read`.
    pub fn receive<E>(
        &mut self,
        now: Tick,
        read: impl FnOnce(RangeInclusive<Tick>, &mut Take<T>) -> Result<(), E>,
        mut take: impl FnMut(&T),
    ) -> Result<(), E> {
        if !self.is_open {
            return Ok(());
        }
        let Self { arrivals, link, .. } = self;
        // Most links never have a fault. Their samples bypass the impairment, which would copy and sort them.
        let is_clear = link.is_clear();
        let usable = arrivals.usable(now);
        if !usable.is_empty() {
            read(usable, &mut |sample| {
                // Note the sample before its link may lose it: otherwise the next read would offer it again.
                arrivals.note(sample.tick());
                if is_clear { take(sample) } else { link.offer(*sample) }
            })?;
        }
        // Even if nothing new has come: delayed samples arrive in their own ticks.
        if !is_clear {
            link.deliver(now, |sample| take(&sample));
        }
        Ok(())
    }

    /// The link's counts as of `now`; `None` for a link without faults.
    pub fn counts(&self, now: Tick) -> Option<LinkCounts> {
        (!self.link.is_clear()).then(|| self.link.counts(now))
    }

    /// The counts as of `now` once for each fault that has altered its first sample since the last call.
    pub fn news(&mut self, now: Tick) -> Vec<LinkCounts> {
        self.link.news(now)
    }

    /// The counts as of `now` once for each fault that has altered a sample.
    pub fn all_acted(&self, now: Tick) -> Vec<LinkCounts> {
        self.link.all_acted(now)
    }
}

#[cfg(test)]
mod tests;
