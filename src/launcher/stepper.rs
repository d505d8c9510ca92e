//! Pauses a flight in lockstep, lets it go on by ticks, and resumes it, as the user asks.
//!
//! The world holds the tick at which the flight stands, as it does for a fault, so a pause does not change a bit of the
//! flight. The flight stands before a tick: faults of that tick are applied, and no agent has its senses yet.
//!
//! Must never touch a process, a socket, a clock or a service: the supervisor tells it which tick the world holds.

use ringwing_bus::REFUSED;
use ringwing_flight::Tick;
use std::{fmt, mem, num::NonZeroU32, str::FromStr};

/// Earlier than every tick: with this limit the flight stands before its next tick, whichever that is.
const BEFORE_ALL_TICKS: Tick = Tick(i64::MIN);
/// With this limit the flight goes on.
const BEYOND_ALL_TICKS: Tick = Tick(i64::MAX);

/// What the user asks of a flight, as `ringwing pause`, `step` and `resume` send it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PauseRequest {
    /// Stand still before the next tick.
    Pause,
    /// Fly this many ticks, and then stand still again.
    Step(NonZeroU32),
    /// Fly on.
    Resume,
}

impl fmt::Display for PauseRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pause => f.write_str("pause"),
            Self::Step(ticks) => write!(f, "step {ticks}"),
            Self::Resume => f.write_str("resume"),
        }
    }
}

impl FromStr for PauseRequest {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text.split_once(' ') {
            None if text == "pause" => Ok(Self::Pause),
            None if text == "resume" => Ok(Self::Resume),
            // `NonZeroU32` refuses a step of 0, after which the flight would stand where it stood.
            Some(("step", ticks)) => ticks.parse().map(Self::Step).map_err(drop),
            _ => Err(()),
        }
    }
}

/// Where a flight stands. `R` carries the answer to a request back to whoever sent it.
#[derive(Debug)]
pub(super) struct Stepper<R> {
    rate_hz: u32,
    /// The world may open only ticks before this one.
    free_before: Tick,
    /// The tick before which the flight stands.
    standing: Option<Tick>,
    /// Who waits for the flight to stand.
    waiting: Vec<R>,
}

impl<R> Stepper<R> {
    /// A flight of `rate_hz` ticks a second that goes on.
    pub(super) fn new(rate_hz: u32) -> Self {
        Self { rate_hz, free_before: BEYOND_ALL_TICKS, standing: None, waiting: Vec::new() }
    }

    /// The world may open only ticks before this one.
    pub(super) fn free_before(&self) -> Tick {
        self.free_before
    }

    /// Whether the user pauses or steps the flight.
    pub(super) fn is_paused(&self) -> bool {
        self.free_before != BEYOND_ALL_TICKS
    }

    /// Whether the world holds a tick for the user and was not let go since.
    pub(super) fn is_standing(&self) -> bool {
        self.standing.is_some()
    }

    /// Whether somebody waits for the flight to stand.
    pub(super) fn is_busy(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Takes in a request at tick `now`; returns who can be answered at once, and how.
    pub(super) fn submit(&mut self, request: PauseRequest, reply: R, now: Tick) -> Vec<(R, String)> {
        match request {
            _ if !self.is_paused() && request != PauseRequest::Pause => {
                vec![(reply, refused("the flight is not paused: `ringwing pause` pauses it"))]
            }
            PauseRequest::Pause => {
                let Some(tick) = self.standing else {
                    // A step that is under way ends here as well.
                    self.free_before = BEFORE_ALL_TICKS;
                    self.waiting.push(reply);
                    return Vec::new();
                };
                vec![(reply, self.at(tick, "paused already"))]
            }
            PauseRequest::Step(ticks) => {
                // Two steps at a time would leave open which of the two ticks each answer is about.
                let Some(tick) = self.standing.take() else {
                    return vec![(reply, refused("another step is under way"))];
                };
                self.free_before = Tick(tick.0 + i64::from(ticks.get()));
                self.waiting.push(reply);
                Vec::new()
            }
            PauseRequest::Resume => {
                // The flight may not stand yet: a pause was asked for, and the world is still on its way to the next
                // tick.
                let tick = self.standing.take().unwrap_or(now);
                self.free_before = BEYOND_ALL_TICKS;
                let answer = self.at(tick, "flies on");
                let mut answers = self.answer_all(&refused("the flight was resumed before"));
                answers.push((reply, answer));
                answers
            }
        }
    }

    /// Takes in that the world holds `tick`, and that everything due before it is done; returns who is answered now.
    pub(super) fn on_held(&mut self, tick: Tick) -> Vec<(R, String)> {
        // The world also holds ticks on the way, for faults.
        if self.standing.is_some() || tick < self.free_before {
            return Vec::new();
        }
        // A pause had no tick of its own until now. From here on, a step counts from the tick that the world holds.
        (self.standing, self.free_before) = (Some(tick), tick);
        self.answer_all(&self.at(tick, "paused"))
    }

    /// Takes in that the flight is over, its last tick being `tick`; returns who is answered now.
    pub(super) fn on_end(&mut self, tick: Tick) -> Vec<(R, String)> {
        self.answer_all(&self.at(tick, "the flight is over"))
    }

    fn answer_all(&mut self, answer: &str) -> Vec<(R, String)> {
        mem::take(&mut self.waiting).into_iter().map(|reply| (reply, answer.to_owned())).collect()
    }

    fn at(&self, tick: Tick, what: &str) -> String {
        format!("tick {}, {:.2} s: {what}", tick.0, tick.seconds(self.rate_hz))
    }
}

/// The answer to a request that is refused.
fn refused(why: &str) -> String {
    format!("{REFUSED}{why}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use PauseRequest::{Pause, Resume};

    fn step(ticks: u32) -> PauseRequest {
        PauseRequest::Step(NonZeroU32::new(ticks).unwrap())
    }

    fn texts(answers: Vec<(&str, String)>) -> Vec<String> {
        answers.into_iter().map(|(who, answer)| format!("{who} gets {answer}")).collect()
    }

    /// A flight that stands before tick 100.
    fn standing() -> Stepper<&'static str> {
        let mut stepper = Stepper::new(100);
        assert!(stepper.submit(Pause, "a", Tick(99)).is_empty() && stepper.is_busy());
        assert!(stepper.is_paused() && !stepper.is_standing());
        assert!(stepper.free_before() < Tick::APPROACH, "whichever tick is next");
        assert_eq!(texts(stepper.on_held(Tick(100))), ["a gets tick 100, 1.00 s: paused"]);
        stepper
    }

    #[test]
    fn a_request_is_read_as_it_was_written() {
        for request in [Pause, Resume, step(1), step(250)] {
            assert_eq!(request.to_string().parse(), Ok(request));
        }
        for text in ["", "step", "step 0", "step -1", "step x", "pause 5", "resume now", "kill uav 3"] {
            assert_eq!(text.parse::<PauseRequest>(), Err(()), "{text}");
        }
    }

    #[test]
    fn a_paused_flight_stands_until_it_is_stepped_or_resumed() {
        let mut stepper = standing();
        assert_eq!((stepper.free_before(), stepper.is_standing()), (Tick(100), true));
        assert!(stepper.submit(step(3), "b", Tick(100)).is_empty());
        assert_eq!((stepper.free_before(), stepper.is_standing()), (Tick(103), false));
        assert!(stepper.on_held(Tick(102)).is_empty(), "the world holds this tick for a fault");
        assert_eq!(texts(stepper.on_held(Tick(103))), ["b gets tick 103, 1.03 s: paused"]);
        assert_eq!(texts(stepper.submit(Resume, "c", Tick(103))), ["c gets tick 103, 1.03 s: flies on"]);
        assert_eq!((stepper.free_before(), stepper.is_paused()), (BEYOND_ALL_TICKS, false));
        assert!(stepper.on_held(Tick(150)).is_empty(), "the world holds this tick for a fault");
    }

    #[test]
    fn whoever_asks_too_early_or_twice_is_told_so() {
        let mut stepper = Stepper::new(100);
        let refused = "a gets refused: the flight is not paused: `ringwing pause` pauses it";
        assert_eq!(texts(stepper.submit(Resume, "a", Tick(5))), [refused]);
        assert_eq!(texts(stepper.submit(step(1), "a", Tick(5))), [refused]);
        let mut stepper = standing();
        assert_eq!(texts(stepper.submit(Pause, "b", Tick(100))), ["b gets tick 100, 1.00 s: paused already"]);
        stepper.submit(step(1000), "b", Tick(100));
        assert_eq!(
            texts(stepper.submit(step(1), "c", Tick(100))),
            ["c gets refused: another step is under way"]
        );
    }

    #[test]
    fn a_pause_or_the_end_of_the_flight_ends_a_step() {
        let mut stepper = standing();
        stepper.submit(step(1000), "b", Tick(100));
        stepper.submit(Pause, "c", Tick(300));
        let answers = texts(stepper.on_held(Tick(301)));
        assert_eq!(answers, ["b gets tick 301, 3.01 s: paused", "c gets tick 301, 3.01 s: paused"]);
        stepper.submit(step(1000), "d", Tick(301));
        assert_eq!(texts(stepper.on_end(Tick(900))), ["d gets tick 900, 9.00 s: the flight is over"]);
    }

    #[test]
    fn whoever_waits_for_a_step_learns_that_the_flight_was_resumed() {
        let mut stepper = standing();
        stepper.submit(step(1000), "b", Tick(100));
        let answers = texts(stepper.submit(Resume, "c", Tick(300)));
        let resumed = "b gets refused: the flight was resumed before";
        assert_eq!(answers, [resumed, "c gets tick 300, 3.00 s: flies on"]);
    }
}
