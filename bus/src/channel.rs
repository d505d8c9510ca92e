//! A typed channel: one iceoryx2 publish-subscribe service, its publishers and its subscribers.
//!
//! A sender must never wait for a reader. When a reader lags, its oldest sample is replaced, and the gap shows in the
//! ticks of the samples.

use crate::{BusError, Stamps, retry::retry, wire::Wire};
use iceoryx2::{
    node::Node,
    port::{
        DegradationAction,
        publisher::{self, PublisherCreateError},
        subscriber::{self, SubscriberCreateError},
    },
    prelude::{ServiceName, ipc},
    service::{
        builder::publish_subscribe::PublishSubscribeOpenError as OpenError,
        port_factory::publish_subscribe::PortFactory,
    },
};
use ringwing_flight::Payload;
use std::{
    fmt::Debug,
    marker::PhantomData,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// An open service that carries `T`. The service exists while any process holds one.
pub(crate) type Factory<T> = PortFactory<ipc::Service, Wire<T>, Stamps>;
type Connection<T> = subscriber::Subscriber<ipc::Service, Wire<T>, Stamps>;

/// Publishers per service: one sender, and dead ones that are not cleaned up yet. With fewer, a sender that is killed
/// repeatedly cannot restart at once.
pub(crate) const SENDERS: usize = 3;
/// Readers and nodes beyond those that the swarm needs: restarted ones, and tools that look into a live run. With fewer, they
/// wait for a place.
pub(crate) const SPARE_READERS: usize = 3;
/// Observers that may look at a live run at the same time: its viewer, and people who watch. With fewer, one more finds no
/// place; each place makes the segments of the services that observers read larger.
pub(crate) const OBSERVERS: usize = 4;
/// Samples that a subscriber may hold while it gets the next: one is in use at a time, and one more is asked for.
const BORROWED_MAX: usize = 2;

/// Connections that this process could not make; the usual reason is a lack of file descriptors.
static FAILED_CONNECTIONS: AtomicU64 = AtomicU64::new(0);

/// How many connections to other processes have failed in this process.
pub fn failed_connections() -> u64 {
    FAILED_CONNECTIONS.load(Relaxed)
}

/// One service of a run: its name, the payload that it carries, and how much room it has.
#[derive(Debug, Clone)]
pub struct Channel<T> {
    pub(crate) name: String,
    /// Publishers that may be open at once.
    pub(crate) senders: usize,
    /// Subscribers that may be open at once.
    pub(crate) readers: usize,
    /// Samples that are kept for a subscriber that lags.
    pub(crate) depth: usize,
    /// Samples from before it subscribed that a new subscriber gets. They make each send a little more expensive.
    pub(crate) history: usize,
    pub(crate) payload: PhantomData<T>,
}

impl<T: Payload> Channel<T> {
    fn service_name(&self) -> Result<ServiceName, BusError> {
        self.name.as_str().try_into().map_err(|error| BusError::ipc(&self.name, error))
    }

    pub(crate) fn create(&self, node: &Node<ipc::Service>) -> Result<Factory<T>, BusError> {
        node.service_builder(&self.service_name()?)
            .publish_subscribe::<Wire<T>>()
            .user_header::<Stamps>()
            .max_publishers(self.senders)
            .max_subscribers(self.readers)
            .max_nodes(self.readers + self.senders)
            .subscriber_max_buffer_size(self.depth)
            .subscriber_max_borrowed_samples(BORROWED_MAX)
            .history_size(self.history)
            // A full queue loses its oldest sample. Without this, the sender would wait for a reader that lags.
            .enable_safe_overflow(true)
            .create()
            .map_err(|error| self.error("cannot be created", error))
    }

    /// Opens the service; waits for one that another process is about to create.
    fn open(&self, node: &Node<ipc::Service>) -> Result<Factory<T>, BusError> {
        let name = self.service_name()?;
        let open =
            || node.service_builder(&name).publish_subscribe::<Wire<T>>().user_header::<Stamps>().open();
        retry(open, |error| may_open_later(*error)).map_err(|error| self.error("cannot be opened", error))
    }

    /// Opens a sending end; waits until the place of a dead sender is free again.
    pub fn publisher(&self, node: &Node<ipc::Service>) -> Result<Publisher<T>, BusError> {
        let factory = self.open(node)?;
        let create = || factory.publisher_builder().set_degradation_handler(|_, _| count_failure()).create();
        let is_full = |error: &_| matches!(error, PublisherCreateError::ExceedsMaxSupportedPublishers);
        let port = retry(create, is_full).map_err(|error| self.error("no place for a publisher", error))?;
        Ok(Publisher { port, name: self.name.clone() })
    }

    /// Opens a receiving end that keeps the newest `depth` samples; waits until the place of a dead reader is free
    /// again.
    pub fn subscriber(&self, node: &Node<ipc::Service>, depth: usize) -> Result<Subscriber<T>, BusError> {
        let factory = self.open(node)?;
        let create = || {
            // iceoryx2 refuses a subscriber whose buffer is larger than what the service was created with.
            let builder = factory.subscriber_builder().buffer_size(depth.min(self.depth));
            builder.set_degradation_handler(|_, _| count_failure()).create()
        };
        let is_full = |error: &_| *error == SubscriberCreateError::ExceedsMaxSupportedSubscribers;
        let port = retry(create, is_full).map_err(|error| self.error("no place for a subscriber", error))?;
        Ok(Subscriber { port, name: self.name.clone() })
    }

    fn error(&self, problem: &str, reason: impl Debug) -> BusError {
        service_error(&self.name, problem, reason)
    }
}

fn service_error(name: &str, problem: &str, reason: impl Debug) -> BusError {
    BusError::ipc(format!("service {name}: {problem}"), reason)
}

/// Whether opening may succeed a moment later: the service is being created, or its creator died and it is cleaned up.
pub(crate) fn may_open_later(error: OpenError) -> bool {
    matches!(
        error,
        OpenError::DoesNotExist
            | OpenError::IsMarkedForDestruction
            | OpenError::ServiceInCorruptedState
            | OpenError::HangsInCreation
            | OpenError::ExceedsMaxNumberOfNodes
            | OpenError::Interrupt
    )
}

/// Takes note of a failed connection and goes on: the process serves the others it is connected to.
pub(crate) fn count_failure() -> DegradationAction {
    FAILED_CONNECTIONS.fetch_add(1, Relaxed);
    DegradationAction::Ignore
}

/// The sending end of a [`Channel`].
#[derive(Debug)]
pub struct Publisher<T: Payload> {
    port: publisher::Publisher<ipc::Service, Wire<T>, Stamps>,
    name: String,
}

impl<T: Payload> Publisher<T> {
    /// Sends `payload` to every subscriber, without waiting for any.
    pub fn send(&self, payload: T, stamps: Stamps) -> Result<(), BusError> {
        let failed = |error: &dyn Debug| service_error(&self.name, "cannot be sent to", error);
        // Not initialized: header and payload are written over all of it, and every tick pays for this path.
        let mut sample = self.port.loan_uninit().map_err(|error| failed(&error))?;
        *sample.user_header_mut() = stamps;
        sample.write_payload(Wire(payload)).send().map_err(|error| failed(&error))?;
        Ok(())
    }
}

/// A receiving end of a [`Channel`].
#[derive(Debug)]
pub struct Subscriber<T: Payload> {
    port: Connection<T>,
    name: String,
}

impl<T: Payload> Subscriber<T> {
    /// Hands over all samples that have come, oldest first.
    pub fn drain(&self, mut take: impl FnMut(&T, &Stamps)) -> Result<(), BusError> {
        let failed = |error| service_error(&self.name, "cannot be read", error);
        while let Some(sample) = self.port.receive().map_err(failed)? {
            take(&sample.payload().0, sample.user_header());
        }
        Ok(())
    }
}
