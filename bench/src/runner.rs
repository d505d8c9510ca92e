//! Measures all cases one after the other, each in a process of its own, and shows the progress.
//!
//! Must never measure anything itself: this process sleeps while a case runs. Must never leave anything behind, however the
//! benchmark ends.

use crate::{
    args::PlacementArgs,
    axes::Axes,
    case::{Carrier, Case},
    case_args::{CaseArgs, FLIGHT_LOG},
    error::BenchError,
    hops, label,
    measure::MeasureArgs,
    order::order,
    result::{Measured, Repeat},
    scratch::Scratch,
    standstill::StoppedCase,
    trace::Trace,
    transport::hub,
};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_bus::{
    DomainOwner, Patience, StopFlag, SuspendFlag, copy_whole, stop_self, without_restartable_sequences,
};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    cell::Cell,
    fs,
    io::Read,
    os::unix::process::CommandExt,
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

/// Time that a case may take to start and to end, on top of its measured time. Shorter fails large swarms on slow machines.
const OVERHEAD: Duration = Duration::from_secs(60);
/// What each UAV adds to that time: a process more starts, and leaves. Shorter fails large swarms on slow machines.
const OVERHEAD_PER_UAV: Duration = Duration::from_millis(100);
/// Time that a case may take to end after a request; then it is killed. A flight itself gives its processes 10 s, so a
/// shorter time kills flights that end in order; a longer one delays the user's interrupt.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(12);
/// Pause between two looks at the case. Shorter would disturb the measurement, longer slows down a benchmark of many cases.
const POLL_PERIOD: Duration = Duration::from_millis(5);

/// A benchmark that is running.
pub(crate) struct Runner<'a> {
    axes: &'a Axes,
    placement: &'a PlacementArgs,
    seed: u64,
    /// The folder for logs of flights, if the user wants them.
    logs: Option<&'a Path>,
    stop: StopFlag,
    suspend: SuspendFlag,
    /// Whether the case stood still that is measured.
    stood_still: Cell<bool>,
    began: Instant,
    folder: Scratch,
}

impl<'a> Runner<'a> {
    pub(crate) fn new(
        axes: &'a Axes,
        placement: &'a PlacementArgs,
        seed: u64,
        logs: Option<&'a Path>,
    ) -> Result<Self, BenchError> {
        // Before anything else: from here on, an interrupt ends the benchmark in order.
        let (stop, suspend) = (StopFlag::on_signals()?, SuspendFlag::on_signal()?);
        let folder = Scratch::new().map_err(BenchError::system(
            "no temporary folder can be created; set TMPDIR to a writable folder",
        ))?;
        Ok(Self {
            axes,
            placement,
            seed,
            logs,
            stop,
            suspend,
            stood_still: Cell::new(false),
            began: Instant::now(),
            folder,
        })
    }

    /// Whether the user ended the benchmark early.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.stop.is_set()
    }

    /// Measures all cases, or until the user interrupts.
    pub(crate) fn run(&self, quiet: bool) -> Vec<Measured> {
        let cases = self.axes.cases();
        let order = order(cases.len(), self.axes.repeats, self.seed);
        let bar = progress_bar(order.len() as u64, quiet);
        let mut measured: Vec<Measured> =
            cases.into_iter().map(|case| Measured { case, repeats: Vec::new(), failure: None }).collect();
        for (place, index) in order.into_iter().enumerate() {
            bar.set_message(label::case(&measured[index].case));
            bar.tick();
            match self.measure_awake(place as u32, &measured[index].case) {
                // What an interrupted case reports is incomplete.
                _ if self.stop.is_set() => break,
                Ok(repeat) => measured[index].repeats.push(repeat),
                Err(error) => measured[index].failure = Some(error.to_string()),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        measured
    }

    /// Measures `case`, and again if the user has let it stand still: its ticks took as long as that.
    fn measure_awake(&self, place: u32, case: &Case) -> Result<Repeat, BenchError> {
        loop {
            self.stood_still.set(false);
            let measured = self.measure(place, case);
            if !self.stood_still.get() || self.stop.is_set() {
                return measured;
            }
        }
    }

    fn measure(&self, place: u32, case: &Case) -> Result<Repeat, BenchError> {
        let folder = self.folder.path().join(place.to_string());
        fs::create_dir(&folder).map_err(BenchError::file(&folder, "created"))?;
        let began_s = self.began.elapsed().as_secs_f64();
        let result = self.measure_in(case, &folder);
        let kept = self.keep_log(case, &folder);
        // Traces are large: remove each before the next case, even if this one failed.
        fs::remove_dir_all(&folder).map_err(BenchError::file(&folder, "removed"))?;
        kept?;
        Ok(Repeat { place, began_s, ..result? })
    }

    fn measure_in(&self, case: &Case, folder: &Path) -> Result<Repeat, BenchError> {
        let path = folder.join("trace");
        let peer = self.axes.program(&case.carrier);
        let needs_domain = case.carrier != Carrier::Swarm && peer.is_none();
        // Owned here until the peers' traces are read, so that a killed hub leaves nothing in shared memory.
        let owner = needs_domain.then(|| DomainOwner::create("")).transpose()?;
        let mut command = command(&CaseArgs {
            case: case.clone(),
            seed: self.seed,
            domain: owner.as_ref().map(|(owner, _)| owner.domain().id().clone()),
            peer: peer.cloned(),
            measure: MeasureArgs {
                measure_into: Some(path.clone()),
                warm_up_s: Some(self.axes.warm_up_s),
                measure_s: Some(self.axes.measure_s),
            },
            placement: self.placement.clone(),
            launcher: std::process::id(),
        });
        // Not pinned here: the case pins its processes itself, and they would all inherit the one core of this process.
        let child = command.spawn();
        let limit = self.time_limit(case);
        self.wait(child.map_err(BenchError::system("a case cannot be started"))?, limit)?;
        let (head, mut trace) = Trace::load(&path)?;
        if owner.is_some() {
            hub::add_peers(&mut trace, &path, case.uavs)?;
        }
        if trace.ticks.is_empty() {
            return Err(BenchError::case("no tick began in the measured time"));
        }
        Ok(hops::repeat(case, &head, &trace))
    }

    /// How long `case` may take.
    fn time_limit(&self, case: &Case) -> Duration {
        Duration::from_secs_f64(self.axes.warm_up_s + self.axes.measure_s)
            + OVERHEAD
            + OVERHEAD_PER_UAV * case.uavs
    }

    /// Waits until a case ends, at most for `limit`. A case that fails gives its reason on stderr.
    fn wait(&self, mut child: Child, limit: Duration) -> Result<(), BenchError> {
        let mut stderr = child.stderr.take();
        // Read while waiting: a full pipe would block the case.
        let reader = thread::spawn(move || {
            let mut text = String::new();
            if let Some(stderr) = &mut stderr {
                // If stderr cannot be read, only the reason is missing from the report.
                let _ = stderr.read_to_string(&mut text);
            }
            text
        });
        let ended = self.wait_within(&mut child, limit).map_err(BenchError::system("a case is lost"))?;
        let said = reader.join().unwrap_or_default();
        match ended {
            Some(status) if status.success() => Ok(()),
            Some(status) if said.trim().is_empty() => {
                Err(BenchError::case(format!("its process ended with {status}")))
            }
            Some(_) => Err(BenchError::case(reason(&said))),
            None => Err(BenchError::case(format!(
                "it took longer than {:.0} s and was killed: measure fewer UAVs, or end other programs",
                limit.as_secs_f64()
            ))),
        }
    }

    /// Waits for `child`, asks it to end after `limit` or an interrupt, and kills it if it does not.
    ///
    /// Returns how it ended, or `None` if it was killed.
    fn wait_within(&self, child: &mut Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
        let (mut patience, mut patience_to_leave) = (Patience::of(limit), None);
        loop {
            if let Some(status) = child.try_wait()? {
                return Ok(Some(status));
            }
            if self.suspend.take() {
                let case = StoppedCase::stop(child.id());
                stop_self();
                case.go_on();
                self.stood_still.set(true);
            }
            if patience_to_leave.is_none() && (self.stop.is_set() || patience.is_over()) {
                patience_to_leave = Some(Patience::of(LEAVE_TIMEOUT));
                ask_to_end(child.id());
            }
            if patience_to_leave.as_mut().is_some_and(Patience::is_over) {
                child.kill()?;
                child.wait()?;
                return Ok(None);
            }
            thread::sleep(POLL_PERIOD);
        }
    }

    /// Copies the log of the first flight of `case` to the user's folder.
    fn keep_log(&self, case: &Case, folder: &Path) -> Result<(), BenchError> {
        let Some(logs) = self.logs.filter(|_| case.recorder) else { return Ok(()) };
        let (from, to) = (folder.join(FLIGHT_LOG), logs.join(format!("{}.mcap", label::file(case))));
        if from.exists() && !to.exists() {
            copy_whole(&from, &to).map_err(BenchError::file(&to, "written"))?;
        }
        Ok(())
    }
}

fn command(args: &CaseArgs) -> Command {
    let mut command = Command::new("/proc/self/exe");
    command.arg("bench-case").args(args.to_arguments());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    // Whoever forces colours wants them on the terminal, not in the reason of a failed case.
    command.env("NO_COLOR", "1");
    // The processes of a swarm have this setting, which makes context switches faster. To be fair, hubs, peers and the user's
    // programs inherit it.
    let (variable, value) = without_restartable_sequences();
    command.env(variable, value);
    // In a process group of its own: the terminal sends Ctrl-C to the benchmark alone, which ends the case in order.
    command.process_group(0);
    command
}

/// Most lines that are quoted from the stderr of a failed case; a hub's peers all complain about the same problem.
const REASON_LINES: usize = 3;
/// How ringwing's own processes begin a line on stderr.
const OWN_LINE: &str = "error: ";

/// The first lines of what a failed case wrote to stderr, as one line: those of ringwing first, then those of the user's
/// program.
fn reason(said: &str) -> String {
    let lines = || said.lines().map(str::trim).filter(|line| !line.is_empty());
    let own = lines().filter_map(|line| line.strip_prefix(OWN_LINE));
    let mut all = own.chain(lines().filter(|line| !line.starts_with(OWN_LINE)));
    let first: Vec<&str> = all.by_ref().take(REASON_LINES).collect();
    match all.count() {
        0 => first.join("; "),
        more => format!("{}; and {more} more lines", first.join("; ")),
    }
}

fn ask_to_end(process: u32) {
    if let Some(pid) = Pid::from_raw(process.cast_signed()) {
        // It may have ended just now; its exit status will tell.
        let _ = kill_process(pid, Signal::TERM);
    }
}

fn progress_bar(length: u64, quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len}, {eta} left: {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_first_reasons_are_quoted() {
        assert_eq!(reason("error: bench: no place\n"), "bench: no place");
        assert_eq!(reason("error: a\n\nb\nc\nd\ne\n"), "a; b; c; and 2 more lines");
        assert_eq!(reason("Traceback\nerror: the world failed\n"), "the world failed; Traceback");
    }
}
