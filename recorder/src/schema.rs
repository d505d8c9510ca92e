//! The messages of the log that are ours, and how a tick becomes them.
//!
//! Other programs rely on the names and on the numbers of the fields: they follow the declaration, a new field goes to
//! the end. `foxglove` encodes and describes them, `prost` decodes them again.

use crate::clock::Clock;
use foxglove::messages::{Pose, PoseInFrame, Quaternion, Vector3};
use ringwing_flight::{Account, LeaderState, TickTiming};

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
    /// Speed flown over the last tick.
    #[prost(double, tag = "6")]
    pub speed_m_s: f64,
    /// Turn rate flown over the last tick.
    #[prost(double, tag = "7")]
    pub turn_rate_rad_s: f64,
    /// True distance to the ring neighbour before, while that one flies.
    #[prost(double, optional, tag = "8")]
    pub previous_distance_m: Option<f64>,
    /// True distance to the ring neighbour after, while that one flies.
    #[prost(double, optional, tag = "9")]
    pub next_distance_m: Option<f64>,
    /// True distance to the leader, while there is one.
    #[prost(double, optional, tag = "10")]
    pub leader_distance_m: Option<f64>,
    /// The slot that the law gives it at the leader's true position, east.
    #[prost(double, optional, tag = "11")]
    pub slot_x_m: Option<f64>,
    /// The same, north.
    #[prost(double, optional, tag = "12")]
    pub slot_y_m: Option<f64>,
    /// Distance from that slot.
    #[prost(double, optional, tag = "13")]
    pub slot_error_m: Option<f64>,
    /// Distance to the centre of the nearest obstacle sensed, the d of Eq. (13).
    #[prost(double, optional, tag = "14")]
    pub obstacle_distance_m: Option<f64>,
    /// Who flies the airframe: `commanded`, or the failsafe's name.
    #[prost(string, tag = "15")]
    pub mode: String,
}

/// What an agent asked of its airframe and how that came about, every tick: `/uav/001/control`.
///
/// The terms of `f_i` are rounded to single precision; commands, repulsion and potential are as they were, to the bit.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
#[expect(clippy::struct_excessive_bools, reason = "each is told for itself, as viewers plot it")]
pub struct UavControl {
    /// The tick whose senses it answers.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The UAV's number, from 1.
    #[prost(uint32, tag = "2")]
    pub uav: u32,
    /// `v_i`.
    #[prost(double, tag = "3")]
    pub speed_command_m_s: f64,
    /// `omega_i`.
    #[prost(double, tag = "4")]
    pub turn_rate_command_rad_s: f64,
    /// Both neighbours' terms of `f_i`, Eq. (4), east.
    #[prost(double, tag = "5")]
    pub neighbour_force_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "6")]
    pub neighbour_force_y_m: f64,
    /// The neighbour before alone, east.
    #[prost(double, tag = "7")]
    pub previous_force_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "8")]
    pub previous_force_y_m: f64,
    /// The neighbour after alone, east.
    #[prost(double, tag = "9")]
    pub next_force_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "10")]
    pub next_force_y_m: f64,
    /// The formation centre's term of `f_i`, east.
    #[prost(double, tag = "11")]
    pub centre_force_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "12")]
    pub centre_force_y_m: f64,
    /// The slot's term of `f_i`, east.
    #[prost(double, tag = "13")]
    pub slot_force_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "14")]
    pub slot_force_y_m: f64,
    /// `f_obs`, Eq. (13), east.
    #[prost(double, tag = "15")]
    pub repulsion_x_m: f64,
    /// The same, north.
    #[prost(double, tag = "16")]
    pub repulsion_y_m: f64,
    /// Its length.
    #[prost(double, tag = "17")]
    pub repulsion_m: f64,
    /// `F_i`, Eq. (3).
    #[prost(double, tag = "18")]
    pub potential_m2: f64,
    /// Eq. (12) cut the speed.
    #[prost(bool, tag = "19")]
    pub speed_saturated: bool,
    /// Eq. (12) cut the turn rate.
    #[prost(bool, tag = "20")]
    pub turn_rate_saturated: bool,
    /// Age of the data of the neighbour before when they were used; none if it was never heard.
    #[prost(double, optional, tag = "21")]
    pub previous_age_s: Option<f64>,
    /// The same of the neighbour after.
    #[prost(double, optional, tag = "22")]
    pub next_age_s: Option<f64>,
    /// The same of the leader.
    #[prost(double, optional, tag = "23")]
    pub leader_age_s: Option<f64>,
    /// How many UAVs it holds for living, itself among them.
    #[prost(uint32, tag = "24")]
    pub living: u32,
    /// Goes on along the path of a leader that it has not heard for longer than the loss timeout.
    #[prost(bool, tag = "25")]
    pub leader_silent: bool,
    /// The slots move to the places that a loss or a return gave them.
    #[prost(bool, tag = "26")]
    pub slots_moving: bool,
    /// Stands for those whom it holds for lost: 0 for none, and equal where two UAVs agree.
    #[prost(uint64, tag = "27")]
    pub lost_fingerprint: u64,
}

/// How long a tick took and where, by the wall clock, every tick: `/timing`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct Timing {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// From the opening of the tick to the last answer.
    #[prost(double, tag = "2")]
    pub round_trip_us: f64,
    /// From the opening to the moment the last agent saw it.
    #[prost(double, tag = "3")]
    pub wake_us: f64,
    /// The longest an agent took to read its inputs.
    #[prost(double, tag = "4")]
    pub read_us: f64,
    /// The longest an agent took to compute and publish.
    #[prost(double, tag = "5")]
    pub compute_us: f64,
    /// The longest from an agent's answer to the world's reading it.
    #[prost(double, tag = "6")]
    pub return_us: f64,
    /// How late the tick was opened against its deadline.
    #[prost(double, tag = "7")]
    pub late_us: f64,
    /// Airframes whose command of this tick arrived in time.
    #[prost(uint32, tag = "8")]
    pub answered: u32,
    /// Airframes that flew on an older command.
    #[prost(uint32, tag = "9")]
    pub reused: u32,
    /// Deadlines missed by a whole period or more.
    #[prost(uint32, tag = "10")]
    pub missed_deadlines: u32,
}

impl UavControl {
    /// The record of `account`, from the agent of UAV number `uav` at `rate_hz` ticks a second.
    pub(crate) fn of(uav: u32, account: &Account, rate_hz: u32) -> Self {
        let age_s = |ticks: u32| f64::from(ticks) / f64::from(rate_hz);
        let [previous_x, previous_y] = account.previous_force_m.map(single);
        let [next_x, next_y] = account.next_force_m.map(single);
        let [centre_x, centre_y] = account.centre_force_m.map(single);
        let [slot_x, slot_y] = account.slot_force_m.map(single);
        let [repulsion_x, repulsion_y] = account.repulsion_m;
        Self {
            tick: account.tick.0,
            uav,
            speed_command_m_s: account.speed_m_s,
            turn_rate_command_rad_s: account.turn_rate_rad_s,
            neighbour_force_x_m: single(previous_x + next_x),
            neighbour_force_y_m: single(previous_y + next_y),
            previous_force_x_m: previous_x,
            previous_force_y_m: previous_y,
            next_force_x_m: next_x,
            next_force_y_m: next_y,
            centre_force_x_m: centre_x,
            centre_force_y_m: centre_y,
            slot_force_x_m: slot_x,
            slot_force_y_m: slot_y,
            repulsion_x_m: repulsion_x,
            repulsion_y_m: repulsion_y,
            repulsion_m: repulsion_x.hypot(repulsion_y),
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
        }
    }
}

/// A force as the log has it: the mantissa of a single, whose remaining zeros compress away; a third of the file otherwise.
fn single(force_m: f64) -> f64 {
    f64::from(force_m as f32)
}

impl From<&TickTiming> for Timing {
    fn from(timing: &TickTiming) -> Self {
        let us = |ns: u64| ns as f64 / 1e3;
        Self {
            tick: timing.tick,
            round_trip_us: us(timing.round_trip_ns),
            wake_us: us(timing.wake_ns),
            read_us: us(timing.read_ns),
            compute_us: us(timing.compute_ns),
            return_us: us(timing.return_ns),
            late_us: us(timing.late_ns),
            answered: timing.answered,
            reused: timing.reused,
            missed_deadlines: timing.missed_deadlines,
        }
    }
}

/// The leader's place and heading for viewers: `/leader/pose`.
pub(crate) fn leader_pose(leader: &LeaderState, clock: Clock) -> PoseInFrame {
    let [x, y] = leader.position_m;
    let (sin, cos) = (leader.heading_rad / 2.0).sin_cos();
    let pose = Pose {
        position: Some(Vector3 { x, y, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: sin, w: cos }),
    };
    PoseInFrame { timestamp: Some(clock.timestamp(leader.tick.0)), frame_id: "map".into(), pose: Some(pose) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        events::LoggedEvent,
        faults::Faults,
        show::{
            links::LinkCounts,
            swarm::{SwarmMetrics, SwarmState},
        },
    };
    use foxglove::{
        Encode,
        prost_types::{FileDescriptorSet, field_descriptor_proto::Type},
    };
    use proptest::prelude::*;
    use prost::Message;

    /// Each field as `number type name`, with a question mark after the type where it may be absent.
    fn outline<T: Encode>() -> String {
        let schema = T::get_schema().unwrap();
        let files = FileDescriptorSet::decode(&*schema.data).unwrap();
        let mut lines = vec![format!("{} {}", schema.encoding, schema.name)];
        lines.extend(files.file[0].message_type[0].field.iter().map(|field| {
            let kind =
                Type::try_from(field.r#type.unwrap()).unwrap().as_str_name()["TYPE_".len()..].to_lowercase();
            let optional = if field.proto3_optional == Some(true) { "?" } else { "" };
            format!("{} {kind}{optional} {}", field.number.unwrap(), field.name.as_ref().unwrap())
        }));
        lines.join("\n")
    }

    #[test]
    fn other_programs_find_the_fields_where_they_were() {
        let outlines = [
            outline::<UavState>(),
            outline::<UavControl>(),
            outline::<Timing>(),
            outline::<Faults>(),
            outline::<LinkCounts>(),
            outline::<SwarmMetrics>(),
            outline::<SwarmState>(),
            outline::<LoggedEvent>(),
        ]
        .join("\n");
        assert_eq!(outlines, include_str!("schema.golden").trim_end());
    }

    #[test]
    fn what_an_agent_never_heard_has_no_age() {
        let account = Account { repulsion_m: [3.0, -4.0], ..crate::testing::account(7, 3) };
        let control = UavControl::of(3, &account, 100);
        assert_eq!((control.tick, control.uav, control.repulsion_m), (7, 3, 5.0));
        assert_eq!((control.previous_age_s, control.leader_age_s), (None, None));
    }

    proptest! {
        #[test]
        fn a_message_is_decoded_as_it_was_encoded(
            tick in 0..i64::MAX, uav: u32, x in -1e9..1e9_f64, slot in proptest::option::of(-1e9..1e9_f64), cut: bool,
        ) {
            let state = UavState { tick, uav, x_m: x, slot_y_m: slot, mode: "loiter".into(), ..UavState::default() };
            let control = UavControl {
                tick, uav, speed_saturated: cut, leader_age_s: slot, potential_m2: x, ..UavControl::default()
            };
            let timing = Timing { tick, late_us: x, missed_deadlines: uav, ..Timing::default() };
            prop_assert_eq!(&state, &UavState::decode(&*encoded(&state)).unwrap());
            prop_assert_eq!(&control, &UavControl::decode(&*encoded(&control)).unwrap());
            prop_assert_eq!(&timing, &Timing::decode(&*encoded(&timing)).unwrap());
        }
    }

    fn encoded(message: &impl Encode) -> Vec<u8> {
        let mut bytes = Vec::new();
        message.encode(&mut bytes).unwrap();
        bytes
    }
}
