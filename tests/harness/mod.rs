//! Flies swarms for the tests: starts the real command, watches it, and leaves nothing behind.

pub mod bench;
pub mod log;

use ringwing_bus::{Domain, DomainId, Gate};
use ringwing_flight::{Part, Tick};
use ringwing_scenario::Scenario;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

/// No run of a test takes longer, unless it hangs.
const LONGEST: Duration = Duration::from_secs(120);

/// The command under test.
pub fn ringwing() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ringwing"))
}

/// A run that is being put together.
pub struct Swarm {
    command: Command,
    out: tempfile::TempDir,
}

impl Swarm {
    /// A run of the scenario with this name or path, in a folder of its own.
    pub fn fly(scenario: &str) -> Self {
        Self::in_folder(tempfile::tempdir().expect("a temporary folder"), Path::new(scenario))
    }

    /// A run of `scenario`, from a file in the run's folder.
    pub fn fly_scenario(scenario: &Scenario) -> Self {
        let out = tempfile::tempdir().expect("a temporary folder");
        let path = out.path().join("scenario.toml");
        fs::write(&path, scenario.to_toml()).expect("the file is written");
        Self::in_folder(out, &path)
    }

    fn in_folder(out: tempfile::TempDir, scenario: &Path) -> Self {
        let mut command = ringwing();
        command.arg("run").arg(scenario).arg("--out").arg(out.path());
        Self { command, out }
    }

    /// With these arguments too, separated by spaces.
    pub fn with(mut self, arguments: &str) -> Self {
        self.command.args(arguments.split_whitespace());
        self
    }

    /// With this fault too.
    pub fn fault(mut self, sentence: &str) -> Self {
        self.command.args(["--fault", sentence]);
        self
    }

    /// Starts it.
    pub fn start(mut self) -> Running {
        let mut child = self
            .command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("ringwing starts");
        let lines = lines_of(&mut child);
        let mut running =
            Running { child, lines, said: Vec::new(), domain: None, folder: PathBuf::new(), out: self.out };
        running.learn_where();
        running
    }

    /// Flies it to its end.
    pub fn finish(self) -> Finished {
        self.start().finish()
    }
}

fn lines_of(child: &mut Child) -> Receiver<String> {
    let (sender, receiver) = channel();
    let stderr = BufReader::new(child.stderr.take().expect("stderr is piped"));
    thread::spawn(move || stderr.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    receiver
}

/// A run that goes on.
pub struct Running {
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
    domain: Option<Domain>,
    /// The run's folder.
    pub folder: PathBuf,
    out: tempfile::TempDir,
}

impl Running {
    fn learn_where(&mut self) {
        let line = self.wait_for_line("ringwing: domain ");
        let (id, folder) =
            line["ringwing: domain ".len()..].split_once(", folder ").expect("domain and folder");
        self.folder = folder.into();
        let id: DomainId = id.parse().expect("a domain's name");
        self.domain = Domain::join(&id).ok();
    }

    /// The run's place in shared memory.
    pub fn domain(&self) -> &Domain {
        self.domain.as_ref().expect("the run goes on")
    }

    fn gate(&self) -> Gate {
        self.domain().gate().expect("the run's gate")
    }

    /// The process id of the launcher.
    pub fn launcher(&self) -> u32 {
        self.child.id()
    }

    /// The process that flies `part`, once it is ready.
    pub fn process(&self, part: Part) -> u32 {
        let gate = self.gate();
        wait_until(&format!("{part} is ready"), || gate.ready_process(part))
    }

    /// Sends `signal` to `part`; returns the process that got it.
    pub fn signal(&self, part: Part, signal: Signal) -> u32 {
        let process = self.process(part);
        send(process, signal);
        process
    }

    /// Waits until the flight has come to `seconds`, at 100 Hz.
    pub fn wait_for_second(&self, seconds: f64) {
        let gate = self.gate();
        let tick = Tick((seconds * 100.0) as i64);
        wait_until(&format!("the flight comes to {seconds} s"), || {
            (gate.is_closed() || gate.tick().is_some_and(|now| now >= tick)).then_some(())
        });
    }

    /// Waits until the run says something that contains `text` on stderr; returns that line.
    pub fn wait_for_line(&mut self, text: &str) -> String {
        let start = Instant::now();
        loop {
            let Ok(line) = self.lines.recv_timeout(LONGEST.saturating_sub(start.elapsed())) else {
                panic!("the run never said {text:?}, but:\n{}", self.said.join("\n"));
            };
            self.said.push(line.clone());
            if line.contains(text) {
                return line;
            }
        }
    }

    /// Waits for the end of the command, and of everything that it left.
    pub fn finish(mut self) -> Finished {
        let status =
            wait_until("the run ends", || self.child.try_wait().expect("the child can be waited for"));
        while let Ok(line) = self.lines.recv_timeout(Duration::from_secs(5)) {
            self.said.push(line);
        }
        let id = self.domain.take().map(|domain| domain.id().clone());
        let summary = fs::read(self.folder.join("summary.json")).ok();
        let out = std::mem::replace(&mut self.out, tempfile::tempdir().expect("a temporary folder"));
        Finished {
            status,
            summary: summary.map_or(Value::Null, |text| serde_json::from_slice(&text).expect("JSON")),
            stderr: std::mem::take(&mut self.said).join("\n"),
            folder: self.folder.clone(),
            domain: id.expect("the run had a domain"),
            _out: out,
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("--- the run said:\n{}", self.said.join("\n"));
        }
        // Killing the launcher ends its processes; what it left in shared memory the next run or `clean` removes.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A run that has ended.
pub struct Finished {
    /// How the command ended.
    pub status: ExitStatus,
    /// Its `summary.json`, or null.
    pub summary: Value,
    /// What it said on stderr.
    pub stderr: String,
    /// Its folder.
    pub folder: PathBuf,
    domain: DomainId,
    _out: tempfile::TempDir,
}

impl Finished {
    /// The number at `key` of the summary.
    pub fn number(&self, key: &str) -> f64 {
        self.summary[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {:#}", self.summary))
    }

    /// The text at `key` of the summary.
    pub fn text(&self, key: &str) -> &str {
        self.summary[key].as_str().unwrap_or_else(|| panic!("no text {key} in {:#}", self.summary))
    }

    /// The run's log.
    pub fn log(&self) -> log::Log {
        log::Log::read(&self.folder.join("run.mcap"))
    }

    /// Demands this exit code, and that nothing is left of the run.
    pub fn assert_ended_with(&self, code: i32) -> &Self {
        assert_eq!(self.status.code(), Some(code), "{}\n{:#}", self.stderr, self.summary);
        self.assert_nothing_left();
        self
    }

    /// Demands that no process, no shared memory and no temporary file of the run is left.
    pub fn assert_nothing_left(&self) {
        wait_until_gone(&self.domain);
    }
}

/// Waits until no process, no shared memory and no temporary file of `domain` is left; a killed process takes a moment.
pub fn wait_until_gone(domain: &DomainId) {
    let start = Instant::now();
    loop {
        let left = leftovers(domain);
        if left.is_empty() {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(5), "left behind: {left:?}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// What is left of a run.
pub fn leftovers(domain: &DomainId) -> Vec<String> {
    let mut left = processes_of(domain);
    for folder in ["/dev/shm", "/tmp"] {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let ours = format!("ringwing_{domain}");
        left.extend(
            entries.map(|entry| entry.path().display().to_string()).filter(|path| path.contains(&ours)),
        );
    }
    left
}

/// The processes of a run, each as its id and its command line.
pub fn processes_of(domain: &DomainId) -> Vec<String> {
    let wanted = format!("--domain\0{domain}\0");
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let command_line = |path: &Path| fs::read_to_string(path.join("cmdline")).unwrap_or_default();
    processes
        .map(|entry| (entry.path(), command_line(&entry.path())))
        .filter(|(_, line)| line.contains(&wanted))
        .map(|(path, line)| format!("{} {}", path.display(), line.replace('\0', " ")))
        .collect()
}

/// Sends `signal` to `process`.
pub fn send(process: u32, signal: Signal) {
    let pid = Pid::from_raw(process.cast_signed()).expect("a process id");
    kill_process(pid, signal).expect("the process is there");
}

/// Waits until `condition` gives something; fails the test when it takes too long.
pub fn wait_until<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(start.elapsed() < LONGEST, "waited in vain until {what}");
        thread::sleep(Duration::from_millis(1));
    }
}
