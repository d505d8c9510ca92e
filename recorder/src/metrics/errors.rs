//! How far the UAVs are from the formation in one tick.
//!
//! Never judges: how large an error may be is a requirement of the scenario.

use super::{Frame, TrueState};

/// The errors of the UAVs that fly on command, in one tick.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FormationErrors {
    pub(super) commanded: u32,
    /// How many of them have a slot error, and the sum of its squares.
    pub(super) slots: u32,
    pub(super) slot_squares_m2: f64,
    pub(super) slot_max_m: Option<f64>,
    pub(super) neighbour_max_m: Option<f64>,
    pub(super) radius_max_m: Option<f64>,
}

impl FormationErrors {
    pub(super) fn observe(&mut self, state: &TrueState, frame: &Frame) {
        self.commanded += 1;
        if let Some(error_m) = state.slot_error_m.filter(|error_m| error_m.is_finite()) {
            self.slots += 1;
            self.slot_squares_m2 += error_m * error_m;
            raise(&mut self.slot_max_m, error_m);
        }
        let place = frame.ring.place(state.uav);
        if let Some(distance_m) = state.leader_distance_m {
            raise(&mut self.radius_max_m, (distance_m - place.radius_m).abs());
        }
        // Only the distance to the next neighbour, so that each pair counts once. A neighbour in its failsafe keeps no
        // distance.
        let next = place.next.filter(|next| frame.commanded(next.uav).is_some());
        if let Some((next, distance_m)) = next.zip(state.next_distance_m) {
            raise(&mut self.neighbour_max_m, (distance_m - next.rest_m).abs());
        }
    }

    pub(super) fn slot_rms_m(&self) -> Option<f64> {
        (self.slots > 0).then(|| (self.slot_squares_m2 / f64::from(self.slots)).sqrt())
    }
}

/// Raises `largest` to `value`.
pub(super) fn raise(largest: &mut Option<f64>, value: f64) {
    // JSON writes an infinity as null. Leave it out here, so that the numbers are the same live and read again.
    if value.is_finite() {
        *largest = Some(largest.map_or(value, |largest| largest.max(value)));
    }
}
