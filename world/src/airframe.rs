//! The body of one fixed-wing UAV: flies the motion of Eq. (1) as commanded, within the limits of Eq. (2), and drifts with the
//! wind. Speed and heading are those through the air.
//!
//! Never trusts a command: the airframe stays within its limits whatever an agent sends, and its failsafe takes over
//! when the agent stays silent.

use crate::{
    response::{Rates, Response},
    wind::Wind,
};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{Command, FailsafePath, FlightMode, Pose, Tick, Truth, UavId};
use ringwing_scenario::{
    AirframeSection, Failsafe, Scenario, StartState,
    fault::schedule::{AirframeFailure, AirframeFault},
};

/// Why an airframe does not take a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The speed or turn rate is not a finite number.
    #[error("not a finite number")]
    NotFinite,
    /// The command says that another UAV sent it.
    #[error("another UAV's command")]
    NotItsOwn,
    /// The command is not newer than the last one, or is older than the command timeout.
    #[error("a stale command")]
    Stale,
    /// The command answers a tick that has not come yet.
    #[error("a command from the future")]
    FromTheFuture,
    /// The airframe has left the sky.
    #[error("a command to a UAV that has vanished")]
    Vanished,
}

/// Ticks without a new command after which an aircraft no longer seems to be flown. In lockstep 1 would do; in real time a
/// command may be late. With more, a UAV that flies on blindly still counts as steered.
const SILENT_TICKS: i64 = 3;

/// An airframe and its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Airframe {
    uav: UavId,
    pose: Pose,
    /// What it flies.
    flown: Rates,
    /// What it was told, within its limits.
    wanted: Rates,
    response: Response,
    failures: Failures,
    mode: FlightMode,
    /// The tick of the newest command taken, `None` before the first.
    newest_command: Option<Tick>,
    /// How it leaves the formation if it loiters, as the newest command says.
    failsafe_path: FailsafePath,
    /// When its failsafe took over the last time.
    failsafe_began: Tick,
    abilities: Abilities,
    /// `None` in still air.
    wind: Option<Wind>,
    /// The wind over the last tick.
    wind_m_s: Vector2<f64>,
}

/// What a broken airframe cannot do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Failures {
    /// The highest speed that is left.
    weak_m_s: Option<f64>,
    /// The turn rate at which it is stuck.
    jammed_rad_s: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct Abilities {
    limits: AirframeSection,
    timeout_ticks: i64,
    period_s: f64,
}

impl Airframe {
    /// `uav`'s airframe one tick before the flight begins, on its straight way to `start`.
    pub fn new(scenario: &Scenario, uav: UavId, start: &StartState) -> Self {
        let limits = &scenario.airframe;
        let abilities = Abilities {
            limits: limits.clone(),
            timeout_ticks: (limits.command_timeout_s * f64::from(scenario.time.rate_hz)).round() as i64,
            period_s: scenario.period_s(),
        };
        let start_pose = Pose {
            position: Point2::from(start.position_m),
            // A listed heading may be up to one turn, but payloads promise (-pi, pi].
            heading_rad: ringwing_flight::wrap(start.heading_deg.to_radians()),
        };
        let wind = Wind::new(scenario, uav);
        let wind_m_s =
            wind.as_ref().map_or_else(Vector2::zeros, |wind| wind.velocity_m_s(start_pose.heading_rad));
        // The first step flies and drifts, and has to end at the start.
        let approach_s = -abilities.period_s;
        let pose = start_pose.after(start.speed_m_s, 0.0, approach_s).carried(wind_m_s, approach_s);
        let flown = Rates { speed_m_s: start.speed_m_s, turn_rate_rad_s: 0.0 };
        Self {
            uav,
            pose,
            flown,
            wanted: flown,
            response: Response::new(limits),
            failures: Failures::default(),
            mode: FlightMode::COMMANDED,
            newest_command: None,
            failsafe_path: FailsafePath::CIRCLE_LEFT,
            failsafe_began: Tick::APPROACH,
            abilities,
            wind,
            wind_m_s,
        }
    }

    /// The UAV it belongs to.
    pub fn uav(&self) -> UavId {
        self.uav
    }

    /// Position and heading.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Speed through the air in m/s and turn rate in rad/s over the last tick; or those just commanded, if the airframe does at once
    /// what it is told.
    pub fn rates(&self) -> (f64, f64) {
        (self.flown.speed_m_s, self.flown.turn_rate_rad_s)
    }

    /// The velocity of the air at the airframe over the last tick; zero in still air.
    pub fn wind_m_s(&self) -> Vector2<f64> {
        self.wind_m_s
    }

    /// How it flies, and the air there.
    pub fn truth(&self) -> Truth {
        Truth {
            position_m: self.pose.position.into(),
            heading_rad: self.pose.heading_rad,
            speed_m_s: self.flown.speed_m_s,
            turn_rate_rad_s: self.flown.turn_rate_rad_s,
            wind_m_s: self.wind_m_s.into(),
        }
    }

    /// What flies it: commands, or its failsafe.
    pub fn mode(&self) -> FlightMode {
        self.mode
    }

    /// Whether it is in the sky.
    pub fn is_flying(&self) -> bool {
        self.mode != FlightMode::VANISHED
    }

    /// Whether it flies on commands.
    pub fn is_commanded(&self) -> bool {
        self.mode == FlightMode::COMMANDED
    }

    /// Whether its agent has commanded it lately, seen at `now`.
    pub fn is_answering(&self, now: Tick) -> bool {
        // Before the first tick nobody can have answered.
        let newest = self.newest_command.unwrap_or(Tick::APPROACH);
        self.is_commanded() && now.since(newest) <= SILENT_TICKS
    }

    /// The tick of the newest command taken, `None` before the first.
    pub fn newest_command(&self) -> Option<Tick> {
        self.newest_command
    }

    /// Takes a command at `now`, clamped to the airframe's limits.
    ///
    /// A withheld command asks for nothing: the airframe goes on as if its agent were silent.
    pub fn accept(&mut self, command: &Command, now: Tick) -> Result<(), Refusal> {
        if command.uav != self.uav {
            return Err(Refusal::NotItsOwn);
        }
        // Check this before the rest: a withheld command has no numbers to check, and it is no error even after the UAV
        // has vanished.
        if command.withheld != 0 {
            return Ok(());
        }
        self.check(command, now)?;
        // The check has refused NaN, which a clamp would let through.
        let AirframeSection { speed_min_m_s, speed_max_m_s, turn_rate_max_rad_s, .. } = self.abilities.limits;
        self.go_for(Rates {
            speed_m_s: command.speed_m_s.clamp(speed_min_m_s, speed_max_m_s),
            turn_rate_rad_s: command.turn_rate_rad_s.clamp(-turn_rate_max_rad_s, turn_rate_max_rad_s),
        });
        (self.newest_command, self.failsafe_path) = (Some(command.tick), command.failsafe_path);
        // Any command that is taken ends a failsafe, so that a thawed or restarted agent can fly its UAV again.
        self.mode = FlightMode::COMMANDED;
        Ok(())
    }

    fn check(&self, command: &Command, now: Tick) -> Result<(), Refusal> {
        // A command as old as the timeout counts as silence: with it, the failsafe would take over in this very tick.
        let is_expired = now.since(command.tick) >= self.abilities.timeout_ticks;
        let is_newer = self.newest_command.is_none_or(|newest| command.tick > newest);
        if !self.is_flying() {
            Err(Refusal::Vanished)
        } else if !(command.speed_m_s.is_finite() && command.turn_rate_rad_s.is_finite()) {
            Err(Refusal::NotFinite)
        } else if command.tick > now {
            Err(Refusal::FromTheFuture)
        } else if !is_newer || is_expired {
            Err(Refusal::Stale)
        } else {
            Ok(())
        }
    }

    /// Breaks the airframe as those of `faults` say that are on at `now` and are its own, and mends it otherwise. Of several failures of
    /// one kind, the last one counts.
    pub fn break_as(&mut self, faults: &[AirframeFault], now: Tick) {
        self.failures = Failures::default();
        for fault in faults.iter().filter(|fault| fault.uav == self.uav && fault.is_on(now)) {
            match fault.failure.within(&self.abilities.limits) {
                AirframeFailure::Weak(most_m_s) => self.failures.weak_m_s = Some(most_m_s),
                AirframeFailure::Jammed(rate_rad_s) => self.failures.jammed_rad_s = Some(rate_rad_s),
                // That is one of the sensors.
                AirframeFailure::Drifting(_) => {}
            }
        }
    }

    /// Flies from `now` to the next tick. Returns whether the failsafe takes over.
    pub fn step(&mut self, now: Tick) -> bool {
        // An agent that has sent nothing yet counts as silent since the flight's first tick.
        let silent_ticks = now.since(self.newest_command.unwrap_or(Tick::APPROACH));
        let takes_over = silent_ticks >= self.abilities.timeout_ticks && self.is_commanded();
        if takes_over {
            self.enter_failsafe(now);
        }
        if self.mode == FlightMode::LOITER {
            self.go_for(self.loitering(now));
        }
        self.flown = self.response.after(self.flown, self.attainable(), self.abilities.period_s);
        let heading_rad = self.pose.heading_rad;
        self.pose =
            self.pose.after(self.flown.speed_m_s, self.flown.turn_rate_rad_s, self.abilities.period_s);
        self.drift(now, heading_rad);
        takes_over
    }

    /// Lets the air carry the airframe through a tick at whose beginning it headed for `heading_rad`.
    fn drift(&mut self, now: Tick, heading_rad: f64) {
        let Some(wind) = &mut self.wind else { return };
        self.wind_m_s = wind.velocity_m_s(heading_rad);
        self.pose = self.pose.carried(self.wind_m_s, self.abilities.period_s);
        wind.advance(now, self.flown.speed_m_s);
    }

    fn enter_failsafe(&mut self, now: Tick) {
        self.failsafe_began = now;
        let straight = Rates { turn_rate_rad_s: 0.0, ..self.wanted };
        let (mode, wanted) = match self.abilities.limits.failsafe {
            Failsafe::Loiter => (FlightMode::LOITER, self.loitering(now)),
            Failsafe::Hold => (FlightMode::HOLD, straight),
            Failsafe::Vanish => (FlightMode::VANISHED, straight),
        };
        self.mode = mode;
        self.go_for(wanted);
    }

    /// What a broken airframe makes of what it was told.
    fn attainable(&self) -> Rates {
        let Failures { weak_m_s, jammed_rad_s } = self.failures;
        let Rates { speed_m_s, turn_rate_rad_s } = self.wanted;
        Rates {
            speed_m_s: weak_m_s.map_or(speed_m_s, |most_m_s| speed_m_s.min(most_m_s)),
            turn_rate_rad_s: jammed_rad_s.unwrap_or(turn_rate_rad_s),
        }
    }

    fn go_for(&mut self, wanted: Rates) {
        self.wanted = wanted;
        // Others sense the rates before the next step.
        if self.response.is_instant() {
            self.flown = self.attainable();
        }
    }

    /// How one that loiters flies from `now` on.
    fn loitering(&self, now: Tick) -> Rates {
        let time_s = now.since(self.failsafe_began) as f64 * self.abilities.period_s;
        let rates = self.abilities.limits.loiter_rates();
        let (speed_m_s, turn_rate_rad_s) = self.failsafe_path.rates(&rates, time_s);
        Rates { speed_m_s, turn_rate_rad_s }
    }
}

#[cfg(test)]
mod tests;
