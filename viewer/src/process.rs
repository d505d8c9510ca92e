//! The viewer's process of a live run: watches the flight as an observer, and serves it to Foxglove.
//!
//! Must never be waited for. It yields the processor to the flight, and what it does not get in time it leaves out.

use crate::{
    LiveAddress, ViewerError,
    server::{Ask, LiveServer, Offer, memory::Memory},
};
use ringwing_bus::{MemberArgs, Observer};
use ringwing_recorder::{Observation, stream::MessageStream};
use rustix::process::nice;
use std::{
    io::{self, Write},
    sync::Arc,
    thread,
    time::Duration,
};

/// How the process is called in the run.
const NAME: &str = "viewer";
/// How much less of the processor it gets than the flight where both want it, as of `nice`. Less disturbs the flight on a busy
/// machine; more makes the picture jerk.
const NICENESS: i32 = 10;
/// How often it fetches what has come. Less often makes the picture jerk; more often takes the processor from the flight.
const POLL: Duration = Duration::from_millis(10);
/// How long the server stays after the flight, for the last messages to reach the viewers. Shorter cuts them off; longer keeps
/// the process around for nothing.
const LINGER: Duration = Duration::from_millis(200);

/// Serves the flight of a run to Foxglove.
#[derive(Debug, Clone, clap::Args)]
pub struct ViewerArgs {
    /// Which run to show.
    #[command(flatten)]
    pub member: MemberArgs,
    /// Where to listen: a port, an IP address, or both.
    #[arg(long, default_value_t)]
    pub address: LiveAddress,
}

/// Serves the flight until it ends or the process is asked to stop. Prints on standard output where it listens.
pub fn run(args: &ViewerArgs) -> Result<(), ViewerError> {
    // A viewer that gets as much of the processor as the flight works as well, so ignore a failure.
    let _ = nice(NICENESS);
    let observer = Observer::of_run(&args.member, NAME)?;
    let mut flight = Observation::begin(&observer)?;
    let (memory, domain) = (Memory::default(), observer.domain().clone());
    let ask: Ask = Arc::new(move |sentence| domain.ask(sentence));
    let offer = Offer {
        scenario: observer.scenario(),
        ask: Some(ask),
        times: None,
        listener: Arc::new(memory.clone()),
    };
    let mut server = LiveServer::start(&args.address, &offer, memory)?;
    let mut stream = MessageStream::open(&mut server, observer.scenario(), true)?;
    // Nobody may be there to read this, and viewers may know the address.
    let _ = writeln!(io::stdout(), "{}", server.url());
    loop {
        // Ask before fetching, so that everything sent until now is shown.
        let is_over = observer.is_run_over() || observer.stop().is_set();
        show(&mut flight, &mut stream, &mut server)?;
        if is_over {
            thread::sleep(LINGER);
            return Ok(());
        }
        thread::sleep(POLL);
    }
}

/// Shows what has come of the flight since the last call.
fn show(
    flight: &mut Observation,
    stream: &mut MessageStream,
    server: &mut LiveServer,
) -> Result<(), ViewerError> {
    let (mut newest, mut shown) = (None, Ok(()));
    flight.fetch(|follower, seen| {
        newest = Some(seen.frame.tick);
        let view = follower.view(seen.frame, seen.timing.as_ref());
        let result = stream.write_frame(server, seen.frame, seen.timing.as_ref(), seen.events, &view);
        // The closure cannot return an error, so keep the first one for the caller.
        shown = std::mem::replace(&mut shown, Ok(())).and(result);
    })?;
    if let Some(tick) = newest {
        server.tell_time(server.log_time(tick));
    }
    shown
}
