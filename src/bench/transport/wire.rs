//! What carries messages between two processes where iceoryx2 does not: pipes and sockets, as people use them.
//!
//! Never waits but as its kind does: blocking, or polling between yields.

use rustix::{
    fs::{OFlags, fcntl_getfl, fcntl_setfl},
    io::Errno,
};
use std::{
    fs::File,
    io::{self, ErrorKind, Read, Write},
    net::{TcpStream, UdpSocket},
    os::{
        fd::{AsFd, OwnedFd},
        unix::net::UnixDatagram,
    },
    thread,
    time::Duration,
};

/// Datagrams are no longer than this: UDP carries less than 64 KiB.
const DATAGRAM_BYTES: usize = 32 * 1024;

/// One end of a connection.
#[derive(Debug)]
pub(super) enum Wire {
    /// Two pipes.
    Pipe { out: File, back: File },
    /// Two pipes that are polled.
    Polled { out: File, back: File },
    /// A pair of Unix sockets.
    UnixDatagram(UnixDatagram),
    /// UDP sockets that are connected to each other.
    Udp(UdpSocket),
    /// A TCP connection.
    Tcp(TcpStream),
}

impl Wire {
    /// Two pipes, blocking.
    pub(super) fn pipe(out: impl Into<OwnedFd>, back: impl Into<OwnedFd>) -> Self {
        Self::Pipe { out: File::from(out.into()), back: File::from(back.into()) }
    }

    /// Two pipes that nobody sleeps at.
    pub(super) fn polled(out: impl Into<OwnedFd>, back: impl Into<OwnedFd>) -> io::Result<Self> {
        let (out, back) = (File::from(out.into()), File::from(back.into()));
        for end in [&out, &back] {
            fcntl_setfl(end, fcntl_getfl(end)? | OFlags::NONBLOCK)?;
        }
        Ok(Self::Polled { out, back })
    }

    /// A TCP connection that sends at once.
    pub(super) fn tcp(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        Ok(Self::Tcp(stream))
    }

    /// No wait for the other end takes longer; a pipe tells by itself when it is gone.
    pub(super) fn set_patience(&self, limit: Duration) -> io::Result<()> {
        match self {
            Self::Pipe { .. } | Self::Polled { .. } => Ok(()),
            Self::UnixDatagram(socket) => socket.set_read_timeout(Some(limit)),
            Self::Udp(socket) => socket.set_read_timeout(Some(limit)),
            Self::Tcp(stream) => stream.set_read_timeout(Some(limit)),
        }
    }

    /// Sends all of `message`.
    pub(super) fn send(&mut self, message: &[u8]) -> io::Result<()> {
        match self {
            Self::Pipe { out, .. } => out.write_all(message),
            Self::Polled { out, .. } => poll(|rest: &[u8]| out.write(rest), message),
            Self::UnixDatagram(socket) => send_parts(message, |part| socket.send(part)),
            Self::Udp(socket) => send_parts(message, |part| socket.send(part)),
            Self::Tcp(stream) => stream.write_all(message),
        }
    }

    /// Fills `message`.
    pub(super) fn receive(&mut self, message: &mut [u8]) -> io::Result<()> {
        match self {
            Self::Pipe { back, .. } => back.read_exact(message),
            Self::Polled { back, .. } => poll_into(back, message),
            Self::UnixDatagram(socket) => receive_parts(message, |part| socket.recv(part)),
            Self::Udp(socket) => receive_parts(message, |part| socket.recv(part)),
            Self::Tcp(stream) => stream.read_exact(message),
        }
    }
}

fn send_parts(message: &[u8], mut send: impl FnMut(&[u8]) -> io::Result<usize>) -> io::Result<()> {
    message.chunks(DATAGRAM_BYTES).try_for_each(|part| retry(|| send(part)).map(drop))
}

fn receive_parts(
    message: &mut [u8],
    mut receive: impl FnMut(&mut [u8]) -> io::Result<usize>,
) -> io::Result<()> {
    for part in message.chunks_mut(DATAGRAM_BYTES) {
        if retry(|| receive(part))? != part.len() {
            return Err(io::Error::other("a datagram of another length came"));
        }
    }
    Ok(())
}

fn retry<T>(mut attempt: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

fn poll(mut write: impl FnMut(&[u8]) -> io::Result<usize>, message: &[u8]) -> io::Result<()> {
    let mut sent = 0;
    while sent < message.len() {
        sent += yield_until_ready(|| write(&message[sent..]))?;
    }
    Ok(())
}

fn poll_into(back: &mut File, message: &mut [u8]) -> io::Result<()> {
    let mut read = 0;
    while read < message.len() {
        match yield_until_ready(|| back.read(&mut message[read..]))? {
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            count => read += count,
        }
    }
    Ok(())
}

fn yield_until_ready(mut attempt: impl FnMut() -> io::Result<usize>) -> io::Result<usize> {
    loop {
        match attempt() {
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                thread::yield_now();
            }
            result => return result,
        }
    }
}

/// A descriptor of this process's own for one that it was started with.
pub(super) fn inherited(fd: impl AsFd) -> Result<OwnedFd, Errno> {
    rustix::io::dup(fd)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends there and back what is larger than any buffer or datagram.
    fn echo(mut near: Wire, mut far: Wire) {
        let message: Vec<u8> = (0..200_000_u32).map(|number| (number % 251) as u8).collect();
        thread::scope(|scope| {
            let there = scope.spawn(|| {
                let mut heard = vec![0; 200_000];
                far.receive(&mut heard).unwrap();
                far.send(&heard).unwrap();
            });
            near.send(&message).unwrap();
            let mut back = vec![0; 200_000];
            near.receive(&mut back).unwrap();
            there.join().unwrap();
            assert!(back == message);
        });
    }

    #[test]
    fn long_messages_come_back_whole_on_every_wire() {
        let pipes = || (io::pipe().unwrap(), io::pipe().unwrap());
        let ((near_in, far_out), (far_in, near_out)) = pipes();
        echo(Wire::pipe(near_out, near_in), Wire::pipe(far_out, far_in));
        let ((near_in, far_out), (far_in, near_out)) = pipes();
        echo(Wire::polled(near_out, near_in).unwrap(), Wire::polled(far_out, far_in).unwrap());
        let (near, far) = UnixDatagram::pair().unwrap();
        echo(Wire::UnixDatagram(near), Wire::UnixDatagram(far));
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        echo(Wire::tcp(near).unwrap(), Wire::tcp(listener.accept().unwrap().0).unwrap());
    }

    #[test]
    fn a_pipe_whose_other_end_is_gone_is_an_error_and_no_wait() {
        let ((near_in, far_out), (far_in, near_out)) = (io::pipe().unwrap(), io::pipe().unwrap());
        let mut near = Wire::polled(near_out, near_in).unwrap();
        drop((far_out, far_in));
        assert_eq!(near.receive(&mut [0; 8]).unwrap_err().kind(), ErrorKind::UnexpectedEof);
    }
}
