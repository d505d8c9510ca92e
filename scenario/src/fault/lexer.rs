//! Splits a sentence into words and reads them one by one, with an error that says what was expected.
//!
//! Never knows a grammar: which words may follow which is the business of its callers, such as
//! [`grammar`](super::grammar) for faults.

use crate::spelling;
use std::ops::RangeInclusive;

/// Why a sentence cannot be parsed: the first wrong word, and what was expected there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}{message}")]
pub struct FaultSyntaxError {
    place: String,
    message: String,
}

/// What the lexer's readers return.
pub type Parsed<T> = Result<T, FaultSyntaxError>;

/// Longest time in a sentence: a flight lasts at most a day, so a longer time is a mistake.
pub(super) const TIME_MAX_S: f64 = 24.0 * 3600.0;
/// Largest error of a position: the swarm never spreads that far, so a larger one is a mistake.
const LENGTH_MAX_M: f64 = 1e6;
/// Largest angle, a little above a full turn: a larger one probably has the wrong unit.
const ANGLE_MAX_RAD: f64 = 7.0;
/// Highest speed of an airframe: none of this kind is faster, so a larger one probably has the wrong unit.
const SPEED_MAX_M_S: f64 = 1000.0;
/// Largest capacity of a link: far above the highest tick rate, so a larger one is a mistake.
const SAMPLES_PER_S_MAX: f64 = 1e6;
/// Most places in a link's queue. A sample in a longer one would wait for longer than most flights last.
const PLACES_MAX: u32 = 10_000;
/// The units of time, with the number of each that make a second.
const TIME_UNITS: [(&str, f64); 2] = [("s", 1.0), ("ms", 1000.0)];

/// The words of a sentence and the position in it.
pub struct Lexer<'t> {
    words: Vec<&'t str>,
    next: usize,
    /// The words that the grammar has looked for at the end of the sentence.
    continuations: Vec<String>,
}

impl<'t> Lexer<'t> {
    /// The words of `text`, before the first one.
    pub fn new(text: &'t str) -> Self {
        Self { words: split(text), next: 0, continuations: Vec::new() }
    }

    /// The next word, which stays the next.
    pub fn peek(&self) -> Option<&'t str> {
        self.words.get(self.next).copied()
    }

    /// Whether the next word begins like a number.
    pub fn is_at_number(&self) -> bool {
        self.peek().is_some_and(|word| word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
    }

    /// Consumes the next word if it is `word`.
    pub fn take(&mut self, word: &str) -> bool {
        let Some(next) = self.peek() else {
            self.continuations.push(word.to_owned());
            return false;
        };
        let is_next = next.eq_ignore_ascii_case(word);
        self.next += usize::from(is_next);
        is_next
    }

    /// The words with which the sentence may go on, once the grammar has read it to its end.
    pub(super) fn into_continuations(self) -> Vec<String> {
        self.continuations
    }

    /// Consumes the next word, which must be `word`.
    pub fn expect(&mut self, word: &str) -> Parsed<()> {
        self.choose(&[word]).map(drop)
    }

    /// Consumes the next word, which must be one of `choices`, and returns that choice.
    pub fn choose<'c>(&mut self, choices: &[&'c str]) -> Parsed<&'c str> {
        match choices.iter().find(|choice| self.take(choice)) {
            Some(choice) => Ok(choice),
            None => Err(self.expected(&list(choices), choices)),
        }
    }

    /// Checks that no word is left.
    pub fn end(&self) -> Parsed<()> {
        if self.peek().is_none() { Ok(()) } else { Err(self.expected("the end of the sentence", &[])) }
    }

    /// The error that the next word is not `what`; suggests the word in `choices` that it resembles.
    pub fn expected(&self, what: &str, choices: &[&str]) -> FaultSyntaxError {
        // Words are read in either case, but the similarity of two words depends on it.
        let lower = self.peek().map(str::to_lowercase);
        let suggestion =
            lower.and_then(|word| spelling::nearest(&word, choices.iter().copied(), |choice| choice));
        let message = match suggestion {
            Some(word) => format!("did you mean {word}? Expected {what}"),
            None => format!("expected {what}"),
        };
        self.error_at(self.next, message)
    }

    fn error_at(&self, index: usize, message: String) -> FaultSyntaxError {
        let place = match self.words.get(index) {
            Some(word) => format!("word {}, {word:?}: ", index + 1),
            None if index == 0 => "the sentence is empty: ".into(),
            None => format!("after {:?}: ", self.words[index - 1]),
        };
        FaultSyntaxError { place, message }
    }

    /// A time from 0, `200 ms` or `30 s`, in seconds.
    pub fn time_s(&mut self) -> Parsed<f64> {
        self.quantity("a time of at most a day, such as 200 ms or 30 s", &TIME_UNITS, 0.0..=TIME_MAX_S)
    }

    /// A time above 0, in seconds.
    pub fn duration_s(&mut self) -> Parsed<f64> {
        let what = "a time above 0 of at most a day, such as 10 s";
        // A range cannot exclude its lower end, so it begins at the smallest number above 0.
        self.quantity(what, &TIME_UNITS, f64::MIN_POSITIVE..=TIME_MAX_S)
    }

    /// A length, `3 m` or `-3 m`, in metres.
    pub(super) fn length_m(&mut self) -> Parsed<f64> {
        self.quantity("a length in metres, such as 3 m", &[("m", 1.0)], -LENGTH_MAX_M..=LENGTH_MAX_M)
    }

    /// A number and its unit, divided by the unit's factor in `units`; `what` describes it in errors.
    fn quantity(&mut self, what: &str, units: &[(&str, f64)], range: RangeInclusive<f64>) -> Parsed<f64> {
        let start = self.next;
        let number = self.number(what)?;
        let names: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
        let name = self.choose(&names)?;
        let factor = units.iter().find(|(unit, _)| *unit == name).map_or(1.0, |(_, factor)| *factor);
        // Division by 1000 gives the double nearest to what was written; multiplication by 0.001 may not. `display`
        // relies on this for sentences that parse to the same bits.
        let value = number / factor;
        self.check(start, range.contains(&value), value, || format!("out of range, expected {what}"))
    }

    /// An angle, `5 deg` or `0.1 rad`, in radians.
    pub(super) fn angle_rad(&mut self) -> Parsed<f64> {
        let what = "an angle of at most a turn, such as 5 deg or 0.1 rad";
        let start = self.next;
        let number = self.number(what)?;
        let angle = if self.choose(&["deg", "rad"])? == "deg" { number.to_radians() } else { number };
        self.check(start, angle.abs() <= ANGLE_MAX_RAD, angle, || format!("out of range, expected {what}"))
    }

    /// A speed above 0, `14 m/s`.
    pub(super) fn speed_m_s(&mut self) -> Parsed<f64> {
        let what = "a speed above 0, such as 14 m/s";
        let start = self.next;
        let number = self.number(what)?;
        ["m", "/", "s"].into_iter().try_for_each(|word| self.expect(word))?;
        let range = f64::MIN_POSITIVE..=SPEED_MAX_M_S;
        self.check(start, range.contains(&number), number, || {
            format!("out of range, expected {what}, of at most {SPEED_MAX_M_S}")
        })
    }

    /// A turn rate, `5 deg/s` or `-0.1 rad/s`, in radians per second.
    pub(super) fn turn_rate_rad_s(&mut self) -> Parsed<f64> {
        // The error about a wrong number should show a rate, not an angle.
        if !self.is_at_number() {
            return Err(self.expected("a turn rate, such as 5 deg/s or -0.1 rad/s", &[]));
        }
        let angle = self.angle_rad()?;
        ["/", "s"].into_iter().try_for_each(|word| self.expect(word))?;
        Ok(angle)
    }

    /// A probability from 0 to 1, `30 %` or `0.3`.
    pub fn probability(&mut self) -> Parsed<f64> {
        let what = "a probability, such as 30 % or 0.3";
        let start = self.next;
        let number = self.number(what)?;
        let value = if self.take("%") { number / 100.0 } else { number };
        self.check(start, (0.0..=1.0).contains(&value), value, || {
            format!("not between 0 and 1, expected {what}")
        })
    }

    /// A number without a unit, above `low`.
    pub(super) fn above(&mut self, low: f64, what: &str) -> Parsed<f64> {
        let start = self.next;
        let number = self.number(what)?;
        self.check(start, number > low, number, || format!("not above {low}, expected {what}"))
    }

    /// `value` if it `is_valid`, else an error at word `start`.
    fn check(&self, start: usize, is_valid: bool, value: f64, message: impl Fn() -> String) -> Parsed<f64> {
        // The reader is already past the unit, but the mistake is in the number.
        if is_valid { Ok(value) } else { Err(self.error_at(start, message())) }
    }

    /// A link's capacity above 0, `20 samples/s`.
    pub(super) fn samples_per_s(&mut self) -> Parsed<f64> {
        let what = "a capacity above 0, such as 20 samples/s";
        let start = self.next;
        let number = self.number(what)?;
        ["samples", "/", "s"].into_iter().try_for_each(|word| self.expect(word))?;
        let range = f64::MIN_POSITIVE..=SAMPLES_PER_S_MAX;
        self.check(start, range.contains(&number), number, || {
            format!("out of range, expected {what}, of at most {SAMPLES_PER_S_MAX}")
        })
    }

    /// The places of a queue.
    pub(super) fn places(&mut self) -> Parsed<u32> {
        let what = format!("the places of the queue, from 1 to {PLACES_MAX}");
        self.parse_next(&what, |word| word.parse().ok().filter(|places| (1..=PLACES_MAX).contains(places)))
    }

    fn number(&mut self, what: &str) -> Parsed<f64> {
        self.parse_next(what, |word| word.parse().ok().filter(|number: &f64| number.is_finite()))
    }

    /// A whole number from 1: a UAV's number, or a count.
    pub fn count(&mut self, what: &str) -> Parsed<u32> {
        self.parse_next(what, |word| word.parse().ok().filter(|count| *count > 0))
    }

    /// A text in double quotes that is not empty.
    pub(super) fn text(&mut self, what: &str) -> Parsed<String> {
        let unquoted = |word: &str| Some(word.strip_prefix('"')?.strip_suffix('"')?.to_owned());
        self.parse_next(what, |word| unquoted(word).filter(|text| !text.is_empty()))
    }

    /// Consumes the next word if `parse` accepts it; otherwise the error says that `what` was expected.
    fn parse_next<T>(&mut self, what: &str, parse: impl Fn(&str) -> Option<T>) -> Parsed<T> {
        let value = self.peek().and_then(parse).ok_or_else(|| self.expected(what, &[]))?;
        self.next += 1;
        Ok(value)
    }

    /// `{1, 2, 3}`: one or more items.
    pub(super) fn braced<T>(&mut self, item: impl FnMut(&mut Self) -> Parsed<T>) -> Parsed<Vec<T>> {
        self.expect("{")?;
        let items = self.separated(item)?;
        self.expect("}")?;
        Ok(items)
    }

    /// `1, 2, 3`: one or more items.
    pub fn separated<T>(&mut self, mut item: impl FnMut(&mut Self) -> Parsed<T>) -> Parsed<Vec<T>> {
        let mut items = vec![item(self)?];
        while self.take(",") {
            items.push(item(self)?);
        }
        Ok(items)
    }
}

/// `a, b or c`.
fn list(choices: &[&str]) -> String {
    match choices {
        [start @ .., last] if !start.is_empty() => format!("{} or {last}", start.join(", ")),
        _ => choices.concat(),
    }
}

/// The words, numbers, quoted texts and signs of `text`; `2->3`, `30%` and `200ms` need no spaces.
fn split(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let (word, after) = rest.split_at(first_word_bytes(rest));
        words.push(word);
        rest = after.trim_start();
    }
    words
}

/// Length of the first word of `text` in bytes; `text` begins with something other than a space.
fn first_word_bytes(text: &str) -> usize {
    let run = |from: usize, belongs: fn(char) -> bool| {
        from + text[from..].find(|c| !belongs(c)).unwrap_or(text.len() - from)
    };
    // No exponents: `display` writes none, since Rust shows every float without one.
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let first = text.chars().next().map_or(0, char::len_utf8);
    match text.as_bytes() {
        [b'<', b'-', b'>', ..] => 3,
        [b'-', b'>', ..] => 2,
        // A text whose closing quote is missing runs to the end.
        [b'"', ..] => text[1..].find('"').map_or(text.len(), |end| end + 2),
        // A sign without a number is a word of its own.
        [b'-' | b'+', ..] => run(1, is_number),
        [digit, ..] if is_number(char::from(*digit)) => run(0, is_number),
        _ if text.starts_with(char::is_alphabetic) => run(first, char::is_alphabetic),
        // A sign such as `{` or `%`, or a character that no sentence has, which the error then quotes.
        _ => first,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_splits_at_signs_units_and_quotes() {
        assert_eq!(split("2<->3 delay 200ms"), ["2", "<->", "3", "delay", "200", "ms"]);
        assert_eq!(split(" 4->all  loss -1.5% "), ["4", "->", "all", "loss", "-1.5", "%"]);
        assert_eq!(split("file \"a b.txt\"{1,2}"), ["file", "\"a b.txt\"", "{", "1", ",", "2", "}"]);
        assert_eq!(split("file \"a b"), ["file", "\"a b"]);
        assert_eq!(split("x - 3 +m -"), ["x", "-", "3", "+", "m", "-"]);
        assert_eq!(split("  "), [""; 0]);
    }

    #[test]
    fn choices_are_listed_as_in_a_sentence() {
        assert_eq!([list(&["a"]), list(&["a", "b"]), list(&["a", "b", "c"])], ["a", "a or b", "a, b or c"]);
    }
}
