//! The words of a sentence, and what to say when one of them is not what was wanted.

use crate::hint;
use std::ops::RangeInclusive;

/// Why a sentence is not understood: the word concerned, and what would be understood in its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{at}{message}")]
pub struct Misunderstanding {
    at: String,
    message: String,
}

/// Longest time that can be said.
const TIME_MAX_S: f64 = 24.0 * 3600.0;

/// A sentence that is being read, word by word.
pub(super) struct Words<'t> {
    words: Vec<&'t str>,
    next: usize,
}

impl<'t> Words<'t> {
    pub(super) fn of(text: &'t str) -> Self {
        Self { words: split(text), next: 0 }
    }

    /// The next word.
    pub(super) fn peek(&self) -> Option<&'t str> {
        self.words.get(self.next).copied()
    }

    /// Takes the next word if it is `word`.
    pub(super) fn take(&mut self, word: &str) -> bool {
        let is_it = self.peek().is_some_and(|next| next.eq_ignore_ascii_case(word));
        self.next += usize::from(is_it);
        is_it
    }

    /// The next word must be `word`.
    pub(super) fn need(&mut self, word: &str) -> Result<(), Misunderstanding> {
        self.choose(&[word]).map(drop)
    }

    /// The next word must be one of `choices`: which.
    pub(super) fn choose<'c>(&mut self, choices: &[&'c str]) -> Result<&'c str, Misunderstanding> {
        match choices.iter().find(|choice| self.take(choice)) {
            Some(choice) => Ok(choice),
            None => Err(self.wanted(&listed(choices), choices)),
        }
    }

    /// There must be no more words.
    pub(super) fn end(&self) -> Result<(), Misunderstanding> {
        if self.peek().is_none() { Ok(()) } else { Err(self.wanted("the end of the sentence", &[])) }
    }

    /// The next word is not what was wanted: one of `choices`, if there are some.
    pub(super) fn wanted(&self, what: &str, choices: &[&str]) -> Misunderstanding {
        let meant = self.peek().and_then(|word| hint::nearest_word(word, choices));
        let message = match meant {
            Some(word) => format!("did you mean {word}? Give {what}"),
            None => format!("give {what}"),
        };
        self.refuse(self.next, message)
    }

    fn refuse(&self, index: usize, message: String) -> Misunderstanding {
        let at = match self.words.get(index) {
            Some(word) => format!("word {}, {word:?}: ", index + 1),
            None if index == 0 => "nothing is said: ".into(),
            None => format!("after {:?}: ", self.words[index - 1]),
        };
        Misunderstanding { at, message }
    }

    /// A number within `range`, in the unit that follows it; what is needed is called `what`.
    fn quantity(
        &mut self,
        what: &str,
        units: &[(&str, f64)],
        range: RangeInclusive<f64>,
    ) -> Result<f64, Misunderstanding> {
        let start = self.next;
        let number = self.number(what)?;
        let names: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
        let name = self.choose(&names)?;
        let per = units.iter().find(|(unit, _)| *unit == name).map_or(1.0, |(_, per)| *per);
        let value = number / per;
        if range.contains(&value) {
            Ok(value)
        } else {
            Err(self.refuse(start, format!("is out of range: give {what}")))
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, Misunderstanding> {
        let number =
            self.peek().and_then(|word| word.parse::<f64>().ok()).filter(|number| number.is_finite());
        let number = number.ok_or_else(|| self.wanted(what, &[]))?;
        self.next += 1;
        Ok(number)
    }

    /// `200 ms`, `30 s`, in seconds.
    pub(super) fn time_s(&mut self) -> Result<f64, Misunderstanding> {
        self.quantity("a time, such as 200 ms or 30 s, of at most a day", &TIMES, 0.0..=TIME_MAX_S)
    }

    /// A time above 0.
    pub(super) fn duration_s(&mut self) -> Result<f64, Misunderstanding> {
        self.quantity(
            "a time above 0, such as 10 s, of at most a day",
            &TIMES,
            f64::MIN_POSITIVE..=TIME_MAX_S,
        )
    }

    /// `3 m`.
    pub(super) fn length_m(&mut self) -> Result<f64, Misunderstanding> {
        self.quantity("a length in metres, such as 3 m", &[("m", 1.0)], -1e6..=1e6)
    }

    /// `5 deg`, `0.1 rad`, in radians.
    pub(super) fn angle_rad(&mut self) -> Result<f64, Misunderstanding> {
        let what = "an angle, such as 5 deg or 0.1 rad";
        let start = self.next;
        let number = self.number(what)?;
        let angle = if self.choose(&["deg", "rad"])? == "deg" { number.to_radians() } else { number };
        if angle.abs() <= 7.0 {
            Ok(angle)
        } else {
            Err(self.refuse(start, format!("is out of range: give {what}")))
        }
    }

    /// `30 %` or `0.3`, from 0 to 1.
    pub(super) fn probability(&mut self) -> Result<f64, Misunderstanding> {
        let what = "a probability, such as 30 % or 0.3";
        let start = self.next;
        let number = self.number(what)?;
        let value = if self.take("%") { number / 100.0 } else { number };
        let possible = (0.0..=1.0).contains(&value);
        if possible {
            Ok(value)
        } else {
            Err(self.refuse(start, format!("is not within 0 and 1: give {what}")))
        }
    }

    /// A number without a unit, above `low`.
    pub(super) fn above(&mut self, low: f64, what: &str) -> Result<f64, Misunderstanding> {
        let start = self.next;
        let number = self.number(what)?;
        if number > low {
            Ok(number)
        } else {
            Err(self.refuse(start, format!("is not above {low}: give {what}")))
        }
    }

    /// A whole number from 1 on: a UAV's, or how many.
    pub(super) fn count(&mut self, what: &str) -> Result<u32, Misunderstanding> {
        let count = self.peek().and_then(|word| word.parse().ok()).filter(|count| *count > 0);
        let count = count.ok_or_else(|| self.wanted(what, &[]))?;
        self.next += 1;
        Ok(count)
    }

    /// A text in quotes.
    pub(super) fn text(&mut self, what: &str) -> Result<String, Misunderstanding> {
        let text = self.peek().and_then(|word| word.strip_prefix('"')?.strip_suffix('"'));
        let text = text.filter(|text| !text.is_empty()).ok_or_else(|| self.wanted(what, &[]))?;
        self.next += 1;
        Ok(text.to_owned())
    }

    /// `{1, 2, 3}`: at least one of what `item` reads.
    pub(super) fn braced<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, Misunderstanding>,
    ) -> Result<Vec<T>, Misunderstanding> {
        self.need("{")?;
        let items = self.separated(&mut item)?;
        self.need("}")?;
        Ok(items)
    }

    /// `1, 2, 3`: at least one of what `item` reads.
    pub(super) fn separated<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, Misunderstanding>,
    ) -> Result<Vec<T>, Misunderstanding> {
        let mut items = vec![item(self)?];
        while self.take(",") {
            items.push(item(self)?);
        }
        Ok(items)
    }
}

/// How many of each unit make a second.
const TIMES: [(&str, f64); 2] = [("s", 1.0), ("ms", 1000.0)];

fn listed(choices: &[&str]) -> String {
    match choices {
        [only] => format!("{only:?}").replace('"', ""),
        [start @ .., last] => format!("{} or {last}", start.join(", ")),
        [] => String::new(),
    }
}

/// Words, numbers, quoted texts, and signs, each by itself: `2->3`, `30%` and `200ms` need no spaces.
fn split(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let (word, after) = rest.split_at(length_of_first(rest));
        words.push(word);
        rest = after.trim_start();
    }
    words
}

fn length_of_first(text: &str) -> usize {
    let run = |from: usize, belongs: fn(char) -> bool| {
        from + text[from..].find(|c| !belongs(c)).unwrap_or(text.len() - from)
    };
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let first = text.chars().next().map_or(0, char::len_utf8);
    match text.as_bytes() {
        [b'<', b'-', b'>', ..] => 3,
        [b'-', b'>', ..] => 2,
        [b'"', ..] => text[1..].find('"').map_or(text.len(), |end| end + 2),
        [b'-' | b'+', digit, ..] if is_number(char::from(*digit)) => run(1, is_number),
        [digit, ..] if is_number(char::from(*digit)) => run(0, is_number),
        _ if text.starts_with(char::is_alphabetic) => run(first, char::is_alphabetic),
        _ => first,
    }
}
