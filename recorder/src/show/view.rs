//! Decides what viewers are shown of each tick: scenes, coordinate frames, places on the map, metrics and faults.
//!
//! Must never read a file: the same frames and lines give the same views. A recorder that takes over a log shows
//! everything once more, with the trails and faults that it learned from the log.

use super::{
    faults::{CurrentFaults, FaultWatch},
    geo::Earth,
    scene::{self, CraftScene, Mover, Trails},
    timing::TimingWatch,
};
use crate::{
    clock::Clock,
    metrics::{Frame, Moment},
    schema::{Faults, SwarmMetrics, SwarmState, TimingPercentiles},
};
use foxglove::messages::{FrameTransforms, GeoJson, LocationFix, Pose, PoseInFrame, SceneUpdate, Vector3};
use ringwing_flight::{Event, LeaderPath, LeaderState, LivingRing, TickTiming};
use ringwing_scenario::Scenario;

// Messages per simulated second. Raw states are logged every tick; higher rates here only make the log larger, and
// lower ones make playback jerky or late.

/// Coordinate frames, the swarm's state and metrics, and the leader's pose: smooth to the eye.
const STATES_HZ: u32 = 20;
/// Links of the ring, whose colours show ages of data, and estimates and wind.
const LINKS_HZ: u32 = 5;
/// Trails, the largest message: each repeats its whole length.
const TRAILS_HZ: u32 = 1;
/// The leader and the UAVs on the map.
const MAP_HZ: u32 = 1;
/// Faults that have not changed. A plot draws a ramp from one message to the next, so a longer interval would show a
/// change as a longer ramp.
const FAULTS_HZ: u32 = 1;
/// Percentiles of the tick times since the last message. More often, and too few ticks are left for a percentile.
const TIMING_HZ: u32 = 1;

/// The messages that one tick adds; `None` for each that is not due or has not changed.
#[derive(Debug, Default, PartialEq)]
pub struct TickView {
    pub(crate) faults: Option<Faults>,
    pub(crate) leader_fix: Option<LocationFix>,
    pub(crate) map: Option<GeoJson>,
    pub(crate) leader_pose: Option<PoseInFrame>,
    pub(crate) estimates: Option<SceneUpdate>,
    pub(crate) formation: Option<SceneUpdate>,
    pub(crate) obstacles: Option<SceneUpdate>,
    pub(crate) path: Option<SceneUpdate>,
    pub(crate) ring: Option<SceneUpdate>,
    pub(crate) trails: Option<SceneUpdate>,
    pub(crate) uavs: Option<SceneUpdate>,
    pub(crate) wind: Option<SceneUpdate>,
    pub(crate) metrics: Option<SwarmMetrics>,
    pub(crate) state: Option<SwarmState>,
    pub(crate) transforms: Option<FrameTransforms>,
    pub(crate) timing: Option<TimingPercentiles>,
}

/// Follows the flight and makes the view of each tick.
#[derive(Debug, Clone)]
pub(crate) struct Viewer {
    clock: Clock,
    /// L of the whole ring, m.
    spacing_m: f64,
    /// The distance of the farthest slot from the leader, m.
    reach_m: f64,
    scenario: Scenario,
    path: LeaderPath,
    movers: Vec<Mover>,
    earth: Earth,
    /// Whether the ring closes after a loss, so that links skip the lost UAVs.
    closes: bool,
    /// Age from which data have the colour of alarm: the airframe's own limit for commands.
    stale_s: f64,
    watch: FaultWatch,
    /// The faults as last shown; `None` before the first view.
    shown: Option<CurrentFaults>,
    /// The ring as last drawn; `None` before the first view.
    drawn: Option<LivingRing>,
    timing: TimingWatch,
    /// Whether the last scene of estimates showed any.
    shows_estimates: bool,
    craft: CraftScene,
    trails: Trails,
}

impl Viewer {
    /// A viewer that has not seen any frame yet.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let (clock, formation) = (Clock::new(scenario.time.rate_hz), scenario.formation());
        Self {
            clock,
            spacing_m: formation.spacing_m(),
            reach_m: scenario.reach_m(),
            scenario: scenario.clone(),
            path: scenario.leader_path(),
            movers: scene::movers(scenario),
            earth: Earth::new(scenario),
            stale_s: scenario.airframe.command_timeout_s,
            closes: scenario.control.ring_closes,
            watch: FaultWatch::default(),
            shown: None,
            drawn: None,
            timing: TimingWatch::default(),
            shows_estimates: false,
            craft: CraftScene::new(formation.count(), formation.spacing_m()),
            trails: Trails::new(formation.count(), clock),
        }
    }

    /// Takes an event.
    pub(crate) fn on_event(&mut self, event: &Event) {
        self.watch.on_event(event);
    }

    /// Takes a frame without making its view.
    pub(crate) fn observe(&mut self, frame: &Frame) {
        self.watch.observe(frame);
        self.craft.observe(frame);
        self.trails.observe(frame);
    }

    /// Takes how long the tick of a frame took, in logs with wall-clock times.
    pub(crate) fn observe_timing(&mut self, timing: &TickTiming) {
        self.timing.observe(timing);
    }

    /// The view of `frame`, which was observed before; `moment` holds its metrics.
    pub(crate) fn view(&mut self, frame: &Frame, moment: &Moment) -> TickView {
        let (clock, tick) = (self.clock, frame.tick);
        let is_first = self.shown.is_none();
        let due = |hz| clock.is_due(tick, hz).then_some(());
        TickView {
            faults: self.faults(tick),
            leader_fix: due(MAP_HZ).and(frame.leader).map(|leader| self.earth.leader_fix(&leader, clock)),
            map: due(MAP_HZ).map(|()| self.earth.uavs_on_map(frame, clock)),
            leader_pose: due(STATES_HZ).and(frame.leader).map(|leader| leader_pose(&leader, clock)),
            estimates: due(LINKS_HZ).and_then(|()| self.estimates(frame)),
            formation: self.formation(frame),
            // What never changes is written once: a viewer that seeks shows the last message of every topic before
            // that time.
            obstacles: is_first.then(|| scene::obstacles(&self.scenario, clock, tick)),
            path: is_first
                .then(|| scene::leader_path(&self.path, self.scenario.time.duration_s, clock, tick)),
            ring: due(LINKS_HZ).and_then(|()| scene::ring(frame, self.closes, self.stale_s, clock)),
            trails: due(TRAILS_HZ).map(|()| self.trails.scene(frame)),
            uavs: self.craft.scene(frame, self.watch.now(), clock),
            wind: due(LINKS_HZ).and_then(|()| scene::wind(frame, self.spacing_m, self.reach_m, clock)),
            metrics: due(STATES_HZ).map(|()| SwarmMetrics::of(moment, &frame.ring)),
            state: due(STATES_HZ).map(|()| SwarmState::of(frame)),
            transforms: due(STATES_HZ).map(|()| scene::transforms(frame, &self.movers, clock)),
            timing: due(TIMING_HZ).and_then(|()| self.timing.take(tick)),
        }
    }

    /// Where agents believe that their UAVs are, and once nothing when all of them know it again.
    fn estimates(&mut self, frame: &Frame) -> Option<SceneUpdate> {
        let scene = scene::estimates(frame, scene::SPAN * self.spacing_m, self.clock);
        let shown_before = std::mem::replace(&mut self.shows_estimates, !scene.entities.is_empty());
        (self.shows_estimates || shown_before).then_some(scene)
    }

    /// The ring that is flown, if it changed.
    fn formation(&mut self, frame: &Frame) -> Option<SceneUpdate> {
        let ring = frame.ring.living();
        if self.drawn.as_ref() == Some(ring) {
            return None;
        }
        self.drawn = Some(ring.clone());
        Some(scene::formation(&frame.ring, self.spacing_m, self.clock, frame.tick))
    }

    /// The faults, if they changed or are due.
    fn faults(&mut self, tick: i64) -> Option<Faults> {
        let now = self.watch.now();
        let has_changed = self.shown.as_ref() != Some(now);
        if has_changed {
            self.shown = Some(now.clone());
        }
        (has_changed || self.clock.is_due(tick, FAULTS_HZ)).then(|| now.message(tick))
    }
}

/// The leader's position and heading: `/leader/pose`.
fn leader_pose(leader: &LeaderState, clock: Clock) -> PoseInFrame {
    let [x, y] = leader.position_m;
    let pose = Pose {
        position: Some(Vector3 { x, y, z: 0.0 }),
        orientation: Some(scene::turned(leader.heading_rad)),
    };
    PoseInFrame {
        timestamp: Some(clock.timestamp(leader.tick.0)),
        frame_id: scene::MAP.into(),
        pose: Some(pose),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Metrics, testing};
    use ringwing_flight::FlightMode;

    fn views(scenario: &Scenario, frames: &[Frame]) -> Vec<TickView> {
        let (mut viewer, mut metrics) = (Viewer::new(scenario), Metrics::new(scenario));
        let view = |frame| {
            viewer.observe(frame);
            metrics.observe(frame);
            viewer.view(frame, metrics.moment())
        };
        frames.iter().map(view).collect()
    }

    #[test]
    fn the_first_view_is_complete_and_later_views_hold_what_changes_or_is_due() {
        let scenario = testing::ring_of(3, 40.0);
        let views = views(&scenario, &testing::flight(&scenario, 0..200));
        let count = |has: fn(&TickView) -> bool| views.iter().filter(|view| has(view)).count();
        assert_eq!(views[0].faults.as_ref().unwrap().summary, "none");
        assert_eq!((count(|v| v.faults.is_some()), count(|v| v.uavs.is_some())), (2, 1));
        assert_eq!((count(|v| v.formation.is_some()), count(|v| v.obstacles.is_some())), (1, 1));
        assert_eq!(count(|v| v.path.is_some()), 1);
        assert_eq!((count(|v| v.transforms.is_some()), count(|v| v.metrics.is_some())), (40, 40));
        assert_eq!((count(|v| v.ring.is_some()), count(|v| v.trails.is_some())), (10, 2));
        assert_eq!((count(|v| v.map.is_some()), count(|v| v.leader_fix.is_some())), (2, 2));
        assert_eq!(views[1], TickView::default());
    }

    #[test]
    fn estimates_are_shown_while_agents_err_and_removed_once_when_they_know_again() {
        let scenario = testing::ring_of(3, 40.0);
        let mut frames = testing::flight(&scenario, 0..100);
        for frame in &mut frames[20..50] {
            frame.uavs[1].control.as_mut().unwrap().estimate = Some(frame.uavs[0].state.unwrap().pose());
        }
        let views = views(&scenario, &frames);
        let shown: Vec<_> =
            views.iter().filter_map(|view| Some(view.estimates.as_ref()?.entities.len())).collect();
        assert_eq!(shown, [1, 1, 0]);
    }

    #[test]
    fn a_change_of_faults_is_shown_at_its_tick() {
        let scenario = testing::ring_of(3, 40.0);
        let mut frames = testing::flight(&scenario, 0..9);
        for frame in &mut frames[6..] {
            frame.uavs[1].state.as_mut().unwrap().mode = FlightMode::LOITER;
        }
        let views = views(&scenario, &frames);
        let changes: Vec<_> = (0..9).filter(|tick| views[*tick].faults.is_some()).collect();
        assert_eq!(changes, [0, 6]);
        assert_eq!(views[6].faults.as_ref().unwrap().failsafe_names, ["uav 2"]);
        assert!(views[6].uavs.is_some() && views[7].uavs.is_none());
    }
}
