//! The services of a run: one per kind of message and sender, created by the launcher, opened by everybody else.
//!
//! Senders never wait for readers: the oldest sample of a reader that lags is replaced, and the gap shows in the ticks.

use crate::{BusError, Stamps, ballast, waker, wire::Wire};
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
use ringwing_flight::{
    Account, Command, EventMessage, FormationError, LeaderState, LinkCounts, Payload, Roster, Sensed,
    TickTiming, UavId, UavState,
};
use std::{
    fmt::Debug,
    marker::PhantomData,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
    thread,
    time::{Duration, Instant},
};

type Factory<T> = PortFactory<ipc::Service, Wire<T>, Stamps>;
type Connection<T> = subscriber::Subscriber<ipc::Service, Wire<T>, Stamps>;

const NO_PLACE: SubscriberCreateError = SubscriberCreateError::ExceedsMaxSupportedSubscribers;

/// Samples that the recorder may lag behind before it loses some.
pub const RECORDER_DEPTH: usize = 1024;
/// Samples that readers on the tick path keep: in lockstep a fast neighbour may be a tick ahead.
pub const TICK_DEPTH: usize = 4;
/// Samples of a UAV's state that a reader may keep.
const STATE_DEPTH: usize = 16;
/// Who may listen to one UAV: a lost one's return is listened for from both sides, by more while they do not agree yet.
const STATE_READERS: usize = 5;
/// Room for a restarted sender beside the dead ones that are not cleaned up yet.
const MAX_PUBLISHERS: usize = 3;
/// Readers and nodes beyond those that the swarm needs: restarted ones, and people who look into a live run.
pub(crate) const SPARE: usize = 3;
/// How long a service may take to appear, or to recover from a creator that died.
const OPEN_LIMIT: Duration = Duration::from_secs(5);

/// Connections that could not be made, in this process; the usual reason is a lack of file descriptors.
static FAILED_CONNECTIONS: AtomicU64 = AtomicU64::new(0);

/// How many connections to other processes failed in this process so far.
pub fn failed_connections() -> u64 {
    FAILED_CONNECTIONS.load(Relaxed)
}

/// One service: a name, the message it carries, and its quality of service.
#[derive(Debug, Clone)]
pub struct Channel<T> {
    name: String,
    senders: usize,
    readers: usize,
    depth: usize,
    /// Samples that a newcomer is told of what was said before it came.
    history: usize,
    _message: PhantomData<T>,
}

/// What `uav` senses, from the world.
pub fn sensed(uav: UavId) -> Channel<Sensed> {
    Channel::new(format!("uav/{}/sensed", uav.0), 2, RECORDER_DEPTH)
}

/// What `uav` tells its ring neighbours.
pub fn state(uav: UavId) -> Channel<UavState> {
    Channel::new(format!("uav/{}/state", uav.0), STATE_READERS, STATE_DEPTH)
}

/// What `uav`'s agent asks of its airframe.
pub fn command(uav: UavId) -> Channel<Command> {
    Channel::new(format!("uav/{}/command", uav.0), 1, TICK_DEPTH)
}

/// How `uav`'s commands came about, for the recorder.
pub fn account(uav: UavId) -> Channel<Account> {
    Channel::new(format!("uav/{}/account", uav.0), 1, RECORDER_DEPTH)
}

/// Where the leader is, for a swarm of `uavs`.
pub fn leader(uavs: u32) -> Channel<LeaderState> {
    Channel::new("leader/state".into(), uavs as usize + 2, RECORDER_DEPTH)
}

/// What becomes of samples on links with faults, from the agents of a swarm of `uavs` that receive them.
///
/// One service for all, unlike the others: nobody but the recorder listens, and most agents never send.
pub fn links(uavs: u32) -> Channel<LinkCounts> {
    let channel = Channel::new("uav/links".into(), 2, RECORDER_DEPTH).with_history();
    Channel { senders: uavs as usize + MAX_PUBLISHERS, ..channel }
}

/// How long each tick took, from the world.
pub fn timing() -> Channel<TickTiming> {
    Channel::new("world/timing".into(), 2, RECORDER_DEPTH)
}

/// What happened in the air, from the world.
pub fn world_events() -> Channel<EventMessage> {
    Channel::new("world/events".into(), 2, RECORDER_DEPTH).with_history()
}

/// What happened to the processes, from the launcher.
pub fn launcher_events() -> Channel<EventMessage> {
    Channel::new("launcher/events".into(), 2, RECORDER_DEPTH).with_history()
}

/// Who runs, from the launcher.
pub fn roster() -> Channel<Roster> {
    Channel::new("launcher/roster".into(), 2, TICK_DEPTH).with_history()
}

/// How far the swarm is from its formation, from the recorder.
pub fn formation_error() -> Channel<FormationError> {
    Channel::new("recorder/formation_error".into(), 2, TICK_DEPTH).with_history()
}

/// All services of a run, held open: they exist as long as this value.
#[derive(Debug)]
pub struct Services {
    _held: Vec<Box<dyn Debug>>,
}

impl Services {
    /// Creates the services of a swarm of `uavs` in the domain of `node`.
    ///
    /// Events and ballast only where they are used: each service takes time and memory.
    pub fn create(
        node: &Node<ipc::Service>,
        uavs: u32,
        events: bool,
        has_ballast: bool,
    ) -> Result<Self, BusError> {
        let mut held: Vec<Box<dyn Debug>> = vec![
            Box::new(leader(uavs).create(node)?),
            Box::new(links(uavs).create(node)?),
            Box::new(timing().create(node)?),
            Box::new(world_events().create(node)?),
            Box::new(launcher_events().create(node)?),
            Box::new(roster().create(node)?),
            Box::new(formation_error().create(node)?),
        ];
        for uav in UavId::all(uavs) {
            held.push(Box::new(sensed(uav).create(node)?));
            held.push(Box::new(state(uav).create(node)?));
            held.push(Box::new(command(uav).create(node)?));
            held.push(Box::new(account(uav).create(node)?));
        }
        if events {
            held.push(Box::new(waker::create(node, uavs)?));
        }
        if has_ballast {
            held.push(Box::new(ballast::create(node, uavs)?));
        }
        Ok(Self { _held: held })
    }
}

impl<T: Payload> Channel<T> {
    fn new(name: String, readers: usize, depth: usize) -> Self {
        Self {
            name,
            senders: MAX_PUBLISHERS,
            readers: readers + SPARE,
            depth,
            history: 0,
            _message: PhantomData,
        }
    }

    /// Whoever comes later is told the last that was said: of what is said seldom, and costs each send something.
    fn with_history(self) -> Self {
        Self { history: 1, ..self }
    }

    fn service_name(&self) -> Result<ServiceName, BusError> {
        self.name.as_str().try_into().map_err(|error| BusError::ipc(&self.name, error))
    }

    fn create(&self, node: &Node<ipc::Service>) -> Result<Factory<T>, BusError> {
        node.service_builder(&self.service_name()?)
            .publish_subscribe::<Wire<T>>()
            .user_header::<Stamps>()
            .max_publishers(self.senders)
            .max_subscribers(self.readers)
            .max_nodes(self.readers + self.senders)
            .subscriber_max_buffer_size(self.depth)
            .subscriber_max_borrowed_samples(2)
            .history_size(self.history)
            .enable_safe_overflow(true)
            .create()
            .map_err(|error| BusError::ipc(format!("service {}: cannot be created", self.name), error))
    }

    /// Opens the service, with patience for one that is about to appear.
    fn open(&self, node: &Node<ipc::Service>) -> Result<Factory<T>, BusError> {
        let name = self.service_name()?;
        let open =
            || node.service_builder(&name).publish_subscribe::<Wire<T>>().user_header::<Stamps>().open();
        patiently(open, |error| is_passing(*error))
            .map_err(|error| BusError::ipc(format!("service {}: cannot be opened", self.name), error))
    }

    /// Takes the sending end, with patience until the place of a dead sender is free again.
    pub fn publisher(&self, node: &Node<ipc::Service>) -> Result<Publisher<T>, BusError> {
        let factory = self.open(node)?;
        let create = || factory.publisher_builder().set_degradation_handler(|_, _| count_failure()).create();
        let port =
            patiently(create, |error| matches!(error, PublisherCreateError::ExceedsMaxSupportedPublishers));
        let refused =
            |error| BusError::ipc(format!("service {}: no place for a publisher", self.name), error);
        Ok(Publisher { port: port.map_err(refused)?, name: self.name.clone() })
    }

    /// Takes a receiving end that keeps the newest `depth` samples, with the same patience.
    pub fn subscriber(&self, node: &Node<ipc::Service>, depth: usize) -> Result<Subscriber<T>, BusError> {
        let factory = self.open(node)?;
        let port = patiently(|| self.connect(&factory, depth), |error| *error == NO_PLACE);
        Ok(Subscriber { port: port.map_err(|error| self.no_place(error))?, name: self.name.clone() })
    }

    /// The same without patience: `None` when there is no free place at the moment.
    pub fn subscriber_if_free(
        &self,
        node: &Node<ipc::Service>,
        depth: usize,
    ) -> Result<Option<Subscriber<T>>, BusError> {
        match self.connect(&self.open(node)?, depth) {
            Ok(port) => Ok(Some(Subscriber { port, name: self.name.clone() })),
            Err(NO_PLACE) => Ok(None),
            Err(error) => Err(self.no_place(error)),
        }
    }

    fn connect(&self, factory: &Factory<T>, depth: usize) -> Result<Connection<T>, SubscriberCreateError> {
        let builder = factory.subscriber_builder().buffer_size(depth.min(self.depth));
        builder.set_degradation_handler(|_, _| count_failure()).create()
    }

    fn no_place(&self, error: SubscriberCreateError) -> BusError {
        BusError::ipc(format!("service {}: no place for a subscriber", self.name), error)
    }
}

/// Tries until it succeeds, fails for good, or [`OPEN_LIMIT`] has passed.
pub(crate) fn patiently<T, E>(
    attempt: impl Fn() -> Result<T, E>,
    is_passing: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let start = Instant::now();
    loop {
        match attempt() {
            Err(error) if is_passing(&error) && start.elapsed() < OPEN_LIMIT => {
                thread::sleep(Duration::from_millis(2));
            }
            result => return result,
        }
    }
}

fn is_passing(error: OpenError) -> bool {
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

fn count_failure() -> DegradationAction {
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
    /// Sends `message` to everybody who listens; waits for nobody.
    pub fn send(&self, message: T, stamps: Stamps) -> Result<(), BusError> {
        let failed =
            |error: &dyn Debug| BusError::ipc(format!("service {}: cannot be sent to", self.name), error);
        let mut sample = self.port.loan_uninit().map_err(|error| failed(&error))?;
        *sample.user_header_mut() = stamps;
        sample.write_payload(Wire(message)).send().map_err(|error| failed(&error))?;
        Ok(())
    }
}

/// A receiving end of a [`Channel`].
#[derive(Debug)]
pub struct Subscriber<T: Payload> {
    port: subscriber::Subscriber<ipc::Service, Wire<T>, Stamps>,
    name: String,
}

impl<T: Payload> Subscriber<T> {
    /// Hands over everything that has come, oldest first.
    pub fn drain(&self, mut take: impl FnMut(&T, &Stamps)) -> Result<(), BusError> {
        self.drain_until(|message, stamps| {
            take(message, stamps);
            false
        })
    }

    /// Hands over what has come, oldest first, until `take` says that nothing newer is wanted: looking for more where
    /// there can be none costs as much as finding something.
    pub fn drain_until(&self, mut take: impl FnMut(&T, &Stamps) -> bool) -> Result<(), BusError> {
        let failed = |error| BusError::ipc(format!("service {}: cannot be read", self.name), error);
        while let Some(sample) = self.port.receive().map_err(failed)? {
            if take(&sample.payload().0, sample.user_header()) {
                break;
            }
        }
        Ok(())
    }
}
