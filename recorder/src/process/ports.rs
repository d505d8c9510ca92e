//! The recorder's ends of the services.
//!
//! Must never decide which ticks are complete.

use super::{assembly::Assembly, recording::Recording};
use crate::{RecorderError, log::Opening};
use ringwing_bus::{
    Member, Publisher, Stamps, Subscriber,
    services::{self, RECORDER_DEPTH},
};
use ringwing_flight::{
    Account, EventMessage, FormationError, LeaderState, LinkCounts, Sensed, TickTiming, UavId,
};

/// What the recorder subscribes to, and the one thing that it publishes.
pub(super) struct RecorderPorts {
    sensed: Vec<(UavId, Subscriber<Sensed>)>,
    accounts: Vec<(UavId, Subscriber<Account>)>,
    leader: Subscriber<LeaderState>,
    links: Subscriber<LinkCounts>,
    timing: Option<Subscriber<TickTiming>>,
    events: [Subscriber<EventMessage>; 2],
    formation_error: Publisher<FormationError>,
}

impl RecorderPorts {
    /// Subscribes to everything that the log described by `opening` needs.
    pub(super) fn open(member: &Member, opening: &Opening) -> Result<Self, RecorderError> {
        let (node, count) = (member.node(), opening.scenario.formation.uavs);
        let sensed = |uav| Ok((uav, services::sensed(uav).subscriber(node, RECORDER_DEPTH)?));
        let account = |uav| Ok((uav, services::account(uav).subscriber(node, RECORDER_DEPTH)?));
        let timing = || services::timing().subscriber(node, RECORDER_DEPTH);
        Ok(Self {
            sensed: UavId::all(count).map(sensed).collect::<Result<_, RecorderError>>()?,
            accounts: UavId::all(count).map(account).collect::<Result<_, RecorderError>>()?,
            leader: services::leader(count).subscriber(node, RECORDER_DEPTH)?,
            links: services::links(count).subscriber(node, RECORDER_DEPTH)?,
            timing: opening.timing.then(timing).transpose()?,
            events: [
                services::world_events().subscriber(node, RECORDER_DEPTH)?,
                services::launcher_events().subscriber(node, RECORDER_DEPTH)?,
            ],
            formation_error: services::formation_error().publisher(node)?,
        })
    }

    /// Fetches everything that has been sent since the last call.
    pub(super) fn fetch(
        &self,
        assembly: &mut Assembly,
        recording: &mut Recording,
    ) -> Result<(), RecorderError> {
        for (uav, port) in &self.sensed {
            port.drain(|sensed, _| assembly.put_sensed(*uav, sensed))?;
        }
        for (uav, port) in &self.accounts {
            port.drain(|account, _| assembly.put_account(*uav, account))?;
        }
        self.leader.drain(|leader, _| assembly.put_leader(leader))?;
        self.links.drain(|counts, _| assembly.put_link(counts))?;
        if let Some(port) = &self.timing {
            port.drain(|timing, _| assembly.put_timing(timing))?;
        }
        for port in &self.events {
            port.drain(|message, _| {
                // Skip a message of another version whose event this version does not know.
                if let Some(event) = message.event() {
                    recording.log_event(event);
                }
            })?;
        }
        Ok(())
    }

    /// Publishes how far the swarm is from its formation.
    pub(super) fn send_progress(&self, error: FormationError) -> Result<(), RecorderError> {
        Ok(self.formation_error.send(error, Stamps::now())?)
    }
}
