//! What the world lets a UAV sense.

use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// How many obstacles one [`Sensed`] has room for. More let a UAV see all of a dense field, and make each of these
/// messages larger; fewer hide the farther obstacles from it.
pub const MAX_SENSED_OBSTACLES: usize = 8;

/// Who flies the airframe: the agent, or which failsafe.
///
/// A number instead of an `enum`, so that any bytes in shared memory are a valid value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable, Serialize, Deserialize)]
#[repr(transparent)]
pub struct FlightMode(u32);

impl FlightMode {
    /// The airframe flies what its agent commands.
    pub const COMMANDED: Self = Self(0);
    /// Failsafe: it circles where it lost its agent.
    pub const LOITER: Self = Self(1);
    /// Failsafe: it keeps heading and speed.
    pub const HOLD: Self = Self(2);
    /// Failsafe: it has left the sky.
    pub const VANISHED: Self = Self(3);

    /// The mode called `name` in logs and tables; any other name gives one that is called `unknown`.
    pub fn from_name(name: &str) -> Self {
        let all = [Self::COMMANDED, Self::LOITER, Self::HOLD, Self::VANISHED];
        all.into_iter().find(|mode| mode.name() == name).unwrap_or(Self(u32::MAX))
    }

    /// The name that logs and tables use.
    pub fn name(self) -> &'static str {
        match self {
            Self::COMMANDED => "commanded",
            Self::LOITER => "loiter",
            Self::HOLD => "hold",
            Self::VANISHED => "vanished",
            _ => "unknown",
        }
    }
}

/// An obstacle as a UAV's sensors report it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SensedObstacle {
    /// Centre in the local frame, metres.
    pub position_m: [f64; 2],
    /// Radius `R_obs`, Eq. (13).
    pub radius_m: f64,
    /// `L_obs`, Eq. (13): the distance from the centre at which the obstacle begins to repel.
    pub braking_distance_m: f64,
    /// Velocity, east and north, in m/s; zero for a stationary obstacle.
    pub velocity_m_s: [f64; 2],
}

impl SensedObstacle {
    /// The value of an unused entry.
    const NONE: Self =
        Self { position_m: [0.0; 2], radius_m: 0.0, braking_distance_m: 0.0, velocity_m_s: [0.0; 2] };

    /// The bytes that a hash of the flight covers. The velocity counts only if the obstacle moves, so that flights past
    /// stationary obstacles keep the hashes that they had before obstacles could move.
    pub fn hashed_bytes(&self) -> &[u8] {
        // The velocity has to stay the last field: the bytes before it are those of a stationary obstacle.
        let (all, still) = (bytemuck::bytes_of(self), std::mem::offset_of!(Self, velocity_m_s));
        if self.velocity_m_s == [0.0; 2] { &all[..still] } else { all }
    }
}

/// What the world lets one UAV sense of itself and of the obstacles near it, once a tick: what its sensors say, errors
/// included.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sensed {
    /// The tick at which the world is as described.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed through the air over the last tick.
    pub speed_m_s: f64,
    /// Turn rate over the last tick.
    pub turn_rate_rad_s: f64,
    /// The UAV that senses this.
    pub uav: UavId,
    /// Who flies the airframe.
    pub mode: FlightMode,
    /// How many entries of `obstacles` are filled.
    pub obstacle_count: u32,
    /// How many more obstacles in range did not fit; the farthest are left out.
    pub obstacles_omitted: u32,
    /// Obstacles in range, nearest first; the entries after `obstacle_count` are zero.
    pub obstacles: [SensedObstacle; MAX_SENSED_OBSTACLES],
    /// How many ticks ago the position was measured: a receiver with a lower rate than the flight repeats its last fix.
    pub position_age_ticks: u32,
    /// How many ticks ago the heading was measured.
    pub heading_age_ticks: u32,
}

/// A [`Sensed`] without its obstacles, which most ticks do not have. Sent by itself, it takes two cache lines instead of
/// eight.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OwnSenses {
    /// See [`Sensed::tick`].
    pub tick: Tick,
    /// See [`Sensed::position_m`].
    pub position_m: [f64; 2],
    /// See [`Sensed::heading_rad`].
    pub heading_rad: f64,
    /// See [`Sensed::speed_m_s`].
    pub speed_m_s: f64,
    /// See [`Sensed::turn_rate_rad_s`].
    pub turn_rate_rad_s: f64,
    /// See [`Sensed::uav`].
    pub uav: UavId,
    /// See [`Sensed::mode`].
    pub mode: FlightMode,
    /// See [`Sensed::obstacle_count`].
    pub obstacle_count: u32,
    /// See [`Sensed::obstacles_omitted`].
    pub obstacles_omitted: u32,
    /// See [`Sensed::position_age_ticks`].
    pub position_age_ticks: u32,
    /// See [`Sensed::heading_age_ticks`].
    pub heading_age_ticks: u32,
}

/// The obstacles of a [`Sensed`].
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub struct NearObstacles(pub [SensedObstacle; MAX_SENSED_OBSTACLES]);

impl NearObstacles {
    /// No obstacle.
    pub const NONE: Self = Self([SensedObstacle::NONE; MAX_SENSED_OBSTACLES]);
}

impl OwnSenses {
    /// The complete message, with these obstacles.
    pub fn beside(&self, obstacles: &NearObstacles) -> Sensed {
        Sensed {
            tick: self.tick,
            position_m: self.position_m,
            heading_rad: self.heading_rad,
            speed_m_s: self.speed_m_s,
            turn_rate_rad_s: self.turn_rate_rad_s,
            uav: self.uav,
            mode: self.mode,
            obstacle_count: self.obstacle_count,
            obstacles_omitted: self.obstacles_omitted,
            obstacles: obstacles.0,
            position_age_ticks: self.position_age_ticks,
            heading_age_ticks: self.heading_age_ticks,
        }
    }
}

impl Sensed {
    /// Everything but the obstacles.
    pub fn own(&self) -> OwnSenses {
        OwnSenses {
            tick: self.tick,
            position_m: self.position_m,
            heading_rad: self.heading_rad,
            speed_m_s: self.speed_m_s,
            turn_rate_rad_s: self.turn_rate_rad_s,
            uav: self.uav,
            mode: self.mode,
            obstacle_count: self.obstacle_count,
            obstacles_omitted: self.obstacles_omitted,
            position_age_ticks: self.position_age_ticks,
            heading_age_ticks: self.heading_age_ticks,
        }
    }

    /// Passes on the bytes that a hash of the flight covers, in order.
    pub fn for_hashed_bytes(&self, mut update: impl FnMut(&[u8])) {
        // `obstacles` and the ages have to stay the last fields: the hash would miss one that follows them.
        update(&bytemuck::bytes_of(self)[..std::mem::offset_of!(Self, obstacles)]);
        // One by one, because each obstacle decides how many of its bytes count.
        self.obstacles.iter().for_each(|obstacle| update(obstacle.hashed_bytes()));
        // Flights with perfect sensors keep the hashes that they had before sensors had ages.
        let ages = [self.position_age_ticks, self.heading_age_ticks];
        if ages != [0; 2] {
            update(bytemuck::bytes_of(&ages));
        }
    }

    /// The obstacles in range, nearest first.
    pub fn obstacles(&self) -> &[SensedObstacle] {
        // The count comes from shared memory and may be any number.
        &self.obstacles[..(self.obstacle_count as usize).min(MAX_SENSED_OBSTACLES)]
    }
}
