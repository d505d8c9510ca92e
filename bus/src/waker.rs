//! How processes wake each other for ticks and answers: at the gate, or by iceoryx2's events.
//!
//! Never carries data, and never decides which tick is open or who has answered: with events too, the gate knows.

use crate::{BusError, Due, Gate, Member, StopFlag, Wait, WaitStrategy, retry::retry};
use iceoryx2::{
    node::Node,
    port::{
        listener::{Listener, ListenerWaitError},
        notifier::Notifier,
    },
    prelude::{ServiceName, ipc},
    service::{builder::event::EventOpenError, port_factory::event::PortFactory},
};
use ringwing_flight::{Pace, Tick};
use ringwing_scenario::Wake;
use std::time::{Duration, Instant};

/// The event that the world notifies when it opens a tick.
const TICKS: &str = "tick";
/// The event that agents and leader notify with every answer.
const ANSWERS: &str = "answers";
/// The longest wait for an event before another look at the gate, which the launcher closes without an event. Longer
/// delays the end of the run; shorter wakes idle processes for nothing.
const LONGEST_WAIT: Duration = Duration::from_millis(50);

/// Waits for other processes, and wakes them, in the way that the scenario's `ipc.wake` asks for.
#[derive(Debug)]
pub enum Waker {
    /// At the gate, with this strategy. The gate's own methods wake the others.
    Gate(WaitStrategy),
    /// By events.
    Events(Box<EventPorts>),
}

/// The event that a process notifies, and the one that it listens to.
#[derive(Debug)]
pub struct EventPorts {
    notifier: Notifier<ipc::Service>,
    listener: Listener<ipc::Service>,
}

impl Waker {
    /// The world's waker. To be opened when all others are ready to listen.
    pub fn of_world(member: &Member) -> Result<Self, BusError> {
        Self::open(member, TICKS, ANSWERS)
    }

    /// The waker of a process that answers ticks.
    pub(crate) fn of_answerer(member: &Member) -> Result<Self, BusError> {
        Self::open(member, ANSWERS, TICKS)
    }

    fn open(member: &Member, notified: &str, awaited: &str) -> Result<Self, BusError> {
        let scenario = member.scenario();
        Ok(match (scenario.ipc.wake, scenario.pace()) {
            (Wake::Gate, Pace::RealTime) => Self::Gate(WaitStrategy::timed()),
            (Wake::Gate, Pace::Lockstep) => {
                // All UAVs, the leader and the world. The recorder sleeps most of the time.
                Self::Gate(WaitStrategy::yielding(scenario.formation.uavs + 2, member.cores()))
            }
            (Wake::Spin, _) => Self::Gate(WaitStrategy::spinning()),
            (Wake::Event, _) => Self::Events(Box::new(EventPorts::open(member.node(), notified, awaited)?)),
        })
    }

    /// Wakes the processes that wait for this one: all others after the world has opened a tick, or the world after an
    /// answer. Without events the gate has done so already.
    pub fn notify(&self) -> Result<(), BusError> {
        match self {
            Self::Gate(_) => Ok(()),
            Self::Events(ports) => ports.notify(),
        }
    }

    /// World: waits until all expected answers have come, at most for `limit`, or until somebody nudges the world.
    pub fn wait_for_answers(&mut self, gate: &Gate, limit: Duration) -> Result<(), BusError> {
        match self {
            Self::Gate(strategy) => gate.wait_for_answers(strategy, limit),
            Self::Events(ports) => {
                let since = Instant::now();
                // An event tells that somebody has answered, not that all have: only the gate counts.
                while !gate.is_answered() && since.elapsed() < limit {
                    ports.listen(limit)?;
                }
            }
        }
        Ok(())
    }

    /// World: waits until the next tick is `due`, or until `is_over`. Calls `rehearse` when it begins to stand by for the
    /// tick. With events nobody stands by.
    pub fn wait_until(&mut self, due: Due, is_over: impl Fn() -> bool, rehearse: impl FnMut()) {
        match self {
            Self::Gate(strategy) => strategy.wait_until(due, is_over, rehearse),
            // A new strategy each time loses nothing: one that never stands by has nothing to learn.
            Self::Events(_) => WaitStrategy::timed().wait_until(Due { lead_ns: 0, ..due }, is_over, rehearse),
        }
    }

    /// World: discards the events of answers that it did not wait for, so that they do not end the next wait early.
    pub fn discard_events(&self) -> Result<(), BusError> {
        match self {
            Self::Gate(_) => Ok(()),
            Self::Events(ports) => ports.discard(),
        }
    }

    /// Answering process: waits until a tick other than `seen` is open, the flight is over, or `stop` is set. Calls
    /// `rehearse` when it begins to stand by for a tick that is due.
    pub(crate) fn wait_for_tick(
        &mut self,
        gate: &Gate,
        seen: Option<Tick>,
        stop: &StopFlag,
        rehearse: impl FnMut(),
    ) -> Result<Wait, BusError> {
        match self {
            Self::Gate(strategy) => Ok(gate.wait(seen, strategy, stop, rehearse)),
            Self::Events(ports) => loop {
                // Look before listening: the tick may be open already, and its event lost because nobody listened yet.
                if let Some(wait) = gate.news(seen, stop) {
                    return Ok(wait);
                }
                ports.listen(LONGEST_WAIT)?;
            },
        }
    }
}

impl EventPorts {
    fn open(node: &Node<ipc::Service>, notified: &str, awaited: &str) -> Result<Self, BusError> {
        let notifier = open(node, notified)?.notifier_builder().create();
        let listener = open(node, awaited)?.listener_builder().create();
        Ok(Self {
            notifier: notifier.map_err(|error| event_error(notified, "no place for a notifier", error))?,
            listener: listener.map_err(|error| event_error(awaited, "no place for a listener", error))?,
        })
    }

    fn notify(&self) -> Result<(), BusError> {
        let failed = |error| BusError::ipc("an event cannot be sent", error);
        self.notifier.notify().map(drop).map_err(failed)
    }

    /// Waits for one event, at most for `limit`, or until a signal.
    fn listen(&self, limit: Duration) -> Result<(), BusError> {
        self.listener.timed_wait(drop, limit).map(drop).or_else(unless_interrupted)
    }

    fn discard(&self) -> Result<(), BusError> {
        self.listener.try_wait(drop).map(drop).or_else(unless_interrupted)
    }
}

/// A signal ends a wait like an event does: the caller looks at the gate either way.
fn unless_interrupted(error: ListenerWaitError) -> Result<(), BusError> {
    match error {
        ListenerWaitError::InterruptSignal => Ok(()),
        error => Err(BusError::ipc("an event cannot be waited for", error)),
    }
}

/// The two event services of a run. They exist as long as this value.
#[derive(Debug)]
#[expect(dead_code, reason = "the fields are only held: dropping a factory removes its service")]
pub(crate) struct Events {
    ticks: PortFactory<ipc::Service>,
    answers: PortFactory<ipc::Service>,
}

impl Events {
    /// Creates them with room for `places` processes at either end.
    pub(crate) fn create(node: &Node<ipc::Service>, places: usize) -> Result<Self, BusError> {
        let create = |text: &str| {
            let service = node.service_builder(&name(text)?).event();
            let service = service.max_notifiers(places).max_listeners(places).max_nodes(2 * places);
            service.create().map_err(|error| event_error(text, "cannot be created", error))
        };
        Ok(Self { ticks: create(TICKS)?, answers: create(ANSWERS)? })
    }
}

fn open(node: &Node<ipc::Service>, text: &str) -> Result<PortFactory<ipc::Service>, BusError> {
    let name = name(text)?;
    let open = || node.service_builder(&name).event().open();
    retry(open, |error| *error == EventOpenError::DoesNotExist)
        .map_err(|error| event_error(text, "cannot be opened", error))
}

fn name(text: &str) -> Result<ServiceName, BusError> {
    text.try_into().map_err(|error| BusError::ipc(text, error))
}

fn event_error(name: &str, problem: &str, reason: impl std::fmt::Debug) -> BusError {
    BusError::ipc(format!("event {name}: {problem}"), reason)
}
