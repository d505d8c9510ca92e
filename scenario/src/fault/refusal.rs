//! Which faults are impossible for a given swarm, and why.
//!
//! Never knows the state of a run: whether a process is there to be killed is the launcher's question.

use super::{Action, BurstChain, LinkImpairment, ProcessFault, Targets};

impl Action {
    /// Why this action is impossible in a swarm of `uavs`, or `None` if it is possible.
    pub fn refusal(&self, uavs: u32) -> Option<String> {
        match self {
            Self::Process { fault, targets } => fault.refusal(targets).or_else(|| targets.refusal(uavs)),
            Self::Link { links, .. } | Self::Heal(links) => unknown_uav(&links.named_uavs(), uavs),
        }
    }
}

impl Action {
    /// Why this action is impossible at `rate_hz` ticks a second, or `None` if it is possible.
    pub fn refusal_at(&self, rate_hz: u32) -> Option<String> {
        let Self::Link { impairment: LinkImpairment::GilbertBurst { loss, burst_s }, .. } = self else {
            return None;
        };
        let why = if *loss >= 1.0 {
            "a link that loses every sample has no bursts: use blackout".into()
        } else if burst_s * f64::from(rate_hz) < 1.0 - 1e-9 {
            format!("bursts are shorter than a tick at {rate_hz} Hz: give longer ones, or use loss")
        } else {
            "the losses are too many for bursts of this length: give longer bursts or a smaller loss".into()
        };
        BurstChain::new(*loss, *burst_s, rate_hz).is_none().then_some(why)
    }
}

impl Targets {
    fn refusal(&self, uavs: u32) -> Option<String> {
        match self {
            Self::Uavs(named) => unknown_uav(named, uavs),
            Self::Random(count) if *count > uavs => {
                Some(format!("cannot draw {count} UAVs: this run has only {uavs}"))
            }
            _ => None,
        }
    }
}

fn unknown_uav(named: &[u32], uavs: u32) -> Option<String> {
    // The grammar has refused 0 already.
    let unknown = named.iter().find(|uav| **uav > uavs)?;
    Some(format!("there is no uav {unknown}: this run has UAVs 1 to {uavs}"))
}

impl ProcessFault {
    /// Why this kind of process cannot have this fault.
    fn refusal(self, targets: &Targets) -> Option<String> {
        let reason = match (targets, self) {
            (Targets::World, Self::Kill | Self::Stop) => return None,
            (Targets::World, _) => {
                "the world keeps time, so a fault of the world cannot end at a later time: kill or stop it"
            }
            (Targets::Recorder, Self::Slow { .. }) => {
                "the flight does not wait for the recorder, so a slow recorder changes nothing: freeze it instead"
            }
            (Targets::Leader, Self::Slow { .. }) => {
                "the leader cannot be slowed: delay its links instead, such as \"link leader->all delay 20 ms\""
            }
            (Targets::Leader | Targets::Recorder, Self::Weaken { .. } | Self::Jam { .. }) => {
                "only UAVs have airframes: name UAVs, such as \"weaken uav 3 to 14 m/s\""
            }
            (Targets::Leader | Targets::Recorder, Self::Drift { .. }) => {
                "only UAVs have sensors: name UAVs, such as \"drift uav 3 heading at 1 deg/s\""
            }
            _ => return None,
        };
        Some(reason.into())
    }
}
