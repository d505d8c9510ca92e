//! Removes what killed processes leave in shared memory while the run goes on.
//!
//! It works on two threads. The cleaner asks iceoryx2 to remove dead nodes. That can wait forever for a segment whose
//! creator was killed before it had given the segment its size, so the sweeper removes those segments.
//!
//! Must never touch what a living process uses. Must never touch the last samples of a process that a fault ended
//! before the recorder has read them: the log of a flight must not depend on how soon the cleaner comes.

use super::LaunchError;
use iceoryx2::{node::Node, prelude::ipc};
use ringwing_bus::{Domain, create_node};
use ringwing_flight::Tick;
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering::SeqCst},
        mpsc::channel,
    },
    thread::{self, JoinHandle},
    time::Duration,
};

/// Pause between two sweeps. Longer keeps the cleaner waiting; shorter lists `/dev/shm` for nothing, because a segment
/// has to stay without a size for a while before it counts as abandoned.
const SWEEP_PAUSE: Duration = Duration::from_millis(50);
/// Sweeps after a process has ended, which take one second in total. Fewer may end before an abandoned segment is old
/// enough to be removed; more list `/dev/shm` for nothing.
const SWEEPS_PER_END: u32 = 20;
/// How long after a planned end its remains stay at most if the recorder has not read what the process sent last. With
/// less, a slow recorder loses counts of links that it would get without the fault; with more, dead processes take up
/// more places in the services.
const KEPT_FOR_RECORDER_S: u32 = 1;

/// The two cleaning threads of a run.
pub(super) struct Janitor {
    sweeper: Worker,
    cleaner: Worker,
    /// The ticks of the first and the last planned end whose remains are still there.
    ends: Option<(Tick, Tick)>,
    /// How many ticks later the remains are removed, whoever still needs them.
    kept_ticks: i64,
}

/// A thread that does rounds of cleaning when it is told to.
struct Worker {
    rounds: Arc<AtomicU32>,
    is_stopping: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Worker {
    fn start(
        name: &str,
        work: impl FnOnce(&AtomicU32, &AtomicBool) + Send + 'static,
    ) -> Result<Self, LaunchError> {
        let (rounds, is_stopping): (Arc<AtomicU32>, Arc<AtomicBool>) = Default::default();
        let (its_rounds, its_stop) = (rounds.clone(), is_stopping.clone());
        let thread = thread::Builder::new().name(name.into()).spawn(move || work(&its_rounds, &its_stop));
        let failed = |source| LaunchError::Spawn { what: format!("the {name}"), source };
        Ok(Self { rounds, is_stopping, thread: thread.map_err(failed)? })
    }

    fn order(&self, rounds: u32) {
        self.rounds.store(rounds, SeqCst);
        self.thread.thread().unpark();
    }

    fn stop(self) {
        self.is_stopping.store(true, SeqCst);
        self.thread.thread().unpark();
        // A panic of a cleaning thread costs nothing: the whole domain is removed after this.
        let _ = self.thread.join();
    }
}

impl Janitor {
    /// Starts both threads for `domain`, whose world opens `rate_hz` ticks a second.
    pub(super) fn start(domain: &Domain, rate_hz: u32) -> Result<Self, LaunchError> {
        let place = domain.clone();
        let sweeper =
            Worker::start("sweeper", move |rounds, is_stopping| sweep(&place, rounds, is_stopping))?;
        let (place, (opened, is_open)) = (domain.clone(), channel());
        let cleaner =
            Worker::start("cleaner", move |rounds, is_stopping| match create_node(&place, "cleaner") {
                Ok(node) => {
                    drop(opened.send(Ok(())));
                    clean(&place, &node, rounds, is_stopping);
                }
                Err(error) => drop(opened.send(Err(error))),
            })?;
        // A cleaner that sends nothing has panicked, and the run can do without one.
        is_open.recv().unwrap_or(Ok(()))?;
        let kept_ticks = i64::from(rate_hz * KEPT_FOR_RECORDER_S);
        Ok(Self { sweeper, cleaner, ends: None, kept_ticks })
    }

    /// Removes the remains of dead processes, in the background.
    pub(super) fn clean(&self) {
        self.sweeper.order(SWEEPS_PER_END);
        self.cleaner.order(1);
    }

    /// Removes the remains of dead processes later, once the recorder has read what was sent until `now`.
    pub(super) fn clean_later(&mut self, now: Option<Tick>) {
        if let Some(now) = now {
            // The first end stays: if each one began the time anew, a series of kills would put off the removal for
            // ever.
            let (first, _) = self.ends.unwrap_or((now, now));
            self.ends = Some((first, now));
        }
    }

    /// Does a delayed removal that is due at tick `now`, when the recorder has read the ticks up to `recorded`. Without a
    /// tick the flight is over, and nobody reads any more.
    pub(super) fn on_tick(&mut self, now: Option<Tick>, recorded: Tick) {
        let Some((first, last)) = self.ends else { return };
        if recorded >= last || now.is_none_or(|now| now.since(first) > self.kept_ticks) {
            self.ends = None;
            self.clean();
        }
    }

    /// Ends both threads: the cleaner first, because it may wait for a segment that only the sweeper removes.
    pub(super) fn stop(self) {
        self.sweeper.order(u32::MAX);
        self.cleaner.stop();
        self.sweeper.stop();
    }
}

fn sweep(domain: &Domain, rounds: &AtomicU32, is_stopping: &AtomicBool) {
    while !is_stopping.load(SeqCst) {
        if rounds.load(SeqCst) == 0 {
            thread::park();
            continue;
        }
        rounds.fetch_sub(1, SeqCst);
        domain.remove_stillborn_segments();
        thread::park_timeout(SWEEP_PAUSE);
    }
}

fn clean(domain: &Domain, node: &Node<ipc::Service>, rounds: &AtomicU32, is_stopping: &AtomicBool) {
    while !is_stopping.load(SeqCst) {
        // However many processes have ended, one round removes the remains of all.
        if rounds.swap(0, SeqCst) > 0 {
            node.try_cleanup_dead_nodes();
            domain.remove_unfinished_nodes();
        } else {
            thread::park();
        }
    }
}
