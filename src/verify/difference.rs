//! Says in words where two messages differ.
//!
//! Never knows a message type itself: the schemas in the logs name the fields.

use prost_reflect::{DescriptorPool, DynamicMessage, ReflectMessage, Value};
use ringwing_flight::UavId;
use ringwing_recorder::log::reader::{LogMessage, TopicSchema};
use std::fmt;

/// The first difference between two logs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference {
    sentence: String,
    /// The UAVs whose messages differ in the tick of the first difference.
    uavs: Vec<UavId>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
    }
}

impl Difference {
    /// The difference between a message of the log and the message that was `flown` in its place. `None` stands for a
    /// log without further messages.
    pub(super) fn between(recorded: Option<&LogMessage>, flown: Option<&LogMessage>) -> Self {
        let tick = |message: &LogMessage| message.tick.map_or_else(|| "?".into(), |tick| tick.to_string());
        let named = |message: &LogMessage| format!("tick {}, {}", tick(message), message.topic.name);
        let sentence = match (recorded, flown) {
            (Some(one), Some(other)) if one.topic.name == other.topic.name => {
                if one.tick == other.tick {
                    format!("{}: {}", named(one), field(one, other))
                } else {
                    format!("{}: the flight has it at tick {}", named(one), tick(other))
                }
            }
            (Some(one), Some(other)) => format!("{}: the flight has {} instead", named(one), named(other)),
            (Some(one), None) => format!("{}: missing from the flight, which is over", named(one)),
            (None, Some(other)) => format!("{}: missing from the log", named(other)),
            (None, None) => "no difference".into(),
        };
        Self { sentence, uavs: Vec::new() }
    }

    /// The same difference, in a tick in which the messages of `uavs` differ.
    pub(super) fn with_uavs(self, uavs: Vec<UavId>) -> Self {
        Self { uavs, ..self }
    }

    /// The UAVs whose messages differ in the tick of the first difference. All that the others decide in this tick is as
    /// before, so these decided otherwise first.
    pub(crate) fn uavs(&self) -> &[UavId] {
        &self.uavs
    }
}

/// The first field that differs, with both values; without a readable schema, the first byte.
fn field(recorded: &LogMessage, flown: &LogMessage) -> String {
    let decoded = |message: &LogMessage| decode(message.topic.schema.as_deref()?, &message.data);
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
        // Protobuf does not write a field that has its default value. Only a field with presence can really be
        // missing.
        match (recorded.has_field(&field), flown.has_field(&field)) {
            (true, false) if field.supports_presence() => {
                Some(format!("{path} is in the log but not in the flight"))
            }
            (false, true) if field.supports_presence() => {
                Some(format!("{path} is in the flight but not in the log"))
            }
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
        // Their entries may have moved, so comparing these one by one would mislead.
        (Value::List(one), Value::List(other)) => {
            Some(format!("{path} has {} entries in the log, {} in the flight", one.len(), other.len()))
        }
        // Compare bits: 0.0 equals -0.0 as a number, and NaN does not equal itself.
        (Value::F64(one), Value::F64(other)) if one.to_bits() == other.to_bits() => None,
        (Value::F64(one), Value::F64(other)) => {
            Some(format!("{path} is {one:?} in the log, {other:?} in the flight"))
        }
        _ if recorded == flown => None,
        _ => Some(format!("{path} is {} in the log, {} in the flight", shown(recorded), shown(flown))),
    }
}

/// Longest text of a value, in characters. A longer one, such as a whole list, would fill the terminal.
const LONGEST: usize = 60;

/// The text of a value, shortened if it is long.
fn shown(value: &Value) -> String {
    let whole = format!("{value:?}");
    let cut: String = whole.chars().take(LONGEST).collect();
    if cut.len() < whole.len() { cut + "..." } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ringwing_recorder::{log::reader::Topic, schema::UavState};
    use std::sync::Arc;

    fn message(tick: i64, x_m: f64) -> LogMessage {
        let schema = <UavState as foxglove::Encode>::get_schema().unwrap();
        let schema = TopicSchema { name: schema.name, encoding: schema.encoding, data: schema.data.to_vec() };
        let topic = Topic { name: "/uav/003/state".into(), schema: Some(Arc::new(schema)) };
        let state = UavState { tick, uav: 3, x_m, ..UavState::default() };
        LogMessage {
            topic: Arc::new(topic),
            tick: Some(tick),
            log_time: 0,
            data: prost::Message::encode_to_vec(&state),
        }
    }

    #[test]
    fn a_field_that_differs_by_one_bit_is_named_with_both_values() {
        let (one, other) = (1.0_f64, f64::from_bits(1.0_f64.to_bits() + 1));
        let difference = Difference::between(Some(&message(7, one)), Some(&message(7, other)));
        assert_eq!(
            difference.to_string(),
            "tick 7, /uav/003/state: x_m is 1.0 in the log, 1.0000000000000002 in the flight"
        );
    }

    #[test]
    fn a_missing_message_is_named() {
        let (one, none) = (message(7, 1.0), None);
        let said = |a: Option<&LogMessage>, b: Option<&LogMessage>| Difference::between(a, b).to_string();
        assert!(said(Some(&one), none).contains("missing from the flight"));
        assert!(said(none, Some(&one)).contains("missing from the log"));
        assert!(said(Some(&one), Some(&message(8, 1.0))).contains("the flight has it at tick 8"));
    }
}
