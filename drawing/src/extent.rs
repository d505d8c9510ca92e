//! The range of values along one axis.
//!
//! Must never contain an infinite or undefined value, nor a lower end above the upper one.

/// The lowest and the highest value of an axis.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    /// The extent of all finite `values`. Without any finite value it is 0 to 1.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Self {
        let empty = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };
        let widen =
            |extent: Self, value: f64| Self { low: extent.low.min(value), high: extent.high.max(value) };
        let extent = values.filter(|value| value.is_finite()).fold(empty, widen);
        // The ends are still the wrong way round if no value was finite.
        if extent.low > extent.high { Self { low: 0.0, high: 1.0 } } else { extent }
    }

    pub(crate) fn size(self) -> f64 {
        self.high - self.low
    }

    /// Adds `share` of the size at both ends, or more, so that the result is at least `least` long.
    pub(crate) fn padded(self, share: f64, least: f64) -> Self {
        // A constant line still needs an axis with two different ends.
        let padding = (share * self.size()).max((least - self.size()) / 2.0).max(1e-9);
        Self { low: self.low - padding, high: self.high + padding }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_values_stretch_an_axis() {
        let ends = |values: &[f64]| {
            let extent = Extent::of(values.iter().copied());
            (extent.low, extent.high)
        };
        assert_eq!(ends(&[3.0, f64::NAN, -1.0, f64::INFINITY]), (-1.0, 3.0));
        assert_eq!(ends(&[f64::NAN]), (0.0, 1.0));
    }

    #[test]
    fn padding_keeps_the_middle_and_the_least_length() {
        let padded = Extent { low: 4.0, high: 6.0 }.padded(0.1, 10.0);
        assert_eq!((padded.low, padded.high), (0.0, 10.0));
        let point = Extent { low: 5.0, high: 5.0 }.padded(0.1, 0.0);
        assert!(point.low < 5.0 && point.high > 5.0);
    }
}
