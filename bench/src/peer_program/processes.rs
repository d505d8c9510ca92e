//! The processes of a peer program: starting them, telling them when to measure, and ending them.
//!
//! The world says on stdout when the warm-up and the measured time are over, and waits each time until this process has
//! read what all processes have used.
//!
//! Must never leave a process behind, however a case ends.

use super::{
    program::PeerProgram,
    records::{RecordFiles, WORLD_FILE, agent_file},
};
use crate::{
    case::{Case, Load},
    error::BenchError,
    measure::MeasureArgs,
    proc_files::{pss_bytes, usage_of},
    trace::TraceHead,
    transport::MessageSizes,
    usage::ProcessUsage,
};
use ringwing_bus::{Patience, Placement, monotonic_ns};
use rustix::process::{Pid, Signal, kill_process_group};
use std::{
    fs,
    io::{BufRead, BufReader, Write},
    os::unix::process::CommandExt,
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    thread,
    time::{Duration, Instant},
};

/// Time that a program may take for what it does in the same time for any number of agents, such as ending a measurement.
/// Shorter fails programs on an overloaded machine; longer delays the report of one that hangs.
const PATIENCE: Duration = Duration::from_secs(10);
/// Further time for each process to start or to end. Shorter fails large swarms of programs with an interpreter.
const PATIENCE_PER_PROCESS: Duration = Duration::from_millis(200);
/// Pause between two looks at the processes. Longer delays the report of a lost one; shorter disturbs what is measured.
const POLL_PERIOD: Duration = Duration::from_millis(20);

/// What the world prints when the warm-up is over.
const WARM: &str = "warm";
/// What the world prints when the measured time is over.
const DONE: &str = "done";

/// Measures `case` with `program`, and writes the trace to the file that `measure` names.
pub(crate) fn run(
    case: &Case,
    program: &PeerProgram,
    measure: &MeasureArgs,
    placement: Placement,
) -> Result<(), BenchError> {
    let no_file = || BenchError::case("a peer program needs --measure-into");
    let path = measure.measure_into.as_deref().ok_or_else(no_file)?;
    let folder = path.parent().ok_or_else(no_file)?;
    let (warm_up_s, measure_s) =
        (measure.warm_up_s.unwrap_or_default(), measure.measure_s.unwrap_or_default());
    let contract = Contract { case, folder, warm_up_s, measure_s };
    let mut processes = Processes::start(program, &contract, placement)?;
    let head = processes.measure(&contract)?;
    processes.wait_until_ended()?;
    let trace = read(case, folder)?.trace(case, &head).map_err(BenchError::Case)?;
    Ok(trace.save(path, &head)?)
}

fn read(case: &Case, folder: &Path) -> Result<RecordFiles, BenchError> {
    let read = |name: String| {
        fs::read(folder.join(&name)).map_err(|why| BenchError::case(format!("{name}: cannot be read: {why}")))
    };
    Ok(RecordFiles {
        world: read(WORLD_FILE.into())?,
        agents: (1..=case.uavs as usize).map(|uav| read(agent_file(uav))).collect::<Result<_, _>>()?,
    })
}

/// What the processes are told.
struct Contract<'a> {
    case: &'a Case,
    folder: &'a Path,
    warm_up_s: f64,
    measure_s: f64,
}

impl Contract<'_> {
    /// The arguments of the agent of `uav`, or of the world.
    fn arguments(&self, uav: Option<u32>) -> Vec<String> {
        let sizes = MessageSizes::hub_to_peer(self.case);
        let rate_hz = match self.case.load {
            Load::Closed => 0,
            Load::Paced(rate_hz) => rate_hz,
        };
        let role = if uav.is_some() { "agent" } else { "world" };
        let all = [
            ("--role", role.to_owned()),
            ("--dir", self.folder.display().to_string()),
            ("--uavs", self.case.uavs.to_string()),
            ("--rate", rate_hz.to_string()),
            ("--warm-up", self.warm_up_s.to_string()),
            ("--seconds", self.measure_s.to_string()),
            ("--bytes-out", sizes.outgoing.to_string()),
            ("--bytes-back", sizes.incoming.to_string()),
        ];
        let uav = uav.map(|uav| ("--uav", uav.to_string()));
        all.into_iter().chain(uav).flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }
}

/// The processes of a program; all are killed when this is dropped.
struct Processes {
    /// The world, then the agents by number.
    children: Vec<Child>,
    /// What the world prints, line by line.
    lines: Receiver<String>,
}

impl Processes {
    fn start(
        program: &PeerProgram,
        contract: &Contract<'_>,
        placement: Placement,
    ) -> Result<Self, BenchError> {
        let (sender, lines) = channel();
        let mut processes = Self { children: Vec::new(), lines };
        for place in 0..=contract.case.uavs {
            let uav = Some(place).filter(|place| *place > 0);
            let mut command = command(program, contract, uav);
            let child = placement.start(place as usize, || command.spawn());
            processes.children.push(child.map_err(BenchError::system("a peer cannot be started"))?);
        }
        // A thread reads the lines, because reading blocks, and meanwhile all processes have to be watched.
        if let Some(stdout) = processes.children[0].stdout.take() {
            let lines = BufReader::new(stdout).lines().map_while(Result::ok);
            thread::spawn(move || lines.map(|line| sender.send(line)).all(|sent| sent.is_ok()));
        }
        Ok(processes)
    }

    /// Lets the world warm up and measure; returns what the processes used meanwhile.
    fn measure(&mut self, contract: &Contract<'_>) -> Result<TraceHead, BenchError> {
        let start = PATIENCE + PATIENCE_PER_PROCESS * self.children.len() as u32;
        self.wait_for_line(WARM, Duration::from_secs_f64(contract.warm_up_s) + start)?;
        // Read while the world waits for its answer: no tick runs then, so the readings cut none in two.
        let used_before = self.usage();
        let began_ns = monotonic_ns();
        self.let_world_go_on()?;
        self.wait_for_line(DONE, Duration::from_secs_f64(contract.measure_s) + PATIENCE)?;
        let head = TraceHead {
            began_ns,
            ended_ns: monotonic_ns(),
            used: self.usage() - used_before,
            agent_pss_bytes: self.children[1..].iter().map(|child| pss_bytes(child.id())).max().unwrap_or(0),
            ..TraceHead::default()
        };
        self.let_world_go_on()?;
        Ok(head)
    }

    fn usage(&self) -> ProcessUsage {
        self.children.iter().map(|child| usage_of(child.id())).sum()
    }

    fn wait_for_line(&mut self, expected: &str, limit: Duration) -> Result<(), BenchError> {
        let since = Instant::now();
        while since.elapsed() < limit {
            match self.lines.recv_timeout(POLL_PERIOD) {
                Ok(line) if line == expected => return Ok(()),
                Ok(line) => {
                    let why = format!("the world printed {line:?} where `{expected}` was expected");
                    return Err(BenchError::Case(why));
                }
                Err(RecvTimeoutError::Timeout) => {}
                // The world is ending, or has closed its stdout.
                Err(RecvTimeoutError::Disconnected) => thread::sleep(POLL_PERIOD),
            }
            self.check_all_are_running()?;
        }
        let limit_s = limit.as_secs_f64();
        Err(BenchError::case(format!("the world did not print `{expected}` within {limit_s:.1} s")))
    }

    fn check_all_are_running(&mut self) -> Result<(), BenchError> {
        for (place, child) in self.children.iter_mut().enumerate() {
            if let Some(status) = ended(child)? {
                return Err(BenchError::case(format!("{} ended early: {status}", name(place))));
            }
        }
        Ok(())
    }

    /// Answers a line of the world.
    fn let_world_go_on(&mut self) -> Result<(), BenchError> {
        let stdin = self.children[0].stdin.as_mut();
        let answered = stdin.map_or(Ok(()), |stdin| stdin.write_all(b"go\n"));
        answered.map_err(BenchError::system("the world has closed its stdin"))
    }

    /// Waits until all processes have written their timestamps and ended.
    fn wait_until_ended(mut self) -> Result<(), BenchError> {
        let limit = PATIENCE + PATIENCE_PER_PROCESS * self.children.len() as u32;
        let mut patience = Patience::of(limit);
        for (place, child) in self.children.iter_mut().enumerate() {
            let status = loop {
                if let Some(status) = ended(child)? {
                    break status;
                }
                if patience.is_over() {
                    let limit_s = limit.as_secs();
                    return Err(BenchError::case(format!("{} did not end within {limit_s} s", name(place))));
                }
                thread::sleep(POLL_PERIOD);
            };
            if !status.success() {
                return Err(BenchError::case(format!("{} failed: {status}", name(place))));
            }
        }
        Ok(())
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for child in &mut self.children {
            // The number of a process that has ended may belong to a group of somebody else by now.
            let is_running = child.try_wait().is_ok_and(|status| status.is_none());
            if let Some(group) = Pid::from_raw(child.id().cast_signed()).filter(|_| is_running) {
                let _ = kill_process_group(group, Signal::KILL);
                let _ = child.wait();
            }
        }
    }
}

fn command(program: &PeerProgram, contract: &Contract<'_>, uav: Option<u32>) -> Command {
    let mut command = Command::new("/proc/self/exe");
    command.args(["exec", "--launcher", &std::process::id().to_string(), "--"]);
    command.args(&program.command).args(contract.arguments(uav));
    // In a process group of its own, so that what it starts can be killed with it.
    command.stdin(Stdio::null()).stdout(Stdio::null()).process_group(0);
    // Only the world reports and waits for answers. An agent that prints must not fill a pipe that nobody reads.
    if uav.is_none() {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
    }
    command
}

/// Who the process at `place` is, in words.
fn name(place: usize) -> String {
    if place == 0 { "the world".into() } else { format!("the agent of uav {place}") }
}

fn ended(child: &mut Child) -> Result<Option<ExitStatus>, BenchError> {
    child.try_wait().map_err(BenchError::system("a peer is lost"))
}
