//! How often, how long and how far the collision filters departed from the wish of the law.
//!
//! Only UAVs that fly on command have a filter that acts.

use super::{ControlTerms, Frame};
use ringwing_scenario::Scenario;

/// What the filters do in one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Avoidance {
    /// Number of UAVs whose filter acts.
    pub acting: u32,
    /// The largest angle between the heading that a filter takes and that of the law's course.
    pub turn_max_rad: Option<f64>,
    /// The largest difference between a commanded speed and the wished one.
    pub speed_max_m_s: Option<f64>,
}

/// The mean and the largest of some numbers.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spread {
    sum: f64,
    count: u64,
    max: Option<f64>,
}

/// Watches the filters of all UAVs.
#[derive(Debug, Clone, Default)]
pub(super) struct AvoidanceWatch {
    /// Whether the UAVs have filters.
    is_on: bool,
    /// For how many ticks each UAV's filter has acted without a break, UAV 1 first.
    acting_ticks: Vec<u64>,
    commands: u64,
    acted: u64,
    episodes: u64,
    longest_ticks: u64,
    turn_rad: Spread,
    speed_m_s: Spread,
}

impl AvoidanceWatch {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self { is_on: scenario.control.collision_filter, ..Self::default() }
    }

    /// Takes the next frame.
    pub(super) fn observe(&mut self, frame: &Frame) -> Avoidance {
        // Only the first frame changes the length, because the number of UAVs in a frame is that of the swarm.
        self.acting_ticks.resize(frame.uavs.len(), 0);
        let mut now = Avoidance::default();
        for (index, uav) in frame.uavs.iter().enumerate() {
            // In its failsafe, an airframe flies no command, whatever its agent still sends.
            let control = uav.commanded().and(uav.control.as_ref());
            self.commands += u64::from(control.is_some());
            match control.and_then(departure) {
                Some((turn_rad, speed_m_s)) => {
                    self.note(index, turn_rad, speed_m_s);
                    now.acting += 1;
                    now.turn_max_rad = Some(now.turn_max_rad.map_or(turn_rad, |most| most.max(turn_rad)));
                    now.speed_max_m_s = Some(now.speed_max_m_s.map_or(speed_m_s, |most| most.max(speed_m_s)));
                }
                None => self.acting_ticks[index] = 0,
            }
        }
        now
    }

    fn note(&mut self, index: usize, turn_rad: f64, speed_m_s: f64) {
        let ticks = &mut self.acting_ticks[index];
        self.episodes += u64::from(*ticks == 0);
        *ticks += 1;
        self.longest_ticks = self.longest_ticks.max(*ticks);
        self.acted += 1;
        self.turn_rad.add(turn_rad);
        self.speed_m_s.add(speed_m_s);
    }

    /// Share of the commands that a filter changed; `None` without filters.
    pub(super) fn share(&self) -> Option<f64> {
        // A share of 0 would say of a swarm without filters that its filters never acted.
        (self.is_on && self.commands > 0).then(|| self.acted as f64 / self.commands as f64)
    }

    /// How many times a filter began to act.
    pub(super) fn episodes(&self) -> u64 {
        self.episodes
    }

    /// The most ticks for which a filter acted without a break; `None` if none ever acted.
    pub(super) fn longest_ticks(&self) -> Option<u64> {
        (self.longest_ticks > 0).then_some(self.longest_ticks)
    }

    /// The angles between the headings that filters took and those of the law's courses.
    pub(super) fn turn_rad(&self) -> Spread {
        self.turn_rad
    }

    /// The differences between commanded and wished speeds while filters acted.
    pub(super) fn speed_m_s(&self) -> Spread {
        self.speed_m_s
    }
}

/// How far a command departs from the wish, in heading and speed; `None` while the filter does not act.
fn departure(control: &ControlTerms) -> Option<(f64, f64)> {
    let turn_rad = control.avoided?.turn_rad.abs();
    Some((turn_rad, (control.speed_command_m_s - control.wish_speed_m_s).abs()))
}

impl Spread {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
        super::errors::raise(&mut self.max, value);
    }

    /// Their mean; `None` before the first.
    pub(super) fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// The largest.
    pub(super) fn max(&self) -> Option<f64> {
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{metrics::AvoidedThing, testing};

    #[test]
    fn episodes_shares_and_departures_are_those_of_the_ticks_in_which_a_filter_acts() {
        let mut scenario = testing::ring_of(4, 40.0);
        scenario.control.collision_filter = true;
        let mut watch = AvoidanceWatch::new(&scenario);
        // UAV 2 avoids something in ticks 2 to 5 and again in tick 7, by more each time.
        let mut most = Vec::new();
        for tick in 0..10_i32 {
            let mut frame = testing::at_rest(&scenario, i64::from(tick));
            let control = frame.uavs[1].control.as_mut().unwrap();
            if (2..6).contains(&tick) || tick == 7 {
                let turn_rad = -f64::from(tick) / 10.0;
                control.avoided =
                    Some(AvoidedThing { uav: None, intruder: None, place_m: [0.0; 2], turn_rad });
                control.wish_speed_m_s = control.speed_command_m_s + 1.0;
            }
            let now = watch.observe(&frame);
            most.push((now.acting, now.turn_max_rad));
        }
        assert_eq!([most[2], most[6], most[7]], [(1, Some(0.2)), (0, None), (1, Some(0.7))]);
        assert_eq!((watch.share(), watch.episodes(), watch.longest_ticks()), (Some(0.125), 2, Some(4)));
        assert!((watch.turn_rad().mean().unwrap() - 0.42).abs() < 1e-12);
        assert_eq!((watch.turn_rad().max(), watch.speed_m_s().mean()), (Some(0.7), Some(1.0)));
    }

    #[test]
    fn filters_that_never_act_depart_by_nothing_that_could_be_measured() {
        let mut scenario = testing::ring_of(3, 40.0);
        let share = |scenario: &Scenario| {
            let mut watch = AvoidanceWatch::new(scenario);
            watch.observe(&testing::at_rest(scenario, 0));
            watch.share()
        };
        assert_eq!(share(&scenario), None, "there is no filter");
        scenario.control.collision_filter = true;
        assert_eq!(share(&scenario), Some(0.0));
        let mut watch = AvoidanceWatch::new(&scenario);
        assert_eq!(watch.share(), None, "nobody has commanded yet");
        watch.observe(&testing::at_rest(&scenario, 0));
        assert_eq!(watch.longest_ticks(), None);
        assert_eq!((watch.turn_rad().mean(), watch.speed_m_s().max()), (None, None));
    }
}
