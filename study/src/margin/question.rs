//! What is searched: a scenario in which `{x}` stands for a number, and the range of that number.
//!
//! Never flies anything.

use super::search::Range;
use crate::{
    sweep::{Definition, Draft, Given, SweepProblem, Values, number_text},
    theory::{Late, late_data},
};
use ringwing_scenario::{
    Fault, Scenario,
    fault::{Action, Delay, LinkImpairment, Links, Receiver, Sender},
};

/// Where the value goes.
const PLACE: &str = "{x}";
/// Name of the axis in a fault's sentence.
const AXIS: &str = "x";
/// Share of the range that the bracket shall become if nothing else is asked for. A smaller one takes more flights.
const RESOLUTION: f64 = 0.01;

/// What the user asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked<'a> {
    /// A fault's sentence, or `KEY={x}`.
    pub of: &'a str,
    /// The range, such as `0..2`.
    pub between: &'a str,
    /// How narrow the bracket shall become; by default a hundredth of the range.
    pub resolution: Option<f64>,
}

/// A scenario with a place for a number.
#[derive(Debug, Clone)]
pub struct Question {
    /// The scenario, with one axis that has one value at a time.
    definition: Definition,
    /// The fault's sentence as it is flown, or `KEY={x}`.
    pub of: String,
    /// The range of the number.
    pub range: Range,
}

impl Question {
    /// The question that `asked` puts to the scenario of `draft`.
    ///
    /// # Errors
    /// There is no place for the number, the range is empty, or the scenario refuses one of its ends.
    pub fn new(mut draft: Draft, asked: &Asked) -> Result<Self, Vec<SweepProblem>> {
        let refuse = |flag: &str, message: String| vec![SweepProblem::new(flag, message)];
        let range = range(asked).map_err(|message| refuse("--between", message))?;
        let of = if let Some(key) = key(asked.of).map_err(|message| refuse("--of", message))? {
            draft.axes.push(Given::new(key, "0", "--of"));
            asked.of.to_owned()
        } else {
            let sentence = with_time(asked.of);
            draft.axes.push(Given::new(AXIS, "0", "--of"));
            draft.faults.push(Given::new("", &sentence, "--of"));
            sentence
        };
        let mut question = Self { definition: draft.finish()?, of, range };
        for end in [range.from, range.to] {
            question.scenario(end).map_err(|problem| vec![problem])?;
        }
        // A key such as formation.uavs takes whole numbers only. Nothing but the scenario knows that.
        let between = range.from.min(range.to).floor() + 0.5;
        if [range.from, range.to].iter().all(|end| end.fract() == 0.0) && question.scenario(between).is_err()
        {
            question.range = Range { resolution: 1.0, is_whole: true, ..range };
        }
        Ok(question)
    }

    /// The scenario with this value, with room for its UAVs to start.
    ///
    /// # Errors
    /// The scenario refuses the value.
    pub fn scenario(&self, value: f64) -> Result<Scenario, SweepProblem> {
        self.definition_of(value).checked_cell(0)
    }

    /// The arguments of `ringwing run` that fly this value, without the seed.
    pub fn arguments(&self, value: f64) -> Vec<String> {
        self.definition_of(value).arguments(0)
    }

    fn definition_of(&self, value: f64) -> Definition {
        let mut definition = self.definition.clone();
        // The first one: braces of other faults may add axes behind it.
        if let Some(axis) = definition.design.axes.first_mut() {
            axis.values = Values::Listed(vec![number_text(value)]);
        }
        definition
    }

    /// Which data the number delays for every UAV alike; `None` if theory has nothing to say about the number.
    pub fn delays(&self) -> Option<Delays> {
        // The larger end, because the other one may be 0.
        let end = if self.range.to.abs() > self.range.from.abs() { self.range.to } else { self.range.from };
        let scenario = self.scenario(end).ok()?;
        let Fault { action: Action::Link { links, impairment, .. }, .. } = scenario.faults.last()? else {
            return None;
        };
        let LinkImpairment::Delay(Delay::Constant { by_s }) = impairment else { return None };
        let is_own = match links {
            Links::From(Sender::Own, Receiver::All) => true,
            Links::From(Sender::All, Receiver::All) | Links::All => false,
            _ => return None,
        };
        // The sentence may measure in milliseconds. A key has no part in a fault.
        let unit_s = by_s / end;
        let is_delay = self.definition.faults.last().is_some_and(|fault| fault.uses(AXIS));
        let (late, more_s) = late_data(&scenario, is_own)?;
        is_delay.then_some(Delays { late, more_s, unit_s })
    }
}

/// A number that delays data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delays {
    /// The data.
    pub late: Late,
    /// By how much more than the number says they are late, in seconds.
    pub more_s: f64,
    /// The unit of the number in seconds.
    pub unit_s: f64,
}

impl Delays {
    /// The number at which the data are late by `margin_s`.
    pub fn number(&self, margin_s: f64) -> f64 {
        (margin_s - self.more_s) / self.unit_s
    }
}

/// The key of `KEY={x}`; `None` for a sentence.
fn key(of: &str) -> Result<Option<&str>, String> {
    if of.matches(PLACE).count() != 1 || of.matches('{').count() != 1 {
        return Err(format!(
            "{of:?} needs exactly one {PLACE} where the number goes, such as in \"link all->all delay {PLACE} s\" or \
             control.formation_gain={PLACE}"
        ));
    }
    let is_key = |key: &&str| !key.is_empty() && !key.contains(char::is_whitespace);
    Ok(of
        .split_once('=')
        .filter(|(_, value)| value.trim() == PLACE)
        .map(|(key, _)| key.trim())
        .filter(is_key))
}

/// The sentence with a time: a fault without one acts from the beginning.
fn with_time(sentence: &str) -> String {
    let begins_with_time = sentence.split_whitespace().next() == Some("at");
    if begins_with_time { sentence.to_owned() } else { format!("at 0 s {}", sentence.trim()) }
}

fn range(asked: &Asked) -> Result<Range, String> {
    let text = asked.between;
    let (from, to) =
        text.split_once("..").ok_or_else(|| format!("{text:?} is no range: give one such as 0..2"))?;
    let number = |text: &str| {
        let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| format!("{:?} is not a number: give a range such as 0..2", text.trim()))
    };
    let (from, to) = (number(from)?, number(to)?);
    let width = (to - from).abs();
    if width == 0.0 {
        return Err(format!("empty range: {text} has only one value"));
    }
    let resolution = asked.resolution.unwrap_or(width * RESOLUTION);
    if !(resolution > 0.0 && resolution < width) {
        return Err(format!(
            "a resolution of {resolution} does not fit the range {text}: give a smaller one above 0"
        ));
    }
    Ok(Range { from, to, resolution, is_whole: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft() -> Draft {
        Draft { scenario: Some("paper-4.1".into()), ..Draft::default() }
    }

    fn question(of: &str, between: &str) -> Result<Question, String> {
        let asked = Asked { of, between, resolution: None };
        Question::new(draft(), &asked).map_err(|problems| problems[0].to_string())
    }

    #[test]
    fn a_number_goes_into_a_sentence_or_a_key() {
        let delay = question("link all->all delay {x} s", "0..2").unwrap();
        let scenario = delay.scenario(0.25).unwrap();
        assert_eq!(scenario.faults[0].to_string(), "at 0 s link all->all delay 250 ms");
        let gain = question("control.formation_gain={x}", "1..3").unwrap();
        assert_eq!(gain.scenario(1.5).unwrap().control.formation_gain, 1.5);
        assert_eq!(gain.arguments(1.5), ["paper-4.1", "--set", "control.formation_gain=1.5"]);
        assert!(!gain.range.is_whole);
        assert!(question("formation.uavs={x}", "3..20").unwrap().range.is_whole);
    }

    #[test]
    fn what_makes_no_question_is_refused_with_its_flag() {
        for (of, between, message) in [
            ("link all->all delay 1 s", "0..2", "--of: \"link all->all delay 1 s\" needs exactly one {x}"),
            ("link all->all delay {x} s jitter {x} s", "0..2", "--of: "),
            ("link all->all delay {y} s", "0..2", "--of: "),
            ("link all->all delay {x} s", "2..2", "--between: empty range"),
            ("link all->all delay {x} s", "2", "--between: \"2\" is no range"),
            ("link all->all delay {x} s", "0..much", "--between: \"much\" is not a number"),
            ("link all->all dleay {x} s", "0..2", "--of: fault \"at 0 s link all->all dleay 0 s\""),
        ] {
            let error = question(of, between).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
        let error = question("control.gain={x}", "0..2").unwrap_err();
        assert!(error.contains("--of: control.gain = 0"), "{error}");
    }

    #[test]
    fn theory_applies_to_delays_that_all_uavs_have() {
        let late = |of: &str| question(of, "10..200").unwrap().delays();
        let own = late("link own->all delay {x} ms").unwrap();
        assert_eq!(own.late, Late::OwnState);
        assert!((own.number(0.078) - 78.0).abs() < 1e-9);
        assert_eq!(late("at 3 s link all->all delay {x} ms").unwrap().late, Late::NeighboursHeld);
        assert_eq!(late("link leader->all delay {x} ms"), None);
        assert_eq!(late("link 1->2 delay {x} ms"), None);
        assert_eq!(late("link all->all delay 1 s jitter {x} ms"), None);
        assert_eq!(question("control.formation_gain={x}", "1..3").unwrap().delays(), None);
    }
}
