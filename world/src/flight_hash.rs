//! The hash of a flight, over everything that was sensed and answered in it.
//!
//! Must never depend on when or in which portions the bytes are hashed.

use xxhash_rust::xxh3::Xxh3;

/// Most bytes that wait to be hashed: a tick of a large swarm. With more, they leave the cache before they are hashed; with
/// fewer, a large swarm hashes before its tick opens.
const WAITING_BYTES: usize = 1 << 18;

/// A hash that can be computed later: taking in bytes only copies them.
#[derive(Clone)]
pub(crate) struct FlightHash {
    hash: Xxh3,
    waiting: Vec<u8>,
}

impl FlightHash {
    /// The hash of a flight that has not begun.
    pub(crate) fn new() -> Self {
        Self { hash: Xxh3::new(), waiting: Vec::new() }
    }

    /// Takes in the next `bytes`.
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        if self.waiting.len() + bytes.len() > WAITING_BYTES {
            self.catch_up();
        }
        self.waiting.extend_from_slice(bytes);
    }

    /// Hashes everything that was taken in.
    pub(crate) fn catch_up(&mut self) {
        self.hash.update(&self.waiting);
        self.waiting.clear();
    }

    /// The hash of everything that was taken in, as 32 hexadecimal digits.
    pub(crate) fn digits(&self) -> String {
        let mut whole = self.clone();
        whole.catch_up();
        format!("{:032x}", whole.hash.digest128())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn when_the_bytes_are_hashed_does_not_matter(
            portions in proptest::collection::vec((proptest::collection::vec(any::<u8>(), 0..600), any::<bool>()), 0..20),
        ) {
            let (mut late, mut all) = (FlightHash::new(), Vec::new());
            for (bytes, is_time) in &portions {
                late.take(bytes);
                all.extend_from_slice(bytes);
                if *is_time {
                    late.catch_up();
                }
            }
            prop_assert_eq!(late.digits(), format!("{:032x}", xxhash_rust::xxh3::xxh3_128(&all)));
        }
    }

    #[test]
    fn a_flight_whose_hash_nobody_catches_up_keeps_few_bytes() {
        let mut hash = FlightHash::new();
        (0..1000).for_each(|_| hash.take(&[7; 1000]));
        assert!(hash.waiting.len() <= WAITING_BYTES);
        assert_eq!(hash.digits(), format!("{:032x}", xxhash_rust::xxh3::xxh3_128(&vec![7; 1_000_000])));
    }
}
