//! The manual's list of what is in a log: every topic, and every field of ringwing's own messages.

use super::{
    check_part, root,
    rust_docs::{Documented, Field, documented},
};
use ringwing_recorder::schema::topics::{self, UavTopic};
use std::{collections::BTreeMap, fmt::Write, fs};

/// The units that the names of fields end in; the first match counts.
const UNITS: [(&str, &str); 9] = [
    ("_m_s", "m/s"),
    ("_rad_s", "rad/s"),
    ("_m2", "m²"),
    ("_rad", "rad"),
    ("_deg", "degrees"),
    ("_us", "µs"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
];

#[test]
fn the_manual_names_every_topic_of_the_log() {
    let page = fs::read_to_string(root().join("docs/src/log.md")).unwrap();
    let of_uavs = [UavTopic::Control, UavTopic::Notes, UavTopic::State].map(|topic| topic.name(1, 6));
    for topic in topics::ALL.into_iter().chain(of_uavs.iter().map(String::as_str)) {
        assert!(page.contains(&format!("`{topic}`")), "{topic} is not in docs/src/log.md");
    }
}

#[test]
fn the_manual_lists_every_field_of_the_log() {
    let types = documented(&[&root().join("recorder/src/schema")]);
    // The list of all messages that other programs rely on.
    let golden = fs::read_to_string(root().join("recorder/src/schema.golden")).unwrap();
    let mut text = String::new();
    for schema in golden.lines().filter_map(|line| line.strip_prefix("protobuf ")) {
        let name = schema.split('.').next_back().unwrap();
        message(&types, schema, name, &mut text);
    }
    check_part("log.md", "fields", &text);
}

/// Adds the table of a message, and then those of the messages within it.
fn message(types: &BTreeMap<String, Documented>, title: &str, name: &str, text: &mut String) {
    let Some(Documented::Struct { doc, fields }) = types.get(name) else { panic!("no struct {name}") };
    writeln!(text, "### `{title}`\n\n{doc}\n\n| field | unit | meaning |\n| --- | --- | --- |").unwrap();
    for field in fields {
        writeln!(text, "| `{}` | {} | {} |", field.name, unit(field), meaning(field)).unwrap();
    }
    text.push('\n');
    for field in fields {
        let inner = field.kind.trim_start_matches("Vec<").trim_end_matches('>');
        if types.contains_key(inner) {
            message(types, inner, inner, text);
        }
    }
}

fn unit(field: &Field) -> &'static str {
    UNITS.iter().find(|(suffix, _)| field.name.ends_with(suffix)).map_or("", |(_, unit)| unit)
}

fn meaning(field: &Field) -> String {
    let list = if field.kind.starts_with("Vec<") { "A list. " } else { "" };
    let doc = field.doc.replace('|', "\\|").replace("[`", "`").replace("`]", "`");
    // Most optional fields say when they are absent.
    let is_silent = field.kind.starts_with("Option<") && !doc.contains("absent") && !doc.contains("while");
    let absent = if is_silent { " May be absent." } else { "" };
    format!("{list}{doc}{absent}")
}
