//! The budget of a hunt: how many faults of each kind, how long and how strong they may be, and when.
//!
//! A budget is a list such as `2 kills, 1 link fault of at most 1 s, loss at most 30 %, from 20 s to 60 s`. Never knows a
//! swarm: which UAVs and links there are is the business of [`candidate`](super::candidate).

use ringwing_scenario::fault::{FaultSyntaxError, Lexer, Parsed};
use std::{
    fmt::{self, Display, Formatter},
    str::FromStr,
};

/// Most faults of a budget. With more, a search has so many numbers to choose that it hardly beats chance.
const FAULTS_MAX: u32 = 32;

/// What a hunt may do to a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    text: String,
    /// One entry for each fault.
    pub(super) faults: Vec<Allowance>,
    /// What link faults may do.
    pub(super) impairments: Impairments,
    /// When faults may begin, in seconds; `None` leaves that to the length of the flight.
    pub(super) window_s: Option<(f64, f64)>,
}

/// A fault that a budget allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Allowance {
    pub(super) kind: Kind,
    /// How long it may last at most, in seconds; 0 for a kill, which lasts for good.
    pub(super) most_s: f64,
}

/// Kinds of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    /// A UAV is killed for good.
    Kill,
    /// A UAV is killed and comes back.
    Restart,
    /// A UAV is killed and comes back again and again.
    Flap,
    /// A UAV stands still for a while.
    Freeze,
    /// A link between two ring neighbours, or from the leader to a UAV, is impaired.
    Link,
    /// All links of a UAV are impaired.
    Isolation,
    /// All links are impaired.
    Network,
}

/// What link faults may do; each is `None` or `false` where they may not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Impairments {
    /// The largest share of samples that a link may lose.
    pub(super) loss_max: Option<f64>,
    /// The longest delay, in seconds.
    pub(super) delay_max_s: Option<f64>,
    pub(super) blackout: bool,
}

/// Why a text is not a budget.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BudgetError {
    /// A word is wrong.
    #[error(transparent)]
    Syntax(#[from] FaultSyntaxError),
    /// There is nothing to hunt with.
    #[error("the budget has no fault: give a number of faults, such as 2 kills")]
    NoFault,
    /// There are more faults than a search can place.
    #[error("the budget has {0} faults: give at most {FAULTS_MAX}")]
    TooMany(u64),
    /// A bound is given twice.
    #[error("{0} is given twice: give it once")]
    Twice(&'static str),
    /// A bound of link faults, without link faults.
    #[error(
        "{0} bounds nothing, because the budget has no link fault: add one, such as 1 link fault of at most 1 s"
    )]
    NothingToBound(&'static str),
    /// A bound that leaves nothing.
    #[error("{0} allows nothing: give more, or leave it out")]
    Nothing(&'static str),
    /// A window that ends before it begins.
    #[error("from {0} s to {1} s: the window ends before it begins")]
    EmptyWindow(f64, f64),
}

/// What a clause of a budget says.
enum Clause {
    Faults(u32, Allowance),
    Loss(f64),
    Delay(f64),
    Blackout,
    Window(f64, f64),
}

impl FromStr for Budget {
    type Err = BudgetError;

    fn from_str(text: &str) -> Result<Self, BudgetError> {
        if text.trim().is_empty() {
            return Err(BudgetError::NoFault);
        }
        let mut words = Lexer::new(text);
        let clauses = words.separated(clause)?;
        words.end()?;
        Self::new(text.trim(), &clauses)
    }
}

impl Display for Budget {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Budget {
    fn new(text: &str, clauses: &[Clause]) -> Result<Self, BudgetError> {
        let mut budget = Self {
            text: text.to_owned(),
            faults: Vec::new(),
            impairments: Impairments { loss_max: None, delay_max_s: None, blackout: false },
            window_s: None,
        };
        let mut count = 0;
        for clause in clauses {
            match *clause {
                Clause::Faults(more, allowance) => {
                    // 64 bits, because the sum of a few counts of 32 bits may overflow 32 bits.
                    count += u64::from(more);
                    // Too many are refused below, and must not fill the memory first.
                    budget.faults.extend((0..more.min(FAULTS_MAX)).map(|_| allowance));
                }
                Clause::Loss(most) => set("loss", &mut budget.impairments.loss_max, most)?,
                Clause::Delay(most_s) => set("delay", &mut budget.impairments.delay_max_s, most_s)?,
                Clause::Blackout if budget.impairments.blackout => {
                    return Err(BudgetError::Twice("blackout"));
                }
                Clause::Blackout => budget.impairments.blackout = true,
                Clause::Window(from_s, to_s) => set("from", &mut budget.window_s, (from_s, to_s))?,
            }
        }
        match count {
            0 => Err(BudgetError::NoFault),
            _ if count > u64::from(FAULTS_MAX) => Err(BudgetError::TooMany(count)),
            _ => budget.checked(),
        }
    }

    /// Refuses bounds that bound nothing, and fills in what link faults may do where the text does not say.
    fn checked(mut self) -> Result<Self, BudgetError> {
        let Impairments { loss_max, delay_max_s, blackout } = self.impairments;
        let bounds = [("loss", loss_max.is_some()), ("delay", delay_max_s.is_some()), ("blackout", blackout)];
        let bound = bounds.iter().find(|(_, is_given)| *is_given).map(|(name, _)| *name);
        let of_links =
            || self.faults.iter().filter(|fault| fault.kind.is_of_links()).map(|fault| fault.most_s);
        match (bound, of_links().reduce(f64::max)) {
            (Some(bound), None) => return Err(BudgetError::NothingToBound(bound)),
            // A delay cannot matter for longer than until the fault is over and its samples have arrived.
            (None, Some(longest_s)) => {
                self.impairments =
                    Impairments { loss_max: Some(1.0), delay_max_s: Some(longest_s), blackout: true };
            }
            _ => {}
        }
        // Only a loss can be 0 here: the lexer refuses a duration of 0 s.
        if loss_max == Some(0.0) {
            return Err(BudgetError::Nothing("loss at most 0 %"));
        }
        match self.window_s {
            Some((from_s, to_s)) if to_s < from_s => Err(BudgetError::EmptyWindow(from_s, to_s)),
            _ => Ok(self),
        }
    }
}

impl Kind {
    pub(super) fn is_of_links(self) -> bool {
        matches!(self, Self::Link | Self::Isolation | Self::Network)
    }
}

fn set<T>(name: &'static str, place: &mut Option<T>, value: T) -> Result<(), BudgetError> {
    match place.replace(value) {
        None => Ok(()),
        Some(_) => Err(BudgetError::Twice(name)),
    }
}

fn clause(words: &mut Lexer<'_>) -> Parsed<Clause> {
    if words.is_at_number() {
        let count = words.count("the number of faults, from 1")?;
        return Ok(Clause::Faults(count, allowance(words)?));
    }
    if words.take("loss") {
        at_most(words)?;
        return words.probability().map(Clause::Loss);
    }
    if words.take("delay") {
        at_most(words)?;
        return words.duration_s().map(Clause::Delay);
    }
    if words.take("from") {
        let from_s = words.time_s()?;
        words.expect("to")?;
        return Ok(Clause::Window(from_s, words.time_s()?));
    }
    if words.take("blackout") {
        return Ok(Clause::Blackout);
    }
    let what = "a number of faults such as 2 kills, or loss at most 30 %, delay at most 1 s, blackout, from 20 s to 60 s";
    Err(words.expected(what, &["loss", "delay", "blackout", "from"]))
}

/// `kills`, or `link faults of at most 1 s`.
fn allowance(words: &mut Lexer<'_>) -> Parsed<Allowance> {
    const WORDS: [&str; 12] = [
        "kill",
        "kills",
        "restart",
        "restarts",
        "flap",
        "flaps",
        "freeze",
        "freezes",
        "link",
        "network",
        "isolation",
        "isolations",
    ];
    let kind = match words.choose(&WORDS)? {
        // A kill lasts for good, so it alone takes no `of at most`.
        "kill" | "kills" => return Ok(Allowance { kind: Kind::Kill, most_s: 0.0 }),
        "restart" | "restarts" => Kind::Restart,
        "flap" | "flaps" => Kind::Flap,
        "freeze" | "freezes" => Kind::Freeze,
        "isolation" | "isolations" => Kind::Isolation,
        word => {
            words.choose(&["fault", "faults"])?;
            if word == "link" { Kind::Link } else { Kind::Network }
        }
    };
    words.expect("of")?;
    at_most(words)?;
    Ok(Allowance { kind, most_s: words.duration_s()? })
}

fn at_most(words: &mut Lexer<'_>) -> Parsed<()> {
    words.expect("at")?;
    words.expect("most")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(text: &str) -> Budget {
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    fn refusal(text: &str) -> String {
        text.parse::<Budget>().unwrap_err().to_string()
    }

    #[test]
    fn a_budget_counts_faults_and_bounds_them() {
        let parsed = budget("2 kills, 1 link fault of at most 1 s, loss at most 30 %, from 20 s to 60 s");
        let kinds: Vec<_> = parsed.faults.iter().map(|fault| (fault.kind, fault.most_s)).collect();
        assert_eq!(kinds, [(Kind::Kill, 0.0), (Kind::Kill, 0.0), (Kind::Link, 1.0)]);
        let expected = Impairments { loss_max: Some(0.3), delay_max_s: None, blackout: false };
        assert_eq!((parsed.impairments, parsed.window_s), (expected, Some((20.0, 60.0))));
    }

    #[test]
    fn every_kind_of_fault_has_a_word_and_durations_may_be_in_milliseconds() {
        let text = "1 kill, 1 restart of at most 9 s, 2 flaps of at most 8 s, 1 freeze of at most 300ms, \
                    1 isolation of at most 4 s, 1 network fault of at most 2 s, delay at most 200 ms, blackout";
        let parsed = budget(text);
        assert_eq!(parsed.faults.len(), 7);
        assert_eq!(parsed.faults[4], Allowance { kind: Kind::Freeze, most_s: 0.3 });
        assert_eq!((parsed.impairments.delay_max_s, parsed.impairments.blackout), (Some(0.2), true));
        assert_eq!(parsed.to_string(), text);
    }

    #[test]
    fn link_faults_without_bounds_may_do_everything() {
        let expected = Impairments { loss_max: Some(1.0), delay_max_s: Some(5.0), blackout: true };
        assert_eq!(budget("1 link fault of at most 1 s, 1 isolation of at most 5 s").impairments, expected);
    }

    #[test]
    fn a_wrong_budget_is_refused_with_the_word_and_what_to_do() {
        for (text, expected) in [
            ("", "the budget has no fault: give a number of faults, such as 2 kills"),
            ("  ", "the budget has no fault"),
            ("from 1 s to 2 s", "the budget has no fault"),
            ("2 kils", "word 2, \"kils\": did you mean kills?"),
            ("0 kills", "word 1, \"0\": expected the number of faults, from 1"),
            ("1.5 kills", "word 1, \"1.5\": expected the number of faults"),
            ("kills", "word 1, \"kills\": expected a number of faults such as 2 kills"),
            ("2 kills 1 freeze", "word 3, \"1\": expected the end"),
            ("1 freeze", "after \"freeze\": expected of"),
            ("1 link fault of at most 0 s", "word 7, \"0\": out of range"),
            ("1 link of at most 1 s", "word 3, \"of\": expected fault or faults"),
            ("2 kills, loss at most 30 %", "loss bounds nothing, because the budget has no link fault"),
            ("1 link fault of at most 1 s, loss at most 130 %", "not between 0 and 1"),
            ("1 link fault of at most 1 s, loss at most 0 %", "loss at most 0 % allows nothing"),
            ("1 isolation of at most 1 s, blackout, blackout", "blackout is given twice"),
            ("1 kill, from 9 s to 8 s", "from 9 s to 8 s: the window ends before it begins"),
            ("1 kill, from 1 s to 2 s, from 3 s to 4 s", "from is given twice"),
            ("33 kills", "the budget has 33 faults: give at most 32"),
            ("4000000000 kills, 4000000000 kills", "the budget has 8000000000 faults"),
        ] {
            let message = refusal(text);
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
