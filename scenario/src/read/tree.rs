//! Finds, reads and replaces values in the TOML tree of a scenario by their keys.
//!
//! Never knows which keys a scenario has.

use crate::key;
use std::ops::Range;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

/// How far a key leads into a tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lookup<'t, 'a> {
    /// Where the last part that exists begins in the text; `None` if not even the first part exists.
    pub(super) position: Option<usize>,
    /// The value of the key; `None` if a part of it does not exist.
    pub(super) value: Option<&'t DeValue<'a>>,
}

/// Follows `key` into `tree`.
pub(super) fn lookup<'t, 'a>(tree: &'t DeValue<'a>, key: &str) -> Lookup<'t, 'a> {
    let mut found = Lookup { position: None, value: Some(tree) };
    for part in key.split('.') {
        let inner = found.value.and_then(|value| child(value, part));
        // Keep the position of the last part that exists: a message about a missing key then names the line of its
        // section.
        found.position = inner.map(|(position, _)| position).or(found.position);
        found.value = inner.map(|(_, value)| value);
    }
    found
}

/// The position and the value of one part of a key: of the name in a table, of the index in a list.
fn child<'t, 'a>(value: &'t DeValue<'a>, part: &str) -> Option<(usize, &'t DeValue<'a>)> {
    match value {
        DeValue::Table(table) => {
            table.get_key_value(part).map(|(name, value)| (name.span().start, value.get_ref()))
        }
        DeValue::Array(list) => {
            let value = list.get(part.parse::<usize>().ok()?)?;
            Some((value.span().start, value.get_ref()))
        }
        _ => None,
    }
}

/// The key of the value, other than a table or list, whose span is exactly `span`.
pub(super) fn key_at(tree: &DeValue<'_>, span: &Range<usize>) -> Option<String> {
    // An error of the deserializer has only a span. That is enough, because every value has a span of its own.
    let inner = |name: &str, value: &Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::Table(_) | DeValue::Array(_) => {
            key_at(value.get_ref(), span).map(|rest| key::join(name, &rest))
        }
        _ => (value.span() == *span).then(|| name.to_owned()),
    };
    match tree {
        DeValue::Table(table) => table.iter().find_map(|(name, value)| inner(name.get_ref(), value)),
        DeValue::Array(list) => {
            list.iter().enumerate().find_map(|(index, value)| inner(&index.to_string(), value))
        }
        _ => None,
    }
}

/// Sets `key` to `value`, and creates the sections that it needs.
///
/// # Errors
/// A part of `key` is not an index of the list that it stands for; the message says so.
pub(super) fn put<'a>(
    tree: &mut Spanned<DeValue<'a>>,
    key: &str,
    value: Spanned<DeValue<'a>>,
) -> Result<(), String> {
    let (part, rest) = key.split_once('.').map_or((key, None), |(part, rest)| (part, Some(rest)));
    let entry = match tree.get_mut() {
        DeValue::Table(table) => child_of_table(table, part, rest, &value),
        DeValue::Array(list) => {
            let count = list.len();
            let entry = part.parse().ok().and_then(|index: usize| list.get_mut(index));
            Some(entry.ok_or_else(|| {
                format!("there is no item {part} in a list of {count}; the first item is 0")
            })?)
        }
        // The file has a plain value where a section belongs. Reading reports that value, so do nothing here.
        _ => None,
    };
    match (entry, rest) {
        (Some(entry), Some(rest)) => put(entry, rest, value),
        (Some(entry), None) => {
            *entry = value;
            Ok(())
        }
        (None, _) => Ok(()),
    }
}

/// The entry `name` of `table`. A missing section is created; the last part of a key gets the position of `value`.
fn child_of_table<'t, 'a>(
    table: &'t mut DeTable<'a>,
    name: &str,
    rest: Option<&str>,
    value: &Spanned<DeValue<'a>>,
) -> Option<&'t mut Spanned<DeValue<'a>>> {
    if rest.is_none() || !table.contains_key(name) {
        let section = Spanned::new(value.span(), DeValue::Table(DeTable::new()));
        // Removed first, because an insert would keep the position of the name that is there.
        table.remove(name);
        table.insert(Spanned::new(value.span(), DeString::Owned(name.to_owned())), section);
    }
    table.get_mut(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(text: &str) -> Spanned<DeValue<'_>> {
        Spanned::new(0..0, DeValue::Table(DeTable::parse(text).unwrap().into_inner()))
    }

    #[test]
    fn a_key_is_followed_as_far_as_it_leads() {
        let tree = tree("[a]\nb = [2, 3]");
        let found = |key| {
            let found = lookup(tree.get_ref(), key);
            (found.position, found.value.is_some())
        };
        assert_eq!(found("a.b"), (Some(4), true));
        assert_eq!(found("a.b.1"), (Some(12), true));
        assert_eq!(found("a.c.d"), (Some(1), false));
        assert_eq!(found("x"), (None, false));
    }

    #[test]
    fn a_span_leads_back_to_its_key() {
        let tree = tree("[a]\nb = [2, 3]");
        assert_eq!(key_at(tree.get_ref(), &(12..13)).as_deref(), Some("a.b.1"));
        assert_eq!(key_at(tree.get_ref(), &(12..14)), None);
    }

    #[test]
    fn a_value_is_put_under_its_key_with_its_own_position() {
        let mut tree = tree("a = 1\nlist = [{ b = 2 }]");
        let truth = || Spanned::new(90..90, DeValue::Boolean(true));
        for key in ["a", "list.0.b", "new.section.c"] {
            put(&mut tree, key, truth()).unwrap();
        }
        for key in ["a", "list.0.b", "new.section.c"] {
            let found = lookup(tree.get_ref(), key);
            assert_eq!(found.value.and_then(DeValue::as_bool), Some(true), "{key}");
            assert_eq!(found.position, Some(90), "{key}");
        }
        assert_eq!(
            put(&mut tree, "list.1.b", truth()).unwrap_err(),
            "there is no item 1 in a list of 1; the first item is 0"
        );
        put(&mut tree, "a.b", truth()).unwrap();
        assert_eq!(lookup(tree.get_ref(), "a").value.and_then(DeValue::as_bool), Some(true));
    }
}
