//! A simulated flight that is recorded while it flies: the log that the processes would have written, to the byte.
//!
//! Must never decide anything about the flight, and never print: the caller steps it, shows progress and interrupts it.

use ringwing_flight::{Event, Reporter, Tick, TimedEvent, WorldReport};
use ringwing_recorder::{RecorderError, RecorderReport, Recording, log::Opening, metrics::Moment};
use ringwing_scenario::Scenario;
pub use ringwing_simulation::MakeController;
use ringwing_simulation::{Frames, Simulation, SimulationError};
use std::path::Path;

/// Why a flight cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum RecordedFlightError {
    /// The scenario cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The log cannot be written.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
}

/// A flight in this process, with its log.
pub struct RecordedFlight {
    simulation: Simulation,
    frames: Frames,
    recording: Recording,
    /// Why the log is not complete, if it is not.
    problem: Option<String>,
    is_interrupted: bool,
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
    /// The flight of `scenario`, which has been validated, before its first tick. Without a `log`, it is only measured.
    ///
    /// # Errors
    /// The scenario flies in real time, its UAVs find no room to start, or the log cannot be written.
    pub fn begin(scenario: &Scenario, log: Option<&Path>) -> Result<Self, RecordedFlightError> {
        Self::begin_with(scenario, log, Box::new(|_| None))
    }

    /// As [`begin`](Self::begin), with the controllers of the user's that `make_controller` makes.
    ///
    /// # Errors
    /// As with [`begin`](Self::begin).
    pub fn begin_with(
        scenario: &Scenario,
        log: Option<&Path>,
        make_controller: MakeController,
    ) -> Result<Self, RecordedFlightError> {
        let simulation = Simulation::with_controllers(scenario, make_controller)?;
        let text = scenario.to_toml();
        // A simulated tick takes no time that is worth a record.
        let opening = Opening { scenario, text: &text, timing: false, started_at: None };
        Ok(Self {
            recording: Recording::begin(log, &opening, false)?,
            frames: Frames::new(scenario),
            simulation,
            problem: None,
            is_interrupted: false,
        })
    }

    /// Flies and records the next tick. Returns whether there is one after it.
    pub fn step(&mut self) -> bool {
        let goes_on = self.simulation.step();
        for event in self.simulation.events() {
            // The recording announces the faults of the schedule by itself.
            if event.event.reporter() != Reporter::Schedule {
                self.recording.log_event(event.clone());
            }
        }
        if let Some(frame) = self.frames.take(&self.simulation) {
            let written = self.recording.observe(frame, None).err();
            self.note(written);
        }
        goes_on
    }

    /// The flight itself.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The swarm in the tick flown last; `None` before tick 0.
    pub fn moment(&self) -> Option<&Moment> {
        self.recording.moment()
    }

    /// Notes that the flight ends here because somebody asked for it; returns the event.
    pub fn interrupt(&mut self) -> TimedEvent {
        self.is_interrupted = true;
        let event = TimedEvent { tick: self.simulation.now(), event: Event::RunInterrupted };
        self.recording.log_event(event.clone());
        event
    }

    /// Ends the log, and says how the flight went.
    pub fn finish(mut self) -> RecordedEnd {
        let world = (!self.simulation.is_world_ended()).then(|| self.report());
        let written = self.recording.finish(world.as_ref()).err();
        self.note(written);
        RecordedEnd {
            world,
            recorder: self.recording.report(),
            failures: self.failures(),
            ticks: self.simulation.flown().map_or(0, |Tick(tick)| tick.max(0)),
        }
    }

    /// Keeps the first problem of the log: the flight goes on and is measured, as with a recorder that gave up.
    fn note(&mut self, problem: Option<RecorderError>) {
        self.problem = self.problem.take().or(problem.map(|problem| problem.to_string()));
    }

    /// The world's report. An interrupted flight is not complete.
    fn report(&self) -> WorldReport {
        let report = self.simulation.report();
        WorldReport { complete: report.complete && !self.is_interrupted, ..report }
    }

    fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.simulation.is_world_ended() {
            failures.push("the world was ended as asked: the flight did not come to its end".into());
        } else if self.is_interrupted {
            failures.push("interrupted before the end".into());
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
        let mut flight = RecordedFlight::begin(&scenario, Some(&log)).unwrap();
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
        let mut flight = RecordedFlight::begin(&scenario, Some(&log)).unwrap();
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
