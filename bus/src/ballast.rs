//! Ballast: bytes that go between the world and an agent in every tick beside the messages, so that their cost shows.
//!
//! Loaned from shared memory, written, sent without a copy, and read to the last byte; never of any use to the flight.

use crate::{
    BusError,
    channel::{TICK_DEPTH, patiently},
};
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

type Factory = PortFactory<ipc::Service, [u8], ()>;

/// One end of the ballast between the world and an agent.
#[derive(Debug)]
pub struct Ballast {
    bytes: usize,
    sender: Publisher<ipc::Service, [u8], ()>,
    receiver: Subscriber<ipc::Service, [u8], ()>,
}

#[derive(Debug, Clone, Copy)]
enum Way {
    ToAgent,
    ToWorld,
}

impl Ballast {
    /// The world's end of the ballast of `uav`: so many `bytes` each way.
    pub fn of_world(node: &Node<ipc::Service>, uav: UavId, bytes: u32) -> Result<Self, BusError> {
        Self::open(node, uav, bytes, [Way::ToAgent, Way::ToWorld])
    }

    /// The end of the agent of `uav`.
    pub fn of_agent(node: &Node<ipc::Service>, uav: UavId, bytes: u32) -> Result<Self, BusError> {
        Self::open(node, uav, bytes, [Way::ToWorld, Way::ToAgent])
    }

    fn open(
        node: &Node<ipc::Service>,
        uav: UavId,
        bytes: u32,
        [out, back]: [Way; 2],
    ) -> Result<Self, BusError> {
        let bytes = bytes as usize;
        let sender = open(node, uav, out)?.publisher_builder().initial_max_slice_len(bytes).create();
        let receiver = open(node, uav, back)?.subscriber_builder().create();
        Ok(Self {
            bytes,
            sender: sender.map_err(|error| refused(uav, &error))?,
            receiver: receiver.map_err(|error| refused(uav, &error))?,
        })
    }

    /// Sends the bytes of `tick`.
    pub fn send(&self, tick: Tick) -> Result<(), BusError> {
        let failed = |error: &dyn Debug| BusError::ipc("ballast cannot be sent", error);
        let sample = self.sender.loan_slice_uninit(self.bytes).map_err(|error| failed(&error))?;
        let filling = tick.0 as u8;
        sample.write_from_fn(|_| filling).send().map_err(|error| failed(&error))?;
        Ok(())
    }

    /// Reads all that has come, to the last byte; returns how much that was.
    pub fn receive(&self) -> Result<usize, BusError> {
        let failed = |error| BusError::ipc("ballast cannot be read", error);
        let mut read = 0;
        while let Some(sample) = self.receiver.receive().map_err(failed)? {
            black_box(sample.payload().iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)));
            read += sample.payload().len();
        }
        Ok(read)
    }
}

fn refused(uav: UavId, error: &dyn Debug) -> BusError {
    BusError::ipc(format!("the ballast of {uav}: no place for another process"), error)
}

fn name(uav: UavId, way: Way) -> Result<ServiceName, BusError> {
    let way = match way {
        Way::ToAgent => "to_agent",
        Way::ToWorld => "to_world",
    };
    let text = format!("uav/{}/ballast/{way}", uav.0);
    text.as_str().try_into().map_err(|error| BusError::ipc(text, error))
}

/// Creates the services of all ballast of a swarm of `uavs`.
pub(crate) fn create(node: &Node<ipc::Service>, uavs: u32) -> Result<Vec<Factory>, BusError> {
    let ways = UavId::all(uavs).flat_map(|uav| [(uav, Way::ToAgent), (uav, Way::ToWorld)]);
    let create = |(uav, way)| {
        let service = node.service_builder(&name(uav, way)?).publish_subscribe::<[u8]>();
        let service = service.subscriber_max_buffer_size(TICK_DEPTH).history_size(0);
        let created = service.enable_safe_overflow(true).create();
        created.map_err(|error| BusError::ipc(format!("the ballast of {uav}: cannot be created"), error))
    };
    ways.map(create).collect()
}

fn open(node: &Node<ipc::Service>, uav: UavId, way: Way) -> Result<Factory, BusError> {
    let name = name(uav, way)?;
    let missing = |error: &PublishSubscribeOpenError| *error == PublishSubscribeOpenError::DoesNotExist;
    patiently(|| node.service_builder(&name).publish_subscribe::<[u8]>().open(), missing)
        .map_err(|error| BusError::ipc(format!("the ballast of {uav}: cannot be opened"), error))
}
