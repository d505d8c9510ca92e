//! The peers of a hub as child processes: starting them, connecting to them, and waiting for their end.
//!
//! Must never take part in a tick.

use super::{
    connection::PeerConnection,
    mesh::{Mesh, send_ends},
    peer::part,
};
use crate::{
    case::{Carrier, Case, Topology},
    error::BenchError,
};
use ringwing_bus::{Domain, Gate, Patience, Placement, raise_open_files_limit};
use ringwing_flight::Part;
use std::{
    io,
    net::{Ipv4Addr, TcpListener, UdpSocket},
    os::{fd::OwnedFd, unix::net::UnixDatagram},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

/// How long a peer may take to start, to answer, and to end. Shorter fails cases on an overloaded machine.
pub(super) const PEER_TIMEOUT: Duration = Duration::from_secs(10);
/// What each further peer adds to the time in which all must start, and end: they share few cores. Shorter fails large cases on
/// slow machines.
const TIMEOUT_PER_PEER: Duration = Duration::from_millis(50);
/// What the user can do about peers that are late.
const REMEDY: &str = "measure fewer UAVs, or end other programs";
/// Pause between two looks at a peer that starts or ends. Longer delays the start of a case; shorter takes CPU from
/// the peers. No tick is measured meanwhile.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// The peers' processes, and the hub's ends of their connections until [`Peers::connections`] takes them.
pub(super) struct Peers {
    children: Vec<(Part, Child)>,
    mesh: Option<Mesh>,
    unix_sockets: Vec<OwnedFd>,
    listener: Option<TcpListener>,
    udp_sockets: Vec<UdpSocket>,
}

impl Peers {
    /// Starts a peer for each UAV of `case`, and one for a leader; each writes its timestamps into `folder`.
    pub(super) fn start(
        case: &Case,
        domain: &Domain,
        folder: &Path,
        placement: Placement,
    ) -> Result<Self, BenchError> {
        raise_open_files_limit()?;
        let mut peers =
            Self::prepare_all(case).map_err(BenchError::system("the transport cannot be opened"))?;
        // A leader is the peer without a number, and starts last because it has the last place.
        let leader = case.has_leader().then_some(None);
        for member in (0..case.uavs).map(Some).chain(leader) {
            // Not the path of this program: an update may have replaced the file while the benchmark runs.
            let mut command = Command::new("/proc/self/exe");
            command.arg("bench-peer").args(["--case", &case.to_string()]);
            command.args(member.iter().flat_map(|member| ["--member".into(), member.to_string()]));
            command.args(["--domain", &domain.id().to_string()]);
            command.args(["--launcher", &std::process::id().to_string(), "--into"]).arg(folder);
            peers
                .start_one(case, command, member, placement)
                .map_err(BenchError::system("a peer cannot be started"))?;
        }
        Ok(peers)
    }

    /// Creates what all peers share before the first one starts.
    fn prepare_all(case: &Case) -> io::Result<Self> {
        Ok(Self {
            children: Vec::new(),
            mesh: (case.topology == Topology::Mesh).then(|| Mesh::connect(case)).transpose()?,
            unix_sockets: Vec::new(),
            listener: listener(case)?,
            udp_sockets: Vec::new(),
        })
    }

    /// Starts the peer number `member`, and hands its end of the transport over.
    fn start_one(
        &mut self,
        case: &Case,
        mut command: Command,
        member: Option<u32>,
        placement: Placement,
    ) -> io::Result<()> {
        // The hub itself has place 0, and a leader the last one.
        let place = member.unwrap_or(case.uavs) as usize + 1;
        let part = part(member);
        if let Some(mesh) = &mut self.mesh {
            let (ours, theirs) = UnixDatagram::pair()?;
            command.stdin(OwnedFd::from(theirs)).stdout(Stdio::null());
            self.children.push((part, placement.start(place, || command.spawn())?));
            // Sending an end also closes it here, so the hub holds fewer descriptors with each peer that starts.
            return send_ends(&ours, mesh.take(part));
        }
        self.prepare(&case.carrier, &mut command)?;
        self.children.push((part, placement.start(place, || command.spawn())?));
        Ok(())
    }

    /// Creates the hub's end of a peer's connection, and lets the peer inherit or find its own.
    fn prepare(&mut self, carrier: &Carrier, command: &mut Command) -> io::Result<()> {
        command.stdin(Stdio::null()).stdout(Stdio::null());
        match carrier {
            Carrier::Pipe | Carrier::PipePolled => {
                command.stdin(Stdio::piped()).stdout(Stdio::piped());
            }
            Carrier::UnixDatagram => {
                let (ours, theirs) = UnixDatagram::pair()?;
                self.unix_sockets.push(ours.into());
                command.stdin(OwnedFd::from(theirs));
            }
            Carrier::Udp => {
                let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
                command.args(["--port", &socket.local_addr()?.port().to_string()]);
                self.udp_sockets.push(socket);
            }
            Carrier::Tcp => {
                let listener = self.listener.as_ref().ok_or_else(no_listener)?;
                command.args(["--port", &listener.local_addr()?.port().to_string()]);
            }
            Carrier::Swarm | Carrier::Gate | Carrier::Atomic | Carrier::Futex | Carrier::Peer(_) => {}
        }
        Ok(())
    }

    /// Takes the hub's ends of all connections; none for carriers in shared memory.
    pub(super) fn connections(&mut self, case: &Case) -> Result<Vec<PeerConnection>, BenchError> {
        self.connect(case).map_err(BenchError::system("a peer cannot be reached"))
    }

    fn connect(&mut self, case: &Case) -> io::Result<Vec<PeerConnection>> {
        if let Some(mesh) = self.mesh.take() {
            let ends = mesh.world.into_iter();
            let connections = ends.map(|end| PeerConnection::from_end(&case.carrier, end));
            return connections.map(with_timeout).collect();
        }
        let connections: Vec<PeerConnection> = match case.carrier {
            Carrier::Pipe | Carrier::PipePolled => self.pipes(case.carrier == Carrier::PipePolled)?,
            Carrier::UnixDatagram => self
                .unix_sockets
                .drain(..)
                .map(|socket| PeerConnection::UnixDatagram(socket.into()))
                .collect(),
            Carrier::Udp => self.udp_sockets.drain(..).map(introduced_udp).collect::<io::Result<_>>()?,
            Carrier::Tcp => self.accepted(case.uavs)?,
            Carrier::Swarm | Carrier::Gate | Carrier::Atomic | Carrier::Futex | Carrier::Peer(_) => {
                Vec::new()
            }
        };
        connections.into_iter().map(|connection| with_timeout(Ok(connection))).collect()
    }

    fn pipes(&mut self, polled: bool) -> io::Result<Vec<PeerConnection>> {
        let no_pipe = || io::Error::other("the peer has no pipe");
        let pipe = |child: &mut Child| {
            let out = child.stdin.take().ok_or_else(no_pipe)?;
            let back = child.stdout.take().ok_or_else(no_pipe)?;
            if polled { PeerConnection::polled(out, back) } else { Ok(PeerConnection::pipe(out, back)) }
        };
        self.children.iter_mut().map(|(_, child)| pipe(child)).collect()
    }

    /// Accepts all peers, which connect before they report ready.
    fn accepted(&mut self, peers: u32) -> io::Result<Vec<PeerConnection>> {
        let listener = self.listener.take().ok_or_else(no_listener)?;
        (0..peers).map(|_| PeerConnection::tcp(listener.accept()?.0)).collect()
    }

    /// How long all peers may take to start or to end.
    fn patience(&self) -> Patience {
        Patience::of(PEER_TIMEOUT + TIMEOUT_PER_PEER * self.children.len() as u32)
    }

    /// Waits until every peer has reported ready at the gate.
    pub(super) fn wait_until_ready(&mut self, gate: &Gate) -> Result<(), BenchError> {
        let mut patience = self.patience();
        for (part, child) in &mut self.children {
            while gate.ready_process(*part).is_none() {
                if let Some(status) = child.try_wait().map_err(BenchError::system("a peer is lost"))? {
                    return Err(BenchError::case(format!("a peer ended before it was ready: {status}")));
                }
                if patience.is_over() {
                    return Err(BenchError::case(format!("a peer was not ready in time: {REMEDY}")));
                }
                thread::sleep(POLL_PERIOD);
            }
        }
        Ok(())
    }

    /// Waits until all peers have written their timestamps and ended.
    pub(super) fn wait_until_ended(mut self) -> Result<(), BenchError> {
        let mut patience = self.patience();
        for (_, child) in &mut self.children {
            let status = loop {
                if let Some(status) = child.try_wait().map_err(BenchError::system("a peer is lost"))? {
                    break status;
                }
                if patience.is_over() {
                    return Err(BenchError::case(format!("a peer did not end in time: {REMEDY}")));
                }
                thread::sleep(POLL_PERIOD);
            };
            if !status.success() {
                return Err(BenchError::case(format!("a peer failed: {status}")));
            }
        }
        Ok(())
    }
}

/// Limits every wait of the hub for a peer.
fn with_timeout(connection: io::Result<PeerConnection>) -> io::Result<PeerConnection> {
    let connection = connection?;
    connection.set_timeout(PEER_TIMEOUT)?;
    Ok(connection)
}

/// The port that peers of a TCP case connect to.
fn listener(case: &Case) -> io::Result<Option<TcpListener>> {
    if case.carrier != Carrier::Tcp {
        return Ok(None);
    }
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    // All peers connect before the first is accepted; the default backlog is too short for a large swarm.
    rustix::net::listen(&listener, case.uavs.cast_signed())?;
    Ok(Some(listener))
}

fn no_listener() -> io::Error {
    io::Error::other("the hub listens on no port")
}

/// Connects a UDP socket to the peer that sent its first datagram.
fn introduced_udp(socket: UdpSocket) -> io::Result<PeerConnection> {
    socket.set_read_timeout(Some(PEER_TIMEOUT))?;
    let (_, peer) = socket.recv_from(&mut [0; 4])?;
    socket.connect(peer)?;
    Ok(PeerConnection::Udp(socket))
}
