//! `ringwing run`: flies a scenario and prints the verdict.
//!
//! Never flies anything itself; it makes the launcher's plan from the arguments.

use crate::{
    WrongUsage, baseline, config,
    launcher::{LaunchError, Outcome, Plan, launch},
    log_room, output,
    real_time::{Urgency, urgency},
    simulated, summary,
};
use ringwing_bench::PlacementArgs;
use ringwing_bus::write_whole;
use ringwing_flight::{Part, UavId};
use ringwing_recorder::{
    Summary,
    log::run_folder::{DEFAULT_OUT, log_in},
};
use ringwing_scenario::{AgentSection, Fault, Reading, Setting, Source, start};
use ringwing_study::shell::quoted;
use ringwing_viewer::LiveAddress;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// The paper's Section 4.2.
const DEFAULT_SCENARIO: &str = "paper-4.2";
/// Name of the layout for viewers in a run's folder; the recorder writes it.
const LAYOUT: &str = "layout.json";

/// What to fly, and how.
#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct RunArgs {
    /// Name of a preset (see `ringwing scenario list`), or a scenario file
    #[arg(default_value = DEFAULT_SCENARIO)]
    scenario: String,
    /// Override a key of the scenario, such as `control.dead_reckoning=off` or `obstacles.0.radius_m=15`
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// Add a fault, such as "at 30 s kill uav 3" or "at 5 s link 2->3 delay 200 ms for 10 s"
    #[arg(long = "fault", value_name = "SENTENCE")]
    faults: Vec<Fault>,
    /// Fly UAVs with a program of your own, such as "3=python3 mine.py" or "all=./my-controller"
    #[arg(long = "agent", value_name = "UAVS=COMMAND", value_parser = AgentSection::parse)]
    agents: Vec<AgentSection>,
    /// Seed of every random draw
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u64>,
    /// Control law: `paper` as written, or `resilient`, which copes with losses and delays
    #[arg(long, value_parser = config::LAWS)]
    law: Option<String>,
    /// Number of UAVs; all start at random places unless the scenario lists this many starts
    #[arg(long, value_name = "NUMBER")]
    uavs: Option<u32>,
    /// Simulated duration of the flight
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Fly in real time instead of as fast as the machine allows
    #[arg(long)]
    real_time: bool,
    /// Fly in one process, without shared memory: the same flight to the bit, several times faster
    #[arg(long, conflicts_with_all = ["real_time", "by_hand", "pin", "priority"])]
    simulated: bool,
    /// Show the flight in Foxglove while it goes on: on this machine only, unless you name an address
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true)]
    #[arg(default_missing_value = "127.0.0.1", conflicts_with = "simulated")]
    live: Option<LiveAddress>,
    /// Folder in which the run creates its own folder [default: runs]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Write no log; the flight is still measured
    #[arg(long)]
    no_record: bool,
    /// Compare the flight with the same one without its faults, and say what they cost
    #[arg(long, conflicts_with_all = ["real_time", "no_record"])]
    baseline: bool,
    /// Leave wall-clock times out of the log, so that equal flights give equal files
    #[arg(long)]
    no_timing: bool,
    /// Wait until you start this process yourself: world, leader, recorder, agent-3, ...
    #[arg(long, value_name = "PROCESS", value_parser = part)]
    by_hand: Vec<Part>,
    /// Print the summary as JSON, and no progress during the flight
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "With --real-time")]
    placement: PlacementArgs,
}

/// The process with this node name.
fn part(text: &str) -> Result<Part, String> {
    match text {
        "world" => Ok(Part::World),
        "leader" => Ok(Part::Leader),
        "recorder" => Ok(Part::Recorder),
        other => other
            .strip_prefix("agent-")
            .and_then(|number| number.parse().ok())
            .filter(|number| *number > 0)
            .map(|number| Part::Agent(UavId(number)))
            .ok_or_else(|| "expected world, leader, recorder, or agent- with the number of a UAV".into()),
    }
}

/// Flies and prints the summary; the exit code is that of the verdict.
pub(crate) fn run(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let (plan, notes) = plan(args)?;
    for note in &notes {
        output::warning(note);
    }
    let outcome = if args.simulated { simulated::fly(&plan)? } else { launch(&plan)? };
    let mut summary = summary::of_run(
        &plan.scenario,
        &outcome,
        plan.record,
        command(args, plan.scenario.seed, &outcome.added_faults),
    );
    if args.baseline {
        // Without the comparison, the flight still has its verdict.
        match baseline::of_log(&log_in(&outcome.folder)) {
            Ok(deviation) => summary.deviation = Some(deviation),
            Err(error) => output::warning(&format!("--baseline: {error}")),
        }
    }
    for refused in outcome.recorder.iter().flat_map(|report| &report.refused_notes) {
        output::warning(refused);
    }
    let text = if args.json { summary.to_json() + "\n" } else { summary::for_terminal(&summary) };
    // Print first: a disk that is full must not take the result.
    output::print(&text);
    if !args.json && plan.record {
        output::print(&next_steps(&outcome.folder, args.baseline));
    }
    write(&outcome, &summary)?;
    Ok(summary::exit_code(summary.verdict))
}

/// A line for each fault that can have no effect, and for each delay that rounding changes.
pub(crate) fn warnings(reading: &Reading) -> Vec<String> {
    reading.warnings().iter().map(ToString::to_string).collect()
}

/// What to launch, what to know about its faults, and what of the wishes for it is not permitted.
fn plan(args: &RunArgs) -> anyhow::Result<(Plan, Vec<String>)> {
    let reading = Reading::read(&Source::find(&args.scenario)?, &settings(args))?
        .with_faults(&args.faults)?
        .with_agents(&args.agents)?;
    let mut notes = warnings(&reading);
    let scenario = reading.scenario;
    // The world draws start states when it starts. Try that here, to fail before any process is started.
    start::states(&scenario)?;
    if args.simulated {
        ringwing_study::flight::check(&scenario)
            .map_err(|error| WrongUsage(format!("--simulated: {error}")))?;
    }
    if args.baseline {
        baseline::check(&scenario)?;
    }
    let out = config::out(args.out.as_deref());
    check_out(&out)?;
    check_by_hand(&args.by_hand, scenario.formation.uavs)?;
    let urgency = urgency(args.placement.placement(), &scenario)?;
    let Urgency { placement, lock_memory, .. } = urgency;
    notes.extend(urgency.notes);
    notes.extend(args.live.and_then(|address| address.warning()));
    notes.extend(log_room::warning(&scenario, &out).filter(|_| !args.no_record));
    let plan = Plan {
        scenario,
        out,
        record: !args.no_record,
        timing: !args.no_timing,
        by_hand: args.by_hand.iter().copied().collect(),
        quiet: args.json,
        recorder: true,
        measure: None,
        placement,
        lock_memory,
        live: args.live,
    };
    Ok((plan, notes))
}

/// The summary and the printed commands name the run's folder, and they are UTF-8.
pub(crate) fn check_out(out: &Path) -> Result<(), WrongUsage> {
    match out.to_str() {
        Some(_) => Ok(()),
        None => {
            Err(WrongUsage(format!("--out {}: the path is not UTF-8: choose another folder", out.display())))
        }
    }
}

fn check_by_hand(parts: &[Part], uavs: u32) -> Result<(), WrongUsage> {
    match parts.iter().find(|part| matches!(part, Part::Agent(uav) if uav.0 > uavs)) {
        Some(part) => {
            Err(WrongUsage(format!("--by-hand {}: this run has only UAVs 1 to {uavs}", part.node_name())))
        }
        None => Ok(()),
    }
}

/// The overrides of the scenario. Later ones win, so a flag of its own, such as `--seed`, beats `--set`.
fn settings(args: &RunArgs) -> Vec<Setting> {
    let mut settings = args.settings.clone();
    settings.extend(args.seed.map(|seed| Setting::of_flag("--seed", "seed", seed)));
    settings.extend(law(args).map(|law| Setting::of_flag("--law", "control.law", law)));
    settings.extend(args.uavs.map(|uavs| Setting::of_flag("--uavs", "formation.uavs", uavs)));
    settings
        .extend(args.duration.map(|s| Setting::of_flag("--duration", "time.duration_s", format!("{s:?}"))));
    settings.extend(args.real_time.then(|| Setting::of_flag("--real-time", "time.real_time", true)));
    settings
}

/// The law that replaces that of the scenario: as the flag says, or else the user's default, unless a `--set` names one.
fn law(args: &RunArgs) -> Option<String> {
    // A key may be shortened to its end.
    let is_set = || args.settings.iter().any(|setting| matches!(setting.key.as_str(), "control.law" | "law"));
    args.law.clone().or_else(|| config::law().filter(|_| !is_set()))
}

/// How to look further into a flight that was logged.
fn next_steps(folder: &Path, with_baseline: bool) -> String {
    let path = |name: &str| quoted(&folder.join(name).display().to_string());
    let log = quoted(&log_in(folder).display().to_string());
    let more = if with_baseline { " --baseline" } else { "" };
    let folder_text = quoted(&folder.display().to_string());
    let review = format!("  look     {} review {folder_text}{more}\n", quoted(&program()));
    // A flight without a recorder that finished may have no layout.
    if !folder.join(LAYOUT).exists() {
        return review;
    }
    format!("{review}           open {log} in Foxglove with {}\n", path(LAYOUT))
}

/// This command, as the user called it.
fn program() -> String {
    std::env::args().next().unwrap_or_else(|| "ringwing".into())
}

/// Writes `summary.json` into the folder of the run.
fn write(outcome: &Outcome, summary: &Summary) -> Result<(), LaunchError> {
    let path = outcome.folder.join("summary.json");
    write_whole(&path, summary.to_json() + "\n").map_err(|source| LaunchError::Folder { path, source })
}

/// The command that repeats the run, with its seed and with the faults that were added during the flight.
fn command(args: &RunArgs, seed: u64, added: &[Fault]) -> String {
    // `--by-hand` is not repeated: nobody may be there to start the processes.
    let mut words = vec![program(), "run".into(), args.scenario.clone()];
    for setting in &args.settings {
        words.extend(["--set".into(), format!("{}={}", setting.key, setting.value)]);
    }
    words.extend(args.agents.iter().flat_map(|agent| ["--agent".into(), agent.flag()]));
    words.extend(args.faults.iter().chain(added).flat_map(|fault| ["--fault".into(), fault.to_string()]));
    words.extend(["--seed".into(), seed.to_string()]);
    words.extend(law(args).into_iter().flat_map(|law| ["--law".into(), law]));
    words.extend(args.uavs.iter().flat_map(|uavs| ["--uavs".into(), uavs.to_string()]));
    words.extend(args.duration.iter().flat_map(|seconds| ["--duration".into(), seconds.to_string()]));
    let out = config::out(args.out.as_deref());
    if out != *DEFAULT_OUT {
        words.extend(["--out".into(), out.display().to_string()]);
    }
    for (given, flag) in [
        (args.real_time, "--real-time"),
        (args.simulated, "--simulated"),
        (args.no_record, "--no-record"),
        (args.baseline, "--baseline"),
        (args.no_timing, "--no-timing"),
        (args.json, "--json"),
    ] {
        words.extend(given.then(|| flag.into()));
    }
    words.extend(args.placement.to_arguments());
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processes_are_named_by_their_node_names() {
        for name in ["world", "leader", "recorder", "agent-3", "agent-200"] {
            assert_eq!(part(name).unwrap().node_name(), name);
        }
        for name in ["", "agent", "agent-", "agent-0", "agent-x", "launcher"] {
            assert!(part(name).is_err(), "{name}");
        }
    }
}
