//! What a UAV has heard of the others: where they are, and who lives.
//!
//! Never hears of a tick before the next: what comes before its time waits in the [arrivals](crate::reception::arrivals).

use super::track::{Link, Track};
use crate::membership::Membership;
use ringwing_flight::{Rumour, Tick, UavId, UavState, payload::RUMOURS};
use ringwing_scenario::Scenario;

/// The others, as far as they are listened to.
#[derive(Debug, Clone)]
pub struct Neighbours {
    heard: Vec<Heard>,
    /// Whom to listen to; only a membership changes it.
    listened: Vec<UavId>,
    /// Absent under a law that takes no notice of losses.
    membership: Option<Membership>,
}

/// What was heard of one.
#[derive(Debug, Clone)]
struct Heard {
    uav: UavId,
    link: Link,
}

impl Neighbours {
    /// Those of `own` in `scenario`; whoever says nothing for `timeout_ticks` may be lost.
    pub fn new(scenario: &Scenario, own: UavId, timeout_ticks: i64) -> Self {
        let count = scenario.formation.uavs;
        let closes = scenario.control.ring_closes;
        let membership = closes.then(|| Membership::new(own, count, timeout_ticks));
        let listened = vec![own.previous(count), own.next(count)];
        let mut neighbours = Self { heard: Vec::new(), listened, membership };
        neighbours.attend();
        neighbours
    }

    /// Takes in what one of them sent, in tick `now`.
    pub fn hear(&mut self, state: &UavState, now: Tick) {
        let Some(heard) = self.heard.iter_mut().find(|heard| heard.uav == state.uav) else { return };
        let Some(track) = Track::of_uav(state) else { return };
        heard.link.hear(track);
        if let Some(membership) = &mut self.membership {
            membership.hear(state, now);
        }
    }

    /// Judges who lives in tick `now`, after everything was heard.
    pub fn update(&mut self, now: Tick) {
        let Some(membership) = &mut self.membership else { return };
        membership.update(now);
        if membership.listened() != self.listened {
            self.listened.clear();
            self.listened.extend_from_slice(membership.listened());
            self.attend();
        }
    }

    /// What `uav` was heard to say last.
    pub fn newest(&self, uav: UavId) -> Option<&Track> {
        self.heard.iter().find(|heard| heard.uav == uav)?.link.newest()
    }

    /// Whom to listen to.
    pub fn listened(&self) -> &[UavId] {
        &self.listened
    }

    /// Whether `uav` is held for living.
    pub fn lives(&self, uav: UavId) -> bool {
        self.membership.as_ref().is_none_or(|membership| membership.lives(uav))
    }

    /// Grows with each change of who lives.
    pub fn revision(&self) -> u64 {
        self.membership.as_ref().map_or(0, Membership::revision)
    }

    /// A number for the set of the lost: 0 for none, and equal where two UAVs agree.
    pub fn lost_fingerprint(&self) -> u64 {
        self.membership.as_ref().map_or(0, Membership::lost_fingerprint)
    }

    /// What to pass on in this tick.
    pub fn rumours(&mut self) -> [Rumour; RUMOURS] {
        self.membership.as_mut().map_or_else(Default::default, Membership::rumours)
    }

    /// Forgets those who are not listened to any more, and makes room for those who are now.
    fn attend(&mut self) {
        self.heard.retain(|heard| self.listened.contains(&heard.uav));
        for uav in &self.listened {
            if self.heard.iter().all(|heard| heard.uav != *uav) {
                self.heard.push(Heard { uav: *uav, link: Link::default() });
            }
        }
    }
}
