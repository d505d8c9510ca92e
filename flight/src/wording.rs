//! Words for numbers in sentences that people read.

use std::fmt::Display;

/// A count with its noun, which takes an s in the plural: `1 UAV`, `2 UAVs`, `0 messages`.
pub fn counted<N: Copy + Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let plural = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_is_singular() {
        let counts = [0, 1, 2].map(|count: usize| counted(count, "message"));
        assert_eq!(counts, ["0 messages", "1 message", "2 messages"]);
        assert_eq!(counted(1_u64, "UAV"), "1 UAV");
    }
}
