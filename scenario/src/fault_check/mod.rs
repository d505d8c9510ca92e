//! Checks the faults of a whole scenario before the flight: which can have no effect, and which the run would not survive.
//!
//! Never refuses a single sentence by itself: the grammar and [`Action::refusal`](crate::Action::refusal) do.

mod idle;
mod slow;

pub(crate) use idle::warnings;
pub(crate) use slow::too_slow;
