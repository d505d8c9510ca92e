//! All UAVs in the order of their x coordinate, to find those that are near each other.
//!
//! Aircraft that are near each other are near in x, too. So each UAV is compared with the few before and after it, instead of
//! with all others.
//!
//! Never knows what nearness is for, nor which UAVs have left the sky.

use crate::Airframe;
use nalgebra::Point2;
use ringwing_flight::UavId;

/// The order.
#[derive(Debug, Clone)]
pub(crate) struct ByX {
    placed: Vec<Placed>,
    /// The place of each UAV in the order, UAV 1 first.
    places: Vec<usize>,
}

/// A UAV and where it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    pub(crate) uav: UavId,
    pub(crate) position: Point2<f64>,
}

impl ByX {
    /// The order of `airframes`, UAV 1 first.
    pub(crate) fn new(airframes: &[Airframe]) -> Self {
        let placed = airframes.iter().map(|one| Placed { uav: one.uav(), position: one.pose().position });
        let mut by_x = Self { placed: placed.collect(), places: vec![0; airframes.len()] };
        by_x.update(airframes);
        by_x
    }

    /// Takes over where the airframes are now.
    pub(crate) fn update(&mut self, airframes: &[Airframe]) {
        for one in &mut self.placed {
            one.position = airframes[one.uav.index()].pose().position;
        }
        // Hardly anybody has overtaken anybody since the last tick, and a sort of what is nearly sorted is cheap.
        self.placed.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
        for (place, one) in self.placed.iter().enumerate() {
            self.places[one.uav.index()] = place;
        }
    }

    /// Every two UAVs that are at most `range_m` apart in x, each two once.
    pub(crate) fn pairs(&self, range_m: f64) -> impl Iterator<Item = [Placed; 2]> {
        self.placed.iter().enumerate().flat_map(move |(place, one)| {
            let after = self.placed[place + 1..].iter();
            after
                .take_while(move |other| other.position.x - one.position.x <= range_m)
                .map(|other| [*one, *other])
        })
    }

    /// The other UAVs that are at most `range_m` from `uav` in x, in no useful order.
    pub(crate) fn others(&self, uav: UavId, range_m: f64) -> impl Iterator<Item = Placed> {
        let place = self.places[uav.index()];
        let x = self.placed[place].position.x;
        let is_near = move |other: &&Placed| (other.position.x - x).abs() <= range_m;
        let before = self.placed[..place].iter().rev().take_while(is_near);
        before.chain(self.placed[place + 1..].iter().take_while(is_near)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use ringwing_flight::Tick;
    use ringwing_scenario::{Scenario, StartState};
    use std::collections::BTreeSet;

    fn airframes(places: &[(f64, f64)]) -> Vec<Airframe> {
        let at = |(index, place): (usize, &(f64, f64))| {
            let start =
                StartState { position_m: [place.0, 0.0], heading_deg: place.1, speed_m_s: 12.0 + place.1 };
            Airframe::new(&Scenario::default(), UavId(index as u32 + 1), &start)
        };
        places.iter().enumerate().map(at).collect()
    }

    proptest! {
        #[test]
        fn it_finds_what_a_full_search_finds(
            places in prop::collection::vec((0.0..50.0, 0.0..8.0), 1..40), range_m in 0.0..20.0, ticks in 0_i64..200,
        ) {
            let mut flying = airframes(&places);
            let mut by_x = ByX::new(&flying);
            for tick in 0..ticks {
                for one in &mut flying {
                    one.step(Tick(tick));
                }
                by_x.update(&flying);
            }
            let is_near = |a: &Airframe, b: &Airframe| (a.pose().position.x - b.pose().position.x).abs() <= range_m;
            let mut pairs = BTreeSet::new();
            for a in &flying {
                let near: BTreeSet<_> =
                    flying.iter().filter(|b| a.uav() != b.uav() && is_near(a, b)).map(Airframe::uav).collect();
                let found: Vec<Placed> = by_x.others(a.uav(), range_m).collect();
                prop_assert!(found.iter().all(|one| one.position == flying[one.uav.index()].pose().position));
                prop_assert_eq!(found.iter().map(|one| one.uav).collect::<BTreeSet<_>>(), near.clone());
                prop_assert_eq!(found.len(), near.len());
                pairs.extend(near.into_iter().map(|b| BTreeSet::from([a.uav(), b])));
            }
            let found: Vec<_> = by_x.pairs(range_m).map(|pair| BTreeSet::from(pair.map(|one| one.uav))).collect();
            prop_assert_eq!(found.len(), pairs.len());
            prop_assert_eq!(found.into_iter().collect::<BTreeSet<_>>(), pairs);
        }
    }
}
