//! A flight to its end, measured as the recorder measures one.

use crate::{Simulation, SimulationError};
use ringwing_flight::{Event, Tick, TimedEvent, UavId, WorldReport};
use ringwing_recorder::metrics::{
    AirframeSample, FlightSummary, Frame, Metrics, Moment, TickSamples, Verdict, judge,
};
use ringwing_scenario::Scenario;

/// How a flight went.
#[derive(Debug, Clone)]
pub struct Flown {
    /// What the world saw; `None` if a fault ended the world, as its report dies with it.
    pub report: Option<WorldReport>,
    /// The flight in numbers.
    pub summary: FlightSummary,
    /// Everything that happened, in order of time.
    pub events: Vec<TimedEvent>,
    /// The violated requirements of the scenario, in words.
    pub violations: Vec<String>,
}

impl Flown {
    /// The verdict on the flight.
    pub fn verdict(&self) -> Verdict {
        match &self.report {
            Some(report) if report.complete && self.violations.is_empty() => Verdict::Passed,
            Some(report) if report.complete => Verdict::Violated,
            _ => Verdict::Failed,
        }
    }
}

/// Flies `scenario`, which has been validated, to its end.
pub fn fly(scenario: &Scenario) -> Result<Flown, SimulationError> {
    let mut simulation = Simulation::new(scenario)?;
    let mut measurement = Measurement::new(scenario);
    while simulation.step() {
        measurement.observe(&simulation);
    }
    // The last step returns false, but it has flown a tick too.
    measurement.observe(&simulation);
    Ok(measurement.finish(&simulation))
}

/// The ticks of a simulated flight as the recorder sees them.
pub struct Frames {
    rate_hz: u32,
    samples: TickSamples,
    frame: Frame,
    /// The tick taken last.
    taken: Option<Tick>,
}

impl Frames {
    /// The frames of a flight of `scenario`, before its first tick.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            rate_hz: scenario.time.rate_hz,
            samples: TickSamples::new(scenario.formation.uavs as usize),
            frame: Frame::new(scenario),
            taken: None,
        }
    }

    /// The frame of the tick flown last, if [`Simulation::step`] has flown one since the call before. The approach, before
    /// tick 0, has no frame.
    pub fn take(&mut self, simulation: &Simulation) -> Option<&Frame> {
        // A step in which nothing could fly, because the world has ended, leaves the tick before as the one flown last.
        let is_new = |tick: &Tick| *tick >= Tick(0) && Some(*tick) > self.taken;
        let tick = simulation.flown().filter(is_new)?;
        self.taken = Some(tick);
        self.collect_samples(simulation, tick);
        self.frame.refill(&self.samples, self.rate_hz);
        Some(&self.frame)
    }

    /// The frame taken last.
    pub fn latest(&self) -> &Frame {
        &self.frame
    }

    fn collect_samples(&mut self, simulation: &Simulation, tick: Tick) {
        self.samples.restart(tick.0);
        for uav in UavId::all(simulation.scenario().formation.uavs) {
            self.samples.airframes[uav.index()] =
                simulation.sensed(uav).map(|sensed| AirframeSample::new(sensed, simulation.truth(uav)));
            self.samples.accounts[uav.index()] = simulation.account(uav).copied();
        }
        self.samples.leader = simulation.led().copied();
        self.samples.links.extend_from_slice(simulation.links());
        self.samples.notes.extend_from_slice(simulation.notes());
    }
}

/// The recorder's measures of a simulated flight, for callers that step it themselves.
pub struct Measurement {
    frames: Frames,
    metrics: Metrics,
    events: Vec<TimedEvent>,
}

impl Measurement {
    /// The measures of a flight of `scenario`, before its first tick.
    pub fn new(scenario: &Scenario) -> Self {
        Self { frames: Frames::new(scenario), metrics: Metrics::new(scenario), events: Vec::new() }
    }

    /// Measures the tick flown last and takes the events of the step. Call it once after each [`Simulation::step`], also
    /// after the last one. The approach, before tick 0, is not part of the flight: only its events count. Returns the frame
    /// of the tick, if there is a new one.
    pub fn observe(&mut self, simulation: &Simulation) -> Option<&Frame> {
        for event in simulation.events() {
            self.metrics.on_event(event);
            self.events.push(event.clone());
        }
        let frame = self.frames.take(simulation)?;
        self.metrics.observe(frame);
        Some(frame)
    }

    /// The tick observed last, UAV by UAV.
    pub fn frame(&self) -> &Frame {
        self.frames.latest()
    }

    /// The swarm as a whole in the tick observed last.
    pub fn moment(&self) -> &Moment {
        self.metrics.moment()
    }

    /// How the flight of `simulation` went.
    pub fn finish(self, simulation: &Simulation) -> Flown {
        let summary = self.metrics.summary();
        let report = (!simulation.is_world_ended()).then(|| simulation.report());
        // Count the events, because a world that a fault has ended leaves no report.
        let is_collision = |timed: &&TimedEvent| matches!(timed.event, Event::Collision { .. });
        let collisions = self.events.iter().filter(is_collision).count();
        let violations = judge(simulation.scenario(), &summary, Some(collisions));
        Flown { report, summary, events: self.events, violations }
    }
}
