//! What the sensors of one UAV say of its own flight: a satellite receiver, a compass, an airspeed sensor and a gyroscope.
//!
//! Each error is noise, drawn anew for every reading, and a bias. Biases of position and heading wander as first-order
//! Gauss-Markov processes; those of airspeed and turn rate stay. Receiver and compass have rates of their own and repeat their last
//! reading in between. The draws are a pure function of seed, UAV, sensor and tick.
//!
//! Never changes how the UAV flies, and never senses anything but the UAV itself.

use nalgebra::{Point2, Vector2};
use ringwing_flight::{Pose, Tick, UavId, direction, draw::Draws, wrap};
use ringwing_scenario::{
    Scenario, SensorsSection,
    fault::{
        SensorDrift,
        schedule::{AirframeFailure, AirframeFault},
    },
};

/// Separates the sensors from all other draws of the seed ("sensor" in ASCII). Another value gives other errors.
const PURPOSE: u64 = 0x7365_6e73_6f72;
/// The tick whose draws are those from before the flight: the first biases.
const BEFORE: Tick = Tick(Tick::APPROACH.0 - 1);
/// Share of a reading that rounding may take from a count of readings. More would read a sensor too early; with none, a sensor of 10 Hz
/// would sometimes be read a tick late.
const ROUNDING: f64 = 1e-9;

/// Which sensor a draw is for. Each has draws of its own, so that no key changes the errors of another sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(u64)]
enum Kind {
    Position,
    Heading,
    Airspeed,
    TurnRate,
}

/// The sensors of one UAV.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sensors {
    uav: UavId,
    seed: u64,
    period_s: f64,
    receiver: Receiver,
    compass: Compass,
    airspeed: SteadySensor,
    turn_rate: SteadySensor,
}

/// The satellite receiver.
#[derive(Debug, Clone, PartialEq)]
struct Receiver {
    sampling: Sampling,
    noise_m: f64,
    bias_m: [Bias; 2],
    outage: Outage,
    /// The last fix, and its tick.
    fix: (Tick, Point2<f64>),
}

/// The compass.
#[derive(Debug, Clone, PartialEq)]
struct Compass {
    sampling: Sampling,
    noise_rad: f64,
    bias_rad: Bias,
    /// The last reading, and its tick.
    reading: (Tick, f64),
}

/// A sensor that is read in every tick, with a bias that stays.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SteadySensor {
    kind: Kind,
    noise: f64,
    bias: f64,
}

/// In which ticks a sensor is read.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sampling {
    readings_per_tick: f64,
    /// When it was read last, even if that reading failed.
    last: Tick,
}

/// A bias that wanders: `b' = -b / time_s` plus white noise, so strong that the standard deviation is `deviation` at all times.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bias {
    value: f64,
    deviation: f64,
    time_s: f64,
}

/// Whether fixes fail: a Markov chain with two states.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Outage {
    is_out: bool,
    /// Probability that the fix after a good one fails.
    begins: f64,
    /// Probability that the fix after a failed one is good.
    ends: f64,
}

impl Sensors {
    /// The sensors of `uav`, which is at `pose` one tick before the flight; `None` if they are perfect.
    pub(crate) fn new(scenario: &Scenario, uav: UavId, pose: &Pose) -> Option<Self> {
        let section = &scenario.sensors;
        if section.are_perfect() {
            return None;
        }
        let draws = |kind| draws(scenario.seed, uav, kind, BEFORE);
        let steady = |kind, noise, deviation: f64| {
            let bias = deviation * draws(kind).normal();
            SteadySensor { kind, noise, bias }
        };
        let mut sensors = Self {
            uav,
            seed: scenario.seed,
            period_s: scenario.period_s(),
            receiver: Receiver::new(scenario, draws(Kind::Position), pose.position),
            compass: Compass::new(scenario, draws(Kind::Heading), pose.heading_rad),
            airspeed: steady(Kind::Airspeed, section.airspeed_noise_m_s, section.airspeed_bias_m_s),
            turn_rate: steady(Kind::TurnRate, section.turn_rate_noise_rad_s, section.turn_rate_bias_rad_s),
        };
        // Every UAV takes off with a fix.
        let mut receiving = sensors.draws(Kind::Position, Tick::APPROACH);
        sensors.receiver.measure(Tick::APPROACH, pose.position, &mut receiving);
        let mut turning = sensors.draws(Kind::Heading, Tick::APPROACH);
        sensors.compass.measure(Tick::APPROACH, pose.heading_rad, &mut turning);
        Some(sensors)
    }

    /// Reads the sensors that are due at `now`, at `pose`.
    pub(crate) fn advance(&mut self, now: Tick, pose: &Pose) {
        if let Some(elapsed_s) = self.receiver.sampling.due(now, self.period_s) {
            let mut draws = self.draws(Kind::Position, now);
            self.receiver.read(now, elapsed_s, pose.position, &mut draws);
        }
        if let Some(elapsed_s) = self.compass.sampling.due(now, self.period_s) {
            let mut draws = self.draws(Kind::Heading, now);
            self.compass.bias_rad.wander(elapsed_s, draws.normal());
            self.compass.measure(now, pose.heading_rad, &mut draws);
        }
    }

    /// The last fix and the last heading.
    pub(crate) fn pose(&self) -> Pose {
        Pose { position: self.receiver.fix.1, heading_rad: self.compass.reading.1 }
    }

    /// How many ticks before `now` position and heading were measured.
    pub(crate) fn ages_ticks(&self, now: Tick) -> [u32; 2] {
        [self.receiver.fix.0, self.compass.reading.0].map(|measured| now.since(measured).max(0) as u32)
    }

    /// Airspeed in m/s and turn rate in rad/s as read at `now`, where they truly are these.
    pub(crate) fn rates(&self, now: Tick, (speed_m_s, turn_rate_rad_s): (f64, f64)) -> (f64, f64) {
        let read = |sensor: &SteadySensor, truth: f64| {
            truth + sensor.bias + sensor.noise * self.draws(sensor.kind, now).normal()
        };
        // Dynamic pressure is never negative.
        (read(&self.airspeed, speed_m_s).max(0.0), read(&self.turn_rate, turn_rate_rad_s))
    }

    fn draws(&self, kind: Kind, tick: Tick) -> Draws {
        draws(self.seed, self.uav, kind, tick)
    }
}

fn draws(seed: u64, uav: UavId, kind: Kind, tick: Tick) -> Draws {
    Draws::new(seed, [PURPOSE, u64::from(uav.0), kind as u64], tick.0.cast_unsigned())
}

impl Receiver {
    fn new(scenario: &Scenario, mut draws: Draws, position: Point2<f64>) -> Self {
        let section = &scenario.sensors;
        let bias = |_| Bias::begun(section.position_bias_m, section.position_bias_time_s, draws.normal());
        Self {
            bias_m: std::array::from_fn(bias),
            sampling: Sampling::new(section.position_rate_hz, scenario),
            noise_m: section.position_noise_m,
            outage: Outage::new(section, scenario),
            fix: (Tick::APPROACH, position),
        }
    }

    fn read(&mut self, now: Tick, elapsed_s: f64, position: Point2<f64>, draws: &mut Draws) {
        // Draw for a fix that fails as well: then dropouts do not change the errors of the other fixes.
        self.outage.step(draws.uniform());
        self.bias_m.iter_mut().for_each(|bias| bias.wander(elapsed_s, draws.normal()));
        if !self.outage.is_out {
            self.measure(now, position, draws);
        }
    }

    fn measure(&mut self, now: Tick, position: Point2<f64>, draws: &mut Draws) {
        let [x, y] = self.bias_m.map(|bias| bias.value + self.noise_m * draws.normal());
        self.fix = (now, position + Vector2::new(x, y));
    }
}

impl Compass {
    fn new(scenario: &Scenario, mut draws: Draws, heading_rad: f64) -> Self {
        let section = &scenario.sensors;
        let deviation_rad = section.heading_bias_deg.to_radians();
        Self {
            sampling: Sampling::new(section.heading_rate_hz, scenario),
            noise_rad: section.heading_noise_deg.to_radians(),
            bias_rad: Bias::begun(deviation_rad, section.heading_bias_time_s, draws.normal()),
            reading: (Tick::APPROACH, heading_rad),
        }
    }

    fn measure(&mut self, now: Tick, heading_rad: f64, draws: &mut Draws) {
        let error_rad = self.bias_rad.value + self.noise_rad * draws.normal();
        self.reading = (now, wrap(heading_rad + error_rad));
    }
}

impl Sampling {
    /// `rate_hz` readings a second; 0 means one in every tick.
    fn new(rate_hz: f64, scenario: &Scenario) -> Self {
        let tick_rate_hz = f64::from(scenario.time.rate_hz);
        let readings_per_tick = if rate_hz > 0.0 { rate_hz / tick_rate_hz } else { 1.0 };
        Self { readings_per_tick, last: Tick::APPROACH }
    }

    /// The time since the reading before, if there is one at `now`.
    fn due(&mut self, now: Tick, period_s: f64) -> Option<f64> {
        let readings_until = |tick: i64| (tick as f64 * self.readings_per_tick + ROUNDING).floor();
        if readings_until(now.0) <= readings_until(now.0 - 1) {
            return None;
        }
        let elapsed_s = now.since(self.last) as f64 * period_s;
        self.last = now;
        Some(elapsed_s)
    }
}

impl Bias {
    /// A bias that has wandered for ever; `normal` is a draw.
    fn begun(deviation: f64, time_s: f64, normal: f64) -> Self {
        Self { value: deviation * normal, deviation, time_s }
    }

    /// Goes on by `elapsed_s`, in a step that is exact.
    fn wander(&mut self, elapsed_s: f64, normal: f64) {
        let new_share = -libm::expm1(-2.0 * elapsed_s / self.time_s);
        let kept = libm::exp(-elapsed_s / self.time_s);
        self.value = kept * self.value + self.deviation * new_share.sqrt() * normal;
    }
}

impl Outage {
    fn new(section: &SensorsSection, scenario: &Scenario) -> Self {
        let share = section.position_dropout;
        let tick_rate_hz = f64::from(scenario.time.rate_hz);
        let rate_hz = if section.position_rate_hz > 0.0 { section.position_rate_hz } else { tick_rate_hz };
        // A row of failed fixes has a mean length of 1 / ends. With 1 - share, each fix fails by itself, and rows are not shorter
        // than that.
        let ends = if section.position_dropout_s > 0.0 {
            (1.0 / (section.position_dropout_s * rate_hz)).min(1.0 - share)
        } else {
            1.0 - share
        };
        // In the long run, as many rows begin as end: (1 - share) begins = share ends.
        Self { is_out: false, begins: share * ends / (1.0 - share), ends }
    }

    fn step(&mut self, uniform: f64) {
        self.is_out = uniform < if self.is_out { 1.0 - self.ends } else { self.begins };
    }
}

/// `pose` as the sensors of `uav` see it at `now`, where those of `faults` that are on make them drift.
pub(crate) fn drifted(pose: &Pose, faults: &[AirframeFault], uav: UavId, now: Tick, period_s: f64) -> Pose {
    let mut seen = *pose;
    for fault in faults.iter().filter(|fault| fault.uav == uav && fault.is_on(now)) {
        let since_s = now.since(fault.begin) as f64 * period_s;
        match fault.failure {
            AirframeFailure::Drifting(SensorDrift::Position { speed_m_s, toward_rad }) => {
                seen.position += direction(toward_rad) * (speed_m_s * since_s);
            }
            AirframeFailure::Drifting(SensorDrift::Heading { rate_rad_s }) => {
                seen.heading_rad = wrap(seen.heading_rad + rate_rad_s * since_s);
            }
            AirframeFailure::Weak(_) | AirframeFailure::Jammed(_) => {}
        }
    }
    seen
}

#[cfg(test)]
mod tests;
