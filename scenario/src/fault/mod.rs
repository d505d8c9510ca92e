//! Deliberate faults of a run: what happens to which processes and links, and when.
//!
//! A fault is a sentence such as `at 30 s kill uav 3`. The same grammar serves `[[faults]]` in a scenario file,
//! `--fault` on the command line, and `ringwing fault` for a live run; docs/src/faults.md lists it. `grammar` parses a
//! sentence into a [`Fault`], `display` writes it back, and [`schedule`] turns faults into ticks.
//!
//! Never applies a fault: the launcher signals processes, and each agent impairs the links that it receives from.

mod display;
mod grammar;
mod idle;
mod lexer;
mod link;
mod refusal;
pub mod schedule;
#[cfg(test)]
mod tests;
pub mod trace;

pub use grammar::next_words;
pub use idle::{idle_reason, rounded_delay};
pub use lexer::{FaultSyntaxError, Lexer, Parsed};
pub use link::{BurstChain, Delay, LinkImpairment, Links, Receiver, Sender};

use serde::{Deserialize, Serialize};

/// A fault and its time: `at 30 s kill uav 3`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Start of the fault, in seconds of simulated time.
    pub at_s: f64,
    /// What happens then.
    #[serde(rename = "do")]
    pub action: Action,
}

/// A fault without its time: `kill uav 3`, `link 2->3 delay 200 ms for 10 s`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Action {
    /// A fault of processes.
    Process {
        /// What happens to each process.
        fault: ProcessFault,
        /// The processes.
        targets: Targets,
    },
    /// An impairment of links.
    Link {
        /// The links.
        links: Links,
        /// What each link does to its samples.
        impairment: LinkImpairment,
        /// Duration in seconds; `None` lasts until the links are healed.
        for_s: Option<f64>,
    },
    /// Ends every fault of exactly these links; [`Links::All`] ends the faults of all links.
    Heal(Links),
}

/// A fault of one process, or of the airframe that an agent flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProcessFault {
    /// SIGKILL. An agent or the leader stays away; the launcher replaces a recorder.
    Kill,
    /// SIGTERM: the process leaves in order and stays away.
    Stop,
    /// SIGSTOP, then SIGCONT at the end of `for_s`.
    Freeze {
        /// Duration in seconds; `None` lasts until the process is thawed.
        for_s: Option<f64>,
    },
    /// SIGCONT.
    Thaw,
    /// Starts a new process in place of one that is gone.
    Start,
    /// SIGKILL, then a new process.
    Restart {
        /// Time from the kill to the start of the new process, in seconds.
        after_s: f64,
    },
    /// Repeated SIGKILL, with a new process half a period after each kill.
    Flap {
        /// Time from one kill to the next, in seconds.
        every_s: f64,
        /// The last kill comes less than this after the first, in seconds.
        for_s: f64,
    },
    /// Delays every answer by the wall clock: in real time it comes late, in lockstep the run waits for it.
    Slow {
        /// Delay of each answer, in seconds.
        by_s: f64,
        /// Duration in seconds of simulated time; `None` lasts to the end of the flight.
        for_s: Option<f64>,
    },
    /// The airframe cannot fly faster than this through the air, and never slower than its lowest speed.
    Weaken {
        /// The highest speed that is left, in m/s.
        to_m_s: f64,
        /// Duration in seconds; `None` lasts to the end of the flight.
        for_s: Option<f64>,
    },
    /// The airframe turns at this rate whatever is commanded, within its limits.
    Jam {
        /// The turn rate, in rad/s.
        turn_rate_rad_s: f64,
        /// Duration in seconds; `None` lasts to the end of the flight.
        for_s: Option<f64>,
    },
    /// What a sensor says wanders away from the truth. When the fault ends, the error is gone at once.
    Drift {
        /// Which sensor, and how fast.
        drift: SensorDrift,
        /// Duration in seconds; `None` lasts to the end of the flight.
        for_s: Option<f64>,
    },
}

/// How the readings of a sensor wander away from the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorDrift {
    /// Those of the position, as when a satellite receiver is spoofed.
    Position {
        /// Speed of the error, in m/s.
        speed_m_s: f64,
        /// Its direction, counted like a heading, in radians.
        toward_rad: f64,
    },
    /// Those of the heading.
    Heading {
        /// Rate of the error, counterclockwise, in rad/s.
        rate_rad_s: f64,
    },
}

impl ProcessFault {
    /// Whether it is one of the airframe or its sensors, which no process notices.
    pub fn is_of_airframe(&self) -> bool {
        matches!(self, Self::Weaken { .. } | Self::Jam { .. } | Self::Drift { .. })
    }
}

/// The processes that a fault is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Targets {
    /// The world, which keeps time.
    World,
    /// The process that flies the virtual leader.
    Leader,
    /// The process that writes the log.
    Recorder,
    /// The agents of these UAVs.
    Uavs(Vec<u32>),
    /// The agents of this number of UAVs, drawn with the scenario's seed.
    Random(u32),
    /// Every agent.
    AllUavs,
}
