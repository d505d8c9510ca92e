//! What C programs see of a tick: plain structs, whose documentation goes into the header.
//!
//! Never holds a value that C could not hold: no `Option`, no reference, and no `enum`.

use std::ffi::{c_char, c_void};

/// A place or a displacement in the local frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingVector {
    /// To the east.
    pub x: f64,
    /// To the north.
    pub y: f64,
}

/// Where an aircraft is, and where it heads.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingPose {
    /// Position in the local frame.
    pub position_m: RingwingVector,
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
}

/// Where an aircraft was at one tick, and how it flew on from there.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingTrack {
    /// The tick.
    pub tick: i64,
    /// How long ago that was.
    pub age_s: f64,
    /// Where it was then.
    pub pose: RingwingPose,
    /// Its speed along the heading.
    pub speed_m_s: f64,
    /// The rate of its heading.
    pub turn_rate_rad_s: f64,
}

/// A living ring neighbour.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingNeighbour {
    /// The newest state of it that arrived; zero before any arrived.
    pub track: RingwingTrack,
    /// L: the distance between its slot and this UAV's slot.
    pub rest_m: f64,
    /// Its number, from 1; 0 if there is no such neighbour, as in a ring of two.
    pub uav: u32,
    /// Whether any state of it arrived. Without one, use nothing but its number and its distance.
    pub is_heard: bool,
}

/// The leader, which is the centre of the formation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingLeader {
    /// The newest state of it that arrived.
    pub track: RingwingTrack,
    /// Where it is now, predicted as the scenario allows.
    pub pose: RingwingPose,
    /// The heading that a formation in the leader's frame turns with: that of the pose, but without its jumps.
    pub frame_rad: f64,
    /// Whether anything was heard of it. Before that, its track and pose, and the slot's position and motion, are zero.
    pub is_heard: bool,
    /// Whether it has been silent for longer than `membership.loss_timeout_s`.
    pub is_silent: bool,
}

/// The place of this UAV in the formation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingSlot {
    /// Its place; zero before anything was heard of the leader.
    pub position_m: RingwingVector,
    /// Its velocity while the leader flies on as now.
    pub velocity_m_s: RingwingVector,
    /// The rate at which that velocity turns.
    pub turn_rate_rad_s: f64,
    /// From the leader to the slot.
    pub offset_m: RingwingVector,
    /// R: the distance from the leader to the slot.
    pub radius_m: f64,
}

/// What the airframe can do. A wish beyond these limits is cut to them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingLimits {
    /// The lowest speed.
    pub speed_min_m_s: f64,
    /// The highest speed.
    pub speed_max_m_s: f64,
    /// The highest turn rate, to either side.
    pub turn_rate_max_rad_s: f64,
}

/// An obstacle in range of the UAV's sensors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingObstacle {
    /// Its centre.
    pub position_m: RingwingVector,
    /// Its velocity; zero for an obstacle that stands.
    pub velocity_m_s: RingwingVector,
    /// Its radius.
    pub radius_m: f64,
    /// The distance from its centre at which the paper's law begins to avoid it.
    pub braking_distance_m: f64,
}

/// Another aircraft in range of the UAV's sensors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingAircraft {
    /// Where it is.
    pub pose: RingwingPose,
    /// Its speed along the heading.
    pub speed_m_s: f64,
    /// The rate of its heading. Zero for an intruder, and for a UAV that its agent flies.
    pub turn_rate_rad_s: f64,
    /// The number of the UAV or of the intruder, from 1.
    pub number: u32,
    /// Whether it is an intruder and not a UAV of the swarm.
    pub is_intruder: bool,
    /// Whether an agent flies it.
    pub is_answering: bool,
}

/// Which UAVs this one believes to be alive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct RingwingMembership {
    /// The numbers of the lost UAVs, ascending. Always empty if the scenario's ring does not close after a loss.
    pub lost: *const u32,
    /// How many are lost.
    pub lost_count: usize,
    /// Fingerprint of `lost`: 0 if it is empty, and equal where two UAVs agree.
    pub lost_fingerprint: u64,
    /// How many UAVs are alive, this one included.
    pub living: u32,
    /// Whether the slots are moving to their new places after a loss or a return.
    pub slots_are_moving: bool,
}

/// Everything that a controller is told in one tick. It and what it points to are valid until the callback returns.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct RingwingSituation {
    /// The size of this struct in the library. Fields beyond it are not there.
    pub size_bytes: usize,
    /// The tick to decide for. Tick 0 begins the flight, and tick -1 is the approach to the start states.
    pub tick: i64,
    /// Simulated time since the flight began.
    pub time_s: f64,
    /// The length of a tick.
    pub period_s: f64,
    /// Where the UAV believes that it is: as sensed, or as estimated from all sensors, and predicted to this tick if the scenario's dead
    /// reckoning is "full".
    pub own: RingwingPose,
    /// What the UAV's sensors said last of itself, with all their errors. Its age is 0, unless a fault delays or loses senses.
    pub sensed: RingwingTrack,
    /// What the airframe can do.
    pub limits: RingwingLimits,
    /// The previous and the next living UAV in the ring.
    pub neighbours: [RingwingNeighbour; 2],
    /// The leader.
    pub leader: RingwingLeader,
    /// The UAV's estimate of the wind: zero unless it is told the wind or estimates it. Speeds and headings of UAVs are
    /// through the air; velocities of the leader and of slots are over the ground.
    pub wind_m_s: RingwingVector,
    /// The UAV's place in the formation.
    pub slot: RingwingSlot,
    /// Who takes part in the ring.
    pub membership: RingwingMembership,
    /// The obstacles in range, the nearest first.
    pub obstacles: *const RingwingObstacle,
    /// How many obstacles there are.
    pub obstacle_count: usize,
    /// The other aircraft in range, the nearest first; none without `control.collision_filter`.
    pub aircraft: *const RingwingAircraft,
    /// How many aircraft there are.
    pub aircraft_count: usize,
    /// How many more obstacles are in range; the farthest are left out.
    pub obstacles_omitted: u32,
    /// How many more aircraft are in range; the farthest are left out.
    pub aircraft_omitted: u32,
    /// The number of the UAV that flies, from 1.
    pub uav: u32,
    /// Whether the formation turns with the leader.
    pub formation_turns: bool,
    /// Whether anybody reports other aircraft.
    pub senses_aircraft: bool,
    /// Whether the airframe flies what its agent commands; false while it is in its failsafe.
    pub is_commanded: bool,
}

/// What a controller wants its UAV to fly until the next tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct RingwingWish {
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading, counterclockwise.
    pub turn_rate_rad_s: f64,
}

/// What a controller may know before the flight. It and what it points to are valid until the callback returns.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct RingwingStart {
    /// The size of this struct in the library. Fields beyond it are not there.
    pub size_bytes: usize,
    /// The program's own arguments, without its name and without those that ringwing adds.
    pub arguments: *const *mut c_char,
    /// How many arguments of its own the program has.
    pub argument_count: usize,
    /// The whole scenario as TOML, in UTF-8.
    pub scenario_toml: *const c_char,
    /// What all random draws of the flight come from.
    pub seed: u64,
    /// The length of a tick.
    pub period_s: f64,
    /// The number of the UAV that the program will fly, from 1.
    pub uav: u32,
    /// How many UAVs the swarm has.
    pub uavs: u32,
}

/// The functions of a controller. `user` is what was passed to `ringwing_controller_main`; nothing but these functions uses it. All calls
/// come from the thread that called `ringwing_controller_main`.
///
/// In C++, declare the functions noexcept: an exception that leaves one then ends the program with its message. Otherwise
/// it ends the program without it. A program that cannot fly may also call exit.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct RingwingCallbacks {
    /// sizeof(RingwingCallbacks), in the header that the program is built with.
    pub size_bytes: usize,
    /// Called once, before the flight; may be NULL.
    pub start: Option<unsafe extern "C-unwind" fn(user: *mut c_void, start: *const RingwingStart)>,
    /// Decides for one tick. Called once a tick, in order of ticks, except for ticks in which the UAV does not know where it
    /// is, and those that it missed because its process was frozen.
    pub step: Option<
        unsafe extern "C-unwind" fn(user: *mut c_void, situation: *const RingwingSituation) -> RingwingWish,
    >,
}

/// Checks the size of each struct in bytes: programs that are already built depend on it.
///
/// A struct that grows gets its new field behind its old size, and never in the padding at its end: `size_bytes` could not tell
/// such a field from one that is not there.
macro_rules! sizes {
    ($($name:ty: $bytes:literal;)*) => {$(
        #[cfg(target_pointer_width = "64")]
        const _: () = assert!(size_of::<$name>() == $bytes);
    )*};
}

sizes! {
    RingwingVector: 16;
    RingwingPose: 24;
    RingwingTrack: 56;
    RingwingNeighbour: 72;
    RingwingLeader: 96;
    RingwingSlot: 64;
    RingwingLimits: 24;
    RingwingObstacle: 48;
    RingwingAircraft: 48;
    RingwingMembership: 32;
    RingwingSituation: 536;
    RingwingWish: 16;
    RingwingStart: 56;
    RingwingCallbacks: 24;
}
