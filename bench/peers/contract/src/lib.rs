//! The part of a peer for `ringwing bench --peer` that is the same for every transport: the contract of `bench/PEERS.md`.
//!
//! Must never know how messages travel: [`World`] and [`Agent`] are what a transport implements.

mod args;
mod trace;

pub use args::{Args, Role};

use rustix::time::{ClockId, clock_gettime};
use std::{
    error::Error,
    io::{self, Write},
    thread,
    time::Duration,
};
use trace::Trace;

/// Anything that can go wrong; the text goes to stderr.
pub type Failure = Box<dyn Error + Send + Sync>;

/// The tick that ends a run.
const END: i64 = -1;

/// The world's end of a transport, connected to all agents.
pub trait World {
    /// Sends `message` to every agent, each for itself.
    fn send(&mut self, message: &[u8]) -> Result<(), Failure>;
    /// Waits for the next answer of any agent.
    fn receive(&mut self) -> Result<Vec<u8>, Failure>;
    /// Waits until everything that was sent is on its way.
    fn flush(&mut self) -> Result<(), Failure>;
}

/// An agent's end of a transport, connected to the world.
pub trait Agent {
    /// Waits for the next message of the world.
    fn receive(&mut self) -> Result<Vec<u8>, Failure>;
    /// Sends `message` to the world.
    fn send(&mut self, message: &[u8]) -> Result<(), Failure>;
}

/// The time of `CLOCK_MONOTONIC`, in nanoseconds.
fn now_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec.cast_unsigned() * 1_000_000_000 + now.tv_nsec.cast_unsigned()
}

fn put_tick(message: &mut [u8], tick: i64) {
    message[..size_of::<i64>()].copy_from_slice(&tick.to_le_bytes());
}

fn tick_in(message: &[u8]) -> Result<i64, Failure> {
    Ok(i64::from_le_bytes(*message.first_chunk().ok_or("a message is too short for its tick")?))
}

/// Runs ticks as the world, from the warm-up to the end.
pub fn run_world(args: &Args, world: &mut impl World) -> Result<(), Failure> {
    // One clock for the warm-up and the measured time: the numbers of ticks must have no gap between the two.
    let mut clock = Clock { args, world, tick: 0, trace: Trace::default() };
    clock.run_ticks(args.warm_up_s)?;
    report("warm")?;
    clock.run_ticks(args.seconds)?;
    report("done")?;
    let mut message = vec![1; args.bytes_out];
    put_tick(&mut message, END);
    clock.world.send(&message)?;
    clock.world.flush()?;
    Ok(clock.trace.save(&args.dir.join("world.trace"))?)
}

/// Prints a line, and waits until ringwing has read what all processes have used.
fn report(line: &str) -> io::Result<()> {
    println!("{line}");
    io::stdout().flush()?;
    io::stdin().read_line(&mut String::new()).map(drop)
}

struct Clock<'a, W> {
    args: &'a Args,
    world: &'a mut W,
    tick: i64,
    trace: Trace,
}

impl<W: World> Clock<'_, W> {
    fn run_ticks(&mut self, seconds: f64) -> Result<(), Failure> {
        // A rate of 0 means a closed loop, which has no period.
        let period_ns = 1_000_000_000_u64.checked_div(self.args.rate_hz);
        let begin_ns = now_ns();
        let end_ns = begin_ns + (seconds * 1e9) as u64;
        // The contract has the first tick due a period after the start, not at once.
        let mut due_ns = begin_ns + period_ns.unwrap_or(0);
        // A tick that was due in time still runs, however late it begins.
        while period_ns.map_or_else(now_ns, |_| due_ns) < end_ns {
            let opened_ns = if period_ns.is_some() { sleep_until(due_ns) } else { now_ns() };
            self.exchange()?;
            self.trace.push(self.tick, [due_ns, opened_ns, now_ns()]);
            self.tick += 1;
            if let Some(period_ns) = period_ns {
                // Skip the due times that had already passed when the tick was opened.
                due_ns += (1 + (opened_ns - due_ns) / period_ns) * period_ns;
            }
        }
        Ok(())
    }

    fn exchange(&mut self) -> Result<(), Failure> {
        let mut message = vec![1; self.args.bytes_out];
        put_tick(&mut message, self.tick);
        self.world.send(&message)?;
        for _ in 0..self.args.uavs {
            let answer = self.world.receive()?;
            if tick_in(&answer)? != self.tick || answer.len() != self.args.bytes_back {
                return Err(format!("a wrong answer to tick {} came", self.tick).into());
            }
        }
        Ok(())
    }
}

/// Sleeps until `due_ns`; returns the time after that.
fn sleep_until(due_ns: u64) -> u64 {
    loop {
        let now_ns = now_ns();
        if now_ns >= due_ns {
            return now_ns;
        }
        thread::sleep(Duration::from_nanos(due_ns - now_ns));
    }
}

/// Answers ticks as the agent of UAV `uav` until the world ends the run.
pub fn run_agent(args: &Args, uav: u32, agent: &mut impl Agent) -> Result<(), Failure> {
    let mut trace = Trace::default();
    let mut answer = vec![1; args.bytes_back];
    loop {
        let message = agent.receive()?;
        let woke_ns = now_ns();
        let tick = tick_in(&message)?;
        if tick == END {
            break;
        }
        let read_ns = now_ns();
        put_tick(&mut answer, tick);
        let sent_ns = now_ns();
        agent.send(&answer)?;
        trace.push(tick, [woke_ns, read_ns, sent_ns]);
    }
    Ok(trace.save(&args.dir.join(format!("agent-{uav}.trace")))?)
}
