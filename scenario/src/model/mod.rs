//! The data of a scenario: one struct per section of the file, with its defaults.
//!
//! Lengths are in metres, speeds in m/s, angles in degrees and turn rates in rad/s; every name ends in its unit. The
//! local frame has x to the east and y to the north; angles count from the x axis, counterclockwise.
//!
//! Never checks a value: `validate` does.

mod agents;
mod airframe;
mod control;
mod leader_path;
mod manoeuvre;
mod mission;
mod process;
mod sensors;
mod start;
mod surroundings;
mod wind;

pub use agents::AgentSection;
pub(crate) use agents::NamedUavs;
pub use airframe::{AirframeSection, Failsafe, GeoreferenceSection, SensingSection};
pub use control::{ControlSection, DeadReckoning, Law, LawSwitches, MembershipSection, SafetySection};
pub use leader_path::LeaderStart;
pub use manoeuvre::{ManoeuvreSection, SlotOrder};
pub use mission::{
    Assignment, FormationSection, LeaderSection, OffsetSection, PathKind, PathSection, RequirementsSection,
    ShapeName, TimeSection, WaypointSection,
};
pub use process::{IpcSection, SupervisionSection, Wake};
pub use sensors::SensorsSection;
pub use start::{DrawSection, StartSection, StartState};
pub use surroundings::{IntruderSection, ObstacleFieldSection, ObstacleSection};
pub use wind::WindSection;

use crate::{Fault, FaultSchedule, assignment};
use ringwing_flight::{Formation, LivingRing, Manoeuvre, Pace, RingOrder, Tick, UavId};
use serde::{Deserialize, Serialize};
use std::{iter, time::Duration};

/// Seconds that each UAV adds to the time in which a process must be ready: twice what a process needs to start on a slow
/// core. More lets a stuck process of a large swarm delay the flight for longer; less gives up processes that still
/// wait for their turn.
const START_SHARE_S: f64 = 0.02;
/// Seconds that each UAV adds to the time in which a process must answer: ten times what a first tick takes on a slow core.
/// More lets a stuck process of a large swarm hold the flight for longer; less gives up processes that wait for their turn.
const ANSWER_SHARE_S: f64 = 0.005;

/// Everything that decides a flight: the same scenario and build give the same flight, to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scenario {
    /// Name of the run's folder and of the log.
    pub name: String,
    /// One line for `scenario list`.
    pub description: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// Length and time step of the flight.
    pub time: TimeSection,
    /// The formation to form.
    pub formation: FormationSection,
    /// The control law of the agents.
    pub control: ControlSection,
    /// What the swarm does when it loses a UAV.
    pub membership: MembershipSection,
    /// How the collision filter keeps UAVs clear of each other and of obstacles.
    pub safety: SafetySection,
    /// The virtual leader.
    pub leader: LeaderSection,
    /// What each airframe can do.
    pub airframe: AirframeSection,
    /// Where on the earth the swarm flies.
    pub georeference: GeoreferenceSection,
    /// What each UAV can sense around itself.
    pub sensing: SensingSection,
    /// How well each UAV senses its own flight.
    pub sensors: SensorsSection,
    /// The air that the swarm flies in.
    pub wind: WindSection,
    /// How long the run waits for a process.
    pub supervision: SupervisionSection,
    /// How processes exchange messages.
    pub ipc: IpcSection,
    /// What the flight must achieve; otherwise the run ends with exit code 3.
    pub requirements: RequirementsSection,
    /// Where the UAVs start.
    pub start: StartSection,
    /// Obstacles that the seed draws.
    #[serde(skip_serializing_if = "ObstacleFieldSection::is_empty")]
    pub obstacle_field: ObstacleFieldSection,
    /// The listed obstacles; [`Scenario::all_obstacles`] adds those that are drawn.
    pub obstacles: Vec<ObstacleSection>,
    /// The aircraft that nobody controls.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub intruders: Vec<IntruderSection>,
    /// The planned changes of the formation, in order of time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub manoeuvres: Vec<ManoeuvreSection>,
    /// The UAVs that a program of the user's flies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub agents: Vec<AgentSection>,
    /// The faults of processes and links.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

impl Scenario {
    /// The formation to form first.
    pub fn formation(&self) -> Formation {
        self.formation.geometry()
    }

    /// The formations of the flight: the first one, and that of each manoeuvre.
    pub fn formations(&self) -> impl Iterator<Item = Formation> {
        // Carried along, because a manoeuvre leaves out what stays as the one before has made it.
        let mut section = self.formation.clone();
        let changed = self.manoeuvres.iter().map(move |manoeuvre| {
            section = manoeuvre.applied_to(&section);
            section.geometry()
        });
        iter::once(self.formation()).chain(changed)
    }

    /// The distance of the farthest slot of any of them from the leader, metres.
    pub fn reach_m(&self) -> f64 {
        self.formations().map(|formation| formation.reach_m()).fold(0.0, f64::max)
    }

    /// Which UAV has which slot, by the rule that the scenario names.
    pub fn ring_order(&self) -> RingOrder {
        match self.formation.assignment {
            Assignment::Number => RingOrder::by_number(self.formation.uavs),
            Assignment::Nearest => assignment::nearest(self),
        }
    }

    /// The ring before any loss, with the rule by which it closes.
    pub fn whole_ring(&self) -> LivingRing {
        let on_loss = self.control.ring_closes.then_some(self.membership.on_loss);
        LivingRing::whole(self.formation(), self.ring_order(), on_loss)
    }

    /// The manoeuvres, in order of time. Who gets which slot depends on the whole formations only, so it does not matter who
    /// is alive by then.
    pub fn planned_manoeuvres(&self) -> Vec<Manoeuvre> {
        // Carried along: each manoeuvre begins where the one before has put the UAVs.
        let (mut places, mut section) = (self.ring_order(), self.formation.clone());
        let plan = |manoeuvre: &ManoeuvreSection| {
            let before = section.geometry();
            section = manoeuvre.applied_to(&section);
            let formation = section.geometry();
            if manoeuvre.order == SlotOrder::Nearest {
                places = assignment::nearest_places(&before, &places, &formation);
            }
            Manoeuvre {
                begins: self.tick_at(manoeuvre.at_s),
                lasts_ticks: self.tick_at(manoeuvre.over_s).0,
                formation,
                places: places.clone(),
                goes_round: manoeuvre.order == SlotOrder::Keep,
            }
        };
        self.manoeuvres.iter().map(plan).collect()
    }

    /// The ring before any loss, in the formation of `tick`.
    pub fn ring_at(&self, tick: Tick) -> LivingRing {
        let mut ring = self.whole_ring();
        let begun = self.planned_manoeuvres().into_iter().filter(|manoeuvre| manoeuvre.begins <= tick);
        begun.for_each(|manoeuvre| ring.turn_to(&manoeuvre));
        ring
    }

    /// The shape that is flown, or moved to, in `tick`.
    pub fn shape_at(&self, tick: Tick) -> ShapeName {
        let begun = self.manoeuvres.iter().filter(|manoeuvre| self.tick_at(manoeuvre.at_s) <= tick);
        // Not the shape of the last one begun: it may change the spacing only.
        begun.filter_map(|manoeuvre| manoeuvre.shape).next_back().unwrap_or(self.formation.shape)
    }

    /// The tick at `seconds`.
    pub fn tick_at(&self, seconds: f64) -> Tick {
        Tick((seconds * f64::from(self.time.rate_hz)).round() as i64)
    }

    /// Length of a tick in seconds.
    pub fn period_s(&self) -> f64 {
        1.0 / f64::from(self.time.rate_hz)
    }

    /// Whether a tick waits for the processes (lockstep) or for the wall clock (real time).
    pub fn pace(&self) -> Pace {
        if self.time.real_time { Pace::RealTime } else { Pace::Lockstep }
    }

    /// How long a process may take to be ready.
    ///
    /// The limit grows with the swarm, because all processes start at once on the same few cores.
    pub fn start_limit(&self) -> Duration {
        let start_s = self.supervision.start_timeout_s + START_SHARE_S * f64::from(self.formation.uavs);
        Duration::from_secs_f64(start_s)
    }

    /// How long a process may take to answer a tick in lockstep.
    ///
    /// The limit grows with the swarm: the last of many processes gets the processor late, above all in the first tick.
    pub fn answer_limit(&self) -> Duration {
        let answer_s = self.supervision.answer_timeout_s + ANSWER_SHARE_S * f64::from(self.formation.uavs);
        Duration::from_secs_f64(answer_s)
    }

    /// The program that flies `uav`; `None` if the built-in law does.
    pub fn agent_of(&self, uav: UavId) -> Option<&AgentSection> {
        // From the back, because the later of two sections counts: so `--agent` wins over the file.
        self.agents.iter().rev().find(|section| section.has(uav))
    }

    /// The first UAV that a program of the user's flies, and that program.
    pub fn first_own_agent(&self) -> Option<(UavId, &AgentSection)> {
        UavId::all(self.formation.uavs).find_map(|uav| Some((uav, self.agent_of(uav)?)))
    }

    /// The number of the last tick.
    pub fn last_tick(&self) -> i64 {
        // Round, because such a product may be just below a whole number: 0.29 s times 100 Hz is 28.999999999999996.
        (self.time.duration_s * f64::from(self.time.rate_hz)).round() as i64
    }

    /// The schedule of the scenario's own faults.
    pub fn schedule(&self) -> FaultSchedule<'_> {
        self.schedule_of(&self.faults)
    }

    /// The schedule of `faults` in this scenario: with its seed, its rate and its number of UAVs.
    pub fn schedule_of<'f>(&self, faults: &'f [Fault]) -> FaultSchedule<'f> {
        FaultSchedule { faults, seed: self.seed, rate_hz: self.time.rate_hz, uavs: self.formation.uavs }
    }

    /// The scenario as TOML with every value in full: [`Scenario::resolved`] reads back the same bits.
    ///
    /// # Panics
    /// Never: a scenario consists of tables, lists, numbers, texts and booleans, and TOML has all of them.
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
            time: TimeSection::default(),
            formation: FormationSection::default(),
            control: ControlSection::default(),
            membership: MembershipSection::default(),
            safety: SafetySection::default(),
            leader: LeaderSection::default(),
            airframe: AirframeSection::default(),
            georeference: GeoreferenceSection::default(),
            sensing: SensingSection::default(),
            sensors: SensorsSection::default(),
            wind: WindSection::default(),
            supervision: SupervisionSection::default(),
            ipc: IpcSection::default(),
            requirements: RequirementsSection::default(),
            start: StartSection::default(),
            obstacle_field: ObstacleFieldSection::default(),
            obstacles: Vec::new(),
            intruders: Vec::new(),
            manoeuvres: Vec::new(),
            agents: Vec::new(),
            faults: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_limits_grow_with_the_number_of_processes() {
        let limits = |uavs| {
            let mut scenario = Scenario::default();
            scenario.formation.uavs = uavs;
            (scenario.start_limit().as_secs_f64(), scenario.answer_limit().as_secs_f64())
        };
        let ((start, answer), (long_start, long_answer)) = (limits(6), limits(1000));
        assert!((10.0..11.0).contains(&start) && (2.0..2.1).contains(&answer), "{start} {answer}");
        assert!(long_start >= 30.0 && long_answer >= 7.0, "{long_start} {long_answer}");
    }
}
