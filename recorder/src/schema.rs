//! What the log consists of: its [`topics`], and ringwing's own protobuf messages.
//!
//! Other programs rely on the names and the numbers of the fields. A message is called after its Rust type
//! (`uavstate.UavState`), so these types keep their names; field numbers follow the declaration, and a new field goes to
//! the end. `foxglove` encodes and describes the messages, and `prost` decodes them again.

mod event;
mod run;
mod swarm;
pub mod topics;
mod uav;

pub use event::LoggedEvent;
pub(crate) use event::{EventWriter, log_line};
pub use run::{Faults, LinkCounts, Timing, TimingPercentiles};
pub(crate) use swarm::rounded;
pub use swarm::{SwarmMetrics, SwarmState, SwarmUav};
pub use uav::{Note, UavControl, UavNotes, UavState};

#[cfg(test)]
mod tests {
    use super::*;
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
            outline::<UavNotes>(),
            outline::<Timing>(),
            outline::<TimingPercentiles>(),
            outline::<Faults>(),
            outline::<LinkCounts>(),
            outline::<SwarmMetrics>(),
            outline::<SwarmState>(),
            outline::<LoggedEvent>(),
        ]
        .join("\n");
        assert_eq!(outlines, include_str!("schema.golden").trim_end());
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
