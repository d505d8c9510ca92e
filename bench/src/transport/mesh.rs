//! The connections of a mesh: which processes are connected, and how each process gets its ends.
//!
//! The world makes all connections and hands the ends over as descriptors through a Unix socket, because a process can
//! inherit only stdin, stdout and stderr without unsafe code.
//!
//! Must never take part in a tick.

use super::connection::PeerConnection;
use crate::case::{Carrier, Case};
use ringwing_flight::Part;
use rustix::{
    cmsg_space,
    net::{
        RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer, SendAncillaryMessage,
        SendFlags, recvmsg, sendmsg,
    },
};
use std::{
    io::{self, IoSlice, IoSliceMut},
    mem::MaybeUninit,
    os::{
        fd::{AsFd, BorrowedFd, OwnedFd},
        unix::net::UnixDatagram,
    },
};

/// Most descriptors in one message. The kernel refuses more than 253; fewer only take more messages.
const BATCH: usize = 128;
/// Fewest agents that form a ring. In a smaller swarm, each agent is its own neighbour on both sides.
const RING_AGENTS: usize = 3;

/// The descriptors of one end of a connection.
type End = Vec<OwnedFd>;

/// The ends of all connections of a mesh, for each process that holds them.
pub(super) struct Mesh {
    /// Of the world: to the leader, then to each agent.
    pub(super) world: Vec<End>,
    /// Of the leader: to the world, then to each agent.
    leader: Vec<End>,
    /// Of each agent: to the world, to the leader, and to both neighbours.
    agents: Vec<Vec<End>>,
}

impl Mesh {
    /// Connects the processes of `case`.
    pub(super) fn connect(case: &Case) -> io::Result<Self> {
        let agents = case.uavs as usize;
        let mut mesh =
            Self { world: Vec::new(), leader: Vec::new(), agents: (0..agents).map(|_| Vec::new()).collect() };
        let pair = || PeerConnection::pair(&case.carrier);
        // The order of these loops counts: `receive_ends` tells connections apart by their places alone.
        join(pair()?, &mut mesh.world, &mut mesh.leader);
        for agent in &mut mesh.agents {
            join(pair()?, &mut mesh.world, agent);
        }
        for agent in &mut mesh.agents {
            join(pair()?, &mut mesh.leader, agent);
        }
        for agent in 0..agents {
            let [near, far] = pair()?;
            mesh.agents[agent].push(near);
            mesh.agents[successor(agent, agents)].push(far);
        }
        Ok(mesh)
    }

    /// Takes the ends of the process that becomes `part`.
    pub(super) fn take(&mut self, part: Part) -> Vec<End> {
        let ends = match part {
            Part::Agent(uav) => self.agents.get_mut(uav.0 as usize - 1),
            _ => Some(&mut self.leader),
        };
        ends.map(std::mem::take).unwrap_or_default()
    }
}

fn join([near, far]: [End; 2], one: &mut Vec<End>, other: &mut Vec<End>) {
    one.push(near);
    other.push(far);
}

/// The agent whose state `agent` reads from ahead, as numbers from 0.
fn successor(agent: usize, agents: usize) -> usize {
    if agents < RING_AGENTS { agent } else { (agent + 1) % agents }
}

/// Hands `ends` over to the process at the other end of `socket`, and closes them here.
pub(super) fn send_ends(socket: &UnixDatagram, ends: Vec<End>) -> io::Result<()> {
    let all: Vec<OwnedFd> = ends.into_iter().flatten().collect();
    for batch in all.chunks(BATCH) {
        let descriptors: Vec<BorrowedFd> = batch.iter().map(AsFd::as_fd).collect();
        let mut space = [MaybeUninit::uninit(); cmsg_space!(ScmRights(BATCH))];
        let mut ancillary = SendAncillaryBuffer::new(&mut space);
        // Descriptors that do not fit would be left out silently, and the receiver would wait for them forever.
        if !ancillary.push(SendAncillaryMessage::ScmRights(&descriptors)) {
            return Err(io::Error::other("too many descriptors for one message"));
        }
        // Descriptors need a message to travel with.
        sendmsg(socket, &[IoSlice::new(&[0])], &mut ancillary, SendFlags::empty())?;
    }
    Ok(())
}

/// Takes over the connections of `part`, in the order of [`Mesh`].
pub(super) fn receive_ends(
    socket: &UnixDatagram,
    case: &Case,
    part: Part,
) -> io::Result<Vec<PeerConnection>> {
    let connections = if part == Part::Leader { 1 + case.uavs as usize } else { 4 };
    let per_end = if case.carrier == Carrier::UnixDatagram { 1 } else { 2 };
    let mut descriptors = Vec::new();
    // No message says that it is the last: the number of descriptors decides, and both sides know it from the case.
    while descriptors.len() < connections * per_end {
        receive_batch(socket, &mut descriptors)?;
    }
    let mut descriptors = descriptors.into_iter();
    let end = |_| PeerConnection::from_end(&case.carrier, descriptors.by_ref().take(per_end).collect());
    (0..connections).map(end).collect()
}

fn receive_batch(socket: &UnixDatagram, descriptors: &mut Vec<OwnedFd>) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); cmsg_space!(ScmRights(BATCH))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut space);
    let received =
        recvmsg(socket, &mut [IoSliceMut::new(&mut [0])], &mut ancillary, RecvFlags::CMSG_CLOEXEC)?;
    if received.bytes == 0 {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    for message in ancillary.drain() {
        if let RecvAncillaryMessage::ScmRights(batch) = message {
            descriptors.extend(batch);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Load, Topology};
    use ringwing_flight::UavId;
    use ringwing_scenario::Wake;

    fn case(carrier: Carrier, uavs: u32) -> Case {
        let topology = Topology::Mesh;
        let (load, wake) = (Load::Closed, Wake::Gate);
        Case { carrier, topology, load, uavs, wake, payload_bytes: 0, recorder: false }
    }

    /// The connections of the agents of a mesh, handed over as between processes.
    fn agents(case: &Case) -> Vec<Vec<PeerConnection>> {
        let mut mesh = Mesh::connect(case).unwrap();
        let agent = |uav| {
            let (near, far) = UnixDatagram::pair().unwrap();
            send_ends(&near, mesh.take(Part::Agent(uav))).unwrap();
            receive_ends(&far, case, Part::Agent(uav)).unwrap()
        };
        UavId::all(case.uavs).map(agent).collect()
    }

    /// Which agents get what `agent` sends to its neighbours.
    fn heard_by(agents: &mut [Vec<PeerConnection>], agent: usize) -> Vec<usize> {
        agents[agent][2..].iter_mut().for_each(|neighbour| neighbour.send(&[agent as u8; 8]).unwrap());
        let mut heard = Vec::new();
        for (other, connections) in agents.iter_mut().enumerate() {
            for connection in &mut connections[2..] {
                let PeerConnection::UnixDatagram(socket) = &*connection else { panic!("{connection:?}") };
                socket.set_nonblocking(true).unwrap();
                heard.extend(connection.receive(&mut [0; 8]).is_ok().then_some(other));
            }
        }
        heard
    }

    #[test]
    fn each_agent_is_heard_by_both_neighbours_on_the_ring() {
        let mut agents = agents(&case(Carrier::UnixDatagram, 4));
        let heard: Vec<_> = (0..4).map(|agent| heard_by(&mut agents, agent)).collect();
        assert_eq!(heard, [[1, 3], [0, 2], [1, 3], [0, 2]]);
    }

    #[test]
    fn in_a_swarm_below_a_ring_each_agent_hears_itself_twice() {
        for uavs in [1, 2] {
            let mut agents = agents(&case(Carrier::UnixDatagram, uavs));
            for agent in 0..agents.len() {
                assert_eq!(heard_by(&mut agents, agent), [agent, agent]);
            }
        }
    }

    #[test]
    fn the_leader_of_a_large_mesh_gets_an_end_for_every_agent() {
        let case = case(Carrier::Pipe, 70);
        let mut mesh = Mesh::connect(&case).unwrap();
        let (near, far) = UnixDatagram::pair().unwrap();
        send_ends(&near, mesh.take(Part::Leader)).unwrap();
        let mut leader = receive_ends(&far, &case, Part::Leader).unwrap();
        assert_eq!((leader.len(), mesh.world.len()), (71, 71));
        let last = mesh.take(Part::Agent(UavId(70))).swap_remove(1);
        leader[70].send(&[9; 8]).unwrap();
        let mut received = [0; 8];
        PeerConnection::from_end(&Carrier::Pipe, last).unwrap().receive(&mut received).unwrap();
        assert_eq!(received, [9; 8]);
    }
}
