//! The seam between an agent and whatever decides how its UAV flies: a [`Situation`] goes in, a [`Wish`] comes out.
//!
//! The built-in law and a user's [`Controller`] are behind the same seam. Everything else is the agent's: links and their
//! faults, membership, slots, the collision filter, the airframe's limits and the log.
//!
//! Never gives a controller more than its agent knows.

pub mod message;

use crate::{
    law::{ControlInput, saturated_control},
    pilot::{Forecast, Situation, Steer, Steered},
};
use ringwing_flight::{Account, Notes, Tick, UavId};

/// What decides how one UAV flies: the user's own law.
///
/// In lockstep a flight repeats to the bit if the controller is deterministic: if the same situations in the same order
/// give the same wishes. A controller that reads a clock or draws random numbers without a fixed seed is not.
pub trait Controller {
    /// Decides for one tick.
    ///
    /// The agent calls this once a tick, in order of ticks. It leaves out ticks in which it does not know where the UAV
    /// is, and those that it missed because its process was frozen. A new process begins with a new controller.
    fn step(&mut self, situation: &Situation<'_>) -> Wish;
}

/// Makes the controller of a UAV whenever an agent of it starts; `None` leaves the UAV to the built-in law.
pub type MakeController = Box<dyn FnMut(UavId) -> Option<Box<dyn Controller>>>;

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        (**self).step(situation)
    }
}

/// What a controller wants its UAV to fly until the next tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Speed along the heading, m/s.
    pub speed_m_s: f64,
    /// Rate of the heading, rad/s, counterclockwise.
    pub turn_rate_rad_s: f64,
    /// What to put into the log. Nothing else depends on it, so notes never change a flight.
    pub notes: Notes,
}

impl Wish {
    /// A wish for this speed, in m/s, and this turn rate, in rad/s.
    pub fn new(speed_m_s: f64, turn_rate_rad_s: f64) -> Self {
        Self { speed_m_s, turn_rate_rad_s, notes: Notes::default() }
    }

    /// The same wish with a note: `value` gets into the log under `name`, if the flight is recorded. A second value under the
    /// same name replaces the first one.
    ///
    /// A note that cannot be recorded is left out, and the run warns of it: see [`Notes::set`].
    #[must_use]
    pub fn with_note(mut self, name: &str, value: f64) -> Self {
        // The notes remember what they refuse, and the recorder tells the user.
        let _ = self.notes.set(name, value);
        self
    }
}

/// A user's controller behind the seam.
#[derive(Debug, Clone)]
pub struct Guest<C> {
    pub(crate) controller: C,
    /// What it noted last. Boxed, so that the agents of a simulation, most of which have the built-in law, stay small.
    notes: Box<Notes>,
}

impl<C> Guest<C> {
    /// `controller`, before its first tick.
    pub fn new(controller: C) -> Self {
        Self { controller, notes: Box::default() }
    }
}

impl<C: Controller> Steer for Guest<C> {
    type Rehearsal = Straight;

    fn rehearsal(&self) -> Straight {
        Straight
    }

    fn steer(&mut self, situation: &Situation<'_>) -> Option<Steered> {
        let Wish { speed_m_s, turn_rate_rad_s, notes } = self.controller.step(situation);
        *self.notes = notes.made_in(situation.tick, situation.uav);
        let wish = ControlInput { speed_m_s, turn_rate_rad_s };
        // A saturation lets NaN through.
        if !(speed_m_s.is_finite() && turn_rate_rad_s.is_finite()) {
            return None;
        }
        let control = saturated_control(&wish, &situation.limits);
        let account = Account {
            // Comparing floats exactly is right here: a value within the limits comes back unchanged.
            speed_saturated: u16::from(control.speed_m_s != wish.speed_m_s),
            turn_rate_saturated: u16::from(control.turn_rate_rad_s != wish.turn_rate_rad_s),
            ..situation.account(control)
        };
        Some(Steered { control, account, forecast: Some(Forecast::arc(situation, control)) })
    }

    fn notes(&self, now: Tick) -> Option<&Notes> {
        // In a tick without senses the controller decides nothing, and its notes are those of an earlier tick.
        (self.notes.tick == now && !self.notes.is_empty()).then_some(&self.notes)
    }
}

/// Stands in for a user's controller in a rehearsal, because a rehearsed tick would change the controller's state.
#[derive(Debug, Clone, Copy)]
pub struct Straight;

impl Steer for Straight {
    type Rehearsal = Self;

    fn rehearsal(&self) -> Self {
        Self
    }

    fn steer(&mut self, situation: &Situation<'_>) -> Option<Steered> {
        let control = ControlInput { speed_m_s: situation.sensed.speed_m_s, turn_rate_rad_s: 0.0 };
        Some(Steered { control, account: situation.account(control), forecast: None })
    }
}
