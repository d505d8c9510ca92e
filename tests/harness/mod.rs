//! Flies swarms for the tests: starts the real command, observes the run, and ends it when the test is over.

pub mod bench;
pub mod foxglove;
pub mod log;
pub mod terminal;

use ringwing_bus::{Domain, DomainId, Gate};
use ringwing_flight::{Part, Tick};
use ringwing_scenario::Scenario;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Output, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

/// Longest wait of a test. Shorter fails tests on a busy machine; longer delays the report of a hang.
const LONGEST_WAIT: Duration = Duration::from_secs(120);

/// The log in the `folder` of a run, which has the name of the run.
pub fn log_in(folder: &Path) -> PathBuf {
    let run = folder.file_name().expect("a folder of a run").to_str().expect("a name in UTF-8");
    folder.join(format!("{run}.mcap"))
}

/// The folder of the newest run in `out`, if there is one.
pub fn newest_run(out: &Path) -> Option<PathBuf> {
    out.join("latest").canonicalize().ok()
}

/// The command under test.
pub fn ringwing() -> Command {
    // A shell starts background commands with SIGINT ignored, and the command then ignores it as well: if the tests run in
    // the background, they must not pass that on.
    let mut command = Command::new("env");
    command.args(["--default-signal=INT,HUP,TSTP", env!("CARGO_BIN_EXE_ringwing")]);
    // The defaults of whoever runs the tests must not change what they test.
    command.env("RINGWING_CONFIG", "");
    command
}

/// A run that is not started yet.
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

    /// Adds arguments, separated by spaces.
    pub fn with(mut self, arguments: &str) -> Self {
        self.command.args(arguments.split_whitespace());
        self
    }

    /// Adds a fault.
    pub fn fault(mut self, sentence: &str) -> Self {
        self.command.args(["--fault", sentence]);
        self
    }

    /// Lets programs of the user's fly: `UAVS=COMMAND`.
    pub fn agent(mut self, program: &str) -> Self {
        self.command.args(["--agent", program]);
        self
    }

    /// Starts the run.
    pub fn start(mut self) -> Running {
        let mut child = self
            .command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("ringwing starts");
        let lines = lines_of(&mut child);
        let mut running = Running {
            child,
            lines,
            stderr_lines: Vec::new(),
            domain: None,
            folder: PathBuf::new(),
            out: self.out,
        };
        running.read_domain_and_folder();
        running
    }

    /// Starts the run and waits until it ends.
    pub fn finish(self) -> Finished {
        self.start().finish()
    }
}

fn lines_of(child: &mut Child) -> Receiver<String> {
    let (sender, receiver) = channel();
    // A thread reads all the time: a run that writes into a full pipe would stand still until the test looks.
    let stderr = BufReader::new(child.stderr.take().expect("stderr is piped"));
    thread::spawn(move || stderr.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    receiver
}

/// A live run.
pub struct Running {
    child: Child,
    lines: Receiver<String>,
    stderr_lines: Vec<String>,
    domain: Option<Domain>,
    /// The run's folder.
    pub folder: PathBuf,
    out: tempfile::TempDir,
}

impl Running {
    fn read_domain_and_folder(&mut self) {
        let line = self.wait_for_line("ringwing: domain ");
        let (id, folder) =
            line["ringwing: domain ".len()..].split_once(", folder ").expect("domain and folder");
        self.folder = folder.into();
        let id: DomainId = id.parse().expect("a domain's name");
        self.domain = Domain::join(&id).ok();
    }

    /// The run's domain in shared memory.
    pub fn domain(&self) -> &Domain {
        self.domain.as_ref().expect("the run is live")
    }

    fn gate(&self) -> Gate {
        self.domain().gate().expect("the run's gate")
    }

    /// The process id of the launcher.
    pub fn launcher(&self) -> u32 {
        self.child.id()
    }

    /// Waits until `part` is ready; returns its process id.
    pub fn process(&self, part: Part) -> u32 {
        let gate = self.gate();
        wait_until(&format!("{part} is ready"), || gate.ready_process(part))
    }

    /// Sends `signal` to `part` once it is ready; returns its process id.
    pub fn signal(&self, part: Part, signal: Signal) -> u32 {
        let process = self.process(part);
        send(process, signal);
        process
    }

    /// Waits until a flight at 100 Hz reaches the time `seconds`.
    pub fn wait_for_second(&self, seconds: f64) {
        let gate = self.gate();
        let tick = Tick((seconds * 100.0) as i64);
        wait_until(&format!("the flight reaches {seconds} s"), || {
            // A closed gate ends the wait too: then the test fails by what the run did, and not by a timeout.
            (gate.is_closed() || gate.tick().is_some_and(|now| now >= tick)).then_some(())
        });
    }

    /// Waits for a line on stderr that contains `text`; returns the line.
    pub fn wait_for_line(&mut self, text: &str) -> String {
        let start = Instant::now();
        loop {
            let Ok(line) = self.lines.recv_timeout(LONGEST_WAIT.saturating_sub(start.elapsed())) else {
                panic!("the run printed no {text:?}, only:\n{}", self.stderr_lines.join("\n"));
            };
            self.stderr_lines.push(line.clone());
            if line.contains(text) {
                return line;
            }
        }
    }

    /// Waits until the run ends; returns its outcome and output.
    pub fn finish(mut self) -> Finished {
        let status =
            wait_until("the run ends", || self.child.try_wait().expect("the child can be waited for"));
        // A limit, because a process that outlives the launcher would keep the pipe open.
        while let Ok(line) = self.lines.recv_timeout(Duration::from_secs(5)) {
            self.stderr_lines.push(line);
        }
        let id = self.domain.take().map(|domain| domain.id().clone());
        let summary = fs::read(self.folder.join("summary.json")).ok();
        // Nothing can be moved out of a type with `Drop`, so another folder takes its place.
        let out = std::mem::replace(&mut self.out, tempfile::tempdir().expect("a temporary folder"));
        Finished {
            status,
            summary: summary.map_or(Value::Null, |text| serde_json::from_slice(&text).expect("JSON")),
            stderr: std::mem::take(&mut self.stderr_lines).join("\n"),
            folder: self.folder.clone(),
            domain: id.expect("the run had a domain"),
            _out: out,
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("--- stderr of the run:\n{}", self.stderr_lines.join("\n"));
        }
        // Killing the launcher ends its processes. The next run or `ringwing clean` removes its remains in shared memory.
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
    /// Its stderr.
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

    /// The file of the run's log.
    pub fn log_path(&self) -> PathBuf {
        log_in(&self.folder)
    }

    /// The run's log.
    pub fn log(&self) -> log::Log {
        log::Log::read(&self.log_path())
    }

    /// Asserts that the run ended with this exit code and left nothing behind.
    pub fn assert_ended_with(&self, code: i32) -> &Self {
        assert_eq!(self.status.code(), Some(code), "{}\n{:#}", self.stderr, self.summary);
        self.assert_nothing_left();
        self
    }

    /// Asserts that the run left no process, no shared memory and no temporary file behind.
    pub fn assert_nothing_left(&self) {
        wait_until_gone(&self.domain);
    }
}

/// Waits until no process, no shared memory and no temporary file of `domain` is left. Waits, because a killed process takes
/// a moment to disappear.
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

/// The processes, shared memory and temporary files of a run that still exist.
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

/// The processes of a run, each as its path in `/proc` and its command line.
pub fn processes_of(domain: &DomainId) -> Vec<String> {
    // The system ends each argument with a zero, so a domain whose name only begins like this one does not match.
    let wanted = format!("--domain\0{domain}\0");
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let command_line = |path: &Path| fs::read_to_string(path.join("cmdline")).unwrap_or_default();
    processes
        .map(|entry| (entry.path(), command_line(&entry.path())))
        .filter(|(_, line)| line.contains(&wanted))
        .map(|(path, line)| format!("{} {}", path.display(), line.replace('\0', " ")))
        .collect()
}

/// What the kernel says about `process` under `key`, such as `Cpus_allowed_list`; `None` if it has ended.
pub fn status_of(process: u32, key: &str) -> Option<String> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let value = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    Some(value?.trim().to_owned())
}

/// Sends `signal` to `process`.
pub fn send(process: u32, signal: Signal) {
    let pid = Pid::from_raw(process.cast_signed()).expect("a process id");
    kill_process(pid, signal).expect("the process exists");
}

/// Runs `command` to its end, and asserts that it ends with the exit code `code`.
pub fn finished(mut command: Command, code: i32) -> Output {
    let output = command.output().expect("the command starts");
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Waits until `condition` returns a value; fails the test after [`LONGEST_WAIT`].
pub fn wait_until<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(start.elapsed() < LONGEST_WAIT, "timed out waiting until {what}");
        thread::sleep(Duration::from_millis(1));
    }
}
