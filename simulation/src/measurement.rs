//! A flight to its end, measured as the recorder measures one.

use crate::{Simulation, SimulationError};
use ringwing_flight::{Event, Tick, TimedEvent, UavId, WorldReport};
use ringwing_recorder::metrics::{AirframeSample, FlightSummary, Frame, Metrics, TickSamples, judge};
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
    /// The name of the verdict: `passed`, `violated` or `failed`.
    pub fn verdict(&self) -> &'static str {
        match &self.report {
            Some(report) if report.complete && self.violations.is_empty() => "passed",
            Some(report) if report.complete => "violated",
            _ => "failed",
        }
    }
}

/// Flies `scenario`, which has been validated, to its end.
pub fn fly(scenario: &Scenario) -> Result<Flown, SimulationError> {
    let mut simulation = Simulation::new(scenario)?;
    let mut measurement = Measurement::new(scenario);
    loop {
        let tick = simulation.now();
        let goes_on = simulation.step();
        if simulation.is_world_ended() {
            measurement.take_events(&simulation);
            break;
        }
        measurement.observe(&simulation, tick);
        if !goes_on {
            break;
        }
    }
    Ok(measurement.finish(&simulation))
}

/// The recorder's measures of a simulated flight.
struct Measurement {
    rate_hz: u32,
    samples: TickSamples,
    frame: Frame,
    metrics: Metrics,
    events: Vec<TimedEvent>,
}

impl Measurement {
    fn new(scenario: &Scenario) -> Self {
        Self {
            rate_hz: scenario.time.rate_hz,
            samples: TickSamples::new(scenario.formation.uavs as usize),
            frame: Frame::new(scenario),
            metrics: Metrics::new(scenario),
            events: Vec::new(),
        }
    }

    /// Takes in `tick`, which was just flown. The approach, before tick 0, is not part of the flight.
    fn observe(&mut self, simulation: &Simulation, tick: Tick) {
        self.take_events(simulation);
        if tick < Tick(0) {
            return;
        }
        self.samples.restart(tick.0);
        for uav in UavId::all(simulation.scenario().formation.uavs) {
            self.samples.airframes[uav.index()] = simulation.sensed(uav).map(AirframeSample::from);
            self.samples.accounts[uav.index()] = simulation.account(uav).copied();
        }
        self.samples.leader = simulation.led(tick).copied();
        self.samples.links.extend_from_slice(simulation.links());
        self.frame.refill(&self.samples, self.rate_hz);
        self.metrics.observe(&self.frame);
    }

    fn take_events(&mut self, simulation: &Simulation) {
        for event in simulation.events() {
            self.metrics.on_event(event);
            self.events.push(event.clone());
        }
    }

    fn finish(self, simulation: &Simulation) -> Flown {
        let summary = self.metrics.summary();
        let report = (!simulation.is_world_ended()).then(|| simulation.report());
        let is_collision = |timed: &&TimedEvent| matches!(timed.event, Event::Collision { .. });
        let collisions = self.events.iter().filter(is_collision).count();
        let violations = judge(&simulation.scenario().requirements, &summary, collisions);
        Flown { report, summary, events: self.events, violations }
    }
}
