//! What faults do to one link, in one direction: which samples come through, when, how often, and how true.
//!
//! Applied where samples are received. What happens to a sample is a function of seed, link and the tick in which it was
//! sent, never of what happened before: a fault on one link changes nothing on another, and a receiver that was started
//! again meets the same weather. Samples on their way die with their receiver.

#[cfg(test)]
mod tests;

use ringwing_flight::{
    LeaderState, LinkCounts, LinkSource, Sensed, Tick, UavId, UavState, draw::Draws, wrap,
};
use ringwing_scenario::fault::{Delay, Source, Trouble, schedule::LinkFault};

/// What can travel over a link with faults.
pub trait Carried: Copy {
    /// When it was sent.
    fn tick(&self) -> Tick;
    /// The same, as if sent at `tick`.
    fn stamped(self, tick: Tick) -> Self;
    /// The same, with position and heading off by `error`.
    fn off_by(self, error: Error) -> Self;
}

/// How wrong a position and a heading are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Error {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
}

macro_rules! carried {
    ($($message:ty),*) => {$(
        impl Carried for $message {
            fn tick(&self) -> Tick {
                self.tick
            }

            fn stamped(self, tick: Tick) -> Self {
                Self { tick, ..self }
            }

            fn off_by(self, error: Error) -> Self {
                let [x, y] = self.position_m;
                let heading_rad = wrap(self.heading_rad + error.heading_rad);
                Self { position_m: [x + error.x_m, y + error.y_m], heading_rad, ..self }
            }
        }
    )*};
}
carried!(UavState, LeaderState, Sensed);

/// A link: from whom, to whom, and how many ticks after it was sent a sample can be used when nothing is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Route {
    /// From whom.
    pub source: Source,
    /// To whom.
    pub to: UavId,
    /// 0 for a UAV's own senses, 1 for what others say.
    pub ticks: i64,
}

/// What each draw is for; several faults of one kind on a link each have their own draws.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Loss = 1,
    GilbertTurn,
    GilbertLoss,
    Delay,
    Duplicate,
    Reorder,
    Noise,
}

/// A sample on its way.
#[derive(Debug, Clone, Copy)]
struct Flying<T> {
    sample: T,
    /// Not before this tick.
    due: Tick,
    /// Kept while a `hold` lasts.
    held: bool,
}

/// A fault of this link, with what is known of a Gilbert chain: its state, bad or not, at a tick.
#[derive(Debug, Clone)]
struct Burden {
    fault: LinkFault,
    /// How many faults of this kind the link has before this one.
    rank: u64,
    chain: (i64, bool),
}

/// One link and its faults.
#[derive(Debug, Clone)]
pub struct Impairment<T> {
    route: Route,
    seed: u64,
    rate_hz: u32,
    burdens: Vec<Burden>,
    /// Received since the last delivery.
    offered: Vec<T>,
    flying: Vec<Flying<T>>,
    /// The newest that was sent before anything stuck.
    sound: Option<T>,
    counts: LinkCounts,
}

impl<T: Carried> Impairment<T> {
    /// The link `route` without faults, for now.
    pub fn new(route: Route, seed: u64, rate_hz: u32) -> Self {
        let from = match route.source {
            Source::Uav(uav) => LinkSource::uav(UavId(uav)),
            Source::Leader => LinkSource::LEADER,
            Source::Own => LinkSource::OWN,
        };
        Self {
            route,
            seed,
            rate_hz,
            burdens: Vec::new(),
            offered: Vec::new(),
            flying: Vec::new(),
            sound: None,
            counts: LinkCounts::none(from, route.to),
        }
    }

    /// From now on those of `faults` that concern this link; what is on its way stays so.
    pub fn set_faults(&mut self, faults: &[LinkFault]) {
        self.burdens.clear();
        for fault in faults.iter().filter(|fault| fault.links.cover(self.route.source, self.route.to.0)) {
            let kind = std::mem::discriminant(&fault.trouble);
            let same = |burden: &&Burden| std::mem::discriminant(&burden.fault.trouble) == kind;
            let rank = self.burdens.iter().filter(same).count() as u64;
            self.burdens.push(Burden { fault: fault.clone(), rank, chain: (fault.begin, false) });
        }
    }

    /// Whether the link has no fault and never had one: then samples need not come by here.
    pub fn is_clear(&self) -> bool {
        self.burdens.is_empty() && self.flying.is_empty()
    }

    /// Takes what was received, in whatever order.
    pub fn offer(&mut self, sample: T) {
        self.offered.push(sample);
    }

    /// Hands out what arrives at `now`, in the order in which it does.
    pub fn deliver(&mut self, now: Tick, mut take: impl FnMut(T)) {
        let usable = now.0 - self.route.ticks;
        self.offered.sort_by_key(Carried::tick);
        for sample in std::mem::take(&mut self.offered) {
            self.send(sample);
        }
        let holds = self
            .burdens
            .iter()
            .any(|burden| burden.fault.trouble == Trouble::Hold && burden.fault.is_on(now.0));
        let arrives = |flying: &mut Flying<T>| flying.due <= now && !(flying.held && holds);
        let mut arrived: Vec<_> = self.flying.extract_if(.., arrives).collect();
        arrived.sort_by_key(|flying| (flying.due, flying.sample.tick()));
        for Flying { sample, .. } in arrived {
            self.counts.delivered += 1;
            self.counts.late += u64::from(sample.tick().0 < usable);
            take(sample);
        }
    }

    /// Nobody is there to receive any more: what is on its way is lost.
    pub fn drop_all(&mut self) {
        self.counts.lost += self.flying.len() as u64;
        self.flying.clear();
        self.offered.clear();
    }

    /// What has become of all samples so far, as of `now`.
    pub fn counts(&self, now: Tick) -> LinkCounts {
        LinkCounts { tick: now, in_flight: self.flying.len() as u64, ..self.counts }
    }

    /// Puts a sample on its way, or loses it.
    fn send(&mut self, sample: T) {
        let sent = sample.tick();
        let mut fate = Fate::of(self.as_it_comes(sample));
        let dice = Dice { seed: self.seed, route: self.route, sent };
        for burden in self.burdens.iter_mut().filter(|burden| burden.fault.is_on(sent.0)) {
            burden.act(dice, &mut fate);
        }
        self.counts.offered += 1;
        if fate.lost {
            self.counts.lost += 1;
            return;
        }
        let late = (fate.delay_s * f64::from(self.rate_hz)).round() as i64;
        let due = Tick(sent.0 + self.route.ticks + late);
        let Fate { sample, held, copies, .. } = fate;
        self.flying.push(Flying { sample, due, held });
        for _ in 0..copies {
            self.counts.duplicated += 1;
            self.flying.push(Flying { sample, due: due.next(), held });
        }
    }

    /// The sample itself, or what a stuck link shows in its place; a receiver that was not there before the fault sticks
    /// to the first that it hears.
    fn as_it_comes(&mut self, sample: T) -> T {
        let sent = sample.tick();
        let sticks = self
            .burdens
            .iter()
            .any(|burden| burden.fault.trouble == Trouble::Stuck && burden.fault.is_on(sent.0));
        if sticks {
            return self.sound.get_or_insert(sample).stamped(sent);
        }
        self.sound = Some(sample);
        sample
    }
}

/// What becomes of one sample.
#[derive(Debug, Clone, Copy)]
struct Fate<T> {
    sample: T,
    lost: bool,
    held: bool,
    delay_s: f64,
    copies: u32,
}

impl<T> Fate<T> {
    fn of(sample: T) -> Self {
        Self { sample, lost: false, held: false, delay_s: 0.0, copies: 0 }
    }
}

/// All that draws depend on, but for what they are for.
#[derive(Debug, Clone, Copy)]
struct Dice {
    seed: u64,
    route: Route,
    sent: Tick,
}

impl Dice {
    fn draws(self, purpose: Purpose, rank: u64) -> Draws {
        let from = match self.route.source {
            Source::Leader => 0,
            Source::Uav(uav) => u64::from(uav),
            Source::Own => u64::from(u32::MAX),
        };
        let link = from << 32 | u64::from(self.route.to.0);
        Draws::new(self.seed, [link, purpose as u64, rank], self.sent.0.cast_unsigned())
    }

    fn happens(self, purpose: Purpose, rank: u64, probability: f64) -> bool {
        self.draws(purpose, rank).uniform() < probability
    }
}

impl Burden {
    /// Does to a sample what the fault does.
    fn act<T: Carried>(&mut self, dice: Dice, fate: &mut Fate<T>) {
        let rank = self.rank;
        match &self.fault.trouble {
            Trouble::Delay(delay) => fate.delay_s += delay_s(delay, dice, rank, self.fault.begin),
            Trouble::Loss(p) => fate.lost |= dice.happens(Purpose::Loss, rank, *p),
            Trouble::Gilbert { p, r, h, k } => {
                let (p, r, through) = (*p, *r, [*k, *h]);
                let bad = self.is_bad(dice, p, r);
                fate.lost |= !dice.happens(Purpose::GilbertLoss, rank, through[usize::from(bad)]);
            }
            Trouble::Blackout => fate.lost = true,
            Trouble::Duplicate(p) => fate.copies += u32::from(dice.happens(Purpose::Duplicate, rank, *p)),
            Trouble::Reorder { p, by_s } => {
                fate.delay_s += if dice.happens(Purpose::Reorder, rank, *p) { *by_s } else { 0.0 };
            }
            Trouble::Hold => fate.held = true,
            // What is stuck is so before anything else happens to it.
            Trouble::Stuck => {}
            Trouble::Bias { x_m, y_m, heading_rad } => {
                let error = Error { x_m: *x_m, y_m: *y_m, heading_rad: *heading_rad };
                fate.sample = fate.sample.off_by(error);
            }
            Trouble::Noise { position_m, heading_rad } => {
                let mut draws = dice.draws(Purpose::Noise, rank);
                let (x_m, y_m) = (position_m * draws.normal(), position_m * draws.normal());
                let error = Error { x_m, y_m, heading_rad: heading_rad * draws.normal() };
                fate.sample = fate.sample.off_by(error);
            }
        }
    }

    /// Whether the link is bad when the sample is sent: good as the fault begins, and one turn of the chain each tick.
    fn is_bad(&mut self, dice: Dice, p: f64, r: f64) -> bool {
        if self.chain.0 > dice.sent.0 {
            self.chain = (self.fault.begin, false);
        }
        let (from, mut bad) = self.chain;
        for tick in from..dice.sent.0 {
            let turns = if bad { r } else { p };
            bad ^= Dice { sent: Tick(tick), ..dice }.happens(Purpose::GilbertTurn, self.rank, turns);
        }
        self.chain = (dice.sent.0, bad);
        bad
    }
}

fn delay_s(delay: &Delay, dice: Dice, rank: u64, begin: i64) -> f64 {
    let mut draws = dice.draws(Purpose::Delay, rank);
    let delay_s = match delay {
        Delay::Constant { by_s } => *by_s,
        Delay::Uniform { by_s, jitter_s } => by_s + jitter_s * (2.0 * draws.uniform() - 1.0),
        Delay::Normal { by_s, deviation_s } => by_s + deviation_s * draws.normal(),
        Delay::Pareto { by_s, tail_s, shape } => by_s + draws.tail(*tail_s, *shape),
        Delay::Trace(delays_s) => delays_s[dice.sent.since(Tick(begin)) as usize % delays_s.len()],
        // Read before the run, or refused: see `trace`.
        Delay::File(_) => 0.0,
    };
    delay_s.max(0.0)
}
