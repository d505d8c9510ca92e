//! Where samples come in: received from one sender, past whatever is wrong with the link.

use crate::{
    arrivals::Arrivals,
    impairment::{Carried, Impairment, Route},
};
use ringwing_bus::{BusError, Subscriber};
use ringwing_flight::{LinkCounts, Payload, Tick};
use ringwing_scenario::{Scenario, fault::schedule::LinkFault};

/// The receiving end of one link.
pub(crate) struct Inlet<T: Payload> {
    /// Absent while nobody listens.
    port: Option<Subscriber<T>>,
    arrivals: Arrivals<T>,
    link: Impairment<T>,
    /// The newest that has come, whatever the link then did to it.
    arrived: Option<Tick>,
}

impl<T: Carried + Payload> Inlet<T> {
    pub(crate) fn new(port: Subscriber<T>, route: Route, scenario: &Scenario) -> Self {
        let time = &scenario.time;
        let link = Impairment::new(route, scenario.seed, time.rate_hz);
        Self { port: Some(port), arrivals: Arrivals::new(route.ticks, !time.real_time), link, arrived: None }
    }

    pub(crate) fn is_open(&self) -> bool {
        self.port.is_some()
    }

    /// Listens again, from the next tick on.
    pub(crate) fn open(&mut self, port: Subscriber<T>) {
        self.port = Some(port);
    }

    /// Listens no more; what is on its way is lost, what was counted stays.
    pub(crate) fn close(&mut self) {
        self.port = None;
        self.arrivals.forget();
        self.link.drop_all();
    }

    /// From now on the faults of this link are those of `faults`.
    pub(crate) fn set_faults(&mut self, faults: &[LinkFault]) {
        self.link.set_faults(faults);
    }

    /// Hands over what has come for `now`; looks for no more than the newest that can be used.
    pub(crate) fn receive(&mut self, now: Tick, mut take: impl FnMut(&T)) -> Result<(), BusError> {
        let Some(port) = &self.port else { return Ok(()) };
        let (is_clear, link) = (self.link.is_clear(), &mut self.link);
        let mut pass = |sample: &T| if is_clear { take(sample) } else { link.offer(*sample) };
        if !self.arrivals.begin(now, &mut pass) {
            port.drain_until(|sample, _| {
                self.arrived = self.arrived.max(Some(sample.tick()));
                self.arrivals.sort(sample, &mut pass)
            })?;
        }
        if !is_clear {
            self.link.deliver(now, |sample| take(&sample));
        }
        Ok(())
    }

    /// The tick of the newest sample that has come.
    pub(crate) fn arrived(&self) -> Option<Tick> {
        self.arrived
    }

    /// What has become of all samples, if the link has faults.
    pub(crate) fn counts(&self, now: Tick) -> Option<LinkCounts> {
        (!self.link.is_clear()).then(|| self.link.counts(now))
    }
}
