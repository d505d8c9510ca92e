//! When something was wrong in a flight, and when UAVs passed obstacles: the shaded bands of the figures.
//!
//! Never guesses an end: what was not healed before the log ends lasts until then.

use ringwing_flight::{Event, Part, ProcessAction, Route};
use ringwing_recorder::metrics::Frame;
use ringwing_scenario::ObstacleSection;

/// Why a stretch of time is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A fault of a link, or a slow process.
    Fault,
    /// A process was lost or frozen.
    Loss,
    /// A UAV was within the braking distance of an obstacle.
    Passage,
}

/// A stretch of time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Period {
    pub(crate) cause: Cause,
    /// What happened: the sentence of a fault, a process, an obstacle.
    pub(crate) name: String,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

/// Collects the periods of a flight while its log is read.
#[derive(Debug, Default)]
pub(crate) struct Periods {
    over: Vec<Period>,
    /// Begun and not over yet; `to_s` is the last time at which they lasted.
    open: Vec<Period>,
    /// The time of the last tick.
    now_s: f64,
    /// Each obstacle with its way.
    obstacles: Vec<(ObstacleSection, Route)>,
}

impl Periods {
    /// No period yet of a flight past `obstacles`.
    pub(super) fn new(obstacles: &[ObstacleSection]) -> Self {
        let obstacles = obstacles.iter().map(|one| (one.clone(), one.route())).collect();
        Self { obstacles, ..Self::default() }
    }

    /// Takes an event.
    pub(super) fn on_event(&mut self, time_s: f64, event: &Event) {
        use ProcessAction::{Freeze, Kill, Start, Stop, Thaw};
        match event {
            Event::LinkFault { sentence }
            | Event::SlowFault { sentence }
            | Event::AirframeFault { sentence } => {
                self.begin(Cause::Fault, sentence, time_s);
            }
            Event::FaultHealed { sentence } => self.finish(Cause::Fault, sentence, time_s),
            // Whatever took the process away, the period has the same name, so that every kind of return ends it.
            Event::ProcessLost { part, .. }
            | Event::ProcessFrozen { part }
            | Event::ProcessFault { part, action: Kill { .. } | Stop | Freeze, .. } => {
                self.begin(Cause::Loss, &lost(*part), time_s);
            }
            Event::ProcessReady { part }
            | Event::ProcessThawed { part }
            | Event::ProcessFault { part, action: Start | Thaw, .. } => {
                self.finish(Cause::Loss, &lost(*part), time_s);
            }
            _ => {}
        }
    }

    /// Takes a tick: begins and ends the passages of obstacles.
    pub(super) fn observe(&mut self, time_s: f64, frame: &Frame) {
        self.now_s = time_s;
        // Taken out for the loop, because `begin` and `finish` need the whole of `self`.
        let obstacles = std::mem::take(&mut self.obstacles);
        for (obstacle, route) in &obstacles {
            let centre = route.at(time_s).pose.position;
            let mut states = frame.uavs.iter().filter_map(|uav| uav.state.as_ref());
            if states.any(|state| (state.position() - centre).norm() < obstacle.braking_distance_m) {
                self.begin(Cause::Passage, &obstacle.name, time_s);
            } else {
                self.finish(Cause::Passage, &obstacle.name, time_s);
            }
        }
        self.obstacles = obstacles;
    }

    /// Ends everything at the last tick, because the log ends there.
    pub(super) fn end(&mut self) {
        let now_s = self.now_s;
        self.over.extend(self.open.drain(..).map(|period| Period { to_s: now_s, ..period }));
        self.over.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
    }

    /// All periods, by their beginning.
    pub(crate) fn all(&self) -> &[Period] {
        &self.over
    }

    fn begin(&mut self, cause: Cause, name: &str, time_s: f64) {
        let is_it = |period: &Period| period.cause == cause && period.name == name;
        // A process that is killed while it is frozen stays lost: one period.
        if !self.open.iter().any(is_it) {
            self.open.push(Period { cause, name: name.into(), from_s: time_s, to_s: time_s });
        }
    }

    fn finish(&mut self, cause: Cause, name: &str, time_s: f64) {
        let is_it = |period: &Period| period.cause == cause && period.name == name;
        if let Some(index) = self.open.iter().position(is_it) {
            let period = self.open.remove(index);
            self.over.push(Period { to_s: time_s, ..period });
        }
    }
}

fn lost(part: Part) -> String {
    format!("{part} lost")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::UavId;

    #[test]
    fn a_period_lasts_from_its_fault_to_its_healing_or_to_the_end() {
        let mut periods = Periods::default();
        let part = Part::Agent(UavId(3));
        let kill = ProcessAction::Kill { returns: true };
        let sentence = "restart uav 3 after 2 s".to_owned();
        periods.on_event(1.0, &Event::LinkFault { sentence: "link 1->2 hold".into() });
        periods.on_event(2.0, &Event::ProcessFrozen { part });
        periods.on_event(3.0, &Event::ProcessFault { part, action: kill, sentence });
        periods.on_event(5.0, &Event::ProcessReady { part });
        periods.now_s = 9.0;
        periods.end();
        let all: Vec<_> = periods.all().iter().map(|one| (&*one.name, one.from_s, one.to_s)).collect();
        assert_eq!(all, [("link 1->2 hold", 1.0, 9.0), ("uav 3 lost", 2.0, 5.0)]);
    }
}
