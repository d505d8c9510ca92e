//! A thread that starts processes, with a table of open files of its own.
//!
//! A new process begins with a copy of the table of whoever starts it, and closes what it is not to inherit. The launcher of
//! 1000 UAVs has 16,000 files open. To copy and close them for each process took a fifth of the processor time of a start.
//!
//! Must never use a file that another thread has opened later.

use crate::BusError;
use std::{
    io,
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};

type Order = Box<dyn FnOnce() + Send>;

/// The thread. It ends when this is dropped, and with it the processes that it has started and that
/// [die with](crate::die_with) their launcher: the kernel takes the thread for their parent.
#[derive(Debug)]
pub struct Starter {
    orders: Sender<Order>,
}

impl Starter {
    /// Starts the thread. What is open by now stays open until it ends, so there should be little.
    ///
    /// Handlers of signals that write to a file have to be there already: they may run on this thread as well.
    pub fn start() -> Result<Self, BusError> {
        let (orders, incoming) = channel();
        let thread = thread::Builder::new().name("starter".into());
        thread.spawn(move || work(&incoming)).map_err(BusError::system("cannot start a thread"))?;
        let starter = Self { orders };
        // The thread has its table before this returns, so it never keeps a file open that is opened later.
        starter.run(|| ()).map_err(BusError::system("cannot start a thread"))?;
        Ok(starter)
    }

    /// Does `work` on the thread, and waits for the outcome.
    ///
    /// What `work` opens can be used only there, and on threads that `work` starts. It must use no file that another thread has
    /// opened since this one was started.
    ///
    /// # Errors
    /// The thread has ended, because an earlier `work` has panicked.
    pub fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> io::Result<T> {
        let (outcome, incoming) = channel();
        // Nobody waits for the outcome only if this call has ended, and it never ends first.
        let order = move || drop(outcome.send(work()));
        let ended = || io::Error::other("the thread that starts processes has ended");
        self.orders.send(Box::new(order)).map_err(|_| ended())?;
        incoming.recv().map_err(|_| ended())
    }
}

fn work(orders: &Receiver<Order>) {
    own_files();
    for order in orders {
        order();
    }
}

/// Gives this thread a table of open files of its own, with what is open now. Its processes inherit only stdin, stdout and stderr.
fn own_files() {
    const HOW: u32 = libc::CLOSE_RANGE_UNSHARE | libc::CLOSE_RANGE_CLOEXEC;
    // SAFETY: the new table is a copy, and no value on this thread owns a file yet. The other threads keep theirs.
    #[expect(unsafe_code, reason = "no safe wrapper of close_range exists")]
    let _ = unsafe { libc::close_range(3, u32::MAX, HOW.cast_signed()) };
    // A kernel before 5.11 does not know this. There the thread shares the table: processes start more slowly, and inherit files
    // that they never use.
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        fs::{self, File},
        io::{Read, Write},
        os::{
            fd::{AsRawFd, RawFd},
            unix::net::UnixStream,
        },
        process::Command,
    };

    fn is_open_here(file: RawFd) -> bool {
        // Of this thread: `/proc/self` would show the table of the first thread.
        fs::exists(format!("/proc/thread-self/fd/{file}")).unwrap()
    }

    #[test]
    fn files_that_other_threads_open_later_are_not_copied() {
        let starter = Starter::start().unwrap();
        let mut later = File::open("/proc/self/status").unwrap();
        let number = later.as_raw_fd();
        assert!(!starter.run(move || is_open_here(number)).unwrap());
        assert!(is_open_here(number) && later.read_to_string(&mut String::new()).is_ok());
    }

    #[test]
    fn a_process_inherits_nothing_by_chance() {
        let starter = Starter::start().unwrap();
        let files = starter.run(|| Command::new("ls").arg("/proc/self/fd").output().unwrap()).unwrap();
        // The fourth file is the folder that it lists.
        assert_eq!(String::from_utf8(files.stdout).unwrap(), "0\n1\n2\n3\n");
    }

    #[test]
    fn a_process_inherits_what_the_thread_has_opened_for_it() {
        let starter = Starter::start().unwrap();
        let output = starter.run(|| {
            let (mut reader, writer) = io::pipe().unwrap();
            let mut child = Command::new("echo").arg("here").stdout(writer).spawn().unwrap();
            let mut text = String::new();
            reader.read_to_string(&mut text).unwrap();
            child.wait().unwrap();
            text
        });
        assert_eq!(output.unwrap(), "here\n");
    }

    #[test]
    fn a_signal_handler_that_writes_to_a_file_works_on_the_thread() {
        let (mut reader, writer) = UnixStream::pair().unwrap();
        signal_hook::low_level::pipe::register(signal_hook::consts::SIGUSR2, writer).unwrap();
        let starter = Starter::start().unwrap();
        starter.run(|| signal_hook::low_level::raise(signal_hook::consts::SIGUSR2).unwrap()).unwrap();
        assert_eq!(reader.read(&mut [0; 8]).unwrap(), 1);
    }

    #[test]
    fn stderr_stays_open() {
        let starter = Starter::start().unwrap();
        assert!(starter.run(|| io::stderr().write_all(b"")).unwrap().is_ok());
        assert!(starter.run(|| is_open_here(2)).unwrap());
    }

    #[test]
    fn after_a_panic_the_next_order_fails() {
        let starter = Starter::start().unwrap();
        assert!(starter.run(|| panic!("on purpose")).is_err());
        assert!(starter.run(|| ()).is_err());
    }
}
