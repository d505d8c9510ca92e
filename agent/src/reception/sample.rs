//! What every sample on a link has in common.
//!
//! Never decides what happens to a sample: the faults of its link do.

use ringwing_flight::{LeaderState, Sensed, Tick, Traffic, UavState, wrap};

/// A message that a link with faults can carry: a stamped position and heading.
pub trait Sample: Copy {
    /// The tick in which it was sent.
    fn tick(&self) -> Tick;
    /// The same sample, stamped as if sent in `tick`.
    fn stamped(self, tick: Tick) -> Self;
    /// The same sample with an error added to each position and heading in it. `error` is called for each of them, in
    /// order.
    fn displaced(self, error: impl FnMut() -> PoseError) -> Self;
}

/// An error of a measured position and heading.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PoseError {
    /// Added to x.
    pub x_m: f64,
    /// Added to y.
    pub y_m: f64,
    /// Added to the heading.
    pub heading_rad: f64,
}

impl PoseError {
    fn add_to(self, position_m: &mut [f64; 2], heading_rad: &mut f64) {
        let [x, y] = *position_m;
        *position_m = [x + self.x_m, y + self.y_m];
        // Payloads promise a heading in (-pi, pi], also with an error in it.
        *heading_rad = wrap(*heading_rad + self.heading_rad);
    }
}

macro_rules! samples {
    ($($message:ty),*) => {$(
        impl Sample for $message {
            fn tick(&self) -> Tick {
                self.tick
            }

            fn stamped(self, tick: Tick) -> Self {
                Self { tick, ..self }
            }

            fn displaced(mut self, mut error: impl FnMut() -> PoseError) -> Self {
                error().add_to(&mut self.position_m, &mut self.heading_rad);
                self
            }
        }
    )*};
}
samples!(UavState, LeaderState, Sensed);

impl Sample for Traffic {
    fn tick(&self) -> Tick {
        self.tick
    }

    fn stamped(self, tick: Tick) -> Self {
        Self { tick, ..self }
    }

    fn displaced(mut self, mut error: impl FnMut() -> PoseError) -> Self {
        for aircraft in self.aircraft_mut() {
            // Each aircraft is measured by itself, so each has an error of its own.
            error().add_to(&mut aircraft.position_m, &mut aircraft.heading_rad);
        }
        self
    }
}

/// UAV 2's state of `tick`, at x = `tick` metres.
#[cfg(test)]
pub(crate) fn test_state(tick: i64) -> UavState {
    UavState {
        tick: Tick(tick),
        position_m: [tick as f64, 0.0],
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav: ringwing_flight::UavId(2),
        reserved: 0,
        rumours: Default::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_flight::UavId;

    #[test]
    fn a_report_of_traffic_that_is_stamped_again_is_of_its_new_tick() {
        let report = Traffic {
            tick: Tick(3),
            uav: UavId(2),
            aircraft_count: 1,
            aircraft_omitted: 4,
            reserved: 0,
            aircraft: Default::default(),
        };
        assert_eq!(report.stamped(Tick(8)), Traffic { tick: Tick(8), ..report });
    }
}
