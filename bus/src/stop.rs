//! The request to a process to stop, by a signal or because its run is gone.
//!
//! Must never end the process: its own loop looks at the flag.

use crate::BusError;
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

/// How often a process without a parent in the run looks whether the run still exists. Longer leaves orphans around for
/// longer; shorter costs each process started by hand a few system calls more.
const WATCH_PERIOD: Duration = Duration::from_millis(500);

/// Set once the process is asked to stop, and never reset.
#[derive(Debug, Clone, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// A flag that SIGTERM and SIGINT set.
    pub fn on_signals() -> Result<Self, BusError> {
        let flag = Self::default();
        for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
            signal_hook::flag::register(signal, flag.0.clone())
                .map_err(BusError::system("cannot handle signals"))?;
        }
        Ok(flag)
    }

    /// Starts a thread that sets the flag once `condition` no longer holds.
    pub(crate) fn set_unless(&self, condition: impl Fn() -> bool + Send + 'static) -> Result<(), BusError> {
        let flag = self.0.clone();
        let watch = move || {
            while condition() {
                thread::sleep(WATCH_PERIOD);
            }
            flag.store(true, Relaxed);
        };
        thread::Builder::new().spawn(watch).map(drop).map_err(BusError::system("cannot start a thread"))
    }

    /// Whether the process is asked to stop.
    pub fn is_set(&self) -> bool {
        self.0.load(Relaxed)
    }
}
