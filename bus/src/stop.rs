//! The request to a process to stop, by a signal or because its run is gone.
//!
//! Must never end the process: its own loop looks at the flag.

use crate::{BusError, process::heeded};
use signal_hook::consts::{SIGINT, SIGTERM, SIGTSTP};
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

/// The signals that ask a process to stop.
const STOP_SIGNALS: [i32; 2] = [SIGTERM, SIGINT];

/// Set once the process is asked to stop, and never reset.
#[derive(Debug, Clone, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// A flag that SIGTERM and SIGINT set, each unless whoever started this process had it ignored.
    pub fn on_signals() -> Result<Self, BusError> {
        Self::on(&heeded(&STOP_SIGNALS))
    }

    /// A flag that SIGTERM and SIGINT set in a process that a launcher stops by them, whatever the launcher itself ignores.
    pub(crate) fn on_signals_of_launcher() -> Result<Self, BusError> {
        Self::on(&STOP_SIGNALS)
    }

    fn on(signals: &[i32]) -> Result<Self, BusError> {
        let flag = Self::default();
        for signal in signals.iter().copied() {
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
        // The flag says nothing about other memory, so nothing has to be ordered with it.
        self.0.load(Relaxed)
    }
}

/// Set when the user wants the process to stand still, as the terminal's Ctrl-Z says.
#[derive(Debug, Default)]
pub struct SuspendFlag(Arc<AtomicBool>);

impl SuspendFlag {
    /// A flag that SIGTSTP sets, unless whoever started this process had it ignored. From here on the signal does nothing
    /// else.
    pub fn on_signal() -> Result<Self, BusError> {
        let flag = Self::default();
        for signal in heeded(&[SIGTSTP]) {
            signal_hook::flag::register(signal, flag.0.clone())
                .map_err(BusError::system("cannot handle signals"))?;
        }
        Ok(flag)
    }

    /// Whether the process is to stand still. Tells it once for each wish.
    pub fn take(&self) -> bool {
        self.0.swap(false, Relaxed)
    }
}
