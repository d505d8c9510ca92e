//! One tick of the flight as it is measured, shown and logged.
//!
//! During a flight, [`TickSamples`] collect the payloads of a tick, and [`Frame::refill`] makes a frame of them.
//! Replaying a log makes the same frame of its messages. Must never guess: what was not received is absent.

use super::{
    links::LinkTotals,
    ring::{FlownRing, RingNeighbour},
};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{
    Account, Aircraft, Avoided, FlightMode, LeaderState, LinkCounts, Notes, Pose, Sensed, Truth, UavId,
    direction,
};
use ringwing_scenario::Scenario;

/// The payloads of one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct TickSamples {
    /// The tick.
    pub tick: i64,
    /// Each airframe, UAV 1 first; `None` where it has left the sky or its sample was overwritten.
    pub airframes: Vec<Option<AirframeSample>>,
    /// What each agent commanded and why, UAV 1 first.
    pub accounts: Vec<Option<Account>>,
    /// The virtual leader.
    pub leader: Option<LeaderState>,
    /// What became of the samples on links with faults.
    pub links: Vec<LinkCounts>,
    /// What controllers noted, in any order.
    pub notes: Vec<Notes>,
}

/// What the recorder keeps of one airframe's [`Truth`] and of its [`Sensed`], which is much larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirframeSample {
    /// True position.
    pub position: Point2<f64>,
    /// Heading from the x axis, counterclockwise.
    pub heading_rad: f64,
    /// Speed flown through the air over the last tick.
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    pub turn_rate_rad_s: f64,
    /// What its sensors say instead; `None` where they tell the truth to the bit.
    pub measured: Option<MeasuredFlight>,
    /// Distance to the centre of the nearest obstacle in sensor range.
    pub obstacle_distance_m: Option<f64>,
    /// What controls it.
    pub mode: FlightMode,
    /// The velocity of the air over the last tick; `None` where it was still.
    pub wind_m_s: Option<[f64; 2]>,
}

/// What the sensors of a UAV say of its own flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredFlight {
    /// The last fix of the position, east and north.
    pub position_m: [f64; 2],
    /// The last heading.
    pub heading_rad: f64,
    /// Speed through the air.
    pub speed_m_s: f64,
    /// Turn rate.
    pub turn_rate_rad_s: f64,
}

impl MeasuredFlight {
    /// What `sensed` says; `None` if that is the truth to the bit.
    fn apart(sensed: &Sensed, truth: &Truth) -> Option<Self> {
        let Sensed { position_m, heading_rad, speed_m_s, turn_rate_rad_s, .. } = *sensed;
        let told = Truth { position_m, heading_rad, speed_m_s, turn_rate_rad_s, ..*truth };
        (told != *truth).then_some(Self { position_m, heading_rad, speed_m_s, turn_rate_rad_s })
    }
}

impl AirframeSample {
    /// The sample of a UAV that senses this and truly flies like that.
    pub fn new(sensed: &Sensed, truth: &Truth) -> Self {
        let position = Point2::from(truth.position_m);
        let wind_m_s = truth.wind_m_s;
        // Obstacles are sorted, the nearest first. The d of Eq. (13) is measured to the centre.
        let distance = |centre: [f64; 2]| (Point2::from(centre) - position).norm();
        Self {
            position,
            heading_rad: truth.heading_rad,
            speed_m_s: truth.speed_m_s,
            turn_rate_rad_s: truth.turn_rate_rad_s,
            measured: MeasuredFlight::apart(sensed, truth),
            obstacle_distance_m: sensed.obstacles().first().map(|obstacle| distance(obstacle.position_m)),
            mode: sensed.mode,
            wind_m_s: (wind_m_s != [0.0; 2]).then_some(wind_m_s),
        }
    }
}

impl TickSamples {
    /// Nothing received yet of a swarm of `uavs`.
    pub fn new(uavs: usize) -> Self {
        Self {
            tick: 0,
            airframes: vec![None; uavs],
            accounts: vec![None; uavs],
            leader: None,
            links: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Forgets everything and keeps the memory, ready for `tick`.
    pub fn restart(&mut self, tick: i64) {
        self.tick = tick;
        self.airframes.fill(None);
        self.accounts.fill(None);
        self.links.clear();
        self.notes.clear();
        self.leader = None;
    }
}

/// One tick of the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The tick.
    pub tick: i64,
    /// The virtual leader.
    pub leader: Option<LeaderState>,
    /// What became of the samples on links with faults, ordered by receiver, then by sender.
    pub links: Vec<LinkTotals>,
    /// What controllers noted, by ascending UAV. Only for the log: nothing is measured by it, and a frame that comes from a log
    /// has none.
    pub notes: Vec<Notes>,
    /// Each UAV, number 1 first.
    pub uavs: Vec<UavFrame>,
    /// The ring that the UAVs are measured against.
    pub ring: FlownRing,
}

/// One UAV in one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct UavFrame {
    /// Where it is, unless it has left the sky.
    pub state: Option<TrueState>,
    /// What its agent commanded, if it did.
    pub control: Option<ControlTerms>,
}

/// Where a UAV truly is, and how far that is from the UAVs and places around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueState {
    /// The UAV's number, from 1.
    pub uav: u32,
    /// True position, east.
    pub x_m: f64,
    /// True position, north.
    pub y_m: f64,
    /// Heading from the x axis, counterclockwise.
    pub heading_rad: f64,
    /// Speed flown through the air over the last tick.
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    pub turn_rate_rad_s: f64,
    /// Distance to the previous ring neighbour, while both are in the ring and that one is in the sky.
    pub previous_distance_m: Option<f64>,
    /// Distance to the next ring neighbour, while that one flies.
    pub next_distance_m: Option<f64>,
    /// Distance to the leader, while there is one.
    pub leader_distance_m: Option<f64>,
    /// The slot at the leader's true position, east and north.
    pub slot_m: Option<[f64; 2]>,
    /// Distance from that slot.
    pub slot_error_m: Option<f64>,
    /// Distance to the centre of the nearest obstacle in sensor range, the d of Eq. (13).
    pub obstacle_distance_m: Option<f64>,
    /// What controls the airframe.
    pub mode: FlightMode,
    /// The velocity of the air over the last tick, east and north; `None` where it was still.
    pub wind_m_s: Option<[f64; 2]>,
    /// What its sensors say of its own flight; `None` where they tell the truth to the bit.
    pub measured: Option<MeasuredFlight>,
}

impl TrueState {
    /// True position.
    pub fn position(&self) -> Point2<f64> {
        Point2::new(self.x_m, self.y_m)
    }

    /// True position and heading.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position(), heading_rad: self.heading_rad }
    }

    /// The velocity over the ground: that through the air, along the heading, and that of the air.
    pub fn velocity_m_s(&self) -> Vector2<f64> {
        let through_the_air = direction(self.heading_rad) * self.speed_m_s;
        self.wind_m_s.map_or(through_the_air, |wind_m_s| through_the_air + Vector2::from(wind_m_s))
    }

    /// Where it goes over the ground, from the x axis, counterclockwise; in still air its heading.
    pub fn course_rad(&self) -> f64 {
        let velocity_m_s = self.velocity_m_s();
        // In still air the heading itself, to the bit.
        self.wind_m_s.map_or(self.heading_rad, |_| libm::atan2(velocity_m_s.y, velocity_m_s.x))
    }

    /// The speed of the air; `None` where it was still.
    pub fn wind_speed_m_s(&self) -> Option<f64> {
        self.wind_m_s.map(|wind_m_s| Vector2::from(wind_m_s).norm())
    }

    /// Whether its agent flies it, and not its failsafe.
    pub fn is_commanded(&self) -> bool {
        self.mode == FlightMode::COMMANDED
    }
}

/// What an agent commanded and how that came about.
///
/// The terms of `f_i` are rounded to single precision, as the log has them, so that a flight gives the same numbers
/// live and read again.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "four independent facts, each plotted by itself")]
pub struct ControlTerms {
    /// `v_i`.
    pub speed_command_m_s: f64,
    /// `omega_i`.
    pub turn_rate_command_rad_s: f64,
    /// The previous neighbour's term of `f_i`, Eq. (4).
    pub previous_force_m: [f64; 2],
    /// The next neighbour's term.
    pub next_force_m: [f64; 2],
    /// The formation centre's term.
    pub centre_force_m: [f64; 2],
    /// The slot's term.
    pub slot_force_m: [f64; 2],
    /// `f_obs`, Eq. (13), in full precision.
    pub repulsion_m: [f64; 2],
    /// `F_i`, Eq. (3).
    pub potential_m2: f64,
    /// Whether Eq. (12) cut the speed.
    pub speed_saturated: bool,
    /// Whether Eq. (12) cut the turn rate.
    pub turn_rate_saturated: bool,
    /// Age of the previous neighbour's data when they were used; `None` if none ever arrived.
    pub previous_age_s: Option<f64>,
    /// Age of the next neighbour's data.
    pub next_age_s: Option<f64>,
    /// Age of the leader's data.
    pub leader_age_s: Option<f64>,
    /// Number of UAVs that the agent considers alive, itself included.
    pub living: u32,
    /// Whether the leader has been silent for longer than the loss timeout, so that the agent follows its predicted path.
    pub leader_silent: bool,
    /// Whether the slots still move to their new positions after a loss or a return.
    pub slots_moving: bool,
    /// Fingerprint of the UAVs that the agent considers lost: 0 for none, and equal if two agents agree.
    pub lost_fingerprint: u64,
    /// The speed that the law asked for, within the airframe's limits.
    pub wish_speed_m_s: f64,
    /// The turn rate that the law asked for, within the airframe's limits.
    pub wish_turn_rate_rad_s: f64,
    /// What the collision filter avoids; `None` while it flies the law's wish.
    pub avoided: Option<AvoidedThing>,
    /// The agent's estimate of the wind; `None` while it assumes still air.
    pub wind_estimate_m_s: Option<[f64; 2]>,
    /// Where the agent believes that its UAV is; `None` where that is the truth to the bit.
    pub estimate: Option<Pose>,
}

/// What a collision filter avoids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvoidedThing {
    /// The number of the UAV; `None` for an obstacle or an intruder.
    pub uav: Option<u32>,
    /// The number of the intruder.
    pub intruder: Option<u32>,
    /// Where it was when the filter chose its way, east and north.
    pub place_m: [f64; 2],
    /// How far the heading that the filter takes lies from that of the law's course; positive to the left.
    pub turn_rad: f64,
}

impl AvoidedThing {
    fn of(account: &Account) -> Option<Self> {
        let (uav, intruder) = match account.avoided.who() {
            Some(Aircraft::Uav(uav)) => (Some(uav.0), None),
            Some(Aircraft::Intruder(intruder)) => (None, Some(intruder.0)),
            None => (None, None),
        };
        let acts = account.avoided != Avoided::NOTHING;
        let (place_m, turn_rad) = (account.avoided_m, account.avoided_turn_rad);
        acts.then_some(Self { uav, intruder, place_m, turn_rad })
    }
}

impl ControlTerms {
    /// The terms of `account`, at `rate_hz` ticks a second.
    pub fn of(account: &Account, rate_hz: u32) -> Self {
        // Payloads hold flags as integers, because most byte values are not a valid `bool`.
        let age_s = |ticks: u32| f64::from(ticks) / f64::from(rate_hz);
        Self {
            speed_command_m_s: account.speed_m_s,
            turn_rate_command_rad_s: account.turn_rate_rad_s,
            previous_force_m: account.previous_force_m.map(single),
            next_force_m: account.next_force_m.map(single),
            centre_force_m: account.centre_force_m.map(single),
            slot_force_m: account.slot_force_m.map(single),
            repulsion_m: account.repulsion_m,
            potential_m2: account.potential_m2,
            speed_saturated: account.speed_saturated != 0,
            turn_rate_saturated: account.turn_rate_saturated != 0,
            previous_age_s: account.previous_age.ticks().map(age_s),
            next_age_s: account.next_age.ticks().map(age_s),
            leader_age_s: account.leader_age.ticks().map(age_s),
            living: account.living,
            leader_silent: account.leader_silent != 0,
            slots_moving: account.slots_moving != 0,
            lost_fingerprint: account.lost_fingerprint,
            wish_speed_m_s: account.wish_speed_m_s,
            wish_turn_rate_rad_s: account.wish_turn_rate_rad_s,
            avoided: AvoidedThing::of(account),
            wind_estimate_m_s: (account.wind_m_s != [0.0; 2]).then_some(account.wind_m_s),
            estimate: Some(Pose {
                position: account.estimate_m.into(),
                heading_rad: account.estimate_heading_rad,
            }),
        }
    }

    /// Both neighbours' terms of `f_i`.
    pub fn neighbour_force_m(&self) -> [f64; 2] {
        let ([previous_x, previous_y], [next_x, next_y]) = (self.previous_force_m, self.next_force_m);
        // The sum of two rounded terms has new low bits, which would not compress.
        [single(previous_x + next_x), single(previous_y + next_y)]
    }

    /// The length of `f_obs`.
    pub fn repulsion_length_m(&self) -> f64 {
        libm::hypot(self.repulsion_m[0], self.repulsion_m[1])
    }
}

/// Rounds a force to single precision: the zeros at its end compress away, which makes the log a third smaller.
fn single(force_m: f64) -> f64 {
    f64::from(force_m as f32)
}

impl Frame {
    /// A frame of `scenario`'s swarm in which nothing is known yet.
    pub fn new(scenario: &Scenario) -> Self {
        Self::blank(0, FlownRing::new(scenario))
    }

    /// A frame of `tick`, measured against `ring`, in which nothing is known yet.
    pub(crate) fn blank(tick: i64, ring: FlownRing) -> Self {
        let uavs = vec![UavFrame::default(); ring.uavs() as usize];
        Self { tick, leader: None, links: Vec::new(), notes: Vec::new(), uavs, ring }
    }

    /// Makes this the frame of `samples`, at `rate_hz` ticks a second.
    pub fn refill(&mut self, samples: &TickSamples, rate_hz: u32) {
        let is_commanded = |airframe: &AirframeSample| airframe.mode == FlightMode::COMMANDED;
        let airframe = |number: u32| samples.airframes[UavId(number).index()].as_ref();
        self.ring.follow(samples.tick, |number| airframe(number).is_some_and(is_commanded));
        self.tick = samples.tick;
        self.leader = samples.leader;
        let mut counts: Vec<&LinkCounts> = samples.links.iter().collect();
        // Agents send their counts in any order; sorted, equal flights give equal logs.
        counts.sort_by_key(|counts| (counts.to, counts.from, counts.acted));
        self.links.clear();
        self.links.extend(counts.into_iter().map(LinkTotals::from));
        self.notes.clone_from(&samples.notes);
        // Agents send in any order, as above.
        self.notes.sort_by_key(|notes| notes.uav);
        // The ring is up to date by now: slots and neighbours come from it.
        for (uav, frame) in UavId::all(self.ring.uavs()).zip(&mut self.uavs) {
            let state = true_state(uav, samples, &self.ring);
            let mut control =
                samples.accounts[uav.index()].as_ref().map(|account| ControlTerms::of(account, rate_hz));
            // With perfect senses the estimate is the truth, and need not be logged twice.
            if let (Some(control), Some(state)) = (&mut control, &state) {
                control.estimate = control.estimate.filter(|estimate| *estimate != state.pose());
            }
            *frame = UavFrame { state, control };
        }
    }

    /// The state of UAV `number`, if it flies on command.
    pub fn commanded(&self, number: u32) -> Option<&TrueState> {
        self.uavs.get(number as usize - 1)?.commanded()
    }

    /// The mean velocity of the air at the UAVs in the sky; `None` where it is still.
    pub fn wind_m_s(&self) -> Option<Vector2<f64>> {
        let winds = self.uavs.iter().filter_map(|uav| uav.state?.wind_m_s).map(Vector2::from);
        let count = winds.clone().count();
        (count > 0).then(|| winds.sum::<Vector2<f64>>() / count as f64)
    }

    /// All UAVs in the order of their slots.
    pub(crate) fn round_the_ring(&self) -> impl Iterator<Item = &UavFrame> + Clone {
        self.ring.in_order().map(|number| &self.uavs[UavId(number).index()])
    }

    /// The states of all UAVs that fly on command.
    pub(super) fn all_commanded(&self) -> impl Iterator<Item = &TrueState> {
        self.uavs.iter().filter_map(UavFrame::commanded)
    }

    /// What the agents of the UAVs that fly on command commanded.
    pub(super) fn controls(&self) -> impl Iterator<Item = &ControlTerms> {
        self.uavs.iter().filter(|uav| uav.commanded().is_some()).filter_map(|uav| uav.control.as_ref())
    }
}

impl UavFrame {
    /// How far its agent's estimate of its position is from the true one, in metres; `None` without a command.
    pub fn estimate_error_m(&self) -> Option<f64> {
        let (state, control) = (self.state.as_ref()?, self.control.as_ref()?);
        Some(control.estimate.map_or(0.0, |estimate| (estimate.position - state.position()).norm()))
    }

    /// How far its agent's estimate of the wind is from the true one, as the length of the difference; `None` in still air, and
    /// without a command.
    pub fn wind_error_m_s(&self) -> Option<f64> {
        let truth_m_s = Vector2::from(self.state.as_ref()?.wind_m_s?);
        // An agent that assumes still air is off by the whole wind.
        let estimate_m_s =
            self.control.as_ref()?.wind_estimate_m_s.map_or_else(Vector2::zeros, Vector2::from);
        Some((estimate_m_s - truth_m_s).norm())
    }

    /// Its state, if it flies on command.
    pub fn commanded(&self) -> Option<&TrueState> {
        self.state.as_ref().filter(|state| state.is_commanded())
    }
}

fn true_state(uav: UavId, samples: &TickSamples, ring: &FlownRing) -> Option<TrueState> {
    let airframe = samples.airframes[uav.index()]?;
    let distance = |place: Point2<f64>| (place - airframe.position).norm();
    let neighbour_distance = |neighbour: RingNeighbour| {
        samples.airframes[UavId(neighbour.uav).index()].map(|other| distance(other.position))
    };
    let place = ring.place(uav.0);
    // A lost UAV flies away from the ring. The distances to the neighbours that it would return to say nothing about the
    // formation, and in a plot they would hide the others.
    let neighbour_distance =
        |neighbour: Option<RingNeighbour>| neighbour.filter(|_| place.is_in).and_then(neighbour_distance);
    // The leader's true position at this tick, not what agents heard of it: errors include the delay of their data.
    let centre = samples.leader.map(|leader| Point2::from(leader.position_m));
    let slot =
        samples.leader.map(|leader| Point2::from(leader.position_m) + ring.slot_offset(uav.0, &leader));
    Some(TrueState {
        uav: uav.0,
        x_m: airframe.position.x,
        y_m: airframe.position.y,
        heading_rad: airframe.heading_rad,
        speed_m_s: airframe.speed_m_s,
        turn_rate_rad_s: airframe.turn_rate_rad_s,
        previous_distance_m: neighbour_distance(place.previous),
        next_distance_m: neighbour_distance(place.next),
        leader_distance_m: centre.map(distance),
        slot_m: slot.map(Into::into),
        slot_error_m: slot.map(distance),
        obstacle_distance_m: airframe.obstacle_distance_m,
        mode: airframe.mode,
        wind_m_s: airframe.wind_m_s,
        measured: airframe.measured,
    })
}

#[cfg(test)]
mod tests;
