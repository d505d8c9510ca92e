//! The scenario of a run: its swarm, law, obstacles, faults and requirements.
//!
//! [`model`] is the data. [`Source`] finds the text of a scenario, and [`Scenario::read`] parses it, applies the
//! [`Setting`]s of the command line, validates the result and reports every problem at once. [`preset`] holds the
//! built-in scenarios, [`start`] places the UAVs, `assignment` gives them their slots, and [`fault`] is the grammar of
//! faults and their schedule.
//!
//! Never knows processes, services or clocks: a scenario means the same in every process of a run.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod assignment;
mod event_text;
pub mod fault;
mod fault_check;
mod field;
mod key;
pub mod model;
pub mod preset;
mod read;
mod spelling;
pub mod start;
mod validate;

pub use fault::{Action, Fault, schedule::FaultSchedule};
pub use key::unit_symbol;
pub use model::{
    AgentSection, AirframeSection, Assignment, ControlSection, DeadReckoning, DrawSection, Failsafe,
    FormationSection, GeoreferenceSection, IntruderSection, IpcSection, Law, LawSwitches, LeaderSection,
    LeaderStart, ManoeuvreSection, MembershipSection, ObstacleFieldSection, ObstacleSection, OffsetSection,
    PathKind, PathSection, RequirementsSection, SafetySection, Scenario, SensingSection, SensorsSection,
    ShapeName, SlotOrder, StartSection, StartState, SupervisionSection, TimeSection, Wake, WaypointSection,
    WindSection,
};
pub use preset::Preset;
pub use read::{Place, Problem, Reading, ScenarioError, Setting, Source, example_scenario, keys};
pub use validate::{PAYLOAD_MAX_BYTES, UAVS_MAX, UAVS_MIN};
