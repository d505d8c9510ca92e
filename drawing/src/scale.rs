//! What the numbers along an axis mean: where its ticks are and how they are labelled.
//!
//! Must never move a point: on a logarithmic axis, callers hand in logarithms.

use crate::extent::Extent;
use plotters::coord::{
    ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter},
    types::RangedCoordf64,
};
use std::ops::Range;

/// Longest logarithmic axis, in decades, that has ticks at 2 and 5 between the powers of ten. On longer axes their labels
/// would overlap.
const MAX_DECADES_WITH_SUBTICKS: f64 = 3.2;

/// What a coordinate means.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// The value itself.
    #[default]
    Linear,
    /// An exponent to base 10, labelled as a power: -3 reads `1e-3`.
    Powers,
    /// A logarithm to base 10, labelled with the number that it stands for: 2 reads `100`.
    Log,
    /// A percentile, given as the number of nines: 2 reads `99 %`, 3 reads `99.9 %`.
    Shares,
}

impl Scale {
    /// The positions of about `wanted` ticks.
    fn ticks(self, extent: Extent, wanted: usize) -> Vec<f64> {
        match self {
            Self::Linear | Self::Powers => RangedCoordf64::from(extent.low..extent.high).key_points(wanted),
            // `percentile` rounds to whole nines, so a tick between them would have a wrong label.
            Self::Shares => decade_ticks(extent, &[1.0]),
            Self::Log if extent.size() > MAX_DECADES_WITH_SUBTICKS => decade_ticks(extent, &[1.0]),
            Self::Log => decade_ticks(extent, &[1.0, 2.0, 5.0]),
        }
    }

    /// The label of the tick at `value`.
    pub(crate) fn label(self, value: f64) -> String {
        // Tick positions are computed in floating point, so a whole exponent can be off by a rounding error.
        let is_whole = (value - value.round()).abs() < 1e-6;
        match self {
            Self::Linear => short(value),
            Self::Powers if is_whole => format!("1e{}", value.round()),
            // Between two powers a label would be hard to read, such as 1e-2.5.
            Self::Powers => String::new(),
            Self::Log => short(10_f64.powf(value)),
            Self::Shares => percentile(value),
        }
    }
}

/// An axis that plotters can draw.
pub(crate) struct Axis {
    range: RangedCoordf64,
    ticks: Vec<f64>,
    scale: Scale,
}

impl Axis {
    /// An axis with about `ticks` ticks; with 0, it has no tick at all.
    pub(crate) fn new(scale: Scale, extent: Extent, ticks: usize) -> Self {
        let range = (extent.low..extent.high).into();
        Self { range, ticks: if ticks > 0 { scale.ticks(extent, ticks) } else { Vec::new() }, scale }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.range.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // Light points are the unlabelled grid lines between ticks; charts have none.
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.range()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        short(*value)
    }

    fn format_ext(&self, value: &f64) -> String {
        self.scale.label(*value)
    }
}

/// The percentile with this many nines: `0 %`, `90 %`, `99 %`, `99.9 %` and so on.
fn percentile(nines: f64) -> String {
    let nines = nines.round().max(0.0);
    // 90 % and 99 % need no decimals; each further nine needs one.
    let decimals = (nines as usize).saturating_sub(2);
    format!("{:.decimals$} %", 100.0 * (1.0 - 10_f64.powf(-nines)))
}

/// The logarithms within `extent` of `factors` times any power of ten.
fn decade_ticks(extent: Extent, factors: &[f64]) -> Vec<f64> {
    // Start one decade early, because its 2 or 5 can lie within the extent.
    let decades = extent.low.floor() as i32..=extent.high.ceil() as i32;
    let of_decade = |decade: i32| factors.iter().map(move |factor| f64::from(decade) + factor.log10());
    decades.flat_map(of_decade).filter(|tick| (extent.low..=extent.high).contains(tick)).collect()
}

/// A number with at most four decimals and no trailing zeros.
fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    // A small negative number is rounded to -0.
    if short == "-0" { "0".into() } else { short.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_axes_are_short() {
        assert_eq!([short(10.0), short(-0.00001), short(0.25)], ["10", "0", "0.25"]);
    }

    #[test]
    fn logarithmic_axes_are_labeled_with_the_numbers_themselves() {
        let labels = |scale: Scale, low, high| -> Vec<String> {
            scale.ticks(Extent { low, high }, 10).into_iter().map(|tick| scale.label(tick)).collect()
        };
        assert_eq!(labels(Scale::Log, 0.0, 1.0), ["1", "2", "5", "10"]);
        assert_eq!(labels(Scale::Log, -0.35, 0.31), ["0.5", "1", "2"]);
        assert_eq!(labels(Scale::Log, 0.5, 4.1), ["10", "100", "1000", "10000"]);
        assert_eq!(labels(Scale::Shares, 0.0, 4.3), ["0 %", "90 %", "99 %", "99.9 %", "99.99 %"]);
        assert_eq!((Scale::Powers.label(-3.0), Scale::Powers.label(0.5)), ("1e-3".into(), String::new()));
    }
}
