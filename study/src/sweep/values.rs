//! The values of an axis, as users write them: `0, 0.1 .. 1.0`, `log 0.01 .. 1 in 5`, `uniform 0 .. 2`.
//!
//! Never knows what the values are for. A value stays the text that was written, because that text is what `ringwing run`
//! gets to fly one flight again.

use serde::{Deserialize, Serialize};

/// Most values of one axis. More are a mistake, such as a step that is too small by some powers of ten.
const VALUES_MAX: usize = 1_000_000;
/// Significant digits of a computed value. Fewer would move values visibly; more would show rounding errors, such as
/// 0.30000000000000004.
const DIGITS: usize = 10;
/// Bins of a random axis in maps. More show finer shapes, but each has fewer flights.
const BINS: u32 = 8;
/// How far beyond its end a range may go, in steps, so that a rounding error does not cost the last value.
const END_TOLERANCE: f64 = 1e-6;

/// The values of an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Values {
    /// These values, in this order.
    Listed(Vec<String>),
    /// Random draws, one for each sample of the sweep.
    Drawn(Distribution),
}

/// What values are drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// The lowest value.
    pub low: f64,
    /// The value below which all draws are.
    pub high: f64,
    /// Whether the logarithm is uniform, and not the value itself.
    pub is_log: bool,
}

impl Distribution {
    /// The value at the share `u` of the distribution, in [0, 1).
    pub fn at(&self, u: f64) -> String {
        let value = if self.is_log {
            libm::exp(libm::log(self.low) + u * (libm::log(self.high) - libm::log(self.low)))
        } else {
            self.low + u * (self.high - self.low)
        };
        number_text(value)
    }

    /// The middle of the bin that a drawn `value` is in: maps show random axes in bins.
    pub fn bin(&self, value: &str) -> String {
        let Ok(value) = value.parse::<f64>() else { return value.to_owned() };
        let share = if self.is_log {
            (libm::log(value) - libm::log(self.low)) / (libm::log(self.high) - libm::log(self.low))
        } else {
            (value - self.low) / (self.high - self.low)
        };
        // A draw is rounded to some digits and may come out as `high`, which is beyond the last bin.
        let bin = ((share * f64::from(BINS)) as u32).min(BINS - 1);
        let middle: f64 = self.at((f64::from(bin) + 0.5) / f64::from(BINS)).parse().unwrap_or(value);
        // Three digits, because the middle of a bin is no exact number.
        number_text(format!("{middle:.2e}").parse().unwrap_or(middle))
    }
}

/// Reads the values in `text`: a list of items, separated by commas, or a distribution.
///
/// An item is a word, a number, or a range: `A .. B step S`, `A .. B in N` for N values, or `A .. B` after two numbers of
/// the list, which give the step. `log A .. B in N` spaces them evenly in the logarithm.
///
/// # Errors
/// What is wrong, and what to write.
pub(super) fn parse(text: &str) -> Result<Values, String> {
    for (word, is_log) in [("uniform ", false), ("log-uniform ", true)] {
        if let Some(range) = text.trim().strip_prefix(word) {
            return distribution(range, is_log).map(Values::Drawn);
        }
    }
    let mut listed = Vec::new();
    for item in items(text) {
        if item.is_empty() {
            return Err(format!("{text:?} has an empty item: give values such as 0, 0.1 .. 1.0"));
        }
        match item.split_once("..") {
            Some((from, to)) => add_range(&mut listed, from.trim(), to.trim())?,
            None => listed.push(item.to_owned()),
        }
        if listed.len() > VALUES_MAX {
            return Err(format!("more than {VALUES_MAX} values: give a larger step"));
        }
    }
    Ok(Values::Listed(listed))
}

/// The items of a list. A comma inside brackets belongs to its item: `[150, 10]` is one position.
fn items(text: &str) -> Vec<&str> {
    let (mut items, mut depth, mut start) = (Vec::new(), 0_u32, 0);
    for (index, letter) in text.char_indices() {
        match letter {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                items.push(text[start..index].trim());
                start = index + 1;
            }
            _ => {}
        }
    }
    items.push(text[start..].trim());
    items
}

fn add_range(listed: &mut Vec<String>, from: &str, to: &str) -> Result<(), String> {
    let (is_log, from) = from.strip_prefix("log ").map_or((false, from), |from| (true, from.trim()));
    let first = number(from)?;
    if let Some((to, count)) = to.split_once(" in ") {
        let count = count.trim().parse().ok().filter(|count| (1..=VALUES_MAX).contains(count));
        let count = count
            .ok_or_else(|| format!("{to:?} in how many values? Give a number from 1 to {VALUES_MAX}"))?;
        listed.extend(spaced(first, number(to.trim())?, count, is_log)?);
        return Ok(());
    }
    if is_log {
        return Err("a logarithmic range needs a number of values, such as log 0.01 .. 1 in 5".into());
    }
    let (last, step) = match to.split_once(" step ") {
        Some((last, step)) => (number(last.trim())?, number(step.trim())?),
        None => (number(to)?, step_before(listed, first)?),
    };
    listed.extend(stepped(first, last, step)?);
    Ok(())
}

/// The step that the value before a range gives: in `0, 0.1 .. 1.0` it is 0.1. Without such a value, the step of whole
/// numbers is 1.
fn step_before(listed: &[String], first: f64) -> Result<f64, String> {
    match listed.last().map(|before| number(before)) {
        Some(before) => Ok(first - before?),
        None if first.fract() == 0.0 => Ok(1.0),
        None => Err(format!(
            "the range from {first} needs a step, such as {first} .. B step S, {first} .. B in 11, or A, {first} .. B"
        )),
    }
}

fn stepped(first: f64, last: f64, step: f64) -> Result<Vec<String>, String> {
    let steps = (last - first) / step;
    if steps.is_nan() || steps + END_TOLERANCE < 0.0 || step == 0.0 {
        return Err(format!("empty range: from {first} in steps of {step} no value comes to {last}"));
    }
    if steps > VALUES_MAX as f64 {
        return Err(format!("more than {VALUES_MAX} values: give a larger step"));
    }
    Ok((0..=(steps + END_TOLERANCE) as u32)
        .map(|index| number_text(first + f64::from(index) * step))
        .collect())
}

fn spaced(first: f64, last: f64, count: usize, is_log: bool) -> Result<Vec<String>, String> {
    if is_log && (first <= 0.0 || last <= 0.0) {
        return Err(format!("a logarithmic range must be above 0, and {first} .. {last} is not"));
    }
    if count > 1 && first == last {
        return Err(format!("empty range: {first} .. {last} has only one value"));
    }
    // A single value is the first one: with no gaps to divide by, its share would be no number.
    let share = |index: usize| if count > 1 { index as f64 / (count - 1) as f64 } else { 0.0 };
    let value = |index| {
        let share = share(index);
        if is_log { first * libm::pow(last / first, share) } else { first + share * (last - first) }
    };
    Ok((0..count).map(|index| number_text(value(index))).collect())
}

fn distribution(range: &str, is_log: bool) -> Result<Distribution, String> {
    let (low, high) = range.split_once("..").ok_or("a distribution needs a range, such as uniform 0 .. 2")?;
    let (low, high) = (number(low.trim())?, number(high.trim())?);
    if low >= high {
        return Err(format!("empty range: {low} is not below {high}"));
    }
    if is_log && low <= 0.0 {
        return Err(format!("a logarithmic distribution must be above 0, and {low} is not"));
    }
    Ok(Distribution { low, high, is_log })
}

fn number(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|number: &f64| number.is_finite());
    parsed.ok_or_else(|| format!("{text:?} is not a number: a range needs numbers, such as 0 .. 1 step 0.1"))
}

/// A computed value as text, without the digits that only show rounding errors.
pub fn number_text(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    // A rounding error around 0 would be written as -0 or as 1e-17.
    if rounded.abs() < 1e-12 { "0".into() } else { rounded.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(text: &str) -> Vec<String> {
        match parse(text).unwrap() {
            Values::Listed(values) => values,
            drawn @ Values::Drawn(_) => panic!("{drawn:?}"),
        }
    }

    #[test]
    fn lists_and_ranges_give_the_values_that_people_would_write() {
        assert_eq!(listed("0, 0.1 .. 0.5"), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(listed("1 .. 4"), ["1", "2", "3", "4"]);
        assert_eq!(listed("0 .. 1 step 0.25, 2, paper"), ["0", "0.25", "0.5", "0.75", "1", "2", "paper"]);
        assert_eq!(listed("2 .. 1 in 3"), ["2", "1.5", "1"]);
        assert_eq!(listed("log 0.01 .. 1 in 3"), ["0.01", "0.1", "1"]);
        assert_eq!(listed("[150, 10], [160, 10]"), ["[150, 10]", "[160, 10]"]);
        assert_eq!(listed("1.0, 0.8 .. 0.2"), ["1.0", "0.8", "0.6", "0.4", "0.2"]);
    }

    #[test]
    fn empty_and_endless_ranges_are_refused() {
        for (text, part) in [
            ("1 .. 0", "empty range"),
            ("0 .. 1 step 0", "empty range"),
            ("0 .. 1 step -0.1", "empty range"),
            ("uniform 2 .. 2", "empty range"),
            ("0.5 .. 1", "needs a step"),
            ("log 0 .. 1 in 3", "above 0"),
            ("log 1 .. 2", "number of values"),
            ("0 .. 1 in 0", "in how many"),
            ("a .. b", "not a number"),
            ("1,,2", "empty item"),
            ("", "empty item"),
            ("0 .. 1 step 1e-9", "larger step"),
            ("0 .. inf", "not a number"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn draws_lie_within_their_distribution() {
        let Values::Drawn(uniform) = parse("uniform 1 .. 3").unwrap() else { panic!("drawn") };
        assert_eq!([uniform.at(0.0), uniform.at(0.5)], ["1", "2"]);
        let Values::Drawn(log) = parse("log-uniform 0.01 .. 1").unwrap() else { panic!("drawn") };
        assert_eq!([log.at(0.0), log.at(0.5)], ["0.01", "0.1"]);
        assert_eq!(["1", "1.2", "2.99"].map(|value| uniform.bin(value)), ["1.12", "1.12", "2.88"]);
    }
}
