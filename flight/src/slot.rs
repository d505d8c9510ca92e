//! The slot of one UAV in the formation, and the way from one slot to another.
//!
//! Must never know who has the slot.

use crate::direction;
use nalgebra::Vector2;

/// A place in the formation, seen from its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Slot {
    /// On a circle.
    Circle(CirclePlace),
    /// On a circle that is stretched to an ellipse.
    Ellipse {
        /// The place before stretching.
        place: CirclePlace,
        /// How it is stretched.
        stretch: Stretch,
    },
    /// Anywhere: the displacement from the centre in metres.
    Plane(Vector2<f64>),
}

/// A place on a circle around the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CirclePlace {
    /// Seen from the centre, in rad. Not wrapped: around the ring it falls from slot to slot, by one turn at most in
    /// all.
    pub bearing_rad: f64,
    /// Distance from the centre, metres.
    pub radius_m: f64,
}

/// How a circle is stretched to an ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// The direction of the formation, in rad.
    pub ahead_rad: f64,
    /// The factor along that direction.
    pub along: f64,
    /// The factor across it.
    pub across: f64,
}

impl CirclePlace {
    fn offset(&self) -> Vector2<f64> {
        direction(self.bearing_rad) * self.radius_m
    }

    fn towards(&self, to: &Self, share: f64) -> Self {
        // Bearings are not wrapped, so a slot turns as far as they say, even by more than half a turn.
        let between = |from: f64, to: f64| from + (to - from) * share;
        Self {
            bearing_rad: between(self.bearing_rad, to.bearing_rad),
            radius_m: between(self.radius_m, to.radius_m),
        }
    }
}

impl Stretch {
    fn of(&self, offset: &Vector2<f64>) -> Vector2<f64> {
        let ahead = direction(self.ahead_rad);
        let left = Vector2::new(-ahead.y, ahead.x);
        ahead * (self.along * ahead.dot(offset)) + left * (self.across * left.dot(offset))
    }
}

impl Slot {
    /// The displacement from the centre to the slot, metres.
    pub fn offset(&self) -> Vector2<f64> {
        match self {
            Self::Circle(place) => place.offset(),
            Self::Ellipse { place, stretch } => stretch.of(&place.offset()),
            Self::Plane(offset) => *offset,
        }
    }

    /// The distance from the centre, metres.
    pub fn radius_m(&self) -> f64 {
        match self {
            // The exact R: the length of a computed offset would be off by some bits.
            Self::Circle(place) => place.radius_m,
            Self::Ellipse { .. } | Self::Plane(_) => self.offset().norm(),
        }
    }

    /// The place after `share` of the way to `to`, from 0 to 1: round the centre where both lie on the same kind of
    /// curve, and straight otherwise.
    #[must_use]
    pub fn towards(&self, to: &Self, share: f64) -> Self {
        // The end is exact: interpolation would round it.
        if share >= 1.0 {
            return *to;
        }
        match (self, to) {
            (Self::Circle(from), Self::Circle(to)) => Self::Circle(from.towards(to, share)),
            (Self::Ellipse { place, stretch }, Self::Ellipse { place: to, stretch: same })
                if stretch == same =>
            {
                Self::Ellipse { place: place.towards(to, share), stretch: *stretch }
            }
            _ => self.straight_towards(to, share),
        }
    }

    /// The place after `share` of the straight way to `to`.
    #[must_use]
    pub fn straight_towards(&self, to: &Self, share: f64) -> Self {
        if share >= 1.0 { *to } else { Self::Plane(self.offset().lerp(&to.offset(), share)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const HERE: CirclePlace = CirclePlace { bearing_rad: 1.0, radius_m: 40.0 };
    const THERE: CirclePlace = CirclePlace { bearing_rad: -1.0, radius_m: 80.0 };
    const STRETCH: Stretch = Stretch { ahead_rad: 0.5, along: 2.0, across: 1.5 };

    fn on_ellipse(place: CirclePlace) -> Slot {
        Slot::Ellipse { place, stretch: STRETCH }
    }

    #[test]
    fn a_stretch_acts_along_and_across_the_direction_of_the_formation() {
        let offset = |bearing_rad: f64| on_ellipse(CirclePlace { bearing_rad, radius_m: 10.0 }).offset();
        assert!((offset(0.5) - direction(0.5) * 20.0).norm() < 1e-9, "ahead");
        assert!((offset(0.5 + PI / 2.0) - direction(0.5 + PI / 2.0) * 15.0).norm() < 1e-9, "to the left");
    }

    #[test]
    fn a_slot_goes_round_the_centre_if_both_places_are_on_the_same_kind_of_curve() {
        let quarter = CirclePlace { bearing_rad: 0.5, radius_m: 50.0 };
        assert_eq!(Slot::Circle(HERE).towards(&Slot::Circle(THERE), 0.25), Slot::Circle(quarter));
        assert_eq!(on_ellipse(HERE).towards(&on_ellipse(THERE), 0.25), on_ellipse(quarter));
    }

    #[test]
    fn between_different_curves_a_slot_moves_straight() {
        let wider = Slot::Ellipse { place: THERE, stretch: Stretch { across: 3.0, ..STRETCH } };
        for (from, to) in [(Slot::Circle(HERE), on_ellipse(THERE)), (on_ellipse(HERE), wider)] {
            let middle = (from.offset() + to.offset()) / 2.0;
            let Slot::Plane(halfway) = from.towards(&to, 0.5) else { panic!("not straight") };
            assert!((halfway - middle).norm() < 1e-9);
            assert_eq!(from.towards(&to, 1.0), to, "the end is exact");
        }
    }
}
