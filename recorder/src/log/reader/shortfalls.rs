//! Says what a log lacks of its flight, for instance after another program has filtered it.
//!
//! Never measures the flight: it compares what the log has with what its recorder says that it wrote.

use super::survey::Survey;
use crate::{
    schema::topics::{self, UavTopic},
    stream::channels,
};
use ringwing_scenario::Scenario;

/// Topics named one by one; the others are only counted. More names make the sentence too long for a terminal.
const NAMED_TOPICS: usize = 4;

/// What a log lacks, and what is unusual about it, as sentences.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Shortfalls {
    /// Why the log does not show the whole flight, so that the flight cannot be judged.
    pub problems: Vec<String>,
    /// What does not hinder a judgement.
    pub notes: Vec<String>,
}

impl Shortfalls {
    pub(super) fn of(survey: &Survey, scenario: &Scenario) -> Self {
        let problems = damages(survey)
            .into_iter()
            .chain(missing_uavs(survey, scenario))
            .chain(missing_messages(survey))
            .collect();
        Self { problems, notes: disorder(survey).into_iter().collect() }
    }
}

fn damages(survey: &Survey) -> Vec<String> {
    let damages = &survey.damages;
    let mut sentences: Vec<String> = damages
        .listed
        .iter()
        .map(|damage| format!("the log is damaged at byte {}: {}", damage.offset, damage.problem))
        .collect();
    let unlisted = damages.count - damages.listed.len() as u64;
    if unlisted > 0 {
        sentences.push(format!("the log has {unlisted} more damages"));
    }
    if survey.unnamed > 0 {
        let count = survey.unnamed;
        sentences.push(format!("{count} messages have no topic, because the record that names it is lost"));
    }
    sentences
}

/// The UAVs without a state in the log.
fn missing_uavs(survey: &Survey, scenario: &Scenario) -> Option<String> {
    let uavs = scenario.formation.uavs;
    let names = (1..=uavs).map(|uav| UavTopic::State.name(uav, uavs));
    let missing: Vec<String> = names.filter(|topic| !survey.messages.contains_key(topic)).collect();
    // A log that was cut before its first tick lacks everything, and says so itself.
    let is_cut = survey.messages.is_empty();
    (!missing.is_empty() && !is_cut).then(|| {
        let more = missing.len().saturating_sub(NAMED_TOPICS);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        let named = missing.iter().take(NAMED_TOPICS).cloned().collect::<Vec<_>>().join(", ");
        format!("the log lacks {} of {uavs} UAVs: it has no topic {named}{rest}", missing.len())
    })
}

/// The topics with fewer messages in the log than its recorder wrote. Logs of earlier versions do not say that.
fn missing_messages(survey: &Survey) -> Vec<String> {
    let missing = |group: &String| {
        // A log that was cut has no such record. That it has no end is reported elsewhere.
        let written: u64 = survey.results.first()?.get(&channels::count_key(group))?.parse().ok()?;
        let of_group = survey.messages.iter().filter(|(topic, _)| topics::group(topic) == *group);
        let found: u64 = of_group.map(|(_, count)| count).sum();
        (found < written).then(|| format!("{} of {written} messages of {group} are missing", written - found))
    };
    topics::judged_groups().iter().filter_map(missing).collect()
}

fn disorder(survey: &Survey) -> Option<String> {
    let (topic, log_time) = survey.first_disordered.as_ref()?;
    let count = survey.disordered;
    Some(format!(
        "{count} messages are out of order, the first is of {topic} at log time {log_time} ns; they are read in the order \
         of their times"
    ))
}
