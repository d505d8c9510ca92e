//! Whether a scenario's tree has the example's shape: its keys, and values of its types.
//!
//! Never knows which values are possible beyond that: the deserializer knows choices and ranges, `validate` the rest.

use crate::{example, hint};
use toml::{
    Spanned,
    de::{DeArray, DeString, DeTable, DeValue},
};

/// Numbers beyond this are mistakes, and would overflow when squared and multiplied often enough.
const MAGNITUDE_MAX: f64 = 1e7;
/// How much of a wrong text is quoted.
const QUOTE_MAX: usize = 40;

/// A place where the tree has not the example's shape.
#[derive(Debug)]
pub(crate) struct Misfit {
    pub(crate) key: String,
    pub(crate) position: usize,
    pub(crate) message: String,
}

/// Makes `value` fit the example under `key`: what does not is noted, and gone or replaced by the example's.
pub(crate) fn fit(
    value: &mut Spanned<DeValue<'_>>,
    wanted: &DeValue<'static>,
    key: &str,
    misfits: &mut Vec<Misfit>,
) {
    if let Some(what) = mismatch(value.get_ref(), wanted) {
        let message = format!("{what}: {}", example::remedy(key, wanted));
        misfits.push(Misfit { key: key.to_owned(), position: value.span().start, message });
        *value.get_mut() = wanted.clone();
        return;
    }
    match (value.get_mut(), wanted) {
        (DeValue::Table(table), DeValue::Table(wanted)) => fit_table(table, wanted, key, misfits),
        (DeValue::Array(list), DeValue::Array(wanted)) => fit_list(list, wanted, key, misfits),
        _ => {}
    }
}

fn fit_table(table: &mut DeTable<'_>, wanted: &DeTable<'static>, key: &str, misfits: &mut Vec<Misfit>) {
    let mut unknown = Vec::new();
    for (name, value) in table.iter_mut() {
        let inner = example::join(key, name.get_ref());
        if let Some(wanted) = wanted.get(name.get_ref().as_ref()) {
            fit(value, wanted.get_ref(), &inner, misfits);
        } else {
            let message = hint::unknown_key(key, name.get_ref(), wanted);
            misfits.push(Misfit { key: inner, position: name.span().start, message });
            unknown.push(name.get_ref().to_string());
        }
    }
    for name in unknown {
        table.remove(name.as_str());
    }
}

/// In a list of sections, each must have every key.
fn fit_list(list: &mut DeArray<'_>, wanted: &DeArray<'static>, key: &str, misfits: &mut Vec<Misfit>) {
    let Some(DeValue::Table(every)) = wanted.first().map(Spanned::get_ref) else { return };
    for (index, section) in list.iter_mut().enumerate() {
        let key = format!("{key}.{index}");
        fit(section, &DeValue::Table(every.clone()), &key, misfits);
        let position = section.span().start;
        if let DeValue::Table(table) = section.get_mut() {
            complete(table, every, &key, position, misfits);
        }
    }
}

fn complete(
    table: &mut DeTable<'_>,
    every: &DeTable<'static>,
    section: &str,
    position: usize,
    misfits: &mut Vec<Misfit>,
) {
    for (name, wanted) in every {
        if !table.contains_key(name.get_ref().as_ref()) {
            let key = example::join(section, name.get_ref());
            let message = format!("is missing: {}", example::remedy(&key, wanted.get_ref()));
            misfits.push(Misfit { key, position, message });
            table.insert(Spanned::new(0..0, name.get_ref().clone()), wanted.clone());
        }
    }
}

/// What is wrong with the type of `value`, if anything.
fn mismatch(value: &DeValue<'_>, wanted: &DeValue<'_>) -> Option<String> {
    match (value, wanted) {
        (DeValue::Float(_) | DeValue::Integer(_), DeValue::Float(_)) => bad_number(number(value)?),
        (DeValue::Float(float), DeValue::Integer(_)) => {
            Some(format!("{} is no whole number", float.as_str()))
        }
        (DeValue::Array(list), DeValue::Array(pair)) if !example::is_section_list(wanted) => {
            bad_list(list, pair)
        }
        _ if value.same_type(wanted) => None,
        _ => Some(describe(value)),
    }
}

fn bad_list(list: &DeArray<'_>, wanted: &DeArray<'_>) -> Option<String> {
    if list.len() != wanted.len() {
        return Some(format!("this is a list of {}", list.len()));
    }
    list.iter().zip(wanted.iter()).find_map(|(value, wanted)| mismatch(value.get_ref(), wanted.get_ref()))
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        // A whole number too long for 128 bits is beyond any bound.
        DeValue::Integer(integer) => Some(
            i128::from_str_radix(integer.as_str(), integer.radix()).map_or(f64::MAX, |number| number as f64),
        ),
        _ => None,
    }
}

fn bad_number(number: f64) -> Option<String> {
    if !number.is_finite() {
        Some(format!("{number} is not finite"))
    } else if number.abs() > MAGNITUDE_MAX {
        Some(format!("{number:e} is beyond {MAGNITUDE_MAX:e}"))
    } else {
        None
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("{} is text", quote(text)),
        DeValue::Integer(number) => format!("{number} is a number"),
        DeValue::Float(number) => format!("{} is a number", number.as_str()),
        DeValue::Boolean(truth) => format!("{truth} is a truth value"),
        DeValue::Datetime(date) => format!("{date} is a date"),
        DeValue::Array(list) => format!("this is a list of {}", list.len()),
        DeValue::Table(_) => "this is a section".into(),
    }
}

/// `text` in quotes on one line, its end left out when it is long.
pub(crate) fn quote(text: &str) -> String {
    let mut start: String = text.chars().take(QUOTE_MAX).collect();
    if start.len() < text.len() {
        start.push('…');
    }
    format!("{start:?}")
}

/// The value written as `text`: TOML, or else a word without its quotes.
pub(crate) fn value_of<'a>(text: &'a str, wanted: Option<&DeValue<'_>>) -> DeValue<'a> {
    let bare = DeValue::String(DeString::Borrowed(text));
    match DeValue::parse(text.trim()).map(Spanned::into_inner) {
        // Nobody quotes twice for the shell: what looks like a number can be a name.
        Ok(value) if !value.is_str() && wanted.is_some_and(DeValue::is_str) => bare,
        Ok(value) => value,
        Err(_) => bare,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is wrong with a text, one line for each misfit.
    fn misfits(text: &str) -> Vec<String> {
        let mut tree = Spanned::new(0..0, DeValue::Table(DeTable::parse(text).unwrap().into_inner()));
        let mut misfits = Vec::new();
        fit(&mut tree, example::tree(), "", &mut misfits);
        let mut again = Vec::new();
        fit(&mut tree, example::tree(), "", &mut again);
        assert!(again.is_empty(), "what was noted is put right");
        misfits.iter().map(|misfit| format!("{}: {}", misfit.key, misfit.message)).collect()
    }

    #[test]
    fn each_wrong_type_is_named_with_a_remedy() {
        let cases = [
            (
                "time.duration_s = '90 s'",
                "\"90 s\" is text: give a number of seconds without a unit, such as 90.0",
            ),
            ("time.rate_hz = 99.5", "99.5 is no whole number: give a whole number of hertz, such as 100"),
            ("time.real_time = 1", "1 is a number: give true or false, without quotes"),
            ("time.real_time = 'yes'", "\"yes\" is text: give true or false, without quotes"),
            ("control.slot_gain = true", "true is a truth value: give a number, such as 1.0"),
            ("control.law = 1", "1 is a number: give text in quotes, such as \"paper\""),
            ("name = 2026-01-02", "2026-01-02 is a date: give text in quotes, such as \"unnamed\""),
            (
                "leader.start_m = [1]",
                "this is a list of 1: give two numbers of metres, such as [900.0, 42.0]",
            ),
            (
                "leader.start_m = [1, 2, 3]",
                "this is a list of 3: give two numbers of metres, such as [900.0, 42.0]",
            ),
            ("leader.start_m = [1, 'b']", "\"b\" is text: give two numbers of metres, such as [900.0, 42.0]"),
            (
                "leader.start_m = [1, nan]",
                "NaN is not finite: give two numbers of metres, such as [900.0, 42.0]",
            ),
            ("time = 90", "90 is a number: give a section with its keys"),
            ("obstacles = 5", "5 is a number: give one [[obstacles]] section for each, or []"),
            ("seed = []", "this is a list of 0: give a whole number, such as 1"),
        ];
        for (text, wanted) in cases {
            let misfits = misfits(text);
            assert_eq!(misfits.len(), 1, "{text}");
            assert!(misfits[0].ends_with(&format!(": {wanted}")), "{misfits:?}");
        }
    }

    #[test]
    fn numbers_that_no_arithmetic_survives_are_refused() {
        for number in [
            "nan",
            "-nan",
            "inf",
            "-inf",
            "1e999",
            "1e8",
            "-1e300",
            "1000000000000000000000000000000000000000000",
        ] {
            assert_eq!(misfits(&format!("formation.spacing_m = {number}")).len(), 1, "{number}");
        }
    }

    #[test]
    fn a_section_of_a_list_must_have_every_key() {
        assert_eq!(
            misfits("[[start.uavs]]\nheading_deg = 1\nspeed_m_s = 15\nturn = 2"),
            [
                "start.uavs.0.turn: no such key; known here are heading_deg, position_m, speed_m_s",
                "start.uavs.0.position_m: is missing: give two numbers of metres, such as [900.0, 42.0]",
            ]
        );
        assert_eq!(misfits("obstacles = [7]"), ["obstacles.0: 7 is a number: give a section with its keys"]);
    }

    #[test]
    fn what_fits_is_left_alone() {
        assert!(misfits("formation.spacing_m = 40\nleader.start_m = [0, -1]\nobstacles = []").is_empty());
    }

    #[test]
    fn a_long_text_is_quoted_in_part() {
        assert_eq!(quote("a\nb"), "\"a\\nb\"");
        assert_eq!(quote(&"x".repeat(50)), format!("\"{}…\"", "x".repeat(40)));
    }

    #[test]
    fn a_bare_word_is_text_and_a_number_may_be_a_name() {
        let text = DeValue::String(DeString::Borrowed(""));
        assert_eq!(value_of("paper", None).as_str(), Some("paper"));
        assert_eq!(value_of("'paper'", Some(&text)).as_str(), Some("paper"));
        assert_eq!(value_of("2026", Some(&text)).as_str(), Some("2026"));
        assert!(value_of(" 2026 ", None).is_integer());
    }
}
