//! Where a UAV assumes the leader to be: it predicts a silent leader, and avoids a jump when the leader is heard
//! again, also of the heading that a formation turns with.
//!
//! Never plans a path: a silent leader flies on along its last arc.

use super::track::{NewestTrack, PeerTrack};
use nalgebra::Vector2;
use ringwing_flight::{LeaderState, Pose, Tick, wrap};
use ringwing_scenario::DeadReckoning;

/// The part of a jump that is left after one second. Less corrects faster and moves the slots faster; 0 is the bare
/// jump.
const LEFT_AFTER_1_S: f64 = 0.37;
/// Ignore jumps below rounding error: two predictions of the same position differ by less than this. A larger value
/// lets small jumps through.
const SMALLEST_JUMP_M: f64 = 1e-6;

/// Ignore jumps of the heading below rounding error, as with [`SMALLEST_JUMP_M`].
const SMALLEST_JUMP_RAD: f64 = 1e-9;

/// The leader at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedLeader {
    /// The newest track.
    pub track: PeerTrack,
    /// Where the leader is and heads.
    pub pose: Pose,
    /// The heading that a formation in the leader's frame turns with: that of the pose, but without its jumps.
    pub frame_rad: f64,
}

/// The leader as one UAV has received it.
#[derive(Debug, Clone, Default)]
pub(super) struct LeaderEstimate {
    newest: NewestTrack,
    /// The track of the last estimate.
    used: Option<PeerTrack>,
    /// From the predicted position to the estimate; it decays.
    offset: Vector2<f64>,
    /// From the predicted heading to that of the formation's frame; it decays.
    frame_offset_rad: f64,
}

impl LeaderEstimate {
    /// Takes in what the leader sent.
    pub(super) fn receive(&mut self, state: &LeaderState) {
        if let Some(track) = PeerTrack::of_leader(state) {
            self.newest.update(track);
        }
    }

    /// The leader at `now`; `None` before anything was received.
    pub(super) fn at(
        &mut self,
        now: Tick,
        reckoning: DeadReckoning,
        period_s: f64,
    ) -> Option<EstimatedLeader> {
        let track = *self.newest.get()?;
        let mut pose = track.along_arc(now, reckoning, period_s);
        let mut frame_rad = pose.heading_rad;
        // The paper's law uses the received state as it is.
        if reckoning == DeadReckoning::Full {
            self.smooth(&track, &pose, now, period_s);
            pose.position += self.offset;
            frame_rad = wrap(frame_rad + self.frame_offset_rad);
        }
        Some(EstimatedLeader { track, pose, frame_rad })
    }

    /// Adds the jumps of the prediction at a new track to the offsets, and lets the offsets decay.
    fn smooth(&mut self, track: &PeerTrack, pose: &Pose, now: Tick, period_s: f64) {
        if let Some(used) = self.used.filter(|used| used.tick != track.tick) {
            // Add the jump to the offset, so that the estimate stays where it was. All slots are measured from it, and
            // they would jump too.
            let without_news = used.along_arc(now, DeadReckoning::Full, period_s);
            self.offset += without_news.position - pose.position;
            self.frame_offset_rad =
                wrap(self.frame_offset_rad + wrap(without_news.heading_rad - pose.heading_rad));
        }
        self.used = Some(*track);
        // Per second instead of per tick, so that a scenario behaves the same at another tick rate.
        let left = libm::pow(LEFT_AFTER_1_S, period_s);
        self.offset =
            if self.offset.norm() < SMALLEST_JUMP_M { Vector2::zeros() } else { self.offset * left };
        self.frame_offset_rad =
            if self.frame_offset_rad.abs() < SMALLEST_JUMP_RAD { 0.0 } else { self.frame_offset_rad * left };
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
        estimate.at(Tick(now), DeadReckoning::Full, 0.01).unwrap().pose.position
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
    fn a_jump_below_rounding_error_is_dropped_at_once() {
        let mut estimate = LeaderEstimate::default();
        estimate.receive(&leader(0, 0.0));
        position(&mut estimate, 1000);
        estimate.receive(&LeaderState { heading_rad: 5e-10, ..leader(1000, 5e-7) });
        position(&mut estimate, 1000);
        assert_eq!((estimate.offset, estimate.frame_offset_rad), (Vector2::zeros(), 0.0));
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

    #[test]
    fn a_silent_leader_is_followed_along_its_last_arc_and_a_new_heading_turns_the_frame_gently() {
        let mut estimate = LeaderEstimate::default();
        let turning = LeaderState { turn_rate_rad_s: 0.05, ..leader(0, 0.0) };
        estimate.receive(&turning);
        let at =
            |estimate: &mut LeaderEstimate, now| estimate.at(Tick(now), DeadReckoning::Full, 0.01).unwrap();
        let silent = at(&mut estimate, 1000);
        assert!((silent.pose.heading_rad - 0.5).abs() < 1e-9 && silent.frame_rad == silent.pose.heading_rad);
        let back = LeaderState { heading_rad: -0.3, ..leader(1000, 0.0) };
        estimate.receive(&back);
        let heard = at(&mut estimate, 1001);
        assert_eq!(heard.pose.heading_rad, -0.3, "the velocity is that of the leader at once");
        assert!((heard.frame_rad - 0.5).abs() < 0.02, "{}", heard.frame_rad);
        let in_the_end = (1002..3500).map(|now| at(&mut estimate, now).frame_rad).last().unwrap();
        assert!((in_the_end + 0.3).abs() < 1e-6, "{in_the_end}");
    }
}
