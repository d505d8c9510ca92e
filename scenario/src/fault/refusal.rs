//! Which faults are impossible for a given swarm, and why.
//!
//! Never knows the state of a run: whether a process is there to be killed is the launcher's question.

use super::{Action, BurstChain, Fault, LinkImpairment, ProcessFault, Targets};
use crate::Scenario;
use ringwing_flight::{Pace, Part};
use std::collections::BTreeMap;

/// How much of `answer_timeout_s` the delayed answers of an agent may take. With a larger share, a busy machine could give
/// up an agent that is only as slow as its fault says, and chance would decide the flight.
const SLOW_SHARE: f64 = 0.8;

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

impl Scenario {
    /// Why `added`, a fault that is to be added, is impossible in this scenario, or `None` if it is possible.
    pub fn refusal_of(&self, added: &Fault) -> Option<String> {
        let action = &added.action;
        let refusal = action.refusal(self.formation.uavs).or_else(|| action.refusal_at(self.time.rate_hz));
        refusal.or_else(|| {
            let all = self.faults.iter().chain([added]).cloned().collect();
            let together = Self { faults: all, ..self.clone() };
            too_slow(&together).remove(&(together.faults.len() as u32))
        })
    }
}

/// The faults that slow an agent in lockstep by more than the world waits for an answer: the number of the fault, counted
/// from 1, and what to do.
pub(crate) fn too_slow(scenario: &Scenario) -> BTreeMap<u32, String> {
    let timeout_s = scenario.supervision.answer_timeout_s;
    let slow = scenario.schedule().slow_answers();
    let mut refused = BTreeMap::new();
    // In real time nobody waits for an answer.
    if scenario.pace() == Pace::RealTime {
        return refused;
    }
    for one in &slow {
        // Delays of one agent add up, and the sum can only grow where one of them begins.
        let at_its_begin = slow.iter().filter(|other| other.part == one.part && other.is_on(one.begin));
        let by_s: f64 = at_its_begin.map(|other| other.by_s).sum();
        if by_s > SLOW_SHARE * timeout_s {
            refused.insert(one.number, slow_message(one.part, by_s, timeout_s));
        }
    }
    refused
}

fn slow_message(part: Part, by_s: f64, timeout_s: f64) -> String {
    let needed_s = (by_s / SLOW_SHARE * 1000.0).ceil() / 1000.0;
    format!(
        "{part} would answer {by_s} s late, and in lockstep the world gives up a process after \
         supervision.answer_timeout_s {timeout_s} s: slow it by at most {} s, or set answer_timeout_s to {needed_s} s",
        (SLOW_SHARE * timeout_s * 1e6).floor() / 1e6
    )
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
            _ => return None,
        };
        Some(reason.into())
    }
}
