//! Starts the processes of a run, supervises them, applies faults, and removes everything that they leave.
//!
//! Must never fly, and never touch a sample on the tick path.
//!
//! [`supervisor`] runs the loop. What it has to do comes from pure modules: [`lifecycle`] for each process,
//! [`process_table`] for the roster, [`fault_queue`] for the faults, [`stepper`] for pauses that the user asks for.

mod fault_queue;
mod faults;
mod inbox;
mod janitor;
mod lifecycle;
mod output_keeper;
mod pause;
mod ports;
mod process_table;
mod progress;
mod seating;
mod spawner;
mod stepper;
mod supervisor;
mod viewer;

pub(crate) use progress::Progress;
pub(crate) use stepper::PauseRequest;

use inbox::Inbox;
use ports::LauncherPorts;
use ringwing_bench::MeasureArgs;
use ringwing_bus::{
    BusError, Capacity, Demand, Domain, Placement, Services, Starter, create_node,
    domain::{DomainOwner, remove_abandoned},
    usable_cores, write_whole,
};
use ringwing_flight::{Part, WorldReport};
use ringwing_programs::FindError;
use ringwing_recorder::{RecorderReport, log::run_folder};
use ringwing_scenario::{Fault, Scenario};
use ringwing_viewer::LiveAddress;
use std::{
    collections::BTreeSet,
    fs, io,
    path::PathBuf,
    time::{Duration, Instant},
};
use supervisor::Supervisor;

/// What to launch.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
pub(crate) struct Plan {
    /// The scenario to fly, validated.
    pub(crate) scenario: Scenario,
    /// The folder in which the run's own folder is made.
    pub(crate) out: PathBuf,
    /// Write a log.
    pub(crate) record: bool,
    /// Put wall-clock timing into the log.
    pub(crate) timing: bool,
    /// Processes that the user starts.
    pub(crate) by_hand: BTreeSet<Part>,
    /// Print nothing while it flies.
    pub(crate) quiet: bool,
    /// Start a recorder. Without one the flight is not measured.
    pub(crate) recorder: bool,
    /// What the world measures for a benchmark, if one runs.
    pub(crate) measure: Option<MeasureArgs>,
    /// Where and how urgently the processes run.
    pub(crate) placement: Placement,
    /// Lock the memory of the processes.
    pub(crate) lock_memory: bool,
    /// Where the flight is shown while it goes on, if it is.
    pub(crate) live: Option<LiveAddress>,
}

impl Plan {
    /// Whether the run needs the process `part`.
    fn needs(&self, part: Part) -> bool {
        part != Part::Recorder || self.recorder
    }

    /// How many threads help idle cores to take over processes from busy ones.
    fn idle_core_threads(&self) -> u32 {
        seating::idle_core_threads(&self.scenario, self.placement, usable_cores())
    }
}

/// How a run went.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// The run's folder.
    pub(crate) folder: PathBuf,
    /// What the world counted; `None` if it died.
    pub(crate) world: Option<WorldReport>,
    /// What the recorder measured; `None` if it left no report.
    pub(crate) recorder: Option<RecorderReport>,
    /// Why the run failed, if it did.
    pub(crate) failures: Vec<String>,
    /// The faults that were asked for during the flight.
    pub(crate) added_faults: Vec<Fault>,
    /// The last tick flown.
    pub(crate) ticks: i64,
    /// Wall-clock time from the first tick to the last.
    pub(crate) flight_time: Duration,
    /// Wall-clock time from the command to the first tick.
    pub(crate) start_time: Duration,
}

/// Why a run cannot begin.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LaunchError {
    /// The run's folder cannot be made or written.
    #[error("{}: cannot be written: {source}; choose another folder with --out", path.display())]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A program of the user's cannot be started.
    #[error(transparent)]
    Program(#[from] FindError),
    /// The domain cannot be made.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A process or thread cannot be started.
    #[error("{what} cannot be started: {source}{}", spawn_remedy(source))]
    Spawn {
        /// The process or thread.
        what: String,
        /// The operating system's reason.
        source: io::Error,
    },
}

/// What to do about a process or thread that cannot be started.
fn spawn_remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        // Too many processes: of this user, of its control group, or of the machine.
        io::ErrorKind::WouldBlock => {
            "; raise `ulimit -u`, start the container with a higher `--pids-limit`, or fly fewer UAVs"
        }
        io::ErrorKind::OutOfMemory => "; end other programs, or fly fewer UAVs",
        _ => "",
    }
}

/// Flies `plan` to its end, and says how it went.
pub(crate) fn launch(plan: &Plan) -> Result<Outcome, LaunchError> {
    let begin = Instant::now();
    // Open the inbox first: from here on an interrupt ends the run in order.
    let inbox = Inbox::open()?;
    // After the inbox, whose signal handlers write to a pipe, and before the services, each of which takes open files.
    let starter = Starter::start()?;
    ringwing_programs::check(&plan.scenario)?;
    // Do this before looking at the memory: what a killed run has left would be missing.
    remove_abandoned();
    // Before anything is made: a run that lacks something later ends by a signal, and says nothing.
    let demand = Demand::of(&plan.scenario, plan.recorder).with_threads(plan.idle_core_threads());
    let demand = if plan.live.is_some() { demand.with_viewer() } else { demand };
    let journal_depth = Capacity::look().admit(&demand).map_err(BusError::from)?;
    let resolved = plan.scenario.to_toml();
    let (owner, gate) = DomainOwner::create(&resolved)?;
    demand.set_aside(owner.domain(), journal_depth)?;
    // Only now: a run that is refused must not leave an empty folder.
    let folder = make_folder(plan, owner.domain())?;
    let node = create_node(owner.domain(), "launcher")?;
    // All services exist before the first process starts, so no process has to wait until another has made one.
    let services = Services::create(&node, owner.domain(), &plan.scenario, journal_depth)?;
    let ports = LauncherPorts::open(node, services)?;
    Supervisor::new(plan, owner.domain(), gate, ports, inbox, starter, &folder)?.run(begin)
}

/// Makes `<out>/<name>-<domain>/` with the resolved scenario, and a configuration with which the tool `iox2` finds the
/// run.
fn make_folder(plan: &Plan, domain: &Domain) -> Result<PathBuf, LaunchError> {
    let unwritable = |(path, source)| LaunchError::Folder { path, source };
    let folder =
        run_folder::create(&plan.out, &plan.scenario, &domain.id().to_string()).map_err(unwritable)?;
    let config = folder.join("config");
    fs::create_dir_all(&config).map_err(|error| unwritable((config.clone(), error)))?;
    let file = config.join("iceoryx2.toml");
    write_whole(&file, domain.iox2_config()).map_err(|error| unwritable((file, error)))?;
    // The link comes last, so that it never leads to a folder that lacks its files.
    run_folder::link_latest(&folder);
    Ok(folder)
}
