//! What one fault does to one sample.
//!
//! A pure function of (seed, link, sending tick), so faults never influence each other.

use super::{
    capacity::RateLimit,
    route::Route,
    sample::{PoseError, Sample},
};
use ringwing_flight::{Tick, draw::Draws};
use ringwing_scenario::fault::{BurstChain, Delay, LinkImpairment, schedule::LinkFault};
use std::mem::discriminant;

/// A fault of one link.
#[derive(Debug, Clone)]
pub(super) struct ActiveFault {
    fault: LinkFault,
    rate_hz: u32,
    /// Faults of the same kind that the link has before this one: each rank has its own draws.
    rank: u64,
    /// The last known state of a Gilbert chain.
    gilbert: GilbertState,
}

/// A Gilbert chain at one tick.
#[derive(Debug, Clone, Copy)]
struct GilbertState {
    tick: Tick,
    is_bad: bool,
}

/// What the faults of a link do to one sample, all together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fate<T> {
    pub(super) sample: T,
    pub(super) is_lost: bool,
    /// Whether the sample is damaged on the way, so that the receiver drops it.
    pub(super) is_corrupted: bool,
    /// Whether the sample waits until no `hold` is active.
    pub(super) is_held: bool,
    /// The delay beyond the latency of a link without faults.
    pub(super) delay_s: f64,
    /// Copies that follow the sample.
    pub(super) copies: u32,
}

/// Everything that the draws for one sample depend on, except their purpose.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkDraws {
    pub(super) seed: u64,
    pub(super) route: Route,
    pub(super) sent: Tick,
}

/// What a draw is for: each purpose has its own stream. Another number gives other draws for the same seed.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Loss = 1,
    GilbertTurn,
    GilbertLoss,
    Delay,
    Duplicate,
    Reorder,
    Noise,
    Corrupt,
}

/// Longest delay of a sample. No flight lasts longer, so a longer one changes nothing but could exceed the range of ticks.
const DELAY_MAX_S: f64 = 86_400.0;

impl<T> Fate<T> {
    /// The fate of a sample on a link without faults.
    pub(super) fn undisturbed(sample: T) -> Self {
        Self { sample, is_lost: false, is_corrupted: false, is_held: false, delay_s: 0.0, copies: 0 }
    }
}

impl LinkDraws {
    fn stream(self, purpose: Purpose, rank: u64) -> Draws {
        // Both ends identify the link: each direction has its own draws.
        let link = u64::from(self.route.source.number()) << 32 | u64::from(self.route.to.0);
        Draws::new(self.seed, [link, purpose as u64, rank], self.sent.0.cast_unsigned())
    }

    fn happens(self, purpose: Purpose, rank: u64, probability: f64) -> bool {
        self.stream(purpose, rank).uniform() < probability
    }
}

impl ActiveFault {
    /// The faults of `faults` that concern `route`.
    pub(super) fn of_route(faults: &[LinkFault], route: &Route, rate_hz: u32) -> Vec<Self> {
        let mut active: Vec<Self> = Vec::new();
        for fault in faults.iter().filter(|fault| fault.links.includes(route.source, route.to)) {
            let kind = discriminant(&fault.impairment);
            // Two faults of one kind must not draw the same numbers, and a fault of another kind must not shift either
            // of them.
            let rank = active.iter().filter(|other| discriminant(&other.fault.impairment) == kind).count();
            let gilbert = GilbertState { tick: fault.begin, is_bad: false };
            active.push(Self { fault: fault.clone(), rate_hz, rank: rank as u64, gilbert });
        }
        active
    }

    /// Which of the run's faults it is, counted from 1.
    pub(super) fn number(&self) -> u32 {
        self.fault.number
    }

    /// The limit that it puts on the link in `tick`, if it does.
    pub(super) fn rate_limit(&self, tick: Tick) -> Option<RateLimit> {
        let LinkImpairment::Rate { samples_per_s, queue } = self.fault.impairment else { return None };
        self.is_on(tick).then_some(RateLimit {
            number: self.fault.number,
            begin: self.fault.begin,
            samples_per_s,
            rate_hz: self.rate_hz,
            queue: queue as usize,
        })
    }

    /// Whether it applies to samples that are sent in `tick`.
    pub(super) fn is_on(&self, tick: Tick) -> bool {
        self.fault.is_on(tick)
    }

    /// Whether it holds samples back in `now`.
    pub(super) fn holds(&self, now: Tick) -> bool {
        self.fault.impairment == LinkImpairment::Hold && self.is_on(now)
    }

    /// Whether it repeats an old value in place of a sample that is sent in `tick`.
    pub(super) fn sticks(&self, tick: Tick) -> bool {
        self.fault.impairment == LinkImpairment::Stuck && self.is_on(tick)
    }

    /// Adds its effect to the fate of one sample. Returns whether it has one.
    pub(super) fn apply<T: Sample>(&mut self, draws: LinkDraws, fate: &mut Fate<T>) -> bool {
        let rank = self.rank;
        // Delays add up, errors add up, and one loss is enough: no fault depends on what another one did.
        match &self.fault.impairment {
            LinkImpairment::Delay(delay) => {
                let delay_s = delay_s(delay, draws, rank, self.fault.begin);
                self.delay(delay_s, fate)
            }
            LinkImpairment::Loss(p) => lose(draws.happens(Purpose::Loss, rank, *p), fate),
            LinkImpairment::Gilbert { p, r, h, k } => {
                let (p, r, h, k) = (*p, *r, *h, *k);
                let pass_probability = if self.is_bad(draws, p, r) { h } else { k };
                lose(!draws.happens(Purpose::GilbertLoss, rank, pass_probability), fate)
            }
            LinkImpairment::GilbertBurst { loss, burst_s } => {
                // Validation refuses what no chain can give.
                let chain = BurstChain::new(*loss, *burst_s, self.rate_hz);
                lose(chain.is_some_and(|BurstChain { p, r }| self.is_bad(draws, p, r)), fate)
            }
            LinkImpairment::Blackout => lose(true, fate),
            LinkImpairment::Corrupt(p) => {
                let is_hit = draws.happens(Purpose::Corrupt, rank, *p);
                fate.is_corrupted |= is_hit;
                is_hit
            }
            LinkImpairment::Duplicate(p) => {
                let is_hit = draws.happens(Purpose::Duplicate, rank, *p);
                fate.copies += u32::from(is_hit);
                is_hit
            }
            LinkImpairment::Reorder { p, by_s } => {
                let by_s = if draws.happens(Purpose::Reorder, rank, *p) { *by_s } else { 0.0 };
                self.delay(by_s, fate)
            }
            LinkImpairment::Hold => {
                fate.is_held = true;
                // It has an effect only on a sample that arrives while the fault still lasts.
                false
            }
            // The link does both before any other fault applies, and notes their effects itself.
            LinkImpairment::Stuck | LinkImpairment::Rate { .. } => false,
            LinkImpairment::Bias { x_m, y_m, heading_rad } => {
                let error = PoseError { x_m: *x_m, y_m: *y_m, heading_rad: *heading_rad };
                displace(|| error, fate)
            }
            LinkImpairment::Noise { position_m, heading_rad } => {
                let mut noise = draws.stream(Purpose::Noise, rank);
                let error = || {
                    let (x_m, y_m) = (position_m * noise.normal(), position_m * noise.normal());
                    PoseError { x_m, y_m, heading_rad: heading_rad * noise.normal() }
                };
                displace(error, fate)
            }
        }
    }

    /// Delays a sample further. Returns whether it arrives in a later tick because of that.
    fn delay<T>(&self, by_s: f64, fate: &mut Fate<T>) -> bool {
        let before = whole_ticks(fate.delay_s, self.rate_hz);
        fate.delay_s += by_s;
        whole_ticks(fate.delay_s, self.rate_hz) > before
    }

    /// Whether the Gilbert chain is in its bad state when the sample is sent.
    ///
    /// The chain starts good when the fault begins and draws one transition per tick: good to bad with probability
    /// `p`, bad to good with `r`.
    fn is_bad(&mut self, draws: LinkDraws, p: f64, r: f64) -> bool {
        // Samples may be offered out of order: for an older one, run the chain again from the start.
        if self.gilbert.tick > draws.sent {
            self.gilbert = GilbertState { tick: self.fault.begin, is_bad: false };
        }
        let GilbertState { tick: known, mut is_bad } = self.gilbert;
        for tick in known.0..draws.sent.0 {
            let turn_probability = if is_bad { r } else { p };
            let draws = LinkDraws { sent: Tick(tick), ..draws };
            is_bad ^= draws.happens(Purpose::GilbertTurn, self.rank, turn_probability);
        }
        self.gilbert = GilbertState { tick: draws.sent, is_bad };
        is_bad
    }
}

fn lose<T>(is_hit: bool, fate: &mut Fate<T>) -> bool {
    fate.is_lost |= is_hit;
    is_hit
}

fn displace<T: Sample>(mut error: impl FnMut() -> PoseError, fate: &mut Fate<T>) -> bool {
    let mut has_error = false;
    fate.sample = fate.sample.displaced(|| {
        let error = error();
        has_error |= error != PoseError::default();
        error
    });
    has_error
}

/// A delay in whole ticks, because a receiver reads only once a tick.
pub(super) fn whole_ticks(delay_s: f64, rate_hz: u32) -> i64 {
    (delay_s.min(DELAY_MAX_S) * f64::from(rate_hz)).round() as i64
}

fn delay_s(delay: &Delay, draws: LinkDraws, rank: u64, begin: Tick) -> f64 {
    let mut stream = draws.stream(Purpose::Delay, rank);
    let delay_s = match delay {
        Delay::Constant { by_s } => *by_s,
        Delay::Uniform { by_s, jitter_s } => by_s + jitter_s * (2.0 * stream.uniform() - 1.0),
        Delay::Normal { by_s, deviation_s } => by_s + deviation_s * stream.normal(),
        Delay::Pareto { by_s, tail_s, shape } => by_s + stream.tail(*tail_s, *shape),
        // A trace starts with the fault, one delay per tick, and repeats.
        Delay::Trace(delays_s) => delays_s[draws.sent.since(begin) as usize % delays_s.len()],
        // A file is read into a trace before the run, or the scenario is refused.
        Delay::File(_) => 0.0,
    };
    // A wide distribution reaches below zero, but no sample arrives before a link without faults would deliver it.
    delay_s.max(0.0)
}
