//! Whatever steers a UAV, as its pilot sees it.
//!
//! Never knows which law it is.

use super::{forecast::LawForecast, situation::Situation};
use crate::law::ControlInput;
use nalgebra::Vector2;
use ringwing_flight::{Account, Notes, Pose, SensedObstacle, Tick, direction};

/// Decides, once a tick, how a UAV flies: the built-in law, or a user's controller.
///
/// A pilot is generic over it, so that the built-in law is called without any detour.
pub trait Steer {
    /// Stands in for it while a tick is rehearsed.
    type Rehearsal: Steer;

    /// What to rehearse with: nothing that is done with it may change this one.
    fn rehearsal(&self) -> Self::Rehearsal;

    /// Decides for one tick; `None` if what was decided is not a finite number.
    fn steer(&mut self, situation: &Situation<'_>) -> Option<Steered>;

    /// What it has noted for the log in `now`. The built-in law notes nothing, because the account has all its terms.
    fn notes(&self, _now: Tick) -> Option<&Notes> {
        None
    }
}

/// What was decided in one tick.
#[derive(Debug, Clone)]
pub struct Steered {
    /// What to fly, within the airframe's limits.
    pub(crate) control: ControlInput,
    /// How it came about, for the log.
    pub(crate) account: Account,
    /// Where it leads; `None` for straight on.
    pub(crate) forecast: Option<Forecast>,
}

/// Where a decision leads over the next seconds, for the collision filter.
#[derive(Debug, Clone)]
#[expect(
    clippy::large_enum_variant,
    reason = "a box would cost an allocation in every tick of the built-in law"
)]
pub(crate) enum Forecast {
    /// The built-in law knows its forces of the next seconds.
    Law(LawForecast),
    /// A user's controller is taken to hold speed and turn rate.
    Arc {
        /// Heading now.
        heading_rad: f64,
        /// What it holds.
        control: ControlInput,
        /// The rate at which the whole formation turns.
        formation_rad_s: f64,
    },
}

impl Forecast {
    /// That of a controller that holds `control`.
    pub(crate) fn arc(situation: &Situation<'_>, control: ControlInput) -> Self {
        let turn_rate_rad_s = situation.leader.map_or(0.0, |leader| leader.track.turn_rate_rad_s);
        Self::Arc {
            heading_rad: situation.own.heading_rad,
            control,
            formation_rad_s: situation.frame.turn_rate_rad_s(turn_rate_rad_s),
        }
    }

    /// The force on the UAV if it is at `own` after `after_s`: the velocity that it wants there.
    pub(super) fn force(&self, own: &Pose, after_s: f64, obstacles: &[SensedObstacle]) -> Vector2<f64> {
        match self {
            Self::Law(law) => law.force(own, after_s, obstacles),
            Self::Arc { heading_rad, control, .. } => {
                direction(heading_rad + control.turn_rate_rad_s * after_s) * control.speed_m_s
            }
        }
    }

    /// The rate at which other UAVs turn that fly on command.
    pub(super) fn swarm_rad_s(&self) -> f64 {
        match self {
            Self::Law(law) => law.turn_rate_rad_s(),
            Self::Arc { formation_rad_s, .. } => *formation_rad_s,
        }
    }
}
