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
