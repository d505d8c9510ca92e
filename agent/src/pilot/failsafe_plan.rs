//! How an airframe should leave the formation if its agent falls silent: by the path that keeps it clear of the others.
//!
//! The agent tells its airframe beforehand, with every command, because afterwards it cannot. A plan compares many paths, a
//! few moments of them after each answer, when nobody waits for this agent.
//!
//! Never knows where the other UAVs are. The plan is for a formation whose UAVs fly in their slots. A UAV that is far from its
//! own slot does not use it.

use super::{Situation, slots::Slots, track::PeerTrack};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{
    FailsafePath, FormationFrame, LivingRing, LoiterRates, Pose, SensedObstacle, UavId, direction, wrap,
};
use ringwing_scenario::{Failsafe, Scenario};
use std::sync::Arc;

/// How far ahead a path is compared with the slots. After this time, a formation of 16 has passed a UAV that was in front of it.
/// A shorter time misses UAVs that overtake the airframe later; a longer one only costs more.
const LOOK_AHEAD_S: f64 = 40.0;
/// Time between two compared moments. The airframe and a slot approach each other at up to 37 m/s. With more time between
/// the moments, a path seems clearer than it is, by more than 3 m at a distance of 20 m.
const STEP_S: f64 = 0.5;
const STEPS: u32 = (LOOK_AHEAD_S / STEP_S) as u32;
/// A path that stays this far from every slot, in multiples of the spacing, is good enough. More sends airframes on longer ways that
/// could circle at once; less leaves too little for survivors that are still on their way to their slots. A UAV that is farther than this
/// from its own slot cannot use the plan.
const ENOUGH_SPACINGS: f64 = 0.6;
/// How long an airframe may fly straight on before it circles. Longer legs lead out of larger formations.
const STRAIGHT_S: [u8; 3] = [5, 10, 20];
/// Moments that are compared in each second of the flight. All paths together have about 3000. Twice as many finish a plan in
/// half the time, and cost twice as much in each of its ticks.
const STEPS_PER_S: f64 = 1000.0;
/// A leader that has turned by more than this makes a plan outdated. Less plans more often, more uses an old plan for longer.
const NEW_HEADING_RAD: f64 = 0.1;
/// The same for a change of the leader's turn rate.
const NEW_TURN_RATE_RAD_S: f64 = 0.005;
/// The same for a change of the wind estimate, which always varies a little in gusts.
const NEW_WIND_M_S: f64 = 2.0;

/// Decides how one UAV's airframe leaves the formation.
#[derive(Debug, Clone)]
pub(super) struct FailsafePlan {
    own: UavId,
    /// `None` if the airframe does not loiter, or if nobody closes the ring after a loss: then there is nothing to choose.
    loiter: Option<Loiter>,
    /// What the newest finished plan says.
    planned: FailsafePath,
    /// What the airframe is told.
    path: FailsafePath,
    /// What was known in the tick that was flown last; `None` once the plan has gone on from there.
    sight: Option<Sight>,
    /// What the newest plan is for; `None` before the first one.
    planned_for: Option<Circumstances>,
    /// The plan that is being made.
    search: Option<Search>,
}

/// How the leader and the air move in a tick.
#[derive(Debug, Clone, Copy)]
struct Sight {
    /// Where the leader is, and how it flies on.
    leader: PeerTrack,
    wind_m_s: Vector2<f64>,
}

/// What decides which path is clear, apart from obstacles.
#[derive(Debug, Clone, Copy)]
struct Circumstances {
    /// How many times the slots were sent elsewhere.
    changes: u64,
    /// The bearing of the formation seen from the leader: constant if the formation turns with the leader.
    frame_rad: f64,
    leader_turn_rate_rad_s: f64,
    wind_m_s: Vector2<f64>,
}

/// How an airframe goes into its failsafe, and how the others fly on.
#[derive(Debug, Clone, Copy)]
struct Loiter {
    /// The airframe flies on as last commanded until then.
    begins_s: f64,
    rates: LoiterRates,
    frame: FormationFrame,
    /// When the others notice the loss, and how long the ring takes to close.
    loss_s: f64,
    slots_move_s: f64,
    enough_m: f64,
    steps_per_tick: u32,
}

/// The flight after the agent's last command, as planned. The origin is where the leader is then. Places are relative to the
/// air, which carries the airframe: seen from there, the leader and the obstacles drift against the wind.
#[derive(Debug, Clone)]
struct Outlook {
    /// Where the failsafe takes over.
    start: Pose,
    /// The leader, at the origin.
    leader: PeerTrack,
    wind_m_s: Vector2<f64>,
    /// The slot of each other UAV, before and after the ring has closed. Shared, because an agent copies its pilot to
    /// rehearse each tick.
    others: Arc<[[Vector2<f64>; 2]]>,
}

/// The obstacles that are sensed in one tick, with where the leader is then.
#[derive(Debug, Clone, Copy)]
struct Obstacles<'a> {
    sensed: &'a [SensedObstacle],
    leader: Point2<f64>,
}

/// A comparison of all paths that goes on from tick to tick.
#[derive(Debug, Clone)]
struct Search {
    outlook: Outlook,
    /// The path that was flown before is looked at first.
    before: FailsafePath,
    /// The path that is looked at, as a place in [`path_at`]; `None` for the one before.
    candidate: Option<u32>,
    /// Which moment of it comes next.
    step: u32,
    /// The smallest distance so far.
    clearance_m: f64,
    best: FailsafePath,
    best_m: f64,
}

impl FailsafePlan {
    /// The plan of UAV `own` in `scenario`.
    pub(super) fn new(scenario: &Scenario, own: UavId) -> Self {
        let (airframe, membership) = (&scenario.airframe, &scenario.membership);
        let chooses = scenario.control.ring_closes && airframe.failsafe == Failsafe::Loiter;
        let loiter = chooses.then(|| Loiter {
            begins_s: airframe.command_timeout_s,
            rates: airframe.loiter_rates(),
            frame: scenario.formation.frame,
            loss_s: membership.loss_timeout_s,
            slots_move_s: membership.slots_move_s,
            enough_m: ENOUGH_SPACINGS * scenario.formation.spacing_m,
            steps_per_tick: (STEPS_PER_S * scenario.period_s()).ceil() as u32,
        });
        let built_in = FailsafePath::CIRCLE_LEFT;
        Self { own, loiter, planned: built_in, path: built_in, sight: None, planned_for: None, search: None }
    }

    /// The way to leave.
    pub(super) fn path(&self) -> FailsafePath {
        self.path
    }

    /// Decides what the airframe is told in `situation`.
    pub(super) fn look(&mut self, situation: &Situation<'_>) {
        let (Some(loiter), Some(leader), Some(slot)) = (self.loiter, situation.leader, situation.slot_m())
        else {
            return;
        };
        let leader = PeerTrack { pose: leader.pose, ..leader.track };
        self.sight = Some(Sight { leader, wind_m_s: situation.wind_m_s });
        self.path = self.way_out(&loiter, &situation.own, slot, &leader.pose);
    }

    /// The newest plan, or away from `leader` for a UAV that is far from its `slot`.
    fn way_out(&self, loiter: &Loiter, own: &Pose, slot: Point2<f64>, leader: &Pose) -> FailsafePath {
        if (own.position - slot).norm() < loiter.enough_m { self.planned } else { outward(own, leader) }
    }

    /// Goes on with the plan while the living UAVs have `slots`, among the `obstacles` that are sensed. Begins a new plan if the last one
    /// is outdated.
    pub(super) fn go_on(&mut self, slots: &Slots, obstacles: &[SensedObstacle]) {
        let (Some(loiter), Some(sight)) = (self.loiter, self.sight.take()) else { return };
        let now = Circumstances::new(slots, &sight, loiter.frame);
        // Obstacles come nearer all the time. So while there are any, one search follows another.
        if self.is_outdated(&now) || (self.search.is_none() && !obstacles.is_empty()) {
            self.planned_for = Some(now);
            self.search = Some(Search::new(loiter.outlook(self.own, slots.ring(), &sight), self.planned));
        }
        let obstacles = Obstacles { sensed: obstacles, leader: sight.leader.pose.position };
        if let Some(search) = &mut self.search
            && let Some(path) = search.advance(&loiter, &obstacles)
        {
            (self.planned, self.search) = (path, None);
        }
    }

    fn is_outdated(&self, now: &Circumstances) -> bool {
        let Some(then) = &self.planned_for else { return true };
        // A leader that keeps turning must not restart a search again and again, because it would never end.
        then.changes != now.changes || (self.search.is_none() && !then.resembles(now))
    }
}

impl Circumstances {
    fn new(slots: &Slots, sight: &Sight, frame: FormationFrame) -> Self {
        let Sight { leader, wind_m_s } = *sight;
        let frame_rad = match frame {
            FormationFrame::Fixed => -leader.pose.heading_rad,
            FormationFrame::Leader => 0.0,
        };
        let leader_turn_rate_rad_s = leader.turn_rate_rad_s;
        Self { changes: slots.changes(), frame_rad, leader_turn_rate_rad_s, wind_m_s }
    }

    /// Whether the leader and the air move nearly as in `other`.
    fn resembles(&self, other: &Self) -> bool {
        let turned_rad = wrap(other.frame_rad - self.frame_rad).abs();
        let turns_rad_s = (other.leader_turn_rate_rad_s - self.leader_turn_rate_rad_s).abs();
        let wind_changes_m_s = (other.wind_m_s - self.wind_m_s).norm();
        turned_rad < NEW_HEADING_RAD && turns_rad_s < NEW_TURN_RATE_RAD_S && wind_changes_m_s < NEW_WIND_M_S
    }
}

impl Loiter {
    /// What happens if the agent of `own` falls silent now.
    fn outlook(&self, own: UavId, ring: &LivingRing, sight: &Sight) -> Outlook {
        let Sight { leader, wind_m_s } = *sight;
        let here = Pose { position: Point2::origin(), ..leader.pose };
        Outlook {
            start: self.start(ring.slot(own.0).offset(), sight),
            leader: PeerTrack { pose: here, ..leader },
            wind_m_s,
            others: moving_slots(own, ring).into(),
        }
    }

    /// Where the failsafe takes over of a UAV that flew in the slot at `offset`.
    fn start(&self, offset: Vector2<f64>, sight: &Sight) -> Pose {
        let Sight { leader, wind_m_s } = sight;
        let (heading_rad, rate_rad_s) = (leader.pose.heading_rad, leader.turn_rate_rad_s);
        let offset = self.frame.placed(offset, heading_rad);
        let leading_m_s = direction(heading_rad) * leader.speed_m_s;
        let velocity = self.frame.velocity_m_s(leading_m_s, rate_rad_s, offset) - wind_m_s;
        let slot = Pose { position: Point2::from(offset), heading_rad: libm::atan2(velocity.y, velocity.x) };
        slot.after(velocity.norm(), rate_rad_s, self.begins_s)
    }

    /// How far the ring has closed this long after the last command, from 0 to 1.
    fn closed(&self, time_s: f64) -> f64 {
        // Slots that jump have a duration of zero.
        if time_s <= self.loss_s { 0.0 } else { ((time_s - self.loss_s) / self.slots_move_s).min(1.0) }
    }

    /// The smallest distance of an airframe on `path`, `time_s` after its failsafe took over, from the slots of the others and from
    /// the edges of `obstacles`.
    fn clearance_m(
        &self,
        path: FailsafePath,
        outlook: &Outlook,
        time_s: f64,
        obstacles: &Obstacles<'_>,
    ) -> f64 {
        let own = path.pose(&outlook.start, &self.rates, time_s).position;
        let time_s = self.begins_s + time_s;
        let from_obstacles_m = obstacles.clearance_m(own, time_s, outlook.wind_m_s);
        let PeerTrack { pose, speed_m_s, turn_rate_rad_s, .. } = outlook.leader;
        let led = pose.after(speed_m_s, turn_rate_rad_s, time_s);
        let centre = led.carried(outlook.wind_m_s, -time_s);
        let closed = self.closed(time_s);
        // Seen in the frame of the slots, so that only one place has to be turned.
        let own = self.frame.seen(own - centre.position, centre.heading_rad);
        let distance_m2 =
            |[before, after]: &[Vector2<f64>; 2]| (own - before - (after - before) * closed).norm_squared();
        let nearest_m2 = outlook.others.iter().map(distance_m2).fold(f64::INFINITY, f64::min);
        nearest_m2.sqrt().min(from_obstacles_m)
    }
}

impl Obstacles<'_> {
    /// The distance of `own` from the nearest edge after `time_s`, as [`Outlook`] gives places; infinite without obstacles.
    fn clearance_m(&self, own: Point2<f64>, time_s: f64, wind_m_s: Vector2<f64>) -> f64 {
        let from_edge_m = |one: &SensedObstacle| {
            let velocity_m_s = Vector2::from(one.velocity_m_s) - wind_m_s;
            let centre = Point2::from(one.position_m) - self.leader + velocity_m_s * time_s;
            (own.coords - centre).norm() - one.radius_m
        };
        self.sensed.iter().map(from_edge_m).fold(f64::INFINITY, f64::min)
    }
}

impl Search {
    fn new(outlook: Outlook, before: FailsafePath) -> Self {
        Self {
            outlook,
            before,
            candidate: None,
            step: 0,
            clearance_m: f64::INFINITY,
            best: before,
            best_m: f64::NEG_INFINITY,
        }
    }

    /// Compares the moments of a tick. Returns the first path that is clear enough, or in the end the clearest.
    fn advance(&mut self, loiter: &Loiter, obstacles: &Obstacles<'_>) -> Option<FailsafePath> {
        for _ in 0..loiter.steps_per_tick {
            let Some(path) = self.candidate.map_or(Some(self.before), path_at) else {
                return Some(self.best);
            };
            self.compare(path, loiter, obstacles);
            if self.best_m >= loiter.enough_m {
                return Some(self.best);
            }
        }
        None
    }

    /// Compares the next moment of `path`.
    fn compare(&mut self, path: FailsafePath, loiter: &Loiter, obstacles: &Obstacles<'_>) {
        let time_s = f64::from(self.step) * STEP_S;
        let clearance_m = loiter.clearance_m(path, &self.outlook, time_s, obstacles);
        self.clearance_m = self.clearance_m.min(clearance_m);
        self.step += 1;
        let is_worse = self.clearance_m <= self.best_m;
        // Most paths meet somebody early, so it saves most of the work to leave a path once it is worse than the best.
        if is_worse || self.step > STEPS {
            if !is_worse {
                (self.best, self.best_m) = (path, self.clearance_m);
            }
            self.candidate = Some(self.candidate.map_or(0, |place| place + 1));
            (self.step, self.clearance_m) = (0, f64::INFINITY);
        }
    }
}

/// The circle that leads away from the leader. It is slow, so that the others have time to avoid a UAV that is in their midst.
fn outward(own: &Pose, leader: &Pose) -> FailsafePath {
    let is_left = direction(own.heading_rad).perp(&(own.position - leader.position)) >= 0.0;
    if is_left { FailsafePath::CIRCLE_LEFT } else { FailsafePath::CIRCLE_RIGHT }
}

/// The paths in the order in which they are preferred: circles at once, then short straight legs before long ones, and
/// narrow turns before wide ones. `None` after the last one.
fn path_at(place: u32) -> Option<FailsafePath> {
    let circles = [FailsafePath::CIRCLE_LEFT, FailsafePath::CIRCLE_RIGHT];
    if let Some(circle) = circles.get(place as usize) {
        return Some(*circle);
    }
    let turns = 2 * u32::from(FailsafePath::QUARTER_TURN_STEPS.unsigned_abs()) + 1;
    let place = place - circles.len() as u32;
    let (leg, turn) = ((place / turns) as usize, (place % turns) as i8);
    // 0, -1, 1, -2, 2, and so on.
    let turn = if turn % 2 == 0 { turn / 2 } else { -(turn + 1) / 2 };
    STRAIGHT_S.get(leg).map(|straight_s| FailsafePath::new(turn, *straight_s))
}

/// The slot of each UAV but `own`, before and after the ring has closed without it.
fn moving_slots(own: UavId, ring: &LivingRing) -> Vec<[Vector2<f64>; 2]> {
    let lives = |number: u32| number != own.0 && ring.has(number);
    let mut closed = ring.clone();
    closed.reform(lives);
    let others = ring.in_formation().filter(|number| lives(*number));
    others.map(|number| [ring, &closed].map(|ring| ring.slot(number).offset())).collect()
}

#[cfg(test)]
mod tests;
