//! What a controller in Python is told, as Python objects.
//!
//! Never shares memory with the agent: a controller may keep what it was told for as long as it likes.

use numpy::PyArray1;
use pyo3::prelude::*;
use ringwing_controller::{
    Aircraft as Who, EstimatedLeader, PeerTrack, Pose, RingNeighbour, SensedAircraft, SensedObstacle,
    Situation as Told,
};

/// A vector or a place as an array of shape (2,).
type Array<'py> = Bound<'py, PyArray1<f64>>;

fn array(py: Python<'_>, [x, y]: [f64; 2]) -> Array<'_> {
    PyArray1::from_slice(py, &[x, y])
}

/// Where a UAV or the leader was, and how it flew.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone)]
pub(crate) struct Track {
    pose: Pose,
    /// The tick of the state.
    #[pyo3(get)]
    tick: i64,
    /// The age of this state. It is at least one tick, because a state takes one tick to arrive.
    #[pyo3(get)]
    age_s: f64,
    /// Its speed along the heading.
    #[pyo3(get)]
    speed_m_s: f64,
    /// The rate of its heading, counterclockwise.
    #[pyo3(get)]
    turn_rate_rad_s: f64,
}

#[pymethods]
impl Track {
    /// Where it was, an array of shape (2,): east and north.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.pose.position.into())
    }

    /// Where it headed, counterclockwise from the x axis.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.pose.heading_rad
    }

    /// Position and heading after `seconds` at constant speed and turn rate.
    fn after<'py>(&self, py: Python<'py>, seconds: f64) -> (Array<'py>, f64) {
        let pose = self.pose.after(self.speed_m_s, self.turn_rate_rad_s, seconds);
        (array(py, pose.position.into()), pose.heading_rad)
    }
}

impl Track {
    fn new(situation: &Told<'_>, track: &PeerTrack) -> Self {
        Self {
            pose: track.pose,
            tick: track.tick.0,
            age_s: situation.age_s(track.tick),
            speed_m_s: track.speed_m_s,
            turn_rate_rad_s: track.turn_rate_rad_s,
        }
    }
}

/// A living ring neighbour.
#[pyclass(frozen, module = "ringwing", get_all)]
#[derive(Debug, Clone)]
pub(crate) struct Neighbour {
    /// Its number, from 1.
    uav: u32,
    /// L: the distance between its slot and this UAV's slot.
    rest_m: f64,
    /// `None` before the first state of this neighbour has arrived.
    track: Option<Track>,
}

/// The leader, as heard and as predicted to this tick.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone)]
pub(crate) struct Leader {
    pose: Pose,
    /// The newest state of it that has arrived.
    #[pyo3(get)]
    track: Track,
    /// Whether no state of the leader has arrived for longer than `membership.loss_timeout_s`.
    #[pyo3(get)]
    is_silent: bool,
}

#[pymethods]
impl Leader {
    /// Where it is, an array of shape (2,): east and north.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.pose.position.into())
    }

    /// Where it heads, counterclockwise from the x axis.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.pose.heading_rad
    }
}

/// An obstacle in range.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone)]
pub(crate) struct Obstacle(SensedObstacle);

#[pymethods]
impl Obstacle {
    /// Its centre, an array of shape (2,): east and north.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.position_m)
    }

    /// Its velocity, an array of shape (2,); zero for an obstacle that stands.
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.velocity_m_s)
    }

    /// Its radius.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.radius_m
    }

    /// The obstacle repels within this distance from its centre.
    #[getter]
    fn braking_distance_m(&self) -> f64 {
        self.0.braking_distance_m
    }
}

/// Another aircraft in range.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone)]
pub(crate) struct Aircraft(SensedAircraft);

#[pymethods]
impl Aircraft {
    /// Where it is, an array of shape (2,): east and north.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.position_m)
    }

    /// Where it heads, counterclockwise from the x axis.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading_rad
    }

    /// Its speed along the heading.
    #[getter]
    fn speed_m_s(&self) -> f64 {
        self.0.speed_m_s
    }

    /// The rate of its heading, counterclockwise.
    #[getter]
    fn turn_rate_rad_s(&self) -> f64 {
        self.0.turn_rate_rad_s
    }

    /// The number of the UAV; `None` for an intruder.
    #[getter]
    fn uav(&self) -> Option<u32> {
        match self.0.who.who() {
            Who::Uav(uav) => Some(uav.0),
            Who::Intruder(_) => None,
        }
    }
}

/// Everything that a controller is told in one tick.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug)]
pub(crate) struct Situation {
    own: Pose,
    slot_m: Option<[f64; 2]>,
    slot_offset_m: [f64; 2],
    slot_velocity_m_s: Option<[f64; 2]>,
    wind_m_s: [f64; 2],
    /// The number of the tick. The flight begins with tick 0; tick -1 is the approach to the start states.
    #[pyo3(get)]
    tick: i64,
    /// Simulated time since the flight began.
    #[pyo3(get)]
    time_s: f64,
    /// The length of a tick.
    #[pyo3(get)]
    period_s: f64,
    /// The number of the UAV, from 1.
    #[pyo3(get)]
    uav: u32,
    /// Its speed along the heading.
    #[pyo3(get)]
    speed_m_s: f64,
    /// The rate of its heading, counterclockwise.
    #[pyo3(get)]
    turn_rate_rad_s: f64,
    /// The age of what the UAV sensed last of itself; 0 unless a fault delays or loses it.
    #[pyo3(get)]
    senses_age_s: f64,
    /// The previous living UAV in the ring.
    #[pyo3(get)]
    previous: Option<Neighbour>,
    /// The next living UAV in the ring; `None` if it is the same as `previous`.
    #[pyo3(get)]
    next: Option<Neighbour>,
    /// `None` before the first state of the leader has arrived.
    #[pyo3(get)]
    leader: Option<Leader>,
    /// The rate at which that velocity turns.
    #[pyo3(get)]
    slot_turn_rate_rad_s: Option<f64>,
    /// R: the distance from the leader to the slot.
    #[pyo3(get)]
    radius_m: f64,
    /// The obstacles in range, the nearest first.
    #[pyo3(get)]
    obstacles: Vec<Obstacle>,
    /// The other aircraft in range, the nearest first; empty unless `control.collision_filter` is on.
    #[pyo3(get)]
    aircraft: Vec<Aircraft>,
    /// The number of living UAVs, including this one.
    #[pyo3(get)]
    living: u32,
    /// The numbers of the UAVs that are lost.
    #[pyo3(get)]
    lost: Vec<u32>,
    /// Whether the slots are moving to new places after a loss or a return.
    #[pyo3(get)]
    slots_are_moving: bool,
    /// The lowest speed of the airframe.
    #[pyo3(get)]
    speed_min_m_s: f64,
    /// The highest speed of the airframe.
    #[pyo3(get)]
    speed_max_m_s: f64,
    /// The highest turn rate of the airframe, to either side.
    #[pyo3(get)]
    turn_rate_max_rad_s: f64,
}

#[pymethods]
impl Situation {
    /// The position of the UAV: as sensed, or as its agent estimates it from all sensors.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.own.position.into())
    }

    /// Where it heads, counterclockwise from the x axis.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.own.heading_rad
    }

    /// The position of the UAV's slot; `None` as long as `leader` is `None`.
    #[getter]
    fn slot_m<'py>(&self, py: Python<'py>) -> Option<Array<'py>> {
        self.slot_m.map(|slot_m| array(py, slot_m))
    }

    /// The vector from the leader to the slot.
    #[getter]
    fn slot_offset_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.slot_offset_m)
    }

    /// The velocity of the slot, an array of shape (2,); `None` without a leader.
    #[getter]
    fn slot_velocity_m_s<'py>(&self, py: Python<'py>) -> Option<Array<'py>> {
        self.slot_velocity_m_s.map(|velocity_m_s| array(py, velocity_m_s))
    }

    /// The UAV's estimate of the wind, an array of shape (2,): zero unless it is told the wind or estimates it. Speeds and
    /// headings of UAVs are through the air; velocities of the leader and of slots are over the ground.
    #[getter]
    fn wind_m_s<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.wind_m_s)
    }

    fn __repr__(&self) -> String {
        format!("<Situation of UAV {} at {:.2} s>", self.uav, self.time_s)
    }
}

impl Situation {
    /// That of an agent, copied.
    pub(crate) fn new(situation: &Told<'_>) -> Self {
        let neighbour = |neighbour: RingNeighbour<'_>| Neighbour {
            uav: neighbour.uav.0,
            rest_m: neighbour.rest_m,
            track: neighbour.track.map(|track| Track::new(situation, track)),
        };
        let leader = |leader: EstimatedLeader| Leader {
            pose: leader.pose,
            track: Track::new(situation, &leader.track),
            is_silent: situation.leader_is_silent,
        };
        let (motion, limits, members) = (situation.slot_motion(), situation.limits, situation.membership);
        Self {
            own: situation.own,
            slot_m: situation.slot_m().map(Into::into),
            slot_offset_m: situation.slot_offset_m.into(),
            slot_velocity_m_s: motion.map(|motion| motion.velocity_m_s.into()),
            wind_m_s: situation.wind_m_s.into(),
            slot_turn_rate_rad_s: motion.map(|motion| motion.turn_rate_rad_s),
            tick: situation.tick.0,
            time_s: situation.time_s(),
            period_s: situation.period_s,
            uav: situation.uav.0,
            speed_m_s: situation.sensed.speed_m_s,
            turn_rate_rad_s: situation.sensed.turn_rate_rad_s,
            senses_age_s: situation.age_s(situation.sensed.tick),
            previous: situation.neighbours[0].map(neighbour),
            next: situation.neighbours[1].map(neighbour),
            leader: situation.leader.map(leader),
            radius_m: situation.radius_m,
            obstacles: situation.obstacles().iter().copied().map(Obstacle).collect(),
            aircraft: situation.aircraft().iter().copied().map(Aircraft).collect(),
            living: members.living,
            lost: members.lost.iter().map(|uav| uav.0).collect(),
            slots_are_moving: members.slots_are_moving,
            speed_min_m_s: limits.speed_min_m_s(),
            speed_max_m_s: limits.speed_max_m_s(),
            turn_rate_max_rad_s: limits.turn_rate_max_rad_s(),
        }
    }
}
