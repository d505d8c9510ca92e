//! The time of a flight that is played: it runs at any speed, stands still, and jumps.
//!
//! Must never read a clock: the present moment comes in as an argument.

use foxglove::websocket::{PlaybackCommand, PlaybackControlRequest};
use std::time::Instant;

/// The range of speeds. A slower one looks like a pause; a faster one is limited by how fast the log is read anyway.
const SPEEDS: (f64, f64) = (0.01, 1000.0);

/// The time of a flight that is played.
#[derive(Debug)]
pub(super) struct PlayClock {
    /// The time in the flight at the moment `since`, in nanoseconds of the log.
    time: u64,
    since: Option<Instant>,
    speed: f64,
    is_playing: bool,
    /// The time to jump to, until the player does.
    seek: Option<u64>,
}

impl PlayClock {
    /// A clock that stands at `time` until it is started, and will then run at `speed`.
    pub(super) fn at(time: u64, speed: f64) -> Self {
        Self { time, since: None, speed, is_playing: true, seek: None }
    }

    /// Lets the clock run from `now` on.
    pub(super) fn start(&mut self, now: Instant) {
        self.since = Some(now);
    }

    /// The time in the flight.
    pub(super) fn time(&self, now: Instant) -> u64 {
        let Some(since) = self.since.filter(|_| self.is_playing) else { return self.time };
        let flown = now.saturating_duration_since(since).as_nanos() as f64 * self.speed;
        self.time.saturating_add(flown as u64)
    }

    /// Whether it runs.
    pub(super) fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// How many times as fast as the flight it runs.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// Does what a viewer asks for.
    pub(super) fn heed(&mut self, request: &PlaybackControlRequest, now: Instant) {
        // Do this before speed and pause change: until now, time has passed at the old speed.
        self.time = request.seek_time.unwrap_or_else(|| self.time(now));
        self.since = self.since.map(|_| now);
        // A request without a seek must not cancel one that the player has not seen yet.
        self.seek = request.seek_time.or(self.seek);
        self.is_playing = matches!(request.playback_command, PlaybackCommand::Play);
        let speed = f64::from(request.playback_speed);
        // `clamp` lets NaN through, and a clock with that speed would stand still.
        if speed.is_finite() {
            self.speed = speed.clamp(SPEEDS.0, SPEEDS.1);
        }
    }

    /// Hands over the time to jump to.
    pub(super) fn take_seek(&mut self) -> Option<u64> {
        self.seek.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn request(
        playback_command: PlaybackCommand,
        speed: f32,
        seek_time: Option<u64>,
    ) -> PlaybackControlRequest {
        PlaybackControlRequest { playback_command, playback_speed: speed, seek_time, request_id: "1".into() }
    }

    #[test]
    fn a_clock_runs_at_its_speed_stands_still_and_jumps() {
        let begin = Instant::now();
        let after = |seconds| begin + Duration::from_secs(seconds);
        let mut clock = PlayClock::at(100, 2.0);
        assert_eq!(clock.time(after(5)), 100, "it is not started");
        clock.start(begin);
        assert_eq!(clock.time(after(5)), 10_000_000_100);
        clock.heed(&request(PlaybackCommand::Pause, 2.0, None), after(5));
        assert_eq!((clock.time(after(60)), clock.is_playing()), (10_000_000_100, false));
        clock.heed(&request(PlaybackCommand::Play, 0.5, None), after(60));
        assert_eq!((clock.time(after(64)), clock.take_seek()), (12_000_000_100, None));
        clock.heed(&request(PlaybackCommand::Play, 1.0, Some(500)), after(64));
        assert_eq!((clock.time(after(65)), clock.take_seek()), (1_000_000_500, Some(500)));
        assert_eq!(clock.take_seek(), None);
    }

    #[test]
    fn a_speed_that_makes_no_sense_is_not_taken() {
        let mut clock = PlayClock::at(0, 1.0);
        for (asked, taken) in [(f32::NAN, 1.0), (-3.0, 0.01), (1e9, 1000.0)] {
            clock.heed(&request(PlaybackCommand::Play, asked, None), Instant::now());
            assert_eq!(clock.speed(), taken);
        }
    }
}
