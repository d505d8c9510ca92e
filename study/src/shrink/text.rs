//! A small scenario as a file that a person reads: comments first, then only what differs from the defaults.
//!
//! Never leaves out a value that decides the flight: the text reads back as the same scenario.

use super::search::Shrunk;
use ringwing_scenario::Scenario;
use toml::{Table, Value};

impl Shrunk {
    /// The scenario with comments that say what it violates and what it was made from: `source`, with `original`.
    pub fn to_text(&self, source: &str, original: &Scenario) -> String {
        // A line break in a file's name would end the comment.
        let source = source.replace(char::is_control, " ");
        format!(
            "# This flight {}.\n# It was shrunk from {source} ({}) to this ({}) in {} flights{}.\n# Keys that are left out keep \
             their defaults.\n\n{}",
            self.symptom.sentence(),
            size(original),
            size(&self.smallest.scenario),
            self.smallest.flights,
            if self.smallest.is_stopped { "; the search was interrupted" } else { "" },
            brief(&self.smallest.scenario)
        )
    }
}

/// The size of a scenario in a few words.
pub(crate) fn size(scenario: &Scenario) -> String {
    let (faults, uavs) = (scenario.faults.len(), scenario.formation.uavs);
    format!("faults: {faults}, UAVs: {uavs}, {} s", scenario.time.duration_s)
}

/// The scenario without its default values, or in full if that would read back as another one.
pub(crate) fn brief(scenario: &Scenario) -> String {
    let full = scenario.to_toml();
    let parsed = |text: &str| text.parse::<Table>().ok();
    let short = parsed(&full)
        .zip(parsed(&Scenario::default().to_toml()))
        .map(|(own, usual)| without(own, &usual).to_string());
    let is_same = |text: &String| Scenario::resolved(text).is_ok_and(|read| read == *scenario);
    short.filter(is_same).unwrap_or(full)
}

/// `own` without the values that `usual` has too.
fn without(own: Table, usual: &Table) -> Table {
    let differing = |(key, value): (String, Value)| match (value, usual.get(&key)) {
        (Value::Table(own), Some(Value::Table(usual))) => {
            let rest = without(own, usual);
            (!rest.is_empty()).then_some((key, Value::Table(rest)))
        }
        (value, Some(usual)) if value == *usual => None,
        (value, _) => Some((key, value)),
    };
    own.into_iter().filter_map(differing).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_scenario::Source;

    #[test]
    fn a_brief_scenario_reads_back_as_the_same_one_and_is_shorter() {
        for name in ["storm", "paper-4.2", "dropout"] {
            let scenario = Scenario::read(&Source::find(name).unwrap(), &[]).unwrap();
            let text = brief(&scenario);
            assert_eq!(Scenario::resolved(&text).unwrap(), scenario, "{name}");
            assert!(text.len() < scenario.to_toml().len(), "{name}");
        }
    }
}
