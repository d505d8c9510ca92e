//! The names of the reports: files that processes leave for each other in the domain.

/// The world's [`WorldReport`](ringwing_flight::WorldReport), for the launcher.
pub const WORLD: &str = "world";
/// The recorder's summary of the flight, for the launcher.
pub const RECORDER: &str = "recorder";
/// The faults that were added during the run, from the launcher, for agents, world and recorder.
pub const FAULTS: &str = "faults";
