//! Where the leader is, also while it is silent, and without a jump when it is heard again.
//!
//! Never flies a path of its own: a silent leader is where its last state leads.

use super::track::{Link, Track};
use nalgebra::Vector2;
use ringwing_flight::{LeaderState, Pose, Tick};
use ringwing_scenario::DeadReckoning;

/// What is left of a jump after a second.
const LEFT_AFTER_1_S: f64 = 0.37;
/// A smaller jump is none: it is how two ways to the same place round.
const SMALLEST_M: f64 = 1e-6;

/// The leader as it was heard.
#[derive(Debug, Clone, Default)]
pub struct Lead {
    link: Link,
    /// What the last estimate was made from.
    used: Option<Track>,
    /// From where it is by what was heard to where it is taken to be, which fades.
    offset: Vector2<f64>,
}

impl Lead {
    /// Takes in what the leader sent.
    pub fn hear(&mut self, state: &LeaderState) {
        if let Some(track) = Track::of_leader(state) {
            self.link.hear(track);
        }
    }

    /// What was heard last, and where the leader is now; none before it was heard.
    pub fn at(&mut self, now: Tick, reckoning: DeadReckoning, period_s: f64) -> Option<(Track, Pose)> {
        let track = *self.link.newest()?;
        let mut pose = track.reckoned(now, reckoning, period_s);
        if reckoning == DeadReckoning::Full {
            self.smooth(&track, &pose, now, period_s);
            pose.position += self.offset;
        }
        Some((track, pose))
    }

    fn smooth(&mut self, track: &Track, pose: &Pose, now: Tick, period_s: f64) {
        if let Some(used) = self.used.filter(|used| used.tick != track.tick) {
            let foreseen = used.reckoned(now, DeadReckoning::Full, period_s);
            self.offset += foreseen.position - pose.position;
        }
        self.used = Some(*track);
        self.offset = if self.offset.norm() < SMALLEST_M {
            Vector2::zeros()
        } else {
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

    fn place(lead: &mut Lead, now: i64) -> nalgebra::Point2<f64> {
        lead.at(Tick(now), DeadReckoning::Full, 0.01).unwrap().1.position
    }

    #[test]
    fn a_leader_that_comes_back_where_it_should_be_is_taken_at_its_word() {
        let mut lead = Lead::default();
        lead.hear(&leader(0, 0.0));
        assert!((place(&mut lead, 1000).x - 150.0).abs() < 1e-9, "it flew on unheard");
        lead.hear(&leader(1000, 0.0));
        assert_eq!(place(&mut lead, 1001).y, 0.0);
        assert_eq!(lead.offset, Vector2::zeros());
    }

    #[test]
    fn a_leader_that_comes_back_elsewhere_makes_no_jump() {
        let mut lead = Lead::default();
        lead.hear(&leader(0, 0.0));
        let before = place(&mut lead, 1000);
        lead.hear(&leader(1000, 10.0));
        let after = place(&mut lead, 1001);
        assert!((after - before).norm() < 0.3, "{after}");
        let at_last = (1002..2500).map(|now| place(&mut lead, now).y).last().unwrap();
        assert!((at_last - 10.0).abs() < 1e-4, "{at_last}");
    }
}
