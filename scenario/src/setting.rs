//! Overrides: values from the command line that take the place of those in the file.

use crate::{hint, shape};
use std::fmt::Display;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

/// One value given on the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// As the user wrote it, for messages: `--set airframe.speed_max_m_s=27`, `--uavs 200`.
    pub written: String,
    /// Which key: `airframe.speed_max_m_s`, `obstacles.0.radius_m`, or the last part of one, `speed_max_m_s`.
    pub key: String,
    /// TOML, or a text without its quotes.
    pub value: String,
}

impl Setting {
    /// Reads the `key=value` of a `--set`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            Some((key, value)) if !key.is_empty() => {
                Ok(Self { written: format!("--set {text}"), key: key.into(), value: value.into() })
            }
            _ => Err(format!("{} is no setting: give key=value, such as duration_s=30", shape::quote(text))),
        }
    }

    /// A flag of its own for `key`: `--uavs 200`.
    pub fn of_flag(flag: &str, key: &str, value: impl Display) -> Self {
        Self { written: format!("{flag} {value}"), key: key.into(), value: value.to_string() }
    }

    /// The full key, or why there is none.
    pub(crate) fn full_key(&self) -> Result<String, String> {
        hint::full_key(&self.key)
    }
}

/// Puts `value` under `key`, in place of what is there; sections that are not there yet are made.
pub(crate) fn put<'a>(
    tree: &mut Spanned<DeValue<'a>>,
    key: &str,
    value: Spanned<DeValue<'a>>,
) -> Result<(), String> {
    let (part, rest) = key.split_once('.').map_or((key, None), |(part, rest)| (part, Some(rest)));
    match (tree.get_mut(), rest) {
        (DeValue::Table(table), None) => insert(table, part, value),
        (DeValue::Table(table), Some(rest)) => {
            if !table.contains_key(part) {
                insert(table, part, Spanned::new(value.span(), DeValue::Table(DeTable::new())));
            }
            return table.get_mut(part).map_or(Ok(()), |section| put(section, rest, value));
        }
        (DeValue::Array(list), rest) => {
            let count = list.len();
            let entry = part.parse().ok().and_then(|index: usize| list.get_mut(index));
            let entry =
                entry.ok_or_else(|| format!("there is no {part} in a list of {count}; the first is 0"))?;
            match rest {
                Some(rest) => return put(entry, rest, value),
                None => *entry = value,
            }
        }
        // What the file has in a section's place is refused for itself.
        _ => {}
    }
    Ok(())
}

/// Key and value both come from where `value` does.
fn insert<'a>(table: &mut DeTable<'a>, name: &str, value: Spanned<DeValue<'a>>) {
    table.remove(name);
    table.insert(Spanned::new(value.span(), DeString::Owned(name.to_owned())), value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::origin;

    #[test]
    fn a_setting_is_a_key_and_a_value() {
        let setting = Setting::parse("control.law = paper").unwrap();
        assert_eq!((setting.key.as_str(), setting.value.as_str()), ("control.law", "paper"));
        assert_eq!(setting.written, "--set control.law = paper");
        assert_eq!(Setting::of_flag("--uavs", "formation.uavs", 200).written, "--uavs 200");
        for text in ["", "x", "=3", " = 3"] {
            assert!(Setting::parse(text).unwrap_err().contains("give key=value"), "{text}");
        }
    }

    #[test]
    fn a_value_is_put_where_its_key_says() {
        let text = "a = 1\nlist = [{ b = 2 }]";
        let mut tree = Spanned::new(0..0, DeValue::Table(DeTable::parse(text).unwrap().into_inner()));
        let truth = || Spanned::new(90..90, DeValue::Boolean(true));
        for key in ["a", "list.0.b", "new.section.c"] {
            put(&mut tree, key, truth()).unwrap();
        }
        for key in ["a", "list.0.b", "new.section.c"] {
            let found = origin::trace(tree.get_ref(), key);
            assert_eq!(found.value.and_then(DeValue::as_bool), Some(true), "{key}");
            assert_eq!(found.position, Some(90), "{key}");
        }
        assert_eq!(
            put(&mut tree, "list.1.b", truth()).unwrap_err(),
            "there is no 1 in a list of 1; the first is 0"
        );
    }
}
