//! An agent's answer to a tick: what it asks of its airframe, and its account of why.

use super::{Aircraft, AircraftId, FailsafePath};
use crate::{Tick, UavId};
use bytemuck::{Pod, Zeroable};

/// What an agent asks of its airframe, once a tick: its answer to the tick.
///
/// A running agent answers every tick. While it does not know where its UAV is, it withholds the command, and the
/// airframe follows its own rule for a silent agent.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Command {
    /// The tick that it answers.
    pub tick: Tick,
    /// The commanded speed `v_i`.
    pub speed_m_s: f64,
    /// The commanded turn rate `omega_i`.
    pub turn_rate_rad_s: f64,
    /// The sender.
    pub uav: UavId,
    /// 1 when the agent withholds its command because its own senses have been silent for too long, 2 when it does because
    /// its controller's wish was not a finite number, else 0.
    pub withheld: u16,
    /// How the airframe leaves the formation if the agent falls silent after this command.
    pub failsafe_path: FailsafePath,
}

/// `withheld` of a command whose wish was not a finite number.
const NOT_FINITE: u16 = 2;

impl Command {
    /// The answer to `tick` that asks for this speed and turn rate, and that lets a silent airframe circle at once.
    pub fn new(tick: Tick, uav: UavId, speed_m_s: f64, turn_rate_rad_s: f64) -> Self {
        Self { tick, speed_m_s, turn_rate_rad_s, uav, withheld: 0, failsafe_path: FailsafePath::CIRCLE_LEFT }
    }

    /// The answer to `tick` of an agent that does not know where its UAV is.
    pub fn withheld(tick: Tick, uav: UavId) -> Self {
        Self { tick, uav, withheld: 1, ..Self::zeroed() }
    }

    /// The answer to `tick` of an agent whose controller wishes for a speed or turn rate that is not a finite number.
    pub fn not_finite(tick: Tick, uav: UavId) -> Self {
        Self { tick, uav, withheld: NOT_FINITE, ..Self::zeroed() }
    }

    /// Whether it is withheld because the controller's wish was not a finite number.
    pub fn is_not_finite(&self) -> bool {
        self.withheld == NOT_FINITE
    }
}

/// The age of received data in ticks, or that no data ever came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct AgeTicks(u32);

impl AgeTicks {
    /// No data ever came.
    pub const NEVER: Self = Self(u32::MAX);

    /// The age at `now` of data sent at `sent`; 0 if that is later.
    pub fn between(sent: Tick, now: Tick) -> Self {
        // `u32::MAX` means "never", so no age may reach it.
        Self(u32::try_from(now.since(sent).max(0)).unwrap_or(u32::MAX - 1).min(u32::MAX - 1))
    }

    /// The age; `None` if no data ever came.
    pub fn ticks(self) -> Option<u32> {
        (self != Self::NEVER).then_some(self.0)
    }
}

/// What the collision filter avoids.
///
/// A number instead of an `enum`, so that any bytes in shared memory are a valid value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Avoided(u32);

impl Avoided {
    /// Nothing: the law's wish is flown untouched.
    pub const NOTHING: Self = Self(0);
    /// An obstacle.
    pub const OBSTACLE: Self = Self(u32::MAX);

    /// This aircraft.
    pub fn aircraft(who: AircraftId) -> Self {
        // Aircraft have small numbers, one high bit aside, so neither 0 nor the largest number is one.
        Self(who.number())
    }

    /// The aircraft, unless it is an obstacle or nothing.
    pub fn who(self) -> Option<Aircraft> {
        let is_aircraft = self != Self::NOTHING && self != Self::OBSTACLE;
        is_aircraft.then(|| AircraftId::of_number(self.0).who())
    }
}

/// How a command came about, once a tick, for the log: every term of the law, the age of its inputs, and which UAVs
/// the agent considers alive.
///
/// Separate from [`Command`], so that the world reads no more than it needs.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Account {
    /// The tick that the command answers.
    pub tick: Tick,
    /// The commanded speed `v_i`.
    pub speed_m_s: f64,
    /// The commanded turn rate `omega_i`.
    pub turn_rate_rad_s: f64,
    /// The slot `p_id` that the UAV steers for, in the local frame.
    pub slot_m: [f64; 2],
    /// The previous neighbour's term of `f_i`, Eq. (4), in m.
    pub previous_force_m: [f64; 2],
    /// The next neighbour's term of `f_i`, Eq. (4), in m.
    pub next_force_m: [f64; 2],
    /// The formation centre's term of `f_i`, Eq. (4), in m.
    pub centre_force_m: [f64; 2],
    /// The slot's term of `f_i`, Eq. (4), in m.
    pub slot_force_m: [f64; 2],
    /// `f_obs`, Eq. (13), summed over the obstacles, in m.
    pub repulsion_m: [f64; 2],
    /// The UAV's estimate of the wind, in m/s; zero if it assumes still air.
    pub wind_m_s: [f64; 2],
    /// Where the UAV believes that it is, in the local frame.
    pub estimate_m: [f64; 2],
    /// Where it takes its nose to point.
    pub estimate_heading_rad: f64,
    /// `F_i`, Eq. (3), in m^2.
    pub potential_m2: f64,
    /// The speed that the law asks for, within the airframe's limits. It differs from `speed_m_s` only while the
    /// collision filter acts.
    pub wish_speed_m_s: f64,
    /// The turn rate that the law asks for, within the airframe's limits.
    pub wish_turn_rate_rad_s: f64,
    /// Where the filter takes what it avoids to be, in the local frame; zero if it avoids nothing.
    pub avoided_m: [f64; 2],
    /// How far the heading that the filter takes lies from that of the law's course; positive to the left.
    pub avoided_turn_rad: f64,
    /// Fingerprint of the set of UAVs that the agent considers lost: 0 for the empty set, equal for equal sets.
    pub lost_fingerprint: u64,
    /// The sender.
    pub uav: UavId,
    /// Age of the previous neighbour's data when they were used.
    pub previous_age: AgeTicks,
    /// Age of the next neighbour's data.
    pub next_age: AgeTicks,
    /// Age of the leader's data.
    pub leader_age: AgeTicks,
    /// How many UAVs the agent considers alive, its own included.
    pub living: u32,
    /// What the collision filter avoids.
    pub avoided: Avoided,
    /// 1 if Eq. (12) limited the speed, else 0.
    pub speed_saturated: u16,
    /// 1 if Eq. (12) limited the turn rate, else 0.
    pub turn_rate_saturated: u16,
    /// 1 while the leader has been silent for longer than the loss timeout and the agent follows its predicted path,
    /// else 0.
    pub leader_silent: u16,
    /// 1 while the slots move to their new places after a loss or a return, else 0.
    pub slots_moving: u16,
}

impl Account {
    /// The account of a `command` that was given before the first data from the leader came: no term of the law
    /// applies.
    pub fn without_leader(command: &Command) -> Self {
        Self {
            tick: command.tick,
            speed_m_s: command.speed_m_s,
            turn_rate_rad_s: command.turn_rate_rad_s,
            // Equal to the command: a difference would say that the collision filter acts.
            wish_speed_m_s: command.speed_m_s,
            wish_turn_rate_rad_s: command.turn_rate_rad_s,
            uav: command.uav,
            previous_age: AgeTicks::NEVER,
            next_age: AgeTicks::NEVER,
            leader_age: AgeTicks::NEVER,
            ..Self::zeroed()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_age_is_not_mistaken_for_never() {
        assert_eq!(AgeTicks::NEVER.ticks(), None);
        assert_eq!(AgeTicks::between(Tick(3), Tick(7)).ticks(), Some(4));
        assert_eq!(AgeTicks::between(Tick(9), Tick(7)).ticks(), Some(0));
        assert_eq!(AgeTicks::between(Tick(0), Tick(i64::MAX)).ticks(), Some(u32::MAX - 1));
    }
}
