//! What a UAV has heard of another: a ring neighbour or the leader.
//!
//! Never hears of a tick before the next: what comes before its time waits in the [arrivals](crate::reception::arrivals).

use nalgebra::Point2;
use ringwing_flight::{AgeTicks, LeaderState, Pose, Tick, UavState};
use ringwing_scenario::DeadReckoning;

/// A moving thing at one moment, and how it flies on from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// The moment.
    pub tick: Tick,
    /// Where it was.
    pub pose: Pose,
    /// Speed from that moment on.
    pub speed_m_s: f64,
    /// Turn rate from that moment on.
    pub turn_rate_rad_s: f64,
}

impl Track {
    /// `None` where a number is not finite: no sender of ours sends such.
    fn new(
        tick: Tick,
        position_m: [f64; 2],
        heading_rad: f64,
        speed_m_s: f64,
        turn_rate_rad_s: f64,
    ) -> Option<Self> {
        let [x, y] = position_m;
        let finite = [x, y, heading_rad, speed_m_s, turn_rate_rad_s].iter().all(|number| number.is_finite());
        let pose = Pose { position: Point2::new(x, y), heading_rad };
        finite.then_some(Self { tick, pose, speed_m_s, turn_rate_rad_s })
    }

    /// What a neighbour sent.
    pub fn of_uav(state: &UavState) -> Option<Self> {
        Self::new(state.tick, state.position_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s)
    }

    /// What the leader sent.
    pub fn of_leader(state: &LeaderState) -> Option<Self> {
        Self::new(state.tick, state.position_m, state.heading_rad, state.speed_m_s, state.turn_rate_rad_s)
    }

    /// Where it is at `now`, predicted along its arc as far as `reckoning` allows.
    pub fn reckoned(&self, now: Tick, reckoning: DeadReckoning, period_s: f64) -> Pose {
        let duration_s = self.predicted(now, reckoning) as f64 * period_s;
        self.pose.after(self.speed_m_s, self.turn_rate_rad_s, duration_s)
    }

    /// The same of a UAV, straight on from the second tick.
    ///
    /// A UAV holds its turn rate for a tick; the stiff heading loop of Eq. (6) has another one for the next. Prolonged by
    /// the seconds that data may be old, a moment's turn would be a wrong circle, and the swarm would swing by it.
    pub fn foreseen(&self, now: Tick, reckoning: DeadReckoning, period_s: f64) -> Pose {
        let predicted = self.predicted(now, reckoning);
        let turned = predicted.min(1);
        let pose = self.pose.after(self.speed_m_s, self.turn_rate_rad_s, turned as f64 * period_s);
        if predicted == turned {
            pose
        } else {
            pose.after(self.speed_m_s, 0.0, (predicted - turned) as f64 * period_s)
        }
    }

    /// How many ticks ahead it is predicted.
    fn predicted(&self, now: Tick, reckoning: DeadReckoning) -> i64 {
        let age = now.since(self.tick);
        match reckoning {
            DeadReckoning::Off => 0,
            DeadReckoning::Tick => age.min(1),
            DeadReckoning::Full => age,
        }
    }
}

/// The newest that was heard of one other.
#[derive(Debug, Clone, Default)]
pub struct Link {
    heard: Option<Track>,
}

impl Link {
    /// Takes in what came, in whatever order.
    pub fn hear(&mut self, track: Track) {
        if self.heard.is_none_or(|heard| heard.tick < track.tick) {
            self.heard = Some(track);
        }
    }

    /// The newest that was heard.
    pub fn newest(&self) -> Option<&Track> {
        self.heard.as_ref()
    }
}

/// How old `track` is at `now`, or that there is none.
pub fn age(track: Option<&Track>, now: Tick) -> AgeTicks {
    track.map_or(AgeTicks::NEVER, |track| AgeTicks::between(track.tick, now))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(tick: i64) -> Track {
        Track::new(Tick(tick), [tick as f64, 0.0], 0.0, 15.0, 0.0).unwrap()
    }

    #[test]
    fn what_comes_late_does_not_replace_what_is_newer() {
        let mut link = Link::default();
        for tick in [7, 8, 10, 9, 2] {
            link.hear(at(tick));
        }
        assert_eq!(link.newest(), Some(&at(10)));
    }

    #[test]
    fn old_data_are_predicted_as_far_as_allowed() {
        let x = |reckoning| at(0).reckoned(Tick(20), reckoning, 0.01).position.x;
        assert!((x(DeadReckoning::Off) - 0.0).abs() < 1e-12);
        assert!((x(DeadReckoning::Tick) - 0.15).abs() < 1e-12);
        assert!((x(DeadReckoning::Full) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_uav_is_foreseen_to_turn_for_a_tick_and_a_leader_all_the_time() {
        let turning = Track { turn_rate_rad_s: 0.5, ..at(0) };
        let heading = |pose: Pose| pose.heading_rad;
        let full = DeadReckoning::Full;
        assert!((heading(turning.reckoned(Tick(200), full, 0.01)) - 1.0).abs() < 1e-12);
        assert!((heading(turning.foreseen(Tick(200), full, 0.01)) - 0.005).abs() < 1e-12);
        assert_eq!(turning.foreseen(Tick(1), full, 0.01), turning.reckoned(Tick(1), full, 0.01));
        assert_eq!(turning.foreseen(Tick(200), DeadReckoning::Off, 0.01), turning.pose);
    }

    #[test]
    fn what_is_not_finite_is_not_heard() {
        assert_eq!(Track::new(Tick(0), [f64::NAN, 0.0], 0.0, 15.0, 0.0), None);
        assert_eq!(Track::new(Tick(0), [0.0, 0.0], 0.0, f64::INFINITY, 0.0), None);
    }

    #[test]
    fn what_was_never_heard_has_no_age() {
        assert_eq!(age(None, Tick(5)).ticks(), None);
        assert_eq!(age(Some(&at(2)), Tick(5)).ticks(), Some(3));
    }
}
