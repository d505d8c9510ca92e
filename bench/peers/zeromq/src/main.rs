//! A peer for `ringwing bench --peer` over ZeroMQ: a ROUTER socket of the world and a DEALER socket of each agent, over IPC.

use ringwing_peer_contract::{Agent, Args, Failure, Role, World, run_agent, run_world};
use std::{env, io, path::Path, process::ExitCode, time::Duration};
use tokio::{
    runtime::{Builder, Runtime},
    time::sleep,
};
use zeromq::{DealerSocket, RouterSocket, Socket, SocketRecv, SocketSend, ZmqMessage};

/// How long the world lets its last messages leave. Shorter loses them on a busy machine, so that agents never end.
const LINGER: Duration = Duration::from_millis(200);

struct ZmqWorld {
    runtime: Runtime,
    socket: RouterSocket,
    /// The identity of each agent, as the first frame of a message to it.
    agents: Vec<ZmqMessage>,
}

impl ZmqWorld {
    /// Waits until all agents have sent their first message.
    fn open(args: &Args) -> Result<Self, Failure> {
        let (runtime, mut socket) = (runtime()?, RouterSocket::new());
        runtime.block_on(socket.bind(&endpoint(&args.dir)))?;
        let mut world = Self { runtime, socket, agents: Vec::new() };
        for _ in 0..args.uavs {
            let mut hello = world.runtime.block_on(world.socket.recv())?;
            // The ROUTER socket puts the sender's identity before each message; the greeting itself does not matter.
            hello.split_off(1);
            world.agents.push(hello);
        }
        Ok(world)
    }
}

impl World for ZmqWorld {
    fn send(&mut self, message: &[u8]) -> Result<(), Failure> {
        let Self { runtime, socket, agents } = self;
        runtime.block_on(async {
            for identity in agents {
                let mut addressed = ZmqMessage::from(message.to_vec());
                addressed.prepend(identity);
                socket.send(addressed).await?;
            }
            Ok(())
        })
    }

    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        let mut message = self.runtime.block_on(self.socket.recv())?;
        payload(&message.split_off(1))
    }

    fn flush(&mut self) -> Result<(), Failure> {
        // A timer can be made only inside the runtime.
        self.runtime.block_on(async { sleep(LINGER).await });
        Ok(())
    }
}

struct ZmqAgent {
    runtime: Runtime,
    socket: DealerSocket,
}

impl ZmqAgent {
    /// Connects, and tells the world its identity.
    fn open(args: &Args) -> Result<Self, Failure> {
        let (runtime, mut socket) = (runtime()?, DealerSocket::new());
        runtime.block_on(socket.connect(&endpoint(&args.dir)))?;
        let mut agent = Self { runtime, socket };
        agent.send(b"hello")?;
        Ok(agent)
    }
}

impl Agent for ZmqAgent {
    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        payload(&self.runtime.block_on(self.socket.recv())?)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Failure> {
        Ok(self.runtime.block_on(self.socket.send(message.to_vec().into()))?)
    }
}

/// A runtime on this thread alone: another thread would have to be woken for every message.
fn runtime() -> io::Result<Runtime> {
    Builder::new_current_thread().enable_all().build()
}

fn endpoint(dir: &Path) -> String {
    format!("ipc://{}/zeromq.socket", dir.display())
}

fn payload(message: &ZmqMessage) -> Result<Vec<u8>, Failure> {
    Ok(message.get(0).ok_or("an empty message came")?.to_vec())
}

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let result = Args::parse(&words).and_then(|args| match args.role {
        Role::World => run_world(&args, &mut ZmqWorld::open(&args)?),
        Role::Agent(uav) => run_agent(&args, uav, &mut ZmqAgent::open(&args)?),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("zeromq: {error}");
            ExitCode::FAILURE
        }
    }
}
