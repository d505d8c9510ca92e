//! Planned changes of the formation.

use super::{FormationSection, ShapeName};
use crate::key;
use serde::{Deserialize, Serialize};

/// `[[manoeuvres]]`: from a moment on, another shape, spacing, bearing or order. What is left out stays as it was.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManoeuvreSection {
    /// When the slots begin to move.
    pub at_s: f64,
    /// How long they move.
    pub over_s: f64,
    /// See `formation.shape`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeName>,
    /// See `formation.spacing_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_m: Option<f64>,
    /// See `formation.bearing_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bearing_deg: Option<f64>,
    /// See `formation.sweep_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep_deg: Option<f64>,
    /// See `formation.aspect`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aspect: Option<f64>,
    /// See `formation.inner_ratio`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner_ratio: Option<f64>,
    /// See `formation.columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Who gets which slot.
    #[serde(default)]
    pub order: SlotOrder,
}

/// Which UAV gets which slot of the formation that a manoeuvre leads to. Ring neighbours stay the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlotOrder {
    /// The sum of the squared ways is smallest. Then no two slots come nearer to each other on the way than L / sqrt(2).
    #[default]
    Nearest,
    /// Each UAV keeps the number of its slot.
    Keep,
}

impl ManoeuvreSection {
    /// The formation after this manoeuvre, if it was `before`.
    pub(crate) fn applied_to(&self, before: &FormationSection) -> FormationSection {
        FormationSection {
            shape: self.shape.unwrap_or(before.shape),
            spacing_m: self.spacing_m.unwrap_or(before.spacing_m),
            bearing_deg: self.bearing_deg.unwrap_or(before.bearing_deg),
            sweep_deg: self.sweep_deg.unwrap_or(before.sweep_deg),
            aspect: self.aspect.unwrap_or(before.aspect),
            inner_ratio: self.inner_ratio.unwrap_or(before.inner_ratio),
            columns: self.columns.unwrap_or(before.columns),
            // What no manoeuvre changes, such as the number of UAVs.
            ..before.clone()
        }
    }

    /// What changes, as the summary names it: `vee, spacing 30 m, over 12 s`.
    pub fn text(&self) -> String {
        let shape = self.shape.map(|shape| shape.name().to_owned());
        let number = |name: &str, key: &str, value: Option<f64>| {
            Some(format!("{name} {}", key::with_unit(key, value?)))
        };
        let numbers = [
            number("spacing", "spacing_m", self.spacing_m),
            number("bearing", "bearing_deg", self.bearing_deg),
            number("sweep", "sweep_deg", self.sweep_deg),
            number("aspect", "aspect", self.aspect),
            number("inner ratio", "inner_ratio", self.inner_ratio),
            number("columns", "columns", self.columns.map(f64::from)),
            number("over", "over_s", Some(self.over_s)),
        ];
        shape.into_iter().chain(numbers.into_iter().flatten()).collect::<Vec<_>>().join(", ")
    }
}
