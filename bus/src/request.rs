//! Asks the launcher of a live run for something, such as a fault or a pause, and gets its answer.
//!
//! Must never know what can be asked for.

use crate::{BusError, Domain};
use std::{
    fmt,
    io::{self, Read, Write},
    os::unix::net::UnixStream,
};

/// How an answer begins if the launcher does not do what was asked. The rest of an answer is for people.
pub const REFUSED: &str = "refused: ";

/// What the launcher answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer(String);

impl Answer {
    /// Whether the launcher did not do what was asked.
    pub fn is_refusal(&self) -> bool {
        self.0.starts_with(REFUSED)
    }
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Domain {
    /// Sends a request to the launcher of this run, one line, and waits for its whole answer.
    pub fn ask(&self, request: &str) -> Result<Answer, BusError> {
        let answer = self.exchange(request).map_err(|error| self.no_answer(&error))?;
        // A launcher that ends closes the connection without an answer.
        if answer.is_empty() {
            let problem = "the run ended before it did what was asked".into();
            return Err(BusError::NoAnswer { id: self.id().to_string(), problem });
        }
        Ok(Answer(answer.trim_end().to_owned()))
    }

    fn exchange(&self, request: &str) -> io::Result<String> {
        let mut stream = UnixStream::connect(self.request_path())?;
        writeln!(stream, "{request}")?;
        let mut answer = String::new();
        // This needs no timeout: the launcher closes the connection when it has answered, and the kernel does when it
        // ends.
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    }

    /// The error that the request could not be sent, or that its answer did not come.
    fn no_answer(&self, error: &io::Error) -> BusError {
        // Others may see the socket without being allowed to write to it.
        if error.kind() == io::ErrorKind::PermissionDenied {
            return self.permission_denied();
        }
        let why = if self.has_launcher() { "its launcher does not answer" } else { "its launcher is gone" };
        BusError::NoAnswer { id: self.id().to_string(), problem: format!("{why}: {error}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DomainOwner;
    use std::{io::BufRead, io::BufReader, os::unix::net::UnixListener, thread};

    /// What a launcher that sends `reply` answers to "kill uav 3".
    fn asked(reply: &'static str) -> Result<Answer, BusError> {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let listener = UnixListener::bind(owner.domain().request_path()).unwrap();
        let launcher = thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut line = String::new();
            BufReader::new(stream.try_clone().unwrap()).read_line(&mut line).unwrap();
            stream.write_all(reply.as_bytes()).unwrap();
            line
        });
        let answer = owner.domain().ask("kill uav 3");
        assert_eq!(launcher.join().unwrap(), "kill uav 3\n");
        answer
    }

    #[test]
    fn an_answer_says_whether_it_is_a_refusal() {
        let done = asked("tick 5: kill uav 3\nwarning: late\n").unwrap();
        assert_eq!(done.to_string(), "tick 5: kill uav 3\nwarning: late");
        assert!(!done.is_refusal() && asked("refused: no such uav\n").unwrap().is_refusal());
    }

    #[test]
    fn a_run_that_ends_or_has_no_launcher_gives_no_answer() {
        assert!(asked("").unwrap_err().to_string().ends_with("the run ended before it did what was asked"));
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let error = owner.domain().ask("list").unwrap_err().to_string();
        assert!(error.contains("its launcher does not answer"), "{error}");
    }
}
