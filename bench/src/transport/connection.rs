//! A connection between two processes without iceoryx2: pipes and sockets, used as programs commonly use them.
//!
//! Must never wait in any other way than its kind does: blocking in the kernel, or polling between yields.

use crate::case::Carrier;
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

/// Longest datagram; longer messages are split. UDP refuses 64 KiB and more, and shorter datagrams take more system calls.
const DATAGRAM_BYTES: usize = 32 * 1024;

/// One end of a connection.
#[derive(Debug)]
pub(super) enum PeerConnection {
    /// Two pipes.
    Pipe { out: File, back: File },
    /// Two pipes that are polled.
    Polled { out: File, back: File },
    /// One of a pair of Unix sockets.
    UnixDatagram(UnixDatagram),
    /// A UDP socket that is connected to the other one.
    Udp(UdpSocket),
    /// A TCP stream.
    Tcp(TcpStream),
}

impl PeerConnection {
    /// Both ends of a new connection of the kind that `carrier` uses, as descriptors: a socket, or the writing end of one
    /// pipe and the reading end of another.
    pub(super) fn pair(carrier: &Carrier) -> io::Result<[Vec<OwnedFd>; 2]> {
        if *carrier == Carrier::UnixDatagram {
            let (near, far) = UnixDatagram::pair()?;
            return Ok([vec![near.into()], vec![far.into()]]);
        }
        // A pipe goes one way only, so each direction has its own.
        let ((near_in, far_out), (far_in, near_out)) = (io::pipe()?, io::pipe()?);
        Ok([vec![near_out.into(), near_in.into()], vec![far_out.into(), far_in.into()]])
    }

    /// The connection whose end [`pair`](Self::pair) made.
    pub(super) fn from_end(carrier: &Carrier, end: Vec<OwnedFd>) -> io::Result<Self> {
        let mut descriptors = end.into_iter();
        match (carrier, descriptors.next(), descriptors.next()) {
            // The order is that of `pair`: the writing end comes first.
            (Carrier::Pipe, Some(out), Some(back)) => Ok(Self::pipe(out, back)),
            (Carrier::PipePolled, Some(out), Some(back)) => Self::polled(out, back),
            (Carrier::UnixDatagram, Some(socket), None) => Ok(Self::UnixDatagram(socket.into())),
            _ => Err(io::Error::other("a connection has another number of descriptors")),
        }
    }

    /// Two blocking pipes.
    pub(super) fn pipe(out: impl Into<OwnedFd>, back: impl Into<OwnedFd>) -> Self {
        Self::Pipe { out: File::from(out.into()), back: File::from(back.into()) }
    }

    /// Two pipes that never block.
    pub(super) fn polled(out: impl Into<OwnedFd>, back: impl Into<OwnedFd>) -> io::Result<Self> {
        let (out, back) = (File::from(out.into()), File::from(back.into()));
        for end in [&out, &back] {
            fcntl_setfl(end, fcntl_getfl(end)? | OFlags::NONBLOCK)?;
        }
        Ok(Self::Polled { out, back })
    }

    /// A TCP stream without Nagle's algorithm, which would hold small messages back.
    pub(super) fn tcp(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        Ok(Self::Tcp(stream))
    }

    /// Limits every wait for the other end. Pipes need no limit: they report by themselves that the other end is gone.
    pub(super) fn set_timeout(&self, limit: Duration) -> io::Result<()> {
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
            Self::Polled { out, .. } => write_polled(out, message),
            Self::UnixDatagram(socket) => send_datagrams(message, |part| socket.send(part)),
            Self::Udp(socket) => send_datagrams(message, |part| socket.send(part)),
            Self::Tcp(stream) => stream.write_all(message),
        }
    }

    /// Receives exactly as many bytes as `message` has.
    pub(super) fn receive(&mut self, message: &mut [u8]) -> io::Result<()> {
        match self {
            Self::Pipe { back, .. } => back.read_exact(message),
            Self::Polled { back, .. } => read_polled(back, message),
            Self::UnixDatagram(socket) => receive_datagrams(message, |part| socket.recv(part)),
            Self::Udp(socket) => receive_datagrams(message, |part| socket.recv(part)),
            Self::Tcp(stream) => stream.read_exact(message),
        }
    }
}

fn send_datagrams(message: &[u8], mut send: impl FnMut(&[u8]) -> io::Result<usize>) -> io::Result<()> {
    message.chunks(DATAGRAM_BYTES).try_for_each(|part| uninterrupted(|| send(part)).map(drop))
}

fn receive_datagrams(
    message: &mut [u8],
    mut receive: impl FnMut(&mut [u8]) -> io::Result<usize>,
) -> io::Result<()> {
    for part in message.chunks_mut(DATAGRAM_BYTES) {
        if uninterrupted(|| receive(part))? != part.len() {
            return Err(io::Error::other("a datagram of another length came"));
        }
    }
    Ok(())
}

/// Repeats a system call that a signal interrupted; `write_all` and `read_exact` do so by themselves.
fn uninterrupted<T>(mut call: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match call() {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

fn write_polled(out: &mut File, message: &[u8]) -> io::Result<()> {
    let mut sent = 0;
    while sent < message.len() {
        // A pipe takes only what it has room for, so a long message needs several writes.
        sent += yield_until_ready(|| out.write(&message[sent..]))?;
    }
    Ok(())
}

fn read_polled(back: &mut File, message: &mut [u8]) -> io::Result<()> {
    let mut read = 0;
    while read < message.len() {
        match yield_until_ready(|| back.read(&mut message[read..]))? {
            // A pipe whose other end is closed reads as empty and not as an error; without this, the loop never ends.
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            count => read += count,
        }
    }
    Ok(())
}

fn yield_until_ready(mut call: impl FnMut() -> io::Result<usize>) -> io::Result<usize> {
    loop {
        match call() {
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                // On a shared core, the other process cannot empty or fill the pipe before this one yields.
                thread::yield_now();
            }
            result => return result,
        }
    }
}

/// A descriptor that this process owns, for one that it inherited.
pub(super) fn duplicated(fd: impl AsFd) -> Result<OwnedFd, Errno> {
    rustix::io::dup(fd)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends a message both ways that is larger than any buffer or datagram.
    fn echo(mut near: PeerConnection, mut far: PeerConnection) {
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
    fn long_messages_arrive_complete_over_every_connection() {
        for carrier in [Carrier::Pipe, Carrier::PipePolled, Carrier::UnixDatagram] {
            let ends = PeerConnection::pair(&carrier).unwrap();
            let [near, far] = ends.map(|end| PeerConnection::from_end(&carrier, end).unwrap());
            echo(near, far);
        }
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        echo(PeerConnection::tcp(near).unwrap(), PeerConnection::tcp(listener.accept().unwrap().0).unwrap());
    }

    #[test]
    fn a_polled_pipe_reports_that_its_other_end_is_gone() {
        let ((near_in, far_out), (far_in, near_out)) = (io::pipe().unwrap(), io::pipe().unwrap());
        let mut near = PeerConnection::polled(near_out, near_in).unwrap();
        drop((far_out, far_in));
        assert_eq!(near.receive(&mut [0; 8]).unwrap_err().kind(), ErrorKind::UnexpectedEof);
    }
}
