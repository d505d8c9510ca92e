//! The scenario's data. Lengths in metres, speeds in m/s, angles in degrees and rates in rad/s, as the names say.

use crate::{Fault, Schedule};
use ringwing_flight::{Formation, LivingRing, OnLoss, Pace};
use serde::{Deserialize, Serialize};

/// Everything a run is flown by; with the same build, it gives the same flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scenario {
    /// Name of the run's folder and of the log.
    pub name: String,
    /// One line for `scenario list`.
    pub description: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// How long and how fine.
    pub time: Time,
    /// The ring to form.
    pub formation: FormationSection,
    /// The law the agents fly by.
    pub control: Control,
    /// What the swarm does when one of it is lost.
    pub membership: Membership,
    /// The virtual leader.
    pub leader: Leader,
    /// What each airframe can do.
    pub airframe: Airframe,
    /// Where on the earth it flies.
    pub georeference: Georeference,
    /// What each UAV can sense.
    pub sensing: Sensing,
    /// How long the run waits for a process.
    pub supervision: Supervision,
    /// How its processes talk to each other.
    pub ipc: Ipc,
    /// What the flight must achieve; a run that does not ends with exit code 3.
    pub requirements: Requirements,
    /// Where the UAVs begin.
    pub start: Start,
    /// What stands in the way.
    pub obstacles: Vec<Obstacle>,
    /// What is done to processes and links on purpose.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

/// How long and how fine the flight is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Time {
    /// Simulated length of the flight.
    pub duration_s: f64,
    /// Control ticks a second.
    pub rate_hz: u32,
    /// Keep to the wall clock instead of flying as fast as the machine allows.
    pub real_time: bool,
}

/// The standard formation, Definition 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FormationSection {
    /// n.
    pub uavs: u32,
    /// L.
    pub spacing_m: f64,
    /// alpha: bearing of UAV 1's slot seen from the centre; the others follow clockwise.
    pub bearing_deg: f64,
}

/// The control law of every agent.
///
/// The law sets the switches of the resilient law's parts that are not set themselves: see [`Law::switches`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(clippy::struct_excessive_bools, reason = "each part of the law is a switch of its own")]
pub struct Control {
    /// Which law.
    pub law: Law,
    /// How far old data of neighbours, leader and own senses are predicted forward.
    pub dead_reckoning: DeadReckoning,
    /// A neighbour's G fades with the age of what was heard of it: times `exp(-age / trust_time_s)`.
    pub trust_fades: bool,
    /// How long it takes to fade to 37 %.
    pub trust_time_s: f64,
    /// G fades far from the slot: times `exp(-(slot error / (gain_reach_spacings L))^2)`.
    pub gain_fades: bool,
    /// How far G reaches, in L.
    pub gain_reach_spacings: f64,
    /// The formation's force is no larger than the leader's speed: who is ahead of its slot waits, and never turns back.
    pub force_limited: bool,
    /// The living close the ring after a loss, and open it on a return.
    pub ring_closes: bool,
    /// G of Eq. (3).
    pub formation_gain: f64,
    /// Gain of Eq. (3)'s last term; 1 in the paper.
    pub slot_gain: f64,
    /// k of Eq. (13).
    pub obstacle_gain_m: f64,
    /// What turns the force across the heading into a turn rate; 1 in the paper, by its units.
    pub heading_gain_rad_per_m: f64,
}

/// Which law the agents fly by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Equations (4) to (13), as written.
    Paper,
    /// The same, with everything that keeps the swarm together when UAVs or data are lost or late.
    Resilient,
}

/// Which parts of the resilient law are in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each part of the law is a switch of its own")]
pub struct Switches {
    /// See [`Control::dead_reckoning`].
    pub dead_reckoning: DeadReckoning,
    /// See [`Control::trust_fades`].
    pub trust_fades: bool,
    /// See [`Control::gain_fades`].
    pub gain_fades: bool,
    /// See [`Control::force_limited`].
    pub force_limited: bool,
    /// See [`Control::ring_closes`].
    pub ring_closes: bool,
}

/// What the swarm does when one of it is lost; of no effect while `control.ring_closes` is off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Membership {
    /// A ring neighbour from which nothing new came for so long is lost, unless it is heard of another way.
    pub loss_timeout_s: f64,
    /// Which slots the living take.
    pub on_loss: OnLoss,
    /// How long slots take to move to their new places.
    pub slots_move_s: f64,
}

/// How far old data are predicted forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeadReckoning {
    /// Not at all: used as they came.
    Off,
    /// By the one tick that processes cost.
    Tick,
    /// By their whole age.
    Full,
}

/// The virtual leader, which flies straight on (Assumption 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Leader {
    /// Where it is at time 0.
    pub start_m: [f64; 2],
    /// `theta_d`, from the x axis, counterclockwise.
    pub heading_deg: f64,
    /// `v_d`.
    pub speed_m_s: f64,
}

/// What each airframe can do, Eq. (2), and what it does without its agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Airframe {
    /// `v_min`.
    pub speed_min_m_s: f64,
    /// `v_max`.
    pub speed_max_m_s: f64,
    /// `omega_max`.
    pub turn_rate_max_rad_s: f64,
    /// How long it flies on the last command of a silent agent before its failsafe takes over.
    pub command_timeout_s: f64,
    /// What it does then.
    pub failsafe: Failsafe,
    /// Two UAVs closer than this have collided.
    pub collision_distance_m: f64,
}

/// What an airframe does once its agent has been silent for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failsafe {
    /// Circles at half its largest turn rate and its lowest speed.
    Loiter,
    /// Keeps heading and speed.
    Hold,
    /// Leaves the sky.
    Vanish,
}

/// Where on the earth the local frame's origin lies, for maps alone: nothing that flies depends on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Georeference {
    /// Of the origin, north positive.
    pub latitude_deg: f64,
    /// Of the origin, east positive.
    pub longitude_deg: f64,
    /// Above the WGS 84 ellipsoid, of everything that flies.
    pub altitude_m: f64,
}

/// What each UAV can sense.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensing {
    /// Obstacles whose edge is nearer than this are sensed.
    pub range_m: f64,
}

/// How long the run waits for a process, in wall-clock time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Supervision {
    /// For all processes to be ready at the start, and for a replaced one to be.
    pub start_timeout_s: f64,
    /// For a running process to answer a tick in lockstep; after that the flight goes on without it until it does.
    pub answer_timeout_s: f64,
    /// How often a lost leader or recorder is replaced.
    pub replacements: u32,
}

/// How the processes of the run talk to each other: what flies is the same, to the bit, whatever is chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ipc {
    /// How processes wait for a tick, and the world for its answers.
    pub wake: Wake,
    /// Bytes that go each way between the world and every agent in each tick beside the messages, for measurements.
    pub payload_bytes: u32,
    /// Fewer UAVs than make a ring may fly, for measurements: one in the centre, or two on either side of it.
    pub few_uavs: bool,
}

/// How processes wait for a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wake {
    /// At the gate: yields while that pays, then sleeps on a futex.
    Gate,
    /// At the gate, never sleeping.
    Spin,
    /// On events of the shared-memory bus.
    Event,
}

/// What the flight must achieve; what is left out is not required.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Requirements {
    /// At most this many collisions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collisions_max: Option<u32>,
    /// Every UAV stays at least this far from every obstacle's edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_min_m: Option<f64>,
    /// No two UAVs come closer than this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation_min_m: Option<f64>,
    /// The formation has settled by this time: every slot error within 1 m, and for 5 s on end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_max_s: Option<f64>,
    /// At the end no UAV is farther than this from its slot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot_error_max_m: Option<f64>,
}

/// Where the UAVs begin: at listed places, or drawn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Start {
    /// How to draw them; used when `uavs` is empty.
    pub draw: Draw,
    /// One entry for each UAV, or none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub uavs: Vec<StartState>,
}

/// A seeded draw of start states from a box round the leader, its sides given in formation radii.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Draw {
    /// The box's length along the leader's heading.
    pub length_radii: f64,
    /// Its width across.
    pub width_radii: f64,
    /// How far its middle lies ahead of the leader; negative is behind.
    pub ahead_radii: f64,
    /// No two UAVs begin closer than this.
    pub separation_m: f64,
    /// Headings deviate from the leader's by at most this.
    pub heading_spread_deg: f64,
}

/// Where one UAV begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartState {
    /// Position in the local frame (x east, y north).
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise.
    pub heading_deg: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
}

/// A circle that no UAV may enter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Name in tables and pictures.
    pub name: String,
    /// Centre in the local frame.
    pub position_m: [f64; 2],
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`: distance from the centre at which it begins to repel.
    pub braking_distance_m: f64,
}

impl Law {
    /// Its name in scenarios and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Resilient => "resilient",
        }
    }

    /// The switches of its parts, where the scenario does not set them.
    pub fn switches(self) -> Switches {
        let on = self == Self::Resilient;
        let dead_reckoning = if on { DeadReckoning::Full } else { DeadReckoning::Tick };
        Switches { dead_reckoning, trust_fades: on, gain_fades: on, force_limited: on, ring_closes: on }
    }
}

impl Scenario {
    /// The formation to form.
    pub fn formation(&self) -> Formation {
        let FormationSection { uavs, spacing_m, bearing_deg } = self.formation;
        Formation::new(uavs, spacing_m, bearing_deg.to_radians())
    }

    /// The ring of the living while all are alive.
    pub fn whole_ring(&self) -> LivingRing {
        LivingRing::whole(self.formation(), self.control.ring_closes.then_some(self.membership.on_loss))
    }

    /// Length of a tick in seconds.
    pub fn period_s(&self) -> f64 {
        1.0 / f64::from(self.time.rate_hz)
    }

    /// Its faults, tick by tick.
    pub fn schedule(&self) -> Schedule<'_> {
        self.schedule_of(&self.faults)
    }

    /// `faults`, tick by tick, as a run of this scenario meets them.
    pub fn schedule_of<'f>(&self, faults: &'f [Fault]) -> Schedule<'f> {
        Schedule { faults, seed: self.seed, rate_hz: self.time.rate_hz, uavs: self.formation.uavs }
    }

    /// Whether ticks wait for the processes or for the clock.
    pub fn pace(&self) -> Pace {
        if self.time.real_time { Pace::RealTime } else { Pace::Lockstep }
    }

    /// The number of the last tick.
    pub fn last_tick(&self) -> i64 {
        (self.time.duration_s * f64::from(self.time.rate_hz)).round() as i64
    }

    /// The scenario as TOML, every value in full: read back, it is the same to the last bit.
    ///
    /// # Panics
    /// Never: a scenario is nothing but tables, lists, numbers, texts and truth values, all of which TOML has.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scenario is plain data")
    }
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "unnamed".into(),
            description: String::new(),
            seed: 1,
            time: Time::default(),
            formation: FormationSection::default(),
            control: Control::default(),
            membership: Membership::default(),
            leader: Leader::default(),
            airframe: Airframe::default(),
            georeference: Georeference::default(),
            sensing: Sensing::default(),
            supervision: Supervision::default(),
            ipc: Ipc::default(),
            requirements: Requirements::default(),
            start: Start::default(),
            obstacles: Vec::new(),
            faults: Vec::new(),
        }
    }
}

impl Default for Time {
    fn default() -> Self {
        Self { duration_s: 90.0, rate_hz: 100, real_time: false }
    }
}

impl Default for FormationSection {
    fn default() -> Self {
        Self { uavs: 6, spacing_m: 40.0, bearing_deg: 180.0 }
    }
}

impl Default for Control {
    fn default() -> Self {
        let Switches { dead_reckoning, trust_fades, gain_fades, force_limited, ring_closes } =
            Law::Paper.switches();
        Self {
            law: Law::Paper,
            dead_reckoning,
            trust_fades,
            trust_time_s: 0.5,
            gain_fades,
            gain_reach_spacings: 0.5,
            force_limited,
            ring_closes,
            formation_gain: 2.0,
            slot_gain: 1.0,
            obstacle_gain_m: 100.0,
            heading_gain_rad_per_m: 1.0,
        }
    }
}

impl Default for Membership {
    fn default() -> Self {
        Self { loss_timeout_s: 1.0, on_loss: OnLoss::KeepSpacing, slots_move_s: 5.0 }
    }
}

impl Default for Leader {
    fn default() -> Self {
        Self { start_m: [0.0, 0.0], heading_deg: 0.0, speed_m_s: 15.0 }
    }
}

impl Default for Airframe {
    fn default() -> Self {
        Self {
            speed_min_m_s: 12.0,
            speed_max_m_s: 25.0,
            turn_rate_max_rad_s: 0.5,
            command_timeout_s: 0.5,
            failsafe: Failsafe::Loiter,
            collision_distance_m: 2.0,
        }
    }
}

impl Default for Georeference {
    fn default() -> Self {
        Self { latitude_deg: 47.3977, longitude_deg: 8.5456, altitude_m: 500.0 }
    }
}

impl Default for Sensing {
    fn default() -> Self {
        Self { range_m: 150.0 }
    }
}

impl Default for Supervision {
    fn default() -> Self {
        Self { start_timeout_s: 10.0, answer_timeout_s: 2.0, replacements: 10 }
    }
}

impl Default for Ipc {
    fn default() -> Self {
        Self { wake: Wake::Gate, payload_bytes: 0, few_uavs: false }
    }
}

impl Default for Draw {
    fn default() -> Self {
        Self {
            length_radii: 3.0,
            width_radii: 2.0,
            ahead_radii: 0.0,
            separation_m: 10.0,
            heading_spread_deg: 28.6,
        }
    }
}
