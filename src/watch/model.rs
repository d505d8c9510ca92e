//! What is known of the flight that is watched: the last tick, the recent past, and what has happened.
//!
//! Must never read a clock or a terminal: the same ticks give the same picture.

use ringwing_flight::{Level, Tick, TimedEvent};
use ringwing_recorder::metrics::{Frame, Moment};
use ringwing_scenario::{ObstacleSection, Scenario};
use std::collections::VecDeque;

/// Pictures that a course over time remembers. More than a terminal has columns are never shown.
const COURSE_LENGTH: usize = 500;
/// Events that are remembered. More than a terminal has lines are never shown.
const EVENTS: usize = 200;

/// How the flight goes through time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pace {
    /// A live flight goes on.
    Live,
    /// A live flight stands before this tick.
    Held {
        /// The tick.
        tick: Tick,
    },
    /// A log is played.
    Played {
        /// How many times as fast as it was flown.
        speed: f64,
    },
    /// A log is not played at the moment.
    Stopped,
    /// A log was played to its end.
    AtEnd,
}

/// A value over the last pictures.
#[derive(Debug, Default)]
pub(super) struct Course {
    values: VecDeque<f64>,
    newest: Option<f64>,
    /// The largest, or smallest, value since the last picture.
    pending: Option<f64>,
}

impl Course {
    fn note(&mut self, value: Option<f64>, worse: fn(f64, f64) -> f64) {
        let Some(value) = value else { return };
        self.newest = Some(value);
        // A picture stands for many ticks. With the last value instead of the worst, a peak between two pictures
        // would be lost.
        self.pending = Some(self.pending.map_or(value, |other| worse(value, other)));
    }

    fn end_batch(&mut self) {
        // Without a new tick there is no new value: a paused flight must not push its past out of the course.
        let Some(value) = self.pending.take() else { return };
        if self.values.len() == COURSE_LENGTH {
            self.values.pop_front();
        }
        self.values.push_back(value);
    }

    /// The last values, at most `most`, oldest first.
    pub(super) fn last(&self, most: usize) -> Vec<f64> {
        self.values.iter().skip(self.values.len().saturating_sub(most)).copied().collect()
    }

    /// The value in the last tick. The course itself has the worst one of each picture.
    pub(super) fn newest(&self) -> Option<f64> {
        self.newest
    }
}

/// The courses that are shown.
#[derive(Debug, Default)]
pub(super) struct Courses {
    /// The largest slot error, m.
    pub(super) slot_error_m: Course,
    /// The distance of the two closest UAVs, m.
    pub(super) closest_m: Course,
    /// The greatest age of data that an agent used, s.
    pub(super) age_s: Course,
    /// The time from the opening of a tick to its last answer, us.
    pub(super) latency_us: Course,
}

/// An event as it is shown.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ShownEvent {
    /// When, s.
    pub(super) time_s: f64,
    /// How bad it is.
    pub(super) level: Level,
    /// What happened.
    pub(super) text: String,
}

/// The flight as it is shown.
pub(super) struct Model {
    scenario: Scenario,
    /// All obstacles, those of drawn fields as well.
    obstacles: Vec<ObstacleSection>,
    /// Whether the terminal shows colours.
    pub(super) is_coloured: bool,
    frame: Option<Frame>,
    /// Where the leader was last seen.
    leader: Option<[f64; 2]>,
    commanded: u32,
    pub(super) courses: Courses,
    events: VecDeque<ShownEvent>,
    pace: Pace,
    /// The pace of the picture before. A flight also stands for a moment when a fault is applied.
    pace_before: Pace,
    notice: String,
    first_row: usize,
    is_over: bool,
}

impl Model {
    /// A flight of `scenario` that nothing is known of yet.
    pub(super) fn new(scenario: Scenario, is_coloured: bool) -> Self {
        Self {
            // Drawing a field takes longer than drawing a picture, so do it once.
            obstacles: scenario.all_obstacles(),
            scenario,
            is_coloured,
            frame: None,
            leader: None,
            commanded: 0,
            courses: Courses::default(),
            events: VecDeque::new(),
            pace: Pace::Live,
            pace_before: Pace::Live,
            notice: String::new(),
            first_row: 0,
            is_over: false,
        }
    }

    /// Takes a tick.
    pub(super) fn take(
        &mut self,
        frame: &Frame,
        moment: &Moment,
        events: &[TimedEvent],
        latency_us: Option<f64>,
    ) {
        for TimedEvent { tick, event } in events {
            let time_s = tick.seconds(self.scenario.time.rate_hz);
            let (level, text) = (event.level(), self.scenario.event_text(event));
            self.events.push_back(ShownEvent { time_s, level, text });
        }
        self.events.drain(..self.events.len().saturating_sub(EVENTS));
        // A log may have ticks with nothing but events.
        if frame.uavs.iter().all(|uav| uav.state.is_none()) {
            return;
        }
        self.commanded = moment.commanded;
        // The picture is centred on the leader: if it is lost, keep its last place, so that the picture does not
        // jump.
        self.leader = frame.leader.map(|leader| leader.position_m).or(self.leader);
        // A collision is one whether or not the two are ring neighbours, so the course shows the closest pair of all.
        let closest = [&moment.closest.adjacent, &moment.closest.other];
        let closest_m = closest.into_iter().flatten().map(|pair| pair.distance_m).reduce(f64::min);
        let ages = frame
            .uavs
            .iter()
            .filter_map(|uav| uav.control.as_ref())
            .flat_map(|control| [control.previous_age_s, control.next_age_s, control.leader_age_s]);
        let courses = &mut self.courses;
        courses.slot_error_m.note(moment.slot_error_max_m, f64::max);
        courses.closest_m.note(closest_m, f64::min);
        courses.age_s.note(ages.flatten().reduce(f64::max), f64::max);
        courses.latency_us.note(latency_us, f64::max);
        self.frame.get_or_insert_with(|| frame.clone()).clone_from(frame);
    }

    /// Takes where the leader is, from a log, which says so less often than it has ticks.
    pub(super) fn set_leader(&mut self, place_m: [f64; 2]) {
        self.leader = Some(place_m);
    }

    /// Makes one picture of the ticks since the last one.
    pub(super) fn end_batch(&mut self) {
        let Courses { slot_error_m, closest_m, age_s, latency_us } = &mut self.courses;
        for course in [slot_error_m, closest_m, age_s, latency_us] {
            course.end_batch();
        }
    }

    /// Takes how the flight goes through time.
    pub(super) fn set_pace(&mut self, pace: Pace) {
        self.pace_before = std::mem::replace(&mut self.pace, pace);
    }

    /// Whether the flight stands still, for longer than a fault takes.
    pub(super) fn is_standing(&self) -> bool {
        match (self.pace_before, self.pace) {
            (Pace::Held { tick: before }, Pace::Held { tick: now }) => before == now,
            (_, pace) => matches!(pace, Pace::Stopped | Pace::AtEnd),
        }
    }

    /// How the flight goes through time, in a few words.
    pub(super) fn pace_text(&self) -> String {
        let is_real_time = self.scenario.time.real_time;
        match self.pace {
            Pace::Held { tick } if self.is_standing() => format!("paused before tick {}", tick.0),
            // A hold for a fault is over before anybody could read of it, so the flight counts as live.
            Pace::Live | Pace::Held { .. } if is_real_time => "live, real time".into(),
            Pace::Live | Pace::Held { .. } => "live, lockstep".into(),
            Pace::Played { speed } => format!("log, {speed}x"),
            Pace::Stopped => "log, paused".into(),
            Pace::AtEnd => "log, at its end".into(),
        }
    }

    /// Shows `text` until the next notice.
    pub(super) fn set_notice(&mut self, text: &str) {
        // The notice has one row of the terminal, and the answer to a fault may have a warning in its second line.
        self.notice = text.lines().collect::<Vec<_>>().join("; ");
    }

    /// The last notice.
    pub(super) fn notice(&self) -> &str {
        &self.notice
    }

    /// Moves the table of UAVs by `rows`.
    pub(super) fn scroll(&mut self, rows: isize) {
        // Only the drawing knows how many rows there are, and it stops the table earlier.
        let last = self.scenario.formation.uavs as usize - 1;
        self.first_row = self.first_row.saturating_add_signed(rows).min(last);
    }

    /// The first row of the table of UAVs.
    pub(super) fn first_row(&self) -> usize {
        self.first_row
    }

    /// Notes that the run is over.
    pub(super) fn note_over(&mut self) {
        self.is_over = true;
    }

    /// What remains on the terminal when it is given back.
    pub(super) fn last_words(&self) -> String {
        let seen = self.tick().map_or_else(
            || "no tick was seen".into(),
            |tick| format!("tick {tick}, {:.2} s was the last one seen", self.seconds(tick)),
        );
        if self.is_over { format!("the run is over; {seen}") } else { seen }
    }

    /// All obstacles, those of drawn fields as well.
    pub(super) fn obstacles(&self) -> &[ObstacleSection] {
        &self.obstacles
    }

    /// The scenario that is flown.
    pub(super) fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The last tick.
    pub(super) fn frame(&self) -> Option<&Frame> {
        self.frame.as_ref()
    }

    /// The number of the last tick.
    pub(super) fn tick(&self) -> Option<i64> {
        self.frame.as_ref().map(|frame| frame.tick)
    }

    /// Where the leader was last seen.
    pub(super) fn leader(&self) -> Option<[f64; 2]> {
        self.leader
    }

    /// How many UAVs fly on command.
    pub(super) fn commanded(&self) -> u32 {
        self.commanded
    }

    /// The last events, at most `most`, the newest last.
    pub(super) fn events(&self, most: usize) -> impl Iterator<Item = &ShownEvent> {
        self.events.iter().skip(self.events.len().saturating_sub(most))
    }

    /// Ticks in a second.
    pub(super) fn ticks_per_s(&self) -> u32 {
        self.scenario.time.rate_hz
    }

    /// The time of `tick`.
    pub(super) fn seconds(&self, tick: i64) -> f64 {
        Tick(tick).seconds(self.scenario.time.rate_hz)
    }
}
