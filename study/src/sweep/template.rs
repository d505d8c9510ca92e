//! Fault sentences with axes in braces: `at 30 s link all->all delay {0, 0.1 .. 1.0} s`, `... delay {delay} s`.
//!
//! Never parses the sentence itself: the grammar of faults does, once the braces are filled.

use serde::{Deserialize, Serialize};

/// Axes outside a sentence that may have the same name. No sweep has as many.
const MANY: usize = 1000;

/// A sentence with places for values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Template {
    parts: Vec<Part>,
    /// Where it was written, for messages: `storm.toml:12`, `--fault`.
    #[serde(skip)]
    pub place: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Part {
    Text(String),
    /// The axis with this name.
    Axis(String),
}

/// An axis that a sentence defines in its braces: its name and its values as written.
pub(super) type InlineAxis = (String, String);

impl Template {
    /// Reads the sentence `text`. `is_axis` says which axes exist already; braces with anything else in them define one,
    /// named before a colon or after the word before the brace.
    ///
    /// # Errors
    /// A brace has no counterpart, or an axis has no name.
    pub(super) fn parse(
        text: &str,
        place: &str,
        mut is_axis: impl FnMut(&str) -> bool,
    ) -> Result<(Self, Vec<InlineAxis>), String> {
        let (mut parts, mut axes) = (Vec::new(), Vec::<InlineAxis>::new());
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('{') {
            let (inside, behind) =
                after.split_once('}').ok_or_else(|| format!("the brace before {after:?} is never closed"))?;
            parts.push(Part::Text(before.to_owned()));
            let inside = inside.trim();
            let is_known = is_axis(inside) || axes.iter().any(|(name, _)| name == inside);
            let name =
                if is_known { inside.to_owned() } else { define(inside, before, &mut axes, &mut is_axis)? };
            parts.push(Part::Axis(name));
            rest = behind;
        }
        if rest.contains('}') {
            return Err(format!("{text:?} has a closing brace without an opening one"));
        }
        parts.push(Part::Text(rest.to_owned()));
        Ok((Self { parts, place: place.to_owned() }, axes))
    }

    /// Whether the sentence has a place for this axis.
    pub fn uses(&self, axis: &str) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Axis(name) if name == axis))
    }

    /// The sentence with the values that `value` has for the axes.
    pub fn fill<'a>(&self, value: impl Fn(&str) -> Option<&'a str>) -> String {
        let text = |part: &Part| match part {
            Part::Text(text) => text.clone(),
            // Never empty: `parse` has found or defined every axis of the sentence.
            Part::Axis(name) => value(name).unwrap_or_default().to_owned(),
        };
        self.parts.iter().map(text).collect()
    }
}

/// Adds the axis that the braces around `inside` define; returns its name.
fn define(
    inside: &str,
    before: &str,
    axes: &mut Vec<InlineAxis>,
    is_axis: &mut impl FnMut(&str) -> bool,
) -> Result<String, String> {
    let (name, values) = match inside.split_once(':') {
        Some((name, values)) => (name.trim(), values.trim()),
        None => (before.split_whitespace().next_back().unwrap_or_default(), inside),
    };
    if name.is_empty() {
        return Err(format!("the axis {{{inside}}} needs a name, such as {{delay: {inside}}}"));
    }
    let mut is_taken = |name: &str| is_axis(name) || axes.iter().any(|(other, _)| other == name);
    // Two faults may both have a delay, so the second is another axis.
    // One more name than there are axes, so that one is free.
    let name = (1..=axes.len() + MANY)
        .map(|number| if number == 1 { name.to_owned() } else { format!("{name} {number}") })
        .find(|name| !is_taken(name))
        .unwrap_or_default();
    axes.push((name.clone(), values.to_owned()));
    Ok(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braces_refer_to_an_axis_or_define_one() {
        let text = "at {start: 1, 2} s link all loss {loss} % delay {0, 0.1 .. 1} s";
        let (template, axes) = Template::parse(text, "--fault", |name| name == "loss").unwrap();
        let pair = |name: &str, values: &str| (name.to_owned(), values.to_owned());
        assert_eq!(axes, [pair("start", "1, 2"), pair("delay", "0, 0.1 .. 1")]);
        let value = |name: &str| {
            [("start", "2"), ("loss", "5"), ("delay", "0.3")].into_iter().find(|(axis, _)| *axis == name)
        };
        assert_eq!(
            template.fill(|name| value(name).map(|(_, value)| value)),
            "at 2 s link all loss 5 % delay 0.3 s"
        );
        assert!(template.uses("delay") && template.uses("loss") && !template.uses("law"));
    }

    #[test]
    fn a_second_axis_of_the_same_word_gets_another_name() {
        let (_, axes) =
            Template::parse("at 1 s link all delay {1, 2} s jitter {3} s delay {4} s", "", |_| false)
                .unwrap();
        assert_eq!(
            axes.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
            ["delay", "jitter", "delay 2"]
        );
    }

    #[test]
    fn unbalanced_braces_are_refused() {
        for text in ["at {1 s kill uav 3", "at 1} s kill uav 3", "{1, 2} s"] {
            assert!(Template::parse(text, "", |_| false).is_err(), "{text}");
        }
    }
}
