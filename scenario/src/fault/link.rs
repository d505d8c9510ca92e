//! Links and what can be wrong with them.
//!
//! A link leads in one direction, from one sender to one agent. Never decides what happens to a sample: the receiving
//! agent does.

use ringwing_flight::{LinkSource, UavId};

/// A set of links, as a fault names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Links {
    /// `2->3`, `leader->all`: from each of the senders to each of the receivers.
    From(Sender, Receiver),
    /// `2<->3`: both directions between two UAVs.
    Between(u32, u32),
    /// Every link between two UAVs, and every link from the leader.
    All,
    /// Every link between UAVs of different groups, in both directions; a UAV in no group keeps all its links.
    Partition(Vec<Vec<u32>>),
    /// Every link to and from one UAV, including the one from the leader. The UAV keeps its own sensors.
    Isolate(u32),
}

/// The sending end of a set of links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The agent of this UAV.
    Uav(u32),
    /// Every agent.
    All,
    /// The leader.
    Leader,
    /// The receiver's own airframe, which reports the UAV's own state.
    Own,
    /// The receiver's own airframe, which reports other aircraft nearby.
    Traffic,
}

/// The receiving end of a set of links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receiver {
    /// The agent of this UAV.
    Uav(u32),
    /// Every agent.
    All,
}

/// What an impaired link does to the samples that it carries. Names follow Linux's `netem` where `netem` has the
/// impairment.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkImpairment {
    /// Every sample arrives later.
    Delay(Delay),
    /// Each sample is lost with this probability.
    Loss(f64),
    /// Losses in bursts (Gilbert and Elliott): the link is good or bad, and may change state once per tick.
    Gilbert {
        /// Probability per tick that a good link turns bad.
        p: f64,
        /// Probability per tick that a bad link turns good.
        r: f64,
        /// Probability that a sample passes a bad link (`netem` takes the loss, `1-h`).
        h: f64,
        /// Probability that a sample passes a good link (`netem` takes the loss, `1-k`).
        k: f64,
    },
    /// Losses in bursts, by what can be measured: a [`Gilbert`](Self::Gilbert) link whose bad state loses every sample.
    GilbertBurst {
        /// Share of samples lost in the long run, from 0 to below 1.
        loss: f64,
        /// Mean duration of a burst of losses, in seconds; at least a tick.
        burst_s: f64,
    },
    /// Every sample is lost.
    Blackout,
    /// Each sample is damaged on the way with this probability. The receiver notices and drops it.
    Corrupt(f64),
    /// The link carries this many samples a second. The others wait in its queue; once that is full, the oldest is
    /// dropped.
    Rate {
        /// Capacity in samples a second, above 0.
        samples_per_s: f64,
        /// Places in the queue, at least one.
        queue: u32,
    },
    /// Each sample arrives again one tick later, with this probability.
    Duplicate(f64),
    /// Each sample is held back with this probability, so that later samples overtake it.
    Reorder {
        /// The probability.
        p: f64,
        /// How long the sample is held back, in seconds.
        by_s: f64,
    },
    /// Samples wait until the fault ends, then all arrive at once.
    Hold,
    /// The last value from before the fault arrives again and again with a new time stamp.
    Stuck,
    /// Positions and headings have a constant error.
    Bias {
        /// Error to the east, in metres.
        x_m: f64,
        /// Error to the north, in metres.
        y_m: f64,
        /// Error of the heading, counterclockwise, in radians.
        heading_rad: f64,
    },
    /// Positions and headings have Gaussian errors of mean 0, drawn anew for each sample.
    Noise {
        /// Standard deviation of each coordinate, in metres.
        position_m: f64,
        /// Standard deviation of the heading, in radians.
        heading_rad: f64,
    },
}

/// How much later samples arrive.
#[derive(Debug, Clone, PartialEq)]
pub enum Delay {
    /// The same delay for every sample.
    Constant {
        /// The delay, in seconds.
        by_s: f64,
    },
    /// Uniform between `by_s - jitter_s` and `by_s + jitter_s`, but at least 0.
    Uniform {
        /// Mean, in seconds.
        by_s: f64,
        /// Half the width, in seconds.
        jitter_s: f64,
    },
    /// Gaussian, but at least 0.
    Normal {
        /// Mean, in seconds.
        by_s: f64,
        /// Standard deviation, in seconds.
        deviation_s: f64,
    },
    /// A constant plus a Lomax (shifted Pareto) tail: most samples are on time, and a few are very late.
    Pareto {
        /// Smallest delay, in seconds.
        by_s: f64,
        /// Mean of the tail, in seconds.
        tail_s: f64,
        /// Exponent of the tail, above 1; a smaller one makes very late samples more likely.
        shape: f64,
    },
    /// Measured delays in seconds, one per tick from the start of the fault; after the last comes the first again.
    Trace(Vec<f64>),
    /// Path of a file with a [`Trace`](Self::Trace); [`trace::read_all`](super::trace::read_all) loads it.
    File(String),
}

/// A Gilbert chain's probabilities per tick: good to bad, and bad to good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BurstChain {
    /// Probability that a good link turns bad.
    pub p: f64,
    /// Probability that a bad link turns good.
    pub r: f64,
}

impl BurstChain {
    /// The chain that loses the share `loss` of all samples in bursts of `burst_s` on average, at `rate_hz` ticks a second.
    ///
    /// A bad state lasts 1 / r ticks on average, and the chain is in it for p / (p + r) of the time (Gilbert, *Capacity of
    /// a Burst-Noise Channel*, 1960). `None` if no such chain exists: bursts shorter than a tick, or good times shorter
    /// than a tick between them.
    pub fn new(loss: f64, burst_s: f64, rate_hz: u32) -> Option<Self> {
        let r = 1.0 / (burst_s * f64::from(rate_hz));
        let p = r * loss / (1.0 - loss);
        // A burst of one tick may come out a rounding error above 1.
        let is_possible = r <= 1.0 + 1e-9 && p <= 1.0 + 1e-9;
        (loss < 1.0 && is_possible).then_some(Self { p: p.min(1.0), r: r.min(1.0) })
    }
}

impl Links {
    /// Whether the link from `source` to the agent of `to` belongs to the set.
    pub fn includes(&self, source: LinkSource, to: UavId) -> bool {
        match source {
            LinkSource::LEADER => self.includes_leader_link(to.0),
            // Only `own->` and `traffic->` name such links: a UAV that is cut off from the others keeps its sensors.
            LinkSource::OWN => self.includes_sensors(Sender::Own, to.0),
            LinkSource::TRAFFIC => self.includes_sensors(Sender::Traffic, to.0),
            _ => self.includes_uav_link(source.number(), to.0),
        }
    }

    fn includes_sensors(&self, sensors: Sender, to: u32) -> bool {
        matches!(self, Self::From(sender, receiver) if *sender == sensors && receiver.includes(to))
    }

    fn includes_leader_link(&self, to: u32) -> bool {
        match self {
            // `all->3` means all agents; the leader has a name of its own.
            Self::From(sender, receiver) => *sender == Sender::Leader && receiver.includes(to),
            Self::All => true,
            Self::Isolate(uav) => *uav == to,
            // These name UAVs only: all groups of a partition still hear the leader.
            Self::Between(..) | Self::Partition(_) => false,
        }
    }

    fn includes_uav_link(&self, from: u32, to: u32) -> bool {
        match self {
            Self::From(Sender::Uav(uav), receiver) => *uav == from && receiver.includes(to),
            Self::From(Sender::All, receiver) => receiver.includes(to),
            Self::From(Sender::Leader | Sender::Own | Sender::Traffic, _) => false,
            Self::Between(one, other) => (from, to) == (*one, *other) || (from, to) == (*other, *one),
            Self::All => true,
            Self::Partition(groups) => {
                let group = |uav| groups.iter().position(|group| group.contains(&uav));
                // A UAV in no group has no other side to be cut off from.
                group(from).zip(group(to)).is_some_and(|(from, to)| from != to)
            }
            Self::Isolate(uav) => *uav == from || *uav == to,
        }
    }

    /// Every UAV that is named, so that a fault for a UAV that does not exist can be refused.
    pub(super) fn named_uavs(&self) -> Vec<u32> {
        match self {
            Self::From(sender, receiver) => {
                sender.named_uav().into_iter().chain(receiver.named_uav()).collect()
            }
            Self::Between(one, other) => vec![*one, *other],
            Self::All => Vec::new(),
            Self::Partition(groups) => groups.concat(),
            Self::Isolate(uav) => vec![*uav],
        }
    }
}

impl Sender {
    fn named_uav(self) -> Option<u32> {
        if let Self::Uav(uav) = self { Some(uav) } else { None }
    }
}

impl Receiver {
    fn named_uav(self) -> Option<u32> {
        if let Self::Uav(uav) = self { Some(uav) } else { None }
    }

    fn includes(self, uav: u32) -> bool {
        self.named_uav().is_none_or(|named| named == uav)
    }
}
