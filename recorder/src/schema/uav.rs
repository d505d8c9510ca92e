//! The messages about one UAV, every tick: `/uav/001/state`, `/uav/001/control` and `/uav/001/notes`.
//!
//! A frame that is read back from the first two equals the one that was written, to the bit.

use crate::metrics::{AvoidedThing, ControlTerms, MeasuredFlight, TrueState};
use ringwing_flight::{FlightMode, Notes, Pose};

/// Where a UAV is and how it flies, every tick: `/uav/001/state`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct UavState {
    /// The tick; simulated time is tick / rate.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The UAV's number, from 1.
    #[prost(uint32, tag = "2")]
    pub uav: u32,
    /// True position, east.
    #[prost(double, tag = "3")]
    pub x_m: f64,
    /// True position, north.
    #[prost(double, tag = "4")]
    pub y_m: f64,
    /// Heading from the x axis, counterclockwise.
    #[prost(double, tag = "5")]
    pub heading_rad: f64,
    /// Speed flown through the air over the last tick.
    #[prost(double, tag = "6")]
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    #[prost(double, tag = "7")]
    pub turn_rate_rad_s: f64,
    /// True distance to the previous ring neighbour, while both are in the ring and that one is in the sky.
    #[prost(double, optional, tag = "8")]
    pub previous_distance_m: Option<f64>,
    /// True distance to the next ring neighbour, while that one flies.
    #[prost(double, optional, tag = "9")]
    pub next_distance_m: Option<f64>,
    /// True distance to the leader, while there is one.
    #[prost(double, optional, tag = "10")]
    pub leader_distance_m: Option<f64>,
    /// Its slot around the leader's true position, east.
    #[prost(double, optional, tag = "11")]
    pub slot_x_m: Option<f64>,
    /// Its slot around the leader's true position, north.
    #[prost(double, optional, tag = "12")]
    pub slot_y_m: Option<f64>,
    /// Distance from that slot.
    #[prost(double, optional, tag = "13")]
    pub slot_error_m: Option<f64>,
    /// Distance to the centre of the nearest obstacle in sensor range, the d of Eq. (13).
    #[prost(double, optional, tag = "14")]
    pub obstacle_distance_m: Option<f64>,
    /// What controls the airframe: `commanded`, or the name of its failsafe.
    #[prost(string, tag = "15")]
    pub mode: String,
    /// Velocity of the air at the UAV over the last tick, east; absent in still air, like all of the wind.
    #[prost(double, optional, tag = "16")]
    pub wind_x_m_s: Option<f64>,
    /// Velocity of the air, north.
    #[prost(double, optional, tag = "17")]
    pub wind_y_m_s: Option<f64>,
    /// Where the UAV goes over the ground, from the x axis, counterclockwise. In still air that is its heading.
    #[prost(double, optional, tag = "18")]
    pub course_rad: Option<f64>,
    /// Speed over the ground. In still air that is the speed.
    #[prost(double, optional, tag = "19")]
    pub ground_speed_m_s: Option<f64>,
    /// What the UAV's sensors say of its position, east; absent where they tell the truth, like all that they say.
    #[prost(double, optional, tag = "20")]
    pub measured_x_m: Option<f64>,
    /// What they say of its position, north.
    #[prost(double, optional, tag = "21")]
    pub measured_y_m: Option<f64>,
    /// What they say of its heading.
    #[prost(double, optional, tag = "22")]
    pub measured_heading_rad: Option<f64>,
    /// What they say of its speed through the air.
    #[prost(double, optional, tag = "23")]
    pub measured_speed_m_s: Option<f64>,
    /// What they say of its turn rate.
    #[prost(double, optional, tag = "24")]
    pub measured_turn_rate_rad_s: Option<f64>,
}

/// What an agent commanded and the terms behind it, every tick: `/uav/001/control`.
///
/// The terms of `f_i` are rounded to single precision. Commands, repulsion and potential are exact.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
#[expect(clippy::struct_excessive_bools, reason = "four independent facts, each plotted by itself")]
pub struct UavControl {
    /// The tick whose sensed state the command answers.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The UAV's number, from 1.
    #[prost(uint32, tag = "2")]
    pub uav: u32,
    /// The commanded speed `v_i`.
    #[prost(double, tag = "3")]
    pub speed_command_m_s: f64,
    /// The commanded turn rate `omega_i`.
    #[prost(double, tag = "4")]
    pub turn_rate_command_rad_s: f64,
    /// Both neighbours' terms of `f_i`, Eq. (4), east.
    #[prost(double, tag = "5")]
    pub neighbour_force_x_m: f64,
    /// Both neighbours' terms, north.
    #[prost(double, tag = "6")]
    pub neighbour_force_y_m: f64,
    /// The previous neighbour's term, east.
    #[prost(double, tag = "7")]
    pub previous_force_x_m: f64,
    /// The previous neighbour's term, north.
    #[prost(double, tag = "8")]
    pub previous_force_y_m: f64,
    /// The next neighbour's term, east.
    #[prost(double, tag = "9")]
    pub next_force_x_m: f64,
    /// The next neighbour's term, north.
    #[prost(double, tag = "10")]
    pub next_force_y_m: f64,
    /// The formation centre's term of `f_i`, east.
    #[prost(double, tag = "11")]
    pub centre_force_x_m: f64,
    /// The formation centre's term, north.
    #[prost(double, tag = "12")]
    pub centre_force_y_m: f64,
    /// The slot's term of `f_i`, east.
    #[prost(double, tag = "13")]
    pub slot_force_x_m: f64,
    /// The slot's term, north.
    #[prost(double, tag = "14")]
    pub slot_force_y_m: f64,
    /// `f_obs`, Eq. (13), east.
    #[prost(double, tag = "15")]
    pub repulsion_x_m: f64,
    /// `f_obs`, north.
    #[prost(double, tag = "16")]
    pub repulsion_y_m: f64,
    /// The length of `f_obs`.
    #[prost(double, tag = "17")]
    pub repulsion_m: f64,
    /// The potential `F_i`, Eq. (3).
    #[prost(double, tag = "18")]
    pub potential_m2: f64,
    /// Whether Eq. (12) cut the speed.
    #[prost(bool, tag = "19")]
    pub speed_saturated: bool,
    /// Whether Eq. (12) cut the turn rate.
    #[prost(bool, tag = "20")]
    pub turn_rate_saturated: bool,
    /// Age of the previous neighbour's data when they were used; absent if none ever arrived.
    #[prost(double, optional, tag = "21")]
    pub previous_age_s: Option<f64>,
    /// Age of the next neighbour's data.
    #[prost(double, optional, tag = "22")]
    pub next_age_s: Option<f64>,
    /// Age of the leader's data.
    #[prost(double, optional, tag = "23")]
    pub leader_age_s: Option<f64>,
    /// Number of UAVs that the agent considers alive, itself included.
    #[prost(uint32, tag = "24")]
    pub living: u32,
    /// Whether the leader has been silent for longer than the loss timeout, so that the agent follows its predicted path.
    #[prost(bool, tag = "25")]
    pub leader_silent: bool,
    /// Whether the slots still move to their new positions after a loss or a return.
    #[prost(bool, tag = "26")]
    pub slots_moving: bool,
    /// Fingerprint of the UAVs that the agent considers lost: 0 for none, and equal if two agents agree.
    #[prost(uint64, tag = "27")]
    pub lost_fingerprint: u64,
    /// The speed that the law asked for; it differs from the commanded one only while the collision filter acts.
    #[prost(double, tag = "28")]
    pub wish_speed_m_s: f64,
    /// The turn rate that the law asked for.
    #[prost(double, tag = "29")]
    pub wish_turn_rate_rad_s: f64,
    /// The UAV that the collision filter avoids; absent if it avoids something else or does not act.
    #[prost(uint32, optional, tag = "30")]
    pub avoided_uav: Option<u32>,
    /// Where the filter saw what it avoids, east; absent while it does not act.
    #[prost(double, optional, tag = "31")]
    pub avoided_x_m: Option<f64>,
    /// Where the filter saw what it avoids, north.
    #[prost(double, optional, tag = "32")]
    pub avoided_y_m: Option<f64>,
    /// The intruder that the filter avoids.
    #[prost(uint32, optional, tag = "33")]
    pub avoided_intruder: Option<u32>,
    /// How far the heading that the filter takes lies from that of the law's course; positive to the left.
    #[prost(double, optional, tag = "34")]
    pub avoided_turn_rad: Option<f64>,
    /// The agent's estimate of the wind, east; absent while it assumes still air.
    #[prost(double, optional, tag = "35")]
    pub wind_estimate_x_m_s: Option<f64>,
    /// The agent's estimate of the wind, north.
    #[prost(double, optional, tag = "36")]
    pub wind_estimate_y_m_s: Option<f64>,
    /// Where the agent believes that its UAV is, east; absent where that is the truth, like all of this estimate.
    #[prost(double, optional, tag = "37")]
    pub estimate_x_m: Option<f64>,
    /// Where the agent believes that its UAV is, north.
    #[prost(double, optional, tag = "38")]
    pub estimate_y_m: Option<f64>,
    /// Where the agent believes that its UAV heads.
    #[prost(double, optional, tag = "39")]
    pub estimate_heading_rad: Option<f64>,
}

/// What the controller of a UAV noted, in every tick with notes: `/uav/001/notes`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct UavNotes {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The UAV's number, from 1.
    #[prost(uint32, tag = "2")]
    pub uav: u32,
    /// The notes.
    #[prost(message, repeated, tag = "3")]
    pub notes: Vec<Note>,
}

/// A number that a controller noted.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct Note {
    /// Its name. The controller chooses it; if it ends with a unit, as the fields here do, it explains itself.
    #[prost(string, tag = "1")]
    pub name: String,
    /// The number; it may be NaN or infinite.
    #[prost(double, tag = "2")]
    pub value: f64,
}

impl UavNotes {
    /// The message of `notes`.
    pub(crate) fn of(notes: &Notes) -> Self {
        let list = notes.iter().map(|(name, value)| Note { name: name.to_owned(), value }).collect();
        Self { tick: notes.tick.0, uav: notes.uav.0, notes: list }
    }
}

impl UavState {
    /// The message about `state` at `tick`.
    pub(crate) fn of(tick: i64, state: &TrueState) -> Self {
        Self {
            tick,
            uav: state.uav,
            x_m: state.x_m,
            y_m: state.y_m,
            heading_rad: state.heading_rad,
            speed_m_s: state.speed_m_s,
            turn_rate_rad_s: state.turn_rate_rad_s,
            previous_distance_m: state.previous_distance_m,
            next_distance_m: state.next_distance_m,
            leader_distance_m: state.leader_distance_m,
            slot_x_m: state.slot_m.map(|[x, _]| x),
            slot_y_m: state.slot_m.map(|[_, y]| y),
            slot_error_m: state.slot_error_m,
            obstacle_distance_m: state.obstacle_distance_m,
            mode: state.mode.name().into(),
            wind_x_m_s: state.wind_m_s.map(|[x, _]| x),
            wind_y_m_s: state.wind_m_s.map(|[_, y]| y),
            course_rad: state.wind_m_s.map(|_| state.course_rad()),
            ground_speed_m_s: state.wind_m_s.map(|_| state.velocity_m_s().norm()),
            measured_x_m: state.measured.map(|measured| measured.position_m[0]),
            measured_y_m: state.measured.map(|measured| measured.position_m[1]),
            measured_heading_rad: state.measured.map(|measured| measured.heading_rad),
            measured_speed_m_s: state.measured.map(|measured| measured.speed_m_s),
            measured_turn_rate_rad_s: state.measured.map(|measured| measured.turn_rate_rad_s),
        }
    }

    /// The state in this message.
    pub(crate) fn state(&self) -> TrueState {
        TrueState {
            uav: self.uav,
            x_m: self.x_m,
            y_m: self.y_m,
            heading_rad: self.heading_rad,
            speed_m_s: self.speed_m_s,
            turn_rate_rad_s: self.turn_rate_rad_s,
            previous_distance_m: self.previous_distance_m,
            next_distance_m: self.next_distance_m,
            leader_distance_m: self.leader_distance_m,
            slot_m: self.slot_x_m.zip(self.slot_y_m).map(Into::into),
            slot_error_m: self.slot_error_m,
            obstacle_distance_m: self.obstacle_distance_m,
            // A mode that this version does not know reads as `unknown`, and the rest of the state stays usable.
            mode: FlightMode::from_name(&self.mode),
            // Course and ground speed follow from the rest.
            wind_m_s: self.wind_x_m_s.zip(self.wind_y_m_s).map(Into::into),
            measured: self.measured(),
        }
    }

    fn measured(&self) -> Option<MeasuredFlight> {
        Some(MeasuredFlight {
            position_m: [self.measured_x_m?, self.measured_y_m?],
            heading_rad: self.measured_heading_rad?,
            speed_m_s: self.measured_speed_m_s?,
            turn_rate_rad_s: self.measured_turn_rate_rad_s?,
        })
    }
}

impl UavControl {
    /// The message about what the agent of UAV number `uav` commanded at `tick`.
    pub(crate) fn of(tick: i64, uav: u32, control: &ControlTerms) -> Self {
        let [neighbour_force_x_m, neighbour_force_y_m] = control.neighbour_force_m();
        let [previous_force_x_m, previous_force_y_m] = control.previous_force_m;
        let [next_force_x_m, next_force_y_m] = control.next_force_m;
        let [centre_force_x_m, centre_force_y_m] = control.centre_force_m;
        let [slot_force_x_m, slot_force_y_m] = control.slot_force_m;
        let [repulsion_x_m, repulsion_y_m] = control.repulsion_m;
        Self {
            tick,
            uav,
            speed_command_m_s: control.speed_command_m_s,
            turn_rate_command_rad_s: control.turn_rate_command_rad_s,
            neighbour_force_x_m,
            neighbour_force_y_m,
            previous_force_x_m,
            previous_force_y_m,
            next_force_x_m,
            next_force_y_m,
            centre_force_x_m,
            centre_force_y_m,
            slot_force_x_m,
            slot_force_y_m,
            repulsion_x_m,
            repulsion_y_m,
            repulsion_m: control.repulsion_length_m(),
            potential_m2: control.potential_m2,
            speed_saturated: control.speed_saturated,
            turn_rate_saturated: control.turn_rate_saturated,
            previous_age_s: control.previous_age_s,
            next_age_s: control.next_age_s,
            leader_age_s: control.leader_age_s,
            living: control.living,
            leader_silent: control.leader_silent,
            slots_moving: control.slots_moving,
            lost_fingerprint: control.lost_fingerprint,
            wish_speed_m_s: control.wish_speed_m_s,
            wish_turn_rate_rad_s: control.wish_turn_rate_rad_s,
            avoided_uav: control.avoided.and_then(|avoided| avoided.uav),
            avoided_x_m: control.avoided.map(|avoided| avoided.place_m[0]),
            avoided_y_m: control.avoided.map(|avoided| avoided.place_m[1]),
            avoided_intruder: control.avoided.and_then(|avoided| avoided.intruder),
            avoided_turn_rad: control.avoided.map(|avoided| avoided.turn_rad),
            wind_estimate_x_m_s: control.wind_estimate_m_s.map(|[x, _]| x),
            wind_estimate_y_m_s: control.wind_estimate_m_s.map(|[_, y]| y),
            estimate_x_m: control.estimate.map(|estimate| estimate.position.x),
            estimate_y_m: control.estimate.map(|estimate| estimate.position.y),
            estimate_heading_rad: control.estimate.map(|estimate| estimate.heading_rad),
        }
    }

    /// What this message says that the agent commanded.
    pub(crate) fn terms(&self) -> ControlTerms {
        // The sum of the neighbours' terms and the length of the repulsion are only logged for plots: they follow
        // from the rest.
        ControlTerms {
            speed_command_m_s: self.speed_command_m_s,
            turn_rate_command_rad_s: self.turn_rate_command_rad_s,
            previous_force_m: [self.previous_force_x_m, self.previous_force_y_m],
            next_force_m: [self.next_force_x_m, self.next_force_y_m],
            centre_force_m: [self.centre_force_x_m, self.centre_force_y_m],
            slot_force_m: [self.slot_force_x_m, self.slot_force_y_m],
            repulsion_m: [self.repulsion_x_m, self.repulsion_y_m],
            potential_m2: self.potential_m2,
            speed_saturated: self.speed_saturated,
            turn_rate_saturated: self.turn_rate_saturated,
            previous_age_s: self.previous_age_s,
            next_age_s: self.next_age_s,
            leader_age_s: self.leader_age_s,
            living: self.living,
            leader_silent: self.leader_silent,
            slots_moving: self.slots_moving,
            lost_fingerprint: self.lost_fingerprint,
            wish_speed_m_s: self.wish_speed_m_s,
            wish_turn_rate_rad_s: self.wish_turn_rate_rad_s,
            // The place tells whether the filter acts: an obstacle that it avoids has no number.
            avoided: self.avoided_x_m.zip(self.avoided_y_m).map(|(x, y)| AvoidedThing {
                uav: self.avoided_uav,
                intruder: self.avoided_intruder,
                place_m: [x, y],
                turn_rad: self.avoided_turn_rad.unwrap_or_default(),
            }),
            wind_estimate_m_s: self.wind_estimate_x_m_s.zip(self.wind_estimate_y_m_s).map(Into::into),
            estimate: self.estimate(),
        }
    }

    fn estimate(&self) -> Option<Pose> {
        let position = [self.estimate_x_m?, self.estimate_y_m?].into();
        Some(Pose { position, heading_rad: self.estimate_heading_rad? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_frame_comes_back_from_its_messages_to_the_bit() {
        let frame = testing::flight(&testing::ring_of(5, 40.0), 7..8).remove(0);
        for uav in &frame.uavs {
            let (state, control) = (uav.state.unwrap(), uav.control.unwrap());
            assert_eq!(UavState::of(7, &state).state(), state);
            assert_eq!(UavControl::of(7, state.uav, &control).terms(), control);
        }
    }

    #[test]
    fn what_the_filter_avoids_comes_back_from_its_message() {
        for (uav, intruder) in [(None, None), (Some(4), None), (None, Some(1))] {
            let avoided = Some(AvoidedThing { uav, intruder, place_m: [3.0, -4.0], turn_rad: -0.5 });
            let control = ControlTerms { wish_speed_m_s: 17.0, avoided, ..ControlTerms::default() };
            assert_eq!(UavControl::of(7, 3, &control).terms(), control);
        }
    }

    #[test]
    fn the_wind_and_what_the_agent_takes_it_for_come_back_and_the_course_is_logged_with_them() {
        let mut frame = testing::at_rest(&testing::ring_of(3, 40.0), 7);
        let state = frame.uavs[0].state.as_mut().unwrap();
        // East at 15 m/s in a wind of 20 m/s to the north: the triangle of 3, 4 and 5.
        state.wind_m_s = Some([0.0, 20.0]);
        let message = UavState::of(7, state);
        assert!((message.ground_speed_m_s.unwrap() - 25.0).abs() < 1e-12);
        assert!((message.course_rad.unwrap() - (20.0_f64 / 15.0).atan()).abs() < 1e-12);
        assert_eq!(message.state(), *state);
        let control = ControlTerms { wind_estimate_m_s: Some([1.0, 18.5]), ..ControlTerms::default() };
        assert_eq!(UavControl::of(7, 1, &control).terms(), control);
    }

    #[test]
    fn what_sensors_say_and_agents_believe_comes_back() {
        let mut frame = testing::at_rest(&testing::ring_of(3, 40.0), 7);
        let state = frame.uavs[0].state.as_mut().unwrap();
        state.measured = Some(MeasuredFlight {
            position_m: [1.0, -2.0],
            heading_rad: 0.1,
            speed_m_s: 14.5,
            turn_rate_rad_s: 0.01,
        });
        assert_eq!(UavState::of(7, state).state(), *state);
        let estimate = Some(Pose { position: [3.0, 4.0].into(), heading_rad: -0.1 });
        let control = ControlTerms { estimate, ..ControlTerms::default() };
        assert_eq!(UavControl::of(7, 1, &control).terms(), control);
    }

    #[test]
    fn the_length_of_the_repulsion_is_logged_with_it() {
        let control = ControlTerms { repulsion_m: [3.0, -4.0], ..ControlTerms::default() };
        let message = UavControl::of(7, 3, &control);
        assert_eq!((message.tick, message.uav, message.repulsion_m), (7, 3, 5.0));
    }
}
