//! Watches a live flight from outside: gets what the recorder gets, and costs the flight nothing.
//!
//! Must never be waited for: an observer that lags loses ticks, and nobody notices.

use super::{
    assembly::{Assembled, Assembly},
    ports::FlightPorts,
};
use crate::{RecorderError, clock::Clock, follower::Follower, metrics::Frame};
use ringwing_bus::Observer;
use ringwing_flight::{TickTiming, TimedEvent};

/// A live flight, as far as it was watched.
pub struct Observation {
    ports: FlightPorts,
    assembly: Assembly,
    follower: Follower,
    frame: Frame,
    clock: Clock,
    /// How many ticks a tick may wait for what belongs to it: in real time an agent may be late.
    patience: i64,
}

/// One tick that was watched.
#[derive(Debug)]
pub struct Seen<'o> {
    /// The swarm in the tick.
    pub frame: &'o Frame,
    /// What happened.
    pub events: &'o [TimedEvent],
    /// How long the tick took.
    pub timing: Option<TickTiming>,
}

/// The share of a second for which a tick in real time waits for late commands. More makes what is shown late; less shows
/// UAVs without the commands that came late.
const PATIENCE_PER_S: i64 = 10;

impl Observation {
    /// Begins to watch the flight of the run that `observer` has joined. Subscribes before it returns.
    pub fn begin(observer: &Observer) -> Result<Self, RecorderError> {
        let scenario = observer.scenario();
        let (uavs, rate_hz) = (scenario.formation.uavs, scenario.time.rate_hz);
        Ok(Self {
            ports: FlightPorts::of_observer(observer.node(), scenario)?,
            // From tick 0 on: the flight begins there, and the approach tick before it is not shown.
            assembly: Assembly::new(uavs, 0),
            follower: Follower::new(scenario),
            frame: Frame::new(scenario),
            clock: Clock::new(rate_hz),
            // In lockstep nothing is late: the world opens no tick before all have answered the last one.
            patience: if scenario.time.real_time { i64::from(rate_hz) / PATIENCE_PER_S } else { 0 },
        })
    }

    /// Fetches what has come since the last call, and hands over each tick that is complete; `take` may ask the follower for
    /// its view.
    pub fn fetch(&mut self, mut take: impl FnMut(&mut Follower, &Seen)) -> Result<(), RecorderError> {
        let follower = &mut self.follower;
        self.ports.fetch(&mut self.assembly, |event| follower.take_event(event))?;
        let Some(newest) = self.assembly.newest() else { return Ok(()) };
        while let Some(assembled) = self.assembly.take_before(newest + 1 - self.patience) {
            let Assembled { samples, timing, .. } = &assembled;
            self.frame.refill(samples, self.clock.rate_hz());
            let events = self.follower.observe(&self.frame);
            let seen = Seen { frame: &self.frame, events: &events, timing: *timing };
            take(&mut self.follower, &seen);
            self.assembly.recycle(assembled);
        }
        Ok(())
    }
}
