//! Where two messages differ, in words.
//!
//! Knows no message by itself: fields are named by the descriptions in the logs.

use prost_reflect::{DescriptorPool, DynamicMessage, ReflectMessage, Value};
use ringwing_recorder::log::reader::{Message, TopicSchema};
use std::fmt;

/// The first difference of two logs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference(String);

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Difference {
    /// Of a message in the log and what was `flown` in its place.
    pub(super) fn between(recorded: Option<&Message>, flown: Option<&Message>) -> Self {
        let named = |message: &Message| format!("tick {}, {}", message.sequence, message.topic.name);
        Self(match (recorded, flown) {
            (Some(one), Some(other)) if one.topic.topic == other.topic.topic => {
                if one.sequence == other.sequence {
                    format!("{}: {}", named(one), field(one, other))
                } else {
                    format!("{}: was flown at tick {}", named(one), other.sequence)
                }
            }
            (Some(one), Some(other)) => format!("{}: instead of it came {}", named(one), named(other)),
            (Some(one), None) => format!("{}: is not flown, the flight is over", named(one)),
            (None, Some(other)) => format!("{}: is flown and not in the log", named(other)),
            (None, None) => "none".into(),
        })
    }
}

/// The first field that differs, with both values.
fn field(recorded: &Message, flown: &Message) -> String {
    let decoded = |message: &Message| decode(message.topic.schema.as_deref()?, &message.data);
    let difference = match (decoded(recorded), decoded(flown)) {
        (Some(one), Some(other)) => first_of_messages("", &one, &other),
        _ => None,
    };
    difference.unwrap_or_else(|| {
        let at = recorded.data.iter().zip(&flown.data).take_while(|(one, other)| one == other).count();
        format!("byte {at} of its encoding")
    })
}

fn decode(schema: &TopicSchema, data: &[u8]) -> Option<DynamicMessage> {
    let pool = DescriptorPool::decode(schema.data.as_slice()).ok()?;
    DynamicMessage::decode(pool.get_message_by_name(&schema.name)?, data).ok()
}

fn first_of_messages(path: &str, recorded: &DynamicMessage, flown: &DynamicMessage) -> Option<String> {
    recorded.descriptor().fields().find_map(|field| {
        let path = if path.is_empty() { field.name().to_owned() } else { format!("{path}.{}", field.name()) };
        match (recorded.has_field(&field), flown.has_field(&field)) {
            (true, false) if field.supports_presence() => Some(format!("{path} is recorded and not flown")),
            (false, true) if field.supports_presence() => Some(format!("{path} is flown and not recorded")),
            _ => first_of_values(&path, &recorded.get_field(&field), &flown.get_field(&field)),
        }
    })
}

fn first_of_values(path: &str, recorded: &Value, flown: &Value) -> Option<String> {
    match (recorded, flown) {
        (Value::Message(one), Value::Message(other)) => first_of_messages(path, one, other),
        (Value::List(one), Value::List(other)) if one.len() == other.len() => {
            let mut both = one.iter().zip(other).enumerate();
            both.find_map(|(index, (one, other))| first_of_values(&format!("{path}.{index}"), one, other))
        }
        (Value::List(one), Value::List(other)) => {
            Some(format!("{path} has {} entries, flown {}", one.len(), other.len()))
        }
        // To the bit: -0 is not 0, and no number is itself.
        (Value::F64(one), Value::F64(other)) if one.to_bits() == other.to_bits() => None,
        (Value::F64(one), Value::F64(other)) => Some(format!("{path} is {one:?}, flown {other:?}")),
        _ if recorded == flown => None,
        _ => Some(format!("{path} is {}, flown {}", shown(recorded), shown(flown))),
    }
}

/// A value, cut where it is longer than a line.
fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    let whole = format!("{value:?}");
    let cut: String = whole.chars().take(LONGEST).collect();
    if cut.len() < whole.len() { cut + "..." } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_recorder::{log::reader::Topic, schema::UavState};
    use std::rc::Rc;

    fn message(tick: i64, x_m: f64) -> Message {
        let schema = <UavState as foxglove::Encode>::get_schema().unwrap();
        let schema = TopicSchema { name: schema.name, encoding: schema.encoding, data: schema.data.to_vec() };
        let topic = Topic { name: "/uav/003/state".into(), schema: Some(Rc::new(schema)) };
        let state = UavState { tick, uav: 3, x_m, ..UavState::default() };
        Message {
            topic: Rc::new(topic),
            sequence: tick as u32,
            log_time: 0,
            data: prost::Message::encode_to_vec(&state),
        }
    }

    #[test]
    fn a_single_bit_is_named_with_both_values() {
        let (one, other) = (1.0_f64, f64::from_bits(1.0_f64.to_bits() + 1));
        let difference = Difference::between(Some(&message(7, one)), Some(&message(7, other)));
        assert_eq!(difference.to_string(), "tick 7, /uav/003/state: x_m is 1.0, flown 1.0000000000000002");
    }

    #[test]
    fn what_is_missing_is_named() {
        let (one, none) = (message(7, 1.0), None);
        let said = |a: Option<&Message>, b: Option<&Message>| Difference::between(a, b).to_string();
        assert!(said(Some(&one), none).contains("the flight is over"));
        assert!(said(none, Some(&one)).contains("not in the log"));
        assert!(said(Some(&one), Some(&message(8, 1.0))).contains("was flown at tick 8"));
    }
}
