//! A typed blackboard: what one process shows of itself to others, tick by tick, over iceoryx2.
//!
//! A tick needs the newest value of a sender and not a queue of values: reading one costs a copy and two atomic
//! operations. A board keeps the values of the last few ticks, each in an entry of its own, so that a reader in tick k
//! finds the value of tick k - 1 even if a fast sender has shown that of tick k already.
//!
//! iceoryx2 never lets a second process write where a killed one was the writer. So every process that becomes a
//! part of the run, every *incarnation* of the part, has a service of its own, such as `uav/3/state/2`. The launcher
//! creates it and writes the number to the gate's page. A reader that does not find the value that it wants looks
//! there, and moves on to the new service: nobody has to tell it. A new service begins with the values of the one before,
//! so it does not matter when a reader moves on: what a lost sender has shown stays valid, and is seen by all or by none.
//!
//! Must never wait for a reader, and never decide which value a reader may use.

use crate::{BusError, Gate, Stamps, retry::retry};
use iceoryx2::{
    node::Node,
    port::{
        reader::{EntryHandle, EntryHandleError, Reader, ReaderCreateError},
        writer::{EntryHandleMut, EntryHandleMutError, Writer, WriterCreateError},
    },
    prelude::{ServiceName, ZeroCopySend, ipc},
    service::{
        builder::blackboard::{BlackboardOpenError as OpenError, Creator},
        port_factory::blackboard::PortFactory,
    },
};
use ringwing_flight::{Pace, Part, Payload, Tick};
use std::{fmt::Debug, marker::PhantomData, ops::RangeInclusive, rc::Rc};

/// The service of one incarnation. It exists while any process holds it open.
pub(crate) type BoardFactory = PortFactory<ipc::Service, Key>;
/// Names an entry of a service: one entry for each tick that is kept, of each payload on the board.
type Key = u32;

/// Ticks that a board keeps in lockstep: a sender is at most one tick ahead of its readers. With one less, a fast
/// neighbour would overwrite what others still need; more are never read.
const KEPT_IN_LOCKSTEP: u32 = 2;
/// Ticks that a board keeps in real time. A reader that is late by more of them loses values; more cost memory.
const KEPT_IN_REAL_TIME: u32 = 4;
/// In an entry: nothing was written yet.
const NO_TICK: i64 = i64::MIN;

/// What a process of a run needs to use boards: its node, and the gate that knows the incarnations.
#[derive(Debug, Clone, Copy)]
pub struct BoardAccess<'a> {
    /// Opens the services.
    pub node: &'a Node<ipc::Service>,
    /// Knows which incarnation of each part is the newest.
    pub gate: &'a Gate,
}

/// The boards on which one sender shows values of type `T`, one for each of its incarnations.
#[derive(Debug, Clone)]
pub struct Board<T> {
    pub(crate) name: String,
    /// Whose board it is.
    pub(crate) sender: Part,
    /// Readers that may have it open at once.
    pub(crate) readers: usize,
    /// For how many ticks it keeps a value.
    pub(crate) kept: u32,
    /// The key of the first entry. Two payloads of one sender can share a service under different keys.
    pub(crate) first_key: Key,
    pub(crate) payload: PhantomData<T>,
}

/// One entry: a payload, its tick, and when its sender did what.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Posted<T> {
    tick: i64,
    stamps: Stamps,
    payload: T,
}

// SAFETY: tick, stamps and a `Payload` have a fixed layout and no pointers, and every bit pattern is a valid value.
#[expect(unsafe_code, reason = "in iceoryx2, the promise that a type can be shared is an unsafe trait")]
unsafe impl<T: Payload> ZeroCopySend for Posted<T> {
    unsafe fn type_name() -> &'static str {
        T::TYPE_NAME
    }
}

/// How many ticks a board keeps at this pace.
pub(crate) fn kept_at(pace: Pace) -> u32 {
    match pace {
        Pace::Lockstep => KEPT_IN_LOCKSTEP,
        Pace::RealTime => KEPT_IN_REAL_TIME,
    }
}

impl<T: Payload> Board<T> {
    fn service_name(&self, incarnation: u32) -> Result<ServiceName, BusError> {
        let name = format!("{}/{incarnation}", self.name);
        name.as_str().try_into().map_err(|error| BusError::ipc(name, error))
    }

    fn keys(&self) -> impl Iterator<Item = Key> + use<T> {
        self.first_key..self.first_key + self.kept
    }

    /// Creates the board of the sender's `incarnation`, with the values on the board of its `predecessor`, if there is one.
    pub(crate) fn create(
        &self,
        node: &Node<ipc::Service>,
        incarnation: u32,
        predecessor: Option<&BoardFactory>,
    ) -> Result<BoardFactory, BusError> {
        let old = self.reader_of(predecessor)?;
        self.create_from(self.add_entries(self.creator(node, incarnation)?, old.as_ref()))
    }

    /// Creates the board together with `other`, which has the same name and other keys.
    pub(crate) fn create_with<U: Payload>(
        &self,
        other: &Board<U>,
        node: &Node<ipc::Service>,
        incarnation: u32,
        predecessor: Option<&BoardFactory>,
    ) -> Result<BoardFactory, BusError> {
        let old = self.reader_of(predecessor)?;
        let creator = self.add_entries(self.creator(node, incarnation)?, old.as_ref());
        self.create_from(other.add_entries(creator, old.as_ref()))
    }

    fn creator(
        &self,
        node: &Node<ipc::Service>,
        incarnation: u32,
    ) -> Result<Creator<Key, ipc::Service>, BusError> {
        let creator = node.service_builder(&self.service_name(incarnation)?).blackboard_creator::<Key>();
        // Besides the readers, the sender and the launcher hold the service open.
        Ok(creator.max_readers(self.readers).max_nodes(self.readers + 2))
    }

    fn reader_of(
        &self,
        factory: Option<&BoardFactory>,
    ) -> Result<Option<Reader<ipc::Service, Key>>, BusError> {
        let reader = factory.map(|factory| factory.reader_builder().create()).transpose();
        reader.map_err(|error| self.error("no place to read the predecessor's values", error))
    }

    /// Adds the entries with the values that `old` reads, or empty.
    fn add_entries(
        &self,
        creator: Creator<Key, ipc::Service>,
        old: Option<&Reader<ipc::Service, Key>>,
    ) -> Creator<Key, ipc::Service> {
        let empty = Posted { tick: NO_TICK, stamps: Stamps::default(), payload: T::zeroed() };
        let inherited = |key| Some(old?.entry::<Posted<T>>(&key).ok()?.get());
        self.keys().fold(creator, |creator, key| {
            let value = inherited(key).map_or(empty, |value| *value);
            creator.add(key, value)
        })
    }

    fn create_from(&self, creator: Creator<Key, ipc::Service>) -> Result<BoardFactory, BusError> {
        creator.create().map_err(|error| self.error("cannot be created", error))
    }

    /// Opens the service of the sender's newest incarnation and calls `connect` with it, until that succeeds.
    ///
    /// The number is read again before each attempt: while one process opens a board, the launcher may replace the
    /// sender, or clean up after a reader that was killed.
    fn connect<P>(
        &self,
        access: BoardAccess,
        connect: impl Fn(&BoardFactory) -> Result<P, AttemptError>,
    ) -> Result<(P, u32), BusError> {
        let attempt = || {
            let incarnation = access.gate.incarnation(self.sender);
            let name = self.service_name(incarnation).map_err(AttemptError::lasting)?;
            let opener = access.node.service_builder(&name).blackboard_opener::<Key>();
            let factory = opener.open().map_err(|error| AttemptError {
                may_pass: may_open_later(error),
                error: self.error("cannot be opened", error),
            })?;
            Ok((connect(&factory)?, incarnation))
        };
        retry(attempt, |failed: &AttemptError| failed.may_pass).map_err(|failed| failed.error)
    }

    /// Opens the writing end for the process that is the sender's newest incarnation.
    pub fn writer(&self, access: BoardAccess) -> Result<BoardWriter<T>, BusError> {
        let create = |factory: &BoardFactory| {
            factory.writer_builder().create().map_err(|error| AttemptError {
                // The place of a predecessor that was just killed: the launcher is about to create the next board.
                may_pass: matches!(error, WriterCreateError::ExceedsMaxSupportedWriters),
                error: self.error("no place for a writer", error),
            })
        };
        let (port, _) = self.connect(access, create)?;
        self.writer_at(&Rc::new(port))
    }

    fn writer_at(&self, port: &Rc<Writer<ipc::Service, Key>>) -> Result<BoardWriter<T>, BusError> {
        let entry =
            |key| port.entry(&key).map_err(|error: EntryHandleMutError| self.error("no entry", error));
        Ok(BoardWriter { entries: self.keys().map(entry).collect::<Result<_, _>>()?, port: port.clone() })
    }

    /// Opens a reading end of the newest incarnation's board.
    pub fn reader(&self, access: BoardAccess) -> Result<BoardReader<T>, BusError> {
        let create = |factory: &BoardFactory| {
            factory.reader_builder().create().map_err(|error| AttemptError {
                // The place of a reader that was killed becomes free when the launcher has cleaned up after it.
                may_pass: matches!(error, ReaderCreateError::ExceedsMaxSupportedReaders),
                error: self.error("no place for a reader", error),
            })
        };
        let (port, incarnation) = self.connect(access, create)?;
        self.reader_at(&Rc::new(port), incarnation)
    }

    fn reader_at(
        &self,
        port: &Rc<Reader<ipc::Service, Key>>,
        incarnation: u32,
    ) -> Result<BoardReader<T>, BusError> {
        let entry = |key| port.entry(&key).map_err(|error: EntryHandleError| self.error("no entry", error));
        let entries = self.keys().map(entry).collect::<Result<_, _>>()?;
        Ok(BoardReader { board: self.clone(), incarnation, entries, port: port.clone() })
    }

    fn error(&self, problem: &str, reason: impl Debug) -> BusError {
        BusError::ipc(format!("board {}: {problem}", self.name), reason)
    }
}

/// Why an attempt to open a board failed, and whether the next one may succeed.
struct AttemptError {
    error: BusError,
    may_pass: bool,
}

impl AttemptError {
    fn lasting(error: BusError) -> Self {
        Self { error, may_pass: false }
    }
}

/// Whether opening may succeed a moment later: the service is being created or removed, or is full of dead processes.
fn may_open_later(error: OpenError) -> bool {
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

/// The writing end of a [`Board`].
pub struct BoardWriter<T: Payload> {
    /// One for each tick that is kept.
    entries: Vec<EntryHandleMut<ipc::Service, Key, Posted<T>>>,
    port: Rc<Writer<ipc::Service, Key>>,
}

impl<T: Payload> BoardWriter<T> {
    /// The writing end of `board`, which is part of the same service.
    pub fn beside<U: Payload>(&self, board: &Board<U>) -> Result<BoardWriter<U>, BusError> {
        board.writer_at(&self.port)
    }

    /// Shows `payload` as the value of `tick`, in place of the oldest one that is kept.
    pub fn post(&self, tick: Tick, payload: T, stamps: Stamps) {
        self.entries[slot_of(tick, self.entries.len())].update_with_copy(Posted {
            tick: tick.0,
            stamps,
            payload,
        });
    }
}

/// A reading end of a [`Board`].
pub struct BoardReader<T: Payload> {
    board: Board<T>,
    incarnation: u32,
    /// One for each tick that is kept.
    entries: Vec<EntryHandle<ipc::Service, Key, Posted<T>>>,
    port: Rc<Reader<ipc::Service, Key>>,
}

impl<T: Payload> BoardReader<T> {
    /// A reading end of `board`, which is part of the same service.
    pub fn beside<U: Payload>(&self, board: &Board<U>) -> Result<BoardReader<U>, BusError> {
        board.reader_at(&self.port, self.incarnation)
    }

    /// Hands over what the sender has shown in `ticks` and the board still keeps, oldest first. Returns the tick of the
    /// last value handed over.
    pub fn read(&self, ticks: RangeInclusive<Tick>, mut take: impl FnMut(&T, &Stamps)) -> Option<Tick> {
        // Newer ticks have taken the entries of older ones, so there is nothing to find before this one.
        let oldest_kept = ticks.end().0 - self.entries.len().cast_signed() as i64 + 1;
        let mut newest = None;
        for tick in ticks.start().0.max(oldest_kept)..=ticks.end().0 {
            let posted = self.entries[slot_of(Tick(tick), self.entries.len())].get();
            // Another tick in its place: the sender has skipped this one, or is far ahead.
            if posted.tick == tick {
                take(&posted.payload, &posted.stamps);
                newest = Some(Tick(tick));
            }
        }
        newest
    }

    /// Like [`read`](Self::read). If the last value is not there, moves on to the board of the sender's newest
    /// incarnation, if there is a newer one, and reads on there. Returns whether it has moved on.
    pub fn read_newest(
        &mut self,
        access: BoardAccess,
        ticks: RangeInclusive<Tick>,
        mut take: impl FnMut(&T, &Stamps),
    ) -> Result<bool, BusError> {
        let newest = self.read(ticks.clone(), &mut take);
        let moves_on = newest != Some(*ticks.end()) && self.follow(access)?;
        if moves_on {
            // The new board has what was read before as well. Hand over only what comes after it.
            let first = newest.map_or(*ticks.start(), |Tick(tick)| Tick(tick + 1));
            self.read(first..=*ticks.end(), take);
        }
        Ok(moves_on)
    }

    /// Moves on to the board of the sender's newest incarnation; returns whether there was a newer one.
    fn follow(&mut self, access: BoardAccess) -> Result<bool, BusError> {
        let is_outdated = access.gate.incarnation(self.board.sender) != self.incarnation;
        if is_outdated {
            *self = self.board.reader(access)?;
        }
        Ok(is_outdated)
    }
}

/// The place of `tick` among `kept` entries.
fn slot_of(tick: Tick, kept: usize) -> usize {
    // The approach is tick -1, for which a plain remainder would be negative.
    tick.0.rem_euclid(kept.cast_signed() as i64) as usize
}

#[cfg(test)]
mod tests;
