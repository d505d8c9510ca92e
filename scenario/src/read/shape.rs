//! Checks that a scenario's tree has the shape of the example: its keys, and values of its types.
//!
//! Never checks a value further: the deserializer knows choices and ranges, `validate` knows everything else.

use super::{example, hint};
use crate::key;
use ringwing_flight::counted;
use toml::{
    Spanned,
    de::{DeArray, DeString, DeTable, DeValue},
};

/// Larger numbers are mistakes: no quantity of a swarm comes near. Without a limit, products of them would overflow.
const MAGNITUDE_MAX: f64 = 1e7;
/// Characters of a wrong text that an error quotes; more would bury the message.
const QUOTE_MAX: usize = 40;

/// A value that does not have the shape of the example.
#[derive(Debug)]
pub(super) struct Mismatch {
    pub(super) key: String,
    pub(super) position: usize,
    pub(super) message: String,
}

/// Makes `value` fit the example `wanted` under `key`, and adds everything that does not fit to `mismatches`.
///
/// A wrong value is replaced by the example's and an unknown key is removed, so that the rest can still be checked.
pub(super) fn fit(
    value: &mut Spanned<DeValue<'_>>,
    wanted: &DeValue<'static>,
    key: &str,
    mismatches: &mut Vec<Mismatch>,
) {
    if let Some(error) = type_error(value.get_ref(), wanted) {
        let message = format!("{error}: {}", example::remedy(key, wanted));
        mismatches.push(Mismatch { key: key.to_owned(), position: value.span().start, message });
        *value.get_mut() = wanted.clone();
        return;
    }
    match (value.get_mut(), wanted) {
        (DeValue::Table(table), DeValue::Table(wanted)) => fit_table(table, wanted, key, mismatches),
        (DeValue::Array(list), DeValue::Array(wanted)) => fit_list(list, wanted, key, mismatches),
        _ => {}
    }
}

fn fit_table(table: &mut DeTable<'_>, wanted: &DeTable<'static>, key: &str, mismatches: &mut Vec<Mismatch>) {
    let mut unknown = Vec::new();
    for (name, value) in table.iter_mut() {
        let inner = key::join(key, name.get_ref());
        if let Some(wanted) = wanted.get(name.get_ref().as_ref()) {
            fit(value, wanted.get_ref(), &inner, mismatches);
        } else {
            let message = hint::unknown_key(key, name.get_ref(), wanted);
            mismatches.push(Mismatch { key: inner, position: name.span().start, message });
            unknown.push(name.get_ref().to_string());
        }
    }
    // The loop above borrows the table, so remove the unknown keys after it.
    for name in unknown {
        table.remove(name.as_str());
    }
}

/// Fits each section of a list of sections. Unlike other sections, they have no defaults, so every key is required but for a
/// few.
fn fit_list(list: &mut DeArray<'_>, wanted: &DeArray<'static>, key: &str, mismatches: &mut Vec<Mismatch>) {
    // Only lists of sections go further: `type_error` has checked the numbers of a position.
    let Some(DeValue::Table(every)) = wanted.first().map(Spanned::get_ref) else { return };
    for (index, section) in list.iter_mut().enumerate() {
        let key = format!("{key}.{index}");
        fit(section, &DeValue::Table(every.clone()), &key, mismatches);
        let position = section.span().start;
        if let DeValue::Table(table) = section.get_mut() {
            add_missing(table, every, &key, position, mismatches);
        }
    }
}

fn add_missing(
    table: &mut DeTable<'_>,
    every: &DeTable<'static>,
    section: &str,
    position: usize,
    mismatches: &mut Vec<Mismatch>,
) {
    for (name, wanted) in every {
        let key = key::join(section, name.get_ref());
        if !table.contains_key(name.get_ref().as_ref()) && !example::is_optional(&key) {
            let message = format!("missing: {}", example::remedy(&key, wanted.get_ref()));
            mismatches.push(Mismatch { key, position, message });
            // With the example's value in its place, the deserializer does not report the same key again.
            table.insert(Spanned::new(0..0, name.get_ref().clone()), wanted.clone());
        }
    }
}

/// What is wrong with the type of `value`, or `None` if it is that of `wanted`.
fn type_error(value: &DeValue<'_>, wanted: &DeValue<'_>) -> Option<String> {
    match (value, wanted) {
        // A whole number will do for any number: nobody should have to write 40.0 for 40.
        (DeValue::Float(_) | DeValue::Integer(_), DeValue::Float(_)) => number_error(number(value)?),
        (DeValue::Float(float), DeValue::Integer(_)) => {
            Some(format!("{} is not a whole number", float.as_str()))
        }
        (DeValue::Array(list), DeValue::Array(items))
            if example::is_position_list(wanted) || example::is_text_list(wanted) =>
        {
            let every = items.first()?.get_ref();
            list.iter().find_map(|item| type_error(item.get_ref(), every))
        }
        (DeValue::Array(list), DeValue::Array(pair)) if !example::is_section_list(wanted) => {
            list_error(list, pair)
        }
        _ if value.same_type(wanted) => None,
        _ => Some(describe(value)),
    }
}

fn list_error(list: &DeArray<'_>, wanted: &DeArray<'_>) -> Option<String> {
    if list.len() != wanted.len() {
        return Some(describe_list(list));
    }
    list.iter().zip(wanted.iter()).find_map(|(value, wanted)| type_error(value.get_ref(), wanted.get_ref()))
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        // An integer that does not fit 128 bits is above every limit.
        DeValue::Integer(integer) => Some(
            i128::from_str_radix(integer.as_str(), integer.radix()).map_or(f64::MAX, |number| number as f64),
        ),
        _ => None,
    }
}

fn number_error(number: f64) -> Option<String> {
    if !number.is_finite() {
        Some(format!("{number} is not finite"))
    } else if number.abs() > MAGNITUDE_MAX {
        Some(format!("{number:e} is larger than {MAGNITUDE_MAX:e} in magnitude"))
    } else {
        None
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("{} is text", quote(text)),
        DeValue::Integer(number) => format!("{number} is a number"),
        DeValue::Float(number) => format!("{} is a number", number.as_str()),
        DeValue::Boolean(truth) => format!("{truth} is a boolean"),
        DeValue::Datetime(date) => format!("{date} is a date"),
        DeValue::Array(list) => describe_list(list),
        DeValue::Table(_) => "this is a section".into(),
    }
}

fn describe_list(list: &DeArray<'_>) -> String {
    format!("this is a list of {}", counted(list.len(), "item"))
}

/// `text` in quotes on one line; a long text is cut.
pub(super) fn quote(text: &str) -> String {
    let mut start: String = text.chars().take(QUOTE_MAX).collect();
    if start.len() < text.len() {
        start.push('…');
    }
    format!("{start:?}")
}

/// The value that an override writes as `text`: TOML, or a text without quotes.
pub(super) fn value_of<'a>(text: &'a str, wanted: Option<&DeValue<'_>>) -> DeValue<'a> {
    let bare = DeValue::String(DeString::Borrowed(text));
    match DeValue::parse(text.trim()).map(Spanned::into_inner) {
        // Quotes are lost in the shell: where text is wanted, `2026` is text and not a number.
        Ok(value) if !value.is_str() && wanted.is_some_and(DeValue::is_str) => bare,
        Ok(value) => value,
        Err(_) => bare,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mismatches of `text`, one line each.
    fn mismatches(text: &str) -> Vec<String> {
        let mut tree = Spanned::new(0..0, DeValue::Table(DeTable::parse(text).unwrap().into_inner()));
        let mut mismatches = Vec::new();
        fit(&mut tree, example::tree(), "", &mut mismatches);
        let mut again = Vec::new();
        fit(&mut tree, example::tree(), "", &mut again);
        assert!(again.is_empty(), "a fitted tree has no mismatch");
        mismatches.iter().map(|mismatch| format!("{}: {}", mismatch.key, mismatch.message)).collect()
    }

    #[test]
    fn a_wrong_type_is_named_with_a_remedy() {
        let cases = [
            (
                "time.duration_s = '90 s'",
                "\"90 s\" is text: give a number of seconds without a unit, such as 90.0",
            ),
            ("time.rate_hz = 99.5", "99.5 is not a whole number: give a whole number of hertz, such as 100"),
            ("time.real_time = 1", "1 is a number: give true or false, without quotes"),
            ("time.real_time = 'yes'", "\"yes\" is text: give true or false, without quotes"),
            ("control.slot_gain = true", "true is a boolean: give a number, such as 1.0"),
            ("control.law = 1", "1 is a number: give text in quotes, such as \"paper\""),
            ("name = 2026-01-02", "2026-01-02 is a date: give text in quotes, such as \"unnamed\""),
            (
                "leader.start_m = [1]",
                "this is a list of 1 item: give two numbers of metres, such as [900.0, 42.0]",
            ),
            (
                "leader.start_m = [1, 2, 3]",
                "this is a list of 3 items: give two numbers of metres, such as [900.0, 42.0]",
            ),
            ("leader.start_m = [1, 'b']", "\"b\" is text: give two numbers of metres, such as [900.0, 42.0]"),
            (
                "leader.start_m = [1, nan]",
                "NaN is not finite: give two numbers of metres, such as [900.0, 42.0]",
            ),
            ("time = 90", "90 is a number: give a section with its keys"),
            ("obstacles = 5", "5 is a number: give one [[obstacles]] section for each, or []"),
            ("seed = []", "this is a list of 0 items: give a whole number, such as 1"),
        ];
        for (text, wanted) in cases {
            let mismatches = mismatches(text);
            assert_eq!(mismatches.len(), 1, "{text}");
            assert!(mismatches[0].ends_with(&format!(": {wanted}")), "{mismatches:?}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_or_too_large_are_refused() {
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
            assert_eq!(mismatches(&format!("formation.spacing_m = {number}")).len(), 1, "{number}");
        }
    }

    #[test]
    fn a_section_of_a_list_must_have_every_key() {
        assert_eq!(
            mismatches("[[start.uavs]]\nheading_deg = 1\nspeed_m_s = 15\nbank = 2"),
            [
                "start.uavs.0.bank: no such key; the keys here are heading_deg, position_m, speed_m_s",
                "start.uavs.0.position_m: missing: give two numbers of metres, such as [900.0, 42.0]",
            ]
        );
        assert_eq!(
            mismatches("obstacles = [7]"),
            ["obstacles.0: 7 is a number: give a section with its keys"]
        );
    }

    #[test]
    fn a_tree_of_the_right_shape_has_no_mismatch() {
        assert!(mismatches("formation.spacing_m = 40\nleader.start_m = [0, -1]\nobstacles = []").is_empty());
        assert!(mismatches(MAST).is_empty(), "how an obstacle moves may be left out");
    }

    /// An obstacle that stands.
    const MAST: &str =
        "[[obstacles]]\nname = 'mast'\nposition_m = [1, 2]\nradius_m = 3\nbraking_distance_m = 9\n";

    #[test]
    fn a_list_of_positions_has_any_number_of_pairs() {
        let waypoints = |list: &str| mismatches(&format!("{MAST}waypoints_m = {list}"));
        for list in ["[]", "[[1, 2]]", "[[1, 2], [3.5, 4], [5, 6]]"] {
            assert!(waypoints(list).is_empty(), "{list}");
        }
        let remedy = "give positions of metres, such as [[900.0, 42.0], [950.0, 0.0]]";
        for (list, wanted) in [
            ("[1, 2]", "1 is a number"),
            ("[[1, 2], [3]]", "this is a list of 1 item"),
            ("[[1, nan]]", "NaN is not finite"),
            ("'there'", "\"there\" is text"),
        ] {
            assert_eq!(waypoints(list), [format!("obstacles.0.waypoints_m: {wanted}: {remedy}")]);
        }
    }

    #[test]
    fn a_command_has_any_number_of_words() {
        let command = |list: &str| mismatches(&format!("[[agents]]\nuavs = '3'\ncommand = {list}"));
        for list in ["[]", "['./mine']", "['python3', 'mine.py', '--gain', '2']"] {
            assert!(command(list).is_empty(), "{list}");
        }
        let remedy = "give texts in quotes, such as [\"python3\", \"mine.py\"]";
        for (list, wanted) in [("['mine', 2]", "2 is a number"), ("'mine'", "\"mine\" is text")] {
            assert_eq!(command(list), [format!("agents.0.command: {wanted}: {remedy}")]);
        }
    }

    #[test]
    fn a_long_text_is_cut_in_quotes() {
        assert_eq!(quote("a\nb"), "\"a\\nb\"");
        assert_eq!(quote(&"x".repeat(50)), format!("\"{}…\"", "x".repeat(40)));
    }

    #[test]
    fn a_bare_word_is_text_and_so_is_a_number_where_text_is_wanted() {
        let text = DeValue::String(DeString::Borrowed(""));
        assert_eq!(value_of("paper", None).as_str(), Some("paper"));
        assert_eq!(value_of("'paper'", Some(&text)).as_str(), Some("paper"));
        assert_eq!(value_of("2026", Some(&text)).as_str(), Some("2026"));
        assert!(value_of(" 2026 ", None).is_integer());
    }
}
