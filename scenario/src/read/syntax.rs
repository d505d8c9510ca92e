//! Explains errors of the TOML parser and of the deserializer in terms of the scenario format.

use super::{example, shape};
use crate::key;
use toml::de::DeValue;

/// The message for `text` that is not TOML at `position`, with the parser's `reason`.
///
/// Where the line has a value without quotes or with a unit, the message says what to write: the parser's own reason
/// would mislead.
pub(super) fn syntax_error(text: &str, position: usize, reason: &str) -> String {
    // The parser may stop in the middle of a value, but the beginning of the value shows what the user meant.
    let before = text.get(..position).unwrap_or(text);
    let line = before.rfind('\n').map_or(0, |newline| newline + 1);
    let after_equals = before[line..].split_once('=').map(|(key, _)| line + key.len() + 1);
    let value = after_equals.map_or("", |start| text[start..].trim_start_matches([' ', '\t']));
    match value.chars().next() {
        Some(first) if first.is_ascii_digit() || "+-.".contains(first) => {
            "this is not a value: give a number with a decimal point and without a unit, such as 90.0".into()
        }
        // The parser accepts `true` and `false`, so this must be text.
        Some(first) if first.is_alphabetic() => "this is not a value: put text in quotes".into(),
        _ => format!("this is not TOML: {reason}"),
    }
}

/// The message for the `given` value of `key` that has the right type, but that the deserializer refuses for `reason`.
pub(super) fn refused_value(
    reason: &str,
    given: Option<&DeValue<'_>>,
    key: &str,
    wanted: &DeValue<'_>,
) -> String {
    if is_fault_sentence(key) {
        return reason.to_owned();
    }
    match (given, reason.rsplit_once("expected ")) {
        // An unknown choice: the deserializer lists the known ones in backticks.
        (Some(DeValue::String(text)), Some((_, choices))) => {
            format!("{} is not known: give {}", shape::quote(text), choices.replace('`', "\""))
        }
        (Some(DeValue::Integer(number)), _) => {
            format!("{number} is out of range: {}", example::remedy(key, wanted))
        }
        _ => format!("{reason}: {}", example::remedy(key, wanted)),
    }
}

/// The parser of faults already says what it expected.
fn is_fault_sentence(key: &str) -> bool {
    key.starts_with("faults.") && key::name(key) == "do"
}
