//! `ringwing bench compare`: two results side by side, and which differences are significant.
//!
//! Must never report a difference that the spread of the repeats explains.

use crate::{
    case::Case,
    doctor,
    error::BenchError,
    label,
    quantity::{self, CaseQuantity},
    result::{FORMAT, Measured, RESULTS_FILE, Results},
    statistics::{SIGNIFICANCE_LEVEL, Significance, Spread, significance},
};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// Which results to compare.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct CompareArgs {
    /// One result: a file printed by `ringwing bench --json`, or a folder written by --out
    a: PathBuf,
    /// The other result
    b: PathBuf,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
}

/// Compares two results; returns the text to print.
pub(crate) fn run(args: &CompareArgs) -> Result<String, BenchError> {
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let comparison = Comparison::of(&a, &b);
    Ok(if args.json {
        serde_json::to_string_pretty(&comparison).expect("a comparison is plain data")
    } else {
        heading(&args.a, &a, "A") + &heading(&args.b, &b, "B") + &comparison.to_text()
    })
}

/// Reads a result from its file, or from the folder that holds it.
fn read(path: &Path) -> Result<Results, BenchError> {
    let file = if path.is_dir() { path.join(RESULTS_FILE) } else { path.to_owned() };
    let text = fs::read_to_string(&file).map_err(BenchError::file(&file, "read"))?;
    parse(&text).map_err(|problem| BenchError::Results { path: file, problem })
}

/// Parses a result; the error says what the text is instead, and what to do.
fn parse(text: &str) -> Result<Results, String> {
    #[derive(serde::Deserialize)]
    struct FormatOnly {
        format: String,
    }
    const NOT_OURS: &str = "not a result of `ringwing bench --json`";
    // Look at the format alone first: any other version, and any other JSON, would only be reported as damaged.
    match serde_json::from_str::<FormatOnly>(text) {
        Ok(FormatOnly { format }) if format == FORMAT => {}
        Ok(FormatOnly { format }) if format.starts_with("ringwing-bench-") => {
            return Err(format!(
                "written as `{format}`, but this ringwing reads `{FORMAT}`; measure again, or compare with the \
                 ringwing that wrote it"
            ));
        }
        Ok(_) => return Err(NOT_OURS.into()),
        // A truncated result is no JSON, but its beginning still names the format.
        Err(error) if text.contains(FORMAT) => {
            return Err(format!("truncated or damaged: {error}; measure again"));
        }
        Err(error) => return Err(format!("{NOT_OURS}: {error}")),
    }
    serde_json::from_str(text).map_err(|error| format!("truncated or damaged: {error}"))
}

fn heading(path: &Path, results: &Results, side: &str) -> String {
    let Results { ringwing, began, command, interrupted, .. } = results;
    let interrupted = if *interrupted { ", interrupted" } else { "" };
    format!("{side}  {}: ringwing {ringwing}, begun {began}{interrupted}\n   {command}\n", path.display())
}

/// Two results side by side.
#[derive(Debug, Serialize)]
struct Comparison {
    /// Facts about the machines that differ: A's value and B's.
    machines_differ: BTreeMap<String, [String; 2]>,
    /// The cases that both results have.
    cases: Vec<ComparedCase>,
    /// Names of the cases that only A has.
    only_in_a: Vec<String>,
    /// Names of the cases that only B has.
    only_in_b: Vec<String>,
}

/// A case that both results have.
#[derive(Debug, Serialize)]
struct ComparedCase {
    name: String,
    case: Case,
    #[serde(rename = "figures")]
    quantities: Vec<QuantityRow>,
}

/// A quantity that at least one of the results has.
#[derive(Debug, Serialize)]
struct QuantityRow {
    name: String,
    a: Option<Spread>,
    b: Option<Spread>,
    /// By how many percent B's median is larger than A's.
    difference_percent: Option<f64>,
    verdict: Significance,
}

impl Comparison {
    fn of(a: &Results, b: &Results) -> Self {
        // Cases are matched by what they are, not by position: the command lines may differ.
        let twin = |of: &Measured, all: &Results| all.cases.iter().position(|other| other.case == of.case);
        let pair = |of_a: &Measured| Some(ComparedCase::of((a, of_a), (b, b.cases.get(twin(of_a, b)?)?)));
        let only_in = |of: &Results, other: &Results| {
            let alone = of.cases.iter().filter(|measured| twin(measured, other).is_none());
            alone.map(|measured| label::case(&measured.case)).collect()
        };
        Self {
            machines_differ: different_facts(a, b),
            cases: a.cases.iter().filter_map(pair).collect(),
            only_in_a: only_in(a, b),
            only_in_b: only_in(b, a),
        }
    }

    fn to_text(&self) -> String {
        let mut text = self.machines_to_text();
        self.cases.iter().for_each(|case| text.push_str(&case.to_text()));
        for (side, names) in [("A", &self.only_in_a), ("B", &self.only_in_b)] {
            text.extend(names.iter().map(|name| format!("\nOnly in {side}: {name}")));
        }
        if self.cases.is_empty() {
            return text + "\nThe results have no case in common: measure with the same options.\n";
        }
        text + &format!(
            "\n\nMedians over repeats (ranges). A difference is reported if the ranges do not overlap, which happens by\n\
             chance in less than {:.0} of 100 comparisons (Mann and Whitney, two-sided). Among many figures, some\n\
             differ by chance. The machine may also have changed between the two results: alternate them.\n",
            100.0 * SIGNIFICANCE_LEVEL
        )
    }

    fn machines_to_text(&self) -> String {
        if self.machines_differ.is_empty() {
            return String::new();
        }
        let differs = |(name, [a, b]): (&String, &[String; 2])| format!("  {name}: {a} | {b}\n");
        let facts: String = self.machines_differ.iter().map(differs).collect();
        format!("\nThe machines differ, which may explain every difference below:\n{facts}")
    }
}

/// The facts that differ, apart from those that change from moment to moment.
fn different_facts(a: &Results, b: &Results) -> BTreeMap<String, [String; 2]> {
    let [a, b] = [a, b].map(|results| {
        let facts = results.machine.facts.iter().cloned();
        facts.filter(|(name, _)| !doctor::MOMENTARY.contains(&name.as_str())).collect::<BTreeMap<_, _>>()
    });
    let of = |facts: &BTreeMap<String, String>, name| facts.get(name).map_or("-".into(), String::clone);
    // Names of both sides: different versions may look at different facts.
    let different = a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name));
    different.map(|name| (name.clone(), [of(&a, name), of(&b, name)])).collect()
}

impl ComparedCase {
    fn of((a, of_a): (&Results, &Measured), (b, of_b): (&Results, &Measured)) -> Self {
        let (of_a, case) = (quantity::all(a, of_a), of_a.case.clone());
        let of_b = quantity::all(b, of_b);
        let values = |quantities: &[CaseQuantity], name: &str| {
            quantities.iter().find(|quantity| quantity.name == name).map(|quantity| quantity.values.clone())
        };
        // A's quantities in their order, then those that only B has.
        let mut names: Vec<&String> = of_a.iter().map(|quantity| &quantity.name).collect();
        names.extend(of_b.iter().map(|quantity| &quantity.name).filter(|name| values(&of_a, name).is_none()));
        let compared = |name: &&String| {
            let [a, b] = [&of_a, &of_b].map(|quantities| values(quantities, name).unwrap_or_default());
            QuantityRow::of(name, &a, &b)
        };
        Self { name: label::case(&case), case, quantities: names.iter().map(compared).collect() }
    }

    fn to_text(&self) -> String {
        let mut text = format!("\n{}\n  {:<28} {:>26} {:>26}  {:>8}\n", self.name, "", "A", "B", "B to A");
        self.quantities.iter().for_each(|quantity| text.push_str(&quantity.to_text()));
        text
    }
}

impl QuantityRow {
    fn of(name: &str, a: &[f64], b: &[f64]) -> Self {
        let (of_a, of_b) = (Spread::of(a), Spread::of(b));
        // There is no ratio to 0: a calm run misses no deadline.
        let difference =
            |(a, b): (Spread, Spread)| (a.median != 0.0).then(|| 100.0 * (b.median / a.median - 1.0));
        let difference_percent = of_a.zip(of_b).and_then(difference);
        Self { name: name.into(), a: of_a, b: of_b, difference_percent, verdict: significance(a, b) }
    }

    fn to_text(&self) -> String {
        let [a, b] = [self.a, self.b].map(|spread| spread.map_or("-".into(), median_and_range));
        let percent = self.difference_percent.map_or("-".into(), |percent| format!("{percent:+.1} %"));
        let verdict = match self.verdict {
            Significance::Lower => "LOWER",
            Significance::Higher => "HIGHER",
            Significance::Within => "within spread",
            Significance::TooFew => "too few repeats",
        };
        format!("  {:<28} {a:>26} {b:>26}  {percent:>8}  {verdict}\n", self.name)
    }
}

fn median_and_range(spread: Spread) -> String {
    let Spread { median, least, most, .. } = spread;
    format!("{} ({} to {})", three_digits(median), three_digits(least), three_digits(most))
}

/// A number with three significant digits, or all digits before the decimal point if there are more.
fn three_digits(value: f64) -> String {
    // Each limit is where the shorter format would round up to a fourth digit.
    match value.abs() {
        size if size < 9.995 => format!("{value:.2}"),
        size if size < 99.95 => format!("{value:.1}"),
        size if size < 1e15 => label::grouped(value.round() as u64),
        _ => format!("{value:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        case::{Carrier, Load},
        example,
    };

    /// The example with the tick times of its swarms multiplied by `factor`; the hops stay.
    fn slower(factor: f64) -> Results {
        let mut results = example::results();
        for measured in results.cases.iter_mut().filter(|one| one.case.carrier == Carrier::Swarm) {
            measured.repeats.iter_mut().for_each(|repeat| repeat.tick_ns *= factor);
        }
        results
    }

    fn row<'c>(comparison: &'c Comparison, name: &str) -> &'c QuantityRow {
        let pair = comparison.cases.iter().find(|pair| pair.name == "swarm, 6 UAVs, closed loop").unwrap();
        pair.quantities.iter().find(|row| row.name == name).unwrap()
    }

    #[test]
    fn a_result_does_not_differ_from_itself() {
        let results = example::results();
        let comparison = Comparison::of(&results, &results);
        assert_eq!(comparison.cases.len(), results.cases.len());
        for row in comparison.cases.iter().flat_map(|pair| &pair.quantities) {
            assert_eq!(row.verdict, Significance::Within, "{row:?}");
            assert!(row.difference_percent.is_none_or(|percent| percent == 0.0), "{row:?}");
        }
    }

    #[test]
    fn twice_as_slow_is_a_difference_and_a_tenth_is_not() {
        let a = example::results();
        // Repeats range from 12.6 to 21 us: ten percent more stay within that range, twice as much does not.
        let tenth = Comparison::of(&a, &slower(1.1));
        assert_eq!(row(&tenth, "tick time, us").verdict, Significance::Within);
        let double = Comparison::of(&a, &slower(2.0));
        let tick = row(&double, "tick time, us");
        assert_eq!(tick.verdict, Significance::Higher);
        assert!((tick.difference_percent.unwrap() - 100.0).abs() < 1e-9);
        // The ratio to the floor of the same round does not vary, so there a tenth shows.
        assert_eq!(row(&tenth, "tick time over the floor").verdict, Significance::Higher);
        assert_eq!(row(&double, "whole tick p50, us").verdict, Significance::Within);
    }

    #[test]
    fn cases_of_only_one_result_are_named() {
        let a = example::results();
        let mut b = example::results();
        b.cases.retain(|one| one.case.uavs != 30 && one.case.load == Load::Closed);
        let comparison = Comparison::of(&a, &b);
        assert_eq!(comparison.only_in_a.len(), 4, "{:?}", comparison.only_in_a);
        assert!(comparison.to_text().contains("Only in A: swarm, 6 UAVs, paced at 100 Hz"));
        b.cases.clear();
        assert!(Comparison::of(&a, &b).to_text().contains("no case in common"));
    }

    #[test]
    fn another_machine_is_reported_but_another_load_average_is_not() {
        let a = example::results();
        let mut b = example::results();
        b.machine.facts[1].1 = "64 of 64".into();
        b.machine.facts.push(("load average".into(), "9 9 9".into()));
        let comparison = Comparison::of(&a, &b);
        assert_eq!(comparison.machines_differ.keys().collect::<Vec<_>>(), ["cores"]);
        assert!(comparison.to_text().contains("cores: 2 of 2 | 64 of 64"), "{}", comparison.to_text());
    }

    #[test]
    fn the_error_says_what_a_file_is_instead_of_a_result() {
        let whole = serde_json::to_string(&example::results()).unwrap();
        assert_eq!(parse(&whole).unwrap(), example::results());
        let said = |text: &str| parse(text).unwrap_err();
        assert!(said("hello").contains("not a result of `ringwing bench --json`"), "{}", said("hello"));
        assert!(said("{\"format\": \"other\"}").contains("not a result of"));
        let newer = whole.replace(FORMAT, "ringwing-bench-2");
        assert!(said(&newer).contains("written as `ringwing-bench-2`"), "{}", said(&newer));
        assert!(said(&whole[..whole.len() / 2]).contains("truncated or damaged"));
        let changed = whole.replacen("\"n\":2000", "\"n\":1999", 1);
        assert!(said(&changed).contains("`n` contradicts `hdr`"), "{}", said(&changed));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read(Path::new("nowhere/a.json")).unwrap_err().to_string();
        assert!(
            error.contains("nowhere/a.json: cannot be read") && error.contains("No such file"),
            "{error}"
        );
    }

    #[test]
    fn json_has_medians_ranges_and_verdicts() {
        let json = serde_json::to_value(Comparison::of(&example::results(), &slower(2.0))).unwrap();
        let swarm = &json["cases"][3];
        assert_eq!(
            (&swarm["name"], &swarm["case"]["uavs"]),
            (&"swarm, 6 UAVs, closed loop".into(), &6.into())
        );
        let tick = &swarm["figures"][0];
        assert_eq!((&tick["name"], &tick["verdict"]), (&"tick time, us".into(), &"higher".into()));
        assert_eq!((&tick["a"]["least"], &tick["b"]["least"]), (&12.6.into(), &25.2.into()));
        assert_eq!(tick["a"]["repeats"], 4);
    }

    #[test]
    fn printed_and_indented_json_files_can_be_compared() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.json", "b.json"].map(|name| folder.path().join(name));
        fs::write(&a, serde_json::to_string(&example::results()).unwrap()).unwrap();
        fs::write(&b, serde_json::to_string_pretty(&slower(1.2)).unwrap()).unwrap();
        for json in [false, true] {
            run(&CompareArgs { a: a.clone(), b: b.clone(), json }).unwrap();
        }
        assert_eq!(read(&b).unwrap(), slower(1.2));
    }

    #[test]
    fn the_text_fits_a_terminal() {
        let text = Comparison::of(&example::results(), &slower(2.0)).to_text();
        for line in text.lines() {
            assert!(line.chars().count() <= 110, "{}: {line}", line.chars().count());
        }
    }
}
