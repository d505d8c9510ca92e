//! A UAV's estimate of where it is and how the air moves, from all of its sensors.
//!
//! Between two fixes, airspeed, heading and turn rate say how far the UAV has come through the air. A fix that lies elsewhere says
//! that the wind is another one, or that the fix is wrong; the variances decide how much of both. The same goes for the heading, with a
//! compass in place of the receiver and the bias of the gyroscope in place of the wind. So position and wind are one filter, and its
//! estimate of the wind is whatever carries the UAV away, including errors of airspeed and heading.
//!
//! The filter knows the data sheet of its sensors, which is `[sensors]`, and no bias. A bias of the receiver or of the compass looks like
//! the truth to it, so it stays in the estimate.
//!
//! Never knows more than the UAV senses of itself. With perfect sensors it does nothing, so that the flight keeps its bits.

mod offset_filter;

use nalgebra::Vector2;
use offset_filter::OffsetFilter;
use ringwing_flight::{Pose, Sensed, Tick, wrap};
use ringwing_scenario::Scenario;

/// How fast the wind may change: its standard deviation after a second, squared, in m^2/s^3. A larger value follows gusts sooner and
/// passes on more of the noise of fixes. Moderate gusts at 150 m have 2 s^2 V / L = 0.4.
const WIND_WALK: f64 = 0.4;
/// How fast the bias of a gyroscope may change, in rad^2/s^3. A larger value trusts the compass more, and so its noise.
const GYROSCOPE_WALK: f64 = 1e-8;
/// Standard deviation of the wind before the first fix for a UAV that is not told the wind, in m/s. A smaller value would take longer to
/// find a strong wind.
const WIND_UNKNOWN_M_S: f64 = 15.0;
/// The same for a UAV that is told the mean wind and not the gusts.
const WIND_TOLD_M_S: f64 = 3.0;
/// Smallest noise of a fix that the filter assumes, in m, and of a compass, in rad. With less it would follow every error of the model.
const NOISE_MIN: (f64, f64) = (0.05, 0.002);
/// Smallest bias of a gyroscope that the filter assumes, in rad/s. With none it would not look for one.
const GYROSCOPE_BIAS_MIN_RAD_S: f64 = 0.001;
/// After a longer gap in the senses the filter begins anew: nobody knows how the UAV flew meanwhile.
const LONGEST_GAP_S: f64 = 1.0;

/// One UAV's estimate of its own flight.
#[derive(Debug, Clone)]
pub(super) struct OwnEstimate {
    /// `None` for a UAV that uses its readings as they are.
    assumed: Option<Assumed>,
    /// `None` before the first senses.
    filter: Option<Filter>,
}

/// What the filter assumes of the sensors and of the wind.
#[derive(Debug, Clone)]
struct Assumed {
    period_s: f64,
    position_variance: f64,
    heading_variance: f64,
    airspeed_noise_m_s: f64,
    turn_rate_noise_rad_s: f64,
    turn_rate_bias_rad_s: f64,
    wind_m_s: Vector2<f64>,
    wind_deviation_m_s: f64,
}

#[derive(Debug, Clone)]
struct Filter {
    /// The tick of the estimate.
    tick: Tick,
    /// When the newest readings that were used were taken.
    fixed: Tick,
    aligned: Tick,
    east: OffsetFilter,
    north: OffsetFilter,
    heading: OffsetFilter,
}

impl OwnEstimate {
    /// What a UAV of `scenario` knows before it has sensed anything.
    pub(super) fn new(scenario: &Scenario) -> Self {
        let is_needed = scenario.control.pose_estimated && !scenario.sensors.are_perfect();
        Self { assumed: is_needed.then(|| Assumed::new(scenario)), filter: None }
    }

    /// Takes in what the UAV senses; the samples come in order of their ticks.
    pub(super) fn observe(&mut self, senses: &Sensed) {
        let Some(assumed) = &self.assumed else { return };
        let is_usable = |filter: &Filter| {
            let gap_s = senses.tick.since(filter.tick) as f64 * assumed.period_s;
            gap_s <= LONGEST_GAP_S
        };
        match self.filter.as_mut().filter(|filter| is_usable(filter)) {
            Some(filter) => filter.observe(senses, assumed),
            None => self.filter = Some(Filter::begun(senses, assumed)),
        }
    }

    /// Where the UAV was and headed when it took `senses`: as estimated, or as read without an estimate.
    pub(super) fn pose(&self, senses: &Sensed) -> Pose {
        let of_senses = self.filter.as_ref().filter(|filter| filter.tick == senses.tick);
        let read = || Pose { position: senses.position_m.into(), heading_rad: senses.heading_rad };
        of_senses.map_or_else(read, Filter::pose)
    }

    /// The velocity of the air that the fixes show, in m/s; `None` for a UAV that uses its readings as they are.
    pub(super) fn wind_m_s(&self) -> Option<Vector2<f64>> {
        self.filter.as_ref().map(Filter::wind_m_s)
    }
}

impl Assumed {
    fn new(scenario: &Scenario) -> Self {
        let sensors = &scenario.sensors;
        let squared = |value: f64| value * value;
        let is_told = scenario.wind.known;
        Self {
            period_s: scenario.period_s(),
            position_variance: squared(sensors.position_noise_m.max(NOISE_MIN.0)),
            heading_variance: squared(sensors.heading_noise_deg.to_radians().max(NOISE_MIN.1)),
            airspeed_noise_m_s: sensors.airspeed_noise_m_s,
            turn_rate_noise_rad_s: sensors.turn_rate_noise_rad_s,
            turn_rate_bias_rad_s: sensors.turn_rate_bias_rad_s.max(GYROSCOPE_BIAS_MIN_RAD_S),
            wind_m_s: if is_told { scenario.wind.mean_m_s() } else { Vector2::zeros() },
            wind_deviation_m_s: if is_told { WIND_TOLD_M_S } else { WIND_UNKNOWN_M_S },
        }
    }
}

impl Filter {
    /// Begins with the readings as they are.
    fn begun(senses: &Sensed, assumed: &Assumed) -> Self {
        let [x, y] = senses.position_m;
        let wind_variance = assumed.wind_deviation_m_s * assumed.wind_deviation_m_s;
        let along = |value, wind_m_s| {
            OffsetFilter::begun([value, assumed.position_variance], [wind_m_s, wind_variance], WIND_WALK)
        };
        let bias_variance = assumed.turn_rate_bias_rad_s * assumed.turn_rate_bias_rad_s;
        Self {
            tick: senses.tick,
            fixed: fixed_at(senses),
            aligned: aligned_at(senses),
            east: along(x, assumed.wind_m_s.x),
            north: along(y, assumed.wind_m_s.y),
            heading: OffsetFilter::begun(
                [senses.heading_rad, assumed.heading_variance],
                [0.0, bias_variance],
                GYROSCOPE_WALK,
            ),
        }
    }

    fn observe(&mut self, senses: &Sensed, assumed: &Assumed) {
        self.predict(senses, assumed);
        // The readings repeat until there are new ones, and each of them counts once. Between ticks of the sensor, a reading may be
        // older than the senses that bring it: then compare it with where the UAV was.
        let aligned = aligned_at(senses);
        if aligned > self.aligned {
            self.aligned = aligned;
            let then = self.pose_before(senses, senses.tick.since(aligned) as f64 * assumed.period_s);
            self.heading.correct(wrap(senses.heading_rad - then.heading_rad), assumed.heading_variance);
            self.heading.value = wrap(self.heading.value);
        }
        let fixed = fixed_at(senses);
        if fixed > self.fixed {
            self.fixed = fixed;
            let then = self.pose_before(senses, senses.tick.since(fixed) as f64 * assumed.period_s);
            let [x, y] = senses.position_m;
            self.east.correct(x - then.position.x, assumed.position_variance);
            self.north.correct(y - then.position.y, assumed.position_variance);
        }
    }

    /// Goes on to the tick of `senses`, which say how fast the UAV flew and turned on the way.
    fn predict(&mut self, senses: &Sensed, assumed: &Assumed) {
        let elapsed_s = senses.tick.since(self.tick) as f64 * assumed.period_s;
        self.tick = senses.tick;
        let before = self.pose();
        let flown = before.after(senses.speed_m_s, self.turn_rate_rad_s(senses), elapsed_s);
        let way = flown.position - before.position;
        let squared = |error: f64| error * error;
        let way_variance = squared(assumed.airspeed_noise_m_s * elapsed_s);
        self.east.predict(way.x, way_variance, elapsed_s);
        self.north.predict(way.y, way_variance, elapsed_s);
        let turn_variance = squared(assumed.turn_rate_noise_rad_s * elapsed_s);
        self.heading.predict(senses.turn_rate_rad_s * elapsed_s, turn_variance, elapsed_s);
        self.heading.value = wrap(self.heading.value);
    }

    /// Where the UAV was `age_s` ago, if it flew as in `senses` since.
    fn pose_before(&self, senses: &Sensed, age_s: f64) -> Pose {
        let back = self.pose().after(senses.speed_m_s, self.turn_rate_rad_s(senses), -age_s);
        back.carried(self.wind_m_s(), -age_s)
    }

    fn turn_rate_rad_s(&self, senses: &Sensed) -> f64 {
        senses.turn_rate_rad_s + self.heading.offset
    }

    fn pose(&self) -> Pose {
        Pose { position: [self.east.value, self.north.value].into(), heading_rad: self.heading.value }
    }

    fn wind_m_s(&self) -> Vector2<f64> {
        Vector2::new(self.east.offset, self.north.offset)
    }
}

/// When the position in `senses` was measured.
fn fixed_at(senses: &Sensed) -> Tick {
    Tick(senses.tick.0 - i64::from(senses.position_age_ticks))
}

/// When the heading in `senses` was measured.
fn aligned_at(senses: &Sensed) -> Tick {
    Tick(senses.tick.0 - i64::from(senses.heading_age_ticks))
}

#[cfg(test)]
mod tests;
