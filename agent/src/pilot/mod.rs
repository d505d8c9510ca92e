//! The pilot of one UAV: senses and received states go in, a command and the UAV's own state come out.
//!
//! `own_flight`, `own_estimate`, `neighbours`, `leader_estimate` and `wind_estimate` hold what the UAV knows of itself, of the
//! others, of the leader and of the wind; `slots` holds where each UAV should be. Each tick the pilot puts all of that into a
//! [`Situation`], and what [steers](Steer) the UAV decides: the built-in law of `built_in`, or a user's controller.
//!
//! Never knows processes, services or clocks: the same inputs give the same outputs, to the bit.

mod built_in;
mod failsafe_plan;
mod force_limit;
mod forecast;
mod gains;
mod leader_estimate;
mod neighbours;
mod own_estimate;
mod own_flight;
mod situation;
mod slot_motion;
mod slots;
mod steering;
mod track;
mod wind_estimate;

pub use built_in::BuiltInLaw;
pub use leader_estimate::EstimatedLeader;
pub use situation::{Membership, RingNeighbour, Situation};
pub use slot_motion::SlotMotion;
pub(crate) use steering::Forecast;
pub use steering::{Steer, Steered};
pub use track::PeerTrack;

use crate::law::{ControlInput, Limits, RepulsiveObstacle, repulsion};
use crate::safety::{CollisionFilter, Surroundings};
use failsafe_plan::FailsafePlan;
use leader_estimate::LeaderEstimate;
use nalgebra::{Point2, Vector2};
use neighbours::Neighbours;
use own_estimate::OwnEstimate;
use own_flight::OwnFlight;
use ringwing_flight::{
    Account, Command, FormationFrame, LeaderState, Notes, Pose, Sensed, SensedObstacle, Tick, Traffic, UavId,
    UavState, direction,
};
use ringwing_scenario::{DeadReckoning, Scenario};
use slots::Slots;
use wind_estimate::WindEstimate;

/// What a pilot decides in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// For the ring neighbours: where the UAV is, and how it flies on.
    pub state: UavState,
    /// For the airframe.
    pub command: Command,
    /// For the log: how the command came about.
    pub account: Account,
}

/// Why a pilot decides nothing in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Undecided {
    /// The UAV has sensed nothing new for the loss timeout, so it does not know where it is.
    NoSenses,
    /// What steers the UAV wishes for a speed or turn rate that is not a finite number.
    NotFinite,
}

/// The pilot of one UAV, which `S` steers.
#[derive(Debug, Clone)]
pub struct Pilot<S = BuiltInLaw> {
    steering: S,
    knowledge: Knowledge,
    /// `None` while the scenario switches it off.
    filter: Option<CollisionFilter>,
    failsafe: FailsafePlan,
}

/// What the pilot of one UAV knows.
#[derive(Debug, Clone)]
struct Knowledge {
    uav: UavId,
    limits: Limits,
    dead_reckoning: DeadReckoning,
    frame: FormationFrame,
    period_s: f64,
    timeout_ticks: i64,
    own: OwnFlight,
    estimate: OwnEstimate,
    neighbours: Neighbours,
    /// The UAVs that are lost as of `revision`.
    lost: Vec<UavId>,
    leader: LeaderEstimate,
    wind: WindEstimate,
    slots: Slots,
    /// The revision of the membership that the slots are for.
    revision: u64,
}

impl Pilot {
    /// The pilot of `uav` in `scenario`, which has been validated, steered by the built-in law.
    pub fn new(scenario: &Scenario, uav: UavId) -> Self {
        Self::steered_by(BuiltInLaw::new(scenario), scenario, uav)
    }
}

impl<S: Steer> Pilot<S> {
    /// The pilot of `uav` in `scenario`, which has been validated.
    ///
    /// # Panics
    /// If the scenario's airframe limits break Eq. (2): validation refuses such a scenario.
    pub fn steered_by(steering: S, scenario: &Scenario, uav: UavId) -> Self {
        Self {
            steering,
            knowledge: Knowledge::new(scenario, uav),
            filter: scenario.control.collision_filter.then(|| CollisionFilter::new(scenario, uav)),
            failsafe: FailsafePlan::new(scenario, uav),
        }
    }

    /// A copy to rehearse a tick with.
    pub fn rehearsal(&self) -> Pilot<S::Rehearsal> {
        Pilot {
            steering: self.steering.rehearsal(),
            knowledge: self.knowledge.clone(),
            filter: self.filter.clone(),
            failsafe: self.failsafe.clone(),
        }
    }

    /// Takes in what the UAV senses.
    pub fn receive_sensed(&mut self, senses: &Sensed) {
        // Another UAV's senses would make the pilot steer from a wrong position.
        if senses.uav == self.knowledge.uav && self.knowledge.own.receive(senses) {
            self.knowledge.take_in(senses);
        }
    }

    /// Takes in which other aircraft the UAV senses.
    pub fn receive_traffic(&mut self, traffic: &Traffic) {
        if let Some(filter) = &mut self.filter {
            filter.receive(traffic);
        }
    }

    /// Takes in what another UAV sent, in tick `now`.
    pub fn receive_state(&mut self, state: &UavState, now: Tick) {
        self.knowledge.neighbours.receive(state, now);
    }

    /// Takes in what the leader sent.
    pub fn receive_leader(&mut self, state: &LeaderState) {
        self.knowledge.leader.receive(state);
    }

    /// The UAVs to listen to from the next tick on.
    pub fn listened(&self) -> &[UavId] {
        self.knowledge.neighbours.listened()
    }

    /// What its controller has noted for the log in `now`, also if what it wished cannot be flown.
    pub fn notes(&self, now: Tick) -> Option<&Notes> {
        self.steering.notes(now)
    }

    /// Decides for `now`.
    pub fn fly(&mut self, now: Tick) -> Result<Decision, Undecided> {
        let Self { steering, knowledge, filter, failsafe } = self;
        // Update the membership and the slots even without senses: the others fly on, and this UAV must agree with them
        // when its senses return.
        knowledge.update(now);
        let timeout_ticks = knowledge.timeout_ticks;
        let senses = *knowledge.own.senses(now, timeout_ticks).ok_or(Undecided::NoSenses)?;
        let (reckoning, period_s) = (knowledge.dead_reckoning, knowledge.period_s);
        let wind_m_s = knowledge.wind.wind_m_s();
        // A controller is told the bare readings as well, but every UAV flies by the estimate.
        let then = knowledge.estimate.pose(&senses);
        let own = knowledge.own.pose_at(then, &senses, now, reckoning, period_s, wind_m_s);
        let leader = knowledge.leader.at(now, reckoning, period_s);
        let traffic = filter.as_ref().and_then(CollisionFilter::traffic);
        let situation = knowledge.situation(now, own, &senses, leader, traffic);
        failsafe.look(&situation);
        let steered = steering.steer(&situation).ok_or(Undecided::NotFinite)?;
        let (control, account) = filtered(filter.as_mut(), steered, &senses, &own, now, wind_m_s);
        // If later senses are late, the own position is predicted from what was commanded here.
        knowledge.own.record_command(now, control);
        let command = Command {
            failsafe_path: failsafe.path(),
            ..Command::new(now, knowledge.uav, control.speed_m_s, control.turn_rate_rad_s)
        };
        Ok(Decision { state: knowledge.state(now, &own, control), command, account })
    }

    /// Does what no answer has to wait for: goes on with the plan of how the airframe leaves the formation without its agent. To be
    /// called once the tick is answered.
    pub fn plan_ahead(&mut self) {
        self.failsafe.go_on(&self.knowledge.slots, self.knowledge.own.obstacles());
    }
}

/// What is flown of the decision, with the account of it.
fn filtered(
    filter: Option<&mut CollisionFilter>,
    steered: Steered,
    senses: &Sensed,
    own: &Pose,
    now: Tick,
    wind_m_s: Vector2<f64>,
) -> (ControlInput, Account) {
    let Steered { control, mut account, forecast } = steered;
    let Some(filter) = filter else { return (control, account) };
    let obstacles = senses.obstacles();
    let force = |pose: &Pose, after_s: f64| match &forecast {
        Some(forecast) => forecast.force(pose, after_s, obstacles),
        None => direction(own.heading_rad) * control.speed_m_s,
    };
    let swarm_rad_s = forecast.as_ref().map_or(0.0, Forecast::swarm_rad_s);
    let surroundings = Surroundings { obstacles, swarm_rad_s, wind_m_s };
    let flown = filter.apply(now, own, control, force, &surroundings);
    (account.speed_m_s, account.turn_rate_rad_s) = (flown.control.speed_m_s, flown.control.turn_rate_rad_s);
    (account.avoided, account.avoided_m) = (flown.avoided, flown.avoided_at.into());
    account.avoided_turn_rad = flown.turn_rad;
    (flown.control, account)
}

impl Knowledge {
    fn new(scenario: &Scenario, uav: UavId) -> Self {
        let airframe = &scenario.airframe;
        let limits =
            Limits::new(airframe.speed_min_m_s, airframe.speed_max_m_s, airframe.turn_rate_max_rad_s);
        let timeout_ticks =
            (scenario.membership.loss_timeout_s * f64::from(scenario.time.rate_hz)).round() as i64;
        Self {
            uav,
            limits: limits.expect("a validated scenario has valid limits"),
            dead_reckoning: scenario.control.dead_reckoning,
            frame: scenario.formation.frame,
            period_s: scenario.period_s(),
            timeout_ticks,
            own: OwnFlight::default(),
            estimate: OwnEstimate::new(scenario),
            neighbours: Neighbours::new(scenario, uav, timeout_ticks),
            lost: Vec::new(),
            leader: LeaderEstimate::default(),
            wind: WindEstimate::new(scenario),
            slots: Slots::new(scenario, uav),
            // Revision 0 is the whole ring, and `Slots::new` begins with that.
            revision: 0,
        }
    }

    /// Takes in the newest senses of the UAV itself.
    fn take_in(&mut self, senses: &Sensed) {
        self.estimate.observe(senses);
        match self.estimate.wind_m_s() {
            Some(wind_m_s) => self.wind.take(wind_m_s),
            None => self.wind.observe(senses),
        }
    }

    /// Judges who is alive. Moves the slots, and sends them to a new ring when a UAV was lost or has returned.
    fn update(&mut self, now: Tick) {
        self.neighbours.update(now);
        if self.revision != self.neighbours.revision() {
            self.revision = self.neighbours.revision();
            let neighbours = &self.neighbours;
            self.slots.reform(now, |uav| neighbours.is_alive(uav));
            self.lost = self.slots.uavs().filter(|uav| !neighbours.is_alive(*uav)).collect();
        }
        self.slots.advance(now);
    }

    /// What the UAV at `own` is told in `now`.
    fn situation<'a>(
        &'a self,
        now: Tick,
        own: Pose,
        sensed: &'a Sensed,
        leader: Option<EstimatedLeader>,
        traffic: Option<&'a Traffic>,
    ) -> Situation<'a> {
        let geometry = self.slots.geometry();
        // Only the ring neighbours are a part of it. The agent may listen to more UAVs, to learn who is alive.
        let neighbours = geometry.neighbours.map(|neighbour| {
            let (uav, rest_m) = neighbour?;
            Some(RingNeighbour { uav, rest_m, track: self.neighbours.newest(uav) })
        });
        Situation {
            tick: now,
            period_s: self.period_s,
            uav: self.uav,
            limits: self.limits,
            own,
            sensed,
            neighbours,
            leader,
            wind_m_s: self.wind.wind_m_s(),
            leader_is_silent: leader.is_some_and(|leader| now.since(leader.track.tick) > self.timeout_ticks),
            slot_offset_m: leader
                .map_or(geometry.slot, |leader| self.frame.placed(geometry.slot, leader.frame_rad)),
            radius_m: geometry.radius_m,
            frame: self.frame,
            traffic,
            membership: Membership {
                living: self.slots.living(),
                lost: &self.lost,
                lost_fingerprint: self.neighbours.lost_fingerprint(),
                slots_are_moving: self.slots.is_moving(),
            },
        }
    }

    /// The state for the neighbours. It holds the speed and turn rate that begin now, so they predict the coming tick
    /// exactly.
    fn state(&mut self, now: Tick, own: &Pose, control: ControlInput) -> UavState {
        UavState {
            tick: now,
            position_m: own.position.into(),
            heading_rad: own.heading_rad,
            speed_m_s: control.speed_m_s,
            turn_rate_rad_s: control.turn_rate_rad_s,
            uav: self.uav,
            reserved: 0,
            rumours: self.neighbours.rumours(),
        }
    }
}

/// `f_obs` of Eq. (13), summed over the sensed obstacles, for a UAV at `own` after `after_s`, seen from air that moves at
/// `wind_m_s`.
fn repulsion_of(
    obstacles: &[SensedObstacle],
    gain_m: f64,
    own: &Point2<f64>,
    after_s: f64,
    wind_m_s: Vector2<f64>,
) -> Vector2<f64> {
    let of_one = |sensed: &SensedObstacle| {
        let velocity_m_s = Vector2::from(sensed.velocity_m_s) - wind_m_s;
        let obstacle = RepulsiveObstacle {
            centre: Point2::from(sensed.position_m) + velocity_m_s * after_s,
            radius_m: sensed.radius_m,
            braking_distance_m: sensed.braking_distance_m,
        };
        repulsion(gain_m, &obstacle, own)
    };
    obstacles.iter().map(of_one).sum()
}

#[cfg(test)]
mod tests;
