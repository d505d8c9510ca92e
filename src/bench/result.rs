//! What one `ringwing bench` measured: the file that `--json` prints and every table, page and comparison is made from.
//!
//! Never filters: a distribution holds every sample of its repeat, the warm-up apart, which is no part of it.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the format of this file is called; another layout needs another.
pub(crate) const FORMAT: &str = "ringwing-bench-1";

/// All of one benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Results {
    /// [`FORMAT`].
    pub(crate) format: String,
    /// Version of the program that measured.
    pub(crate) ringwing: String,
    /// When it began: UTC, RFC 3339.
    pub(crate) began: String,
    /// The command that measures the same again.
    pub(crate) command: String,
    /// Seed of the order of the cases and of the flights.
    pub(crate) seed: u64,
    /// What the benchmark ran on.
    pub(crate) machine: Machine,
    /// It was ended before all cases were done.
    pub(crate) interrupted: bool,
    /// The cases in the order of the command line.
    pub(crate) cases: Vec<Measured>,
}

/// One case and its repeats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Measured {
    /// What was measured.
    pub(crate) case: Case,
    /// How it went, each time.
    pub(crate) repeats: Vec<Repeat>,
    /// Why there are fewer repeats than asked for, if so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) failure: Option<String>,
}

/// One point on the axes.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Case {
    /// What carries the data.
    pub(crate) subject: Subject,
    /// When ticks begin.
    pub(crate) load: Load,
    /// Agents, each a process.
    pub(crate) uavs: u32,
    /// How processes wait for a tick; only the swarm's differ.
    pub(crate) wake: Wake,
    /// Bytes sent each way in a tick beside the messages themselves.
    pub(crate) payload_bytes: u32,
    /// A recorder writes everything to a log.
    pub(crate) recorder: bool,
}

/// What carries the data of a tick between the processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Subject {
    /// The swarm itself: the real world and agents, the real law, the real messages.
    Swarm,
    /// Floor: the tick gate with as many processes, and no data at all.
    Gate,
    /// Floor: one atomic word in shared memory that two processes take turns at, spinning.
    Atomic,
    /// A futex in shared memory wakes everybody; no data.
    Futex,
    /// A pipe to each agent and one back, blocking.
    Pipe,
    /// The same, polled between yields.
    PipePolled,
    /// Unix datagrams, blocking.
    UnixDatagram,
    /// UDP on the loopback interface, blocking.
    Udp,
    /// TCP on the loopback interface, without Nagle's delay, blocking.
    Tcp,
}

/// When ticks begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Load {
    /// Each as soon as the one before is answered.
    Closed,
    /// At this rate, in Hz, whoever has answered.
    Paced(u32),
}

/// How processes wait for a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Wake {
    /// At the gate: yields while that pays, then sleeps on a futex.
    Gate,
    /// At the gate, never sleeping.
    Spin,
    /// On iceoryx2's own events.
    Event,
}

/// One measurement of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Repeat {
    /// Its place in the order in which all were measured, from 0.
    pub(crate) place: u32,
    /// When it began, after the benchmark did.
    pub(crate) began_s: f64,
    /// Wall-clock time of the measured ticks.
    pub(crate) took_s: f64,
    /// Measured ticks.
    pub(crate) ticks: u64,
    /// The mean wall-clock time from one tick to the next, in nanoseconds.
    pub(crate) tick_ns: f64,
    /// How long each hop took, in nanoseconds.
    pub(crate) hops: BTreeMap<Hop, Samples>,
    /// Deadlines missed by a period or more; 0 in a closed loop.
    pub(crate) missed_deadlines: u64,
    /// Airframe ticks flown on an older command; 0 in a closed loop.
    pub(crate) reused_commands: u64,
    /// What the processes used.
    pub(crate) usage: Usage,
    /// The whole tick over time: equal pieces of the repeat, in order.
    pub(crate) strip: Vec<Piece>,
}

/// A part of a tick's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Hop {
    /// The world publishes, an agent wakes.
    Wake,
    /// An agent woke, and has read its inputs.
    Read,
    /// An agent has read, and has computed its answer.
    Compute,
    /// An agent publishes, the world has it; not in paced loads, where the world looks at its next deadline.
    Return,
    /// From the tick's (intended) start to the last answer: one sample a tick.
    Tick,
}

/// Every sample of one hop: its distribution, with three significant digits, and its exact ends.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Samples(pub(crate) Histogram<u64>);

impl Default for Samples {
    fn default() -> Self {
        Self(Histogram::new(3).expect("three significant digits make a histogram"))
    }
}

impl Samples {
    /// Adds a sample.
    pub(crate) fn record(&mut self, nanoseconds: u64) {
        self.0.record(nanoseconds).expect("a histogram that grows takes every number");
    }
}

/// Each value, and how often it was there.
impl Serialize for Samples {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let values = self.0.iter_recorded();
        serializer.collect_seq(values.map(|value| (value.value_iterated_to(), value.count_at_value())))
    }
}

impl<'de> Deserialize<'de> for Samples {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut samples = Self::default();
        for (value, count) in Vec::<(u64, u64)>::deserialize(deserializer)? {
            samples.0.record_n(value, count).map_err(serde::de::Error::custom)?;
        }
        Ok(samples)
    }
}

/// A piece of the repeat's time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Piece {
    /// Ticks in it.
    pub(crate) ticks: u64,
    /// Median of the whole tick, in nanoseconds; 0 without ticks.
    pub(crate) p50_ns: u64,
    /// The longest tick.
    pub(crate) max_ns: u64,
}

/// What the processes of a repeat used while it was measured, all of them together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Usage {
    /// Processor time in user mode.
    pub(crate) user_s: f64,
    /// Processor time in the kernel.
    pub(crate) system_s: f64,
    /// Context switches that a process asked for by waiting.
    pub(crate) voluntary_switches: u64,
    /// Context switches that the kernel forced.
    pub(crate) involuntary_switches: u64,
    /// Mean time that the law itself took in a tick, all agents together; 0 where no law flies.
    pub(crate) law_ns_per_tick: f64,
    /// Mean time spent in iceoryx2's send and receive in a tick, all processes together; 0 where there is none.
    pub(crate) ipc_ns_per_tick: f64,
    /// Proportional set size of one agent, the largest of them; 0 where it is not readable.
    pub(crate) agent_pss_bytes: u64,
}

/// What the benchmark ran on, and what of that spoils it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Machine {
    /// Names and values, in the order in which they are shown.
    pub(crate) facts: Vec<(String, String)>,
    /// What makes these figures worse, or less certain, than they could be; with what to do about it.
    pub(crate) warnings: Vec<String>,
}
