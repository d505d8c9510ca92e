//! The panels to see a log in, rendered for its scenario: Foxglove's legacy layout, which its open forks import as well.
//!
//! Refers to nothing that the log does not have. Swarms above [`LISTED_UAVS`] are shown by a selection and by their metrics.

mod panel;
mod plots;
mod space;
mod tabs;

use crate::scene;
use panel::Panels;
use ringwing_scenario::Scenario;
use serde_json::json;

/// Swarms up to this size are plotted UAV by UAV.
const LISTED_UAVS: u32 = 32;
/// So many of larger ones.
const SELECTED_UAVS: u32 = 8;

/// The layout for the log of `scenario`, with or without wall-clock `timing`.
pub(crate) fn render(scenario: &Scenario, timing: bool) -> String {
    let mut panels = Panels::default();
    let subject = Subject::of(scenario, timing);
    let tabs = tabs::all(&subject, &mut panels);
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

/// What there is to show.
struct Subject<'a> {
    scenario: &'a Scenario,
    timing: bool,
    /// The UAVs that are plotted one by one.
    uavs: Vec<u32>,
}

impl<'a> Subject<'a> {
    fn of(scenario: &'a Scenario, timing: bool) -> Self {
        let count = scenario.formation.uavs;
        let uavs = if count <= LISTED_UAVS {
            (1..=count).collect()
        } else {
            (0..SELECTED_UAVS).map(|part| 1 + part * count / SELECTED_UAVS).collect()
        };
        Self { scenario, timing, uavs }
    }

    /// The topic of one UAV.
    fn topic(&self, uav: u32, kind: &str) -> String {
        format!("/uav/{}/{kind}", scene::padded(uav, self.scenario.formation.uavs))
    }
}

#[cfg(test)]
mod tests;
