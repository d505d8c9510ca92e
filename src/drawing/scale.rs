//! What the numbers along an axis stand for: where its ticks are, and what stands at them.
//!
//! Never moves a point: a logarithmic axis is drawn from logarithms.

use super::chart::Extent;
use plotters::coord::{
    ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter},
    types::RangedCoordf64,
};
use std::ops::Range;

/// Decades that an axis may span for more ticks than its powers of ten.
const FEW_DECADES: f64 = 3.2;

/// What a coordinate means.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Itself.
    #[default]
    Linear,
    /// The power of ten that is shown as such: -3 is `1e-3`.
    Powers,
    /// The logarithm to base 10 of what is shown: 2 is `100`.
    Log,
    /// A share, by how little is left above it, in powers of ten: 2 is `99 %`, 3 is `99.9 %`.
    Shares,
}

impl Scale {
    /// Where the ticks are, about `most` of them.
    fn ticks(self, extent: Extent, most: usize) -> Vec<f64> {
        match self {
            Self::Linear | Self::Powers => RangedCoordf64::from(extent.low..extent.high).key_points(most),
            Self::Shares => steps(extent, &[1.0]),
            Self::Log if extent.size() > FEW_DECADES => steps(extent, &[1.0]),
            Self::Log => steps(extent, &[1.0, 2.0, 5.0]),
        }
    }

    /// What stands at `value`.
    fn label(self, value: f64) -> String {
        let is_whole = (value - value.round()).abs() < 1e-6;
        match self {
            Self::Linear => plain(value),
            Self::Powers if is_whole => format!("1e{}", value.round()),
            Self::Powers => String::new(),
            Self::Log => plain(10_f64.powf(value)),
            Self::Shares => share(value),
        }
    }
}

/// An axis as plotters draws it.
pub(super) struct Axis {
    range: RangedCoordf64,
    ticks: Vec<f64>,
    scale: Scale,
}

impl Axis {
    /// With about `ticks` ticks, or none.
    pub(super) fn new(scale: Scale, extent: Extent, ticks: usize) -> Self {
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
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.range()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        plain(*value)
    }

    fn format_ext(&self, value: &f64) -> String {
        self.scale.label(*value)
    }
}

/// `0 %`, `90 %`, `99 %`, `99.9 %` and so on.
fn share(nines: f64) -> String {
    let nines = nines.round().max(0.0);
    let places = (nines as usize).saturating_sub(2);
    format!("{:.places$} %", 100.0 * (1.0 - 10_f64.powf(-nines)))
}

/// The logarithms of `factors` times every power of ten, as far as `extent` goes.
fn steps(extent: Extent, factors: &[f64]) -> Vec<f64> {
    let decades = extent.low.floor() as i32..=extent.high.ceil() as i32;
    let of_decade = |decade: i32| factors.iter().map(move |factor| f64::from(decade) + factor.log10());
    decades.flat_map(of_decade).filter(|at| (extent.low..=extent.high).contains(at)).collect()
}

/// A number without idle zeros.
fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_axes_are_short() {
        assert_eq!([plain(10.0), plain(-0.00001), plain(0.25)], ["10", "0", "0.25"]);
    }

    #[test]
    fn logarithms_show_what_they_are_of() {
        let labels = |scale: Scale, low, high| -> Vec<String> {
            scale.ticks(Extent { low, high }, 10).into_iter().map(|at| scale.label(at)).collect()
        };
        assert_eq!(labels(Scale::Log, 0.0, 1.0), ["1", "2", "5", "10"]);
        assert_eq!(labels(Scale::Log, -0.35, 0.31), ["0.5", "1", "2"]);
        assert_eq!(labels(Scale::Log, 0.5, 4.1), ["10", "100", "1000", "10000"]);
        assert_eq!(labels(Scale::Shares, 0.0, 4.3), ["0 %", "90 %", "99 %", "99.9 %", "99.99 %"]);
        assert_eq!((Scale::Powers.label(-3.0), Scale::Powers.label(0.5)), ("1e-3".into(), String::new()));
    }
}
