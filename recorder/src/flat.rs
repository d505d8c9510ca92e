//! Flattens nested results into one level, for metadata and for comparisons.

use serde_json::Value;
use std::collections::BTreeMap;

/// The numbers, texts and flags in `value`, each under its path: `uavs.0.slot_error_m`. Nulls are left out.
pub fn flattened(value: &Value) -> BTreeMap<String, Value> {
    let mut leaves = BTreeMap::new();
    collect("", value, &mut leaves);
    leaves
}

fn collect(path: &str, value: &Value, leaves: &mut BTreeMap<String, Value>) {
    let member = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    match value {
        // MCAP metadata maps strings to strings: a null could only become the text "null", which readers would take
        // for a value.
        Value::Null => {}
        Value::Object(members) => {
            members.iter().for_each(|(name, value)| collect(&member(name), value, leaves));
        }
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                collect(&member(&index.to_string()), value, leaves);
            }
        }
        leaf => drop(leaves.insert(path.to_owned(), leaf.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn leaves_are_named_by_their_path_and_nulls_are_left_out() {
        let leaves = flattened(&json!({ "a": 1, "b": [{ "c": "x" }, { "c": null }], "d": { "e": true } }));
        let expected = [("a", json!(1)), ("b.0.c", json!("x")), ("d.e", json!(true))];
        assert_eq!(leaves, expected.map(|(path, value)| (path.to_owned(), value)).into());
    }
}
