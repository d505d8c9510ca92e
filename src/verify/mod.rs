//! `ringwing verify`: flies a log's scenario again and compares every message except wall-clock times.
//!
//! Never changes the log: the second flight has a temporary folder of its own.

mod difference;

use crate::{
    VIOLATED,
    launcher::{LOG, Plan, launch},
    simulated, tell,
};
use anyhow::bail;
use difference::Difference;
use ringwing_bus::Placement;
use ringwing_flight::{Part, TimedEvent};
use ringwing_recorder::{
    log::reader::{LogMessage, Reader},
    schema::topics,
};
use ringwing_scenario::{Scenario, fault::schedule::ScheduledAction};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Which log to verify.
#[derive(Debug, clap::Args)]
pub(crate) struct VerifyArgs {
    /// Log of a lockstep run, its `run.mcap`
    log: PathBuf,
    /// Fly again with a process for each part, as the run did, instead of in one process
    #[arg(long)]
    processes: bool,
}

/// Flies the scenario of the log again and compares; the exit code is 3 if a message differs.
pub(crate) fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    let scenario = repeatable(&args.log)?;
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
    };
    let outcome = if needs_processes(args, &plan.scenario) { launch(&plan)? } else { simulated::fly(&plan)? };
    if let Some(failure) = outcome.failures.first() {
        bail!("the flight cannot be repeated here: {failure}");
    }
    let result = compare(&args.log, &outcome.folder.join(LOG))?;
    Ok(report(&args.log, result))
}

/// Whether to fly again with processes. A fault of the recorder leaves a gap in the log, which only a recorder's process
/// can leave again.
fn needs_processes(args: &VerifyArgs, scenario: &Scenario) -> bool {
    let is_of_recorder = |action: &ScheduledAction| action.part == Part::Recorder;
    args.processes || scenario.schedule().scheduled_actions().iter().any(is_of_recorder)
}

fn report(log: &Path, result: Result<u64, Difference>) -> ExitCode {
    match result {
        Ok(count) => {
            tell(&format!("{}: repeated to the bit, {count} messages compared", log.display()));
            ExitCode::SUCCESS
        }
        Err(difference) => {
            tell(&format!("{}: differs from the flight of this build: {difference}", log.display()));
            ExitCode::from(VIOLATED)
        }
    }
}

/// The scenario of the log; an error if the flight cannot be repeated.
fn repeatable(log: &Path) -> anyhow::Result<Scenario> {
    let mut reader = Reader::open(log)?;
    let scenario = reader.scenario()?;
    let not = format!("log {}: is not repeatable", log.display());
    if scenario.time.real_time {
        bail!(
            "{not}: it is the log of a real-time run, which depends on the wall clock; fly the scenario in lockstep"
        );
    }
    // Read all ticks before asking for damages, which the reader finds on the way.
    for tick in reader.ticks(&scenario) {
        if let Some(TimedEvent { tick, event }) = first_by_chance(&tick.events) {
            bail!("{not}: at {tick} this happened by chance: {}", scenario.event_text(event));
        }
    }
    if let Some(damage) = reader.damages().listed.first() {
        bail!("{not}: it is damaged at byte {}: {}", damage.offset, damage.problem);
    }
    // Only a recorder that finished its log wrote a verdict.
    if reader.result().is_none_or(|result| result.get("verdict").is_none_or(|verdict| verdict == "failed")) {
        bail!("{not}: the flight did not complete");
    }
    Ok(scenario)
}

/// The number of messages if all are equal in both logs, or else the first difference.
fn compare(log: &Path, again: &Path) -> anyhow::Result<Result<u64, Difference>> {
    let messages = |path: &Path| Reader::open(path).map(|reader| reader.filter(is_compared));
    let (mut recorded, mut flown) = (messages(log)?, messages(again)?);
    let mut count = 0;
    loop {
        match (recorded.next(), flown.next()) {
            (None, None) => return Ok(Ok(count)),
            (Some(one), Some(other)) if is_same(&one, &other) => count += 1,
            // All further differences may follow from the first one.
            (one, other) => return Ok(Err(Difference::between(one.as_ref(), other.as_ref()))),
        }
    }
}

/// The first event that depends on chance. A flight with such an event may differ the next time.
fn first_by_chance(events: &[TimedEvent]) -> Option<&TimedEvent> {
    events.iter().find(|timed| timed.event.is_by_chance())
}

/// Whether a message should be equal in both logs; wall-clock times differ from run to run.
fn is_compared(message: &LogMessage) -> bool {
    message.topic.name != topics::TIMING
}

fn is_same(one: &LogMessage, other: &LogMessage) -> bool {
    one.topic.name == other.topic.name && one.sequence == other.sequence && one.data == other.data
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::{Event, ProcessAction, Tick, UavId};

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
        assert_eq!(first_by_chance(&events), None);
    }
}
