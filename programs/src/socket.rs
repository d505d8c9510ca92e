//! What goes over the socket between a simulated flight and a program: messages of bytes, each with its length before it.
//!
//! The flight sends the scenario as TOML. The program makes its controller and sends the greeting. Then each situation gets a wish.
//!
//! Must never know what a message means.

use ringwing_agent::controller::message::{LAYOUT, SITUATION_BYTES, WISH_BYTES};
use std::io::{self, Read, Write};

/// The longest message to a program. Scenarios are the longest ones; a longer limit only lets a damaged length ask for more memory.
pub(crate) const LONGEST_TO_PROGRAM: usize = 64 << 20;
/// The longest message from a program: a wish or a greeting.
pub(crate) const LONGEST_FROM_PROGRAM: usize = if WISH_BYTES > 256 { WISH_BYTES } else { 256 };

/// What a program says when its controller is ready. A program that was built against another layout of the messages says something
/// else.
pub(crate) fn greeting() -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!("ringwing {version}, layout {LAYOUT}, situation {SITUATION_BYTES} bytes, wish {WISH_BYTES} bytes")
}

/// Sends one message.
pub(crate) fn send(to: &mut impl Write, message: &[u8]) -> io::Result<()> {
    let length = u32::try_from(message.len()).map_err(|_| io::ErrorKind::InvalidInput)?;
    // In one piece: two writes would wake the reader twice.
    to.write_all(&[&length.to_le_bytes(), message].concat())
}

/// Receives one message of at most `longest` bytes; `None` if the sender has closed the socket before it.
pub(crate) fn receive(from: &mut impl Read, longest: usize) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; size_of::<u32>()];
    match from.read_exact(&mut length) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        Err(error) => return Err(error),
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > longest {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("a message of {length} bytes")));
    }
    let mut message = vec![0; length];
    from.read_exact(&mut message)?;
    Ok(Some(message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_arrive_whole_and_in_order_and_the_end_is_seen() {
        let mut stream = Vec::new();
        for message in [&b"one"[..], b"", b"three"] {
            send(&mut stream, message).unwrap();
        }
        let mut from = stream.as_slice();
        let received: Vec<_> = std::iter::from_fn(|| receive(&mut from, 10).unwrap()).collect();
        assert_eq!(received, [&b"one"[..], b"", b"three"]);
        assert!(receive(&mut &stream[..6], 10).is_err(), "the sender ended within a message");
        assert!(receive(&mut &u32::MAX.to_le_bytes()[..], 10).is_err(), "a damaged length");
    }
}
