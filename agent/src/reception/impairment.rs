//! The faults of one link in one direction: which samples arrive, in which tick, how often, and with what error.
//!
//! A link fault is applied where the sample is received. It is a pure function of (seed, link, sending tick): a fault
//! on one link changes nothing on another, and a receiver that is restarted sees the same faults again. Samples that
//! are in flight are lost with their receiver, and so is the queue of a link with a limited rate.
//!
//! Never looks at what a sample says, only at when it was sent.

#[cfg(test)]
mod tests;

use super::{
    active_fault::{ActiveFault, Fate, LinkDraws, whole_ticks},
    capacity::{Passage, RateLimit, SendQueue},
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
    /// Samples that wait for the capacity of the link.
    queue: SendQueue<T>,
    in_flight: Vec<InFlight<T>>,
    /// The newest sample that was sent while the link was not stuck.
    last_true: Option<T>,
    counts: LinkCounts,
    /// The faults that have altered a sample, by number, in the order of their first effects.
    acted: Vec<u32>,
    /// How many of these were reported.
    reported: usize,
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
            queue: SendQueue::new(),
            in_flight: Vec::new(),
            last_true: None,
            counts: LinkCounts::none(route.source, route.to),
            acted: Vec::new(),
            reported: 0,
        }
    }

    /// Replaces the link's faults by those of `faults` that concern it. Samples in flight stay in flight.
    pub fn set_faults(&mut self, faults: &[LinkFault]) {
        self.faults = ActiveFault::of_route(faults, &self.route, self.rate_hz);
    }

    /// Whether the link has no fault and nothing in flight: then samples can bypass it.
    ///
    /// A fault that is over or still to come counts as one, so that the link's counts cover the whole flight.
    pub fn is_clear(&self) -> bool {
        self.faults.is_empty() && self.in_flight.is_empty() && self.queue.len() == 0
    }

    /// Takes a received sample, in any order.
    pub fn offer(&mut self, sample: T) {
        self.offered.push(sample);
    }

    /// Passes on the samples that arrive in `now`, in their order of arrival.
    pub fn deliver(&mut self, now: Tick, mut take: impl FnMut(T)) {
        // The order in which samples were offered depends on scheduling.
        self.offered.sort_by_key(Sample::tick);
        let mut passages = Vec::new();
        let newest_usable = Tick(now.0 - self.route.latency_ticks);
        // Samples wait at their sender. It has sent everything up to the newest sample that is here, and to the tick whose
        // samples can be used by now, whether there is one or not.
        let sent_up_to = self.offered.last().map_or(newest_usable, |newest| newest_usable.max(newest.tick()));
        for sample in std::mem::take(&mut self.offered) {
            self.counts.offered += 1;
            let sample = self.true_or_stuck(sample);
            let Self { queue, faults, .. } = self;
            queue.push(sample, sample.tick(), |tick| slowest(faults, tick), |one| passages.push(one));
        }
        let Self { queue, faults, .. } = self;
        queue.serve_to(sent_up_to, |tick| slowest(faults, tick), |one| passages.push(one));
        self.take_passages(passages);
        for InFlight { sample, .. } in self.take_arrived(now) {
            self.counts.delivered += 1;
            self.counts.late += u64::from(sample.tick() < newest_usable);
            take(sample);
        }
    }

    /// Takes what arrives in `now` out of what is in flight, in its order of arrival.
    fn take_arrived(&mut self, now: Tick) -> Vec<InFlight<T>> {
        // A held sample waits for every `hold` on its link, even one that began after it was sent.
        let holding: Vec<u32> =
            self.faults.iter().filter(|fault| fault.holds(now)).map(ActiveFault::number).collect();
        let is_kept = |one: &InFlight<T>| one.is_held && !holding.is_empty();
        if self.in_flight.iter().any(|one| one.due <= now && is_kept(one)) {
            for number in holding.iter().copied() {
                self.note_acted(number);
            }
        }
        let arrives = |one: &mut InFlight<T>| one.due <= now && !is_kept(one);
        let mut arrived: Vec<_> = self.in_flight.extract_if(.., arrives).collect();
        // The order in flight depends on when samples were polled, so sort by tick here too.
        arrived.sort_by_key(|one| (one.due, one.sample.tick()));
        arrived
    }

    /// Puts in flight what has left the queue, and counts what it dropped.
    fn take_passages(&mut self, passages: Vec<Passage<T>>) {
        for passage in passages {
            match passage {
                Passage::Sent(sample, left) => {
                    // A sample that waited was altered by what limited the link when it was sent.
                    let sent = sample.tick();
                    let limit = slowest(&self.faults, sent).filter(|_| left > sent);
                    if let Some(limit) = limit {
                        self.note_acted(limit.number);
                    }
                    self.send(sample, left);
                }
                Passage::Dropped(_, number) => {
                    self.counts.lost += 1;
                    self.note_acted(number);
                }
            }
        }
    }

    /// Loses everything in flight: the receiver no longer listens.
    pub fn drop_all(&mut self) {
        self.counts.lost += (self.in_flight.len() + self.queue.len()) as u64;
        self.in_flight.clear();
        self.queue.clear();
        self.offered.clear();
    }

    /// The counts of all samples so far, as of `now`.
    pub fn counts(&self, now: Tick) -> LinkCounts {
        let in_flight = (self.in_flight.len() + self.queue.len()) as u64;
        LinkCounts { tick: now, in_flight, ..self.counts }
    }

    /// The counts as of `now` once for each fault that has altered its first sample since the last call.
    pub fn news(&mut self, now: Tick) -> Vec<LinkCounts> {
        let counts = self.counts(now);
        let new = self.acted.iter().skip(self.reported).map(|acted| LinkCounts { acted: *acted, ..counts });
        let news = new.collect();
        self.reported = self.acted.len();
        news
    }

    /// The counts as of `now` once for each fault that has altered a sample, whether that was reported or not.
    pub fn all_acted(&self, now: Tick) -> Vec<LinkCounts> {
        let counts = self.counts(now);
        self.acted.iter().map(|acted| LinkCounts { acted: *acted, ..counts }).collect()
    }

    fn note_acted(&mut self, number: u32) {
        if !self.acted.contains(&number) {
            self.acted.push(number);
        }
    }

    /// Puts a sample that leaves the queue in `left` in flight, with its copies, or loses it.
    fn send(&mut self, sample: T, left: Tick) {
        let sent = sample.tick();
        let mut fate = Fate::undisturbed(sample);
        let draws = LinkDraws { seed: self.seed, route: self.route, sent };
        // The sending tick decides which faults apply. The tick of reception would depend on the other faults.
        for index in 0..self.faults.len() {
            let fault = &mut self.faults[index];
            if fault.is_on(sent) && fault.apply(draws, &mut fate) {
                let number = fault.number();
                self.note_acted(number);
            }
        }
        if fate.is_lost {
            self.counts.lost += 1;
        } else if fate.is_corrupted {
            self.counts.corrupted += 1;
        } else {
            self.put_in_flight(fate, left);
        }
    }

    fn put_in_flight(&mut self, fate: Fate<T>, left: Tick) {
        let Fate { sample, is_held, copies, delay_s, .. } = fate;
        let due = Tick(left.0 + self.route.latency_ticks + whole_ticks(delay_s, self.rate_hz));
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
        let sticking: Vec<u32> =
            self.faults.iter().filter(|fault| fault.sticks(sent)).map(ActiveFault::number).collect();
        if !sticking.is_empty() {
            // A receiver that started after the link stuck repeats the first sample that it gets.
            let repeated = *self.last_true.get_or_insert(sample);
            if repeated.tick() != sent {
                for number in sticking {
                    self.note_acted(number);
                }
            }
            return repeated.stamped(sent);
        }
        self.last_true = Some(sample);
        sample
    }
}

/// What limits a link with `faults` in `tick`: of several limits the lowest rate.
fn slowest(faults: &[ActiveFault], tick: Tick) -> Option<RateLimit> {
    let limits = faults.iter().filter_map(|fault| fault.rate_limit(tick));
    limits.min_by(|one, other| one.samples_per_s.total_cmp(&other.samples_per_s))
}
