//! What a UAV has received from another UAV or from the leader, and where that sender is now.
//!
//! Never gets a sample before it can be used: the [arrivals](crate::reception::arrivals) see to that.

use nalgebra::{Point2, Vector2};
use ringwing_flight::{AgeTicks, LeaderState, Pose, Tick, UavState};
use ringwing_scenario::DeadReckoning;

/// Where a UAV or the leader was at one tick, and how it flies on from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeerTrack {
    /// The tick of the sample.
    pub tick: Tick,
    /// Where it was then.
    pub pose: Pose,
    /// Its speed from that tick on.
    pub speed_m_s: f64,
    /// Its turn rate from that tick on.
    pub turn_rate_rad_s: f64,
}

impl PeerTrack {
    /// `None` if a number is not finite: then the sample is damaged, because no sender of this project sends such
    /// numbers.
    fn new(
        tick: Tick,
        position_m: [f64; 2],
        heading_rad: f64,
        speed_m_s: f64,
        turn_rate_rad_s: f64,
    ) -> Option<Self> {
        let [x, y] = position_m;
        let is_finite =
            [x, y, heading_rad, speed_m_s, turn_rate_rad_s].iter().all(|number| number.is_finite());
        let pose = Pose { position: Point2::new(x, y), heading_rad };
        is_finite.then_some(Self { tick, pose, speed_m_s, turn_rate_rad_s })
    }

    pub(super) fn of_uav(state: &UavState) -> Option<Self> {
        Self::new(state.tick, state.position_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s)
    }

    pub(super) fn of_leader(state: &LeaderState) -> Option<Self> {
        Self::new(state.tick, state.position_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s)
    }

    /// Where it is after `seconds`, if it holds its speed and turn rate.
    pub fn after(&self, seconds: f64) -> Pose {
        self.pose.after(self.speed_m_s, self.turn_rate_rad_s, seconds)
    }

    /// Where the leader is at `now`: predicted along its arc, as far as `reckoning` allows.
    pub(super) fn along_arc(&self, now: Tick, reckoning: DeadReckoning, period_s: f64) -> Pose {
        let duration_s = self.predicted_ticks(now, reckoning) as f64 * period_s;
        self.after(duration_s)
    }

    /// Where a UAV is at `now`: predicted along its arc for one tick, and after that turning at `formation_rad_s`, as the
    /// whole formation does, in a wind of `wind_m_s`, as far as `reckoning` allows.
    ///
    /// A UAV holds its turn rate for one tick; then the stiff heading loop of Eq. (6) commands another one. Data may
    /// be seconds old, and a momentary turn extended over seconds makes a circle that the UAV does not fly. The whole
    /// swarm would follow it and oscillate.
    pub(super) fn with_formation_after_one_tick(
        &self,
        now: Tick,
        reckoning: DeadReckoning,
        formation_rad_s: f64,
        period_s: f64,
        wind_m_s: Vector2<f64>,
    ) -> Pose {
        let predicted = self.predicted_ticks(now, reckoning);
        let held = predicted.min(1);
        let pose = self.pose.after(self.speed_m_s, self.turn_rate_rad_s, held as f64 * period_s);
        // Skip a part of no length: it could still round the last bit.
        let pose = if predicted == held {
            pose
        } else {
            pose.after(self.speed_m_s, formation_rad_s, (predicted - held) as f64 * period_s)
        };
        pose.carried(wind_m_s, predicted as f64 * period_s)
    }

    fn predicted_ticks(&self, now: Tick, reckoning: DeadReckoning) -> i64 {
        // An exchange between processes takes one tick, while the paper assumes none. `Tick` makes up for that and no
        // more.
        let age = now.since(self.tick);
        match reckoning {
            DeadReckoning::Off => 0,
            DeadReckoning::Tick => age.min(1),
            DeadReckoning::Full => age,
        }
    }
}

/// The newest track of one sender.
#[derive(Debug, Clone, Default)]
pub(super) struct NewestTrack(Option<PeerTrack>);

impl NewestTrack {
    /// Keeps `track` if it is newer than what is known: links with faults deliver out of order.
    pub(super) fn update(&mut self, track: PeerTrack) {
        if self.0.is_none_or(|known| known.tick < track.tick) {
            self.0 = Some(track);
        }
    }

    pub(super) fn get(&self) -> Option<&PeerTrack> {
        self.0.as_ref()
    }
}

/// The age of `track` at `now`, or "never received".
pub(super) fn age(track: Option<&PeerTrack>, now: Tick) -> AgeTicks {
    track.map_or(AgeTicks::NEVER, |track| AgeTicks::between(track.tick, now))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(tick: i64) -> PeerTrack {
        PeerTrack::new(Tick(tick), [tick as f64, 0.0], 0.0, 15.0, 0.0).unwrap()
    }

    #[test]
    fn a_late_sample_does_not_replace_a_newer_one() {
        let mut newest = NewestTrack::default();
        for tick in [7, 8, 10, 9, 2] {
            newest.update(at(tick));
        }
        newest.update(PeerTrack { speed_m_s: 9.0, ..at(10) });
        assert_eq!(newest.get(), Some(&at(10)), "nor does a second one of the same tick");
    }

    #[test]
    fn old_data_are_predicted_as_far_as_dead_reckoning_allows() {
        let x = |reckoning| at(0).along_arc(Tick(20), reckoning, 0.01).position.x;
        assert!((x(DeadReckoning::Off) - 0.0).abs() < 1e-12);
        assert!((x(DeadReckoning::Tick) - 0.15).abs() < 1e-12);
        assert!((x(DeadReckoning::Full) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_uav_is_predicted_to_turn_for_one_tick_and_the_leader_for_the_whole_time() {
        let turning = PeerTrack { turn_rate_rad_s: 0.5, ..at(0) };
        let full = DeadReckoning::Full;
        let uav = |now, reckoning, formation_rad_s| {
            let still = Vector2::zeros();
            turning.with_formation_after_one_tick(Tick(now), reckoning, formation_rad_s, 0.01, still)
        };
        let leader = turning.along_arc(Tick(200), full, 0.01);
        assert!((leader.heading_rad - 1.0).abs() < 1e-12);
        assert!((uav(200, full, 0.0).heading_rad - 0.005).abs() < 1e-12);
        assert_eq!(uav(1, full, 0.0), turning.along_arc(Tick(1), full, 0.01));
        assert_eq!(uav(200, DeadReckoning::Off, 0.0), turning.pose);
        // While the formation turns, a UAV goes on turning with it.
        assert!((uav(200, full, -0.1).heading_rad - (0.005 - 0.199)).abs() < 1e-12);
    }

    #[test]
    fn a_uav_is_predicted_to_drift_with_the_wind() {
        let drift = |reckoning| {
            let wind_m_s = Vector2::new(0.0, 5.0);
            at(0).with_formation_after_one_tick(Tick(20), reckoning, 0.0, 0.01, wind_m_s).position.y
        };
        assert!((drift(DeadReckoning::Full) - 1.0).abs() < 1e-12);
        assert!((drift(DeadReckoning::Tick) - 0.05).abs() < 1e-12 && drift(DeadReckoning::Off) == 0.0);
    }

    #[test]
    fn a_sample_with_a_number_that_is_not_finite_is_ignored() {
        assert_eq!(PeerTrack::new(Tick(0), [f64::NAN, 0.0], 0.0, 15.0, 0.0), None);
        assert_eq!(PeerTrack::new(Tick(0), [0.0, 0.0], 0.0, f64::INFINITY, 0.0), None);
    }

    #[test]
    fn data_that_were_never_received_have_no_age() {
        assert_eq!(age(None, Tick(5)).ticks(), None);
        assert_eq!(age(Some(&at(2)), Tick(5)).ticks(), Some(3));
    }
}
