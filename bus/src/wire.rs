//! What makes a payload of `flight` something that iceoryx2 can carry.

use iceoryx2::prelude::ZeroCopySend;
use ringwing_flight::Payload;

/// A payload in shared memory: the same bytes, under the payload's own type name.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct Wire<T>(pub T);

// SAFETY: a `Payload` is `Pod`: a fixed layout, no pointers, and every bit pattern is a valid value. `Wire` is transparent.
#[expect(unsafe_code, reason = "iceoryx2 takes the promise that a type can be shared as an unsafe trait")]
unsafe impl<T: Payload> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        T::TYPE_NAME
    }
}
