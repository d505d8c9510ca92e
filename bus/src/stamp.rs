//! Wall-clock stamps, which travel beside a payload and never in it: payloads stay the same from run to run.

use iceoryx2::prelude::ZeroCopySend;
use rustix::time::{ClockId, clock_gettime};

/// When the sender did each step, in nanoseconds of `CLOCK_MONOTONIC`: the user header of every service.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("ringwing.Stamps.v2")]
#[repr(C)]
pub struct Stamps {
    /// The sender saw the tick.
    pub woke_ns: u64,
    /// The sender had read its inputs.
    pub read_ns: u64,
    /// The sender began to send: its work was done.
    pub sent_ns: u64,
    /// How long sending took in the tick before. The time for this tick is known only once the sample is sent.
    pub sending_ns: u64,
}

// Other programs read this header: a changed layout needs a new `type_name`.
const _: () = assert!(size_of::<Stamps>() == 32);

impl Stamps {
    /// The stamps of a sender that neither waits nor reads before it sends.
    pub fn now() -> Self {
        let now = monotonic_ns();
        Self { woke_ns: now, read_ns: now, sent_ns: now, sending_ns: 0 }
    }
}

/// `CLOCK_MONOTONIC` in nanoseconds, the same for all processes of a machine.
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
