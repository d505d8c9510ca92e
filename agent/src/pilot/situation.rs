//! Everything that whatever steers a UAV is told in one tick.
//!
//! Never holds more than the UAV itself knows.

use super::{
    leader_estimate::EstimatedLeader,
    slot_motion::SlotMotion,
    track::{PeerTrack, age},
};
use crate::law::{ControlInput, Limits};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{
    Account, Avoided, FormationFrame, Pose, Sensed, SensedAircraft, SensedObstacle, Tick, Traffic, UavId,
};

/// Everything that a controller is told in one tick. Positions and headings are in the local frame: x to the east, y to the
/// north, metres; headings count from the x axis, counterclockwise, in (-pi, pi].
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The tick to decide for. Tick 0 begins the flight, and tick -1 is the approach to the start states.
    pub tick: Tick,
    /// Length of a tick, seconds.
    pub period_s: f64,
    /// The UAV that flies.
    pub uav: UavId,
    /// What the airframe can do, Eq. (2). A wish beyond these limits is cut to them.
    pub limits: Limits,
    /// Where the UAV believes that it is: as sensed, or as estimated from all sensors with `control.pose_estimated`, and predicted to this
    /// tick if the scenario's dead reckoning is `"full"`.
    pub own: Pose,
    /// What the UAV's sensors said last, with all their errors. Its tick is this one, unless a fault delays or loses senses.
    pub sensed: &'a Sensed,
    /// The previous and the next living UAV in the ring. In a ring of two, only one of them is there.
    pub neighbours: [Option<RingNeighbour<'a>>; 2],
    /// The leader, which is the centre of the formation; `None` before anything was heard of it.
    pub leader: Option<EstimatedLeader>,
    /// The UAV's estimate of the wind, m/s: zero unless it is told the wind or estimates it. Speeds and headings of UAVs are
    /// through the air; velocities of the leader and of slots are over the ground.
    pub wind_m_s: Vector2<f64>,
    /// Whether the leader has been silent for longer than `membership.loss_timeout_s`.
    pub leader_is_silent: bool,
    /// From the leader to this UAV's slot, metres. It turns with the leader if the formation does.
    pub slot_offset_m: Vector2<f64>,
    /// R: the distance from the centre to the slot, metres.
    pub radius_m: f64,
    /// Whether the formation keeps its orientation or turns with the leader.
    pub frame: FormationFrame,
    /// The other aircraft that are sensed; `None` without `control.collision_filter`, because then nobody reports them.
    pub traffic: Option<&'a Traffic>,
    /// Who takes part in the ring.
    pub membership: Membership<'a>,
}

/// A living ring neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingNeighbour<'a> {
    /// Who it is.
    pub uav: UavId,
    /// L: the distance between its slot and this UAV's slot, metres.
    pub rest_m: f64,
    /// Where it was when it sent the newest state that arrived, and how it flew; `None` before any arrived.
    pub track: Option<&'a PeerTrack>,
}

/// Which UAVs the agent believes to be alive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membership<'a> {
    /// How many UAVs are alive, this one included.
    pub living: u32,
    /// The UAVs that are lost, in order of their numbers. Always empty if the scenario's ring does not close after a loss.
    pub lost: &'a [UavId],
    /// Fingerprint of `lost`: 0 if it is empty, and equal where two UAVs agree.
    pub lost_fingerprint: u64,
    /// Whether the slots are moving to their new places after a loss or a return.
    pub slots_are_moving: bool,
}

impl Situation<'_> {
    /// Simulated time since the flight began, seconds.
    pub fn time_s(&self) -> f64 {
        self.tick.0 as f64 * self.period_s
    }

    /// How long ago something of `tick` was, seconds.
    pub fn age_s(&self, tick: Tick) -> f64 {
        self.tick.since(tick) as f64 * self.period_s
    }

    /// The place of the UAV's slot; `None` before anything was heard of the leader.
    pub fn slot_m(&self) -> Option<Point2<f64>> {
        self.leader.map(|leader| leader.pose.position + self.slot_offset_m)
    }

    /// How the slot moves over the ground while the leader flies on as now; `None` before anything was heard of the leader.
    pub fn slot_motion(&self) -> Option<SlotMotion> {
        self.leader.map(|leader| SlotMotion::turning(&leader, self.frame, self.slot_offset_m))
    }

    /// The obstacles in range, the nearest first.
    pub fn obstacles(&self) -> &[SensedObstacle] {
        self.sensed.obstacles()
    }

    /// The other aircraft in range, the nearest first; none without `control.collision_filter`.
    pub fn aircraft(&self) -> &[SensedAircraft] {
        self.traffic.map_or(&[], Traffic::aircraft)
    }

    /// The newest track of the previous (0) or the next (1) neighbour.
    pub(super) fn track(&self, place: usize) -> Option<&PeerTrack> {
        self.neighbours[place].and_then(|neighbour| neighbour.track)
    }

    /// The account of `control`, without any term of a law.
    pub(crate) fn account(&self, control: ControlInput) -> Account {
        let leader = self.leader.map(|leader| leader.track);
        Account {
            tick: self.tick,
            speed_m_s: control.speed_m_s,
            turn_rate_rad_s: control.turn_rate_rad_s,
            wish_speed_m_s: control.speed_m_s,
            wish_turn_rate_rad_s: control.turn_rate_rad_s,
            avoided_m: [0.0; 2],
            avoided_turn_rad: 0.0,
            avoided: Avoided::NOTHING,
            uav: self.uav,
            slot_m: self.slot_m().map_or([0.0; 2], Into::into),
            previous_force_m: [0.0; 2],
            next_force_m: [0.0; 2],
            centre_force_m: [0.0; 2],
            slot_force_m: [0.0; 2],
            repulsion_m: [0.0; 2],
            wind_m_s: self.wind_m_s.into(),
            estimate_m: self.own.position.into(),
            estimate_heading_rad: self.own.heading_rad,
            potential_m2: 0.0,
            previous_age: age(self.track(0), self.tick),
            next_age: age(self.track(1), self.tick),
            leader_age: age(leader.as_ref(), self.tick),
            speed_saturated: 0,
            turn_rate_saturated: 0,
            living: self.membership.living,
            leader_silent: u16::from(self.leader_is_silent),
            slots_moving: u16::from(self.membership.slots_are_moving),
            lost_fingerprint: self.membership.lost_fingerprint,
        }
    }
}
