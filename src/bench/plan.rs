//! In which order cases are measured: all of them in each round, shuffled anew each time.
//!
//! So a machine that slows down shows as spread, and not as a difference between cases. Pure: the seed decides.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// The order in which `cases` cases are measured, by their places, `repeats` times each.
pub(super) fn order(cases: usize, repeats: u32, seed: u64) -> Vec<usize> {
    let mut stream = ChaCha8Rng::seed_from_u64(seed);
    (0..repeats).flat_map(|_| shuffled(cases, &mut stream)).collect()
}

/// Fisher and Yates's: every order is as likely.
fn shuffled(count: usize, stream: &mut ChaCha8Rng) -> Vec<usize> {
    let mut places: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        let other = stream.next_u64() % (last as u64 + 1);
        places.swap(last, other as usize);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_round_measures_every_case_once() {
        let order = order(40, 5, 7);
        for round in order.chunks(40) {
            let mut places = round.to_vec();
            places.sort_unstable();
            assert_eq!(places, (0..40).collect::<Vec<_>>());
        }
        assert_eq!(order.len(), 200);
        assert_ne!(order[..40], order[40..80], "rounds differ");
    }

    #[test]
    fn the_seed_decides() {
        assert_eq!(order(40, 3, 7), order(40, 3, 7));
        assert_ne!(order(40, 3, 7), order(40, 3, 8));
    }

    #[test]
    fn of_one_case_or_none_there_is_one_order() {
        assert_eq!(order(1, 3, 7), [0, 0, 0]);
        assert!(order(0, 3, 7).is_empty());
    }
}
