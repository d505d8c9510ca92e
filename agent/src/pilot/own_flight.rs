//! What a UAV knows of its own flight: its newest senses, and what it has commanded since.
//!
//! Never returns senses from the future.

use crate::law::ControlInput;
use nalgebra::Vector2;
use ringwing_flight::{FlightMode, Pose, Sensed, SensedObstacle, Tick};
use ringwing_scenario::DeadReckoning;
use std::collections::VecDeque;

/// Commands kept, one per tick. Senses that are older than this are predicted along the arc that the UAV flew when they
/// were taken; more commands predict older senses better and take more memory.
const COMMANDS_KEPT: usize = 1024;

/// A UAV's own flight.
#[derive(Debug, Clone)]
pub(super) struct OwnFlight {
    senses: Option<Sensed>,
    /// Newer senses have arrived since the last tick that was flown.
    has_news: bool,
    /// The last tick that was flown with newer senses.
    last_news: Tick,
    /// What was commanded in the last ticks, oldest first.
    commands: VecDeque<(Tick, ControlInput)>,
}

impl Default for OwnFlight {
    /// What is known before anything was sensed.
    fn default() -> Self {
        Self {
            senses: None,
            has_news: false,
            last_news: Tick::APPROACH,
            commands: VecDeque::with_capacity(COMMANDS_KEPT),
        }
    }
}

impl OwnFlight {
    /// Takes in what the UAV senses, in any order. Returns whether that is newer than what was known.
    pub(super) fn receive(&mut self, senses: &Sensed) -> bool {
        let is_newer = self.senses.is_none_or(|known| known.tick < senses.tick);
        if is_newer {
            (self.senses, self.has_news) = (Some(*senses), true);
        }
        is_newer
    }

    /// The newest senses, or `None` if nothing new has arrived for `timeout_ticks`: then the UAV must not command its
    /// airframe.
    pub(super) fn senses(&mut self, now: Tick, timeout_ticks: i64) -> Option<&Sensed> {
        // Any newer sample counts, however old it is: late senses are not lost senses.
        if std::mem::take(&mut self.has_news) {
            self.last_news = now;
        }
        let is_current = now.since(self.last_news) < timeout_ticks;
        self.senses.as_ref().filter(|senses| is_current && senses.tick <= now)
    }

    /// Notes what the UAV commands in `now`.
    pub(super) fn record_command(&mut self, now: Tick, control: ControlInput) {
        if self.commands.len() == COMMANDS_KEPT {
            self.commands.pop_front();
        }
        self.commands.push_back((now, control));
    }

    /// The obstacles in the newest senses.
    pub(super) fn obstacles(&self) -> &[SensedObstacle] {
        self.senses.as_ref().map_or(&[], Sensed::obstacles)
    }

    /// Where the UAV is at `now`, if it was at `then` when it took `senses`: along what it has commanded since, in a wind of `wind_m_s`,
    /// as far as `reckoning` allows.
    pub(super) fn pose_at(
        &self,
        then: Pose,
        senses: &Sensed,
        now: Tick,
        reckoning: DeadReckoning,
        period_s: f64,
        wind_m_s: Vector2<f64>,
    ) -> Pose {
        let mut pose = then;
        let end = match reckoning {
            // Senses arrive in their own tick, so there is no exchange of one tick for `Tick` to make up for.
            DeadReckoning::Off | DeadReckoning::Tick => senses.tick,
            DeadReckoning::Full => now,
        };
        // A failsafe ignores commands. Where they are ignored or unknown, assume that the UAV goes on as sensed.
        let mut flown = ControlInput { speed_m_s: senses.speed_m_s, turn_rate_rad_s: senses.turn_rate_rad_s };
        // One step per tick, as the world flies, so that the prediction is exact to the bit.
        for tick in (senses.tick.0..end.0).map(Tick) {
            if senses.mode == FlightMode::COMMANDED {
                flown = self.commanded(tick).unwrap_or(flown);
            }
            pose = pose.after(flown.speed_m_s, flown.turn_rate_rad_s, period_s);
        }
        pose.carried(wind_m_s, end.since(senses.tick) as f64 * period_s)
    }

    fn commanded(&self, tick: Tick) -> Option<ControlInput> {
        // Ticks without a command have no entry: the agent was frozen, or it withheld the command. So search by tick.
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
            position_age_ticks: 0,
            heading_age_ticks: 0,
        }
    }

    #[test]
    fn late_senses_are_used_until_nothing_new_has_arrived_for_the_timeout() {
        let mut own = OwnFlight::default();
        assert_eq!(own.senses(Tick(0), 10), None);
        own.receive(&senses(3));
        own.receive(&senses(2));
        assert_eq!(own.senses(Tick(20), 10).unwrap().tick, Tick(3));
        assert!(own.senses(Tick(29), 10).is_some());
        assert_eq!(own.senses(Tick(30), 10), None);
        own.receive(&senses(4));
        assert!(own.senses(Tick(40), 10).is_some());
    }

    #[test]
    fn senses_from_the_future_wait() {
        let mut own = OwnFlight::default();
        own.receive(&senses(5));
        assert_eq!(own.senses(Tick(4), 10), None);
        assert!(own.senses(Tick(5), 10).is_some());
    }

    /// The pose two ticks after `taken`, while the UAV commanded two turns that `taken` does not show.
    fn pose_two_ticks_later(taken: &Sensed, reckoning: DeadReckoning) -> (Pose, Pose) {
        let mut own = OwnFlight::default();
        let start = Pose { position: taken.position_m.into(), heading_rad: taken.heading_rad };
        let mut truth = start;
        for (tick, (speed_m_s, turn_rate_rad_s)) in (taken.tick.0..).zip([(20.0, 0.1), (18.0, -0.2)]) {
            own.record_command(Tick(tick), ControlInput { speed_m_s, turn_rate_rad_s });
            truth = truth.after(speed_m_s, turn_rate_rad_s, 0.01);
        }
        (own.pose_at(start, taken, Tick(taken.tick.0 + 2), reckoning, 0.01, Vector2::zeros()), truth)
    }

    #[test]
    fn the_commands_since_the_senses_tell_where_the_uav_is() {
        let (pose, truth) = pose_two_ticks_later(&senses(3), DeadReckoning::Full);
        assert_eq!(pose, truth);
        let (pose, _) = pose_two_ticks_later(&senses(3), DeadReckoning::Tick);
        assert_eq!(pose.position.x, 3.0, "the paper's law knows only what was sensed");
    }

    #[test]
    fn a_uav_in_its_failsafe_is_predicted_along_what_it_flies_and_not_along_its_commands() {
        let loitering = Sensed { mode: FlightMode::LOITER, turn_rate_rad_s: 0.3, ..senses(3) };
        let (pose, _) = pose_two_ticks_later(&loitering, DeadReckoning::Full);
        assert!((pose.heading_rad - 0.006).abs() < 1e-12);
    }
}
