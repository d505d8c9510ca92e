//! A controller in another language: hands each tick to its callbacks.
//!
//! Never decides anything, and never keeps a pointer of the program beyond the call of `ringwing_controller_main`.

use crate::types::{
    RingwingAircraft, RingwingCallbacks, RingwingLeader, RingwingLimits, RingwingMembership,
    RingwingNeighbour, RingwingObstacle, RingwingPose, RingwingSituation, RingwingSlot, RingwingStart,
    RingwingTrack, RingwingVector, RingwingWish,
};
use ringwing_controller::{
    Aircraft, Controller, EstimatedLeader, FlightMode, FormationFrame, Limits, Membership, Notes, PeerTrack,
    Point2, Pose, RingNeighbour, Sensed, SensedAircraft, SensedObstacle, Situation, Start, Vector2, Wish,
};
use std::{
    cell::RefCell,
    ffi::{CString, c_char, c_void},
};

thread_local! {
    /// What the program notes during its `step`; `None` outside of it.
    static NOTES: RefCell<Option<Notes>> = const { RefCell::new(None) };
}

/// Notes `value` for the log under `name`; returns whether the log gets it.
pub(crate) fn note(name: &str, value: f64) -> bool {
    NOTES.with_borrow_mut(|notes| notes.as_mut().is_some_and(|notes| notes.set(name, value).is_ok()))
}

/// The callback that decides, as the program has to have it.
type Step = unsafe extern "C-unwind" fn(*mut c_void, *const RingwingSituation) -> RingwingWish;

/// The callbacks of a program and what they work on.
pub(crate) struct Foreign {
    step: Step,
    user: *mut c_void,
    /// What the program is told points into these; they keep their memory from tick to tick.
    obstacles: Vec<RingwingObstacle>,
    aircraft: Vec<RingwingAircraft>,
}

impl Foreign {
    /// Calls the program's `start`, if it has one. `arguments` points to the program's own arguments.
    pub(crate) fn new(
        callbacks: &RingwingCallbacks,
        step: Step,
        user: *mut c_void,
        start: &Start<'_>,
        arguments: *const *mut c_char,
    ) -> Self {
        if let Some(callback) = callbacks.start {
            tell_start(callback, user, start, arguments);
        }
        Self { step, user, obstacles: Vec::new(), aircraft: Vec::new() }
    }

    /// What the program is told of a tick. It points into `self` and into `situation`.
    fn translated(&mut self, situation: &Situation<'_>) -> RingwingSituation {
        self.obstacles.clear();
        self.obstacles.extend(situation.obstacles().iter().map(obstacle));
        self.aircraft.clear();
        self.aircraft.extend(situation.aircraft().iter().map(aircraft));
        RingwingSituation {
            size_bytes: size_of::<RingwingSituation>(),
            tick: situation.tick.0,
            time_s: situation.time_s(),
            period_s: situation.period_s,
            own: pose(&situation.own),
            sensed: track(situation, &own_track(situation.sensed)),
            limits: limits(&situation.limits),
            neighbours: situation.neighbours.map(|known| neighbour(situation, known.as_ref())),
            leader: leader(situation, situation.leader.as_ref()),
            wind_m_s: vector(situation.wind_m_s),
            slot: slot(situation),
            membership: membership(&situation.membership),
            obstacles: self.obstacles.as_ptr(),
            obstacle_count: self.obstacles.len(),
            aircraft: self.aircraft.as_ptr(),
            aircraft_count: self.aircraft.len(),
            obstacles_omitted: situation.sensed.obstacles_omitted,
            aircraft_omitted: situation.traffic.map_or(0, |traffic| traffic.aircraft_omitted),
            uav: situation.uav.0,
            formation_turns: situation.frame == FormationFrame::Leader,
            senses_aircraft: situation.traffic.is_some(),
            is_commanded: situation.sensed.mode == FlightMode::COMMANDED,
        }
    }
}

impl Controller for Foreign {
    fn step(&mut self, situation: &Situation<'_>) -> Wish {
        let told = self.translated(situation);
        NOTES.set(Some(Notes::default()));
        #[expect(
            unsafe_code,
            reason = "whoever calls ringwing_controller_main promises that this can be called"
        )]
        // SAFETY: what `told` points to lives until the end of this function.
        let wish = unsafe { (self.step)(self.user, &raw const told) };
        let notes = NOTES.take().unwrap_or_default();
        Wish { speed_m_s: wish.speed_m_s, turn_rate_rad_s: wish.turn_rate_rad_s, notes }
    }
}

fn tell_start(
    callback: unsafe extern "C-unwind" fn(*mut c_void, *const RingwingStart),
    user: *mut c_void,
    start: &Start<'_>,
    arguments: *const *mut c_char,
) {
    // TOML allows no zero, so there is always a text.
    let scenario = CString::new(start.scenario.to_toml()).unwrap_or_default();
    let told = RingwingStart {
        size_bytes: size_of::<RingwingStart>(),
        arguments,
        argument_count: start.arguments.len(),
        scenario_toml: scenario.as_ptr(),
        seed: start.scenario.seed,
        period_s: 1.0 / f64::from(start.scenario.time.rate_hz),
        uav: start.uav.0,
        uavs: start.scenario.formation.uavs,
    };
    #[expect(unsafe_code, reason = "whoever calls ringwing_controller_main promises that this can be called")]
    // SAFETY: what `told` points to lives until the end of this function, and the arguments as long as the program.
    unsafe {
        callback(user, &raw const told);
    }
}

fn point(point: Point2<f64>) -> RingwingVector {
    RingwingVector { x: point.x, y: point.y }
}

fn vector(vector: Vector2<f64>) -> RingwingVector {
    RingwingVector { x: vector.x, y: vector.y }
}

pub(crate) fn pose(pose: &Pose) -> RingwingPose {
    RingwingPose { position_m: point(pose.position), heading_rad: pose.heading_rad }
}

fn track(situation: &Situation<'_>, track: &PeerTrack) -> RingwingTrack {
    RingwingTrack {
        tick: track.tick.0,
        age_s: situation.age_s(track.tick),
        pose: pose(&track.pose),
        speed_m_s: track.speed_m_s,
        turn_rate_rad_s: track.turn_rate_rad_s,
    }
}

fn own_track(sensed: &Sensed) -> PeerTrack {
    PeerTrack {
        tick: sensed.tick,
        pose: Pose { position: sensed.position_m.into(), heading_rad: sensed.heading_rad },
        speed_m_s: sensed.speed_m_s,
        turn_rate_rad_s: sensed.turn_rate_rad_s,
    }
}

fn limits(limits: &Limits) -> RingwingLimits {
    RingwingLimits {
        speed_min_m_s: limits.speed_min_m_s(),
        speed_max_m_s: limits.speed_max_m_s(),
        turn_rate_max_rad_s: limits.turn_rate_max_rad_s(),
    }
}

fn neighbour(situation: &Situation<'_>, neighbour: Option<&RingNeighbour<'_>>) -> RingwingNeighbour {
    let Some(RingNeighbour { uav, rest_m, track: newest }) = neighbour else {
        return RingwingNeighbour::default();
    };
    RingwingNeighbour {
        track: newest.map_or_else(RingwingTrack::default, |newest| track(situation, newest)),
        rest_m: *rest_m,
        uav: uav.0,
        is_heard: newest.is_some(),
    }
}

fn leader(situation: &Situation<'_>, leader: Option<&EstimatedLeader>) -> RingwingLeader {
    let is_silent = situation.leader_is_silent;
    let Some(leader) = leader else {
        return RingwingLeader { is_silent, ..RingwingLeader::default() };
    };
    RingwingLeader {
        track: track(situation, &leader.track),
        pose: pose(&leader.pose),
        frame_rad: leader.frame_rad,
        is_heard: true,
        is_silent,
    }
}

fn slot(situation: &Situation<'_>) -> RingwingSlot {
    let fixed = RingwingSlot {
        offset_m: vector(situation.slot_offset_m),
        radius_m: situation.radius_m,
        ..RingwingSlot::default()
    };
    let (Some(position), Some(motion)) = (situation.slot_m(), situation.slot_motion()) else { return fixed };
    RingwingSlot {
        position_m: point(position),
        velocity_m_s: vector(motion.velocity_m_s),
        turn_rate_rad_s: motion.turn_rate_rad_s,
        ..fixed
    }
}

fn membership(membership: &Membership<'_>) -> RingwingMembership {
    RingwingMembership {
        // A `UavId` is a number and nothing else.
        lost: membership.lost.as_ptr().cast(),
        lost_count: membership.lost.len(),
        lost_fingerprint: membership.lost_fingerprint,
        living: membership.living,
        slots_are_moving: membership.slots_are_moving,
    }
}

fn obstacle(sensed: &SensedObstacle) -> RingwingObstacle {
    RingwingObstacle {
        position_m: point(sensed.position_m.into()),
        velocity_m_s: vector(sensed.velocity_m_s.into()),
        radius_m: sensed.radius_m,
        braking_distance_m: sensed.braking_distance_m,
    }
}

fn aircraft(sensed: &SensedAircraft) -> RingwingAircraft {
    let (number, is_intruder) = match sensed.who.who() {
        Aircraft::Uav(uav) => (uav.0, false),
        Aircraft::Intruder(intruder) => (intruder.0, true),
    };
    RingwingAircraft {
        pose: RingwingPose { position_m: point(sensed.position_m.into()), heading_rad: sensed.heading_rad },
        speed_m_s: sensed.speed_m_s,
        turn_rate_rad_s: sensed.turn_rate_rad_s,
        number,
        is_intruder,
        is_answering: sensed.is_answering != 0,
    }
}

#[cfg(test)]
mod tests;
