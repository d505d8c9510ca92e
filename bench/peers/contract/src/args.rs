//! The arguments that ringwing appends to a peer's command line.
//!
//! Must never have a default: ringwing gives every argument.

use crate::Failure;
use std::{path::PathBuf, str::FromStr};

/// What a process is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It opens ticks.
    World,
    /// It answers them, as the agent of this UAV, from 1.
    Agent(u32),
}

/// What a process has to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Args {
    /// What it is.
    pub role: Role,
    /// The folder for addresses and traces.
    pub dir: PathBuf,
    /// Number of agents.
    pub uavs: u32,
    /// Rate of the ticks in Hz; 0 for a closed loop.
    pub rate_hz: u64,
    /// How long ticks run before they are measured.
    pub warm_up_s: f64,
    /// How long they are measured.
    pub seconds: f64,
    /// Size of a message to an agent.
    pub bytes_out: usize,
    /// Size of an answer.
    pub bytes_back: usize,
}

impl Args {
    /// Reads `words`, without the program's name.
    pub fn parse(words: &[String]) -> Result<Self, Failure> {
        let role = match value::<String>(words, "--role")?.as_str() {
            "world" => Role::World,
            "agent" => Role::Agent(value(words, "--uav")?),
            other => return Err(format!("--role {other}: give world or agent").into()),
        };
        Ok(Self {
            role,
            dir: value(words, "--dir")?,
            uavs: value(words, "--uavs")?,
            rate_hz: value(words, "--rate")?,
            warm_up_s: value(words, "--warm-up")?,
            seconds: value(words, "--seconds")?,
            bytes_out: value(words, "--bytes-out")?,
            bytes_back: value(words, "--bytes-back")?,
        })
    }
}

/// The value that follows `name`.
fn value<T: FromStr>(words: &[String], name: &str) -> Result<T, Failure> {
    // By name and not by place: the words before are those that the user put behind the program.
    let place = words.iter().position(|word| word == name);
    let text = place.and_then(|place| words.get(place + 1)).ok_or_else(|| format!("{name} is missing"))?;
    text.parse().map_err(|_| format!("{name} {text}: not a value").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "--role agent --dir /tmp/x --uavs 3 --rate 0 --warm-up 0.1 --seconds 2 --bytes-out 608 \
                        --bytes-back 152 --uav 2";

    fn parse(line: &str) -> Result<Args, Failure> {
        Args::parse(&line.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn an_agent_knows_its_uav_and_its_sizes() {
        let args = parse(LINE).unwrap();
        assert_eq!((args.role, args.uavs, args.rate_hz), (Role::Agent(2), 3, 0));
        assert_eq!((args.bytes_out, args.bytes_back, args.seconds), (608, 152, 2.0));
    }

    #[test]
    fn a_missing_or_wrong_argument_is_named() {
        for (from, to, name) in
            [("--uavs 3", "", "--uavs"), ("--rate 0", "--rate x", "--rate x"), ("agent", "bird", "bird")]
        {
            let error = parse(&LINE.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
