//! The panels for viewing a log, made for its scenario, in Foxglove's legacy layout, which its open forks import too.
//!
//! Never refers to a topic that the log does not have. Swarms above [`LISTED_UAVS`] are shown by a selection of UAVs and by
//! their metrics.

mod panel;
mod plots;
mod space;
mod tabs;

use crate::schema::topics::UavTopic;
use nalgebra::Point2;
use panel::Panels;
use ringwing_scenario::{Scenario, start};
use serde_json::json;

/// Largest swarm whose UAVs are all plotted. Viewers become slow with more lines, and legends longer than the plot.
const LISTED_UAVS: u32 = 32;
/// Number of UAVs plotted for a larger swarm. More would repeat the distinct colours; fewer would waste some.
const SELECTED_UAVS: u32 = 8;

/// The layout for the log of `scenario` as JSON; `timing` tells whether the log holds wall-clock times.
pub(crate) fn render(scenario: &Scenario, timing: bool) -> String {
    let mut panels = Panels::default();
    let shown = ShownLog::of(scenario, timing);
    let tabs = tabs::all(&shown, &mut panels);
    let root = panels.add("Tab", &scenario.name, json!({ "activeTabIdx": 0, "tabs": tabs }));
    let layout = json!({
        "configById": panels.into_configs(),
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1.0 },
        "layout": root,
    });
    format!("{layout}\n")
}

/// What the layout shows.
struct ShownLog<'a> {
    scenario: &'a Scenario,
    timing: bool,
    /// Numbers of the UAVs that are plotted one by one.
    uavs: Vec<u32>,
    /// The largest distance of a UAV from the leader at the start, or of its slot, m.
    reach_m: f64,
    /// The largest distance between ring neighbours at the start or in their slots, or twice L, which a loss leaves between
    /// the survivors, m.
    gap_m: f64,
}

impl<'a> ShownLog<'a> {
    fn of(scenario: &'a Scenario, timing: bool) -> Self {
        let count = scenario.formation.uavs;
        let uavs = if count <= LISTED_UAVS {
            (1..=count).collect()
        } else {
            // Spread evenly around the ring, so that every side of the formation is seen.
            (0..SELECTED_UAVS).map(|part| 1 + part * count / SELECTED_UAVS).collect()
        };
        Self { scenario, timing, uavs, reach_m: reach_m(scenario), gap_m: gap_m(scenario) }
    }

    /// The topic of this `kind` of UAV `uav`.
    fn topic(&self, uav: u32, kind: UavTopic) -> String {
        kind.name(uav, self.scenario.formation.uavs)
    }
}

fn reach_m(scenario: &Scenario) -> f64 {
    let leader = scenario.leader_start().position;
    let distances = starts(scenario).map(|start| (start - leader).norm());
    distances.fold(scenario.reach_m(), f64::max)
}

fn gap_m(scenario: &Scenario) -> f64 {
    let next = starts(scenario).cycle().skip(1);
    let distances = starts(scenario).zip(next).map(|(one, next)| (next - one).norm());
    let widest_m = scenario.formations().map(|formation| formation.widest_m()).fold(0.0, f64::max);
    distances.fold(widest_m.max(2.0 * scenario.formation().spacing_m()), f64::max)
}

fn starts(scenario: &Scenario) -> impl Iterator<Item = Point2<f64>> + Clone {
    // A scenario whose UAVs find no room at the start never gets as far as a layout.
    let states = start::states(scenario).unwrap_or_default();
    states.into_iter().map(|state| Point2::from(state.position_m))
}

#[cfg(test)]
mod tests;
