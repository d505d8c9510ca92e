//! A simulated flight that is recorded while it flies: the log that the processes would have written, to the byte.
//!
//! Must never decide anything about the flight, and never print: the caller steps it, shows progress and interrupts it.

use crate::crewed::{CrewedFlight, FlightError};
use ringwing_flight::{Event, Reporter, Tick, TimedEvent, WorldReport};
use ringwing_recorder::{RecorderError, RecorderReport, Recording, log::Opening, metrics::Moment};
use ringwing_scenario::Scenario;
pub use ringwing_simulation::MakeController;
use ringwing_simulation::{Frames, Simulation};
use std::path::Path;

/// Why a flight cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum RecordedFlightError {
    /// The scenario cannot be flown here.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// The log cannot be written.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
}

/// A flight in this process, with its log.
pub struct RecordedFlight {
    flight: CrewedFlight,
    frames: Frames,
    recording: Recording,
    /// Why the log is not complete, if it is not.
    problem: Option<String>,
    /// Why the flight has ended early, if it has.
    cut: Option<String>,
}

/// Where a flight keeps what it leaves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Places<'p> {
    /// The log; without one, the flight is only measured.
    pub log: Option<&'p Path>,
    /// The folder for what the programs print that fly UAVs; without one, only the end of it is kept.
    pub output: Option<&'p Path>,
}

/// How a recorded flight ended.
#[derive(Debug)]
pub struct RecordedEnd {
    /// What the world counted; `None` if a fault ended it.
    pub world: Option<WorldReport>,
    /// What was measured.
    pub recorder: RecorderReport,
    /// Why the flight failed, if it did.
    pub failures: Vec<String>,
    /// The last tick flown.
    pub ticks: i64,
}

impl RecordedFlight {
    /// The flight of `scenario`, which has been validated, before its first tick.
    ///
    /// # Errors
    /// The scenario flies in real time, its UAVs find no room to start, a program that it names cannot be started, or the log
    /// cannot be written.
    pub fn begin(scenario: &Scenario, places: Places<'_>) -> Result<Self, RecordedFlightError> {
        Self::begin_with(scenario, places, Box::new(|_| None))
    }

    /// As [`begin`](Self::begin), with the controllers that `make_controller` makes.
    ///
    /// # Errors
    /// As with [`begin`](Self::begin).
    pub fn begin_with(
        scenario: &Scenario,
        Places { log, output }: Places<'_>,
        make_controller: MakeController,
    ) -> Result<Self, RecordedFlightError> {
        let flight = CrewedFlight::begin_with(scenario, output, make_controller)?;
        let text = scenario.to_toml();
        // A simulated tick takes no time that is worth a record.
        let opening = Opening { scenario, text: &text, timing: false, started_at: None };
        Ok(Self {
            recording: Recording::begin(log, &opening, false)?,
            frames: Frames::new(scenario),
            flight,
            problem: None,
            cut: None,
        })
    }

    /// Flies and records the next tick. Returns whether there is one after it.
    pub fn step(&mut self) -> bool {
        let goes_on = match self.flight.step() {
            Ok(goes_on) => goes_on,
            // The tick in which a program failed is not logged: the withheld wish would be blamed on the controller.
            Err(failure) => {
                self.cut_short(failure.to_string());
                return false;
            }
        };
        for event in self.flight.simulation().events() {
            // The recording announces the faults of the schedule by itself.
            if event.event.reporter() != Reporter::Schedule {
                self.recording.log_event(event.clone());
            }
        }
        if let Some(frame) = self.frames.take(self.flight.simulation()) {
            let written = self.recording.observe(frame, None).err();
            self.note(written);
        }
        goes_on
    }

    /// What happened in the last step; nothing if the flight was cut short.
    pub fn events(&self) -> &[TimedEvent] {
        if self.cut.is_none() { self.simulation().events() } else { &[] }
    }

    /// The flight itself.
    pub fn simulation(&self) -> &Simulation {
        self.flight.simulation()
    }

    /// The swarm in the tick flown last; `None` before tick 0.
    pub fn moment(&self) -> Option<&Moment> {
        self.recording.moment()
    }

    /// Notes that the flight ends here because somebody asked for it; returns the event.
    pub fn interrupt(&mut self) -> TimedEvent {
        self.cut_short("interrupted before the end".into())
    }

    /// Notes that the flight ends here; returns the event.
    fn cut_short(&mut self, why: String) -> TimedEvent {
        self.cut.get_or_insert(why);
        let event = TimedEvent { tick: self.simulation().now(), event: Event::RunInterrupted };
        self.recording.log_event(event.clone());
        event
    }

    /// Ends the log, and says how the flight went.
    pub fn finish(mut self) -> RecordedEnd {
        let world = (!self.simulation().is_world_ended()).then(|| self.report());
        let written = self.recording.finish(world.as_ref()).err();
        self.note(written);
        RecordedEnd {
            world,
            recorder: self.recording.report(),
            failures: self.failures(),
            ticks: self.simulation().flown().map_or(0, |Tick(tick)| tick.max(0)),
        }
    }

    /// Keeps the first problem of the log: the flight goes on and is measured, as with a recorder that gave up.
    fn note(&mut self, problem: Option<RecorderError>) {
        self.problem = self.problem.take().or(problem.map(|problem| problem.to_string()));
    }

    /// The world's report. A flight that was cut short is not complete.
    fn report(&self) -> WorldReport {
        let report = self.simulation().report();
        WorldReport { complete: report.complete && self.cut.is_none(), ..report }
    }

    fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.simulation().is_world_ended() {
            failures.push("the world was ended as asked: the flight did not come to its end".into());
        } else {
            failures.extend(self.cut.clone());
        }
        failures.extend(self.problem.iter().map(|problem| format!("{problem}: the log is incomplete")));
        failures
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_recorder::{
        log::{meter::Measured, reader::Reader},
        metrics::Verdict,
    };

    fn short() -> Scenario {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = 2.0;
        scenario.faults = vec!["at 1 s kill uav 3".parse().unwrap()];
        scenario
    }

    #[test]
    fn the_log_of_a_flight_measures_as_the_flight_did() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("flight.mcap");
        let scenario = short();
        let mut flight = RecordedFlight::begin(&scenario, Places { log: Some(&log), output: None }).unwrap();
        while flight.step() {}
        let end = flight.finish();
        let measured = Measured::of(&mut Reader::open(&log).unwrap(), &scenario);
        assert_eq!(end.failures, Vec::<String>::new());
        assert_eq!(measured.summary.flight, Some(end.recorder.summary));
        assert_eq!(measured.summary.payload_hash, end.world.map(|world| world.payload_hash));
        assert_eq!((measured.summary.verdict, measured.summary.ticks), (Verdict::Passed, end.ticks));
    }

    #[test]
    fn an_interrupted_flight_has_failed_and_its_log_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("flight.mcap");
        let scenario = short();
        let mut flight = RecordedFlight::begin(&scenario, Places { log: Some(&log), output: None }).unwrap();
        for _ in 0..50 {
            assert!(flight.step());
        }
        flight.interrupt();
        let end = flight.finish();
        assert_eq!(end.failures, ["interrupted before the end"]);
        let summary = Measured::of(&mut Reader::open(&log).unwrap(), &scenario).summary;
        assert_eq!(summary.verdict, Verdict::Failed);
        assert!(summary.failures[0].starts_with("the flight was ended at 0.4"), "{:?}", summary.failures);
    }
}
