//! A value that is impossible, by itself or beside another.

use crate::{example, unit};
use std::ops::RangeInclusive;

/// An impossible value, or several that are impossible together.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Flaw {
    /// What to say to the author of each of the values; the first is preferred.
    pub(crate) views: Vec<View>,
    /// Further keys without which there is nothing to say.
    needs: Vec<String>,
}

/// A flaw as seen from one key.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    pub(crate) key: String,
    pub(crate) message: String,
}

impl Flaw {
    /// A flaw of `key`.
    pub(crate) fn of(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self::default().or(key, message)
    }

    /// The same flaw seen from `key`.
    pub(crate) fn or(mut self, key: impl Into<String>, message: impl Into<String>) -> Self {
        self.views.push(View { key: key.into(), message: message.into() });
        self
    }

    /// There is no flaw when `key` is not what it should be.
    pub(crate) fn needs(mut self, key: impl Into<String>) -> Self {
        self.needs.push(key.into());
        self
    }

    /// All keys that it depends on.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        self.views.iter().map(|view| view.key.as_str()).chain(self.needs.iter().map(String::as_str))
    }
}

/// A key with its number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quantity<'k> {
    pub(crate) key: &'k str,
    pub(crate) value: f64,
}

/// Short for a [`Quantity`].
pub(crate) fn quantity(key: &str, value: impl Into<f64>) -> Quantity<'_> {
    Quantity { key, value: value.into() }
}

impl Quantity<'_> {
    /// The number with its unit.
    pub(crate) fn measure(&self) -> String {
        unit::measure(self.key, self.value)
    }

    /// As it is called beside `other`, whose section need not be said again.
    pub(crate) fn beside(&self, other: &str) -> String {
        let section = |key: &str| key.rsplit_once('.').map(|(section, _)| section.to_owned());
        let name = if section(self.key) == section(other) { example::last(self.key) } else { self.key };
        format!("{name} {}", self.measure())
    }

    pub(crate) fn above_zero(self) -> Option<Flaw> {
        let message = || format!("{} is not above 0: give a larger one", self.measure());
        (self.value <= 0.0).then(|| Flaw::of(self.key, message()))
    }

    pub(crate) fn not_below_zero(self) -> Option<Flaw> {
        let message = || format!("{} is below 0: give 0 or more", self.measure());
        (self.value < 0.0).then(|| Flaw::of(self.key, message()))
    }

    pub(crate) fn within(self, range: RangeInclusive<f64>) -> Option<Flaw> {
        let (low, high) = (*range.start(), unit::measure(self.key, *range.end()));
        let message = || format!("{} is not within {low} to {high}: give one that is", self.measure());
        (!range.contains(&self.value)).then(|| Flaw::of(self.key, message()))
    }

    /// At most `high`.
    pub(crate) fn at_most(self, high: Quantity<'_>) -> Option<Flaw> {
        (self.value > high.value).then(|| disorder(high, "below", self, "above"))
    }

    /// Less than `high`.
    pub(crate) fn below(self, high: Quantity<'_>) -> Option<Flaw> {
        (self.value >= high.value).then(|| disorder(high, "not above", self, "not below"))
    }
}

fn disorder(high: Quantity<'_>, too_low: &str, low: Quantity<'_>, too_high: &str) -> Flaw {
    let said = |one: Quantity<'_>, how: &str, other: Quantity<'_>, remedy: &str| {
        format!("{} is {how} {}: give a {remedy} one", one.measure(), other.beside(one.key))
    };
    Flaw::of(high.key, said(high, too_low, low, "larger")).or(low.key, said(low, too_high, high, "smaller"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(flaw: Option<Flaw>) -> Vec<String> {
        let said = |view: View| format!("{}: {}", view.key, view.message);
        flaw.into_iter().flat_map(|flaw| flaw.views).map(said).collect()
    }

    #[test]
    fn a_bound_is_named_with_its_quantity_and_its_unit() {
        let spacing = |value| quantity("formation.spacing_m", value);
        assert_eq!(
            messages(spacing(0.0).above_zero()),
            ["formation.spacing_m: 0 m is not above 0: give a larger one"]
        );
        assert_eq!(
            messages(spacing(-0.5).not_below_zero()),
            ["formation.spacing_m: -0.5 m is below 0: give 0 or more"]
        );
        assert_eq!(
            messages(spacing(7.0).within(1.0..=5.0)),
            ["formation.spacing_m: 7 m is not within 1 to 5 m: give one that is"]
        );
        assert_eq!(spacing(0.0).not_below_zero(), None);
        assert_eq!(spacing(5.0).within(1.0..=5.0), None);
    }

    #[test]
    fn two_values_out_of_order_are_seen_from_both_sides() {
        let low = quantity("airframe.speed_min_m_s", 12.0);
        let high = quantity("airframe.speed_max_m_s", 10.0);
        assert_eq!(
            messages(low.at_most(high)),
            [
                "airframe.speed_max_m_s: 10 m/s is below speed_min_m_s 12 m/s: give a larger one",
                "airframe.speed_min_m_s: 12 m/s is above speed_max_m_s 10 m/s: give a smaller one",
            ]
        );
        let leader = quantity("leader.speed_m_s", 12.0);
        assert_eq!(low.at_most(leader), None);
        assert_eq!(
            messages(low.below(leader))[0],
            "leader.speed_m_s: 12 m/s is not above airframe.speed_min_m_s 12 m/s: give a larger one"
        );
    }
}
