//! Collects everything that the launcher waits for: changes of its processes, the user's signals, requests for faults,
//! and ticks that the world holds. One thread per source turns these into [`Notice`]s.
//!
//! Must never act on a notice: the supervisor does, one notice at a time.

use super::{LaunchError, fault_queue::LiveRequest};
use ringwing_bus::{Gate, REFUSED, heeded};
use ringwing_flight::{ProcessEnd, UavId};
use rustix::{
    event::{PollFd, PollFlags, poll},
    io::Errno,
    process::{Pid, PidfdFlags, WaitOptions, WaitStatus, pidfd_open, wait},
};
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM, SIGTSTP},
    iterator::Signals,
};
use std::{
    io::{self, BufRead, BufReader, Read, Write},
    os::unix::net::{UnixListener, UnixStream},
    path::Path,
    process::ChildStdout,
    sync::mpsc::{Receiver, Sender, channel},
    thread::{self, JoinHandle},
    time::Duration,
};

/// How long a client may take to send its request. A longer limit lets a stuck client block all others for longer; a
/// shorter one may cut off a client on a busy machine.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest request that is read. A smaller limit could cut off a sentence with a long trace of delays; a larger one
/// only lets a broken client fill more memory.
const REQUEST_BYTES: u64 = 1 << 20;
/// How often the thread that waits for holds looks whether the flight is over. Longer delays the end of that thread;
/// shorter costs wake-ups during the flight.
const CLOSED_GATE_CHECK: Duration = Duration::from_millis(50);
/// How long the reaper sleeps while the launcher has no child. A child that ends at once is noticed this much later.
const NO_CHILD_PAUSE: Duration = Duration::from_millis(2);

/// Something that the launcher reacts to.
#[derive(Debug)]
pub(super) enum Notice {
    /// A process ended, stopped or continued.
    Process {
        /// Its process id.
        pid: u32,
        /// What happened to it.
        change: ProcessChange,
    },
    /// The user wants the run to end.
    Interrupt,
    /// The user wants the run to stop until it is continued (Ctrl-Z).
    Suspend,
    /// The world holds a tick until a fault is applied.
    Held,
    /// A program of the user's has printed more than is kept.
    OutputCut {
        /// The UAV that it flies.
        uav: UavId,
    },
    /// Somebody asks for a fault, for the list of faults, or for a pause.
    Request(LiveRequest<Reply>),
    /// The viewer has printed this line.
    ViewerSays(String),
}

/// What happened to a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProcessChange {
    /// It ended.
    Ended(ProcessEnd),
    /// A signal stopped it.
    Stopped,
    /// A signal let it run on.
    Continued,
}

/// Answers a request.
#[derive(Debug)]
pub(super) struct Reply(UnixStream);

impl Reply {
    /// Sends `answer` and hangs up.
    pub(super) fn send(mut self, answer: &str) {
        // This fails only if the client has left, and then nobody waits for the answer.
        let _ = writeln!(self.0, "{answer}");
    }

    /// Refuses what was asked, says `why`, and hangs up.
    pub(super) fn refuse(self, why: &str) {
        self.send(&format!("{REFUSED}{why}"));
    }
}

/// Collects notices from all sources, in the order they come.
pub(super) struct Inbox {
    sender: Sender<Notice>,
    receiver: Receiver<Notice>,
}

impl Inbox {
    /// Begins to watch children and signals.
    pub(super) fn open() -> Result<Self, LaunchError> {
        let (sender, receiver) = channel();
        let children = sender.clone();
        spawn_thread("the thread that waits for processes", move || report_children(&children))?;
        let failed = |source| LaunchError::Spawn { what: "the signal handler".into(), source };
        // What was ignored when the launcher started, for example by `nohup`, stays ignored.
        let signals = Signals::new(heeded(&[SIGINT, SIGTERM, SIGHUP, SIGTSTP])).map_err(failed)?;
        let user = sender.clone();
        spawn_thread("the thread that waits for signals", move || report_signals(signals, &user))?;
        Ok(Self { sender, receiver })
    }

    /// Where others may leave notices.
    pub(super) fn sender(&self) -> Sender<Notice> {
        self.sender.clone()
    }

    /// The next notice, if one comes within `limit`.
    pub(super) fn next(&self, limit: Duration) -> Option<Notice> {
        self.receiver.recv_timeout(limit).ok()
    }

    /// Begins to watch for ticks that the world holds.
    pub(super) fn watch_holds(&self, gate: Gate) -> Result<(), LaunchError> {
        let inbox = self.sender.clone();
        // The flight stands while the world holds a tick, so a thread of its own notices it at once.
        spawn_thread("the thread that waits for the world to hold", move || report_holds(&gate, &inbox))
            .map(drop)
    }

    /// Begins to listen for requests at the socket `path`.
    pub(super) fn watch_requests(&self, path: &Path) -> Result<(), LaunchError> {
        let failed = |source| LaunchError::Spawn { what: "the socket for requests".into(), source };
        let listener = UnixListener::bind(path).map_err(failed)?;
        let inbox = self.sender.clone();
        spawn_thread("the thread that waits for requests", move || report_requests(&listener, &inbox))
            .map(drop)
    }

    /// Begins to listen to what the viewer prints.
    pub(super) fn watch_viewer(&self, lines: ChildStdout) -> Result<(), LaunchError> {
        let inbox = self.sender.clone();
        spawn_thread("the thread that listens to the viewer", move || {
            let lines = BufReader::new(lines).lines().map_while(Result::ok);
            // This fails only if the launcher has left, and then nobody reads.
            let _ = lines.map(Notice::ViewerSays).try_for_each(|notice| inbox.send(notice));
        })
        .map(drop)
    }

    /// Begins to watch the process `pid` for its end, because it is not a child of the launcher.
    pub(super) fn watch_stranger(&self, pid: u32) -> Result<(), LaunchError> {
        let inbox = self.sender.clone();
        spawn_thread("the thread that watches a process", move || {
            wait_for_end(pid);
            // This fails only if the launcher has left, and then nobody waits for the notice.
            let _ = inbox.send(Notice::Process { pid, change: ProcessChange::Ended(ProcessEnd::Unknown) });
        })
        .map(drop)
    }
}

/// Starts a thread; an error calls it `what`.
pub(super) fn spawn_thread(
    what: &str,
    run: impl FnOnce() + Send + 'static,
) -> Result<JoinHandle<()>, LaunchError> {
    let failed = |source| LaunchError::Spawn { what: what.into(), source };
    thread::Builder::new().spawn(run).map_err(failed)
}

fn report_children(inbox: &Sender<Notice>) {
    loop {
        match wait(WaitOptions::UNTRACED | WaitOptions::CONTINUED) {
            Ok(Some((pid, status))) => {
                let pid = pid.as_raw_nonzero().get().cast_unsigned();
                if inbox.send(Notice::Process { pid, change: change_of(status) }).is_err() {
                    return;
                }
            }
            Ok(None) | Err(_) => thread::sleep(NO_CHILD_PAUSE),
        }
    }
}

fn change_of(status: WaitStatus) -> ProcessChange {
    match (status.exit_status(), status.terminating_signal()) {
        (Some(code), _) => ProcessChange::Ended(ProcessEnd::Exited(code)),
        (_, Some(signal)) => ProcessChange::Ended(ProcessEnd::Killed(signal)),
        _ if status.continued() => ProcessChange::Continued,
        _ => ProcessChange::Stopped,
    }
}

fn report_signals(mut signals: Signals, inbox: &Sender<Notice>) {
    for signal in signals.forever() {
        let notice = if signal == SIGTSTP { Notice::Suspend } else { Notice::Interrupt };
        if inbox.send(notice).is_err() {
            return;
        }
    }
}

fn report_holds(gate: &Gate, inbox: &Sender<Notice>) {
    let mut seen = 0;
    while !gate.is_closed() {
        let holds = gate.wait_for_hold(seen, CLOSED_GATE_CHECK);
        let is_new = std::mem::replace(&mut seen, holds) != holds;
        if is_new && inbox.send(Notice::Held).is_err() {
            return;
        }
    }
}

fn report_requests(listener: &UnixListener, inbox: &Sender<Notice>) {
    // A client that hangs up or sends no text in time gets no answer.
    for request in listener.incoming().filter_map(|stream| read_request(stream.ok()?).ok()) {
        if inbox.send(Notice::Request(request)).is_err() {
            return;
        }
    }
}

fn read_request(stream: UnixStream) -> io::Result<LiveRequest<Reply>> {
    stream.set_read_timeout(Some(REQUEST_TIMEOUT))?;
    let mut line = String::new();
    BufReader::new(stream.try_clone()?.take(REQUEST_BYTES)).read_line(&mut line)?;
    Ok(LiveRequest { sentence: line.trim().to_owned(), reply: Reply(stream) })
}

/// Waits until the process `pid` has ended; returns at once if it does not exist.
fn wait_for_end(pid: u32) {
    let process = Pid::from_raw(pid.cast_signed()).and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
    if let Some(process) = process {
        // A signal to the launcher interrupts the wait, although the process still lives.
        while poll(&mut [PollFd::new(&process, PollFlags::IN)], None) == Err(Errno::INTR) {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_one_line_and_its_sender_gets_the_answer() {
        let (mut client, server) = UnixStream::pair().unwrap();
        writeln!(client, " kill uav 3 ").unwrap();
        let request = read_request(server).unwrap();
        assert_eq!(request.sentence, "kill uav 3");
        request.reply.send("tick 5: done");
        let mut answer = String::new();
        client.read_to_string(&mut answer).unwrap();
        assert_eq!(answer, "tick 5: done\n");
    }

    #[test]
    fn the_end_of_a_process_that_is_not_a_child_is_waited_for() {
        let mut child = std::process::Command::new("sleep").arg("0.05").spawn().unwrap();
        wait_for_end(child.id());
        assert!(child.try_wait().unwrap().is_some_and(|status| status.success()));
        wait_for_end(child.id());
    }
}
