//! The wrapper that makes a payload of `flight`, which does not know iceoryx2, something that iceoryx2 can carry.
//!
//! Must never change the bytes of a payload.

use iceoryx2::prelude::ZeroCopySend;
use ringwing_flight::Payload;

/// A payload in shared memory: the same bytes, under the payload's own type name.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct Wire<T>(pub T);

/// All bytes zero: what iceoryx2 puts into a header before its sender writes it.
impl<T: Payload> Default for Wire<T> {
    fn default() -> Self {
        Self(T::zeroed())
    }
}

// SAFETY: a `Payload` is `Pod`: it has a fixed layout and no pointers, and every bit pattern is a valid value. `Wire`
// is transparent.
#[expect(unsafe_code, reason = "in iceoryx2, the promise that a type can be shared is an unsafe trait")]
unsafe impl<T: Payload> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        T::TYPE_NAME
    }
}
