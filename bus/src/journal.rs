//! The journal: all that a log needs of a tick, in one sample from the world to the recorder.
//!
//! It is publish-subscribe with a queue, because a log needs every tick and a recorder reads in batches. One sample for
//! the whole swarm costs the world and the recorder a fraction of what a service for each UAV would.
//!
//! Must never hold up the world: a recorder that lags too far loses the oldest ticks.

use crate::{
    BusError, Domain, Stamps,
    channel::{OBSERVERS, SENDERS, count_failure, may_open_later},
    domain::Reserve,
    retry::retry,
    wire::Wire,
};
use iceoryx2::{
    node::Node,
    port::{
        publisher::{Publisher, PublisherCreateError},
        subscriber::{Subscriber, SubscriberCreateError},
    },
    prelude::{PortFactory as _, ServiceName, ipc},
    service::port_factory::publish_subscribe::PortFactory,
};
use ringwing_flight::{JournalEntry, JournalHeader, Notes};
use std::fmt::Debug;

pub(crate) type Factory = PortFactory<ipc::Service, [Wire<JournalEntry>], Wire<JournalHeader>>;

/// The name of the service.
const NAME: &str = "journal";
/// Readers that may subscribe at once: a recorder, its successor, and observers. Each place makes the journal's segment in
/// shared memory larger, though its memory is used only as far as the reader lags.
const READERS: usize = 2 + OBSERVERS;
/// Ticks that wait for an observer, at most. More cost memory for each observer that hangs; fewer make its picture jerk when
/// it gets the processor late.
const OBSERVER_DEPTH_MAX: usize = 16;
/// The most memory that waits for one observer, in bytes. A larger limit costs more for each observer that hangs; a smaller one
/// makes the picture of a large swarm jerk.
const OBSERVER_BYTES_MAX: usize = 1 << 20;
/// Ticks that the recorder may lag behind, at most. More cost memory while it lags; fewer lose ticks in real time when it
/// waits for the disk.
const DEPTH_MAX: usize = 1024;
/// The most memory that waits for one recorder, in bytes. A larger limit lets the recorder of a large swarm lag
/// further; a smaller one loses its ticks sooner.
const BYTES_MAX: usize = 64 << 20;
/// Samples that the recorder holds while it reads, and the one that the world writes: they need memory beside those that wait.
const IN_USE: usize = 4;
/// What iceoryx2 adds to each sample, in bytes: its header and the rounding.
const SAMPLE_OVERHEAD: usize = 64;
/// Ticks of which agents may have sent notes while the journal does not have them: the open tick, and the one before it. With
/// fewer, a recorder that lags loses notes; more are never used.
const NOTES_AHEAD: usize = 2;

/// How many ticks the journal of a swarm of `uavs` keeps for a recorder that lags behind, if there is enough memory.
pub fn depth_max(uavs: u32) -> usize {
    DEPTH_MAX.min(BYTES_MAX / sample_bytes(uavs))
}

/// Memory of one tick in the journal of a swarm of `uavs`, in bytes.
pub(crate) fn sample_bytes(uavs: u32) -> usize {
    size_of::<JournalHeader>() + uavs as usize * size_of::<JournalEntry>() + SAMPLE_OVERHEAD
}

/// Memory that the journal of a swarm of `uavs` takes when the recorder lags by all `depth` ticks, in bytes.
pub(crate) fn lag_bytes(uavs: u32, depth: usize) -> u64 {
    ((depth + IN_USE) * sample_bytes(uavs)) as u64
}

/// Memory that it takes further for an observer that hangs, in bytes.
pub(crate) fn observer_lag_bytes(uavs: u32) -> u64 {
    (observer_depth(uavs) * sample_bytes(uavs)) as u64
}

/// How many ticks of notes wait for a recorder that lags: those that the journal of a swarm of `uavs` keeps, and those that it
/// does not have yet.
pub(crate) fn notes_depth(uavs: u32) -> usize {
    depth_max(uavs) + NOTES_AHEAD
}

/// Memory that the notes of one agent take when the recorder lags by all of these ticks, in bytes.
pub(crate) fn notes_lag_bytes(uavs: u32) -> u64 {
    (notes_depth(uavs) * (size_of::<Notes>() + size_of::<Stamps>() + SAMPLE_OVERHEAD)) as u64
}

/// How many ticks of a swarm of `uavs` wait for an observer.
fn observer_depth(uavs: u32) -> usize {
    OBSERVER_DEPTH_MAX.min(OBSERVER_BYTES_MAX / sample_bytes(uavs)).max(1)
}

/// The size of the journal's segment in bytes. Most of it is never used: it has room for several readers that lag.
pub(crate) fn segment_bytes(uavs: u32, depth: usize) -> u64 {
    READERS as u64 * lag_bytes(uavs, depth)
}

/// Creates the journal. It keeps `depth` ticks for a recorder that lags behind before it loses the oldest.
pub(crate) fn create(node: &Node<ipc::Service>, depth: usize) -> Result<Factory, BusError> {
    node.service_builder(&name()?)
        .publish_subscribe::<[Wire<JournalEntry>]>()
        .user_header::<Wire<JournalHeader>>()
        .max_publishers(SENDERS)
        .max_subscribers(READERS)
        .max_nodes(READERS + SENDERS)
        .subscriber_max_buffer_size(depth)
        .history_size(0)
        // A full queue loses its oldest tick. Without this, the world would wait for a recorder that lags.
        .enable_safe_overflow(true)
        .create()
        .map_err(|error| journal_error("cannot be created", error))
}

fn open(node: &Node<ipc::Service>) -> Result<Factory, BusError> {
    let name = name()?;
    let open = || {
        let builder = node.service_builder(&name).publish_subscribe::<[Wire<JournalEntry>]>();
        builder.user_header::<Wire<JournalHeader>>().open()
    };
    retry(open, |error| may_open_later(*error)).map_err(|error| journal_error("cannot be opened", error))
}

/// The world's end of the journal.
#[derive(Debug)]
pub struct JournalWriter {
    port: Publisher<ipc::Service, [Wire<JournalEntry>], Wire<JournalHeader>>,
    uavs: usize,
    depth: usize,
}

impl JournalWriter {
    /// Opens the writing end for a swarm of `uavs`.
    pub fn open(node: &Node<ipc::Service>, uavs: u32) -> Result<Self, BusError> {
        let factory = open(node)?;
        let create = || {
            let builder = factory.publisher_builder().initial_max_slice_len(uavs as usize);
            builder.set_degradation_handler(|_, _| count_failure()).create()
        };
        let is_full = |error: &_| matches!(error, PublisherCreateError::ExceedsMaxSupportedPublishers);
        let port = retry(create, is_full).map_err(|error| journal_error("no place for a writer", error))?;
        Ok(Self { port, uavs: uavs as usize, depth: factory.static_config().subscriber_max_buffer_size() })
    }

    /// How many ticks the journal keeps for a recorder that lags behind.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Takes the memory for the longest lag out of the reserve of `domain`. Without it, the world would be killed by SIGBUS
    /// when the recorder lags and `/dev/shm` is full.
    pub fn pin(&self, domain: &Domain) -> Result<(), BusError> {
        // Release first: while the reserve holds this memory, the segment might find no other.
        domain.release(Reserve::Journal);
        domain.pin_segment_of(self.port.id().value(), lag_bytes(self.uavs as u32, self.depth))
    }

    /// Sends one tick: its header and one entry for each UAV.
    ///
    /// # Panics
    /// If there are fewer `entries` than UAVs.
    pub fn send(&self, header: &JournalHeader, entries: &[JournalEntry]) -> Result<(), BusError> {
        let failed = |error: &dyn Debug| journal_error("cannot be written", error);
        let mut sample = self.port.loan_slice_uninit(self.uavs).map_err(|error| failed(&error))?;
        *sample.user_header_mut() = Wire(*header);
        // Copy the entries straight into shared memory: a slice on the way would be half a megabyte for 1000 UAVs.
        sample.write_from_fn(|index| Wire(entries[index])).send().map_err(|error| failed(&error))?;
        Ok(())
    }
}

/// The end of the journal of a recorder or an observer.
#[derive(Debug)]
pub struct JournalReader {
    port: Subscriber<ipc::Service, [Wire<JournalEntry>], Wire<JournalHeader>>,
}

impl JournalReader {
    /// Opens the recorder's end; waits until the place of a dead reader is free again.
    pub fn of_recorder(node: &Node<ipc::Service>) -> Result<Self, BusError> {
        Self::open(node, usize::MAX)
    }

    /// Opens the end of an observer of a swarm of `uavs`, for which fewer ticks wait.
    pub fn of_observer(node: &Node<ipc::Service>, uavs: u32) -> Result<Self, BusError> {
        Self::open(node, observer_depth(uavs))
    }

    fn open(node: &Node<ipc::Service>, depth: usize) -> Result<Self, BusError> {
        let factory = open(node)?;
        let depth = depth.min(factory.static_config().subscriber_max_buffer_size());
        let create = || factory.subscriber_builder().buffer_size(depth).create();
        let is_full = |error: &_| *error == SubscriberCreateError::ExceedsMaxSupportedSubscribers;
        let port = retry(create, is_full).map_err(|error| journal_error("no place for a reader", error))?;
        Ok(Self { port })
    }

    /// Hands over all ticks that have come, oldest first: the header of each, and the entries of all UAVs.
    pub fn drain(&self, mut take: impl FnMut(&JournalHeader, &[Wire<JournalEntry>])) -> Result<(), BusError> {
        let failed = |error| journal_error("cannot be read", error);
        while let Some(sample) = self.port.receive().map_err(failed)? {
            take(&sample.user_header().0, sample.payload());
        }
        Ok(())
    }
}

fn name() -> Result<ServiceName, BusError> {
    NAME.try_into().map_err(|error| journal_error("not a name", error))
}

fn journal_error(problem: &str, reason: impl Debug) -> BusError {
    BusError::ipc(format!("service {NAME}: {problem}"), reason)
}
