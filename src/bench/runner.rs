//! Measures case after case, each in a process of its own, and shows how far it has come.
//!
//! Never measures itself: this process sleeps while a case runs. Leaves nothing behind, however it ends.

use super::{
    args::Axes,
    case, hops, label, plan,
    result::{Case, Measured, Repeat, Subject},
    scratch::Scratch,
    transport::hub,
};
use crate::{launcher::LOG, placement::Placement};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ringwing_bus::{StopFlag, Trace, domain::DomainOwner};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    fs,
    io::Read,
    os::unix::process::CommandExt,
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

/// What a case may take to start and to end, beside the time that it is measured.
const OVERHEAD: Duration = Duration::from_secs(60);
/// What it may take to end once it is asked to.
const LEAVE: Duration = Duration::from_secs(12);
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// A benchmark that goes on.
pub(super) struct Runner<'a> {
    axes: &'a Axes,
    placement: &'a Placement,
    seed: u64,
    /// Where logs of flights are left.
    logs: Option<&'a Path>,
    stop: StopFlag,
    began: Instant,
    folder: Scratch,
}

impl<'a> Runner<'a> {
    pub(super) fn new(
        axes: &'a Axes,
        placement: &'a Placement,
        seed: u64,
        logs: Option<&'a Path>,
    ) -> anyhow::Result<Self> {
        // Above all: an interrupt from here on ends the benchmark in order.
        let stop = StopFlag::on_signals()?;
        let folder = Scratch::new()
            .context("no temporary folder can be made; set TMPDIR to one that can be written")?;
        Ok(Self { axes, placement, seed, logs, stop, began: Instant::now(), folder })
    }

    /// Whether the user wanted it to end before all was measured.
    pub(super) fn is_interrupted(&self) -> bool {
        self.stop.is_set()
    }

    /// Measures all cases, or what there is time for until an interrupt.
    pub(super) fn run(&self, quiet: bool) -> Vec<Measured> {
        let cases = self.axes.cases();
        let order = plan::order(cases.len(), self.axes.repeats, self.seed);
        let bar = progress(order.len() as u64, quiet);
        let mut measured: Vec<Measured> =
            cases.into_iter().map(|case| Measured { case, repeats: Vec::new(), failure: None }).collect();
        for (place, index) in order.into_iter().enumerate() {
            bar.set_message(label::case(&measured[index].case));
            bar.tick();
            match self.measure(place as u32, &measured[index].case) {
                _ if self.stop.is_set() => break,
                Ok(repeat) => measured[index].repeats.push(repeat),
                Err(error) => measured[index].failure = Some(format!("{error:#}")),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        measured
    }

    fn measure(&self, place: u32, case: &Case) -> anyhow::Result<Repeat> {
        let folder = self.folder.path().join(place.to_string());
        fs::create_dir(&folder)?;
        let began_s = self.began.elapsed().as_secs_f64();
        let trace = folder.join("trace");
        let result = self.measure_into(case, &trace);
        let logged = self.keep_log(case, &folder);
        fs::remove_dir_all(&folder)?;
        logged?;
        Ok(Repeat { place, began_s, ..result? })
    }

    fn measure_into(&self, case: &Case, path: &Path) -> anyhow::Result<Repeat> {
        // Held until the peers' stamps are read: whatever of the domain is left goes with it.
        let owner = (case.subject != Subject::Swarm).then(|| DomainOwner::create("")).transpose()?;
        let mut command = self.command(case, path);
        if let Some((owner, _)) = &owner {
            command.args(["--domain", &owner.domain().id().to_string()]);
        }
        self.wait(self.placement.around(0, || command.spawn()).context("a case cannot be started")?)?;
        let (head, mut trace) = Trace::load(path)?;
        if owner.is_some() {
            hub::gather(&mut trace, path, case.uavs)?;
        }
        anyhow::ensure!(!trace.ticks.is_empty(), "no tick began in the time that was measured");
        Ok(hops::repeat(case, &head, &trace))
    }

    fn command(&self, case: &Case, trace: &Path) -> Command {
        let mut command = Command::new("/proc/self/exe");
        command.args(["bench-case", "--case", &case::text(case), "--seed", &self.seed.to_string()]);
        command.arg("--measure-into").arg(trace);
        command.args(["--warm-up-s", &self.axes.warm_up_s.to_string()]);
        command.args(["--measure-s", &self.axes.measure_s.to_string()]);
        command.args(["--launcher", &std::process::id().to_string()]).args(self.placement.arguments());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        // A group of its own: the terminal's Ctrl-C is for the benchmark, which ends the case in order.
        command.process_group(0);
        command
    }

    /// Waits for the end of a case; one that fails says why on stderr.
    fn wait(&self, mut child: Child) -> anyhow::Result<()> {
        let mut said = child.stderr.take().context("stderr is piped")?;
        let said = thread::spawn(move || {
            let mut text = String::new();
            said.read_to_string(&mut text).map(|_| text).unwrap_or_default()
        });
        let length = Duration::from_secs_f64(self.axes.warm_up_s + self.axes.measure_s);
        let ended = self.see_out(&mut child, length + OVERHEAD)?;
        let text = said.join().unwrap_or_default();
        match ended {
            Some(status) if status.success() => Ok(()),
            Some(status) if text.trim().is_empty() => anyhow::bail!("its process ended with {status}"),
            Some(_) => anyhow::bail!("{}", reason(&text)),
            None => {
                anyhow::bail!("it took longer than {:.0} s, and was ended", (length + OVERHEAD).as_secs_f64())
            }
        }
    }

    /// How the child ended; `None` if it had to be killed.
    fn see_out(&self, child: &mut Child, limit: Duration) -> anyhow::Result<Option<ExitStatus>> {
        let since = Instant::now();
        let mut asked = None;
        loop {
            if let Some(status) = child.try_wait()? {
                return Ok(Some(status));
            }
            if asked.is_none() && (self.stop.is_set() || since.elapsed() > limit) {
                asked = Some(Instant::now());
                ask_to_leave(child.id());
            }
            if asked.is_some_and(|asked| asked.elapsed() > LEAVE) {
                child.kill()?;
                child.wait()?;
                return Ok(None);
            }
            thread::sleep(LOOK_AGAIN);
        }
    }

    /// Leaves the log of the first flight of `case` where the user wants it.
    fn keep_log(&self, case: &Case, folder: &Path) -> anyhow::Result<()> {
        let Some(logs) = self.logs.filter(|_| case.recorder) else { return Ok(()) };
        let to = logs.join(format!("{}.mcap", label::file(case)));
        let flights = fs::read_dir(folder)?.flatten().map(|entry| entry.path().join(LOG));
        if let Some(log) = flights.into_iter().find(|log| log.exists()).filter(|_| !to.exists()) {
            fs::copy(&log, &to).with_context(|| format!("{} cannot be written", to.display()))?;
        }
        Ok(())
    }
}

/// Lines of what a case says that are shown of one that fails.
const REASON_LINES: usize = 3;

/// The first of what was said on stderr: all peers of a hub that fails say so.
fn reason(said: &str) -> String {
    let mut lines = said.lines().map(|line| line.trim_start_matches("ringwing: ").trim());
    let first: Vec<&str> = lines.by_ref().filter(|line| !line.is_empty()).take(REASON_LINES).collect();
    match lines.count() {
        0 => first.join("; "),
        more => format!("{}; and {more} more lines", first.join("; ")),
    }
}

fn ask_to_leave(process: u32) {
    if let Some(pid) = Pid::from_raw(process.cast_signed()) {
        // It may have ended at this moment.
        let _ = kill_process(pid, Signal::TERM);
    }
}

fn progress(length: u64, quiet: bool) -> ProgressBar {
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
    fn of_many_reasons_the_first_are_shown() {
        assert_eq!(reason("ringwing: bench: no place\n"), "bench: no place");
        assert_eq!(reason("ringwing: a\n\nb\nc\nd\ne\n"), "a; b; c; and 2 more lines");
    }
}
