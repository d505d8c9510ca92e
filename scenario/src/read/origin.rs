//! Where each value of a scenario's tree was written: on a line of the file, or in an override.
//!
//! A value of the file keeps its span in the text. A value of an override gets a span beyond the end of the text, a
//! different one for each part, so that one number tells for every value where it was written.

use super::{problem::Place, setting::Setting};
use std::ops::Range;
use toml::{
    Spanned,
    de::{DeArray, DeString, DeTable, DeValue},
};

/// Resolves positions of the tree into lines of the file or overrides.
#[derive(Debug)]
pub(super) struct Origins<'s> {
    text: &'s str,
    settings: &'s [Setting],
    /// For each position beyond the text, the index of its override.
    owners: Vec<usize>,
}

impl<'s> Origins<'s> {
    pub(super) fn new(text: &'s str, settings: &'s [Setting]) -> Self {
        Self { text, settings, owners: Vec::new() }
    }

    /// A new span that belongs to the override with this index.
    pub(super) fn new_span(&mut self, setting: usize) -> Range<usize> {
        // Begin one beyond the end: at the end itself, the parser reports that the text stops too soon.
        self.owners.push(setting);
        let position = self.text.len() + self.owners.len();
        position..position
    }

    /// `value` with a new span on each of its parts.
    pub(super) fn with_spans<'a>(&mut self, value: DeValue<'a>, setting: usize) -> Spanned<DeValue<'a>> {
        let value = match value {
            DeValue::Table(table) => DeValue::Table(self.table_with_spans(table, setting)),
            DeValue::Array(list) => {
                let mut spanned = DeArray::new();
                list.into_iter().for_each(|item| spanned.push(self.with_spans(item.into_inner(), setting)));
                DeValue::Array(spanned)
            }
            other => other,
        };
        Spanned::new(self.new_span(setting), value)
    }

    fn table_with_spans<'a>(&mut self, table: DeTable<'a>, setting: usize) -> DeTable<'a> {
        let spanned = |(name, value): (Spanned<DeString<'a>>, Spanned<DeValue<'a>>)| {
            let name = Spanned::new(self.new_span(setting), name.into_inner());
            (name, self.with_spans(value.into_inner(), setting))
        };
        table.into_iter().map(spanned).collect()
    }

    /// The line or the override at `position`.
    pub(super) fn place(&self, position: usize) -> Place {
        match self.setting(position) {
            Some(setting) => Place::Setting(setting.written.clone()),
            None => Place::Line(1 + self.text.get(..position).unwrap_or(self.text).matches('\n').count()),
        }
    }

    /// The override at `position`, or `None` for a position in the text.
    pub(super) fn setting(&self, position: usize) -> Option<&'s Setting> {
        let index = position.checked_sub(self.text.len() + 1)?;
        self.settings.get(*self.owners.get(index)?)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tree, *};

    #[test]
    fn a_position_leads_to_a_line_of_the_file_or_to_an_override() {
        let text = "a = 1\n\nb = [2, 3]\n";
        let settings = [Setting::parse("c=1").unwrap(), Setting::parse("d=2").unwrap()];
        let mut origins = Origins::new(text, &settings);
        let value = origins.with_spans(DeValue::parse("{ x = [1, 2] }").unwrap().into_inner(), 1);
        let inner = &value.get_ref()["x"].get_ref()[1];
        assert_eq!(origins.place(inner.span().start), Place::Setting("--set d=2".into()));
        assert_eq!(origins.place(8), Place::Line(3));
        assert_eq!(origins.place(text.len()), Place::Line(4));
        assert_eq!(tree::key_at(value.get_ref(), &inner.span()), Some("x.1".into()));
    }
}
