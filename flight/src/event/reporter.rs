//! Who reports an event, which decides its place among the events of a tick.

/// Who reports an event. Events of one tick are ordered by their reporters, and not by when each report arrived, which
/// depends on scheduling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reporter {
    /// Whoever reads the schedule of faults: known before the flight.
    Schedule,
    /// The world, on the way to the tick.
    World,
    /// The launcher, before the tick opens.
    Launcher,
    /// The recorder, when it records the tick.
    Recorder,
}
