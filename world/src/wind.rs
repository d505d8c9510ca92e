//! The wind at one UAV: the mean wind, and Dryden gusts after MIL-F-8785C at low altitude.
//!
//! The gusts are two components, along and across the heading, because the standard aligns them with the velocity through the
//! air. Each is white noise that a filter has shaped; the draws are a pure function of seed, UAV and tick. Gusts at two UAVs are
//! independent, as if they were farther apart than a gust is long: so a swarm is shaken more than by one field of gusts.
//!
//! Never knows what the airframe makes of the wind.

use nalgebra::Vector2;
use ringwing_flight::{Tick, UavId, direction, draw::Draws};
use ringwing_scenario::{Scenario, WindSection};

/// Separates gusts from all other draws of the seed ("gust" in ASCII). Another value gives other gusts.
const PURPOSE: u64 = 0x6775_7374;
/// The standard counts in feet.
const FOOT_M: f64 = 0.3048;
/// Slowest airspeed at which gusts change, in m/s. The standard divides by the airspeed, and an airframe may be that slow.
const AIRSPEED_MIN_M_S: f64 = 1.0;

/// The wind at one UAV.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wind {
    mean_m_s: Vector2<f64>,
    /// `None` without turbulence.
    gusts: Option<Gusts>,
}

/// How strong and how long gusts are.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turbulence {
    /// Standard deviation of each horizontal component.
    deviation_m_s: f64,
    /// The scale length L of both horizontal components.
    length_m: f64,
}

/// The gusts at one UAV, and the filters that they come from.
#[derive(Debug, Clone, PartialEq)]
struct Gusts {
    turbulence: Turbulence,
    /// Along the heading.
    along_m_s: f64,
    /// The two states of the filter of the gusts across the heading.
    across: LateralFilter,
    seed: u64,
    uav: UavId,
    period_s: f64,
}

/// The filter of the lateral gusts, `(1 + sqrt(3) T s) / (1 + T s)^2` with T = L / V, as two first-order lags in a row. With white
/// noise at its input, its output is `sqrt(3) first + (1 - sqrt(3)) second`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LateralFilter {
    first: f64,
    second: f64,
}

impl Wind {
    /// The wind at `uav` before the flight; `None` in still air.
    pub(crate) fn new(scenario: &Scenario, uav: UavId) -> Option<Self> {
        let wind = &scenario.wind;
        let gusts = || Gusts::new(Turbulence::of(wind), scenario, uav);
        (!wind.is_still())
            .then(|| Self { mean_m_s: wind.mean_m_s(), gusts: (wind.turbulence_m_s > 0.0).then(gusts) })
    }

    /// The velocity of the air at a UAV that heads for `heading_rad`.
    pub(crate) fn velocity_m_s(&self, heading_rad: f64) -> Vector2<f64> {
        let Some(gusts) = &self.gusts else { return self.mean_m_s };
        let along = direction(heading_rad);
        self.mean_m_s + along * gusts.along_m_s + Vector2::new(-along.y, along.x) * gusts.across.gust()
    }

    /// Goes on from `now` to the next tick of a UAV that flies at `airspeed_m_s`.
    pub(crate) fn advance(&mut self, now: Tick, airspeed_m_s: f64) {
        if let Some(gusts) = &mut self.gusts {
            gusts.advance(now, airspeed_m_s);
        }
    }
}

impl Turbulence {
    /// Turbulence of low altitude: MIL-F-8785C, 3.7.3.4, where the vertical gusts have a tenth of the wind speed at 20 feet.
    fn of(wind: &WindSection) -> Self {
        let height_ft = wind.height_m / FOOT_M;
        let base = 0.177 + 0.000_823 * height_ft;
        Self {
            deviation_m_s: 0.1 * wind.turbulence_m_s / libm::pow(base, 0.4),
            length_m: height_ft / libm::pow(base, 1.2) * FOOT_M,
        }
    }
}

impl Gusts {
    fn new(turbulence: Turbulence, scenario: &Scenario, uav: UavId) -> Self {
        let mut gusts = Self {
            turbulence,
            along_m_s: 0.0,
            across: LateralFilter { first: 0.0, second: 0.0 },
            seed: scenario.seed,
            uav,
            period_s: scenario.period_s(),
        };
        // The turbulence is older than the flight: after an endless time, a gust is like any other.
        gusts.pass(f64::INFINITY, Tick(Tick::APPROACH.0 - 1));
        gusts
    }

    fn advance(&mut self, now: Tick, airspeed_m_s: f64) {
        // How far the UAV comes through the air, in lengths of a gust.
        let lengths = airspeed_m_s.max(AIRSPEED_MIN_M_S) * self.period_s / self.turbulence.length_m;
        self.pass(lengths, now);
    }

    /// Flies through `lengths` of a gust, in a step that is exact at constant airspeed.
    fn pass(&mut self, lengths: f64, now: Tick) {
        let mut draws = Draws::new(self.seed, [PURPOSE, u64::from(self.uav.0), 0], now.0.cast_unsigned());
        let [along, first, second] = std::array::from_fn(|_| draws.normal());
        let deviation_m_s = self.turbulence.deviation_m_s;
        let new_share = -libm::expm1(-2.0 * lengths);
        self.along_m_s = libm::exp(-lengths) * self.along_m_s + deviation_m_s * new_share.sqrt() * along;
        self.across = self.across.after(lengths, deviation_m_s, [first, second]);
    }
}

impl LateralFilter {
    fn gust(self) -> f64 {
        let root = 3_f64.sqrt();
        root * self.first + (1.0 - root) * self.second
    }

    /// After `lengths` of a gust; `normals` are two draws.
    ///
    /// With d = `lengths`, the homogeneous part is e^-d [1 0; d 1]. At rest the covariance of the two states is
    /// s^2 [1 1/2; 1/2 1/2] with s^2 = sigma^2 / 2, so that the variance of the output is sigma^2. What the step adds is that less what
    /// is left of it.
    fn after(self, lengths: f64, deviation_m_s: f64, normals: [f64; 2]) -> Self {
        let left = libm::exp(-lengths);
        // Endless time leaves nothing; infinity times that would not be a number.
        let carried = if left == 0.0 { 0.0 } else { lengths * left };
        let [first, both, second] = added(lengths).map(|share| share * deviation_m_s * deviation_m_s / 2.0);
        let spread = first.sqrt();
        // The Cholesky factor of the covariance. Rounding may leave a negative rest in a very short step.
        let tied = if spread > 0.0 { both / spread } else { 0.0 };
        let free = (second - tied * tied).max(0.0).sqrt();
        Self {
            first: left * self.first + spread * normals[0],
            second: left * self.second + carried * self.first + tied * normals[0] + free * normals[1],
        }
    }
}

/// The covariance that a step adds: of the first state, of both, and of the second, where that of the first at rest is 1.
fn added(lengths: f64) -> [f64; 3] {
    let squared = libm::exp(-2.0 * lengths);
    let remainder = |polynomial: f64| if squared == 0.0 { 0.0 } else { squared * polynomial };
    [
        -libm::expm1(-2.0 * lengths),
        0.5 - remainder(0.5 + lengths),
        0.5 - remainder(0.5 + lengths + lengths * lengths),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moderate turbulence at 100 m.
    fn moderate() -> Scenario {
        let mut scenario = Scenario::default();
        scenario.wind.turbulence_m_s = 15.4;
        // An exact step may be as long as one likes, and long ones give more independent gusts.
        scenario.time.rate_hz = 1;
        scenario
    }

    /// The gusts, along and across, of a UAV that flies straight at 20 m/s for `seconds`.
    fn flown(seconds: i64) -> [Vec<f64>; 2] {
        let mut gusts = Wind::new(&moderate(), UavId(3)).unwrap().gusts.unwrap();
        let mut series = [Vec::new(), Vec::new()];
        for tick in 0..seconds {
            series[0].push(gusts.along_m_s);
            series[1].push(gusts.across.gust());
            gusts.advance(Tick(tick), 20.0);
        }
        series
    }

    /// The mean product of two values that are `lag` apart.
    fn correlation(series: &[f64], lag: usize) -> f64 {
        let products = series.iter().zip(&series[lag..]).map(|(one, other)| one * other);
        products.sum::<f64>() / (series.len() - lag) as f64
    }

    #[test]
    fn the_standard_gives_strength_and_length_by_height() {
        let at = |height_m| {
            Turbulence::of(&WindSection { height_m, turbulence_m_s: 10.0, ..WindSection::default() })
        };
        let ceiling = at(304.8);
        assert!(
            (ceiling.deviation_m_s - 1.0).abs() < 1e-9 && (ceiling.length_m - 304.8).abs() < 1e-6,
            "{ceiling:?}"
        );
        // 200 ft: 0.3416^-0.4 = 1.5369, and 200 / 0.3416^1.2 = 725.8 ft.
        let low = at(60.96);
        assert!((low.deviation_m_s - 1.5369).abs() < 1e-3 && (low.length_m - 221.2).abs() < 0.2, "{low:?}");
    }

    #[test]
    fn gusts_have_the_variance_and_the_length_of_the_standard() {
        let Turbulence { deviation_m_s, length_m } = Turbulence::of(&moderate().wind);
        let [along, across] = flown(1_000_000);
        for series in [&along, &across] {
            let variance = correlation(series, 0) / (deviation_m_s * deviation_m_s);
            assert!((variance - 1.0).abs() < 0.05, "{variance}");
        }
        // A lag of 6 s is 120 m. The autocorrelation is e^(-x / L) along, and e^(-x / L) (1 - x / 2 L) across.
        let lag_m = 120.0;
        let of = |series: &[f64]| correlation(series, 6) / correlation(series, 0);
        let along_m = -lag_m / of(&along).ln();
        assert!((along_m / length_m - 1.0).abs() < 0.05, "{along_m} m instead of {length_m} m");
        let across_of = |length_m: f64| (-lag_m / length_m).exp() * (1.0 - lag_m / (2.0 * length_m));
        // It grows with the length: the measured value lies between those of lengths 5 % off.
        let measured = of(&across);
        assert!((across_of(0.95 * length_m)..across_of(1.05 * length_m)).contains(&measured), "{measured}");
    }

    #[test]
    fn many_short_steps_add_what_one_long_step_adds() {
        // The covariance after two steps is that of the first one, carried on, and that of the second.
        for lengths in [1e-3, 0.02, 0.7] {
            let [first, both, second] = added(lengths);
            let (left, carried) = ((-lengths).exp(), lengths * (-lengths).exp());
            let twice = [
                left * left * first + first,
                left * (left * both + carried * first) + both,
                left * left * second + 2.0 * left * carried * both + carried * carried * first + second,
            ];
            for (one, two) in added(2.0 * lengths).into_iter().zip(twice) {
                assert!((one - two).abs() < 1e-14, "{lengths}: {one} {two}");
            }
        }
        assert_eq!(added(f64::INFINITY), [1.0, 0.5, 0.5]);
    }

    #[test]
    fn gusts_repeat_for_a_seed_and_differ_between_uavs() {
        let gust = |seed, uav| {
            let scenario = Scenario { seed, ..moderate() };
            let mut wind = Wind::new(&scenario, UavId(uav)).unwrap();
            (0..50).for_each(|tick| wind.advance(Tick(tick), 15.0));
            wind.velocity_m_s(0.3)
        };
        assert_eq!(gust(1, 2), gust(1, 2));
        assert!(gust(1, 2) != gust(1, 3) && gust(1, 2) != gust(2, 2));
    }

    #[test]
    fn still_air_has_no_wind_and_a_steady_one_does_not_change() {
        assert_eq!(Wind::new(&Scenario::default(), UavId(1)), None);
        let mut scenario = Scenario::default();
        (scenario.wind.mean_speed_m_s, scenario.wind.from_deg) = (6.0, 180.0);
        let mut wind = Wind::new(&scenario, UavId(1)).unwrap();
        wind.advance(Tick(0), 15.0);
        assert!((wind.velocity_m_s(1.0) - Vector2::new(6.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn gusts_along_and_across_the_heading_add_to_the_mean_wind() {
        let mut wind = Wind::new(&moderate(), UavId(3)).unwrap();
        wind.mean_m_s = Vector2::new(6.0, -1.0);
        let gusts = wind.gusts.as_mut().unwrap();
        // With two equal states the output of the lateral filter is that state.
        (gusts.along_m_s, gusts.across) = (3.0, LateralFilter { first: 2.0, second: 2.0 });
        let (sin, cos) = 0.5_f64.sin_cos();
        let expected = Vector2::new(6.0 + 3.0 * cos - 2.0 * sin, -1.0 + 3.0 * sin + 2.0 * cos);
        assert!((wind.velocity_m_s(0.5) - expected).norm() < 1e-12);
    }

    #[test]
    fn a_gust_forgets_as_the_uav_flies_through_it_and_takes_in_the_draw_of_the_tick() {
        let mut scenario = moderate();
        scenario.time.rate_hz = 100;
        let mut wind = Wind::new(&scenario, UavId(3)).unwrap();
        let Turbulence { deviation_m_s, length_m } = Turbulence::of(&scenario.wind);
        let before_m_s = wind.gusts.as_ref().unwrap().along_m_s;
        wind.advance(Tick(7), 20.0);
        // A first-order Markov process after 0.2 m.
        let left = (-0.2 / length_m).exp();
        let draw = Draws::new(scenario.seed, [PURPOSE, 3, 0], 7).normal();
        let expected = left * before_m_s + deviation_m_s * (1.0 - left * left).sqrt() * draw;
        assert!((wind.gusts.unwrap().along_m_s - expected).abs() < 1e-9);
    }

    #[test]
    fn a_step_of_the_lateral_filter_spreads_its_draws_by_the_covariance_that_it_adds() {
        let calm = LateralFilter { first: 0.0, second: 0.0 };
        for lengths in [0.02, 0.7, f64::INFINITY] {
            let [one, other] = [[1.0, 0.0], [0.0, 1.0]].map(|normals| calm.after(lengths, 3.0, normals));
            let covariance = [
                one.first * one.first + other.first * other.first,
                one.first * one.second + other.first * other.second,
                one.second * one.second + other.second * other.second,
            ];
            for (found, share) in covariance.into_iter().zip(added(lengths)) {
                assert!((found - share * 9.0 / 2.0).abs() < 1e-12, "{lengths}: {found}");
            }
            assert!(other.second > 0.0 && other.first == 0.0, "the factor is that of Cholesky");
        }
        let here = LateralFilter { first: 2.0, second: -1.0 };
        // Without new gusts the states decay, and the first one flows into the second.
        let (left, later) = ((-0.7_f64).exp(), here.after(0.7, 0.0, [1.0, 1.0]));
        assert!((later.first - 2.0 * left).abs() < 1e-12);
        assert!((later.second - left * (0.7 * 2.0 - 1.0)).abs() < 1e-12);
        assert_eq!(here.after(0.0, 3.0, [1.0, 1.0]), here, "a step of no length changes nothing");
    }
}
