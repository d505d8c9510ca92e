//! Where each value of a scenario's tree came from.
//!
//! Values of the file keep their spans in its text. Values of overrides get spans beyond its end, each its own mark, so
//! that one number says of any value where it was written.

use crate::{Place, Setting};
use std::ops::Range;
use toml::{
    Spanned,
    de::{DeArray, DeString, DeTable, DeValue},
};

/// Tells the file's lines and the overrides apart.
#[derive(Debug)]
pub(crate) struct Origins<'s> {
    text: &'s str,
    settings: &'s [Setting],
    /// The override that each mark stands for.
    marks: Vec<usize>,
}

impl<'s> Origins<'s> {
    pub(crate) fn new(text: &'s str, settings: &'s [Setting]) -> Self {
        Self { text, settings, marks: Vec::new() }
    }

    /// A span that belongs to override `setting` and to nothing else.
    pub(crate) fn mark(&mut self, setting: usize) -> Range<usize> {
        self.marks.push(setting);
        let position = self.text.len() + self.marks.len();
        position..position
    }

    /// The same value with a mark on each of its parts.
    pub(crate) fn marked<'a>(&mut self, value: DeValue<'a>, setting: usize) -> Spanned<DeValue<'a>> {
        let value = match value {
            DeValue::Table(table) => DeValue::Table(self.marked_table(table, setting)),
            DeValue::Array(list) => {
                let mut marked = DeArray::new();
                list.into_iter().for_each(|value| marked.push(self.marked(value.into_inner(), setting)));
                DeValue::Array(marked)
            }
            single => single,
        };
        Spanned::new(self.mark(setting), value)
    }

    fn marked_table<'a>(&mut self, table: DeTable<'a>, setting: usize) -> DeTable<'a> {
        let marked = |(name, value): (Spanned<DeString<'a>>, Spanned<DeValue<'a>>)| {
            (Spanned::new(self.mark(setting), name.into_inner()), self.marked(value.into_inner(), setting))
        };
        table.into_iter().map(marked).collect()
    }

    /// The place that begins at `position`.
    pub(crate) fn place(&self, position: usize) -> Place {
        match self.setting(position) {
            Some(setting) => Place::Setting(setting.written.clone()),
            None => Place::Line(1 + self.text.get(..position).unwrap_or(self.text).matches('\n').count()),
        }
    }

    /// The override that `position` belongs to, if it does to one.
    pub(crate) fn setting(&self, position: usize) -> Option<&'s Setting> {
        let mark = position.checked_sub(self.text.len() + 1)?;
        self.settings.get(*self.marks.get(mark)?)
    }
}

/// How far a key leads into a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trace<'t, 'a> {
    /// Where the last part that is there begins; `None` when not even the first is.
    pub(crate) position: Option<usize>,
    /// What the key leads to; `None` when it does not lead all the way.
    pub(crate) value: Option<&'t DeValue<'a>>,
}

/// Follows `key` into `tree`.
pub(crate) fn trace<'t, 'a>(tree: &'t DeValue<'a>, key: &str) -> Trace<'t, 'a> {
    let mut trace = Trace { position: None, value: Some(tree) };
    for part in key.split('.') {
        let inner = trace.value.and_then(|value| step(value, part));
        trace.position = inner.map(|(position, _)| position).or(trace.position);
        trace.value = inner.map(|(_, value)| value);
    }
    trace
}

fn step<'t, 'a>(value: &'t DeValue<'a>, part: &str) -> Option<(usize, &'t DeValue<'a>)> {
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

/// The key of the single value at exactly `span`.
pub(crate) fn key_at(tree: &DeValue<'_>, span: &Range<usize>) -> Option<String> {
    let inner = |name: &str, value: &Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::Table(_) | DeValue::Array(_) => {
            key_at(value.get_ref(), span).map(|rest| format!("{name}.{rest}"))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_file_and_of_overrides_are_told_apart() {
        let text = "a = 1\n\nb = [2, 3]\n";
        let settings = [Setting::parse("c=1").unwrap(), Setting::parse("d=2").unwrap()];
        let mut origins = Origins::new(text, &settings);
        let value = origins.marked(DeValue::parse("{ x = [1, 2] }").unwrap().into_inner(), 1);
        let inner = &value.get_ref()["x"].get_ref()[1];
        assert_eq!(origins.place(inner.span().start), Place::Setting("--set d=2".into()));
        assert_eq!(origins.place(8), Place::Line(3));
        assert_eq!(origins.place(text.len()), Place::Line(4));
        assert_eq!(key_at(value.get_ref(), &inner.span()), Some("x.1".into()));
    }

    #[test]
    fn a_key_is_followed_as_far_as_it_leads() {
        let tree = DeValue::Table(DeTable::parse("[a]\nb = [2, 3]").unwrap().into_inner());
        let found = |key| {
            let trace = trace(&tree, key);
            (trace.position, trace.value.is_some())
        };
        assert_eq!(found("a.b"), (Some(4), true));
        assert_eq!(found("a.b.1"), (Some(12), true));
        assert_eq!(found("a.c.d"), (Some(1), false));
        assert_eq!(found("x"), (None, false));
    }
}
