//! Which UAVs are alive, as one UAV knows it from the states of its ring neighbours alone.
//!
//! A failure detector and a dissemination protocol after SWIM (Das, Gupta, Motivala 2002). The states that every UAV
//! sends each tick replace SWIM's probes, and carry its rumours:
//!
//! - Each UAV watches the nearest UAV on each side of the ring that is alive. If that UAV is silent for a quarter of
//!   the patience with it, the watcher suspects it. If it is silent for the whole patience, the watcher declares it
//!   lost and watches the next one.
//! - Suspicions and losses travel round the ring as rumours. A UAV that receives a rumour of its own suspicion or
//!   loss refutes it with the next incarnation.
//! - After a refuted suspicion the patience with that UAV doubles, because its link has longer gaps than assumed.
//!   After a long time without such gaps it halves again.
//! - Of two reports on a UAV, the one with the higher standing is newer, whichever way it came and however late. So
//!   all UAVs that hear from each other, directly or not, agree in the end.
//!
//! Never mistakes lateness for loss: a UAV is alive if something new arrived from it recently, however old that is.
//! Never knows positions.

mod dissemination;
mod listening;
mod record;
mod standing;

use dissemination::Dissemination;
use listening::Side;
use record::{MemberRecord, Silence};
use ringwing_flight::{RingOrder, Rumour, Tick, UavId, UavState, payload::RUMOURS};
use standing::Standing;

/// The two directions round the ring.
#[derive(Debug, Clone, Copy)]
enum RingSide {
    Previous,
    Next,
}

const DIRECTIONS: [RingSide; 2] = [RingSide::Previous, RingSide::Next];

/// A UAV that is watched for silence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Watch {
    uav: UavId,
    /// Only silence from this tick on counts.
    since: Tick,
}

/// One UAV's view of who is alive.
#[derive(Debug, Clone)]
pub struct MembershipView {
    own: UavId,
    order: RingOrder,
    timeout_ticks: i64,
    /// UAV 1 first.
    members: Vec<MemberRecord>,
    /// On each side the nearest UAV that is alive, and while that one is silent the next one beyond.
    watches: Vec<Watch>,
    /// The watches of the tick before.
    watches_before: Vec<Watch>,
    listened: Vec<UavId>,
    revision: u64,
    lost_fingerprint: u64,
    dissemination: Dissemination,
}

impl MembershipView {
    /// The view of UAV `own` in a ring of this `order` at the start: all are alive. A watched UAV that is silent for
    /// `timeout_ticks` is lost, unless the patience with it has grown.
    pub fn new(own: UavId, order: RingOrder, timeout_ticks: i64) -> Self {
        let mut view = Self {
            own,
            timeout_ticks,
            members: vec![MemberRecord::new(timeout_ticks); order.count() as usize],
            order,
            watches: Vec::new(),
            watches_before: Vec::new(),
            listened: Vec::new(),
            revision: 0,
            lost_fingerprint: 0,
            dissemination: Dissemination::default(),
        };
        view.update_listened(Tick::APPROACH);
        view
    }

    /// Whether this UAV considers `uav` alive; a suspected UAV is alive.
    pub fn is_alive(&self, uav: UavId) -> bool {
        !self.members[uav.index()].standing.is_lost()
    }

    /// Grows with each change of who is alive.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The UAVs to listen to, in order of their numbers: the watched ones, the lost ones between them for their
    /// return, and the neighbours in the whole ring.
    pub fn listened(&self) -> &[UavId] {
        &self.listened
    }

    /// A fingerprint of the set of lost UAVs: 0 for the empty set, and equal where two UAVs agree.
    pub fn lost_fingerprint(&self) -> u64 {
        self.lost_fingerprint
    }

    /// Takes in a state that was received in tick `now`: a sign of life of its sender, and its rumours.
    pub fn receive(&mut self, state: &UavState, now: Tick) {
        let numbers = 1..=self.count();
        // These numbers come from shared memory. One outside the swarm would index past the members.
        if state.uav == self.own || !numbers.contains(&state.uav.0) {
            return;
        }
        self.members[state.uav.index()].receive(state, now, self.timeout_ticks);
        for rumour in state.rumours.iter().filter(|rumour| numbers.contains(&rumour.uav)) {
            self.apply_report(UavId(rumour.uav), Standing::from(rumour.standing), now);
        }
    }

    /// Judges the silence of the watched UAVs in tick `now`, after everything was received.
    pub fn update(&mut self, now: Tick) {
        std::mem::swap(&mut self.watches, &mut self.watches_before);
        self.watches.clear();
        for direction in DIRECTIONS {
            self.watch(direction, now);
        }
        // A loss or a return updates the list at once, in `apply_report`. Only watches and turns can change it here.
        if self.watches != self.watches_before || Side::may_take_turns(self.listened.len()) {
            self.update_listened(now);
        }
    }

    /// The rumours to send in this tick.
    pub fn rumours(&mut self) -> [Rumour; RUMOURS] {
        self.dissemination.rumours(&mut self.members)
    }

    fn count(&self) -> u32 {
        self.members.len() as u32
    }

    /// Adopts the reported standing of `uav` if it is newer than the known one. A report on this UAV itself is refuted.
    fn apply_report(&mut self, uav: UavId, reported: Standing, now: Tick) {
        let member = &mut self.members[uav.index()];
        if reported <= member.standing {
            return;
        }
        let was_lost = member.standing.is_lost();
        if uav == self.own {
            member.standing = reported.refuted();
        } else {
            // Only the UAV itself raises its incarnation. That is a sign of life, even if the report suspects it again.
            if reported.incarnation() > member.standing.incarnation() {
                member.refute(now, self.timeout_ticks);
            }
            member.standing = reported;
        }
        self.dissemination.spread(member);
        if was_lost != member.standing.is_lost() {
            self.revision += 1;
            self.lost_fingerprint ^= fingerprint(uav);
            self.update_listened(now);
        }
    }

    /// Watches the UAVs in one direction that are alive, up to the first that is not silent.
    ///
    /// The UAV beyond a suspect is watched before the suspect is declared lost. If two neighbours are lost together,
    /// the loss of the second one then does not take another whole patience to notice.
    fn watch(&mut self, direction: RingSide, now: Tick) {
        // A copy for each step: an iterator would borrow the view, which changes on the way.
        let mut uav = self.own;
        loop {
            uav = self.beside(direction, uav);
            if uav == self.own {
                return;
            }
            if !self.is_alive(uav) {
                continue;
            }
            // A UAV that was not watched in the last tick gets its whole patience from now on.
            let before = self.watches_before.iter().find(|watch| watch.uav == uav);
            let since = before.map_or(now, |watch| watch.since);
            self.watches.push(Watch { uav, since });
            let member = &mut self.members[uav.index()];
            let report = match member.judge_silence(since, now) {
                Silence::Short => return,
                Silence::Suspicious => member.standing.suspected(),
                Silence::Over => member.standing.lost(),
            };
            // Repeats every tick while the silence lasts. After the first time the standing is not newer, and nothing
            // changes.
            self.apply_report(uav, report, now);
        }
    }

    /// All other UAVs in one direction, the nearest first.
    fn others(&self, direction: RingSide) -> impl Iterator<Item = UavId> {
        let step = move |uav: &UavId| Some(self.beside(direction, *uav));
        std::iter::successors(step(&self.own), step).take_while(|uav| *uav != self.own)
    }

    /// The UAV next to `uav` in one direction of the whole ring.
    fn beside(&self, direction: RingSide, uav: UavId) -> UavId {
        match direction {
            RingSide::Previous => self.order.previous(uav),
            RingSide::Next => self.order.next(uav),
        }
    }

    fn update_listened(&mut self, now: Tick) {
        let mut listened = std::mem::take(&mut self.listened);
        listened.clear();
        for direction in DIRECTIONS {
            let nearest_alive = self.others(direction).position(|uav| self.is_alive(uav));
            let side = Side::new(nearest_alive, self.members.len() - 1, now, self.timeout_ticks);
            let places = self.others(direction).enumerate();
            listened.extend(places.filter(|(place, _)| side.includes(*place)).map(|(_, uav)| uav));
        }
        // The UAV beyond a suspect is watched too, although it is not the nearest one.
        listened.extend(self.watches.iter().map(|watch| watch.uav));
        // In a small ring both directions lead to the same UAVs.
        listened.sort_unstable();
        listened.dedup();
        self.listened = listened;
    }
}

/// A number for one UAV. The exclusive or of such numbers is the fingerprint of a set.
fn fingerprint(uav: UavId) -> u64 {
    // The multiplier of Knuth's MMIX generator spreads small numbers over all bits.
    u64::from(uav.0).wrapping_mul(6_364_136_223_846_793_005).rotate_left(uav.0)
}

#[cfg(test)]
mod tests;
