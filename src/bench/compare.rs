//! `ringwing bench compare`: two results side by side, and which differences mean something.
//!
//! Never calls a difference one that the repeats' own spread explains.

use super::{
    RESULTS, doctor,
    figure::{self, Figure},
    label,
    result::{Case, FORMAT, Measured, Results},
    statistics::{CHANCE, Spread, Verdict, verdict},
};
use crate::tell;
use anyhow::{Context, bail};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Which results to compare.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Args {
    /// One result: what `ringwing bench --json` printed, or the folder of --out
    a: PathBuf,
    /// The other
    b: PathBuf,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
}

/// Compares.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let comparison = Comparison::of(&a, &b);
    let text = if args.json {
        serde_json::to_string_pretty(&comparison)?
    } else {
        heading(&args.a, &a, "A") + &heading(&args.b, &b, "B") + &comparison.to_text()
    };
    tell(text.trim_end());
    Ok(ExitCode::SUCCESS)
}

/// A result from its file.
pub(crate) fn read(path: &Path) -> anyhow::Result<Results> {
    let file = if path.is_dir() { path.join(RESULTS) } else { path.to_owned() };
    let name = file.display();
    let text = fs::read_to_string(&file)
        .with_context(|| format!("{name}: cannot be read; name a file that `ringwing bench --json` printed"))
        .map_err(|error| anyhow::anyhow!("{error:#}"))?;
    parse(&text).map_err(|error| anyhow::anyhow!("{name}: {error}"))
}

fn parse(text: &str) -> anyhow::Result<Results> {
    #[derive(serde::Deserialize)]
    struct Kind {
        format: String,
    }
    const NOT_OURS: &str = "not a result of `ringwing bench --json`";
    match serde_json::from_str::<Kind>(text) {
        Ok(Kind { format }) if format == FORMAT => {}
        Ok(Kind { format }) if format.starts_with("ringwing-bench-") => bail!(
            "written as `{format}`, and this ringwing reads `{FORMAT}`; measure again, or compare with the ringwing \
             that wrote it"
        ),
        Ok(_) => bail!(NOT_OURS),
        Err(error) if text.contains(FORMAT) => bail!("cut or damaged: {error}; measure again"),
        Err(error) => bail!("{NOT_OURS}: {error}"),
    }
    serde_json::from_str(text).map_err(|error| anyhow::anyhow!("cut or damaged: {error}"))
}

fn heading(path: &Path, results: &Results, side: &str) -> String {
    let Results { ringwing, began, command, interrupted, .. } = results;
    let cut = if *interrupted { ", interrupted" } else { "" };
    format!("{side}  {}: ringwing {ringwing}, begun {began}{cut}\n   {command}\n", path.display())
}

/// What comes of two results.
#[derive(Debug, Serialize)]
struct Comparison {
    /// Facts of the machines that differ: what A's says, and what B's.
    machines_differ: BTreeMap<String, [String; 2]>,
    /// Cases of both.
    cases: Vec<Pair>,
    /// Cases that B does not have.
    only_in_a: Vec<String>,
    /// Cases that A does not have.
    only_in_b: Vec<String>,
}

/// A case that both have.
#[derive(Debug, Serialize)]
struct Pair {
    name: String,
    case: Case,
    figures: Vec<Row>,
}

/// A figure that one of them has at least.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    a: Option<Spread>,
    b: Option<Spread>,
    /// How much larger B's median is than A's.
    difference_percent: Option<f64>,
    verdict: Verdict,
}

impl Comparison {
    fn of(a: &Results, b: &Results) -> Self {
        let twin = |of: &Measured, all: &Results| all.cases.iter().position(|other| other.case == of.case);
        let pair = |of_a: &Measured| Some(Pair::of((a, of_a), (b, b.cases.get(twin(of_a, b)?)?)));
        let lacks = |all: &Results, of: &Results| {
            let alone = of.cases.iter().filter(|measured| twin(measured, all).is_none());
            alone.map(|measured| label::case(&measured.case)).collect()
        };
        Self {
            machines_differ: different_facts(a, b),
            cases: a.cases.iter().filter_map(pair).collect(),
            only_in_a: lacks(b, a),
            only_in_b: lacks(a, b),
        }
    }

    fn to_text(&self) -> String {
        let mut text = self.to_text_of_machines();
        self.cases.iter().for_each(|pair| text.push_str(&pair.to_text()));
        for (side, names) in [("A", &self.only_in_a), ("B", &self.only_in_b)] {
            text.extend(names.iter().map(|name| format!("\nOnly in {side}: {name}")));
        }
        if self.cases.is_empty() {
            return text + "\nNo case is in both: measure with the same options.\n";
        }
        text + &format!(
            "\n\nMedians over repeats (ranges). A difference counts where the ranges are apart, and chance puts them\n\
             apart in less than {:.0} of 100 comparisons (Mann and Whitney, two-sided): of many figures, some do \
             by chance.\nTwo results measured one after the other differ by what happened in between, too: alternate \
             them.\n",
            100.0 * CHANCE
        )
    }

    fn to_text_of_machines(&self) -> String {
        if self.machines_differ.is_empty() {
            return String::new();
        }
        let differs = |(name, [a, b]): (&String, &[String; 2])| format!("  {name}: {a} | {b}\n");
        let facts: String = self.machines_differ.iter().map(differs).collect();
        format!("\nThe machines differ, and so may all that follows:\n{facts}")
    }
}

/// The facts that differ, but for those that always do.
fn different_facts(a: &Results, b: &Results) -> BTreeMap<String, [String; 2]> {
    let [a, b] = [a, b].map(|results| {
        let facts = results.machine.facts.iter().cloned();
        facts.filter(|(name, _)| !doctor::MOMENTARY.contains(&name.as_str())).collect::<BTreeMap<_, _>>()
    });
    let of = |facts: &BTreeMap<String, String>, name| facts.get(name).map_or("-".into(), String::clone);
    let both = a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name));
    both.map(|name| (name.clone(), [of(&a, name), of(&b, name)])).collect()
}

impl Pair {
    fn of((a, of_a): (&Results, &Measured), (b, of_b): (&Results, &Measured)) -> Self {
        let (of_a, case) = (figure::all(a, of_a), of_a.case.clone());
        let of_b = figure::all(b, of_b);
        let values = |figures: &[Figure], name: &str| {
            figures.iter().find(|figure| figure.name == name).map(|figure| figure.values.clone())
        };
        let mut names: Vec<&String> = of_a.iter().map(|figure| &figure.name).collect();
        names.extend(of_b.iter().map(|figure| &figure.name).filter(|name| values(&of_a, name).is_none()));
        let row = |name: &&String| {
            Row::of(name, &values(&of_a, name).unwrap_or_default(), &values(&of_b, name).unwrap_or_default())
        };
        Self { name: label::case(&case), case, figures: names.iter().map(row).collect() }
    }

    fn to_text(&self) -> String {
        let mut text = format!("\n{}\n  {:<28} {:>26} {:>26}  {:>8}\n", self.name, "", "A", "B", "B to A");
        self.figures.iter().for_each(|row| text.push_str(&row.to_text()));
        text
    }
}

impl Row {
    fn of(name: &str, a: &[f64], b: &[f64]) -> Self {
        let (of_a, of_b) = (Spread::of(a), Spread::of(b));
        let difference =
            |(a, b): (Spread, Spread)| (a.median != 0.0).then(|| 100.0 * (b.median / a.median - 1.0));
        let difference_percent = of_a.zip(of_b).and_then(difference);
        Self { name: name.into(), a: of_a, b: of_b, difference_percent, verdict: verdict(a, b) }
    }

    fn to_text(&self) -> String {
        let [a, b] = [self.a, self.b].map(|spread| spread.map_or("-".into(), shown));
        let percent = self.difference_percent.map_or("-".into(), |percent| format!("{percent:+.1} %"));
        let verdict = match self.verdict {
            Verdict::Lower => "LOWER",
            Verdict::Higher => "HIGHER",
            Verdict::Within => "within spread",
            Verdict::TooFew => "too few",
        };
        format!("  {:<28} {a:>26} {b:>26}  {percent:>8}  {verdict}\n", self.name)
    }
}

/// Median and range with three figures each.
fn shown(spread: Spread) -> String {
    let Spread { median, least, most, .. } = spread;
    format!("{} ({} to {})", three_figures(median), three_figures(least), three_figures(most))
}

fn three_figures(value: f64) -> String {
    match value.abs() {
        size if size < 9.995 => format!("{value:.2}"),
        size if size < 99.95 => format!("{value:.1}"),
        size if size < 1e15 => label::grouped(value.round() as u64),
        _ => format!("{value:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            example,
            result::{Load, Subject},
        },
        *,
    };

    /// The example with its swarms `factor` times as slow, in ticks a second as in every hop's place.
    fn slower(factor: f64) -> Results {
        let mut results = example::results();
        for measured in results.cases.iter_mut().filter(|one| one.case.subject == Subject::Swarm) {
            measured.repeats.iter_mut().for_each(|repeat| repeat.tick_ns *= factor);
        }
        results
    }

    fn row<'c>(comparison: &'c Comparison, name: &str) -> &'c Row {
        let pair = comparison.cases.iter().find(|pair| pair.name == "swarm, 6 UAVs, closed loop").unwrap();
        pair.figures.iter().find(|row| row.name == name).unwrap()
    }

    #[test]
    fn a_result_is_within_the_spread_of_itself() {
        let results = example::results();
        let comparison = Comparison::of(&results, &results);
        assert_eq!(comparison.cases.len(), results.cases.len());
        for row in comparison.cases.iter().flat_map(|pair| &pair.figures) {
            assert_eq!(row.verdict, Verdict::Within, "{row:?}");
            assert!(row.difference_percent.is_none_or(|percent| percent == 0.0), "{row:?}");
        }
    }

    #[test]
    fn twice_as_slow_is_a_difference_and_a_tenth_is_not() {
        let a = example::results();
        // Repeats range from 12.6 to 21 us: ten percent more are lost in that, twice as much is not.
        let tenth = Comparison::of(&a, &slower(1.1));
        assert_eq!(row(&tenth, "tick time, us").verdict, Verdict::Within);
        let double = Comparison::of(&a, &slower(2.0));
        let tick = row(&double, "tick time, us");
        assert_eq!(tick.verdict, Verdict::Higher);
        assert!((tick.difference_percent.unwrap() - 100.0).abs() < 1e-9);
        // The ratio to the floor is freed of the rounds' slowness: there a tenth shows.
        assert_eq!(row(&tenth, "tick time over the floor").verdict, Verdict::Higher);
        assert_eq!(row(&double, "whole tick p50, us").verdict, Verdict::Within);
    }

    #[test]
    fn cases_of_one_side_are_named() {
        let a = example::results();
        let mut b = example::results();
        b.cases.retain(|one| one.case.uavs != 30 && one.case.load == Load::Closed);
        let comparison = Comparison::of(&a, &b);
        assert_eq!(comparison.only_in_a.len(), 4, "{:?}", comparison.only_in_a);
        assert!(comparison.to_text().contains("Only in A: swarm, 6 UAVs, paced at 100 Hz"));
        b.cases.clear();
        assert!(Comparison::of(&a, &b).to_text().contains("No case is in both"));
    }

    #[test]
    fn other_machines_are_told_and_another_moment_is_none() {
        let a = example::results();
        let mut b = example::results();
        b.machine.facts[1].1 = "64 of 64".into();
        b.machine.facts.push(("load average".into(), "9 9 9".into()));
        let comparison = Comparison::of(&a, &b);
        assert_eq!(comparison.machines_differ.keys().collect::<Vec<_>>(), ["cores"]);
        assert!(comparison.to_text().contains("cores: 2 of 2 | 64 of 64"), "{}", comparison.to_text());
    }

    #[test]
    fn what_is_no_result_is_refused_with_what_it_is() {
        let whole = serde_json::to_string(&example::results()).unwrap();
        assert_eq!(parse(&whole).unwrap(), example::results());
        let said = |text: &str| parse(text).unwrap_err().to_string();
        assert!(said("hello").contains("not a result of `ringwing bench --json`"), "{}", said("hello"));
        assert!(said("{\"format\": \"other\"}").contains("not a result of"));
        let newer = whole.replace(FORMAT, "ringwing-bench-2");
        assert!(said(&newer).contains("written as `ringwing-bench-2`"), "{}", said(&newer));
        assert!(said(&whole[..whole.len() / 2]).contains("cut or damaged"));
        let changed = whole.replacen("\"n\":2000", "\"n\":1999", 1);
        assert!(said(&changed).contains("`n` does not agree with `hdr`"), "{}", said(&changed));
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = read(Path::new("nowhere/a.json")).unwrap_err().to_string();
        assert!(
            error.contains("nowhere/a.json: cannot be read") && error.contains("No such file"),
            "{error}"
        );
    }

    #[test]
    fn scripts_get_medians_ranges_and_verdicts() {
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
    fn files_are_compared_as_they_were_printed() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.json", "b.json"].map(|name| folder.path().join(name));
        fs::write(&a, serde_json::to_string(&example::results()).unwrap()).unwrap();
        fs::write(&b, serde_json::to_string_pretty(&slower(1.2)).unwrap()).unwrap();
        for json in [false, true] {
            run(&Args { a: a.clone(), b: b.clone(), json }).unwrap();
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
