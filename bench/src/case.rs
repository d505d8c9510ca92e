//! One case of a benchmark: what carries the data, when ticks begin, and how many processes take part.
//!
//! Must never start a process or measure anything.

use ringwing_scenario::{Scenario, ScenarioError, Wake, start};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Length of the flight of a case, in seconds: the longest that a scenario allows. The measurement ends the flight long
/// before.
const FLIGHT_S: f64 = 24.0 * 3600.0;
/// Simulated rate of a closed loop, in Hz. It decides what a tick computes, not when it begins.
const CLOSED_RATE_HZ: u32 = 100;
/// Fewest UAVs that form a ring; a scenario needs a special permission for fewer.
const RING_UAVS: u32 = 3;

/// One point on the axes of a benchmark.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Case {
    /// What carries the data.
    #[serde(rename = "subject")]
    pub carrier: Carrier,
    /// How the processes are connected; differs only for pipes and Unix datagrams.
    #[serde(default)]
    pub topology: Topology,
    /// When ticks begin.
    pub load: Load,
    /// Number of agents, or of peers in their place; each is a process.
    pub uavs: u32,
    /// How processes wait for a tick; differs only for the swarm.
    pub wake: Wake,
    /// Bytes sent each way in every tick, on top of the messages themselves.
    pub payload_bytes: u32,
    /// Whether a recorder writes everything to a log.
    pub recorder: bool,
}

/// What carries the data of a tick between the processes.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// The swarm itself: the real world, agents, law and messages.
    Swarm,
    /// Floor: the tick gate with as many processes as the swarm, and no data.
    Gate,
    /// Floor: two processes take turns at one atomic word in shared memory, and spin.
    Atomic,
    /// A futex in shared memory wakes as many processes as the swarm has; no data.
    Futex,
    /// A pipe to each peer and one back, blocking.
    Pipe,
    /// Pipes that are polled between yields.
    PipePolled,
    /// Unix datagram sockets, blocking.
    UnixDatagram,
    /// UDP over the loopback interface, blocking.
    Udp,
    /// TCP over the loopback interface with `TCP_NODELAY`, blocking.
    Tcp,
    /// A program that the user brings along, by its name.
    Peer(String),
}

/// How the processes of a transport are connected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Topology {
    /// A hub relays to each peer in one message what an agent of the swarm reads from four services.
    #[default]
    Hub,
    /// As the swarm is connected: the world, the leader and two neighbours send to each agent directly.
    Mesh,
}

/// When ticks begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Load {
    /// Each tick begins as soon as the last one is answered.
    Closed,
    /// Ticks begin at this rate in Hz, whether or not all agents have answered.
    Paced(u32),
}

impl Carrier {
    /// Whether messages are sent at all.
    pub fn carries_data(&self) -> bool {
        !matches!(self, Self::Gate | Self::Atomic | Self::Futex)
    }

    /// Whether its processes can be connected in this topology. Carriers without a choice count as a hub.
    pub fn has(&self, topology: Topology) -> bool {
        topology == Topology::Hub || matches!(self, Self::Pipe | Self::PipePolled | Self::UnixDatagram)
    }
}

impl Case {
    /// Whether there is a process in the leader's place. A hub sends the leader's state itself, and `atomic` has only two
    /// processes.
    pub(crate) fn has_leader(&self) -> bool {
        matches!(self.carrier, Carrier::Swarm | Carrier::Gate | Carrier::Futex)
            || self.topology == Topology::Mesh
    }

    /// Number of processes that answer a tick: the agents, and a leader if there is one.
    pub(crate) fn answering(&self) -> u32 {
        self.uavs + u32::from(self.has_leader())
    }

    /// Number of processes that take part in a tick, without a recorder: those that answer it, and the world.
    pub(crate) fn processes(&self) -> u32 {
        self.answering() + 1
    }

    /// The scenario of this case: drawn start positions, a sky without obstacles, the paper's law.
    ///
    /// # Errors
    /// If the start box has no room for the case's UAVs.
    pub fn scenario(&self, seed: u64) -> Result<Scenario, ScenarioError> {
        let mut scenario = Scenario { name: "bench".into(), seed, ..Scenario::default() };
        scenario.formation.uavs = self.uavs;
        scenario.time.duration_s = FLIGHT_S;
        scenario.time.real_time = self.load != Load::Closed;
        scenario.time.rate_hz = match self.load {
            Load::Closed => CLOSED_RATE_HZ,
            Load::Paced(rate_hz) => rate_hz,
        };
        scenario.ipc.wake = self.wake;
        (scenario.ipc.payload_bytes, scenario.ipc.few_uavs) = (self.payload_bytes, self.uavs < RING_UAVS);
        // Validates the scenario, as if it had been read from a file.
        let scenario = Scenario::resolved(&scenario.to_toml())?;
        start::states(&scenario)?;
        Ok(scenario)
    }
}

/// Writes the case as JSON, so that it fits into one argument of a command.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| fmt::Error)?)
    }
}

/// Reads what [`Display`](fmt::Display) wrote.
impl FromStr for Case {
    type Err = serde_json::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        serde_json::from_str(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: Case = Case {
        carrier: Carrier::Swarm,
        topology: Topology::Hub,
        load: Load::Paced(50),
        uavs: 2,
        wake: Wake::Event,
        payload_bytes: 64,
        recorder: false,
    };

    #[test]
    fn a_case_survives_the_command_line() {
        let text = CASE.to_string();
        assert_eq!(text.parse::<Case>().unwrap(), CASE);
        assert!(
            text.starts_with("{\"subject\":\"swarm\",\"topology\":\"hub\",\"load\":{\"paced\":50},"),
            "{text}"
        );
    }

    #[test]
    fn a_program_is_told_apart_by_its_name() {
        let case = Case { carrier: Carrier::Peer("mine".into()), ..CASE };
        assert!(case.to_string().starts_with("{\"subject\":{\"peer\":\"mine\"},"), "{case}");
        assert_eq!(case.to_string().parse::<Case>().unwrap(), case);
    }

    #[test]
    fn a_result_from_before_there_were_topologies_is_of_a_hub() {
        let text = CASE.to_string().replace("\"topology\":\"hub\",", "");
        assert_eq!(text.parse::<Case>().unwrap(), CASE);
    }

    #[test]
    fn a_case_becomes_a_valid_scenario() {
        let scenario = CASE.scenario(7).unwrap();
        assert_eq!((scenario.formation.uavs, scenario.time.rate_hz, scenario.seed), (2, 50, 7));
        assert!(scenario.time.real_time && scenario.ipc.wake == Wake::Event);
        assert!(scenario.obstacles.is_empty());
    }
}
