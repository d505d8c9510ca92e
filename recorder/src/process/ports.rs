//! The ends of the services of whoever follows a flight: the recorder, and observers.
//!
//! Must never decide which ticks are complete.

use super::assembly::Assembly;
use crate::RecorderError;
use ringwing_bus::{
    BusNode, JournalReader, Member, Publisher, Stamps, Subscriber,
    services::{self, RECORDER_DEPTH},
};
use ringwing_flight::{EventMessage, FormationError, LinkCounts, Notes, TimedEvent};
use ringwing_scenario::Scenario;

/// What a recorder or an observer subscribes to.
pub(super) struct FlightPorts {
    journal: JournalReader,
    links: Subscriber<LinkCounts>,
    /// `None` in a run in which nobody makes notes.
    notes: Option<Subscriber<Notes>>,
    events: [Subscriber<EventMessage>; 2],
    /// Whether it wants to know how long ticks took.
    timing: bool,
}

impl FlightPorts {
    /// Subscribes to the flight of `scenario` with all that the log needs.
    pub(super) fn of_recorder(
        node: &BusNode,
        scenario: &Scenario,
        timing: bool,
    ) -> Result<Self, RecorderError> {
        Self::open(node, scenario, timing, JournalReader::of_recorder(node)?, usize::MAX)
    }

    /// Subscribes to the flight with as little room as a passing look needs.
    pub(super) fn of_observer(node: &BusNode, scenario: &Scenario) -> Result<Self, RecorderError> {
        let journal = JournalReader::of_observer(node, scenario.formation.uavs)?;
        Self::open(node, scenario, true, journal, services::OBSERVER_DEPTH)
    }

    /// Opens the ends, each with room for at most `depth` samples.
    fn open(
        node: &BusNode,
        scenario: &Scenario,
        timing: bool,
        journal: JournalReader,
        depth: usize,
    ) -> Result<Self, RecorderError> {
        let uavs = scenario.formation.uavs;
        let notes = || services::notes(uavs).subscriber(node, depth);
        Ok(Self {
            journal,
            links: services::links(uavs).subscriber(node, depth)?,
            notes: services::has_notes(scenario).then(notes).transpose()?,
            // Whoever joins late gets what has happened before, so there has to be room for that.
            events: [
                services::world_events().subscriber(node, RECORDER_DEPTH)?,
                services::launcher_events().subscriber(node, RECORDER_DEPTH)?,
            ],
            timing,
        })
    }

    /// Fetches everything that has been sent since the last call; hands events to `take_event`.
    ///
    /// The journal comes first: whatever else belongs to one of its ticks was sent before it.
    pub(super) fn fetch(
        &self,
        assembly: &mut Assembly,
        mut take_event: impl FnMut(TimedEvent),
    ) -> Result<(), RecorderError> {
        self.journal.drain(|header, entries| {
            assembly.put_journal(header, entries.iter().map(|entry| &entry.0), self.timing);
        })?;
        self.links.drain(|counts, _| assembly.put_link(counts))?;
        if let Some(port) = &self.notes {
            port.drain(|notes, _| assembly.put_notes(notes))?;
        }
        for port in &self.events {
            // Skip a message of another version whose event this version does not know.
            port.drain(|message, _| message.event().into_iter().for_each(&mut take_event))?;
        }
        Ok(())
    }
}

/// The one thing that the recorder publishes.
pub(super) struct ProgressPort(Publisher<FormationError>);

impl ProgressPort {
    /// Opens the port.
    pub(super) fn open(member: &Member) -> Result<Self, RecorderError> {
        Ok(Self(services::formation_error().publisher(member.node())?))
    }

    /// Publishes how far the swarm is from its formation.
    pub(super) fn send(&self, error: FormationError) -> Result<(), RecorderError> {
        Ok(self.0.send(error, Stamps::now())?)
    }
}
