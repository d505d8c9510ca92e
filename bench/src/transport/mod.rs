//! What other ways to exchange data would cost: the same round trip between the same number of processes, with the same
//! number of bytes each way.
//!
//! The [`hub`] stands in for the world, and a [`peer`] for each agent. Both are real processes that make real system calls;
//! they compute nothing and do not use iceoryx2. An [`exchange`] says what they send, over [`connection`]s or
//! [`shared_words`]. In a [`mesh`], the peers are also connected to each other, and one more stands in for the leader.
//!
//! Must never fly anything.

mod connection;
mod exchange;
pub(crate) mod hub;
mod links;
mod mesh;
pub(crate) mod peer;
mod peers;
mod shared_words;

pub(crate) use exchange::MessageSizes;
