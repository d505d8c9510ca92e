//! Faults: what is done to a run on purpose, to its processes and to its links.
//!
//! One grammar says it in a scenario's `[[faults]]`, on the command line and to a run that is in the air; README.md has
//! it as a table. Here is what a sentence means, [`schedule`] says what it comes to at which tick.
//!
//! Never does anything: processes are met by the launcher, links by the agents that receive from them.

mod grammar;
pub mod schedule;
#[cfg(test)]
mod tests;
pub mod trace;
mod wording;
mod words;

use serde::{Deserialize, Serialize};
use std::str::FromStr;

pub use words::Misunderstanding;

/// Something to be done, and when: `at 30 s kill uav 3`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// When, in simulated time.
    pub at_s: f64,
    /// What.
    #[serde(rename = "do")]
    pub action: Action,
}

/// What is to be done: `kill uav 3`, `link 2->3 delay 200 ms for 10 s`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Action {
    /// Something to processes.
    Process {
        /// What.
        fault: ProcessFault,
        /// To which.
        targets: Targets,
    },
    /// Something to links, from now on.
    Link {
        /// To which.
        links: Links,
        /// What.
        trouble: Trouble,
        /// For how long; until it is healed, if not said.
        for_s: Option<f64>,
    },
    /// Ends the faults of these links, as they were named; of `all`, those of every link.
    Heal(Links),
}

/// What is done to a process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProcessFault {
    /// SIGKILL; an agent or the leader stays away, a recorder is replaced.
    Kill,
    /// SIGTERM: it leaves in order, and stays away.
    Stop,
    /// SIGSTOP, and SIGCONT after a while if one is said.
    Freeze {
        /// For how long; until it is thawed, if not said.
        for_s: Option<f64>,
    },
    /// SIGCONT.
    Thaw,
    /// A new process in the place of one that is gone.
    Start,
    /// SIGKILL, and a new process after a while.
    Restart {
        /// How long nobody is there.
        after_s: f64,
    },
    /// SIGKILL again and again, with a new process half a period after each.
    Flap {
        /// From one death to the next.
        every_s: f64,
        /// No death comes later than this after the first.
        for_s: f64,
    },
    /// Takes longer by the wall clock to answer each tick: in real time its answers come late, in lockstep all wait.
    Slow {
        /// How much longer.
        by_s: f64,
        /// For how long; to the end, if not said.
        for_s: Option<f64>,
    },
}

/// Which processes are meant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Targets {
    /// The one that keeps the time.
    World,
    /// The one that flies the leader.
    Leader,
    /// The one that writes the log.
    Recorder,
    /// The agents of these UAVs.
    Uavs(Vec<u32>),
    /// The agents of so many UAVs, drawn by the scenario's seed.
    Random(u32),
    /// Every agent.
    AllUavs,
}

/// Which links are meant; a link leads from one sender to one receiver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Links {
    /// `2->3`, `leader->all`: from each of the senders to each of the receivers.
    From(Sender, Receiver),
    /// `2<->3`: both directions between two UAVs.
    Between(u32, u32),
    /// Every link between UAVs, and from the leader to each.
    All,
    /// Every link between UAVs of different groups, in both directions; a UAV of no group keeps all of its own.
    Partition(Vec<Vec<u32>>),
    /// Every link to and from a UAV, the leader's too; it keeps its own senses.
    Isolate(u32),
}

/// One end of links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// This UAV's agent.
    Uav(u32),
    /// Every agent.
    All,
    /// The leader.
    Leader,
    /// The receiver's own airframe, which lets it sense itself.
    Own,
}

/// The other end of links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receiver {
    /// This UAV's agent.
    Uav(u32),
    /// Every agent.
    All,
}

/// Where one link comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// An agent.
    Uav(u32),
    /// The leader.
    Leader,
    /// The receiver's own airframe.
    Own,
}

/// What is wrong with a link.
#[derive(Debug, Clone, PartialEq)]
pub enum Trouble {
    /// Samples come later.
    Delay(Delay),
    /// Each sample is lost with this probability.
    Loss(f64),
    /// Losses in bursts, after Gilbert and Elliott: a link is good or bad, and changes from tick to tick.
    Gilbert {
        /// Probability that a good link turns bad.
        p: f64,
        /// Probability that a bad one turns good.
        r: f64,
        /// Probability that a sample comes through a bad link; netem's `1-h` is its loss.
        h: f64,
        /// Probability that a sample comes through a good one; netem's `1-k` is its loss.
        k: f64,
    },
    /// Nothing comes through.
    Blackout,
    /// Each sample comes a second time, a tick later, with this probability.
    Duplicate(f64),
    /// Each sample is held back with this probability, so that later ones overtake it.
    Reorder {
        /// The probability.
        p: f64,
        /// For how long.
        by_s: f64,
    },
    /// What is sent is kept until the fault ends, then comes all at once.
    Hold,
    /// The last value before the fault comes again and again, as if it were new.
    Stuck,
    /// Positions and headings are off by a constant.
    Bias {
        /// East.
        x_m: f64,
        /// North.
        y_m: f64,
        /// Counterclockwise.
        heading_rad: f64,
    },
    /// Positions and headings are off by Gaussian noise.
    Noise {
        /// Standard deviation of each coordinate.
        position_m: f64,
        /// Standard deviation.
        heading_rad: f64,
    },
}

/// How late samples come.
#[derive(Debug, Clone, PartialEq)]
pub enum Delay {
    /// Always by as much.
    Constant {
        /// By how much.
        by_s: f64,
    },
    /// Equally likely anywhere within `jitter_s` of `by_s`.
    Uniform {
        /// In the middle.
        by_s: f64,
        /// To either side.
        jitter_s: f64,
    },
    /// Gaussian, but never negative.
    Normal {
        /// Mean.
        by_s: f64,
        /// Standard deviation.
        deviation_s: f64,
    },
    /// At least `by_s`, and beyond it a tail that falls as a power: rarely, but then much later.
    Pareto {
        /// The least.
        by_s: f64,
        /// Mean of what comes on top.
        tail_s: f64,
        /// Exponent of the tail, above 1; the smaller, the heavier.
        shape: f64,
    },
    /// Measured elsewhere: the delays of one sample after the other, again from the first after the last.
    Trace(Vec<f64>),
    /// A [`Trace`](Self::Trace) that is still to be read: seconds, one number on each line.
    File(String),
}

impl Links {
    /// Whether the link from `source` to UAV `to` is one of them.
    pub fn cover(&self, source: Source, to: u32) -> bool {
        let receives = |receiver: Receiver| receiver == Receiver::All || receiver == Receiver::Uav(to);
        match (self, source) {
            (Self::From(Sender::Uav(uav), receiver), Source::Uav(from)) => {
                *uav == from && receives(*receiver)
            }
            (Self::From(Sender::All, receiver), Source::Uav(_))
            | (Self::From(Sender::Leader, receiver), Source::Leader)
            | (Self::From(Sender::Own, receiver), Source::Own) => receives(*receiver),
            (Self::Between(a, b), Source::Uav(from)) => (from, to) == (*a, *b) || (from, to) == (*b, *a),
            (Self::All, Source::Uav(_) | Source::Leader) => true,
            (Self::Partition(groups), Source::Uav(from)) => {
                let group = |uav| groups.iter().position(|group| group.contains(&uav));
                group(from).zip(group(to)).is_some_and(|(from, to)| from != to)
            }
            (Self::Isolate(uav), Source::Uav(from)) => *uav == from || *uav == to,
            (Self::Isolate(uav), Source::Leader) => *uav == to,
            _ => false,
        }
    }

    /// Every UAV that is named.
    fn uavs(&self) -> Vec<u32> {
        match self {
            Self::From(sender, receiver) => {
                let from = if let Sender::Uav(uav) = sender { Some(*uav) } else { None };
                let to = if let Receiver::Uav(uav) = receiver { Some(*uav) } else { None };
                from.into_iter().chain(to).collect()
            }
            Self::Between(one, other) => vec![*one, *other],
            Self::All => Vec::new(),
            Self::Partition(groups) => groups.concat(),
            Self::Isolate(uav) => vec![*uav],
        }
    }
}

impl Action {
    /// Why this cannot be done to a swarm of `uavs`, if it cannot.
    pub fn refusal(&self, uavs: u32) -> Option<String> {
        let named = match self {
            Self::Process { fault, targets } => {
                return fault.refusal(targets).or_else(|| targets.refusal(uavs));
            }
            Self::Link { links, .. } | Self::Heal(links) => links.uavs(),
        };
        no_such(&named, uavs)
    }
}

fn no_such(named: &[u32], uavs: u32) -> Option<String> {
    let stranger = named.iter().find(|uav| **uav > uavs)?;
    Some(format!("there is no uav {stranger}: this run has UAVs 1 to {uavs}"))
}

impl Targets {
    fn refusal(&self, uavs: u32) -> Option<String> {
        match self {
            Self::Uavs(named) => no_such(named, uavs),
            Self::Random(count) if *count > uavs => {
                Some(format!("there are no {count} UAVs to draw: this run has {uavs}"))
            }
            _ => None,
        }
    }
}

impl ProcessFault {
    /// What cannot be done to a process because of what it is for.
    fn refusal(self, targets: &Targets) -> Option<String> {
        let why = match (targets, self) {
            (Targets::World, Self::Kill | Self::Stop) => return None,
            (Targets::World, _) => {
                "the world keeps the time, so nothing can be done to it at a later one: kill or stop it"
            }
            (Targets::Recorder, Self::Slow { .. }) => {
                "the flight does not wait for a slow recorder: freeze it for a while"
            }
            (Targets::Leader, Self::Slow { .. }) => {
                "the leader computes nothing that could take longer: delay its links instead, such as \
                 \"link leader->all delay 20 ms\""
            }
            _ => return None,
        };
        Some(why.into())
    }
}

impl FromStr for Action {
    type Err = Misunderstanding;

    fn from_str(text: &str) -> Result<Self, Misunderstanding> {
        grammar::action(text)
    }
}

impl FromStr for Fault {
    type Err = Misunderstanding;

    fn from_str(text: &str) -> Result<Self, Misunderstanding> {
        grammar::fault(text)
    }
}

impl TryFrom<String> for Action {
    type Error = Misunderstanding;

    fn try_from(text: String) -> Result<Self, Misunderstanding> {
        text.parse()
    }
}

impl From<Action> for String {
    fn from(action: Action) -> Self {
        action.to_string()
    }
}
