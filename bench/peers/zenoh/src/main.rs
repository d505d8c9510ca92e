//! A peer for `ringwing bench --peer` over zenoh: a key for each direction of each agent, over a Unix socket.

use ringwing_peer_contract::{Agent, Args, Failure, Role, World, run_agent, run_world};
use std::{collections::BTreeSet, env, path::Path, process::ExitCode, thread, time::Duration};
use zenoh::{
    Config, Session, Wait,
    handlers::FifoChannelHandler,
    pubsub::{Publisher, Subscriber},
    qos::CongestionControl,
    sample::Sample,
};

/// Pause between two greetings. Longer delays the start; shorter takes CPU from the other processes.
const GREETING_PERIOD: Duration = Duration::from_millis(20);
/// How long the world lets its last messages leave. Shorter loses them on a busy machine, so that agents never end.
const LINGER: Duration = Duration::from_millis(200);
/// An agent sends this until it hears the same from the world.
const HELLO: &[u8] = b"hello";
/// An agent sends this once, after the greetings: from then on, both directions are open.
const READY: &[u8] = b"ready";

type Inbox = Subscriber<FifoChannelHandler<Sample>>;

struct ZenohWorld {
    agents: Vec<Publisher<'static>>,
    inbox: Inbox,
    _session: Session,
}

impl ZenohWorld {
    /// Waits until all agents have reported ready.
    fn open(args: &Args) -> Result<Self, Failure> {
        let session = zenoh::open(config(args, "listen")?).wait()?;
        let inbox = session.declare_subscriber("back/*").wait()?;
        let agents: Vec<_> = (1..=args.uavs)
            .map(|uav| publisher(&session, &format!("out/{uav}")))
            .collect::<Result<_, _>>()?;
        let mut ready = BTreeSet::new();
        while ready.len() < agents.len() {
            let sample = inbox.recv()?;
            let uav: usize = sample.key_expr().as_str().trim_start_matches("back/").parse()?;
            if sample.payload().to_bytes() == READY {
                ready.insert(uav);
            } else {
                agents.get(uav - 1).ok_or("an agent has too high a number")?.put(HELLO).wait()?;
            }
        }
        Ok(Self { agents, inbox, _session: session })
    }
}

impl World for ZenohWorld {
    fn send(&mut self, message: &[u8]) -> Result<(), Failure> {
        self.agents.iter().try_for_each(|agent| agent.put(message).wait())
    }

    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        payload(&self.inbox)
    }

    fn flush(&mut self) -> Result<(), Failure> {
        thread::sleep(LINGER);
        Ok(())
    }
}

struct ZenohAgent {
    world: Publisher<'static>,
    inbox: Inbox,
    _session: Session,
}

impl ZenohAgent {
    /// Connects, and greets the world until it answers: it does not hear of this agent's key at once.
    fn open(args: &Args, uav: u32) -> Result<Self, Failure> {
        while !socket(&args.dir).exists() {
            thread::sleep(GREETING_PERIOD);
        }
        let session = zenoh::open(config(args, "connect")?).wait()?;
        let inbox = session.declare_subscriber(format!("out/{uav}")).wait()?;
        let world = publisher(&session, &format!("back/{uav}"))?;
        while inbox.try_recv()?.is_none() {
            world.put(HELLO).wait()?;
            thread::sleep(GREETING_PERIOD);
        }
        world.put(READY).wait()?;
        Ok(Self { world, inbox, _session: session })
    }
}

impl Agent for ZenohAgent {
    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        loop {
            // Answers to greetings that crossed the first one are still on their way.
            let message = payload(&self.inbox)?;
            if message != HELLO {
                return Ok(message);
            }
        }
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Failure> {
        self.world.put(message).wait()
    }
}

fn payload(inbox: &Inbox) -> Result<Vec<u8>, Failure> {
    Ok(inbox.recv()?.payload().to_bytes().into_owned())
}

/// A publisher that loses nothing and sends every message at once.
fn publisher(session: &Session, key: &str) -> Result<Publisher<'static>, Failure> {
    session
        .declare_publisher(key.to_owned())
        .congestion_control(CongestionControl::Block)
        .express(true)
        .wait()
}

fn socket(dir: &Path) -> std::path::PathBuf {
    dir.join("zenoh.socket")
}

/// A session that finds nobody but the world: `side` is `listen` or `connect`.
fn config(args: &Args, side: &str) -> Result<Config, Failure> {
    let mut config = Config::default();
    let endpoints = format!("[\"unixsock-stream/{}\"]", socket(&args.dir).display());
    let other = if side == "listen" { "connect" } else { "listen" };
    // All agents connect at once. Zenoh turns away those beyond its limit, and they wait before they try again.
    let agents = (args.uavs + 1).to_string();
    for (key, value) in [
        ("transport/unicast/accept_pending", agents.as_str()),
        ("transport/unicast/max_sessions", &agents),
        ("mode", "\"peer\""),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        (&format!("{side}/endpoints"), endpoints.as_str()),
        (&format!("{other}/endpoints"), "[]"),
    ] {
        config.insert_json5(key, value)?;
    }
    Ok(config)
}

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let result = Args::parse(&words).and_then(|args| match args.role {
        Role::World => run_world(&args, &mut ZenohWorld::open(&args)?),
        Role::Agent(uav) => run_agent(&args, uav, &mut ZenohAgent::open(&args, uav)?),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("zenoh: {error}");
            ExitCode::FAILURE
        }
    }
}
