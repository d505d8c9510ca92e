//! Plots over time: a line for each UAV in its colour, and the limits that it is held against.

use super::{Subject, panel::Panels};
use crate::palette::{self, Rgb};
use serde_json::{Value, json};

/// Pixels for the names beside a plot.
const LEGEND_PIXELS: u32 = 190;

/// A plot that is being put together.
pub(super) struct Plot {
    title: String,
    paths: Vec<Value>,
    range: (Option<f64>, Option<f64>),
}

impl Plot {
    /// An empty one; the title ends with the unit.
    pub(super) fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), paths: Vec::new(), range: (None, None) }
    }

    /// Shows only values in between.
    pub(super) fn within(mut self, least: f64, most: f64) -> Self {
        self.range = (Some(least), Some(most));
        self
    }

    /// Shows nothing below `least`.
    pub(super) fn from(mut self, least: f64) -> Self {
        self.range.0 = Some(least);
        self
    }

    /// Adds a line over the values at `path`.
    pub(super) fn line(mut self, path: impl Into<String>, name: &str, colour: Rgb) -> Self {
        self.paths.push(series(&path.into(), name, colour, 1.5));
        self
    }

    /// Adds a line for each UAV shown, from a field of its topic.
    pub(super) fn uavs(mut self, subject: &Subject, kind: &str, field: &str) -> Self {
        for uav in &subject.uavs {
            let path = format!("{}.{field}", subject.topic(*uav, kind));
            self = self.line(path, &format!("uav {uav}"), palette::colour(*uav));
        }
        self
    }

    /// Adds a level line.
    pub(super) fn level(mut self, value: f64, name: &str) -> Self {
        let name = format!("{name} = {}", (value * 100.0).round() / 100.0);
        self.paths.push(series(&value.to_string(), &name, palette::BRIGHT, 1.0));
        self
    }

    /// Makes it a panel.
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
        "timestampMethod": "receiveTime",
    })
}
