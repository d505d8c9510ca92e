//! Where a UAV assumes the leader to be: it predicts a silent leader, and avoids a jump when the leader is heard
//! again.
//!
//! Never plans a path: a silent leader flies on along its last arc.

use super::track::{NewestTrack, PeerTrack};
use nalgebra::Vector2;
use ringwing_flight::{LeaderState, Pose, Tick};
use ringwing_scenario::DeadReckoning;

/// The part of a jump that is left after one second. Less corrects faster and moves the slots faster; 0 is the bare
/// jump.
const LEFT_AFTER_1_S: f64 = 0.37;
/// Ignore jumps below rounding error: two predictions of the same position differ by less than this. A larger value
/// lets small jumps through.
const SMALLEST_JUMP_M: f64 = 1e-6;

/// The leader as one UAV has received it.
#[derive(Debug, Clone, Default)]
pub(super) struct LeaderEstimate {
    newest: NewestTrack,
    /// The track of the last estimate.
    used: Option<PeerTrack>,
    /// From the predicted position to the estimate; it decays.
    offset: Vector2<f64>,
}

impl LeaderEstimate {
    /// Takes in what the leader sent.
    pub(super) fn receive(&mut self, state: &LeaderState) {
        if let Some(track) = PeerTrack::of_leader(state) {
            self.newest.update(track);
        }
    }

    /// The newest track, and the leader's pose at `now`; `None` before anything was received.
    pub(super) fn at(
        &mut self,
        now: Tick,
        reckoning: DeadReckoning,
        period_s: f64,
    ) -> Option<(PeerTrack, Pose)> {
        let track = *self.newest.get()?;
        let mut pose = track.along_arc(now, reckoning, period_s);
        // The paper's law uses the received state as it is.
        if reckoning == DeadReckoning::Full {
            self.smooth(&track, &pose, now, period_s);
            pose.position += self.offset;
        }
        Some((track, pose))
    }

    /// Adds the jump of the prediction at a new track to the offset, and lets the offset decay.
    fn smooth(&mut self, track: &PeerTrack, pose: &Pose, now: Tick, period_s: f64) {
        if let Some(used) = self.used.filter(|used| used.tick != track.tick) {
            // Add the jump to the offset, so that the estimate stays where it was. All slots are measured from it, and
            // they would jump too.
            let without_news = used.along_arc(now, DeadReckoning::Full, period_s);
            self.offset += without_news.position - pose.position;
        }
        self.used = Some(*track);
        self.offset = if self.offset.norm() < SMALLEST_JUMP_M {
            Vector2::zeros()
        } else {
            // Per second instead of per tick, so that a scenario behaves the same at another tick rate.
            self.offset * libm::pow(LEFT_AFTER_1_S, period_s)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leader(tick: i64, y_m: f64) -> LeaderState {
        LeaderState {
            tick: Tick(tick),
            position_m: [0.15 * tick as f64, y_m],
            heading_rad: 0.0,
            speed_m_s: 15.0,
            turn_rate_rad_s: 0.0,
        }
    }

    fn position(estimate: &mut LeaderEstimate, now: i64) -> nalgebra::Point2<f64> {
        estimate.at(Tick(now), DeadReckoning::Full, 0.01).unwrap().1.position
    }

    #[test]
    fn a_leader_that_returns_where_it_was_predicted_causes_no_offset() {
        let mut estimate = LeaderEstimate::default();
        estimate.receive(&leader(0, 0.0));
        assert!((position(&mut estimate, 1000).x - 150.0).abs() < 1e-9, "it flies on while it is silent");
        estimate.receive(&leader(1000, 0.0));
        assert_eq!(position(&mut estimate, 1001).y, 0.0);
        assert_eq!(estimate.offset, Vector2::zeros());
    }

    #[test]
    fn a_leader_that_returns_elsewhere_is_approached_without_a_jump() {
        let mut estimate = LeaderEstimate::default();
        estimate.receive(&leader(0, 0.0));
        let before = position(&mut estimate, 1000);
        estimate.receive(&leader(1000, 10.0));
        let after = position(&mut estimate, 1001);
        assert!((after - before).norm() < 0.3, "{after}");
        let in_the_end = (1002..2500).map(|now| position(&mut estimate, now).y).last().unwrap();
        assert!((in_the_end - 10.0).abs() < 1e-4, "{in_the_end}");
    }
}
