//! Clears away what killed processes leave in shared memory, while the run goes on.
//!
//! Two threads: one would wait for ever for a segment that its creator did not live to size, so another removes those.

use super::LaunchError;
use ringwing_messages::{Domain, member::create_node};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering::SeqCst},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

const SWEEP: Duration = Duration::from_millis(50);
/// Sweeps after the last death: a stillborn segment is only one when it stays empty for a while.
const SWEEPS_PER_DEATH: u32 = 20;

/// The two cleaning threads of a run.
pub(super) struct Janitor {
    sweeps_due: Arc<AtomicU32>,
    cleaning_due: Arc<AtomicBool>,
    ended: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Janitor {
    pub(super) fn start(domain: &Domain) -> Result<Self, LaunchError> {
        let mut janitor = Self {
            sweeps_due: Arc::default(),
            cleaning_due: Arc::default(),
            ended: Arc::default(),
            threads: Vec::new(),
        };
        let (due, ended, place) = (janitor.sweeps_due.clone(), janitor.ended.clone(), domain.clone());
        janitor.spawn("the janitor", move || sweep(&place, &due, &ended))?;
        let (due, ended, place) = (janitor.cleaning_due.clone(), janitor.ended.clone(), domain.clone());
        janitor.spawn("the cleaner", move || clean(&place, &due, &ended))?;
        Ok(janitor)
    }

    fn spawn(&mut self, name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), LaunchError> {
        let failed = |source| LaunchError::Spawn { what: name.into(), source };
        self.threads.push(thread::Builder::new().name(name.into()).spawn(run).map_err(failed)?);
        Ok(())
    }

    /// A process has died.
    pub(super) fn call(&self) {
        self.sweeps_due.store(SWEEPS_PER_DEATH, SeqCst);
        self.cleaning_due.store(true, SeqCst);
        self.threads.iter().for_each(|thread| thread.thread().unpark());
    }

    /// Ends both threads.
    pub(super) fn stop(&mut self) {
        self.ended.store(true, SeqCst);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A panic of a cleaning thread costs nothing: the whole domain is removed after this.
            let _ = thread.join();
        }
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

fn clean(domain: &Domain, due: &AtomicBool, ended: &AtomicBool) {
    let Ok(node) = create_node(domain, "cleaner") else { return };
    while !ended.load(SeqCst) {
        if due.swap(false, SeqCst) {
            node.try_cleanup_dead_nodes();
        } else {
            thread::park();
        }
    }
}
