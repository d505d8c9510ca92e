//! Flies one UAV: what it senses and has heard goes in, its command and its own state come out.
//!
//! Knows nothing of processes, services or clocks; the same inputs give the same outputs, to the bit.

use crate::{
    law::{
        Bond, Control, Field, Limits, Obstacle, formation_control, potential, potential_forces, repulsion,
        saturated_control, speed_force,
    },
    link::{Link, Track, age},
};
use nalgebra::{Point2, Vector2};
use ringwing_messages::{Command, LeaderState, Sensed, Terms, Tick, UavId, UavState};
use ringwing_scenario::{DeadReckoning, Formation, Pose, Scenario};

/// What a pilot decides in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// For the ring neighbours: where the UAV is and how it flies on.
    pub state: UavState,
    /// For the airframe.
    pub command: Command,
}

/// The pilot of one UAV.
#[derive(Debug, Clone)]
pub struct Pilot {
    uav: UavId,
    formation: Formation,
    radius_m: f64,
    limits: Limits,
    formation_gain: f64,
    slot_gain: f64,
    obstacle_gain_m: f64,
    heading_gain_rad_per_m: f64,
    dead_reckoning: DeadReckoning,
    period_s: f64,
    senses: Option<Sensed>,
    previous: Link,
    next: Link,
    leader: Link,
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
        let formation = scenario.formation();
        Self {
            uav,
            formation,
            radius_m: formation.radius_m(),
            limits: limits.expect("a validated scenario has limits"),
            formation_gain: control.formation_gain,
            slot_gain: control.slot_gain,
            obstacle_gain_m: control.obstacle_gain_m,
            heading_gain_rad_per_m: control.heading_gain_rad_per_m,
            dead_reckoning: control.dead_reckoning,
            period_s: scenario.period_s(),
            senses: None,
            previous: Link::default(),
            next: Link::default(),
            leader: Link::default(),
        }
    }

    /// Takes in what the UAV senses.
    pub fn sense(&mut self, senses: &Sensed) {
        if senses.uav == self.uav {
            self.senses = Some(*senses);
        }
    }

    /// Takes in what the ring neighbour before sent.
    pub fn hear_previous(&mut self, state: &UavState) {
        hear(&mut self.previous, state, self.uav.previous(self.formation.count()));
    }

    /// Takes in what the ring neighbour after sent.
    pub fn hear_next(&mut self, state: &UavState) {
        hear(&mut self.next, state, self.uav.next(self.formation.count()));
    }

    /// Takes in what the leader sent.
    pub fn hear_leader(&mut self, state: &LeaderState) {
        if let Some(track) = Track::of_leader(state) {
            self.leader.hear(track);
        }
    }

    /// Decides for `now`; `None` when nothing was sensed in this tick.
    ///
    /// A UAV that has not heard of the leader yet keeps its heading and speed.
    pub fn fly(&self, now: Tick) -> Option<Decision> {
        let senses = self.senses.as_ref().filter(|senses| senses.tick == now)?;
        let (control, terms) = match self.leader.before(now) {
            Some(leader) => self.follow(leader, senses),
            None => (Control { speed_m_s: senses.speed_m_s, turn_rate_rad_s: 0.0 }, Terms::NONE),
        };
        Some(self.decision(senses, &control, terms))
    }

    /// The law, Eq. (4) to (13), with the leader where it is now.
    fn follow(&self, leader: &Track, senses: &Sensed) -> (Control, Terms) {
        let now = senses.tick;
        let own = Point2::from(senses.position_m);
        let (previous, next) = (self.previous.before(now), self.next.before(now));
        let leader_pose = self.reckoned(leader, now);
        let field = self.field(previous, next, &leader_pose, now);
        let forces = potential_forces(&field, &own);
        let repulsion = self.repulsion(senses, &own);
        let force = speed_force(leader.speed_m_s, leader_pose.heading_rad) - forces.total() + repulsion;
        let wish = formation_control(&force, senses.heading_rad, self.heading_gain_rad_per_m);
        let control = saturated_control(&wish, &self.limits);
        let terms = Terms {
            slot_m: field.slot.into(),
            previous_force_m: forces.previous.into(),
            next_force_m: forces.next.into(),
            centre_force_m: forces.centre.into(),
            slot_force_m: forces.slot.into(),
            repulsion_m: repulsion.into(),
            potential_m2: potential(&field, &own),
            previous_age: age(previous, now),
            next_age: age(next, now),
            leader_age: age(Some(leader), now),
            speed_saturated: u16::from(control.speed_m_s != wish.speed_m_s),
            turn_rate_saturated: u16::from(control.turn_rate_rad_s != wish.turn_rate_rad_s),
            ..Terms::NONE
        };
        (control, terms)
    }

    /// What the UAV's place is measured against, everybody where they are now.
    fn field(&self, previous: Option<&Track>, next: Option<&Track>, leader: &Pose, now: Tick) -> Field {
        let gain = self.formation_gain;
        let neighbour = |track: &Track| Bond {
            point: self.reckoned(track, now).position,
            rest_m: self.formation.spacing_m(),
            gain,
        };
        Field {
            previous: previous.map(neighbour),
            next: next.map(neighbour),
            centre: Bond { point: leader.position, rest_m: self.radius_m, gain },
            slot: self.formation.slot(self.uav.0, leader.position),
            slot_gain: self.slot_gain,
        }
    }

    fn repulsion(&self, senses: &Sensed, own: &Point2<f64>) -> Vector2<f64> {
        let of_one = |sensed: &ringwing_messages::SensedObstacle| {
            let obstacle = Obstacle {
                centre: sensed.position_m.into(),
                radius_m: sensed.radius_m,
                braking_distance_m: sensed.braking_distance_m,
            };
            repulsion(self.obstacle_gain_m, &obstacle, own)
        };
        senses.obstacles().iter().map(of_one).sum()
    }

    fn reckoned(&self, track: &Track, now: Tick) -> Pose {
        track.reckoned(now, self.dead_reckoning, self.period_s)
    }

    /// The state carries the speed and turn rate that begin now, so that neighbours can predict the coming tick exactly.
    fn decision(&self, senses: &Sensed, control: &Control, terms: Terms) -> Decision {
        let Control { speed_m_s, turn_rate_rad_s } = *control;
        let state = UavState {
            tick: senses.tick,
            position_m: senses.position_m,
            heading_rad: senses.heading_rad,
            speed_m_s,
            turn_rate_rad_s,
            uav: self.uav,
            reserved: 0,
            rumours: Default::default(),
        };
        let command =
            Command { tick: senses.tick, speed_m_s, turn_rate_rad_s, uav: self.uav, reserved: 0, terms };
        Decision { state, command }
    }
}

fn hear(link: &mut Link, state: &UavState, expected: UavId) {
    if let Some(track) = Track::of_uav(state).filter(|_| state.uav == expected) {
        link.hear(track);
    }
}
