//! News for the launcher: what its processes do, and what its user wants.

use super::LaunchError;
use ringwing_bus::Gate;
use ringwing_flight::ProcessEnd;
use rustix::{
    event::{PollFd, PollFlags, poll},
    io::Errno,
    process::{Pid, PidfdFlags, WaitOptions, WaitStatus, pidfd_open, wait},
};
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    iterator::Signals,
};
use std::{
    io::{self, BufRead, BufReader, Read, Write},
    os::unix::net::{UnixListener, UnixStream},
    path::Path,
    sync::mpsc::{Receiver, Sender, channel},
    thread,
    time::Duration,
};

/// Something the launcher should know.
#[derive(Debug)]
pub(super) enum Notice {
    /// A process ended, or was frozen or thawed.
    Process {
        /// Its process id.
        pid: u32,
        /// What happened to it.
        change: Change,
    },
    /// The user wants the run to end.
    Interrupt,
    /// The world holds until something is done to the run.
    Held,
    /// Somebody wants something done to the run.
    Request(Request),
}

/// A line that somebody sent, and whom to answer.
#[derive(Debug)]
pub(super) struct Request {
    /// What is wanted.
    pub(super) text: String,
    stream: UnixStream,
}

impl Request {
    /// Says `answer` and hangs up; whoever asked may have left.
    pub(super) fn answer(mut self, answer: &str) {
        let _ = writeln!(self.stream, "{answer}");
    }
}

/// How long somebody who wants something may take to say it.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest request.
const REQUEST_BYTES: u64 = 1 << 20;
/// How often the thread that waits for the world to hold looks whether the flight is over.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// What happened to a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    /// It is no more.
    Ended(ProcessEnd),
    /// It is stopped by a signal.
    Frozen,
    /// It goes on.
    Thawed,
}

/// Where all news come in.
pub(super) struct Desk {
    sender: Sender<Notice>,
    receiver: Receiver<Notice>,
}

impl Desk {
    /// Begins to listen to children and signals.
    pub(super) fn open() -> Result<Self, LaunchError> {
        let (sender, receiver) = channel();
        let children = sender.clone();
        start("the thread that waits for processes", move || reap(&children))?;
        let failed = |source| LaunchError::Spawn { what: "the signal handler".into(), source };
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP]).map_err(failed)?;
        let user = sender.clone();
        start("the thread that waits for signals", move || {
            for _ in signals.forever() {
                if user.send(Notice::Interrupt).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { sender, receiver })
    }

    /// The next notice, if one comes within `limit`.
    pub(super) fn next(&self, limit: Duration) -> Option<Notice> {
        self.receiver.recv_timeout(limit).ok()
    }

    /// Listens to the world too: whether it holds.
    pub(super) fn watch_holds(&self, gate: Gate) -> Result<(), LaunchError> {
        let desk = self.sender.clone();
        start("the thread that waits for the world to hold", move || {
            let mut seen = 0;
            while !gate.is_closed() {
                let holds = gate.wait_for_hold(seen, LOOK_AGAIN);
                if std::mem::replace(&mut seen, holds) != holds && desk.send(Notice::Held).is_err() {
                    return;
                }
            }
        })
    }

    /// Listens at the socket `path` too, to whoever wants something done.
    pub(super) fn watch_requests(&self, path: &Path) -> Result<(), LaunchError> {
        let failed = |source| LaunchError::Spawn { what: "the socket for requests".into(), source };
        let listener = UnixListener::bind(path).map_err(failed)?;
        let desk = self.sender.clone();
        start("the thread that waits for requests", move || {
            for request in listener.incoming().filter_map(|stream| read_request(stream.ok()?).ok()) {
                if desk.send(Notice::Request(request)).is_err() {
                    return;
                }
            }
        })
    }

    /// Listens to the process `pid` too, which is not our child.
    pub(super) fn watch(&self, pid: u32) -> Result<(), LaunchError> {
        let desk = self.sender.clone();
        start("the thread that watches a process", move || {
            let process =
                Pid::from_raw(pid.cast_signed()).and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
            if let Some(process) = process {
                while poll(&mut [PollFd::new(&process, PollFlags::IN)], None) == Err(Errno::INTR) {}
            }
            // A launcher that no longer listens needs no news.
            let _ = desk.send(Notice::Process { pid, change: Change::Ended(ProcessEnd::Unknown) });
        })
    }
}

fn start(what: &str, run: impl FnOnce() + Send + 'static) -> Result<(), LaunchError> {
    let failed = |source| LaunchError::Spawn { what: what.into(), source };
    thread::Builder::new().spawn(run).map(drop).map_err(failed)
}

fn read_request(stream: UnixStream) -> io::Result<Request> {
    stream.set_read_timeout(Some(REQUEST_TIMEOUT))?;
    let mut text = String::new();
    BufReader::new(stream.try_clone()?.take(REQUEST_BYTES)).read_line(&mut text)?;
    Ok(Request { text: text.trim().to_owned(), stream })
}

fn reap(desk: &Sender<Notice>) {
    loop {
        match wait(WaitOptions::UNTRACED | WaitOptions::CONTINUED) {
            Ok(Some((pid, status))) => {
                let pid = pid.as_raw_nonzero().get().cast_unsigned();
                if desk.send(Notice::Process { pid, change: change_of(status) }).is_err() {
                    return;
                }
            }
            // No child at this moment.
            Ok(None) | Err(_) => thread::sleep(Duration::from_millis(2)),
        }
    }
}

fn change_of(status: WaitStatus) -> Change {
    match (status.exit_status(), status.terminating_signal()) {
        (Some(code), _) => Change::Ended(ProcessEnd::Exited(code)),
        (_, Some(signal)) => Change::Ended(ProcessEnd::Killed(signal)),
        _ if status.continued() => Change::Thawed,
        _ => Change::Frozen,
    }
}
