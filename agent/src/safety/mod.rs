//! The collision filter: it lets the law fly as it wishes unless the way is not clear of aircraft and obstacles.
//!
//! A few times a second it predicts everything near, and where the law's wish would lead. If that comes too near to
//! something, it flies the course and speed that depart least from the wish and stay clear; if none does, those whose
//! conflict is the latest and the slightest. Pure: the same inputs give the same course, to the bit.
//!
//! Never changes a wish whose way is clear, and never knows the formation.

mod course;
mod passing;
mod threat;

use crate::law::{ControlInput, saturate};
use course::Course;
use nalgebra::{Point2, Vector2};
use passing::Passing;
use ringwing_flight::{Avoided, Pose, SensedObstacle, Tick, Traffic, UavId, wrap};
use ringwing_scenario::Scenario;
use threat::{Threat, Viewpoint, are_clear, first_conflict};

/// The widest turn that is considered. A wider one takes longer than the usual horizon, and so leads nowhere else.
const WIDEST_TURN_RAD: f64 = 2.62;
/// From heading error to turn rate while the filter acts. Larger holds the course more stiffly; above the tick rate it
/// would oscillate.
const HEADING_GAIN_PER_S: f64 = 5.0;
/// Clearance from obstacles if no course keeps the whole of it. Less could cut a corner between two samples.
const LEAST_CLEARANCE_M: f64 = 0.4;
/// Reports of traffic older than this are not used: the prediction would mislead.
const MEMORY_S: f64 = 2.0;
/// Cost of a turn to the left, in rad of departure from the wish. It makes two that meet head-on both turn right. A larger one
/// sends them the long way round.
const LEFT_COST: f64 = 0.02;
/// Cost of another heading than the last one that was chosen, in rad per rad. More makes the filter stubborn, less makes it
/// waver between two ways.
const CHANGE_COST: f64 = 0.1;
/// While the filter acts, another speed than the wished one costs twice as much after this time, three times after twice
/// of it, and so on. Without that, a UAV that wants to fall back behind another keeps its place beside it for ever, because
/// that takes no turn; a shorter time makes UAVs take the long way round too soon.
const PATIENCE_S: f64 = 3.0;
/// How long an aircraft that does not avoid this UAV may stay in its way until the UAV lets it fly ahead or passes it. Less does so
/// with intruders that cross its way; more lets it fly beside one for longer.
const ENCOUNTER_S: f64 = 10.0;
/// Conflicts with an aircraft that are at most this far apart are one encounter. A UAV beside an aircraft turns to its wish whenever that
/// is clear for a moment, and back. With a shorter time, each of these conflicts would count as the first one; with a longer one,
/// another passage would count as well.
const ENCOUNTER_BREAK_S: f64 = 3.0;
/// Cost of any conflict: more than all departures from the wish together.
const CONFLICT_COST: f64 = 1000.0;
/// Cost of a conflict that is a second nearer, in metres of depth.
const SOONER_COST_PER_S: f64 = 100.0;

/// What the filter makes of a wish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flown {
    /// The wish itself, unless the filter acts.
    pub control: ControlInput,
    /// What it avoids.
    pub avoided: Avoided,
    /// Where that was when the filter chose its way.
    pub avoided_at: Point2<f64>,
    /// How far its heading lay from that of the law's course then; positive to the left.
    pub turn_rad: f64,
}

/// What is around the UAV apart from other aircraft, which it senses by itself.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The obstacles that it senses.
    pub obstacles: &'a [SensedObstacle],
    /// The rate at which other UAVs turn that fly on command.
    pub swarm_rad_s: f64,
    /// Its estimate of the wind. Courses are compared relative to the air: there UAVs fly as they head, and obstacles and
    /// intruders drift.
    pub wind_m_s: Vector2<f64>,
}

/// The course that the filter holds while it acts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Escape {
    heading_rad: f64,
    speed_m_s: f64,
    avoided: Avoided,
    avoided_at: Point2<f64>,
    turn_rad: f64,
    /// When the filter began to act.
    since: Tick,
}

/// The collision filter of one UAV.
#[derive(Debug, Clone)]
pub struct CollisionFilter {
    uav: UavId,
    separation_m: f64,
    clearance_m: f64,
    horizon_s: f64,
    interval_ticks: i64,
    /// The same while it acts or senses an obstacle.
    acting_interval_ticks: i64,
    period_s: f64,
    turn_rate_max_rad_s: f64,
    speed_min_m_s: f64,
    speed_max_m_s: f64,
    leader_speed_m_s: f64,
    /// The turns that it considers, with the courses that they lead to.
    turns: Vec<(f64, Course)>,
    traffic: Option<Traffic>,
    threats: Vec<Threat>,
    escape: Option<Escape>,
    encounter: Option<Encounter>,
}

/// Conflicts with one aircraft that follow one another.
#[derive(Debug, Clone, Copy)]
struct Encounter {
    with: Avoided,
    began: Tick,
    latest: Tick,
}

impl CollisionFilter {
    /// The filter of `uav` in `scenario`, before it has sensed anything.
    pub fn new(scenario: &Scenario, uav: UavId) -> Self {
        let (safety, airframe) = (&scenario.safety, &scenario.airframe);
        let rate_hz = f64::from(scenario.time.rate_hz);
        let ticks = |interval_s: f64| ((interval_s * rate_hz).round() as i64).max(1);
        let turn_rate_max_rad_s = airframe.turn_rate_max_rad_s;
        let step_rad = safety.heading_step_deg.to_radians();
        let side = (WIDEST_TURN_RAD / step_rad).floor() as i32;
        let turn = |step: i32| {
            let turn_rad = f64::from(step) * step_rad;
            (turn_rad, Course::after_turn(turn_rad, turn_rate_max_rad_s, safety.horizon_s))
        };
        Self {
            uav,
            separation_m: safety.separation_m,
            clearance_m: safety.clearance_m,
            horizon_s: safety.horizon_s,
            interval_ticks: ticks(safety.interval_s),
            acting_interval_ticks: ticks(safety.acting_interval_s.min(safety.interval_s)),
            period_s: scenario.period_s(),
            turn_rate_max_rad_s,
            speed_min_m_s: airframe.speed_min_m_s,
            speed_max_m_s: airframe.speed_max_m_s,
            leader_speed_m_s: scenario.leader_start().speed_m_s,
            turns: (-side..=side).map(turn).collect(),
            traffic: None,
            threats: Vec::new(),
            escape: None,
            encounter: None,
        }
    }

    /// Takes in which other aircraft the UAV senses, in any order.
    pub fn receive(&mut self, traffic: &Traffic) {
        let is_newer = self.traffic.is_none_or(|known| known.tick < traffic.tick);
        // Another UAV's report lacks what is near this one, and may list this UAV itself.
        if traffic.uav == self.uav && is_newer {
            self.traffic = Some(*traffic);
        }
    }

    /// The newest report of other aircraft.
    pub fn traffic(&self) -> Option<&Traffic> {
        self.traffic.as_ref()
    }

    /// What to fly at `now` instead of `wish`, with the UAV at `own`. `force` is the law's force at a pose in the air, some seconds
    /// from now.
    pub fn apply(
        &mut self,
        now: Tick,
        own: &Pose,
        wish: ControlInput,
        force: impl Fn(&Pose, f64) -> Vector2<f64>,
        around: &Surroundings<'_>,
    ) -> Flown {
        // The UAVs look in turn: if two of them looked at once, both would give way to the same side, again and again.
        if (now.0 + i64::from(self.uav.0)) % self.interval_ticks(around) == 0 {
            self.escape = self.look(now, own, wish, force, around);
        }
        let Some(Escape { heading_rad, speed_m_s, avoided, avoided_at, turn_rad, .. }) = self.escape else {
            let avoided_at = Point2::origin();
            return Flown { control: wish, avoided: Avoided::NOTHING, avoided_at, turn_rad: 0.0 };
        };
        let wanted_rad_s = HEADING_GAIN_PER_S * wrap(heading_rad - own.heading_rad);
        let turn_rate_rad_s = saturate(wanted_rad_s, -self.turn_rate_max_rad_s, self.turn_rate_max_rad_s);
        Flown { control: ControlInput { speed_m_s, turn_rate_rad_s }, avoided, avoided_at, turn_rad }
    }

    /// How many ticks lie between two looks.
    fn interval_ticks(&self, around: &Surroundings<'_>) -> i64 {
        let is_close = self.escape.is_some() || !around.obstacles.is_empty();
        if is_close { self.acting_interval_ticks } else { self.interval_ticks }
    }

    /// The way to take if that of the wish is not clear; `None` if it is.
    fn look(
        &mut self,
        now: Tick,
        own: &Pose,
        wish: ControlInput,
        force: impl Fn(&Pose, f64) -> Vector2<f64>,
        around: &Surroundings<'_>,
    ) -> Option<Escape> {
        let view = Viewpoint::new(*own, self.horizon_s, around);
        self.find_threats(now, &view, around.obstacles, self.clearance_m);
        // The usual case: nothing is near, so there is no need to predict the law's course.
        if self.threats.is_empty() {
            return None;
        }
        let speed = |along_m_s: f64| saturate(along_m_s, self.speed_min_m_s, self.speed_max_m_s);
        let (wished, heading_rad) =
            Course::under_law(own, self.turn_rate_max_rad_s, self.horizon_s, wish.speed_m_s, force, speed);
        // A wish whose way is clear ends an escape that was flown so far.
        let conflict = first_conflict(&self.threats, &wished, wish.speed_m_s as f32)?;
        let turn_rad = wrap(heading_rad - own.heading_rad);
        // An escape holds one heading. So the wish competes as a turn to where the law heads half way.
        let course = Course::after_turn(turn_rad, self.turn_rate_max_rad_s, self.horizon_s);
        let threat = self.threats[conflict.threat];
        let speed_range_m_s = self.speed_max_m_s - self.speed_min_m_s;
        let passing = Passing::of(self.uav, &threat, &wished, wish.speed_m_s, speed_range_m_s);
        let since = self.escape.map_or(now, |escape| escape.since);
        let acted_s = now.since(since) as f64 * self.period_s;
        let speed_cost = 1.0 + acted_s / PATIENCE_S;
        let only_m_s = self.speed_apart(now, &threat);
        let wish = Wished { control: wish, turn_rad, course: &course, passing, speed_cost, only_m_s };
        let mut choice = self.choose(own, &wish);
        if choice.cost >= CONFLICT_COST && !around.obstacles.is_empty() {
            // A narrow gap is better than none.
            self.find_threats(now, &view, around.obstacles, LEAST_CLEARANCE_M);
            choice = self.choose(own, &wish);
        }
        let heading_rad = wrap(own.heading_rad + choice.turn_rad);
        Some(Escape {
            heading_rad,
            speed_m_s: choice.speed_m_s,
            avoided: threat.what,
            avoided_at: threat.place,
            turn_rad: wrap(choice.turn_rad - turn_rad),
            since,
        })
    }

    /// The speed that gets this UAV away from the aircraft `threat` soonest, if that has stayed beside it for long without avoiding it.
    fn speed_apart(&mut self, now: Tick, threat: &Threat) -> Option<f64> {
        let ticks = |duration_s: f64| (duration_s / self.period_s).round() as i64;
        let lasts = |known: &Encounter| {
            known.with == threat.what && now.since(known.latest) < ticks(ENCOUNTER_BREAK_S)
        };
        let began = self.encounter.filter(lasts).map_or(now, |known| known.began);
        self.encounter = Some(Encounter { with: threat.what, began, latest: now });
        let is_long = now.since(began) > ticks(ENCOUNTER_S);
        let is_judged = is_long && threat.avoids_too.is_none() && threat.what != Avoided::OBSTACLE;
        is_judged.then(|| {
            let slower_by_m_s = threat.speed_m_s(self.horizon_s) - self.speed_min_m_s;
            let faster_by_m_s = self.speed_max_m_s - threat.speed_m_s(self.horizon_s);
            if slower_by_m_s > faster_by_m_s { self.speed_min_m_s } else { self.speed_max_m_s }
        })
    }

    fn find_threats(&mut self, now: Tick, view: &Viewpoint, obstacles: &[SensedObstacle], clearance_m: f64) {
        self.threats.clear();
        // A scenario may ask for less than the least clearance. A second search must not ask for more than the first.
        let clearance_m = clearance_m.min(self.clearance_m);
        self.threats.extend(obstacles.iter().map(|obstacle| view.obstacle(obstacle, clearance_m)));
        let Some(traffic) = &self.traffic else { return };
        let age_s = now.since(traffic.tick) as f64 * self.period_s;
        if age_s <= MEMORY_S {
            let threat = |sensed| view.aircraft(sensed, age_s, self.separation_m);
            self.threats.extend(traffic.aircraft().iter().map(threat));
        }
    }

    /// The cheapest way: clear, and little off the wish.
    fn choose(&self, own: &Pose, wish: &Wished<'_>) -> Choice {
        let speeds = [wish.control.speed_m_s, self.speed_min_m_s, self.speed_max_m_s, self.leader_speed_m_s];
        let speeds = wish.only_m_s.map_or(speeds, |only_m_s| [only_m_s; 4]);
        let mut best = Choice { turn_rad: 0.0, speed_m_s: self.speed_min_m_s, cost: f64::INFINITY };
        let turns = self.turns.iter().map(|(turn_rad, course)| (*turn_rad, course));
        // The wish comes first, so that it wins among equals. If it is clear, the others are only asked whether they
        // are.
        for (turn_rad, course) in std::iter::once((wish.turn_rad, wish.course)).chain(turns) {
            let turn_cost = self.turn_cost(own, turn_rad, wish.turn_rad);
            for speed_m_s in speeds {
                let cost = turn_cost + self.speed_cost(course, speed_m_s, wish);
                // Looking for conflicts is the expensive part, so do it only for a way that could still be the best.
                if cost < best.cost {
                    let cost = cost + self.conflict_cost(course, speed_m_s, best.cost);
                    if cost < best.cost {
                        best = Choice { turn_rad, speed_m_s, cost };
                    }
                }
            }
        }
        best
    }

    fn speed_cost(&self, course: &Course, speed_m_s: f64, wish: &Wished<'_>) -> f64 {
        let departure =
            (speed_m_s - wish.control.speed_m_s).abs() / (self.speed_max_m_s - self.speed_min_m_s);
        let passing_cost = wish.passing.map_or(0.0, |passing| passing.cost(course, speed_m_s));
        wish.speed_cost * departure + passing_cost
    }

    fn turn_cost(&self, own: &Pose, turn_rad: f64, wish_turn_rad: f64) -> f64 {
        let left = if turn_rad > 0.0 { LEFT_COST } else { 0.0 };
        let change =
            self.escape.map_or(0.0, |last| wrap(own.heading_rad + turn_rad - last.heading_rad).abs());
        wrap(turn_rad - wish_turn_rad).abs() + left + CHANGE_COST * change
    }

    /// 0 for a clear course. If it cannot become better than `bound`, any number above that.
    fn conflict_cost(&self, course: &Course, speed_m_s: f64, bound: f64) -> f64 {
        let speed = speed_m_s as f32;
        // Once some course is clear, nobody asks how bad the others are.
        if bound < CONFLICT_COST {
            return if are_clear(&self.threats, course, speed) { 0.0 } else { CONFLICT_COST };
        }
        first_conflict(&self.threats, course, speed).map_or(0.0, |conflict| {
            let left = 1.0 - (conflict.first + 1) as f64 / course::SAMPLES as f64;
            CONFLICT_COST + SOONER_COST_PER_S * left * self.horizon_s + f64::from(conflict.depth_m)
        })
    }
}

/// What the law wishes, where that is not clear.
struct Wished<'a> {
    control: ControlInput,
    /// The turn to where the law heads half way, and the course that this turn leads to.
    turn_rad: f64,
    course: &'a Course,
    /// `None` if what is in the way does not avoid this UAV.
    passing: Option<Passing>,
    /// Cost of another speed, for the whole range of speeds.
    speed_cost: f64,
    /// The speed of all ways, if it does not choose.
    only_m_s: Option<f64>,
}

/// A way to fly, and what it costs.
#[derive(Debug, Clone, Copy)]
struct Choice {
    turn_rad: f64,
    speed_m_s: f64,
    cost: f64,
}

#[cfg(test)]
mod tests;
