//! What a UAV has received from the other UAVs it listens to: where they are, and who is alive.
//!
//! Never gets a sample before it can be used: the [arrivals](crate::reception::arrivals) see to that.

use super::track::{NewestTrack, PeerTrack};
use crate::membership::MembershipView;
use ringwing_flight::{Rumour, Tick, UavId, UavState, payload::RUMOURS};
use ringwing_scenario::Scenario;

/// The UAVs that one UAV listens to.
#[derive(Debug, Clone)]
pub(super) struct Neighbours {
    tracks: Vec<NeighbourTrack>,
    listened: Vec<UavId>,
    /// `None` under a law that ignores losses: then it listens to its two neighbours in the whole ring for ever.
    membership: Option<MembershipView>,
}

#[derive(Debug, Clone)]
struct NeighbourTrack {
    uav: UavId,
    newest: NewestTrack,
}

impl Neighbours {
    /// The neighbours of `own` in `scenario`. A UAV that is silent for `timeout_ticks` may be declared lost.
    pub(super) fn new(scenario: &Scenario, own: UavId, timeout_ticks: i64) -> Self {
        let order = scenario.ring_order();
        let closes = scenario.control.ring_closes;
        let mut listened = vec![order.previous(own), order.next(own)];
        let membership = closes.then(|| MembershipView::new(own, order, timeout_ticks));
        // Benchmarks fly swarms of two, whose neighbours are the same UAV, and of one, which has no neighbour.
        listened.dedup();
        listened.retain(|uav| *uav != own);
        let mut neighbours = Self { tracks: Vec::new(), listened, membership };
        neighbours.update_tracks();
        neighbours
    }

    /// Takes in what one of them sent, in tick `now`.
    pub(super) fn receive(&mut self, state: &UavState, now: Tick) {
        let Some(known) = self.tracks.iter_mut().find(|known| known.uav == state.uav) else { return };
        // Check this before the membership hears of it: a damaged state is no sign of life.
        let Some(track) = PeerTrack::of_uav(state) else { return };
        known.newest.update(track);
        if let Some(membership) = &mut self.membership {
            membership.receive(state, now);
        }
    }

    /// Judges who is alive in tick `now`, after everything was received.
    pub(super) fn update(&mut self, now: Tick) {
        let Some(membership) = &mut self.membership else { return };
        membership.update(now);
        if membership.listened() != self.listened {
            self.listened.clear();
            self.listened.extend_from_slice(membership.listened());
            self.update_tracks();
        }
    }

    /// The newest track of `uav`.
    pub(super) fn newest(&self, uav: UavId) -> Option<&PeerTrack> {
        self.tracks.iter().find(|known| known.uav == uav)?.newest.get()
    }

    /// The UAVs to listen to.
    pub(super) fn listened(&self) -> &[UavId] {
        &self.listened
    }

    /// Whether this UAV considers `uav` alive.
    pub(super) fn is_alive(&self, uav: UavId) -> bool {
        self.membership.as_ref().is_none_or(|membership| membership.is_alive(uav))
    }

    /// Grows with each change of who is alive.
    pub(super) fn revision(&self) -> u64 {
        self.membership.as_ref().map_or(0, MembershipView::revision)
    }

    /// A fingerprint of the set of lost UAVs: 0 for the empty set, and equal where two UAVs agree.
    pub(super) fn lost_fingerprint(&self) -> u64 {
        self.membership.as_ref().map_or(0, MembershipView::lost_fingerprint)
    }

    /// The rumours to send in this tick.
    pub(super) fn rumours(&mut self) -> [Rumour; RUMOURS] {
        self.membership.as_mut().map_or_else(Default::default, MembershipView::rumours)
    }

    /// Drops the tracks of UAVs that it no longer listens to, and adds empty ones for new UAVs.
    fn update_tracks(&mut self) {
        // A UAV that is listened to again must start without a track. The old one would predict it to where it never
        // flew.
        self.tracks.retain(|known| self.listened.contains(&known.uav));
        for uav in &self.listened {
            if self.tracks.iter().all(|known| known.uav != *uav) {
                self.tracks.push(NeighbourTrack { uav: *uav, newest: NewestTrack::default() });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reception::sample::test_state;

    /// A UAV that considers a neighbour lost after 100 silent ticks.
    fn neighbours(own: u32) -> Neighbours {
        let mut scenario = Scenario::default();
        scenario.control.ring_closes = true;
        Neighbours::new(&scenario, UavId(own), 100)
    }

    fn state(uav: u32, tick: i64, x_m: f64) -> UavState {
        UavState { position_m: [x_m, 0.0], uav: UavId(uav), ..test_state(tick) }
    }

    /// UAV 2 hears from UAV 1 in each tick up to `until`, and from UAV 3 the states that `of_three` gives.
    fn fly(until: i64, of_three: impl Fn(i64) -> Option<UavState>) -> Neighbours {
        let mut neighbours = neighbours(2);
        for tick in 0..until {
            let heard = [Some(state(1, tick, 0.0)), of_three(tick)];
            heard.iter().flatten().for_each(|state| neighbours.receive(state, Tick(tick)));
            neighbours.update(Tick(tick));
        }
        neighbours
    }

    #[test]
    fn the_newest_state_of_a_neighbour_is_kept_and_that_of_a_stranger_is_not() {
        let mut neighbours = neighbours(2);
        for (uav, tick, x_m) in [(3, 5, 50.0), (3, 4, 40.0), (5, 5, 0.0)] {
            neighbours.receive(&state(uav, tick, x_m), Tick(6));
        }
        let newest = neighbours.newest(UavId(3)).expect("it was heard");
        assert_eq!((newest.tick, newest.pose.position.x), (Tick(5), 50.0));
        assert!(neighbours.newest(UavId(5)).is_none() && neighbours.newest(UavId(1)).is_none());
    }

    #[test]
    fn a_neighbour_that_falls_silent_or_sends_damaged_states_is_lost() {
        let heard = fly(300, |tick| Some(state(3, tick, 0.0)));
        assert!(heard.is_alive(UavId(3)) && heard.lost_fingerprint() == 0 && heard.revision() == 0);
        let mut silent = fly(300, |tick| (tick < 100).then(|| state(3, tick, 0.0)));
        let damaged = fly(300, |tick| Some(state(3, tick, if tick < 100 { 0.0 } else { f64::NAN })));
        for neighbours in [&silent, &damaged] {
            assert!(!neighbours.is_alive(UavId(3)) && neighbours.revision() > 0);
            assert!(neighbours.listened().contains(&UavId(4)), "it listens beyond the gap");
        }
        assert!(silent.rumours().iter().any(|rumour| rumour.uav == 3), "it tells the others");
        assert_ne!(silent.lost_fingerprint(), 0);
        assert_eq!(silent.lost_fingerprint(), damaged.lost_fingerprint(), "both miss the same UAV");
    }
}
