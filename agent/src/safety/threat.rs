//! What a UAV has to keep clear of: other aircraft and obstacles, each with its course and the distance to keep.
//!
//! Never asks for more distance than there is now: else a UAV that starts too near would find no clear course at all.

use super::{
    Surroundings,
    course::{Course, SAMPLES},
};
use nalgebra::{Point2, Rotation2, Vector2};
use ringwing_flight::{Aircraft, Avoided, Pose, SensedAircraft, SensedObstacle, UavId};

/// Distance by which an obstacle may come nearer although it is nearer than asked. With none, rounding would close every
/// course.
const GIVEN_UP_M: f64 = 0.05;

/// Something to keep clear of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Threat {
    pub(super) course: Course,
    /// Speed of an obstacle.
    own_m_s: f32,
    keep_m: f32,
    /// What a sample must be farther away, squared, so that no place between two samples is nearer than that; for a relative
    /// speed of 1 m/s.
    between_m2: f32,
    /// No sample must be farther away than this, squared: it is nearer now.
    here_m2: f32,
    pub(super) what: Avoided,
    /// The UAV, if it flies on command and so avoids this one in turn.
    pub(super) avoids_too: Option<UavId>,
    /// Where it is now, in the local frame.
    pub(super) place: Point2<f64>,
}

/// Where a UAV is, to see others from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewpoint {
    own: Pose,
    to_body: Rotation2<f64>,
    horizon_s: f64,
    /// The rate at which aircraft turn that fly on command.
    swarm_rad_s: f64,
    /// The velocity of the air in which courses are compared.
    wind_m_s: Vector2<f64>,
}

/// How a course comes too near to something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Conflict {
    /// The first sample that is too near.
    pub(super) first: usize,
    /// How much too near it comes at the worst, in metres.
    pub(super) depth_m: f32,
    /// The place of the threat in the list.
    pub(super) threat: usize,
}

impl Viewpoint {
    pub(super) fn new(own: Pose, horizon_s: f64, around: &Surroundings<'_>) -> Self {
        let to_body = Rotation2::new(-own.heading_rad);
        let Surroundings { swarm_rad_s, wind_m_s, .. } = *around;
        Self { own, to_body, horizon_s, swarm_rad_s, wind_m_s }
    }

    fn seen(&self, place: Point2<f64>) -> Vector2<f64> {
        self.to_body * (place - self.own.position)
    }

    /// An aircraft that was sensed `age_s` ago.
    pub(super) fn aircraft(&self, sensed: &SensedAircraft, age_s: f64, separation_m: f64) -> Threat {
        let pose = Pose { position: sensed.position_m.into(), heading_rad: sensed.heading_rad };
        // A momentary turn of a UAV that answers says nothing about the next seconds, but a turn of the whole swarm does.
        // It reports no turn rate of its own.
        let swarm_rad_s = if sensed.is_answering == 0 { 0.0 } else { self.swarm_rad_s };
        let turn_rate_rad_s = sensed.turn_rate_rad_s + swarm_rad_s;
        // Speed and heading of a UAV are those through the air, so it has drifted since. Those of an intruder are over the
        // ground, so it drifts from now on, seen from the air.
        let is_carried = matches!(sensed.who.who(), Aircraft::Uav(_));
        let drifting_s = |time_s: f64| if is_carried { age_s } else { age_s - time_s };
        let after = |time_s| {
            let flown = pose.after(sensed.speed_m_s, turn_rate_rad_s, time_s);
            flown.carried(self.wind_m_s, drifting_s(time_s)).position
        };
        let place = after(age_s);
        let course = if turn_rate_rad_s == 0.0 {
            // Straight, as most aircraft are taken to fly: two places tell all others.
            let (here, step) = (self.seen(place), self.to_body * (after(age_s + 1.0) - place));
            Course::through(self.horizon_s, |time_s| here + step * time_s)
        } else {
            Course::through(self.horizon_s, |time_s| self.seen(after(age_s + time_s)))
        };
        let here_m = (place - self.own.position).norm();
        let keep_m = separation_m.min(here_m) as f32;
        // Two samples are up to 10 m of relative motion apart, and the separation has room for what lies between.
        Threat {
            course,
            own_m_s: 0.0,
            keep_m,
            between_m2: 0.0,
            here_m2: keep_m * keep_m,
            what: Avoided::aircraft(sensed.who),
            avoids_too: of_swarm(sensed),
            place,
        }
    }

    /// An obstacle.
    pub(super) fn obstacle(&self, sensed: &SensedObstacle, clearance_m: f64) -> Threat {
        let place = Point2::from(sensed.position_m);
        let here_m = (place - self.own.position).norm() - GIVEN_UP_M;
        let keep_m = (sensed.radius_m + clearance_m).min(here_m);
        // Half of the way between two samples, at 1 m/s: the middle of a chord is nearer to the centre than its ends.
        let half_way_m = self.horizon_s / SAMPLES as f64 / 2.0;
        let (here, velocity) = (self.seen(place), Vector2::from(sensed.velocity_m_s) - self.wind_m_s);
        let step = self.to_body * velocity;
        Threat {
            course: Course::through(self.horizon_s, |time_s| here + step * time_s),
            own_m_s: velocity.norm() as f32,
            keep_m: keep_m as f32,
            between_m2: (half_way_m * half_way_m) as f32,
            here_m2: (here_m * here_m) as f32,
            what: Avoided::OBSTACLE,
            avoids_too: None,
            place,
        }
    }
}

impl Threat {
    /// How fast it flies on the straight line from its first to its last place within the horizon.
    pub(super) fn speed_m_s(&self, horizon_s: f64) -> f64 {
        let ([x, y], [end_x, end_y]) = (self.course.first(), self.course.last());
        // The first sample is a step from now.
        let time_s = horizon_s * (SAMPLES - 1) as f64 / SAMPLES as f64;
        f64::from((end_x - x).hypot(end_y - y)) / time_s
    }

    /// The squared distance to keep at each sample at this speed.
    fn keep_m2(&self, speed: f32) -> f32 {
        let relative = speed + self.own_m_s;
        (self.keep_m * self.keep_m + self.between_m2 * relative * relative).min(self.here_m2)
    }

    /// The squared distances from a UAV on `course` at `speed`, at each sample.
    fn squared_m2(&self, course: &Course, speed: f32) -> [f32; SAMPLES] {
        let mut squared_m2 = [0.0; SAMPLES];
        for (at, squared_m2) in squared_m2.iter_mut().enumerate() {
            let x = speed * course.x_m[at] - self.course.x_m[at];
            let y = speed * course.y_m[at] - self.course.y_m[at];
            *squared_m2 = x * x + y * y;
        }
        squared_m2
    }
}

/// The UAV, if the aircraft is one that flies on command.
fn of_swarm(sensed: &SensedAircraft) -> Option<UavId> {
    match sensed.who.who() {
        Aircraft::Uav(uav) if sensed.is_answering != 0 => Some(uav),
        _ => None,
    }
}

/// The smallest of `values`. Four at a time, as processors compute it; one after another would take four times as long.
fn smallest(values: &[f32; SAMPLES]) -> f32 {
    let mut lanes = [f32::INFINITY; 4];
    for four in values.chunks_exact(4) {
        for (lane, value) in lanes.iter_mut().zip(four) {
            *lane = if *value < *lane { *value } else { *lane };
        }
    }
    lanes.into_iter().fold(f32::INFINITY, f32::min)
}

/// Whether a UAV on `course` at `speed` stays clear of all `threats`.
pub(super) fn are_clear(threats: &[Threat], course: &Course, speed: f32) -> bool {
    threats.iter().all(|one| smallest(&one.squared_m2(course, speed)) >= one.keep_m2(speed))
}

/// The first conflict of a UAV on `course` at `speed`, with the greatest depth of all; `None` if it stays clear.
pub(super) fn first_conflict(threats: &[Threat], course: &Course, speed: f32) -> Option<Conflict> {
    let mut conflict: Option<Conflict> = None;
    for (threat, one) in threats.iter().enumerate() {
        let squared_m2 = one.squared_m2(course, speed);
        let (smallest_m2, keep_m2) = (smallest(&squared_m2), one.keep_m2(speed));
        if smallest_m2 < keep_m2 {
            let first = squared_m2.iter().position(|at| *at < keep_m2).unwrap_or(SAMPLES);
            let found = Conflict { first, depth_m: one.keep_m - smallest_m2.sqrt(), threat };
            conflict = Some(conflict.map_or(found, |known| known.joined(found)));
        }
    }
    conflict
}

impl Conflict {
    fn joined(self, other: Self) -> Self {
        let earlier = if other.first < self.first { other } else { self };
        Self { depth_m: self.depth_m.max(other.depth_m), ..earlier }
    }
}
