//! What one UAV can do and sense, and where on the earth it flies.

use ringwing_flight::LoiterRates;
use serde::{Deserialize, Serialize};

/// `[airframe]`: the limits of Eq. (2), how fast an airframe does what it is told, and what it does without its agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AirframeSection {
    /// `v_min`.
    pub speed_min_m_s: f64,
    /// `v_max`.
    pub speed_max_m_s: f64,
    /// `omega_max`.
    pub turn_rate_max_rad_s: f64,
    /// Time constant with which the speed approaches the commanded one; 0 for none.
    pub speed_lag_s: f64,
    /// Largest change of the speed; 0 for no limit.
    pub acceleration_max_m_s2: f64,
    /// Time constant with which the turn rate approaches the commanded one; 0 for none.
    pub turn_lag_s: f64,
    /// Largest change of the turn rate; 0 for no limit.
    pub turn_acceleration_max_rad_s2: f64,
    /// How long an airframe flies on the last command of a silent agent before its failsafe takes over.
    pub command_timeout_s: f64,
    /// What the failsafe does.
    pub failsafe: Failsafe,
    /// Two UAVs closer than this have collided.
    pub collision_distance_m: f64,
    /// A UAV that passes another aircraft nearer than this and does not hit it has had a near miss; 0 for none.
    pub near_miss_distance_m: f64,
}

impl Default for AirframeSection {
    fn default() -> Self {
        Self {
            // The three limits of Section 4 of the paper.
            speed_min_m_s: 12.0,
            speed_max_m_s: 25.0,
            turn_rate_max_rad_s: 0.5,
            // The paper's airframes do at once what they are told.
            speed_lag_s: 0.0,
            acceleration_max_m_s2: 0.0,
            turn_lag_s: 0.0,
            turn_acceleration_max_rad_s2: 0.0,
            command_timeout_s: 0.5,
            failsafe: Failsafe::Loiter,
            collision_distance_m: 2.0,
            // Below the 10 m that the collision filter keeps. More reports passages that were meant, less hides close calls.
            near_miss_distance_m: 8.0,
        }
    }
}

impl AirframeSection {
    /// How fast an airframe flies that loiters without its agent.
    pub fn loiter_rates(&self) -> LoiterRates {
        LoiterRates {
            // Faster than the formation: otherwise the others overtake a UAV that was in front, on both sides of it.
            leaving_m_s: self.speed_max_m_s,
            circling_m_s: self.speed_min_m_s,
            turn_rate_rad_s: self.turn_rate_max_rad_s / 2.0,
        }
    }
}

/// What an airframe does once its agent has been silent for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failsafe {
    /// Circles at half its largest turn rate and its lowest speed. Under `control.ring_closes` it may first leave the formation at
    /// its highest speed, on the path that its agent has chosen beforehand.
    Loiter,
    /// Keeps its heading and speed.
    Hold,
    /// Leaves the sky.
    Vanish,
}

/// `[sensing]`: what each UAV can sense around itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensingSection {
    /// A UAV senses an obstacle whose edge is nearer than this.
    pub range_m: f64,
    /// A UAV senses another aircraft that is nearer than this, while its collision filter is on.
    pub traffic_range_m: f64,
    /// How late a report of other aircraft arrives.
    pub traffic_delay_s: f64,
    /// Share of these reports that is lost, from 0 to 1.
    pub traffic_loss: f64,
    /// Standard deviation of the error of each coordinate of another aircraft.
    pub traffic_noise_m: f64,
    /// Standard deviation of the error of its heading.
    pub traffic_noise_deg: f64,
    /// A UAV's radar sees an intruder that does not cooperate once it is nearer than this.
    pub radar_range_m: f64,
    /// Standard deviation of the error of each coordinate that the radar measures.
    pub radar_noise_m: f64,
    /// The radar takes speed and heading from where it saw an intruder now and this long ago.
    pub radar_track_s: f64,
}

impl Default for SensingSection {
    fn default() -> Self {
        Self {
            range_m: 150.0,
            traffic_range_m: 120.0,
            traffic_delay_s: 0.0,
            traffic_loss: 0.0,
            traffic_noise_m: 0.0,
            traffic_noise_deg: 0.0,
            radar_range_m: 120.0,
            radar_noise_m: 0.0,
            // Shorter, and noise makes the speed useless; longer, and a turn is noticed late.
            radar_track_s: 1.0,
        }
    }
}

/// `[georeference]`: the origin of the local frame on the earth, for maps. The flight does not depend on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GeoreferenceSection {
    /// Latitude of the origin, north positive.
    pub latitude_deg: f64,
    /// Longitude of the origin, east positive.
    pub longitude_deg: f64,
    /// Height of the whole flight above the WGS 84 ellipsoid.
    pub altitude_m: f64,
}

impl Default for GeoreferenceSection {
    fn default() -> Self {
        Self { latitude_deg: 47.3977, longitude_deg: 8.5456, altitude_m: 500.0 }
    }
}
