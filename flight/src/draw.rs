//! Seeded draws: pure functions of the seed, the purpose and the moment of a draw.
//!
//! Draws must never share a stream: then a draw that is added for one purpose shifts no other.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// The stream of draws for one decision.
#[derive(Debug, Clone)]
pub struct Draws(ChaCha8Rng);

impl Draws {
    /// The draws of `seed` at `moment` for the purpose that `words` identifies. If any of the three differs, so do all
    /// draws.
    pub fn new(seed: u64, words: [u64; 3], moment: u64) -> Self {
        // The seed and the three words fill the 256 bits of ChaCha's key, and the moment is its stream number. So
        // every combination has its own stream, without any hashing that could make two of them equal.
        let mut key = [0; 32];
        for (place, word) in key.chunks_exact_mut(8).zip([seed, words[0], words[1], words[2]]) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        let mut stream = ChaCha8Rng::from_seed(key);
        stream.set_stream(moment);
        Self(stream)
    }

    /// A uniform number in [0, 1).
    ///
    /// Made of the 53 bits that a double holds, instead of by a distribution of the `rand` crates, which may change
    /// from version to version.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A Gaussian number of mean 0 and standard deviation 1, by the transform of Box and Muller.
    pub fn normal(&mut self) -> f64 {
        // `uniform` can be 0 but not 1, and the logarithm needs a number above 0.
        let (radius, angle) = (1.0 - self.uniform(), std::f64::consts::TAU * self.uniform());
        (-2.0 * libm::log(radius)).sqrt() * libm::cos(angle)
    }

    /// A number of the Lomax distribution, a Pareto tail that begins at 0, with this `mean` and a `shape` above 1. A
    /// smaller shape makes the tail longer.
    pub fn tail(&mut self, mean: f64, shape: f64) -> f64 {
        // The inverse of the distribution function at a uniform number. The mean of a Lomax distribution is scale /
        // (shape - 1).
        let scale = mean * (shape - 1.0);
        scale * (libm::pow(1.0 - self.uniform(), -1.0 / shape) - 1.0)
    }

    /// `count` different numbers from 1 to `last`, in order; all of them if `count` is larger. Every set is equally
    /// likely.
    pub fn choose(&mut self, count: u32, last: u32) -> Vec<u32> {
        let mut all: Vec<u32> = (1..=last).collect();
        let count = (count as usize).min(all.len());
        // The first `count` steps of a Fisher-Yates shuffle.
        for place in 0..count {
            let left = all.len() - place;
            all.swap(place, place + (self.uniform() * left as f64) as usize);
        }
        all.truncate(count);
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean_of(draw: impl Fn(&mut Draws) -> f64) -> f64 {
        const COUNT: u64 = 20_000;
        (0..COUNT).map(|moment| draw(&mut Draws::new(7, [1, 2, 3], moment))).sum::<f64>() / COUNT as f64
    }

    #[test]
    fn each_distribution_has_its_mean_and_variance() {
        assert!((mean_of(Draws::uniform) - 0.5).abs() < 0.01);
        assert!(mean_of(Draws::normal).abs() < 0.03);
        assert!((mean_of(|draws| draws.normal().powi(2)) - 1.0).abs() < 0.05);
        assert!((mean_of(|draws| draws.tail(0.2, 3.0)) - 0.2).abs() < 0.01);
    }

    #[test]
    fn another_seed_purpose_or_moment_gives_another_draw() {
        let draw = |seed, words, moment| Draws::new(seed, words, moment).uniform();
        let one = draw(1, [1, 2, 3], 4);
        assert_eq!(one, draw(1, [1, 2, 3], 4));
        for other in
            [draw(2, [1, 2, 3], 4), draw(1, [2, 1, 3], 4), draw(1, [1, 2, 4], 4), draw(1, [1, 2, 3], 5)]
        {
            assert_ne!(one, other);
        }
    }

    #[test]
    fn every_number_is_chosen_equally_often() {
        let mut counts = [0; 5];
        for moment in 0..5000 {
            let chosen = Draws::new(1, [0; 3], moment).choose(2, 5);
            assert!(chosen.len() == 2 && chosen[0] < chosen[1]);
            for number in chosen {
                counts[number as usize - 1] += 1;
            }
        }
        assert!(counts.iter().all(|count| (1850..2150).contains(count)), "{counts:?}");
        assert_eq!(Draws::new(1, [0; 3], 0).choose(9, 3), [1, 2, 3]);
    }
}
