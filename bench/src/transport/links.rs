//! Connections of one process to several others, over which the same kind of message goes.
//!
//! Must never let a message of another tick pass for the one that is waited for.

use super::{
    connection::PeerConnection,
    exchange::{MessageSizes, put_tick, tick_in},
};
use std::io;

/// Connections to processes that all get and send messages of the same sizes.
pub(super) struct Links {
    connections: Vec<PeerConnection>,
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
}

impl Links {
    pub(super) fn new(connections: Vec<PeerConnection>, sizes: MessageSizes) -> Self {
        // Not zeros: the kernel maps zeroed pages only once they are written.
        Self { connections, outgoing: vec![1; sizes.outgoing], incoming: vec![1; sizes.incoming] }
    }

    /// Sends the message of `tick` to all.
    pub(super) fn send(&mut self, tick: i64) -> io::Result<()> {
        put_tick(&mut self.outgoing, tick);
        self.connections.iter_mut().try_for_each(|connection| connection.send(&self.outgoing))
    }

    /// Receives the next message of each, which has to be of `tick`.
    pub(super) fn receive(&mut self, tick: i64) -> io::Result<()> {
        for connection in &mut self.connections {
            connection.receive(&mut self.incoming)?;
            let received = tick_in(&self.incoming);
            if received != tick {
                return Err(io::Error::other(format!("a message of tick {received} came, not of {tick}")));
            }
        }
        Ok(())
    }

    /// Waits for the next message of the first connection, and returns its tick.
    pub(super) fn next_tick(&mut self) -> io::Result<i64> {
        let first = self.connections.first_mut().ok_or_else(|| io::Error::other("not connected"))?;
        first.receive(&mut self.incoming)?;
        Ok(tick_in(&self.incoming))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixDatagram;

    #[test]
    fn a_message_of_another_tick_is_refused() {
        let (near, far) = UnixDatagram::pair().unwrap();
        let links = |socket| {
            let sizes = MessageSizes { outgoing: 40, incoming: 40 };
            Links::new(vec![PeerConnection::UnixDatagram(socket)], sizes)
        };
        let (mut near, mut far) = (links(near), links(far));
        near.send(4).unwrap();
        near.send(5).unwrap();
        assert_eq!(far.next_tick().unwrap(), 4);
        let error = far.receive(6).unwrap_err();
        assert!(error.to_string().contains("of tick 5 came, not of 6"), "{error}");
    }
}
