//! Where samples come in: received from one sender, past whatever is wrong with the link.

use crate::impairment::{Carried, Impairment, Route};
use ringwing_messages::{BusError, LinkCounts, Message, Subscriber, Tick};
use ringwing_scenario::fault::schedule::LinkFault;

/// The receiving end of one link.
pub(crate) struct Inlet<T: Message> {
    /// Absent while nobody listens.
    port: Option<Subscriber<T>>,
    route: Route,
    link: Impairment<T>,
    /// What was sent before the receiver's first tick is not heard: whether a newcomer still gets it is chance.
    first: Option<Tick>,
    /// The newest that has come, whatever the link then did to it.
    arrived: Option<Tick>,
}

impl<T: Carried + Message> Inlet<T> {
    pub(crate) fn new(port: Subscriber<T>, route: Route, seed: u64, rate_hz: u32) -> Self {
        let link = Impairment::new(route, seed, rate_hz);
        Self { port: Some(port), route, link, first: None, arrived: None }
    }

    pub(crate) fn is_open(&self) -> bool {
        self.port.is_some()
    }

    /// Listens again, from the next tick on.
    pub(crate) fn open(&mut self, port: Subscriber<T>) {
        (self.port, self.first) = (Some(port), None);
    }

    /// Listens no more; what is on its way is lost, what was counted stays.
    pub(crate) fn close(&mut self) {
        self.port = None;
        self.link.drop_all();
    }

    /// From now on the faults of this link are those of `faults`.
    pub(crate) fn set_faults(&mut self, faults: &[LinkFault]) {
        self.link.set_faults(faults);
    }

    /// Hands over what has come for `now`.
    ///
    /// Does not look for more after the newest that can be used; one of this very tick is no sign that the one before
    /// has come, for a successor's may overtake.
    pub(crate) fn receive(&mut self, now: Tick, mut take: impl FnMut(&T)) -> Result<(), BusError> {
        let Some(port) = &self.port else { return Ok(()) };
        let first = *self.first.get_or_insert(now);
        let newest = now.0 - self.route.ticks;
        let is_clear = self.link.is_clear();
        port.drain_until(|sample, _| {
            if sample.tick() >= first {
                self.arrived = self.arrived.max(Some(sample.tick()));
                if is_clear {
                    take(sample);
                } else {
                    self.link.offer(*sample);
                }
            }
            sample.tick().0 == newest
        })?;
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
