//! How a process waits for a tick, and the world for its answers: at the gate, or on iceoryx2's own events.
//!
//! Never carries data, and never decides who has answered: with events too, the gate tells which tick is open.

use crate::{
    BusError, Due, Gate, Member, Patience, StopFlag, Wait,
    channel::{SPARE, patiently},
};
use iceoryx2::{
    node::Node,
    port::{
        listener::{Listener, ListenerWaitError},
        notifier::Notifier,
    },
    prelude::{ServiceName, ipc},
    service::{builder::event::EventOpenError, port_factory::event::PortFactory},
};
use ringwing_flight::Tick;
use ringwing_scenario::Wake;
use std::time::{Duration, Instant};

/// Rings for a tick.
const TICKS: &str = "tick";
/// Rings for every answer.
const ANSWERS: &str = "answers";
/// Nobody listens longer without a look at the gate, which may be closed by one who rings no bell.
const LONGEST_WAIT: Duration = Duration::from_millis(50);

/// Waits, and wakes the others.
#[derive(Debug)]
pub enum Waker {
    /// At the gate, with so much patience; it wakes by itself.
    Gate(Patience),
    /// On events.
    Bells(Box<Bells>),
}

/// The bell that a process rings, and the one it listens to.
#[derive(Debug)]
pub struct Bells {
    rung: Notifier<ipc::Service>,
    heard: Listener<ipc::Service>,
}

impl Waker {
    /// Of the world: to be opened when all others wait.
    pub fn of_world(member: &Member, wake: Wake, real_time: bool) -> Result<Self, BusError> {
        Self::open(member, wake, real_time, [TICKS, ANSWERS])
    }

    /// Of those who answer.
    pub fn of_answerer(member: &Member, wake: Wake, real_time: bool) -> Result<Self, BusError> {
        Self::open(member, wake, real_time, [ANSWERS, TICKS])
    }

    fn open(
        member: &Member,
        wake: Wake,
        real_time: bool,
        [rung, heard]: [&str; 2],
    ) -> Result<Self, BusError> {
        Ok(match wake {
            Wake::Gate if real_time => Self::Gate(Patience::punctual()),
            Wake::Gate => Self::Gate(Patience::eager()),
            Wake::Spin => Self::Gate(Patience::restless()),
            Wake::Event => Self::Bells(Box::new(Bells::open(member.node(), rung, heard)?)),
        })
    }

    // --- the world's side ---

    /// Wakes everybody for the tick that was opened; the gate has done so itself.
    pub fn call(&self) -> Result<(), BusError> {
        if let Self::Bells(bells) = self { bells.ring() } else { Ok(()) }
    }

    /// Waits until all expected answers are in, at most for `limit`, or until somebody nudges the world.
    pub fn wait_for_answers(&mut self, gate: &Gate, limit: Duration) -> Result<(), BusError> {
        match self {
            Self::Gate(patience) => gate.wait_for_answers(patience, limit),
            Self::Bells(bells) => {
                let since = Instant::now();
                while !gate.is_answered() && since.elapsed() < limit {
                    bells.listen(limit)?;
                }
            }
        }
        Ok(())
    }

    /// Waits until the next tick is `due`, or until `is_over`; bells call nobody who stands by.
    pub fn wait_until(&mut self, due: Due, is_over: impl Fn() -> bool) {
        match self {
            Self::Gate(patience) => patience.wait_until(due, is_over),
            Self::Bells(_) => Patience::punctual().wait_until(Due { lead_ns: 0, ..due }, is_over),
        }
    }

    /// Forgets the rings of answers that nobody waited for.
    pub fn forget(&self) -> Result<(), BusError> {
        if let Self::Bells(bells) = self { bells.listen(Duration::ZERO) } else { Ok(()) }
    }

    // --- the side of those who answer ---

    /// Waits for a tick other than `seen`.
    pub fn wait(&mut self, gate: &Gate, seen: Option<Tick>, stop: &StopFlag) -> Result<Wait, BusError> {
        match self {
            Self::Gate(patience) => Ok(gate.wait(seen, patience, stop)),
            Self::Bells(bells) => loop {
                if let Some(wait) = gate.news(seen, stop) {
                    return Ok(wait);
                }
                bells.listen(LONGEST_WAIT)?;
            },
        }
    }

    /// Wakes the world for an answer that was given at the gate, which has done so itself.
    pub fn answered(&self) -> Result<(), BusError> {
        self.call()
    }
}

impl Bells {
    fn open(node: &Node<ipc::Service>, rung: &str, heard: &str) -> Result<Self, BusError> {
        let refused = |name: &str, error: &dyn std::fmt::Debug| {
            BusError::ipc(format!("event {name}: no place for another process"), error)
        };
        let rung = open(node, rung)?.notifier_builder().create().map_err(|error| refused(rung, &error))?;
        let heard = open(node, heard)?.listener_builder().create().map_err(|error| refused(heard, &error))?;
        Ok(Self { rung, heard })
    }

    fn ring(&self) -> Result<(), BusError> {
        let failed = |error| BusError::ipc("an event cannot be sent", error);
        self.rung.notify().map(drop).map_err(failed)
    }

    fn listen(&self, limit: Duration) -> Result<(), BusError> {
        let heard =
            if limit.is_zero() { self.heard.try_wait(drop) } else { self.heard.timed_wait(drop, limit) };
        match heard {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(error) => Err(BusError::ipc("an event cannot be waited for", error)),
        }
    }
}

fn name(text: &str) -> Result<ServiceName, BusError> {
    text.try_into().map_err(|error| BusError::ipc(text, error))
}

/// Creates the two events of a swarm of `uavs`, held as long as what is returned.
pub(crate) fn create(
    node: &Node<ipc::Service>,
    uavs: u32,
) -> Result<[PortFactory<ipc::Service>; 2], BusError> {
    let create = |text: &str| {
        let places = uavs as usize + SPARE;
        let service = node.service_builder(&name(text)?).event();
        let service = service.max_notifiers(places).max_listeners(places).max_nodes(2 * places);
        service.create().map_err(|error| BusError::ipc(format!("event {text}: cannot be created"), error))
    };
    Ok([create(TICKS)?, create(ANSWERS)?])
}

fn open(node: &Node<ipc::Service>, text: &str) -> Result<PortFactory<ipc::Service>, BusError> {
    let name = name(text)?;
    patiently(|| node.service_builder(&name).event().open(), |error| *error == EventOpenError::DoesNotExist)
        .map_err(|error| BusError::ipc(format!("event {text}: cannot be opened"), error))
}
