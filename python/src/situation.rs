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
    #[pyo3(get)]
    tick: i64,
    #[pyo3(get)]
    age_s: f64,
    #[pyo3(get)]
    speed_m_s: f64,
    #[pyo3(get)]
    turn_rate_rad_s: f64,
}

#[pymethods]
impl Track {
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.pose.position.into())
    }

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
    uav: u32,
    rest_m: f64,
    track: Option<Track>,
}

/// The leader, as heard and as predicted to this tick.
#[pyclass(frozen, module = "ringwing")]
#[derive(Debug, Clone)]
pub(crate) struct Leader {
    pose: Pose,
    #[pyo3(get)]
    track: Track,
    #[pyo3(get)]
    is_silent: bool,
}

#[pymethods]
impl Leader {
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.pose.position.into())
    }

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
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.position_m)
    }

    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.velocity_m_s)
    }

    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.radius_m
    }

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
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.0.position_m)
    }

    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading_rad
    }

    #[getter]
    fn speed_m_s(&self) -> f64 {
        self.0.speed_m_s
    }

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
    #[pyo3(get)]
    tick: i64,
    #[pyo3(get)]
    time_s: f64,
    #[pyo3(get)]
    period_s: f64,
    #[pyo3(get)]
    uav: u32,
    #[pyo3(get)]
    speed_m_s: f64,
    #[pyo3(get)]
    turn_rate_rad_s: f64,
    #[pyo3(get)]
    senses_age_s: f64,
    #[pyo3(get)]
    previous: Option<Neighbour>,
    #[pyo3(get)]
    next: Option<Neighbour>,
    #[pyo3(get)]
    leader: Option<Leader>,
    #[pyo3(get)]
    slot_turn_rate_rad_s: Option<f64>,
    #[pyo3(get)]
    radius_m: f64,
    #[pyo3(get)]
    obstacles: Vec<Obstacle>,
    #[pyo3(get)]
    aircraft: Vec<Aircraft>,
    #[pyo3(get)]
    living: u32,
    #[pyo3(get)]
    lost: Vec<u32>,
    #[pyo3(get)]
    slots_are_moving: bool,
    #[pyo3(get)]
    speed_min_m_s: f64,
    #[pyo3(get)]
    speed_max_m_s: f64,
    #[pyo3(get)]
    turn_rate_max_rad_s: f64,
}

#[pymethods]
impl Situation {
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.own.position.into())
    }

    #[getter]
    fn heading_rad(&self) -> f64 {
        self.own.heading_rad
    }

    #[getter]
    fn slot_m<'py>(&self, py: Python<'py>) -> Option<Array<'py>> {
        self.slot_m.map(|slot_m| array(py, slot_m))
    }

    #[getter]
    fn slot_offset_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.slot_offset_m)
    }

    #[getter]
    fn slot_velocity_m_s<'py>(&self, py: Python<'py>) -> Option<Array<'py>> {
        self.slot_velocity_m_s.map(|velocity_m_s| array(py, velocity_m_s))
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
