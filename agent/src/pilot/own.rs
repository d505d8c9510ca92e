//! Where the UAV itself is: its newest senses, and what it has commanded since.
//!
//! Never gives out senses of a moment that is still to come.

use crate::law::Control;
use ringwing_flight::{FlightMode, Pose, Sensed, Tick};
use ringwing_scenario::DeadReckoning;
use std::collections::VecDeque;

/// Commands kept: older senses than this are predicted along the arc that was flown when they were taken.
const KEPT: usize = 1024;

/// What a UAV knows of its own flight.
#[derive(Debug, Clone)]
pub struct Own {
    senses: Option<Sensed>,
    /// Something newer was sensed since the last tick that was flown.
    is_news: bool,
    /// When that was last so.
    heard: Tick,
    /// What was commanded in the last ticks, the newest last.
    commands: VecDeque<(Tick, Control)>,
}

impl Default for Own {
    /// Before anything was sensed.
    fn default() -> Self {
        Self { senses: None, is_news: false, heard: Tick::APPROACH, commands: VecDeque::with_capacity(KEPT) }
    }
}

impl Own {
    /// Takes in what came, in whatever order.
    pub fn sense(&mut self, senses: &Sensed) {
        if self.senses.is_none_or(|held| held.tick < senses.tick) {
            (self.senses, self.is_news) = (Some(*senses), true);
        }
    }

    /// The newest senses, unless nothing new has come for `patience_ticks`: then the airframe has to look after itself.
    pub fn senses(&mut self, now: Tick, patience_ticks: i64) -> Option<&Sensed> {
        if std::mem::take(&mut self.is_news) {
            self.heard = now;
        }
        let is_heard = now.since(self.heard) < patience_ticks;
        self.senses.as_ref().filter(|senses| is_heard && senses.tick <= now)
    }

    /// Notes what is commanded in tick `now`.
    pub fn command(&mut self, now: Tick, control: Control) {
        if self.commands.len() == KEPT {
            self.commands.pop_front();
        }
        self.commands.push_back((now, control));
    }

    /// Where the UAV is at `now`, predicted along what it commanded since `senses`, as far as `reckoning` allows.
    pub fn reckoned(&self, senses: &Sensed, now: Tick, reckoning: DeadReckoning, period_s: f64) -> Pose {
        let mut pose = Pose { position: senses.position_m.into(), heading_rad: senses.heading_rad };
        let end = match reckoning {
            DeadReckoning::Off | DeadReckoning::Tick => senses.tick,
            DeadReckoning::Full => now,
        };
        let mut flown = Control { speed_m_s: senses.speed_m_s, turn_rate_rad_s: senses.turn_rate_rad_s };
        for tick in (senses.tick.0..end.0).map(Tick) {
            if senses.mode == FlightMode::COMMANDED {
                flown = self.commanded(tick).unwrap_or(flown);
            }
            pose = pose.after(flown.speed_m_s, flown.turn_rate_rad_s, period_s);
        }
        pose
    }

    fn commanded(&self, tick: Tick) -> Option<Control> {
        let found = self.commands.binary_search_by_key(&tick, |(tick, _)| *tick);
        found.ok().map(|place| self.commands[place].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{SensedObstacle, UavId, payload::MAX_SENSED_OBSTACLES};

    fn senses(tick: i64) -> Sensed {
        Sensed {
            tick: Tick(tick),
            position_m: [tick as f64, 0.0],
            heading_rad: 0.0,
            speed_m_s: 15.0,
            turn_rate_rad_s: 0.0,
            uav: UavId(1),
            mode: FlightMode::COMMANDED,
            obstacle_count: 0,
            obstacles_omitted: 0,
            obstacles: [SensedObstacle::default(); MAX_SENSED_OBSTACLES],
        }
    }

    #[test]
    fn late_senses_do_until_nothing_new_has_come_for_too_long() {
        let mut own = Own::default();
        assert_eq!(own.senses(Tick(0), 10), None);
        own.sense(&senses(3));
        own.sense(&senses(2));
        assert_eq!(own.senses(Tick(20), 10).unwrap().tick, Tick(3));
        assert!(own.senses(Tick(29), 10).is_some());
        assert_eq!(own.senses(Tick(30), 10), None);
        own.sense(&senses(4));
        assert!(own.senses(Tick(40), 10).is_some());
    }

    #[test]
    fn senses_of_a_moment_to_come_wait() {
        let mut own = Own::default();
        own.sense(&senses(5));
        assert_eq!(own.senses(Tick(4), 10), None);
        assert!(own.senses(Tick(5), 10).is_some());
    }

    #[test]
    fn what_was_commanded_since_tells_where_the_uav_is() {
        let mut own = Own::default();
        let commands = [(20.0, 0.1), (18.0, -0.2), (16.0, 0.4)];
        let mut truth = Pose { position: [3.0, 0.0].into(), heading_rad: 0.0 };
        for (tick, (speed_m_s, turn_rate_rad_s)) in (3..).zip(commands) {
            own.command(Tick(tick), Control { speed_m_s, turn_rate_rad_s });
            truth = truth.after(speed_m_s, turn_rate_rad_s, 0.01);
        }
        assert_eq!(own.reckoned(&senses(3), Tick(6), DeadReckoning::Full, 0.01), truth);
        let stale = own.reckoned(&senses(3), Tick(6), DeadReckoning::Tick, 0.01);
        assert_eq!(stale.position.x, 3.0, "the paper's law knows only what was sensed");
    }
}
