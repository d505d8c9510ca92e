//! `ringwing verify`: flies a log's scenario again and compares every message except wall-clock times.
//!
//! Never changes the log: the second flight has a temporary folder of its own.

mod comparison;
mod difference;
mod requests;

use crate::{
    VIOLATED, config,
    launcher::{Plan, launch},
    output::{tell, warn_of},
    simulated,
};
use anyhow::bail;
use comparison::Comparison;
pub(crate) use comparison::compare;
pub(crate) use difference::Difference;
use requests::{is_refused_request, is_request};
use ringwing_bus::Placement;
use ringwing_flight::{Part, TimedEvent, UavId, counted};
use ringwing_recorder::{
    ADDED_FAULTS,
    log::{
        reader::{Reader, Shortfalls},
        run_folder::LOG_HELP,
    },
};
use ringwing_scenario::{AgentSection, Fault, Scenario, fault::schedule::ScheduledAction};
use std::{
    collections::BTreeSet,
    io::{Read, Seek},
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Which log to verify.
#[derive(Debug, clap::Args)]
pub(crate) struct VerifyArgs {
    #[arg(help = LOG_HELP)]
    log: PathBuf,
    /// Fly again with a process for each part, as the run did, instead of in one process
    #[arg(long)]
    processes: bool,
}

/// Flies the scenario of the log again and compares; the exit code is 3 if a message differs.
pub(crate) fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    let mut reader = Reader::open(&config::log(&args.log))?;
    let Repeatable { scenario, with_requests } = repeatable(&mut reader)?;
    let folder = tempfile::tempdir()?;
    let plan = Plan {
        scenario,
        out: folder.path().to_owned(),
        record: true,
        // Wall-clock times are not compared.
        timing: false,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: true,
        measure: None,
        placement: Placement::default(),
        lock_memory: false,
        live: None,
    };
    let is_own = |uav: UavId| plan.scenario.agent_of(uav).map(AgentSection::command_line);
    let outcome = if needs_processes(args, &plan.scenario) { launch(&plan)? } else { simulated::fly(&plan)? };
    // A flight that fails here says nothing about the log, so this is an error and not a difference.
    if let Some(failure) = outcome.failures.first() {
        bail!("the flight cannot be repeated here: {failure}");
    }
    let log = reader.path().to_owned();
    let result = compare(reader.rewind(), Reader::open(&outcome.folder)?, with_requests);
    Ok(report(&log, result, is_own))
}

/// Whether to fly again with processes. A fault of the recorder leaves a gap in the log, which only a recorder's process
/// can leave again.
fn needs_processes(args: &VerifyArgs, scenario: &Scenario) -> bool {
    let is_of_recorder = |action: &ScheduledAction| action.part == Part::Recorder;
    args.processes || scenario.schedule().scheduled_actions().iter().any(is_of_recorder)
}

/// Prints the result; `own_program` is the command of the program of the user's that flies a UAV, if one does.
fn report(
    log: &Path,
    result: Result<Comparison, Box<Difference>>,
    own_program: impl Fn(UavId) -> Option<String>,
) -> ExitCode {
    match result {
        Ok(Comparison { messages, left_out }) => {
            if !left_out.is_empty() {
                let topics = left_out.join(", ");
                warn_of(
                    log,
                    &[format!("it lacks these topics of the flight, which were not compared: {topics}")],
                );
            }
            tell(&format!(
                "{}: repeated to the bit, {} compared",
                log.display(),
                counted(messages, "message")
            ));
            ExitCode::SUCCESS
        }
        Err(difference) => {
            tell(&format!("{}: differs from the flight of this build: {difference}", log.display()));
            for (uav, command) in difference.uavs().iter().filter_map(|uav| Some((uav, own_program(*uav)?))) {
                tell(&format!(
                    "  the controller of {uav} differs: {command} decided otherwise at the same inputs"
                ));
            }
            ExitCode::from(VIOLATED)
        }
    }
}

/// A flight that can be flown again.
pub(crate) struct Repeatable {
    /// The scenario, with the faults that were asked for during the flight.
    pub(crate) scenario: Scenario,
    /// Whether somebody asked for faults during the flight.
    with_requests: bool,
}

/// The scenario of the log, with the faults that were asked for during the flight; an error if the flight cannot be
/// repeated.
pub(crate) fn repeatable<R: Read + Seek>(reader: &mut Reader<R>) -> anyhow::Result<Repeatable> {
    let mut scenario = reader.scenario()?;
    let not = format!("log {}: is not repeatable", reader.path().display());
    if scenario.time.real_time {
        bail!(
            "{not}: it is the log of a real-time run, which depends on the wall clock; fly the scenario in lockstep"
        );
    }
    let Shortfalls { problems, notes } = reader.shortfalls(&scenario);
    warn_of(reader.path(), &notes);
    let (mut requested, mut refused) = (0, 0);
    for tick in reader.ticks(&scenario) {
        requested += tick.events.iter().filter(|timed| is_request(&timed.event)).count();
        // A refused request changes no flight, but its events are in this log and not in that of the repeated flight.
        refused += tick.events.iter().filter(|timed| is_refused_request(&timed.event)).count();
        if let Some(TimedEvent { tick, event }) = first_by_chance(&tick.events) {
            bail!("{not}: at {tick} this happened by chance: {}", scenario.event_text(event));
        }
        if let Some(topic) = tick.conflict {
            bail!(
                "{not}: it mixes two flights: {topic} has two different messages at tick {}",
                tick.frame.tick
            );
        }
        if let Some(TimedEvent { tick, event }) = first_about_recorder(&tick.events) {
            bail!(
                "{not}: which ticks it lacks is chance, because at {tick} this happened: {}",
                scenario.event_text(event)
            );
        }
    }
    if let Some(problem) = problems.first() {
        bail!("{not}: {problem}");
    }
    // Only a recorder that finished its log wrote a verdict.
    if reader.result().is_none_or(|result| result.get("verdict").is_none_or(|verdict| verdict == "failed")) {
        bail!("{not}: the flight did not complete");
    }
    let added = reader.result().and_then(|result| result.get(ADDED_FAULTS)).map_or("", String::as_str);
    // A damaged sentence is left out here, and the count below finds that it is missing.
    let added: Vec<Fault> = added.lines().filter_map(|sentence| sentence.parse().ok()).collect();
    if added.len() != requested {
        bail!("{not}: it does not hold all faults that were asked for during the flight");
    }
    scenario.faults.extend(added);
    Ok(Repeatable { scenario, with_requests: requested + refused > 0 })
}

/// The first event that depends on chance. A flight with such an event may differ the next time.
fn first_by_chance(events: &[TimedEvent]) -> Option<&TimedEvent> {
    events.iter().find(|timed| timed.event.is_by_chance())
}

/// The first event about the recorder. It never changes the flight, but the log of another flight will not have it.
fn first_about_recorder(events: &[TimedEvent]) -> Option<&TimedEvent> {
    events.iter().find(|timed| timed.event.makes_log_unrepeatable())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{Event, GapCause, ProcessAction, Tick};

    const AGENT: Part = Part::Agent(UavId(3));

    fn log_of(event: Event) -> [TimedEvent; 2] {
        let asked =
            Event::ProcessFault { part: AGENT, action: ProcessAction::Stop, sentence: "stop uav 3".into() };
        [asked, event].map(|event| TimedEvent { tick: Tick(7), event })
    }

    #[test]
    fn a_flight_in_which_a_process_was_silent_or_a_fault_overdue_is_refused() {
        for event in [Event::ProcessSilent { part: AGENT, waited_s: 5.0 }, Event::FaultOverdue] {
            let events = log_of(event);
            assert_eq!(first_by_chance(&events), Some(&events[1]));
        }
    }

    #[test]
    fn faults_that_the_scenario_asks_for_can_be_repeated() {
        let events = log_of(Event::LinkFault { sentence: "link 2->3 hold".into() });
        assert_eq!((first_by_chance(&events), first_about_recorder(&events)), (None, None));
    }

    #[test]
    fn a_log_with_a_gap_is_refused_although_the_flight_can_be_repeated() {
        let cause = GapCause::LostWithPredecessor;
        let gap = Event::RecorderGap { first_tick: Tick(3), last_tick: Tick(5), cause };
        for event in [gap, Event::RecorderSilent, Event::ProcessReady { part: Part::Recorder }] {
            let events = log_of(event);
            assert_eq!((first_by_chance(&events), first_about_recorder(&events)), (None, Some(&events[1])));
        }
    }
}
