//! The order in which cases are measured: each round measures every case once, in a newly shuffled order.
//!
//! A machine that slows down during a benchmark then shows as spread, not as a difference between cases.
//!
//! Must never draw from anything but the seed.

use ringwing_flight::draw::Draws;

/// Sets the draws of the order apart from all other draws of the same seed.
const PURPOSE: [u64; 3] = [u64::from_le_bytes(*b"benchord"), 0, 0];

/// The order in which `cases` cases are measured `repeats` times, as indices.
pub(crate) fn order(cases: usize, repeats: u32, seed: u64) -> Vec<usize> {
    (0..repeats).flat_map(|round| shuffled(cases, &mut Draws::new(seed, PURPOSE, round.into()))).collect()
}

/// The numbers below `count`, shuffled by Fisher and Yates's method: every order is equally likely.
fn shuffled(count: usize, draws: &mut Draws) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        // A draw is below 1, so `other` is at most `last`.
        let other = (draws.uniform() * (last + 1) as f64) as usize;
        order.swap(last, other);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_round_measures_every_case_once() {
        let order = order(40, 5, 7);
        for round in order.chunks(40) {
            let mut cases = round.to_vec();
            cases.sort_unstable();
            assert_eq!(cases, (0..40).collect::<Vec<_>>());
        }
        assert_eq!(order.len(), 200);
        assert_ne!(order[..40], order[40..80], "rounds differ");
    }

    #[test]
    fn the_order_depends_on_the_seed_alone() {
        assert_eq!(order(40, 3, 7), order(40, 3, 7));
        assert_ne!(order(40, 3, 7), order(40, 3, 8));
    }

    #[test]
    fn every_case_comes_first_equally_often() {
        let mut firsts = [0; 4];
        order(4, 4000, 1).chunks(4).for_each(|round| firsts[round[0]] += 1);
        assert!(firsts.iter().all(|count| (900..1100).contains(count)), "{firsts:?}");
    }

    #[test]
    fn one_case_or_none_needs_no_shuffling() {
        assert_eq!(order(1, 3, 7), [0, 0, 0]);
        assert!(order(0, 3, 7).is_empty());
    }
}
