//! The recorder's ends of the services.
//!
//! Must never decide which ticks are complete.

use super::{assembly::Assembly, recording::Recording};
use crate::{RecorderError, log::Opening};
use ringwing_bus::{
    JournalReader, Member, Publisher, Stamps, Subscriber,
    services::{self, RECORDER_DEPTH},
};
use ringwing_flight::{EventMessage, FormationError, LinkCounts};

/// What the recorder subscribes to, and the one thing that it publishes.
pub(super) struct RecorderPorts {
    journal: JournalReader,
    links: Subscriber<LinkCounts>,
    events: [Subscriber<EventMessage>; 2],
    /// Whether the log shows how long ticks took.
    timing: bool,
    formation_error: Publisher<FormationError>,
}

impl RecorderPorts {
    /// Subscribes to everything that the log described by `opening` needs.
    pub(super) fn open(member: &Member, opening: &Opening) -> Result<Self, RecorderError> {
        let (node, count) = (member.node(), opening.scenario.formation.uavs);
        Ok(Self {
            journal: JournalReader::open(node)?,
            links: services::links(count).subscriber(node, RECORDER_DEPTH)?,
            events: [
                services::world_events().subscriber(node, RECORDER_DEPTH)?,
                services::launcher_events().subscriber(node, RECORDER_DEPTH)?,
            ],
            timing: opening.timing,
            formation_error: services::formation_error().publisher(node)?,
        })
    }

    /// Fetches everything that has been sent since the last call.
    ///
    /// The journal comes first: whatever else belongs to one of its ticks was sent before it.
    pub(super) fn fetch(
        &self,
        assembly: &mut Assembly,
        recording: &mut Recording,
    ) -> Result<(), RecorderError> {
        self.journal.drain(|header, entries| {
            assembly.put_journal(header, entries.iter().map(|entry| &entry.0), self.timing);
        })?;
        self.links.drain(|counts, _| assembly.put_link(counts))?;
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
