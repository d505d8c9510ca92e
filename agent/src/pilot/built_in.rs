//! The built-in law: the paper's, or with the additions of the resilient one, as the scenario's switches say.
//!
//! Keeps no state: the same situation gives the same decision.

use super::{
    forecast::LawForecast,
    gains::Gains,
    leader_estimate::EstimatedLeader,
    repulsion_of,
    situation::{RingNeighbour, Situation},
    slot_motion::SlotMotion,
    steering::{Forecast, Steer, Steered},
};
use crate::law::{
    Bond, ControlInput, Field, Forces, formation_control, potential, potential_forces, saturated_control,
};
use nalgebra::Vector2;
use ringwing_flight::{Account, Command};
use ringwing_scenario::{DeadReckoning, Scenario};

/// The built-in law of one scenario.
#[derive(Debug, Clone)]
pub struct BuiltInLaw {
    gains: Gains,
    dead_reckoning: DeadReckoning,
    /// Whether the law flies the motion of the slot, and not that of the leader.
    feeds_turn_forward: bool,
    /// Whether a collision filter asks where the law leads.
    has_filter: bool,
}

/// The terms of the law in one tick.
struct LawTerms {
    field: Field,
    forces: Forces,
    repulsion_m: Vector2<f64>,
    /// Before saturation.
    unsaturated: ControlInput,
    control: ControlInput,
}

impl BuiltInLaw {
    /// The law of `scenario`, which has been validated.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            gains: Gains::new(scenario),
            dead_reckoning: scenario.control.dead_reckoning,
            feeds_turn_forward: scenario.control.turn_feed_forward,
            has_filter: scenario.control.collision_filter,
        }
    }

    /// The ring neighbours predicted to now, each with the share of G that its data are trusted with. A neighbour that was
    /// never received has no bond.
    fn neighbour_bonds(&self, situation: &Situation<'_>, swarm_rad_s: f64) -> [Option<Bond>; 2] {
        situation.neighbours.map(|neighbour| {
            let RingNeighbour { track, rest_m, .. } = neighbour?;
            let track = track?;
            let pose = track.with_formation_after_one_tick(
                situation.tick,
                self.dead_reckoning,
                swarm_rad_s,
                situation.period_s,
                situation.wind_m_s,
            );
            Some(Bond { point: pose.position, rest_m, gain: self.gains.trust(track, situation.tick) })
        })
    }

    /// What Eq. (3) measures the UAV's position against.
    fn field(
        &self,
        situation: &Situation<'_>,
        trusted: [Option<Bond>; 2],
        leader: &EstimatedLeader,
    ) -> Field {
        let centre = leader.pose.position;
        let slot = centre + situation.slot_offset_m;
        // One G for neighbours and centre, as in Eq. (3). The slot's term keeps its full gain, so that it decides
        // where G has faded.
        let gain = self.gains.formation(&(situation.own.position - slot));
        let [previous, next] =
            trusted.map(|bond| Some(self.gains.bond(gain, bond?, &situation.own.position)));
        Field {
            previous,
            next,
            centre: Bond { point: centre, rest_m: situation.radius_m, gain },
            slot,
            slot_gain: self.gains.slot,
        }
    }

    /// The law, Eq. (4) to (13). `motion` is that of the slot through the air: in wind, the force of Eq. (6) becomes the velocity through
    /// the air, which is what speed and heading make.
    fn law_terms(&self, field: Field, motion: &SlotMotion, situation: &Situation<'_>) -> LawTerms {
        let own = &situation.own;
        let forces = potential_forces(&field, &own.position);
        let repulsion_m = repulsion_of(
            situation.obstacles(),
            self.gains.obstacle_m,
            &own.position,
            0.0,
            situation.wind_m_s,
        );
        // Only the formation's force is limited. A limited repulsion could be outweighed, and the UAV would hit the
        // obstacle.
        let slot_error_m = own.position - field.slot;
        let formation_force = self.gains.limited(forces.total(), &slot_error_m, &motion.velocity_m_s);
        // The paper gives no formula for its "combined force" (end of Section 3.2). Eq. (13) points away from the
        // obstacle, so f_obs is added to the force of Eq. (6), before the saturation of Eq. (12).
        let force = motion.velocity_m_s - formation_force + repulsion_m;
        let mut unsaturated = formation_control(&force, own.heading_rad, self.gains.heading_rad_per_m);
        // In a turn, a UAV in its slot has no force across its heading and has to turn all the same. On a straight leg add
        // nothing: even a zero could change the sign of a zero.
        if motion.turn_rate_rad_s != 0.0 {
            unsaturated.turn_rate_rad_s += motion.turn_rate_rad_s;
        }
        let control = saturated_control(&unsaturated, &situation.limits);
        LawTerms { field, forces, repulsion_m, unsaturated, control }
    }
}

impl Steer for BuiltInLaw {
    type Rehearsal = Self;

    fn rehearsal(&self) -> Self {
        self.clone()
    }

    fn steer(&mut self, situation: &Situation<'_>) -> Option<Steered> {
        let Some(leader) = &situation.leader else { return Some(without_leader(situation)) };
        let over_ground = if self.feeds_turn_forward {
            SlotMotion::turning(leader, situation.frame, situation.slot_offset_m)
        } else {
            SlotMotion::straight(leader)
        };
        let motion = over_ground.in_wind(situation.wind_m_s);
        let bonds = self.neighbour_bonds(situation, motion.turn_rate_rad_s);
        let field = self.field(situation, bonds, leader);
        let terms = self.law_terms(field, &motion, situation);
        let tracks = [situation.track(0), situation.track(1)];
        // Nobody else asks where the law leads.
        let forecast = self
            .has_filter
            .then(|| {
                let frame = situation.frame;
                let wind_m_s = situation.wind_m_s;
                LawForecast::new(&self.gains, &terms.field, bonds, tracks, leader, frame, over_ground)
                    .in_wind(wind_m_s)
            })
            .map(Forecast::Law);
        Some(Steered { control: terms.control, account: account(&terms, situation), forecast })
    }
}

/// Before the first data of the leader: straight on at the present speed.
fn without_leader(situation: &Situation<'_>) -> Steered {
    let control = ControlInput { speed_m_s: situation.sensed.speed_m_s, turn_rate_rad_s: 0.0 };
    let command = Command::new(situation.tick, situation.uav, control.speed_m_s, control.turn_rate_rad_s);
    let account = Account {
        estimate_m: situation.own.position.into(),
        estimate_heading_rad: situation.own.heading_rad,
        ..Account::without_leader(&command)
    };
    Steered { control, account, forecast: None }
}

/// How the law came to its control.
fn account(terms: &LawTerms, situation: &Situation<'_>) -> Account {
    let LawTerms { field, forces, repulsion_m, unsaturated, control } = terms;
    Account {
        previous_force_m: forces.previous.into(),
        next_force_m: forces.next.into(),
        centre_force_m: forces.centre.into(),
        slot_force_m: forces.slot.into(),
        repulsion_m: (*repulsion_m).into(),
        potential_m2: potential(field, &situation.own.position),
        // Comparing floats exactly is right here: Eq. (11) returns a value within the limits unchanged.
        speed_saturated: u16::from(control.speed_m_s != unsaturated.speed_m_s),
        turn_rate_saturated: u16::from(control.turn_rate_rad_s != unsaturated.turn_rate_rad_s),
        ..situation.account(*control)
    }
}
