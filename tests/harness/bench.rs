//! Runs `ringwing bench` for the tests and finds its processes.

use super::{leftovers, ringwing, send, wait_until};
use base64::{Engine, prelude::BASE64_STANDARD};
use hdrhistogram::{Histogram, serialization::Deserializer};
use ringwing_bus::{DomainId, domain};
use rustix::process::Signal;
use serde_json::Value;
use std::{
    fs,
    process::{Child, Output, Stdio},
};

/// A running benchmark, with a temporary folder of its own.
pub struct Bench {
    child: Child,
    temporary: tempfile::TempDir,
}

/// A benchmark that has ended.
pub struct Benched {
    /// Its exit code.
    pub code: Option<i32>,
    /// Its results, or null.
    pub results: Value,
    /// Its stderr.
    pub stderr: String,
}

impl Bench {
    /// Starts `ringwing bench --json` with more `arguments`, separated by spaces.
    pub fn start(arguments: &str) -> Self {
        Self::start_with_peers(arguments, &[])
    }

    /// Starts `ringwing bench --json` with more `arguments`, separated by spaces, and with programs as `NAME=COMMAND`.
    pub fn start_with_peers(arguments: &str, peers: &[&str]) -> Self {
        // A folder of its own, because `finish` counts what is left in it, and other tests write to the common one.
        let temporary = tempfile::tempdir().expect("a temporary folder");
        let mut command = ringwing();
        command.args(["bench", "--json"]).args(arguments.split_whitespace()).env("TMPDIR", temporary.path());
        command.args(peers.iter().flat_map(|peer| ["--peer", peer]));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self { child: command.spawn().expect("ringwing starts"), temporary }
    }

    /// All descendants of the benchmark, each with its command line.
    pub fn processes(&self) -> Vec<(u32, String)> {
        let all: Vec<(u32, u32, String)> = processes();
        let mut ours = vec![self.child.id()];
        let mut found = Vec::new();
        while let Some(parent) = ours.pop() {
            for (process, _, line) in all.iter().filter(|(_, its_parent, _)| *its_parent == parent) {
                ours.push(*process);
                found.push((*process, line.clone()));
            }
        }
        found
    }

    /// The processes that are measuring a case.
    pub fn cases(&self) -> Vec<u32> {
        let is_case = |(_, parent, line): &(u32, u32, String)| {
            *parent == self.child.id() && line.contains(" bench-case ")
        };
        processes().into_iter().filter(is_case).map(|(process, ..)| process).collect()
    }

    /// Waits for a process whose command line contains `text`.
    pub fn wait_for(&self, text: &str) -> (u32, String) {
        wait_until(&format!("there is a process with {text:?}"), || {
            self.processes().into_iter().find(|(_, line)| line.contains(text))
        })
    }

    /// Whether the benchmark has ended by itself.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it can be waited for").is_some()
    }

    /// Asks the benchmark to end with SIGTERM, which it treats like Ctrl-C.
    pub fn interrupt(&self) {
        send(self.child.id(), Signal::TERM);
    }

    /// Lets the benchmark stand still, as Ctrl-Z does.
    pub fn suspend(&self) {
        send(self.child.id(), Signal::TSTP);
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until the benchmark ends, and asserts that it leaves no temporary file.
    pub fn finish(self) -> Benched {
        let Output { status, stdout, stderr } = self.child.wait_with_output().expect("it ends");
        let stderr = String::from_utf8(stderr).expect("text");
        let left = fs::read_dir(self.temporary.path()).expect("its temporary folder").count();
        assert_eq!(left, 0, "files are left in its temporary folder; stderr:\n{stderr}");
        Benched { code: status.code(), results: serde_json::from_slice(&stdout).unwrap_or_default(), stderr }
    }
}

impl Benched {
    /// Runs `ringwing bench --json` with `arguments` to its end.
    pub fn by(arguments: &str) -> Self {
        Bench::start(arguments).finish()
    }

    /// The cases; asserts that all were measured.
    pub fn cases(&self) -> &[Value] {
        assert_eq!(self.code, Some(0), "{}\n{}", self.stderr, self.results);
        self.results["cases"].as_array().expect("cases")
    }
}

/// The number of samples of `hop` in `repeat`.
pub fn samples(repeat: &Value, hop: &str) -> u64 {
    repeat["hops"][hop]["n"].as_u64().unwrap_or(0)
}

/// The number of samples of `nanoseconds` or more, to three digits.
pub fn samples_above(repeat: &Value, hop: &str, nanoseconds: u64) -> u64 {
    let Some(text) = repeat["hops"][hop]["hdr"].as_str() else { return 0 };
    let bytes = BASE64_STANDARD.decode(text).expect("base64");
    let histogram: Histogram<u64> =
        Deserializer::new().deserialize(&mut bytes.as_slice()).expect("a histogram");
    histogram.count_between(nanoseconds, u64::MAX)
}

/// The domain in the command line of a process.
pub fn domain_in(line: &str) -> DomainId {
    let (_, rest) = line.split_once("--domain ").expect("a domain");
    rest.split(' ').next().expect("a name").parse().expect("a domain's name")
}

/// Asserts that nothing is left of `domain`.
pub fn assert_gone(domain: &DomainId) {
    wait_until(&format!("nothing is left of {domain}"), || leftovers(domain).is_empty().then_some(()));
    assert!(!domain::all().contains(domain));
}

/// The processes whose command line begins with `text`.
pub fn processes_with(text: &str) -> Vec<u32> {
    let found = processes().into_iter().filter(|(_, _, line)| line.starts_with(text));
    found.map(|(process, ..)| process).collect()
}

/// All processes of the machine: id, id of the parent, command line.
fn processes() -> Vec<(u32, u32, String)> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    // A process may end while its files are read; then it is left out.
    let read = |entry: fs::DirEntry| {
        let process = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        // The name of a command may hold spaces and parentheses, so count the fields from the last one.
        let parent = stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()?;
        let line = fs::read_to_string(entry.path().join("cmdline")).ok()?;
        Some((process, parent, line.replace('\0', " ")))
    };
    entries.filter_map(read).collect()
}
