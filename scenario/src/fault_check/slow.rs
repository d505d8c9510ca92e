//! Which faults slow an agent by more than the world waits for its answer.
//!
//! Never concerns real time, where nobody waits.

use crate::{Fault, Scenario};
use ringwing_flight::{Pace, Part};
use std::collections::BTreeMap;

/// How much of `answer_timeout_s` the delayed answers of an agent may take. With a larger share, a busy machine could give
/// up an agent that is only as slow as its fault says, and chance would decide the flight.
const SLOW_SHARE: f64 = 0.8;

impl Scenario {
    /// Why `added`, a fault that is to be added, is impossible in this scenario, or `None` if it is possible.
    pub fn refusal_of(&self, added: &Fault) -> Option<String> {
        let action = &added.action;
        let refusal = action.refusal(self.formation.uavs).or_else(|| action.refusal_at(self.time.rate_hz));
        refusal.or_else(|| {
            let all = self.faults.iter().chain([added]).cloned().collect();
            let together = Self { faults: all, ..self.clone() };
            // Without `added` nothing was too slow, so it is to blame whichever of the faults begins later.
            too_slow(&together).into_values().next()
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
