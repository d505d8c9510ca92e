//! An aircraft that nobody controls, and what a UAV can know of it.
//!
//! A cooperative one reports its true position, speed and heading. Of any other, a radar measures the position; speed and
//! heading follow from two measurements. Errors of a radar are a pure function of seed, UAV, intruder and tick. Never gives
//! way to anybody.

use nalgebra::{Point2, Vector2};
use ringwing_flight::{
    AircraftId, IntruderId, Pose, Route, RoutePoint, SensedAircraft, Tick, UavId, draw::Draws,
};
use ringwing_scenario::{IntruderSection, Scenario};

/// Separates the errors of radars from all other draws of the seed ("radar" in ASCII). Another value gives other errors.
const PURPOSE: u64 = 0x72_6164_6172;

/// An intruder at one moment.
#[derive(Debug, Clone)]
pub(crate) struct Intruder {
    id: IntruderId,
    cooperative: bool,
    route: Route,
    now: RoutePoint,
}

/// The radar that every UAV has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Radar {
    seed: u64,
    rate_hz: u32,
    range_m: f64,
    noise_m: f64,
    track_ticks: i64,
}

impl Intruder {
    pub(crate) fn new(number: u32, section: &IntruderSection, time_s: f64) -> Self {
        let route = section.route();
        Self { id: IntruderId(number), cooperative: section.cooperative, now: route.at(time_s), route }
    }

    pub(crate) fn id(&self) -> IntruderId {
        self.id
    }

    pub(crate) fn position(&self) -> Point2<f64> {
        self.now.pose.position
    }

    /// Moves it to where it is at `time_s`.
    pub(crate) fn move_to(&mut self, time_s: f64) {
        self.now = self.route.at(time_s);
    }

    /// How far it is noticed.
    pub(crate) fn range_m(&self, traffic_range_m: f64, radar: &Radar) -> f64 {
        if self.cooperative { traffic_range_m } else { radar.range_m }
    }

    /// What UAV `by` knows of it at `now`.
    pub(crate) fn sensed(&self, by: UavId, now: Tick, radar: &Radar) -> SensedAircraft {
        let RoutePoint { pose: Pose { position, heading_rad }, speed_m_s, .. } = self.now;
        let reported = SensedAircraft {
            position_m: position.into(),
            heading_rad,
            speed_m_s,
            turn_rate_rad_s: 0.0,
            who: AircraftId::intruder(self.id),
            is_answering: 0,
        };
        if self.cooperative { reported } else { self.tracked(by, now, radar, reported) }
    }

    /// What a radar makes of two measurements.
    fn tracked(&self, by: UavId, now: Tick, radar: &Radar, reported: SensedAircraft) -> SensedAircraft {
        let before = Tick(now.0 - radar.track_ticks);
        let here = self.position() + self.error_m(by, now, radar);
        let there =
            self.route.at(before.seconds(radar.rate_hz)).pose.position + self.error_m(by, before, radar);
        // Both ends have errors of their own, so a noisy radar also gives a wrong speed and heading, as a real track
        // would.
        let way = here - there;
        SensedAircraft {
            position_m: here.into(),
            heading_rad: libm::atan2(way.y, way.x),
            speed_m_s: way.norm() / Tick(radar.track_ticks).seconds(radar.rate_hz),
            ..reported
        }
    }

    fn error_m(&self, by: UavId, tick: Tick, radar: &Radar) -> Vector2<f64> {
        // A perfect radar needs no draws, which cost more than everything else here.
        if radar.noise_m == 0.0 {
            return Vector2::zeros();
        }
        let words = [PURPOSE, u64::from(by.0), u64::from(self.id.0)];
        let mut draws = Draws::new(radar.seed, words, tick.0.cast_unsigned());
        Vector2::new(draws.normal(), draws.normal()) * radar.noise_m
    }
}

impl Radar {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let (sensing, rate_hz) = (&scenario.sensing, scenario.time.rate_hz);
        Self {
            seed: scenario.seed,
            rate_hz,
            range_m: sensing.radar_range_m,
            noise_m: sensing.radar_noise_m,
            // With 0 ticks both measurements would be the same one, and the speed 0 / 0.
            track_ticks: ((sensing.radar_track_s * f64::from(rate_hz)).round() as i64).max(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BY: UavId = UavId(2);

    /// An intruder on a circle, 10 m/s fast, at tick 300 of 100 Hz, and a radar with this noise.
    fn seen(cooperative: bool, noise_m: f64, tick: i64) -> SensedAircraft {
        let mut scenario = Scenario::default();
        scenario.sensing.radar_noise_m = noise_m;
        let section = IntruderSection {
            position_m: [0.0, 0.0],
            heading_deg: 0.0,
            speed_m_s: 10.0,
            cooperative,
            turn_rate_rad_s: 0.2,
            waypoints_m: Vec::new(),
            repeat: false,
        };
        let now = Tick(tick);
        Intruder::new(1, &section, now.seconds(100)).sensed(BY, now, &Radar::new(&scenario))
    }

    #[test]
    fn a_cooperative_intruder_is_known_as_it_is_and_another_as_a_radar_tracks_it() {
        let known = seen(true, 5.0, 300);
        assert!((known.heading_rad - 0.6).abs() < 1e-12 && known.speed_m_s == 10.0);
        let tracked = seen(false, 0.0, 300);
        assert_eq!(tracked.position_m, known.position_m);
        // The way of the last second is that of half a second ago, and its chord is a little shorter than the arc.
        assert!((tracked.heading_rad - 0.5).abs() < 1e-9, "{tracked:?}");
        assert!((9.95..10.0).contains(&tracked.speed_m_s));
        assert_eq!(tracked.turn_rate_rad_s, 0.0);
    }

    #[test]
    fn the_radars_errors_have_their_size_and_repeat() {
        let error_m = |tick| {
            let (noisy, exact) = (seen(false, 3.0, tick).position_m, seen(false, 0.0, tick).position_m);
            [noisy[0] - exact[0], noisy[1] - exact[1]]
        };
        assert_eq!(error_m(7), error_m(7));
        let mean_m2 = (0..2000).map(error_m).map(|[x, y]| x * x + y * y).sum::<f64>() / 2000.0;
        assert!((mean_m2 - 18.0).abs() < 1.5, "two coordinates with a variance of 9 m^2: {mean_m2}");
    }
}
