//! The flight's end: one program that is asked for its wishes.
//!
//! Must never wait for a program without a limit, nor leave one behind.

use crate::{
    UNBUFFERED,
    find::{FindError, program_of},
    output::{KEPT_BYTES, keep},
    socket::{greeting, receive, send},
};
use ringwing_agent::{
    Situation, Wish,
    controller::message::{situation_bytes, wish_of_bytes},
};
use ringwing_flight::UavId;
use ringwing_scenario::{AgentSection, Scenario};
use rustix::process::{Pid, Signal, kill_process_group};
use std::{
    fs::{self, OpenOptions},
    io::{self, PipeReader, Write},
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
    answer_timeout: Duration,
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
    /// Starts the program of `section` for `uav`, and waits until its controller is ready. `text` is the scenario as TOML.
    pub(crate) fn start(
        scenario: &Scenario,
        text: &str,
        uav: UavId,
        section: &AgentSection,
        output: Option<&Path>,
    ) -> Result<Self, ProgramError> {
        let file = program_of(uav, section)?;
        let supervision = &scenario.supervision;
        let mut program =
            Self::spawn(&file, section, uav, output).map_err(|source| ProgramError::Start { uav, source })?;
        program.answer_timeout = Duration::from_secs_f64(supervision.answer_timeout_s);
        let patience = Duration::from_secs_f64(supervision.start_timeout_s);
        program.greet(text, patience).map_err(|error| program.failed(&error, patience, String::new()))?;
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
        Ok(Self { uav, child, socket: Some(socket), output, answer_timeout: Duration::MAX })
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
        let answered = self.exchange(&situation_bytes(situation), self.answer_timeout).and_then(|bytes| {
            wish_of_bytes(&bytes).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no wish"))
        });
        answered.map_err(|error| {
            let when = format!(" at {:.2} s", situation.time_s());
            self.failed(&error, self.answer_timeout, when)
        })
    }

    /// Sends a message, and waits for the answer for as long as `patience` says.
    fn exchange(&mut self, message: &[u8], patience: Duration) -> io::Result<Vec<u8>> {
        let socket = self.socket.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        socket.set_read_timeout(Some(patience))?;
        socket.set_write_timeout(Some(patience))?;
        send(socket, message)?;
        receive(socket)?.ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    /// Why the program has failed, with what it printed last.
    fn failed(&mut self, error: &io::Error, patience: Duration, when: String) -> ProgramError {
        let problem = match error.kind() {
            // Both names of a timeout, depending on the system.
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                self.kill();
                format!("did not answer within {} s", patience.as_secs_f64())
            }
            io::ErrorKind::InvalidData => {
                self.kill();
                format!("was built with another version of ringwing: {error}")
            }
            _ => self.end(),
        };
        ProgramError::Failed { uav: self.uav, problem, when, words: self.output.last_words() }
    }

    /// Waits for the end of the program, and says how it ended.
    fn end(&mut self) -> String {
        self.socket = None;
        let since = Instant::now();
        while since.elapsed() < LAST_WORDS {
            match self.child.try_wait() {
                Ok(Some(status)) => return format!("ended ({status})"),
                Ok(None) => thread::sleep(LOOK_AGAIN),
                Err(_) => break,
            }
        }
        "closed its standard input".into()
    }

    /// Ends the program and every process that it has started.
    fn kill(&self) {
        if let Some(group) = Pid::from_raw(self.child.id().cast_signed()) {
            // Fails if nobody of the group is left.
            let _ = kill_process_group(group, Signal::KILL);
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // The closed socket tells it that the flight is over.
        let _ = self.end();
        self.kill();
        let _ = self.child.wait();
    }
}

impl Output {
    /// Begins to keep what comes through `reader`: in a file in the folder `output`, or only the end of it.
    fn begin(reader: PipeReader, uav: UavId, output: Option<&Path>) -> io::Result<Self> {
        let tail = Arc::new(Mutex::new(Vec::new()));
        let file = output.map(|folder| folder.join(format!("uav-{}.txt", uav.0)));
        let mut sink: Box<dyn Write + Send> = Box::new(Tail(tail.clone()));
        let mut room = u64::MAX;
        if let (Some(folder), Some(path)) = (output, &file) {
            fs::create_dir_all(folder)?;
            // A program that is started again adds to what the one before has printed.
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            room = KEPT_BYTES.saturating_sub(file.metadata()?.len());
            sink = Box::new(file);
        }
        let keeper = move || keep(reader, sink, room, || {});
        let reader = thread::Builder::new().name("what a program prints".into()).spawn(keeper)?;
        Ok(Self { file, tail, reader })
    }

    /// Where its output is, or the last line that says something.
    fn last_words(&self) -> String {
        let since = Instant::now();
        while !self.reader.is_finished() && since.elapsed() < LAST_WORDS {
            thread::sleep(LOOK_AGAIN);
        }
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
