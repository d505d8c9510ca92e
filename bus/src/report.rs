//! The files that processes leave in the domain for each other, by name.

/// The world's [`WorldReport`](ringwing_flight::WorldReport).
pub const WORLD: &str = "world";
/// The recorder's summary of the flight.
pub const RECORDER: &str = "recorder";
/// The faults that were added while the run goes on, left by the launcher.
pub const FAULTS: &str = "faults";
