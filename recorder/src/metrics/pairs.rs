//! Which UAVs come closest to each other, among ring neighbours and among all others.

use super::{ClosestPair, FlownRing};
use nalgebra::Point2;
use ringwing_flight::Tick;

/// Two UAVs and how far apart they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UavPair {
    /// Their distance.
    pub distance_m: f64,
    /// The lower number.
    pub uav: u32,
    /// The higher number.
    pub other: u32,
}

/// The closest pairs of one moment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pairs {
    /// The closest ring neighbours.
    pub adjacent: Option<UavPair>,
    /// The closest two that are not ring neighbours.
    pub other: Option<UavPair>,
}

impl Pairs {
    /// The closest pairs of UAVs at these places, apart for neighbours in `ring` and for all others. Sorts the places
    /// from west to east.
    pub(super) fn among(places: &mut [(u32, Point2<f64>)], ring: &FlownRing) -> Self {
        // There are n^2 / 2 pairs a tick. From west to east, all but a few are too far apart in x alone to be closest.
        // In UAV order a ring consists of a few runs that rise or fall, which a stable sort only has to merge.
        places.sort_by(|(_, one), (_, two)| one.x.total_cmp(&two.x));
        let (mut adjacent, mut other) = (Candidate::NONE, Candidate::NONE);
        for (index, (uav, place)) in places.iter().enumerate() {
            for (number, there) in &places[index + 1..] {
                let between = there - place;
                // Rounding keeps the order of squares, so all places behind the break are farther away.
                let farthest = adjacent.squared.max(other.squared);
                if between.x * between.x > farthest {
                    break;
                }
                let squared = between.norm_squared();
                // Ask the ring last: looking up neighbours takes longer than a distance.
                if squared <= farthest {
                    let kind = if ring.are_neighbours(*uav, *number) { &mut adjacent } else { &mut other };
                    kind.offer(squared, *uav, *number);
                }
            }
        }
        Self { adjacent: adjacent.pair(), other: other.pair() }
    }

    /// The closest two UAVs, neighbours or not.
    pub fn pair(&self) -> Option<UavPair> {
        closer(self.adjacent, self.other)
    }
}

#[derive(Clone, Copy)]
struct Candidate {
    squared: f64,
    uavs: (u32, u32),
}

impl Candidate {
    const NONE: Self = Self { squared: f64::INFINITY, uavs: (0, 0) };

    fn offer(&mut self, squared: f64, uav: u32, other: u32) {
        let uavs = (uav.min(other), uav.max(other));
        // Of equally close pairs the one with the lowest numbers, whatever the order of the search.
        if (squared, uavs) < (self.squared, self.uavs) {
            *self = Self { squared, uavs };
        }
    }

    fn pair(self) -> Option<UavPair> {
        let (uav, other) = self.uavs;
        // Infinite without any pair, or if the square overflows. JSON could hold neither.
        (self.squared < f64::INFINITY).then(|| UavPair { distance_m: self.squared.sqrt(), uav, other })
    }
}

fn closer(one: Option<UavPair>, two: Option<UavPair>) -> Option<UavPair> {
    one.into_iter().chain(two).min_by(|one, two| one.distance_m.total_cmp(&two.distance_m))
}

/// The closest pairs of the flight so far, each with its tick.
#[derive(Debug, Clone, Default)]
pub(super) struct ClosestSoFar {
    adjacent: Option<(UavPair, i64)>,
    other: Option<(UavPair, i64)>,
}

impl ClosestSoFar {
    pub(super) fn observe(&mut self, tick: i64, pairs: &Pairs) {
        keep_closer(&mut self.adjacent, pairs.adjacent, tick);
        keep_closer(&mut self.other, pairs.other, tick);
    }

    pub(super) fn adjacent(&self, rate_hz: u32) -> Option<ClosestPair> {
        self.adjacent.map(|closest| timed(closest, rate_hz))
    }

    pub(super) fn other(&self, rate_hz: u32) -> Option<ClosestPair> {
        self.other.map(|closest| timed(closest, rate_hz))
    }

    pub(super) fn pair(&self, rate_hz: u32) -> Option<ClosestPair> {
        let both = self.adjacent.into_iter().chain(self.other);
        both.min_by(|one, two| one.0.distance_m.total_cmp(&two.0.distance_m))
            .map(|closest| timed(closest, rate_hz))
    }
}

fn keep_closer(closest: &mut Option<(UavPair, i64)>, pair: Option<UavPair>, tick: i64) {
    // Strictly closer, so that of equal distances the first moment is kept.
    if let Some(pair) =
        pair.filter(|pair| closest.is_none_or(|(so_far, _)| pair.distance_m < so_far.distance_m))
    {
        *closest = Some((pair, tick));
    }
}

fn timed((UavPair { distance_m, uav, other }, tick): (UavPair, i64), rate_hz: u32) -> ClosestPair {
    ClosestPair { distance_m, uav, other, time_s: Tick(tick).seconds(rate_hz) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use proptest::prelude::*;

    fn numbered(places: &[(f64, f64)]) -> Vec<(u32, Point2<f64>)> {
        (1..).zip(places.iter().map(|(x, y)| Point2::new(*x, *y))).collect()
    }

    fn pairs(places: &[(f64, f64)]) -> Pairs {
        Pairs::among(&mut numbered(places), &FlownRing::new(&testing::ring_of(places.len() as u32, 40.0)))
    }

    #[test]
    fn the_first_and_the_last_are_neighbours() {
        let closest = pairs(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 3.0)]);
        assert_eq!(closest.adjacent, Some(UavPair { distance_m: 3.0, uav: 1, other: 4 }));
        assert_eq!(closest.other.map(|pair| (pair.uav, pair.other)), Some((2, 4)));
        assert_eq!(closest.pair(), closest.adjacent);
    }

    #[test]
    fn neighbours_are_those_of_the_ring_that_has_closed() {
        let mut places = numbered(&[(0.0, 0.0), (1.0, 0.0), (5.0, 0.0), (9.0, 0.0), (50.0, 0.0)]);
        let mut scenario = testing::ring_of(5, 40.0);
        scenario.control.ring_closes = true;
        let mut ring = FlownRing::new(&scenario);
        assert_eq!(
            Pairs::among(&mut places, &ring).adjacent.map(|pair| (pair.uav, pair.other)),
            Some((1, 2))
        );
        ring.follow(0, |number| number != 2);
        // UAV 2 has left the ring: it is nobody's neighbour, and UAV 1 and 3 have become neighbours.
        let closest = Pairs::among(&mut places, &ring);
        assert_eq!(closest.other.map(|pair| (pair.uav, pair.other)), Some((1, 2)));
        assert_eq!(closest.adjacent.map(|pair| (pair.uav, pair.other)), Some((3, 4)));
        let mut far = numbered(&[(0.0, 0.0), (1.0, 0.0), (5.0, 0.0), (19.0, 0.0), (50.0, 0.0)]);
        assert_eq!(Pairs::among(&mut far, &ring).adjacent.map(|pair| (pair.uav, pair.other)), Some((1, 3)));
    }

    #[test]
    fn in_a_ring_of_three_all_are_neighbours() {
        assert_eq!(pairs(&[(0.0, 0.0), (1.0, 0.0), (5.0, 0.0)]).other, None);
    }

    #[test]
    fn the_closest_of_the_flight_keeps_its_first_moment() {
        let mut closest = ClosestSoFar::default();
        for (tick, distance) in [(0, 9.0), (10, 4.0), (20, 4.0), (30, 6.0)] {
            closest.observe(tick, &pairs(&[(0.0, 0.0), (distance, 0.0), (99.0, 0.0)]));
        }
        let expected = ClosestPair { distance_m: 4.0, uav: 1, other: 2, time_s: 1.0 };
        assert_eq!(closest.pair(10), Some(expected));
    }

    proptest! {
        #[test]
        fn of_equally_close_pairs_the_one_with_the_lowest_numbers_is_found(
            places in proptest::collection::vec((-3..3_i32, -3..3_i32), 4..30),
        ) {
            let places: Vec<_> = places.into_iter().map(|(x, y)| (f64::from(x), f64::from(y))).collect();
            let mut plain = [Candidate::NONE; 2];
            let ring = FlownRing::new(&testing::ring_of(places.len() as u32, 40.0));
            for (index, (uav, place)) in numbered(&places).into_iter().enumerate() {
                for (number, there) in numbered(&places).into_iter().skip(index + 1) {
                    let squared = (place - there).norm_squared();
                    let kind = &mut plain[usize::from(!ring.are_neighbours(uav, number))];
                    if squared < kind.squared {
                        *kind = Candidate { squared, uavs: (uav, number) };
                    }
                }
            }
            let [adjacent, other] = plain.map(Candidate::pair);
            prop_assert_eq!(pairs(&places), Pairs { adjacent, other });
        }

        #[test]
        fn the_fast_search_finds_the_same_pairs_as_a_plain_one(
            places in proptest::collection::vec((-100.0..100.0_f64, -100.0..100.0_f64), 3..40),
            // Places that are nearer than a metre, too.
            scale in prop_oneof![Just(1.0), Just(0.01)],
        ) {
            let places: Vec<_> = places.into_iter().map(|(x, y)| (scale * x, scale * y)).collect();
            let count = places.len();
            let distance = |i: usize, j: usize| (places[i].0 - places[j].0).hypot(places[i].1 - places[j].1);
            let all = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
            let (near, far): (Vec<_>, Vec<_>) = all.partition(|(i, j)| j - i == 1 || j - i == count - 1);
            let least = |pairs: Vec<(usize, usize)>| pairs.iter().map(|(i, j)| distance(*i, *j)).reduce(f64::min);
            let found = pairs(&places);
            for (found, expected) in [(found.adjacent, least(near)), (found.other, least(far))] {
                prop_assert_eq!(found.is_some(), expected.is_some());
                prop_assert!(found.map_or(0.0, |pair| pair.distance_m - expected.unwrap()).abs() < 1e-9);
            }
        }
    }
}
