//! Starts the processes of a run, and sends them signals.
//!
//! Must never wait for a process: its start and its end are reported to the [inbox](super::inbox) later.

use super::{LaunchError, Plan, lifecycle::ProcessSignal, output_keeper::OutputKeeper, seating};
use ringwing_bench::MeasureArgs;
use ringwing_bus::{
    DomainId, Placement, Starter, close_files_on_spawn, usable_cores, without_restartable_sequences,
};
use ringwing_flight::{Part, UavId};
use ringwing_programs::UNBUFFERED;
use ringwing_scenario::AgentSection;
use ringwing_study::shell::quoted;
use ringwing_viewer::LiveAddress;
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use std::{
    io,
    os::unix::process::CommandExt,
    path::PathBuf,
    process::{ChildStdout, Command, Stdio},
    time::SystemTime,
};

/// Threads with which the viewer serves its clients. More take cores from the flight; fewer let one large client delay another.
const VIEWER_THREADS: &str = "2";

/// Starts the processes of one run.
#[derive(Debug)]
pub(super) struct Spawner<'a> {
    plan: &'a Plan,
    domain: DomainId,
    /// Where the recorder writes its log, if it writes one.
    log: Option<PathBuf>,
    /// Where all processes but the recorder run.
    swarm: Placement,
    /// What the programs of the user's print.
    output: OutputKeeper,
    starter: Starter,
    /// When the run was started, for the log of every recorder of the run.
    started_at: String,
}

impl<'a> Spawner<'a> {
    /// A spawner for the run of `plan` in `domain`, whose recorder writes to `log` and whose programs print into `output`.
    pub(super) fn new(
        plan: &'a Plan,
        domain: &DomainId,
        log: Option<PathBuf>,
        output: OutputKeeper,
        starter: Starter,
    ) -> Self {
        // To the millisecond: the flight begins a fraction of a second later.
        let started_at = humantime::format_rfc3339_millis(SystemTime::now()).to_string();
        let swarm = match log {
            Some(_) => seating::beside_a_recorder(&plan.scenario, plan.placement, usable_cores()),
            None => plan.placement,
        };
        Self { plan, domain: domain.clone(), log, swarm, output, starter, started_at }
    }

    /// How many cores the processes share that step through time.
    pub(super) fn swarm_cores(&self) -> u32 {
        self.swarm.shared_cores(usable_cores())
    }

    /// What a user types to start `part` by hand.
    pub(super) fn command_line(&self, part: Part) -> String {
        let arguments = self.arguments(part).join(" ");
        match self.own_program(part) {
            Some((_, own)) => format!("cd {} && {} {arguments}", quoted(&own.folder), own.command_line()),
            None => format!("ringwing {arguments}"),
        }
    }

    /// The program of the user's that flies as `part`, and its UAV.
    pub(super) fn own_program(&self, part: Part) -> Option<(UavId, &'a AgentSection)> {
        let Part::Agent(uav) = part else { return None };
        Some((uav, self.plan.scenario.agent_of(uav)?))
    }

    /// What the programs of the user's print.
    pub(super) fn output(&self) -> &OutputKeeper {
        &self.output
    }

    /// Starts the process `part`; returns its id.
    pub(super) fn spawn(&mut self, part: Part) -> Result<u32, LaunchError> {
        let mut arguments = self.arguments(part);
        arguments.extend(["--launcher".into(), std::process::id().to_string()]);
        let mut command = Self::command();
        let pipe = if let Some((uav, own)) = self.own_program(part) {
            become_program(&mut command, own, &arguments);
            Some(self.output.pipe(uav))
        } else {
            command.args(self.plan.lock_memory.then_some("--lock-memory")).args(arguments);
            None
        };
        let (variable, value) = without_restartable_sequences();
        command.env(variable, value);
        let failed = move |source| LaunchError::Spawn { what: part.to_string(), source };
        let placement = if part == Part::Recorder { self.plan.placement } else { self.swarm };
        let start = move || {
            let reader = pipe.map(|pipe| pipe.open(&mut command)).transpose()?;
            let child = placement.start(part.index(), || command.spawn()).map_err(failed)?;
            Ok((child.id(), reader))
        };
        let (pid, reader) = self.starter.run(start).map_err(failed).flatten()?;
        if let Some(reader) = reader {
            self.output.add(reader);
        }
        Ok(pid)
    }

    /// Starts the viewer, which is to listen at `address`; returns its id, and what it prints.
    pub(super) fn spawn_viewer(&self, address: &LiveAddress) -> Result<(u32, ChildStdout), LaunchError> {
        let mut command = Self::command();
        command
            .args(["viewer", "--domain", &self.domain.to_string(), "--address", &address.to_string()])
            .args(["--launcher", &std::process::id().to_string()])
            // Its runtime would start a thread for each core, and the flight needs the cores.
            .env("TOKIO_WORKER_THREADS", VIEWER_THREADS)
            .stdout(Stdio::piped());
        close_files_on_spawn();
        let failed = |source| LaunchError::Spawn { what: "the viewer".into(), source };
        let mut child = command.spawn().map_err(failed)?;
        let lines = child.stdout.take().ok_or_else(|| failed(io::ErrorKind::BrokenPipe.into()))?;
        Ok((child.id(), lines))
    }

    /// A process of this program, without arguments.
    fn command() -> Command {
        // Do not use the path of this program: a new build may replace the file during the run.
        let mut command = Command::new("/proc/self/exe");
        // Use a process group of its own, so that the terminal's Ctrl-C reaches the launcher alone. The launcher then ends
        // the others in order.
        command.arg0("ringwing").stdin(Stdio::null()).stdout(Stdio::null()).process_group(0);
        command
    }

    /// The arguments of the process `part`.
    fn arguments(&self, part: Part) -> Vec<String> {
        let mut arguments: Vec<String> = match part {
            Part::World => vec!["world".into()],
            Part::Leader => vec!["leader".into()],
            Part::Recorder => vec!["recorder".into()],
            Part::Agent(uav) => vec!["agent".into(), "--uav".into(), uav.0.to_string()],
        };
        arguments.extend(["--domain".into(), self.domain.to_string()]);
        match part {
            Part::Recorder => arguments.extend(self.log_arguments()),
            Part::World => arguments.extend(self.plan.measure.iter().flat_map(MeasureArgs::to_arguments)),
            Part::Leader | Part::Agent(_) => {}
        }
        arguments
    }

    fn log_arguments(&self) -> Vec<String> {
        let Some(log) = &self.log else { return Vec::new() };
        let mut arguments = vec!["--log".into(), log.display().to_string()];
        if !self.plan.timing {
            arguments.push("--no-timing".into());
        } else if self.plan.scenario.time.real_time {
            // A flight in lockstep has no time of day.
            arguments.extend(["--started-at".into(), self.started_at.clone()]);
        }
        arguments
    }
}

/// Sends `signal` to the process `pid`, and to the processes that it has started if `with_children`.
pub(super) fn send_signal(pid: u32, signal: ProcessSignal, with_children: bool) {
    let signal = match signal {
        ProcessSignal::Kill => Signal::KILL,
        ProcessSignal::Terminate => Signal::TERM,
        ProcessSignal::Stop => Signal::STOP,
        ProcessSignal::Continue => Signal::CONT,
    };
    // Zero would mean the launcher's own process group, so it is no process here.
    if let Some(pid) = Pid::from_raw(pid.cast_signed()) {
        // A process that has just ended gets no signal. The notice of its end is on its way.
        let _ = if with_children { kill_process_group(pid, signal) } else { kill_process(pid, signal) };
    }
}

/// Makes `command`, which starts this executable, become the program of `section` with `arguments` added.
fn become_program(command: &mut Command, section: &AgentSection, arguments: &[String]) {
    // The program may not know how to end with its launcher, so `ringwing exec` arranges that and becomes the program.
    let launcher = std::process::id().to_string();
    command
        .args(["exec", "--launcher", &launcher, "--folder", &section.folder, "--"])
        .args(&section.command)
        .args(arguments)
        .env(UNBUFFERED.0, UNBUFFERED.1);
}
