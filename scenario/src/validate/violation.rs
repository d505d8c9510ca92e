//! A value that is impossible by itself or together with others, and the bounds that quantities share.
//!
//! Never decides which value is to blame: the reader of the scenario does.

use crate::key;
use std::ops::RangeInclusive;

/// An impossible value, or several values that are impossible together.
///
/// Any of those values may be the wrong one, so there is a message for each. The reader of the scenario picks the value
/// that the user set last.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Violation {
    /// The possible messages, the preferred one first.
    pub(crate) blames: Vec<Blame>,
    /// Further keys on which the violation depends; it means nothing if one of them has a wrong value.
    depends_on: Vec<String>,
}

/// A violation as told to the author of one key.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blame {
    pub(crate) key: String,
    pub(crate) message: String,
}

impl Violation {
    /// A violation that `key` alone may be blamed for.
    pub(super) fn at(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self::default().or_at(key, message)
    }

    /// The same violation, for which `key` may be blamed as well.
    pub(super) fn or_at(mut self, key: impl Into<String>, message: impl Into<String>) -> Self {
        self.blames.push(Blame { key: key.into(), message: message.into() });
        self
    }

    /// The same violation, which also depends on `key`.
    pub(super) fn depending_on(mut self, key: impl Into<String>) -> Self {
        self.depends_on.push(key.into());
        self
    }

    /// Every key on which the violation depends.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        self.blames.iter().map(|blame| blame.key.as_str()).chain(self.depends_on.iter().map(String::as_str))
    }
}

/// A key and its number.
#[derive(Debug, Clone, Copy)]
pub(super) struct CheckedQuantity<'k> {
    pub(super) key: &'k str,
    pub(super) value: f64,
}

/// The quantity of `key`.
pub(super) fn quantity(key: &str, value: impl Into<f64>) -> CheckedQuantity<'_> {
    CheckedQuantity { key, value: value.into() }
}

impl CheckedQuantity<'_> {
    /// The number with its unit: `12 m/s`.
    pub(super) fn measure(&self) -> String {
        key::with_unit(self.key, self.value)
    }

    /// Name and number for a message about `other`, without the section if that is the same: `speed_min_m_s 12 m/s`.
    pub(super) fn beside(&self, other: &str) -> String {
        let (section, name) = key::split(self.key);
        let name = if section == key::split(other).0 { name } else { self.key };
        format!("{name} {}", self.measure())
    }

    /// Refuses 0 and less.
    pub(super) fn above_zero(self) -> Option<Violation> {
        let message = || format!("{} is not above 0: give a larger value", self.measure());
        (self.value <= 0.0).then(|| Violation::at(self.key, message()))
    }

    /// Refuses less than 0.
    pub(super) fn not_below_zero(self) -> Option<Violation> {
        let message = || format!("{} is below 0: give 0 or more", self.measure());
        (self.value < 0.0).then(|| Violation::at(self.key, message()))
    }

    /// Refuses what is not in `range`.
    pub(super) fn within(self, range: RangeInclusive<f64>) -> Option<Violation> {
        let (low, high) = (*range.start(), key::with_unit(self.key, *range.end()));
        let message = || format!("{} is outside {low} to {high}: give a value in this range", self.measure());
        (!range.contains(&self.value)).then(|| Violation::at(self.key, message()))
    }

    /// Refuses a time that is 0, or so long that it must be a mistake.
    pub(super) fn timeout(self, longest_s: f64) -> Option<Violation> {
        // A range includes its lower end, so 0 needs a check of its own.
        self.above_zero().or_else(|| self.within(0.0..=longest_s))
    }

    /// Refuses more than `high`; either of the two may be blamed.
    pub(super) fn at_most(self, high: CheckedQuantity<'_>) -> Option<Violation> {
        (self.value > high.value).then(|| out_of_order(self, "above", high, "below"))
    }

    /// Refuses as much as `high` or more; either of the two may be blamed.
    pub(super) fn below(self, high: CheckedQuantity<'_>) -> Option<Violation> {
        (self.value >= high.value).then(|| out_of_order(self, "not below", high, "not above"))
    }
}

/// The violation of two quantities: seen from `low` it is `low_is` the other one, and seen from `high` `high_is`.
fn out_of_order(
    low: CheckedQuantity<'_>,
    low_is: &str,
    high: CheckedQuantity<'_>,
    high_is: &str,
) -> Violation {
    let message = |one: CheckedQuantity<'_>, relation: &str, other: CheckedQuantity<'_>, remedy: &str| {
        format!("{} is {relation} {}: give a {remedy} value", one.measure(), other.beside(one.key))
    };
    Violation::at(high.key, message(high, high_is, low, "larger"))
        .or_at(low.key, message(low, low_is, high, "smaller"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(violation: Option<Violation>) -> Vec<String> {
        let line = |blame: Blame| format!("{}: {}", blame.key, blame.message);
        violation.into_iter().flat_map(|violation| violation.blames).map(line).collect()
    }

    #[test]
    fn a_message_names_the_bound_with_its_unit() {
        let spacing = |value| quantity("formation.spacing_m", value);
        assert_eq!(
            messages(spacing(0.0).above_zero()),
            ["formation.spacing_m: 0 m is not above 0: give a larger value"]
        );
        assert_eq!(
            messages(spacing(-0.5).not_below_zero()),
            ["formation.spacing_m: -0.5 m is below 0: give 0 or more"]
        );
        assert_eq!(
            messages(spacing(7.0).within(1.0..=5.0)),
            ["formation.spacing_m: 7 m is outside 1 to 5 m: give a value in this range"]
        );
        assert_eq!(spacing(0.0).not_below_zero(), None);
        assert_eq!(spacing(5.0).within(1.0..=5.0), None);
    }

    #[test]
    fn two_values_out_of_order_have_a_message_for_each() {
        let low = quantity("airframe.speed_min_m_s", 12.0);
        let high = quantity("airframe.speed_max_m_s", 10.0);
        assert_eq!(
            messages(low.at_most(high)),
            [
                "airframe.speed_max_m_s: 10 m/s is below speed_min_m_s 12 m/s: give a larger value",
                "airframe.speed_min_m_s: 12 m/s is above speed_max_m_s 10 m/s: give a smaller value",
            ]
        );
        let leader = quantity("leader.speed_m_s", 12.0);
        assert_eq!(low.at_most(leader), None);
        assert_eq!(
            messages(low.below(leader))[0],
            "leader.speed_m_s: 12 m/s is not above airframe.speed_min_m_s 12 m/s: give a larger value"
        );
    }
}
