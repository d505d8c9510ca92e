//! The faults of one link in one direction: which samples arrive, in which tick, how often, and with what error.
//!
//! A link fault is applied where the sample is received. It is a pure function of (seed, link, sending tick): a fault
//! on one link changes nothing on another, and a receiver that is restarted sees the same faults again. Samples that
//! are in flight are lost with their receiver.
//!
//! Never looks at what a sample says, only at when it was sent.

#[cfg(test)]
mod tests;

use super::{
    active_fault::{ActiveFault, Fate, LinkDraws},
    route::Route,
    sample::Sample,
};
use ringwing_flight::{LinkCounts, Tick};
use ringwing_scenario::fault::schedule::LinkFault;

/// A sample that was sent and has not arrived yet.
#[derive(Debug, Clone, Copy)]
struct InFlight<T> {
    sample: T,
    /// It arrives in this tick, or later if it is held.
    due: Tick,
    is_held: bool,
}

/// One link with its faults.
#[derive(Debug, Clone)]
pub struct ImpairedLink<T> {
    route: Route,
    seed: u64,
    rate_hz: u32,
    faults: Vec<ActiveFault>,
    /// Samples received since the last delivery.
    offered: Vec<T>,
    in_flight: Vec<InFlight<T>>,
    /// The newest sample that was sent while the link was not stuck.
    last_true: Option<T>,
    counts: LinkCounts,
}

impl<T: Sample> ImpairedLink<T> {
    /// The link `route`, without faults at first. The draws of its faults depend on `seed`.
    pub fn new(route: Route, seed: u64, rate_hz: u32) -> Self {
        Self {
            route,
            seed,
            rate_hz,
            faults: Vec::new(),
            offered: Vec::new(),
            in_flight: Vec::new(),
            last_true: None,
            counts: LinkCounts::none(route.source, route.to),
        }
    }

    /// Replaces the link's faults by those of `faults` that concern it. Samples in flight stay in flight.
    pub fn set_faults(&mut self, faults: &[LinkFault]) {
        self.faults = ActiveFault::of_route(faults, &self.route);
    }

    /// Whether the link has no fault and nothing in flight: then samples can bypass it.
    ///
    /// A fault that is over or still to come counts as one, so that the link's counts cover the whole flight.
    pub fn is_clear(&self) -> bool {
        self.faults.is_empty() && self.in_flight.is_empty()
    }

    /// Takes a received sample, in any order.
    pub fn offer(&mut self, sample: T) {
        self.offered.push(sample);
    }

    /// Passes on the samples that arrive in `now`, in their order of arrival.
    pub fn deliver(&mut self, now: Tick, mut take: impl FnMut(T)) {
        // The order in which samples were offered depends on scheduling.
        self.offered.sort_by_key(Sample::tick);
        for sample in std::mem::take(&mut self.offered) {
            self.send(sample);
        }
        // A held sample waits for every `hold` on its link, even one that began after it was sent.
        let holds = self.faults.iter().any(|fault| fault.holds(now));
        let arrives = |one: &mut InFlight<T>| one.due <= now && !(one.is_held && holds);
        let mut arrived: Vec<_> = self.in_flight.extract_if(.., arrives).collect();
        // The order in flight depends on when samples were polled, so sort by tick here too.
        arrived.sort_by_key(|one| (one.due, one.sample.tick()));
        let newest_usable = Tick(now.0 - self.route.latency_ticks);
        for InFlight { sample, .. } in arrived {
            self.counts.delivered += 1;
            self.counts.late += u64::from(sample.tick() < newest_usable);
            take(sample);
        }
    }

    /// Loses everything in flight: the receiver no longer listens.
    pub fn drop_all(&mut self) {
        self.counts.lost += self.in_flight.len() as u64;
        self.in_flight.clear();
        self.offered.clear();
    }

    /// The counts of all samples so far, as of `now`.
    pub fn counts(&self, now: Tick) -> LinkCounts {
        LinkCounts { tick: now, in_flight: self.in_flight.len() as u64, ..self.counts }
    }

    /// Puts a sample and its copies in flight, or loses it.
    fn send(&mut self, sample: T) {
        let sent = sample.tick();
        let mut fate = Fate::undisturbed(self.true_or_stuck(sample));
        let draws = LinkDraws { seed: self.seed, route: self.route, sent };
        // The sending tick decides which faults apply. The tick of reception would depend on the other faults.
        for fault in self.faults.iter_mut().filter(|fault| fault.is_on(sent)) {
            fault.apply(draws, &mut fate);
        }
        self.counts.offered += 1;
        if fate.is_lost {
            self.counts.lost += 1;
            return;
        }
        // Whole ticks, because a receiver reads only once a tick.
        let delay_ticks = (fate.delay_s * f64::from(self.rate_hz)).round() as i64;
        let due = Tick(sent.0 + self.route.latency_ticks + delay_ticks);
        let Fate { sample, is_held, copies, .. } = fate;
        self.in_flight.push(InFlight { sample, due, is_held });
        // Copies follow one tick behind, as a retransmission would.
        for _ in 0..copies {
            self.counts.duplicated += 1;
            self.in_flight.push(InFlight { sample, due: due.next(), is_held });
        }
    }

    /// The sample itself, or the value that a stuck link repeats in its place, stamped as new.
    fn true_or_stuck(&mut self, sample: T) -> T {
        let sent = sample.tick();
        if self.faults.iter().any(|fault| fault.sticks(sent)) {
            // A receiver that started after the link stuck repeats the first sample that it gets.
            return self.last_true.get_or_insert(sample).stamped(sent);
        }
        self.last_true = Some(sample);
        sample
    }
}
