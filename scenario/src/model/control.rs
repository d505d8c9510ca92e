//! How the agents fly: the control law, and what the swarm does when it loses a UAV.

use ringwing_flight::OnLoss;
use serde::{Deserialize, Serialize};

/// `[control]`: the control law of every agent.
///
/// A scenario file may leave out the switches of the resilient law: [`Law::switches`] then sets them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(clippy::struct_excessive_bools, reason = "each part of the law has its own switch")]
pub struct ControlSection {
    /// The law.
    pub law: Law,
    /// How far received states of neighbours, leader and the UAV itself are predicted forward.
    pub dead_reckoning: DeadReckoning,
    /// Scale the gain G of a neighbour by `exp(-age / trust_time_s)` of its newest state, so that old data count less.
    pub trust_fades: bool,
    /// Age at which that gain has faded to 37 %.
    pub trust_time_s: f64,
    /// Scale the gain G by `exp(-(slot error / (gain_reach_spacings L))^2)`, so that a UAV far from its slot is not
    /// pushed around by its neighbours. One that comes very near still repels it with the whole of G.
    pub gain_fades: bool,
    /// Slot error at which that gain has faded to 37 %, in multiples of L.
    pub gain_reach_spacings: f64,
    /// Limit the formation force so that a UAV heads for where it meets its slot, and waits for its slot where that is
    /// sooner than flying back to it.
    pub force_limited: bool,
    /// Fly the velocity and turn rate of the slot, as the leader's turn makes them, instead of the leader's. On a straight
    /// path the two are the same.
    pub turn_feed_forward: bool,
    /// Estimate the wind from the UAV's own drift, which is its way over the ground less its way through the air, and fly with
    /// that. Without this, a UAV flies with the mean wind if it is told, and otherwise assumes still air.
    pub wind_estimated: bool,
    /// Time over which that drift is averaged. Has no effect while a UAV estimates its own pose: that filter weighs by itself.
    pub wind_time_s: f64,
    /// Estimate the UAV's own pose, and the wind, from all of its sensors. Without this, a UAV believes that it is where it was
    /// measured last. Has no effect while the sensors are perfect.
    pub pose_estimated: bool,
    /// Close the ring after a loss and open it on a return, as [`MembershipSection`] says.
    pub ring_closes: bool,
    /// Depart from the law's wish where its path is not clear of other aircraft and obstacles, as [`SafetySection`] says.
    pub collision_filter: bool,
    /// G of Eq. (3).
    pub formation_gain: f64,
    /// Gain of the last term of Eq. (3), which draws a UAV to its slot; 1 in the paper.
    pub slot_gain: f64,
    /// k of Eq. (13). Without the collision filter, a UAV needs about 100 to stay clear of obstacles. With it, a large k turns the
    /// UAV round where the way is clear.
    pub obstacle_gain_m: f64,
    /// Turn rate per force across the heading, Eq. (6) and (12); 1 in the paper.
    pub heading_gain_rad_per_m: f64,
}

impl Default for ControlSection {
    fn default() -> Self {
        let LawSwitches {
            dead_reckoning,
            trust_fades,
            gain_fades,
            force_limited,
            turn_feed_forward,
            wind_estimated,
            pose_estimated,
            ring_closes,
            collision_filter,
            obstacle_gain_m,
        } = Law::Paper.switches();
        Self {
            law: Law::Paper,
            dead_reckoning,
            trust_fades,
            trust_time_s: 0.5,
            gain_fades,
            gain_reach_spacings: 0.1,
            force_limited,
            turn_feed_forward,
            wind_estimated,
            // Longer averages out more noise of positions, and follows gusts later.
            wind_time_s: 0.5,
            pose_estimated,
            ring_closes,
            collision_filter,
            // G of Section 4.1.
            formation_gain: 2.0,
            slot_gain: 1.0,
            obstacle_gain_m,
            heading_gain_rad_per_m: 1.0,
        }
    }
}

/// The control law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Equations (4) to (13), as written.
    Paper,
    /// The paper's law with additions that keep the swarm together when UAVs are lost or data are lost or late.
    Resilient,
}

impl Law {
    /// Its name in scenarios and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Resilient => "resilient",
        }
    }

    /// The switches of this law. A scenario may set each one differently.
    pub fn switches(self) -> LawSwitches {
        let on = self == Self::Resilient;
        let dead_reckoning = if on { DeadReckoning::Full } else { DeadReckoning::Tick };
        // The paper gives no k. With its law, below 40 a UAV hits obstacle 2 of Section 4.2, and a much larger k pushes UAVs close
        // to each other. With the collision filter, a UAV in a dense field can circle for good at 100, and at 10 it does not.
        let obstacle_gain_m = if on { 10.0 } else { 100.0 };
        LawSwitches {
            dead_reckoning,
            trust_fades: on,
            gain_fades: on,
            force_limited: on,
            turn_feed_forward: on,
            wind_estimated: on,
            pose_estimated: on,
            ring_closes: on,
            collision_filter: on,
            obstacle_gain_m,
        }
    }
}

/// What the laws differ in. A scenario can set each differently.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each part of the law has its own switch")]
pub struct LawSwitches {
    /// See [`ControlSection::dead_reckoning`].
    pub dead_reckoning: DeadReckoning,
    /// See [`ControlSection::trust_fades`].
    pub trust_fades: bool,
    /// See [`ControlSection::gain_fades`].
    pub gain_fades: bool,
    /// See [`ControlSection::force_limited`].
    pub force_limited: bool,
    /// See [`ControlSection::turn_feed_forward`].
    pub turn_feed_forward: bool,
    /// See [`ControlSection::wind_estimated`].
    pub wind_estimated: bool,
    /// See [`ControlSection::pose_estimated`].
    pub pose_estimated: bool,
    /// See [`ControlSection::ring_closes`].
    pub ring_closes: bool,
    /// See [`ControlSection::collision_filter`].
    pub collision_filter: bool,
    /// See [`ControlSection::obstacle_gain_m`].
    pub obstacle_gain_m: f64,
}

/// How far a received state is predicted forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeadReckoning {
    /// Not at all.
    Off,
    /// By the one tick that a message between processes always takes.
    Tick,
    /// By its whole age.
    Full,
}

/// `[membership]`: what the swarm does when it loses a UAV. Has no effect unless [`ControlSection::ring_closes`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MembershipSection {
    /// A UAV counts as lost when its ring neighbour has received nothing new from it, and no news of it from others,
    /// for this long.
    pub loss_timeout_s: f64,
    /// Which slots the remaining UAVs take.
    pub on_loss: OnLoss,
    /// How long a slot takes to move to its new place.
    pub slots_move_s: f64,
}

impl Default for MembershipSection {
    fn default() -> Self {
        // At 5 s a ring closes sooner than with slots that jump, and after most losses its UAVs stay farther apart.
        Self { loss_timeout_s: 1.0, on_loss: OnLoss::KeepSpacing, slots_move_s: 5.0 }
    }
}

/// `[safety]`: how the collision filter keeps a UAV clear of others. Has no effect unless
/// [`ControlSection::collision_filter`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SafetySection {
    /// The distance to keep from other aircraft.
    pub separation_m: f64,
    /// The distance to keep from the edge of an obstacle.
    pub clearance_m: f64,
    /// How far ahead a path must be clear.
    pub horizon_s: f64,
    /// How often a UAV looks whether its path is clear.
    pub interval_s: f64,
    /// How often it looks while it avoids something or senses an obstacle, unless `interval_s` is shorter.
    pub acting_interval_s: f64,
    /// The angle between two courses that it considers.
    pub heading_step_deg: f64,
}

impl Default for SafetySection {
    fn default() -> Self {
        Self {
            // Five times the distance of a collision. At 15 m, two UAVs with slots by number keep each other from crossing
            // for good in one of twenty flights; less leaves no room for late and noisy senses.
            separation_m: 10.0,
            clearance_m: 4.0,
            // A half turn at the largest turn rate takes 6 s, but a swarm that looks farther ahead avoids conflicts that
            // the law would have solved.
            horizon_s: 4.0,
            interval_s: 0.1,
            // Between obstacles, a UAV turns often: with 0.1 s, some UAV hits one in 5 of 100 fields of 30 circles. Less costs
            // more processor time.
            acting_interval_s: 0.04,
            heading_step_deg: 15.0,
        }
    }
}
