//! Panels, and how they share the screen.
//!
//! Never knows what a panel shows.

use serde_json::{Map, Value, json};

/// Collects the panels of a layout with their settings.
#[derive(Debug, Default)]
pub(super) struct Panels {
    /// Settings by the panel's id.
    configs: Map<String, Value>,
}

impl Panels {
    /// Adds a panel of this `kind` and returns its id for the arrangement.
    pub(super) fn add(&mut self, kind: &str, title: &str, mut config: Value) -> Value {
        let id = format!("{kind}!{}", self.configs.len());
        // Foxglove and Lichtblick each read their own key.
        for key in ["foxglovePanelTitle", "lichtblickPanelTitle"] {
            config[key] = title.into();
        }
        self.configs.insert(id.clone(), config);
        id.into()
    }

    /// The settings by panel id.
    pub(super) fn into_configs(self) -> Map<String, Value> {
        self.configs
    }
}

/// Two parts side by side; the first takes `per_cent` of the width.
pub(super) fn beside(first: Value, per_cent: f64, second: Value) -> Value {
    split("row", first, per_cent, second)
}

/// One part above another; the first takes `per_cent` of the height.
pub(super) fn above(first: Value, per_cent: f64, second: Value) -> Value {
    split("column", first, per_cent, second)
}

fn split(direction: &str, first: Value, per_cent: f64, second: Value) -> Value {
    let settings = [
        ("direction", direction.into()),
        ("first", first),
        ("second", second),
        ("splitPercentage", per_cent.into()),
    ];
    Value::from_iter(settings)
}

/// Parts of equal height, the first on top.
pub(super) fn stacked(mut parts: Vec<Value>) -> Value {
    // A split has two parts, so nest the splits from the bottom up. The upper part of each gets the share that leaves
    // all parts equally high.
    let mut stack = parts.pop().unwrap_or_default();
    let mut height = 1.0;
    while let Some(part) = parts.pop() {
        height += 1.0;
        stack = above(part, 100.0 / height, stack);
    }
    stack
}

/// A tab with its content.
pub(super) fn tab(title: &str, layout: &Value) -> Value {
    json!({ "title": title, "layout": layout })
}
