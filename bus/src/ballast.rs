//! Ballast: bytes that go between the world and each agent in every tick beside the messages, so that a benchmark shows
//! what they cost.
//!
//! They are loaned from shared memory, written, sent without a copy, and read to the last byte. The flight must never
//! depend on them.

use crate::{BusError, retry::retry};
use iceoryx2::{
    node::Node,
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::{ServiceName, ipc},
    service::{
        builder::publish_subscribe::PublishSubscribeOpenError, port_factory::publish_subscribe::PortFactory,
    },
};
use ringwing_flight::{Tick, UavId};
use std::{fmt::Debug, hint::black_box};

/// An open ballast service. The service exists while any process holds one.
pub(crate) type Factory = PortFactory<ipc::Service, [u8], ()>;

/// Samples that a reader may lag behind before it loses one. In lockstep it is one tick behind at most.
const DEPTH: usize = 4;
/// Samples that are in use beside those that wait: the reader's, and the one that is being written.
const IN_USE: u64 = 2;
/// Readers of each service: the other end, its successors while the dead are not cleaned up yet, and people who look into a
/// live run. Each makes the segment larger, though its memory is used only as far as a reader lags.
const READERS: usize = 8;

/// Memory of one direction when its reader lags as far as it can, in bytes.
pub(crate) fn samples_bytes(bytes: u64) -> u64 {
    (DEPTH as u64 + IN_USE) * bytes
}

/// The size of a segment of ballast of `bytes`, in bytes, with a margin for what iceoryx2 adds to each sample.
pub(crate) fn segment_bytes(bytes: u64) -> u64 {
    READERS as u64 * (samples_bytes(bytes) + samples_bytes(bytes) / 4)
}

/// One end of the ballast between the world and an agent.
#[derive(Debug)]
pub struct Ballast {
    bytes: usize,
    sender: Publisher<ipc::Service, [u8], ()>,
    receiver: Subscriber<ipc::Service, [u8], ()>,
}

#[derive(Debug, Clone, Copy)]
enum BallastDirection {
    ToAgent,
    ToWorld,
}

impl Ballast {
    /// The world's end of the ballast of `uav`, with `bytes` per tick in each direction.
    pub fn of_world(node: &Node<ipc::Service>, uav: UavId, bytes: u32) -> Result<Self, BusError> {
        Self::open(node, uav, bytes, [BallastDirection::ToAgent, BallastDirection::ToWorld])
    }

    /// The end of `uav`'s agent.
    pub fn of_agent(node: &Node<ipc::Service>, uav: UavId, bytes: u32) -> Result<Self, BusError> {
        Self::open(node, uav, bytes, [BallastDirection::ToWorld, BallastDirection::ToAgent])
    }

    fn open(
        node: &Node<ipc::Service>,
        uav: UavId,
        bytes: u32,
        [out, back]: [BallastDirection; 2],
    ) -> Result<Self, BusError> {
        let bytes = bytes as usize;
        let sender = open(node, uav, out)?.publisher_builder().initial_max_slice_len(bytes).create();
        let receiver = open(node, uav, back)?.subscriber_builder().create();
        Ok(Self {
            bytes,
            sender: sender.map_err(|error| ballast_error(uav, "no place for a publisher", error))?,
            receiver: receiver.map_err(|error| ballast_error(uav, "no place for a subscriber", error))?,
        })
    }

    /// Sends the bytes of `tick`.
    pub fn send(&self, tick: Tick) -> Result<(), BusError> {
        let failed = |error: &dyn Debug| BusError::ipc("ballast cannot be sent", error);
        let sample = self.sender.loan_slice_uninit(self.bytes).map_err(|error| failed(&error))?;
        let value = tick.0 as u8;
        sample.write_from_fn(|_| value).send().map_err(|error| failed(&error))?;
        Ok(())
    }

    /// Reads all that has come, to the last byte; returns how many bytes that were.
    pub fn receive(&self) -> Result<usize, BusError> {
        let failed = |error| BusError::ipc("ballast cannot be read", error);
        let mut read = 0;
        while let Some(sample) = self.receiver.receive().map_err(failed)? {
            // The sum only keeps the compiler from skipping the read.
            black_box(sample.payload().iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)));
            read += sample.payload().len();
        }
        Ok(read)
    }
}

/// Creates the ballast services of a swarm of `uavs`.
pub(crate) fn create(node: &Node<ipc::Service>, uavs: u32) -> Result<Vec<Factory>, BusError> {
    let create = |(uav, direction)| {
        let service = node.service_builder(&name(uav, direction)?).publish_subscribe::<[u8]>();
        let service = service.max_subscribers(READERS).subscriber_max_buffer_size(DEPTH).history_size(0);
        let created = service.enable_safe_overflow(true).create();
        created.map_err(|error| ballast_error(uav, "cannot be created", error))
    };
    UavId::all(uavs)
        .flat_map(|uav| [(uav, BallastDirection::ToAgent), (uav, BallastDirection::ToWorld)])
        .map(create)
        .collect()
}

fn open(node: &Node<ipc::Service>, uav: UavId, direction: BallastDirection) -> Result<Factory, BusError> {
    let name = name(uav, direction)?;
    let missing = |error: &PublishSubscribeOpenError| *error == PublishSubscribeOpenError::DoesNotExist;
    retry(|| node.service_builder(&name).publish_subscribe::<[u8]>().open(), missing)
        .map_err(|error| ballast_error(uav, "cannot be opened", error))
}

fn name(uav: UavId, direction: BallastDirection) -> Result<ServiceName, BusError> {
    let direction = match direction {
        BallastDirection::ToAgent => "to_agent",
        BallastDirection::ToWorld => "to_world",
    };
    let text = format!("uav/{}/ballast/{direction}", uav.0);
    text.as_str().try_into().map_err(|error| BusError::ipc(text, error))
}

fn ballast_error(uav: UavId, problem: &str, reason: impl Debug) -> BusError {
    BusError::ipc(format!("the ballast of {uav}: {problem}"), reason)
}
