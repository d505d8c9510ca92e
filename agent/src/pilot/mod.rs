//! Flies one UAV: what it senses and has heard goes in, its command and its own state come out.
//!
//! Knows nothing of processes, services or clocks; the same inputs give the same outputs, to the bit.

mod leader_estimate;
mod neighbours;
mod own;
mod slots;
mod track;

use crate::law::{
    Bond, Control, Field, Limits, Obstacle, formation_control, potential, potential_forces, repulsion,
    saturated_control, speed_force,
};
use leader_estimate::Lead;
use nalgebra::{Point2, Vector2};
use neighbours::Neighbours;
use own::Own;
use ringwing_flight::{Account, Command, LeaderState, Pose, Sensed, Tick, UavId, UavState};
use ringwing_scenario::{DeadReckoning, Scenario};
use slots::{Shape, Slots};
use track::{Track, age};

/// What a pilot decides in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// For the ring neighbours: where the UAV is and how it flies on.
    pub state: UavState,
    /// For the airframe.
    pub command: Command,
    /// For the log: how the command came about.
    pub account: Account,
}

/// The pilot of one UAV.
#[derive(Debug, Clone)]
pub struct Pilot {
    uav: UavId,
    limits: Limits,
    formation_gain: f64,
    slot_gain: f64,
    obstacle_gain_m: f64,
    heading_gain_rad_per_m: f64,
    dead_reckoning: DeadReckoning,
    /// In which time a neighbour's term fades with the age of its data, if it does.
    trust_time_s: Option<f64>,
    /// How far from the slot G fades, if it does.
    gain_reach_m: Option<f64>,
    is_force_limited: bool,
    period_s: f64,
    timeout_ticks: i64,
    own: Own,
    neighbours: Neighbours,
    lead: Lead,
    slots: Slots,
    /// The revision of the membership that the slots are for.
    revision: u64,
}

impl Pilot {
    /// The pilot of `uav` in `scenario`, which has been validated.
    ///
    /// # Panics
    /// If the scenario's airframe limits are none: validation refuses them.
    pub fn new(scenario: &Scenario, uav: UavId) -> Self {
        let airframe = &scenario.airframe;
        let limits =
            Limits::new(airframe.speed_min_m_s, airframe.speed_max_m_s, airframe.turn_rate_max_rad_s);
        let control = &scenario.control;
        let timeout_ticks =
            (scenario.membership.loss_timeout_s * f64::from(scenario.time.rate_hz)).round() as i64;
        Self {
            uav,
            limits: limits.expect("a validated scenario has limits"),
            formation_gain: control.formation_gain,
            slot_gain: control.slot_gain,
            obstacle_gain_m: control.obstacle_gain_m,
            heading_gain_rad_per_m: control.heading_gain_rad_per_m,
            dead_reckoning: control.dead_reckoning,
            trust_time_s: control.trust_fades.then_some(control.trust_time_s),
            gain_reach_m: control
                .gain_fades
                .then_some(control.gain_reach_spacings * scenario.formation.spacing_m),
            is_force_limited: control.force_limited,
            period_s: scenario.period_s(),
            timeout_ticks,
            own: Own::default(),
            neighbours: Neighbours::new(scenario, uav, timeout_ticks),
            lead: Lead::default(),
            slots: Slots::new(scenario, uav),
            revision: 0,
        }
    }

    /// Takes in what the UAV senses.
    pub fn receive_sensed(&mut self, senses: &Sensed) {
        if senses.uav == self.uav {
            self.own.sense(senses);
        }
    }

    /// Takes in what another UAV sent, in tick `now`.
    pub fn receive_state(&mut self, state: &UavState, now: Tick) {
        self.neighbours.hear(state, now);
    }

    /// Takes in what the leader sent.
    pub fn receive_leader(&mut self, state: &LeaderState) {
        self.lead.hear(state);
    }

    /// Whom to listen to from the next tick on.
    pub fn listened(&self) -> &[UavId] {
        self.neighbours.listened()
    }

    /// Decides for `now`; `None` when nothing new was sensed for too long.
    ///
    /// A UAV that has not heard of the leader yet keeps its heading and speed.
    pub fn fly(&mut self, now: Tick) -> Option<Decision> {
        self.neighbours.update(now);
        self.follow_losses(now);
        let senses = *self.own.senses(now, self.timeout_ticks)?;
        let own = self.own.reckoned(&senses, now, self.dead_reckoning, self.period_s);
        let (command, account) = match self.lead.at(now, self.dead_reckoning, self.period_s) {
            Some((leader, pose)) => self.follow(&leader, &pose, &senses, &own, now),
            None => {
                let command =
                    self.command(now, Control { speed_m_s: senses.speed_m_s, turn_rate_rad_s: 0.0 });
                (command, Account::without_leader(&command))
            }
        };
        let Command { speed_m_s, turn_rate_rad_s, .. } = command;
        self.own.command(now, Control { speed_m_s, turn_rate_rad_s });
        Some(Decision { state: self.state(now, &own, &command), command, account })
    }

    /// Lets the slots move when somebody was lost or returned.
    fn follow_losses(&mut self, now: Tick) {
        if self.revision != self.neighbours.revision() {
            self.revision = self.neighbours.revision();
            let neighbours = &self.neighbours;
            self.slots.reform(now, |uav| neighbours.lives(uav));
        }
        self.slots.advance(now);
    }

    /// The law, Eq. (4) to (13), with the leader where it is now.
    fn follow(
        &self,
        leader: &Track,
        leader_pose: &Pose,
        senses: &Sensed,
        own: &Pose,
        now: Tick,
    ) -> (Command, Account) {
        let shape = self.slots.shape();
        let heard = shape.neighbours.map(|neighbour| self.neighbours.newest(neighbour?.0));
        let field = self.field(shape, heard, leader_pose, own, now);
        let forces = potential_forces(&field, &own.position);
        let repulsion = self.repulsion(senses, &own.position);
        let formation_force = self.limited(forces.total(), leader.speed_m_s);
        let force = speed_force(leader.speed_m_s, leader_pose.heading_rad) - formation_force + repulsion;
        let wish = formation_control(&force, own.heading_rad, self.heading_gain_rad_per_m);
        let control = saturated_control(&wish, &self.limits);
        let command = self.command(now, control);
        let account = Account {
            tick: now,
            speed_m_s: control.speed_m_s,
            turn_rate_rad_s: control.turn_rate_rad_s,
            uav: self.uav,
            reserved: 0,
            slot_m: field.slot.into(),
            previous_force_m: forces.previous.into(),
            next_force_m: forces.next.into(),
            centre_force_m: forces.centre.into(),
            slot_force_m: forces.slot.into(),
            repulsion_m: repulsion.into(),
            potential_m2: potential(&field, &own.position),
            previous_age: age(heard[0], now),
            next_age: age(heard[1], now),
            leader_age: age(Some(leader), now),
            speed_saturated: u16::from(control.speed_m_s != wish.speed_m_s),
            turn_rate_saturated: u16::from(control.turn_rate_rad_s != wish.turn_rate_rad_s),
            living: self.slots.living(),
            leader_silent: u16::from(now.since(leader.tick) > self.timeout_ticks),
            slots_moving: u16::from(self.slots.is_moving()),
            lost_fingerprint: self.neighbours.lost_fingerprint(),
        };
        (command, account)
    }

    /// What the UAV's place is measured against, everybody where they are now.
    fn field(
        &self,
        shape: &Shape,
        heard: [Option<&Track>; 2],
        leader: &Pose,
        own: &Pose,
        now: Tick,
    ) -> Field {
        let slot = leader.position + shape.slot;
        let gain = self.formation_gain * self.reach(&(own.position - slot));
        let bond = |place: usize| {
            let (track, (_, rest_m)) = (heard[place]?, shape.neighbours[place]?);
            let point = track.foreseen(now, self.dead_reckoning, self.period_s).position;
            Some(Bond { point, rest_m, gain: gain * self.trust(track, now) })
        };
        Field {
            previous: bond(0),
            next: bond(1),
            centre: Bond { point: leader.position, rest_m: shape.radius_m, gain },
            slot,
            slot_gain: self.slot_gain,
        }
    }

    /// How much of G is left so far from the slot: nothing of it holds a UAV where it has no business.
    fn reach(&self, slot_error_m: &Vector2<f64>) -> f64 {
        let faded = |reach_m: f64| libm::exp(-slot_error_m.norm_squared() / (reach_m * reach_m));
        self.gain_reach_m.map_or(1.0, faded)
    }

    /// The formation's force, where it is limited no larger than the leader's speed: then no force turns a UAV back that is
    /// too far ahead; it flies slowly until the formation has come up, and in the end is there sooner.
    fn limited(&self, force: Vector2<f64>, leader_speed_m_s: f64) -> Vector2<f64> {
        if self.is_force_limited { force.cap_magnitude(leader_speed_m_s.abs()) } else { force }
    }

    /// How much of a neighbour's G is left at the age of `track`; the one tick that processes cost is no age.
    fn trust(&self, track: &Track, now: Tick) -> f64 {
        let age_s = (now.since(track.tick) - 1) as f64 * self.period_s;
        self.trust_time_s.map_or(1.0, |time_s| libm::exp(-age_s / time_s))
    }

    fn repulsion(&self, senses: &Sensed, own: &Point2<f64>) -> Vector2<f64> {
        let of_one = |sensed: &ringwing_flight::SensedObstacle| {
            let obstacle = Obstacle {
                centre: sensed.position_m.into(),
                radius_m: sensed.radius_m,
                braking_distance_m: sensed.braking_distance_m,
            };
            repulsion(self.obstacle_gain_m, &obstacle, own)
        };
        senses.obstacles().iter().map(of_one).sum()
    }

    fn command(&self, now: Tick, control: Control) -> Command {
        let Control { speed_m_s, turn_rate_rad_s } = control;
        Command { tick: now, speed_m_s, turn_rate_rad_s, uav: self.uav, withheld: 0 }
    }

    /// What neighbours are told: with the speed and turn rate that begin now they predict the coming tick exactly.
    fn state(&mut self, now: Tick, own: &Pose, command: &Command) -> UavState {
        UavState {
            tick: now,
            position_m: own.position.into(),
            heading_rad: own.heading_rad,
            speed_m_s: command.speed_m_s,
            turn_rate_rad_s: command.turn_rate_rad_s,
            uav: self.uav,
            reserved: 0,
            rumours: self.neighbours.rumours(),
        }
    }
}
