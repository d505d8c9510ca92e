//! The messages, each with one fixed layout and one versioned type name.
//!
//! Plain numbers without padding, so that their bytes can be hashed: the same scenario and seed give the same bytes.

use crate::{Tick, UavId};
use bytemuck::{NoUninit, Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use std::fmt;

/// Where the virtual leader is, once a tick: the centre of the formation.
#[derive(Debug, Clone, Copy, PartialEq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.LeaderState.v1")]
#[repr(C)]
pub struct LeaderState {
    /// The tick this state belongs to; grows by one, so a gap is a lost sample.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading.
    pub turn_rate_rad_s: f64,
}

/// What a UAV has heard of the standing of a member of the swarm.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[type_name("ringwing.Rumour.v1")]
#[repr(C)]
pub struct Rumour {
    /// The number of the member; 0 where there is nothing to tell.
    pub uav: u32,
    /// Three times its incarnation, and 0 for living, 1 for suspected, 2 for lost: of two the higher is the newer.
    pub standing: u32,
}

/// How many rumours a [`UavState`] carries at most.
pub const RUMOURS: usize = 8;

/// What a UAV tells its ring neighbours, once a tick.
#[derive(Debug, Clone, Copy, PartialEq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.UavState.v2")]
#[repr(C)]
pub struct UavState {
    /// The tick this state belongs to; grows by one, so a gap is a lost sample.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed along the heading.
    pub speed_m_s: f64,
    /// Rate of the heading.
    pub turn_rate_rad_s: f64,
    /// The sender.
    pub uav: UavId,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
    /// Losses and returns that it passes on; none in an undisturbed flight.
    pub rumours: [Rumour; RUMOURS],
}

/// Who flies the airframe.
///
/// A number and not an `enum`: whatever bytes another process wrote, reading them is defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.FlightMode.v1")]
#[repr(C)]
pub struct FlightMode(u32);

impl FlightMode {
    /// The agent's commands.
    pub const COMMANDED: Self = Self(0);
    /// The failsafe: circles where it lost its agent.
    pub const LOITER: Self = Self(1);
    /// The failsafe: keeps heading and speed.
    pub const HOLD: Self = Self(2);
    /// The failsafe: has left the sky.
    pub const VANISHED: Self = Self(3);

    /// The name that logs and tables use.
    pub fn name(self) -> &'static str {
        match self {
            Self::COMMANDED => "commanded",
            Self::LOITER => "loiter",
            Self::HOLD => "hold",
            Self::VANISHED => "vanished",
            _ => "unknown",
        }
    }
}

/// How many obstacles one [`Sensed`] can hold; the nearest are chosen.
pub const MAX_SENSED_OBSTACLES: usize = 8;

/// An obstacle as a UAV's sensors report it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[type_name("ringwing.SensedObstacle.v1")]
#[repr(C)]
pub struct SensedObstacle {
    /// Centre in the local frame, metres.
    pub position_m: [f64; 2],
    /// `R_obs`.
    pub radius_m: f64,
    /// `L_obs`: from here on it repels.
    pub braking_distance_m: f64,
}

/// What the world lets one UAV sense of itself and of the obstacles near it, once a tick.
#[derive(Debug, Clone, Copy, PartialEq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.Sensed.v1")]
#[repr(C)]
pub struct Sensed {
    /// The tick of this moment.
    pub tick: Tick,
    /// Position in the local frame (x east, y north), metres.
    pub position_m: [f64; 2],
    /// Heading from the x axis, counterclockwise, in (-pi, pi].
    pub heading_rad: f64,
    /// Speed flown over the last tick.
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    pub turn_rate_rad_s: f64,
    /// Whose senses these are.
    pub uav: UavId,
    /// Who flies the airframe.
    pub mode: FlightMode,
    /// How many entries of `obstacles` hold something.
    pub obstacle_count: u32,
    /// Obstacles in range beyond those that fit.
    pub obstacles_omitted: u32,
    /// Obstacles in range, nearest first.
    pub obstacles: [SensedObstacle; MAX_SENSED_OBSTACLES],
}

impl Sensed {
    /// The obstacles in range, nearest first.
    pub fn obstacles(&self) -> &[SensedObstacle] {
        &self.obstacles[..(self.obstacle_count as usize).min(MAX_SENSED_OBSTACLES)]
    }
}

/// Age of data in ticks, or that there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.AgeTicks.v1")]
#[repr(C)]
pub struct AgeTicks(u32);

impl AgeTicks {
    /// Nothing was ever heard.
    pub const NEVER: Self = Self(u32::MAX);

    /// The age at `now` of something sent at `sent`.
    pub fn between(sent: Tick, now: Tick) -> Self {
        Self(u32::try_from(now.since(sent).max(0)).unwrap_or(u32::MAX - 1).min(u32::MAX - 1))
    }

    /// The age, if anything was heard.
    pub fn ticks(self) -> Option<u32> {
        (self != Self::NEVER).then_some(self.0)
    }
}

/// How a command came about: every term of the law, for the record.
#[derive(Debug, Clone, Copy, PartialEq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.Terms.v2")]
#[repr(C)]
pub struct Terms {
    /// The slot `p_id` the UAV steers for, in the local frame.
    pub slot_m: [f64; 2],
    /// The neighbours' terms of `f_i`, Eq. (4): the neighbour before, in m.
    pub previous_force_m: [f64; 2],
    /// The same of the neighbour after.
    pub next_force_m: [f64; 2],
    /// The formation centre's term of `f_i`, Eq. (4).
    pub centre_force_m: [f64; 2],
    /// The slot's term of `f_i`, Eq. (4).
    pub slot_force_m: [f64; 2],
    /// `f_obs`, Eq. (13), summed over the obstacles.
    pub repulsion_m: [f64; 2],
    /// `F_i`, Eq. (3), in m^2.
    pub potential_m2: f64,
    /// Age of the previous neighbour's data when they were used.
    pub previous_age: AgeTicks,
    /// Age of the next neighbour's data.
    pub next_age: AgeTicks,
    /// Age of the leader's data.
    pub leader_age: AgeTicks,
    /// 1 where Eq. (12) cut the speed, else 0.
    pub speed_saturated: u16,
    /// 1 where Eq. (12) cut the turn rate, else 0.
    pub turn_rate_saturated: u16,
    /// How many UAVs it holds for living, itself among them.
    pub living: u32,
    /// 1 while it goes on along the path of a leader that it has not heard for longer than the loss timeout, else 0.
    pub leader_silent: u16,
    /// 1 while the slots move to the places that a loss or a return gave them, else 0.
    pub slots_moving: u16,
    /// Fingerprint of those whom it holds for lost: 0 for none, and equal where two UAVs agree.
    pub lost_fingerprint: u64,
}

impl Terms {
    /// The terms of a UAV that knows no leader yet: none.
    pub const NONE: Self = Self {
        slot_m: [0.0; 2],
        previous_force_m: [0.0; 2],
        next_force_m: [0.0; 2],
        centre_force_m: [0.0; 2],
        slot_force_m: [0.0; 2],
        repulsion_m: [0.0; 2],
        potential_m2: 0.0,
        previous_age: AgeTicks::NEVER,
        next_age: AgeTicks::NEVER,
        leader_age: AgeTicks::NEVER,
        speed_saturated: 0,
        turn_rate_saturated: 0,
        living: 0,
        leader_silent: 0,
        slots_moving: 0,
        lost_fingerprint: 0,
    };
}

/// What an agent asks of its airframe, once a tick.
#[derive(Debug, Clone, Copy, PartialEq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.Command.v2")]
#[repr(C)]
pub struct Command {
    /// The tick whose senses it answers.
    pub tick: Tick,
    /// The commanded speed `v_i`.
    pub speed_m_s: f64,
    /// The commanded turn rate `omega_i`.
    pub turn_rate_rad_s: f64,
    /// The sender.
    pub uav: UavId,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
    /// How it came about.
    pub terms: Terms,
}

/// How long one tick took and where, once a tick, from the world. Wall clock: never part of a payload hash.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.TickTiming.v1")]
#[repr(C)]
pub struct TickTiming {
    /// The tick.
    pub tick: i64,
    /// From the opening of the tick to the moment the last answer was handed over.
    pub round_trip_ns: u64,
    /// From the opening to the moment the last agent saw it.
    pub wake_ns: u64,
    /// The longest an agent took to read its inputs.
    pub read_ns: u64,
    /// The longest an agent took to compute and publish.
    pub compute_ns: u64,
    /// The longest from an agent's answer to the world's reading it.
    pub return_ns: u64,
    /// How late the tick was opened against its deadline; 0 in lockstep.
    pub late_ns: u64,
    /// Airframes whose command of this tick arrived in time.
    pub answered: u32,
    /// Airframes that flew on an older command.
    pub reused: u32,
    /// Deadlines missed by a whole period or more; 0 in lockstep.
    pub missed_deadlines: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// Where a link comes from.
///
/// A number and not an `enum`: whatever bytes another process wrote, reading them is defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, NoUninit, ZeroCopySend)]
#[type_name("ringwing.LinkSource.v1")]
#[repr(C)]
pub struct LinkSource(u32);

impl LinkSource {
    /// The leader.
    pub const LEADER: Self = Self(0);
    /// The receiver's own airframe.
    pub const OWN: Self = Self(u32::MAX);

    /// The agent of `uav`.
    pub fn uav(uav: UavId) -> Self {
        Self(uav.0)
    }
}

impl fmt::Display for LinkSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::LEADER => f.write_str("leader"),
            Self::OWN => f.write_str("own"),
            Self(uav) => uav.fmt(f),
        }
    }
}

/// What has become of the samples of one link since its receiver began, from the receiver, once a simulated second and
/// only while the link has faults.
///
/// `offered + duplicated == delivered + lost + in_flight`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, NoUninit, ZeroCopySend)]
#[type_name("ringwing.LinkCounts.v1")]
#[repr(C)]
pub struct LinkCounts {
    /// The tick of this count.
    pub tick: Tick,
    /// Sent, and early enough to be used by now.
    pub offered: u64,
    /// Used, duplicates too.
    pub delivered: u64,
    /// Of those delivered, how many came later than on a sound link.
    pub late: u64,
    /// Lost on the way.
    pub lost: u64,
    /// Copies made on the way.
    pub duplicated: u64,
    /// On the way now.
    pub in_flight: u64,
    /// From whom.
    pub from: LinkSource,
    /// To whom.
    pub to: UavId,
}

impl LinkCounts {
    /// Nothing has been sent yet.
    pub fn none(from: LinkSource, to: UavId) -> Self {
        let tick = Tick::APPROACH;
        Self { tick, offered: 0, delivered: 0, late: 0, lost: 0, duplicated: 0, in_flight: 0, from, to }
    }

    /// As it is called in sentences: `2->3`.
    pub fn link(&self) -> String {
        format!("{}->{}", self.from, self.to.0)
    }
}

/// How many UAVs a [`Roster`] can name.
pub const MAX_UAVS: u32 = 1024;

/// Which processes the world may wait for, from the launcher, whenever it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ZeroCopySend)]
#[type_name("ringwing.Roster.v2")]
#[repr(C)]
pub struct Roster {
    /// Grows by one with each change.
    pub revision: u64,
    /// The agents that run, one bit each, UAV 1 first.
    agents: [u64; MAX_UAVS as usize / 64],
    /// The leader runs.
    pub leader: bool,
    /// The recorder runs.
    pub recorder: bool,
    /// A lost leader or recorder is being replaced: in lockstep, let no time pass.
    pub hold: bool,
    /// In lockstep, open no tick from this one on: something is to be done to the run before.
    pub free_before: Tick,
    /// Agents that were thawed, one bit each: they answer the tick that is open, before they have part in the next.
    thawed: [u64; MAX_UAVS as usize / 64],
    /// The leader was thawed.
    pub leader_thawed: bool,
}

/// The flight is free to go on to its end.
const UNBOUND: Tick = Tick(i64::MAX);

impl Roster {
    /// Nobody there yet.
    pub fn empty() -> Self {
        Self {
            revision: 0,
            agents: [0; MAX_UAVS as usize / 64],
            leader: false,
            recorder: false,
            hold: false,
            free_before: UNBOUND,
            thawed: [0; MAX_UAVS as usize / 64],
            leader_thawed: false,
        }
    }

    /// Whether `uav`'s agent runs.
    pub fn has(&self, uav: UavId) -> bool {
        bit(&self.agents, uav)
    }

    /// Notes whether `uav`'s agent runs.
    pub fn set(&mut self, uav: UavId, runs: bool) {
        set_bit(&mut self.agents, uav, runs);
    }

    /// Whether `uav`'s agent was thawed.
    pub fn is_thawed(&self, uav: UavId) -> bool {
        bit(&self.thawed, uav)
    }

    /// Notes whether `uav`'s agent was thawed.
    pub fn set_thawed(&mut self, uav: UavId, thawed: bool) {
        set_bit(&mut self.thawed, uav, thawed);
    }
}

fn bit(words: &[u64], uav: UavId) -> bool {
    words[uav.index() / 64] >> (uav.index() % 64) & 1 == 1
}

fn set_bit(words: &mut [u64], uav: UavId, value: bool) {
    let bit = 1 << (uav.index() % 64);
    let word = &mut words[uav.index() / 64];
    *word = if value { *word | bit } else { *word & !bit };
}

/// How far the swarm is from its formation, from the recorder, for the progress line.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("ringwing.FormationError.v1")]
#[repr(C)]
pub struct FormationError {
    /// The tick it describes.
    pub tick: Tick,
    /// The largest slot error among the UAVs that fly on command, metres.
    pub slot_error_max_m: f64,
    /// How many UAVs fly on command.
    pub commanded: u32,
}

// Other programs read these bytes: a changed layout needs a new `type_name`.
const _: () = {
    assert!(size_of::<LeaderState>() == 48);
    assert!(size_of::<UavState>() == 120);
    assert!(size_of::<Sensed>() == 320);
    assert!(size_of::<Command>() == 168);
    assert!(size_of::<TickTiming>() == 72);
    assert!(size_of::<LinkCounts>() == 64);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_age_is_never_mistaken_for_none() {
        assert_eq!(AgeTicks::NEVER.ticks(), None);
        assert_eq!(AgeTicks::between(Tick(3), Tick(7)).ticks(), Some(4));
        assert_eq!(AgeTicks::between(Tick(9), Tick(7)).ticks(), Some(0));
        assert_eq!(AgeTicks::between(Tick(0), Tick(i64::MAX)).ticks(), Some(u32::MAX - 1));
    }

    #[test]
    fn a_roster_keeps_each_uav_apart() {
        let mut roster = Roster::empty();
        for uav in UavId::all(MAX_UAVS) {
            assert!(!roster.has(uav));
            roster.set(uav, true);
            assert!(roster.has(uav));
        }
        roster.set(UavId(65), false);
        assert!(!roster.has(UavId(65)) && roster.has(UavId(64)) && roster.has(UavId(66)));
    }
}
