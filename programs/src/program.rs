//! The flight's end: one program that is asked for its wishes.
//!
//! Must never wait for a program without a limit, nor leave one behind.

use crate::{
    UNBUFFERED,
    find::{FindError, program_of},
    output::{file_of, keep, open},
    socket::{LONGEST_FROM_PROGRAM, greeting, receive, send},
};
use ringwing_agent::{
    Situation, Wish,
    controller::message::{situation_bytes, wish_of_bytes},
};
use ringwing_flight::UavId;
use ringwing_scenario::{AgentSection, Scenario};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use std::{
    io::{self, PipeReader, Read, Write},
    os::{
        fd::OwnedFd,
        unix::{net::UnixStream, process::CommandExt},
    },
    path::{Path, PathBuf},
    process::{Child, Command},
    sync::{Arc, Mutex, PoisonError},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// The word before the arguments that ringwing adds to a program's own in a simulated flight.
pub const SIMULATED_MARKER: &str = "simulated-agent";
/// Bytes kept of the end of what a program prints, to say why it has failed. Fewer may cut off the line that says so.
const TAIL_BYTES: usize = 4096;
/// How long a program may take to end with its flight, and to have its last words read. Longer delays the end of a flight whose
/// program does not end; shorter kills one that is still writing.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// Pause between two looks at a program that ends. Longer delays the end of each flight; shorter costs wake-ups.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

/// Why a program does not fly its UAV in a simulated flight.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// It cannot be found.
    #[error(transparent)]
    Find(#[from] FindError),
    /// It cannot be started.
    #[error("{uav}: its program cannot be started: {source}")]
    Start {
        /// The UAV.
        uav: UavId,
        /// Why.
        source: io::Error,
    },
    /// It does not fly the UAV any more, or never did.
    #[error("{uav}: its program {problem}{when}{words}")]
    Failed {
        /// The UAV.
        uav: UavId,
        /// What it did.
        problem: String,
        /// When.
        when: String,
        /// Where its output is, or the end of it.
        words: String,
    },
}

/// A running program that flies one UAV.
#[derive(Debug)]
pub(crate) struct Program {
    uav: UavId,
    child: Child,
    /// `None` once the program has been told that its flight is over.
    socket: Option<UnixStream>,
    output: Output,
    answer_limit: Duration,
    /// How the program ended, once it has.
    ending: Option<String>,
}

/// What a program prints.
#[derive(Debug)]
struct Output {
    /// The file that has all of it.
    file: Option<PathBuf>,
    /// The end of it, if there is no file.
    tail: Arc<Mutex<Vec<u8>>>,
    reader: JoinHandle<()>,
}

impl Program {
    /// Starts the program of `section` for `uav`, and waits until its controller is ready.
    pub(crate) fn start(
        scenario: &Scenario,
        uav: UavId,
        section: &AgentSection,
        output: Option<&Path>,
    ) -> Result<Self, ProgramError> {
        let file = program_of(uav, section)?;
        let mut program =
            Self::spawn(&file, section, uav, output).map_err(|source| ProgramError::Start { uav, source })?;
        program.answer_limit = scenario.answer_limit();
        let patience = scenario.start_limit();
        program
            .greet(&scenario.to_toml(), patience)
            .map_err(|error| program.failed(&error, patience, String::new()))?;
        Ok(program)
    }

    fn spawn(file: &Path, section: &AgentSection, uav: UavId, output: Option<&Path>) -> io::Result<Self> {
        let (socket, guest) = UnixStream::pair()?;
        let (reader, writer) = io::pipe()?;
        let output = Output::begin(reader, uav, output)?;
        let launcher = std::process::id().to_string();
        let child = Command::new(file)
            .arg0(&section.command[0])
            .args(&section.command[1..])
            .args([SIMULATED_MARKER, "--uav", &uav.0.to_string(), "--launcher", &launcher])
            .current_dir(&section.folder)
            .env(UNBUFFERED.0, UNBUFFERED.1)
            .stdin(OwnedFd::from(guest))
            .stdout(writer.try_clone()?)
            .stderr(writer)
            // What it starts is ended with it. Ctrl-C reaches only the process that flies, which then ends the program.
            .process_group(0)
            .spawn()?;
        Ok(Self { uav, child, socket: Some(socket), output, answer_limit: Duration::MAX, ending: None })
    }

    fn greet(&mut self, text: &str, patience: Duration) -> io::Result<()> {
        let said = self.exchange(text.as_bytes(), patience)?;
        if said == greeting().as_bytes() {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&said).into_owned();
        Err(io::Error::new(io::ErrorKind::InvalidData, format!("{said:?} instead of {:?}", greeting())))
    }

    /// What the program wishes in this situation.
    pub(crate) fn ask(&mut self, situation: &Situation<'_>) -> Result<Wish, ProgramError> {
        let answered = self.exchange(&situation_bytes(situation), self.answer_limit).and_then(|bytes| {
            wish_of_bytes(&bytes).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no wish"))
        });
        answered.map_err(|error| {
            let when = format!(" at {:.2} s", situation.time_s());
            self.failed(&error, self.answer_limit, when)
        })
    }

    /// Sends a message, and waits for the answer for as long as `patience` says.
    fn exchange(&mut self, message: &[u8], patience: Duration) -> io::Result<Vec<u8>> {
        let socket = self.socket.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        let mut socket = Timed { socket, since: Instant::now(), patience };
        send(&mut socket, message)?;
        receive(&mut socket, LONGEST_FROM_PROGRAM)?.ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    /// Why the program has failed, with what it printed last.
    fn failed(&mut self, error: &io::Error, patience: Duration, when: String) -> ProgramError {
        let problem = match error.kind() {
            // Both names of a timeout, depending on the system.
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                self.end(Duration::ZERO);
                format!("did not answer within {} s", patience.as_secs_f64())
            }
            io::ErrorKind::InvalidData => {
                self.end(Duration::ZERO);
                format!("was built with another version of ringwing: {error}")
            }
            _ => self.end(LAST_WORDS),
        };
        ProgramError::Failed { uav: self.uav, problem, when, words: self.output.last_words() }
    }

    /// Ends the program and every process that it has started, after it had `patience` to end by itself. Returns how it ended.
    fn end(&mut self, patience: Duration) -> String {
        if let Some(ending) = &self.ending {
            return ending.clone();
        }
        // Tells the program that the flight is over.
        self.socket = None;
        let since = Instant::now();
        let pid = Pid::from_child(&self.child);
        // Without collecting the program, so that its number still belongs to its group.
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        let has_ended = || !matches!(waitid(WaitId::Pid(pid), options), Ok(None));
        while !has_ended() && since.elapsed() < patience {
            thread::sleep(LOOK_AGAIN);
        }
        let by_itself = has_ended();
        // Both fail if nobody is left.
        let _ = kill_process_group(pid, Signal::KILL);
        let _ = self.child.kill();
        let ending = match self.child.wait() {
            Ok(status) if by_itself => format!("ended ({status})"),
            _ => "closed its standard input".into(),
        };
        self.ending.insert(ending).clone()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.end(LAST_WORDS);
        self.output.wait();
    }
}

/// The socket of a program that has a limited time.
struct Timed<'s> {
    socket: &'s mut UnixStream,
    since: Instant,
    patience: Duration,
}

impl Timed<'_> {
    /// What is left of the time. A limit for each read alone would let a program send one byte after the other.
    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.patience.saturating_sub(self.since.elapsed());
        if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(Some(left)) }
    }
}

impl Read for Timed<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.socket.set_read_timeout(self.left()?)?;
        self.socket.read(bytes)
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.socket.set_write_timeout(self.left()?)?;
        self.socket.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.socket.flush()
    }
}

impl Output {
    /// Begins to keep what comes through `reader`: in a file in the folder `output`, or only the end of it.
    fn begin(reader: PipeReader, uav: UavId, output: Option<&Path>) -> io::Result<Self> {
        let tail = Arc::new(Mutex::new(Vec::new()));
        let file = output.map(|folder| file_of(folder, uav));
        let mut sink: Box<dyn Write + Send> = Box::new(Tail(tail.clone()));
        let mut room = u64::MAX;
        if let Some(path) = &file {
            let (file, left) = open(path)?;
            (sink, room) = (Box::new(file), left);
        }
        let keeper = move || keep(reader, sink, room, || {});
        let reader = thread::Builder::new().name("what a program prints".into()).spawn(keeper)?;
        Ok(Self { file, tail, reader })
    }

    /// Waits until everything is kept, but only for a limited time: a process that the program left behind may still have its output.
    fn wait(&self) {
        let since = Instant::now();
        while !self.reader.is_finished() && since.elapsed() < LAST_WORDS {
            thread::sleep(LOOK_AGAIN);
        }
    }

    /// Where its output is, or the last line that says something.
    fn last_words(&self) -> String {
        self.wait();
        if let Some(file) = &self.file {
            return format!("; what it printed is in {}", file.display());
        }
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(&tail);
        text.lines()
            .rfind(|line| !line.trim().is_empty())
            .map_or_else(String::new, |line| format!(": {}", line.trim()))
    }
}

/// Keeps the end of what is written to it.
struct Tail(Arc<Mutex<Vec<u8>>>);

impl Write for Tail {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(bytes);
        let surplus = kept.len().saturating_sub(TAIL_BYTES);
        kept.drain(..surplus);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
