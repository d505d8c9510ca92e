//! What every sample on a link has in common.
//!
//! Never decides what happens to a sample: the faults of its link do.

use ringwing_flight::{LeaderState, Sensed, Tick, UavState, wrap};

/// A message that a link with faults can carry: a stamped position and heading.
pub trait Sample: Copy {
    /// The tick in which it was sent.
    fn tick(&self) -> Tick;
    /// The same sample, stamped as if sent in `tick`.
    fn stamped(self, tick: Tick) -> Self;
    /// The same sample with `error` added to its position and heading.
    fn displaced(self, error: PoseError) -> Self;
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

macro_rules! samples {
    ($($message:ty),*) => {$(
        impl Sample for $message {
            fn tick(&self) -> Tick {
                self.tick
            }

            fn stamped(self, tick: Tick) -> Self {
                Self { tick, ..self }
            }

            fn displaced(self, error: PoseError) -> Self {
                let [x, y] = self.position_m;
                let heading_rad = wrap(self.heading_rad + error.heading_rad);
                Self { position_m: [x + error.x_m, y + error.y_m], heading_rad, ..self }
            }
        }
    )*};
}
samples!(UavState, LeaderState, Sensed);

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
