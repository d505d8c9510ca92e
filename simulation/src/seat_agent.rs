//! The agent of one UAV: with the built-in law, or with a controller of the user's.
//!
//! Never decides anything: it hands each call on.

use crate::inputs::AgentInputs;
use ringwing_agent::{
    Answer, UavAgent,
    controller::{Controller, Guest},
};
use ringwing_flight::{LinkCounts, Notes, Tick, UavId};
use ringwing_scenario::{Scenario, fault::schedule::LinkFault};
use std::convert::Infallible;

/// The agent of one UAV.
pub(crate) enum SeatAgent {
    /// With the built-in law.
    BuiltIn(UavAgent),
    /// With a controller of the user's. Which ones there are is the user's choice, so no enum can list them.
    Own(UavAgent<Guest<Box<dyn Controller>>>),
}

impl SeatAgent {
    /// The agent of `uav` as it starts, with `controller` or with the built-in law.
    pub(crate) fn new(scenario: &Scenario, uav: UavId, controller: Option<Box<dyn Controller>>) -> Self {
        match controller {
            None => Self::BuiltIn(UavAgent::new(scenario, uav)),
            Some(controller) => Self::Own(UavAgent::steered_by(Guest::new(controller), scenario, uav)),
        }
    }

    /// Whether the built-in law flies the UAV.
    pub(crate) fn is_built_in(&self) -> bool {
        matches!(self, Self::BuiltIn(_))
    }

    pub(crate) fn set_faults(&mut self, faults: &[LinkFault]) {
        match self {
            Self::BuiltIn(agent) => agent.set_faults(faults),
            Self::Own(agent) => agent.set_faults(faults),
        }
    }

    pub(crate) fn receive(&mut self, now: Tick, inputs: &mut AgentInputs<'_>) -> Result<(), Infallible> {
        match self {
            Self::BuiltIn(agent) => agent.receive(now, inputs),
            Self::Own(agent) => agent.receive(now, inputs),
        }
    }

    pub(crate) fn link_counts(&mut self, now: Tick) -> Vec<LinkCounts> {
        match self {
            Self::BuiltIn(agent) => agent.link_counts(now),
            Self::Own(agent) => agent.link_counts(now),
        }
    }

    pub(crate) fn fly(&mut self, now: Tick) -> Answer {
        match self {
            Self::BuiltIn(agent) => agent.fly(now),
            Self::Own(agent) => agent.fly(now),
        }
    }

    pub(crate) fn plan_ahead(&mut self) {
        match self {
            Self::BuiltIn(agent) => agent.plan_ahead(),
            Self::Own(agent) => agent.plan_ahead(),
        }
    }

    pub(crate) fn notes(&self, now: Tick) -> Option<&Notes> {
        match self {
            Self::BuiltIn(agent) => agent.notes(now),
            Self::Own(agent) => agent.notes(now),
        }
    }

    pub(crate) fn update_inputs(&mut self, inputs: &mut AgentInputs<'_>) -> Result<(), Infallible> {
        match self {
            Self::BuiltIn(agent) => agent.update_inputs(inputs),
            Self::Own(agent) => agent.update_inputs(inputs),
        }
    }
}
