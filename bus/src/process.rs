//! What a process asks of the operating system to live and end with its run.
//!
//! Must never end another process.

use crate::BusError;
use rustix::{
    process::{
        Pid, Resource, Rlimit, Signal, getpid, getppid, getrlimit, kill_process,
        set_parent_process_death_signal, setrlimit,
    },
    thread::set_name,
};
use std::{ffi::CString, fs, io, path::Path, sync::Arc};

/// Whether a process with the id `pid` exists.
pub fn is_running(pid: u32) -> bool {
    Path::new("/proc").join(pid.to_string()).exists()
}

/// Makes the kernel kill this process when its parent `launcher` ends, in whatever way, even while this process is
/// frozen.
///
/// Fails if `launcher` is not the parent, or has ended before the call: then the kernel would never act.
pub fn die_with(launcher: u32) -> Result<(), BusError> {
    // Ask for the signal before checking the parent. In the other order, a launcher that ends in between goes
    // unnoticed.
    set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(BusError::system("cannot tie this process to its launcher"))?;
    let parent = getppid().map(Pid::as_raw_nonzero).map(|pid| pid.get().cast_unsigned());
    if parent == Some(launcher) {
        return Ok(());
    }
    let reason = io::Error::other(format!("process {launcher} is not its parent, or has ended"));
    Err(BusError::system("the launcher ended before this process began")(reason))
}

/// Keeps the processes that this one starts from inheriting its open files, apart from stdin, stdout and stderr.
///
/// iceoryx2 opens its files without the flag for that. For many processes, a [`Starter`](crate::Starter) costs less.
pub fn close_files_on_spawn() {
    // SAFETY: the system call only sets a flag on descriptors of this process. It closes none of them here.
    #[expect(unsafe_code, reason = "no safe wrapper of close_range exists")]
    let _ = unsafe { libc::close_range(3, u32::MAX, libc::CLOSE_RANGE_CLOEXEC.cast_signed()) };
    // A kernel before 5.11 does not know the flag. There the processes inherit the files and never use them.
}

/// The name and value of an environment variable that keeps glibc from registering restartable sequences (rseq(2)) in a new
/// process.
///
/// By default, glibc registers them for every thread. The kernel then writes to the thread's memory after each context switch, where the
/// caches are mostly cold: in two series of interleaved runs with 6 to 200 UAVs, a tick took 0 to 20 % longer. Nothing here
/// uses them; without them, `sched_getcpu` is slower.
pub fn without_restartable_sequences() -> (&'static str, String) {
    const VARIABLE: &str = "GLIBC_TUNABLES";
    const TUNABLE: &str = "glibc.pthread.rseq=0";
    // Keep what the user has set. An older glibc, or another C library, ignores the variable.
    (VARIABLE, with_tunable(std::env::var(VARIABLE).unwrap_or_default(), TUNABLE))
}

/// `set`, a list with colons in between, with `tunable` added unless it is already there.
fn with_tunable(set: String, tunable: &str) -> String {
    if set.is_empty() {
        return tunable.into();
    }
    if set.split(':').any(|one| one == tunable) { set } else { format!("{set}:{tunable}") }
}

/// Sets the name that `top` and `ps` show: the program itself is the same for all processes of a run.
pub(crate) fn set_process_name(name: &str) {
    // The process works without its name as well, so ignore a failure.
    if let Ok(name) = CString::new(name) {
        let _ = set_name(&name);
    }
}

/// Those of `signals` that this process should heed: whoever started it with a signal ignored, such as `nohup`, or a shell that
/// starts a command in the background, does not want that signal to end it.
pub fn heeded(signals: &[i32]) -> Vec<i32> {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = ignored_signals(&status);
    signals.iter().copied().filter(|signal| ignored & (1 << (signal - 1)) == 0).collect()
}

/// The signals that a process ignores, one bit for each, in its `/proc/PID/status`.
fn ignored_signals(status: &str) -> u64 {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Makes writing beyond `ulimit -f` an error, like a full disk. Without this, SIGXFSZ would kill the process.
pub fn survive_file_size_limit() -> Result<(), BusError> {
    // Nobody reads the flag: the handler alone makes the write fail.
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())
        .map(drop)
        .map_err(BusError::system("cannot handle SIGXFSZ"))
}

/// Stops this process, as the terminal's Ctrl-Z would, until somebody lets it go on.
pub fn stop_self() {
    // A process can always send itself a signal.
    let _ = kill_process(getpid(), Signal::STOP);
}

/// Raises the limit of open files as far as this user may: each connection to another process takes some.
pub fn raise_open_files_limit() -> Result<(), BusError> {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum })
        .map_err(BusError::system("cannot raise the limit of open files"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use signal_hook::consts::{SIGHUP, SIGINT, SIGPIPE, SIGTERM};

    #[test]
    fn the_mask_of_ignored_signals_is_read_bit_by_bit() {
        // `nohup` in the background: SIGHUP (1), SIGINT (2) and SIGQUIT (3).
        let mask = ignored_signals("Name:\tx\nSigIgn:\t0000000000000007\nSigCgt:\t0\n");
        let is_ignored = |signal: i32| mask & (1 << (signal - 1)) != 0;
        assert!(is_ignored(SIGHUP) && is_ignored(SIGINT) && !is_ignored(SIGTERM));
        assert_eq!(ignored_signals(""), 0);
    }

    #[test]
    fn a_tunable_joins_those_of_the_user_once() {
        let with = |set: &str| with_tunable(set.into(), "b=0");
        assert_eq!(
            [with(""), with("a=1"), with("b=0"), with("a=1:b=0")],
            ["b=0", "a=1:b=0", "b=0", "a=1:b=0"]
        );
    }

    #[test]
    fn a_signal_that_this_process_ignores_is_not_heeded() {
        // Rust's own start code ignores SIGPIPE.
        assert_eq!(heeded(&[SIGPIPE, SIGTERM]), [SIGTERM]);
    }
}
