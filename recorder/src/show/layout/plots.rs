//! Plots over time: a line for each UAV in its colour, and level lines for limits.
//!
//! Never decides which plots a log needs.

use super::{ShownLog, panel::Panels};
use crate::{
    schema::topics::UavTopic,
    show::palette::{self, Rgb},
};
use serde_json::{Value, json};

/// Width of the legend beside a plot. A narrower one cuts names; a wider one takes room from the lines.
const LEGEND_PIXELS: u32 = 190;

/// A plot panel under construction.
pub(super) struct PlotPanel {
    title: String,
    paths: Vec<Value>,
    /// Least and most value shown; `None` lets the viewer choose.
    range: (Option<f64>, Option<f64>),
}

impl PlotPanel {
    /// A plot without lines; the title should end with the unit.
    pub(super) fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), paths: Vec::new(), range: (None, None) }
    }

    /// Limits the axis to values from `least` to `most`.
    pub(super) fn within(mut self, least: f64, most: f64) -> Self {
        self.range = (Some(least), Some(most));
        self
    }

    /// Begins the axis at `least`.
    pub(super) fn from(mut self, least: f64) -> Self {
        self.range.0 = Some(least);
        self
    }

    /// Adds a line for the values of `field` in the messages of `topic`.
    pub(super) fn line(mut self, topic: &str, field: &str, name: &str, colour: Rgb) -> Self {
        self.paths.push(series(&format!("{topic}.{field}"), name, colour, 1.5));
        self
    }

    /// Adds a thin line for a value that the lines of the UAVs should reach, from `field` of `topic`.
    pub(super) fn reference(mut self, topic: &str, field: &str, name: &str) -> Self {
        self.paths.push(series(&format!("{topic}.{field}"), name, palette::BRIGHT, 0.5));
        self
    }

    /// Adds a line for each UAV shown, from `field` of its `kind` of topic. If not all UAVs are shown, the title says how many.
    pub(super) fn uavs(mut self, shown: &ShownLog, kind: UavTopic, field: &str) -> Self {
        let count = shown.scenario.formation.uavs;
        if shown.uavs.len() < count as usize {
            self.title = format!("{}: {} of {count} UAVs", self.title, shown.uavs.len());
        }
        for uav in &shown.uavs {
            self = self.line(&shown.topic(*uav, kind), field, &format!("uav {uav}"), palette::colour(*uav));
        }
        self
    }

    /// Adds a level line, its value rounded to 1/100 in the legend.
    pub(super) fn level(mut self, value: f64, name: &str) -> Self {
        let name = format!("{name} = {}", (value * 100.0).round() / 100.0);
        // Viewers draw a path that is a number as a level line.
        self.paths.push(series(&value.to_string(), &name, palette::BRIGHT, 1.0));
        self
    }

    /// Adds the plot to `panels` and returns its id.
    pub(super) fn add_to(self, panels: &mut Panels) -> Value {
        let mut config = json!({
            "paths": self.paths,
            "showXAxisLabels": true,
            "showYAxisLabels": true,
            "showLegend": true,
            "legendDisplay": "left",
            "showPlotValuesInLegend": false,
            "isSynced": true,
            "xAxisVal": "timestamp",
            "sidebarDimension": LEGEND_PIXELS,
        });
        for (key, value) in [("minYValue", self.range.0), ("maxYValue", self.range.1)] {
            if let Some(value) = value {
                config[key] = value.into();
            }
        }
        panels.add("Plot", &self.title, config)
    }
}

fn series(path: &str, name: &str, colour: Rgb, width: f64) -> Value {
    json!({
        "value": path,
        "label": name,
        "color": colour.hex(),
        "enabled": true,
        "showLine": true,
        "lineSize": width,
        // The log time, which is simulated time. Our messages have no header that could hold another.
        "timestampMethod": "receiveTime",
    })
}
