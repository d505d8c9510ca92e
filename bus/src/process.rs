//! What a process asks of the operating system to live and end with its run.
//!
//! Must never end another process.

use crate::BusError;
use rustix::{
    process::{
        Pid, Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit,
    },
    thread::set_name,
};
use std::{ffi::CString, io, path::Path};

/// Whether a process with the id `pid` exists.
pub fn is_running(pid: u32) -> bool {
    Path::new("/proc").join(pid.to_string()).exists()
}

/// Makes the kernel kill this process when its parent `launcher` ends, in whatever way, even while this process is
/// frozen.
///
/// Fails if `launcher` is not the parent, or has ended before the call: then the kernel would never act.
pub fn die_with(launcher: u32) -> Result<(), BusError> {
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
/// iceoryx2 opens its files without the flag for that. The launcher of a large swarm has thousands of them open, and each
/// process would begin by copying them all.
pub fn close_files_on_spawn() {
    // SAFETY: the system call only sets a flag on descriptors of this process. It closes none of them here.
    #[expect(unsafe_code, reason = "no safe wrapper of close_range exists")]
    let _ = unsafe { libc::close_range(3, u32::MAX, libc::CLOSE_RANGE_CLOEXEC.cast_signed()) };
    // A kernel before 5.11 does not know the flag. There the processes start as before, only more slowly.
}

/// Sets the name that `top` and `ps` show: the program itself is the same for all processes of a run.
pub(crate) fn set_process_name(name: &str) {
    // The process works without its name as well, so ignore a failure.
    if let Ok(name) = CString::new(name) {
        let _ = set_name(&name);
    }
}

/// Raises the limit of open files as far as this user may: each connection to another process takes some.
pub fn raise_open_files_limit() -> Result<(), BusError> {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum })
        .map_err(BusError::system("cannot raise the limit of open files"))
}
