//! Clears away what killed processes leave in shared memory, while the run goes on.
//!
//! Two threads: one would wait for ever for a segment that its creator did not live to size, so another removes those.

use super::LaunchError;
use iceoryx2::{node::Node, prelude::ipc};
use ringwing_bus::{Domain, member::create_node};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering::SeqCst},
        mpsc::channel,
    },
    thread::{self, JoinHandle},
    time::Duration,
};

const SWEEP: Duration = Duration::from_millis(50);
/// Sweeps after the last death: a stillborn segment is only one when it stays empty for a while.
const SWEEPS_PER_DEATH: u32 = 20;

/// The two cleaning threads of a run.
pub(super) struct Janitor {
    sweeper: Worker,
    cleaner: Worker,
}

/// A thread that works when it is called.
struct Worker {
    due: Arc<AtomicU32>,
    ended: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Worker {
    fn start(
        name: &str,
        work: impl FnOnce(&AtomicU32, &AtomicBool) + Send + 'static,
    ) -> Result<Self, LaunchError> {
        let (due, ended): (Arc<AtomicU32>, Arc<AtomicBool>) = Default::default();
        let (its_due, its_end) = (due.clone(), ended.clone());
        let thread = thread::Builder::new().name(name.into()).spawn(move || work(&its_due, &its_end));
        let failed = |source| LaunchError::Spawn { what: name.into(), source };
        Ok(Self { due, ended, thread: thread.map_err(failed)? })
    }

    fn call(&self, times: u32) {
        self.due.store(times, SeqCst);
        self.thread.thread().unpark();
    }

    fn stop(self) {
        self.ended.store(true, SeqCst);
        self.thread.thread().unpark();
        // A panic of a cleaning thread costs nothing: the whole domain is removed after this.
        let _ = self.thread.join();
    }
}

impl Janitor {
    pub(super) fn start(domain: &Domain) -> Result<Self, LaunchError> {
        let place = domain.clone();
        let sweeper = Worker::start("the janitor", move |due, ended| sweep(&place, due, ended))?;
        let (place, (says, hears)) = (domain.clone(), channel());
        let cleaner = Worker::start("the cleaner", move |due, ended| {
            let node = create_node(&place, "cleaner");
            let node = node.map_err(|error| says.send(Err(error))).inspect(|_| drop(says.send(Ok(()))));
            if let Ok(node) = node {
                clean(&node, due, ended);
            }
        })?;
        // A thread that ends without a word has panicked; then there is nothing to say either.
        hears.recv().unwrap_or(Ok(()))?;
        Ok(Self { sweeper, cleaner })
    }

    /// A process has died.
    pub(super) fn call(&self) {
        self.sweeper.call(SWEEPS_PER_DEATH);
        self.cleaner.call(1);
    }

    /// Ends both threads: the cleaner first, which may be waiting for the sweeper's work.
    pub(super) fn stop(self) {
        self.sweeper.call(u32::MAX);
        self.cleaner.stop();
        self.sweeper.stop();
    }
}

fn sweep(domain: &Domain, due: &AtomicU32, ended: &AtomicBool) {
    while !ended.load(SeqCst) {
        if due.load(SeqCst) == 0 {
            thread::park();
            continue;
        }
        due.fetch_sub(1, SeqCst);
        domain.remove_stillborn_segments();
        thread::park_timeout(SWEEP);
    }
}

fn clean(node: &Node<ipc::Service>, due: &AtomicU32, ended: &AtomicBool) {
    while !ended.load(SeqCst) {
        if due.swap(0, SeqCst) > 0 {
            node.try_cleanup_dead_nodes();
        } else {
            thread::park();
        }
    }
}
