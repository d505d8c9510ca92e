//! The pilot of one UAV: senses and received states go in, a command and the UAV's own state come out.
//!
//! `own_flight`, `neighbours` and `leader_estimate` hold what the UAV knows of itself, of the others and of the leader;
//! `slots` holds where each UAV should be.
//!
//! Never knows processes, services or clocks: the same inputs give the same outputs, to the bit.

mod forecast;
mod gains;
mod leader_estimate;
mod neighbours;
mod own_flight;
mod slot_motion;
mod slots;
mod track;

use crate::law::{
    Bond, ControlInput, Field, Forces, Limits, RepulsiveObstacle, formation_control, potential,
    potential_forces, repulsion, saturated_control,
};
use crate::safety::CollisionFilter;
use forecast::LawForecast;
use gains::Gains;
use leader_estimate::{EstimatedLeader, LeaderEstimate};
use nalgebra::{Point2, Vector2};
use neighbours::Neighbours;
use own_flight::OwnFlight;
use ringwing_flight::{
    Account, Avoided, Command, FormationFrame, LeaderState, Pose, Sensed, SensedObstacle, Tick, Traffic,
    UavId, UavState, direction,
};
use ringwing_scenario::{DeadReckoning, Scenario};
use slot_motion::SlotMotion;
use slots::{SlotGeometry, Slots};
use track::{PeerTrack, age};

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

/// The pilot of one UAV.
#[derive(Debug, Clone)]
pub struct Pilot {
    uav: UavId,
    limits: Limits,
    gains: Gains,
    dead_reckoning: DeadReckoning,
    frame: FormationFrame,
    /// Whether the law flies the motion of the slot, and not that of the leader.
    feeds_turn_forward: bool,
    period_s: f64,
    timeout_ticks: i64,
    own: OwnFlight,
    neighbours: Neighbours,
    leader: LeaderEstimate,
    slots: Slots,
    /// `None` while the scenario switches it off.
    filter: Option<CollisionFilter>,
    /// The revision of the membership that the slots are for.
    revision: u64,
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

/// What the law wishes to fly in one tick.
struct Wish {
    control: ControlInput,
    account: Account,
    /// `None` before the first data from the leader.
    forecast: Option<LawForecast>,
}

impl Pilot {
    /// The pilot of `uav` in `scenario`, which has been validated.
    ///
    /// # Panics
    /// If the scenario's airframe limits break Eq. (2): validation refuses such a scenario.
    pub fn new(scenario: &Scenario, uav: UavId) -> Self {
        let airframe = &scenario.airframe;
        let limits =
            Limits::new(airframe.speed_min_m_s, airframe.speed_max_m_s, airframe.turn_rate_max_rad_s);
        let timeout_ticks =
            (scenario.membership.loss_timeout_s * f64::from(scenario.time.rate_hz)).round() as i64;
        Self {
            uav,
            limits: limits.expect("a validated scenario has valid limits"),
            gains: Gains::new(scenario),
            dead_reckoning: scenario.control.dead_reckoning,
            frame: scenario.formation.frame,
            feeds_turn_forward: scenario.control.turn_feed_forward,
            period_s: scenario.period_s(),
            timeout_ticks,
            own: OwnFlight::default(),
            neighbours: Neighbours::new(scenario, uav, timeout_ticks),
            leader: LeaderEstimate::default(),
            slots: Slots::new(scenario, uav),
            filter: scenario.control.collision_filter.then(|| CollisionFilter::new(scenario, uav)),
            // Revision 0 is the whole ring, and `Slots::new` begins with that.
            revision: 0,
        }
    }

    /// Takes in what the UAV senses.
    pub fn receive_sensed(&mut self, senses: &Sensed) {
        // Another UAV's senses would make the pilot steer from a wrong position.
        if senses.uav == self.uav {
            self.own.receive(senses);
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
        self.neighbours.receive(state, now);
    }

    /// Takes in what the leader sent.
    pub fn receive_leader(&mut self, state: &LeaderState) {
        self.leader.receive(state);
    }

    /// The UAVs to listen to from the next tick on.
    pub fn listened(&self) -> &[UavId] {
        self.neighbours.listened()
    }

    /// Decides for `now`; `None` when the UAV has sensed nothing new for the loss timeout.
    ///
    /// A UAV that has not received anything from the leader yet keeps its heading and speed.
    pub fn fly(&mut self, now: Tick) -> Option<Decision> {
        // Update the membership and the slots even without senses: the others fly on, and this UAV must agree with them
        // when its senses return.
        self.neighbours.update(now);
        self.update_slots(now);
        let senses = *self.own.senses(now, self.timeout_ticks)?;
        let own = self.own.pose_at(&senses, now, self.dead_reckoning, self.period_s);
        let wish = self.steer(&senses, &own, now);
        let (control, account) = self.filtered(wish, &senses, &own, now);
        // If later senses are late, the own position is predicted from what was commanded here.
        self.own.record_command(now, control);
        Some(Decision { state: self.state(now, &own, control), command: self.command(now, control), account })
    }

    /// What is flown of `wish`, with the account of it.
    fn filtered(&mut self, wish: Wish, senses: &Sensed, own: &Pose, now: Tick) -> (ControlInput, Account) {
        let Wish { control, mut account, forecast } = wish;
        let Some(filter) = &mut self.filter else { return (control, account) };
        let obstacles = senses.obstacles();
        let force = |pose: &Pose, after_s: f64| match &forecast {
            Some(forecast) => forecast.force(pose, after_s, obstacles),
            None => direction(own.heading_rad) * control.speed_m_s,
        };
        let swarm_rad_s = forecast.as_ref().map_or(0.0, LawForecast::turn_rate_rad_s);
        let flown = filter.apply(now, own, control, force, obstacles, swarm_rad_s);
        (account.speed_m_s, account.turn_rate_rad_s) =
            (flown.control.speed_m_s, flown.control.turn_rate_rad_s);
        (account.avoided, account.avoided_m) = (flown.avoided, flown.avoided_at.into());
        account.avoided_turn_rad = flown.turn_rad;
        (flown.control, account)
    }

    /// What the law wishes, with its account; without a leader, straight on at the present speed.
    fn steer(&mut self, senses: &Sensed, own: &Pose, now: Tick) -> Wish {
        let Some(leader) = self.leader.at(now, self.dead_reckoning, self.period_s) else {
            let control = ControlInput { speed_m_s: senses.speed_m_s, turn_rate_rad_s: 0.0 };
            let account = Account::without_leader(&self.command(now, control));
            return Wish { control, account, forecast: None };
        };
        let geometry = self.slots.geometry();
        let offset_m = self.frame.placed(geometry.slot, leader.frame_rad);
        let motion = if self.feeds_turn_forward {
            SlotMotion::turning(&leader, self.frame, offset_m)
        } else {
            SlotMotion::straight(&leader)
        };
        // Only the ring neighbours have a term in the law. The agent may listen to more UAVs, to learn who is alive.
        let tracks = geometry.neighbours.map(|neighbour| self.neighbours.newest(neighbour?.0));
        let bonds = self.neighbour_bonds(geometry, tracks, motion.turn_rate_rad_s, now);
        let field = self.field(geometry, bonds, leader.pose.position, offset_m, own);
        let terms = self.law_terms(field, &leader, &motion, senses, own);
        // Nobody else asks where the law leads.
        let forecast = self
            .filter
            .is_some()
            .then(|| LawForecast::new(&self.gains, &terms.field, tracks, &leader, self.frame, motion));
        Wish {
            control: terms.control,
            account: self.account(&terms, tracks, &leader.track, own, now),
            forecast,
        }
    }

    /// Moves the slots, and sends them to a new ring when a UAV was lost or has returned.
    fn update_slots(&mut self, now: Tick) {
        if self.revision != self.neighbours.revision() {
            self.revision = self.neighbours.revision();
            let neighbours = &self.neighbours;
            self.slots.reform(now, |uav| neighbours.is_alive(uav));
        }
        self.slots.advance(now);
    }

    /// The ring neighbours predicted to `now`, each with the share of G that its data are trusted with. A neighbour that was
    /// never received has no bond.
    fn neighbour_bonds(
        &self,
        geometry: &SlotGeometry,
        tracks: [Option<&PeerTrack>; 2],
        swarm_rad_s: f64,
        now: Tick,
    ) -> [Option<Bond>; 2] {
        [0, 1].map(|place| {
            let (track, (_, rest_m)) = (tracks[place]?, geometry.neighbours[place]?);
            let pose =
                track.with_formation_after_one_tick(now, self.dead_reckoning, swarm_rad_s, self.period_s);
            Some(Bond { point: pose.position, rest_m, gain: self.gains.trust(track, now) })
        })
    }

    /// What Eq. (3) measures the UAV's position against, around a leader at `centre`.
    fn field(
        &self,
        geometry: &SlotGeometry,
        trusted: [Option<Bond>; 2],
        centre: Point2<f64>,
        offset_m: Vector2<f64>,
        own: &Pose,
    ) -> Field {
        let slot = centre + offset_m;
        // One G for neighbours and centre, as in Eq. (3). The slot's term keeps its full gain, so that it decides
        // where G has faded.
        let gain = self.gains.formation(&(own.position - slot));
        let [previous, next] = trusted.map(|bond| bond.map(|bond| Bond { gain: gain * bond.gain, ..bond }));
        Field {
            previous,
            next,
            centre: Bond { point: centre, rest_m: geometry.radius_m, gain },
            slot,
            slot_gain: self.gains.slot,
        }
    }

    /// The law, Eq. (4) to (13).
    fn law_terms(
        &self,
        field: Field,
        leader: &EstimatedLeader,
        motion: &SlotMotion,
        senses: &Sensed,
        own: &Pose,
    ) -> LawTerms {
        let forces = potential_forces(&field, &own.position);
        let repulsion_m = repulsion_of(senses.obstacles(), self.gains.obstacle_m, &own.position, 0.0);
        // Only the formation's force is limited. A limited repulsion could be outweighed, and the UAV would hit the
        // obstacle.
        let formation_force = self.gains.limited(forces.total(), leader.track.speed_m_s);
        // The paper gives no formula for its "combined force" (end of Section 3.2). Eq. (13) points away from the
        // obstacle, so f_obs is added to the force of Eq. (6), before the saturation of Eq. (12).
        let force = motion.velocity_m_s - formation_force + repulsion_m;
        let mut unsaturated = formation_control(&force, own.heading_rad, self.gains.heading_rad_per_m);
        // In a turn, a UAV in its slot has no force across its heading and has to turn all the same. On a straight leg add
        // nothing: even a zero could change the sign of a zero.
        if motion.turn_rate_rad_s != 0.0 {
            unsaturated.turn_rate_rad_s += motion.turn_rate_rad_s;
        }
        let control = saturated_control(&unsaturated, &self.limits);
        LawTerms { field, forces, repulsion_m, unsaturated, control }
    }

    fn account(
        &self,
        terms: &LawTerms,
        tracks: [Option<&PeerTrack>; 2],
        leader: &PeerTrack,
        own: &Pose,
        now: Tick,
    ) -> Account {
        let LawTerms { field, forces, repulsion_m, unsaturated, control } = terms;
        Account {
            tick: now,
            speed_m_s: control.speed_m_s,
            turn_rate_rad_s: control.turn_rate_rad_s,
            wish_speed_m_s: control.speed_m_s,
            wish_turn_rate_rad_s: control.turn_rate_rad_s,
            avoided_m: [0.0; 2],
            avoided_turn_rad: 0.0,
            avoided: Avoided::NOTHING,
            uav: self.uav,
            slot_m: field.slot.into(),
            previous_force_m: forces.previous.into(),
            next_force_m: forces.next.into(),
            centre_force_m: forces.centre.into(),
            slot_force_m: forces.slot.into(),
            repulsion_m: (*repulsion_m).into(),
            potential_m2: potential(field, &own.position),
            previous_age: age(tracks[0], now),
            next_age: age(tracks[1], now),
            leader_age: age(Some(leader), now),
            // Comparing floats exactly is right here: Eq. (11) returns a value within the limits unchanged.
            speed_saturated: u16::from(control.speed_m_s != unsaturated.speed_m_s),
            turn_rate_saturated: u16::from(control.turn_rate_rad_s != unsaturated.turn_rate_rad_s),
            living: self.slots.living(),
            leader_silent: u16::from(now.since(leader.tick) > self.timeout_ticks),
            slots_moving: u16::from(self.slots.is_moving()),
            lost_fingerprint: self.neighbours.lost_fingerprint(),
        }
    }

    fn command(&self, now: Tick, control: ControlInput) -> Command {
        let ControlInput { speed_m_s, turn_rate_rad_s } = control;
        Command { tick: now, speed_m_s, turn_rate_rad_s, uav: self.uav, withheld: 0 }
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

/// `f_obs` of Eq. (13), summed over the sensed obstacles, for a UAV at `own` after `after_s`.
fn repulsion_of(obstacles: &[SensedObstacle], gain_m: f64, own: &Point2<f64>, after_s: f64) -> Vector2<f64> {
    let of_one = |sensed: &SensedObstacle| {
        let obstacle = RepulsiveObstacle {
            centre: Point2::from(sensed.position_m) + Vector2::from(sensed.velocity_m_s) * after_s,
            radius_m: sensed.radius_m,
            braking_distance_m: sensed.braking_distance_m,
        };
        repulsion(gain_m, &obstacle, own)
    };
    obstacles.iter().map(of_one).sum()
}
