//! The command `ringwing`: parses the command line and starts what it asks for.
//!
//! A swarm of fixed-wing UAVs, each its own operating-system process, flies a ring formation. Each verb has its own
//! module; this one must never contain a verb's logic.

mod baseline;
mod bench;
mod clean;
mod compare;
mod completion;
mod config;
mod conform;
mod doctor;
mod exec;
mod fault_command;
mod fault_picture;
mod help;
mod hunt;
mod launcher;
mod live_run;
mod log_room;
mod margin;
mod output;
mod own_run;
mod package_files;
mod pause_command;
mod real_time;
mod recover_command;
mod replay;
mod review;
mod run;
mod scenario_command;
mod shrink;
mod simulated;
mod summary;
mod sweep;
mod verify;
mod watch;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::{CompleteEnv, Shell};
use ringwing_flight::counted;
use std::{io, process::ExitCode};

/// Fly a swarm of fixed-wing UAVs in a ring formation, each UAV its own process
///
/// Without a subcommand, ringwing flies the paper's Section 4.2, like `ringwing run`.
#[derive(Debug, Parser)]
#[command(
    name = "ringwing",
    version = VERSION,
    max_term_width = help::COLUMNS_MAX,
    subcommand_negates_reqs = true,
    after_help = EXIT_CODES
)]
struct Cli {
    #[command(flatten)]
    process: ProcessOptions,
    #[command(subcommand)]
    command: Option<Verb>,
}

/// The same command line, reduced to what starts a process.
#[derive(Debug, Parser)]
struct ProcessCli {
    #[command(flatten)]
    process: ProcessOptions,
    #[command(subcommand)]
    command: ProcessVerb,
}

#[derive(Debug, clap::Args)]
struct ProcessOptions {
    /// (process) Keep the memory of this process in RAM
    #[arg(long, hide = true)]
    lock_memory: bool,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Fly a scenario and print the verdict
    Run(Box<run::RunArgs>),
    /// Inject a fault into a live run
    Fault(fault_command::FaultArgs),
    /// Watch a live run or a log in the terminal
    Watch(watch::WatchArgs),
    /// Let a live flight in lockstep stand still before its next tick
    Pause(pause_command::PauseArgs),
    /// Let a paused flight fly some ticks
    Step(pause_command::StepArgs),
    /// Let a paused flight fly on
    Resume(pause_command::PauseArgs),
    /// Summarize and draw a flight from its log
    Review(review::ReviewArgs),
    /// Repeat the flight of a log and compare every message
    Verify(verify::VerifyArgs),
    /// Show the metrics of two logs side by side
    Compare(compare::CompareLogsArgs),
    /// Measure how long a tick takes, with shared memory and with other transports
    Bench(Box<ringwing_bench::BenchArgs>),
    /// Fly a scenario thousands of times, over axes and seeds, and draw robustness maps
    Sweep(Box<sweep::SweepArgs>),
    /// Measure how much of something a swarm can take, such as a delay, and compare it with theory
    Margin(Box<margin::MarginArgs>),
    /// Check whether a controller of your own is fit to fly
    Conform(conform::ConformArgs),
    /// Find the worst that a bounded number of faults can do to a flight
    Hunt(Box<hunt::HuntArgs>),
    /// Make a flight that violates a requirement small
    Shrink(shrink::ShrinkArgs),
    /// Show a log in Foxglove as if the flight went on now
    Replay(replay::ReplayArgs),
    /// Rebuild a log that was cut or damaged
    Recover(recover_command::RecoverArgs),
    /// List, show or check scenarios, or draw what a fault does
    #[command(subcommand)]
    Scenario(scenario_command::ScenarioVerb),
    /// Check whether this machine is fit to fly
    Doctor(doctor::DoctorArgs),
    /// Show your own defaults, and the files that set them
    Config,
    /// Remove what killed runs and benchmarks left behind
    Clean,
    /// Print a script that completes this command in a shell; source it
    Completion {
        /// The shell
        shell: Shell,
    },
    /// Write the man pages and completions that a package installs
    #[command(hide = true)]
    PackageFiles(package_files::PackageFilesArgs),
    #[command(flatten)]
    Process(ProcessVerb),
}

/// A process that another verb starts.
#[derive(Debug, Subcommand)]
enum ProcessVerb {
    /// (process) Fly one UAV of a run
    #[command(display_order = 100)]
    Agent(ringwing_agent::AgentArgs),
    /// (process) Integrate the airframes of a run and keep its time
    #[command(display_order = 101)]
    World(bench::MeasuredWorldArgs),
    /// (process) Fly the virtual leader of a run
    #[command(display_order = 102)]
    Leader(ringwing_leader::LeaderArgs),
    /// (process) Measure one case of a benchmark
    #[command(hide = true)]
    BenchCase(Box<ringwing_bench::CaseArgs>),
    /// (process) Answer ticks in place of an agent
    #[command(hide = true)]
    BenchPeer(Box<ringwing_bench::PeerArgs>),
    /// (process) Become a program of the user's, which then ends with the launcher
    #[command(hide = true)]
    Exec(exec::ExecArgs),
    /// (process) Record a run to MCAP and measure it
    #[command(display_order = 103)]
    Recorder(ringwing_recorder::RecorderArgs),
    /// (process) Show a run in Foxglove
    #[command(display_order = 104)]
    Viewer(ringwing_viewer::ViewerArgs),
}

/// The version, the commit that was built, and the machine that it was built for.
const VERSION: &str =
    concat!(env!("CARGO_PKG_VERSION"), " (", env!("RINGWING_COMMIT"), ", ", env!("RINGWING_TARGET"), ")");
/// What the exit codes below mean, for the help.
const EXIT_CODES: &str = "Exit codes: 0 done or passed; 1 failed; 2 wrong usage or an invalid scenario; 3 a requirement is \
                          violated, a repeated flight differs, or a controller is not fit; 141 the reader of the output hung up";
/// Exit code of a run or tool that failed.
const FAILED: u8 = 1;
/// Exit code of a flight that violated a requirement of its scenario.
const VIOLATED: u8 = 3;
/// Exit code for wrong usage and for invalid scenarios; clap uses the same.
const WRONG_USAGE: u8 = 2;
/// Exit code if the reader of standard output hung up: what a shell reports of a tool that SIGPIPE killed.
const READER_GONE: u8 = 128 + 13;

/// Arguments that are valid alone, but not together or not with this scenario.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct WrongUsage(String);

fn main() -> ExitCode {
    let code = match answer_shell() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => parse().map_or_else(|answer| refuse_or_help(&answer), start),
        Err(refusal) => refuse_or_help(&refusal),
    };
    output::exit_code(code)
}

/// The command line.
fn parse() -> clap::error::Result<Cli> {
    if let Some(ProcessCli { process, command }) = parse_process() {
        return Ok(Cli { process, command: Some(Verb::Process(command)) });
    }
    Cli::from_arg_matches(&help::dressed(Cli::command()).try_get_matches()?)
}

/// The command line of a process, if it is a valid one.
///
/// Building the whole command with its help takes as long as all that comes before `main`, and a run may start hundreds of
/// processes.
fn parse_process() -> Option<ProcessCli> {
    let mut words = std::env::args_os().skip(1).filter_map(|word| word.into_string().ok());
    let verb = words.find(|word| !word.starts_with('-'))?;
    // Its help, and what is wrong with its arguments, are told in the words of the whole command.
    ProcessVerb::has_subcommand(&verb).then(ProcessCli::try_parse)?.ok()
}

/// Prints completions if a shell asks for them, and returns whether it does.
fn answer_shell() -> clap::error::Result<bool> {
    let command = || completion::with_completers(Cli::command());
    CompleteEnv::with_factory(command)
        .try_complete(std::env::args_os(), std::env::current_dir().ok().as_deref())
}

/// Prints clap's answer: the help or the version that was asked for, or what is wrong with the arguments.
fn refuse_or_help(answer: &clap::Error) -> ExitCode {
    let text = answer.render();
    let shown = |is_coloured| if is_coloured { text.ansi().to_string() } else { text.to_string() };
    if answer.use_stderr() {
        output::note(shown(output::is_coloured(&io::stderr())).trim_end());
        return ExitCode::from(WRONG_USAGE);
    }
    output::print(&shown(output::is_coloured(&io::stdout())));
    ExitCode::SUCCESS
}

/// Does what the arguments ask for, and says what went wrong.
fn start(Cli { process, command }: Cli) -> ExitCode {
    // Beyond `ulimit -f` a write fails, like on a full disk: whoever writes reports it.
    if let Err(error) = ringwing_bus::survive_file_size_limit() {
        output::warning(&error);
    }
    if process.lock_memory
        && let Err(error) = real_time::lock_memory()
    {
        output::warning(&format!("memory cannot be locked: {error}"));
    }
    // Before the verb begins, because a mistake in them must not end it half-way.
    if let Err(error) = config::load() {
        return report("", &error);
    }
    // Let clap parse the default verb too, so that the defaults of `run` are written down only once.
    let verb = command.or_else(|| Cli::parse_from(["ringwing", "run"]).command);
    let Some(verb) = verb else { unreachable!("`ringwing run` is a subcommand") };
    let (who, result) = match verb {
        Verb::Run(args) => ("", run::run(&args)),
        Verb::Fault(args) => ("", fault_command::run(&args)),
        Verb::Watch(args) => ("", watch::run(&args)),
        Verb::Pause(args) => ("", pause_command::pause(&args)),
        Verb::Step(args) => ("", pause_command::step(&args)),
        Verb::Resume(args) => ("", pause_command::resume(&args)),
        Verb::Completion { shell } => ("", completion::run(shell)),
        Verb::Review(args) => ("", review::run(&args)),
        Verb::Verify(args) => ("", verify::run(&args)),
        Verb::Compare(args) => ("", compare::run(&args)),
        Verb::Bench(args) => ("", bench::run(&args)),
        Verb::Sweep(args) => ("", sweep::run(&args)),
        Verb::Hunt(args) => ("", hunt::run(&args)),
        Verb::Shrink(args) => ("", shrink::run(&args)),
        Verb::Margin(args) => ("", margin::run(&args)),
        Verb::Replay(args) => ("", replay::run(&args)),
        Verb::Recover(args) => ("", recover_command::run(&args)),
        Verb::Scenario(verb) => ("", scenario_command::run(&verb)),
        Verb::Conform(args) => ("", conform::run(&args)),
        Verb::Doctor(args) => ("", doctor::run(&args)),
        Verb::Config => ("", config::run()),
        Verb::Clean => ("", clean::run()),
        Verb::PackageFiles(args) => ("", package_files::run(&args)),
        Verb::Process(verb) => start_process(verb),
    };
    result.unwrap_or_else(|error| report(who, &error))
}

/// Runs a process to its end. Returns who it is for its errors, and how it ended.
fn start_process(verb: ProcessVerb) -> (&'static str, anyhow::Result<ExitCode>) {
    match verb {
        ProcessVerb::Agent(args) => ("agent: ", finished(ringwing_agent::run(&args))),
        ProcessVerb::World(args) => ("world: ", bench::run_world(&args)),
        ProcessVerb::Leader(args) => ("leader: ", finished(ringwing_leader::run(&args))),
        ProcessVerb::Recorder(args) => ("recorder: ", finished(ringwing_recorder::run(&args))),
        ProcessVerb::Viewer(args) => ("viewer: ", finished(ringwing_viewer::run(&args))),
        ProcessVerb::BenchCase(args) => ("bench: ", bench::run_case(&args)),
        ProcessVerb::BenchPeer(args) => ("bench: ", bench::run_peer(&args)),
        ProcessVerb::Exec(args) => ("", exec::run(&args)),
    }
}

/// Prints the error that ended the command, and returns the exit code for it.
fn report(who: &str, error: &anyhow::Error) -> ExitCode {
    match error.downcast_ref::<ringwing_scenario::ScenarioError>() {
        Some(scenario) => {
            scenario.problems().iter().for_each(|problem| output::error(problem));
            output::note(&counted(scenario.problems().len(), "error"));
        }
        // All processes of a run write to the same terminal, so each says who it is.
        None => output::error(&format!("{who}{error}")),
    }
    let is_usage = error.is::<ringwing_scenario::ScenarioError>() || error.is::<WrongUsage>();
    ExitCode::from(if is_usage { WRONG_USAGE } else { FAILED })
}

fn finished<E: std::error::Error + Send + Sync + 'static>(result: Result<(), E>) -> anyhow::Result<ExitCode> {
    result?;
    Ok(ExitCode::SUCCESS)
}
