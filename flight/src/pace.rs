//! What simulated time waits for.

/// What has to happen before the world opens the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Every process has answered the tick before. The same scenario gives the same payloads, whatever the scheduling.
    Lockstep,
    /// The tick's deadline by the wall clock has come, whoever has answered.
    RealTime,
}
