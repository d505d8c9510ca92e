//! The manual's list of every scenario key: unit, default, bounds and meaning, from the model itself.

use super::{
    bounds::Example,
    check_part, root,
    rust_docs::{Documented, Field, documented},
};
use ringwing_scenario::{Scenario, Setting, Source, unit_symbol};
use std::{collections::BTreeMap, fmt::Write};

/// Everything that the list is made of.
struct Reference {
    types: BTreeMap<String, Documented>,
    example: Example,
    /// The values of a scenario that says nothing, and of one that only asks for the resilient law.
    paper: toml::Table,
    resilient: toml::Table,
    text: String,
}

#[test]
fn the_manual_lists_every_key_of_a_scenario() {
    let mut reference = Reference {
        types: documented(&[&root().join("scenario/src/model"), &root().join("flight/src")]),
        example: Example::new(),
        paper: values(&[]),
        resilient: values(&["control.law=resilient"]),
        text: String::new(),
    };
    reference.section("Scenario", "", false);
    for key in ringwing_scenario::keys() {
        let name = key.rsplit('.').next().unwrap();
        assert!(reference.text.contains(&format!("\n| `{name}` |")), "{key} is missing");
    }
    check_part("scenario.md", "keys", &reference.text);
}

fn values(settings: &[&str]) -> toml::Table {
    let settings: Vec<_> = settings.iter().map(|setting| Setting::parse(setting).unwrap()).collect();
    let source = Source { name: "nothing".into(), text: String::new() };
    Scenario::read(&source, &settings).unwrap().to_toml().parse().unwrap()
}

impl Reference {
    /// Adds the table of the section `path`, whose struct is `name`, and then the sections within it.
    fn section(&mut self, name: &str, path: &str, is_list: bool) {
        let Some(Documented::Struct { doc, fields }) = self.types.get(name) else {
            panic!("no struct {name}")
        };
        let title = match (path, is_list) {
            ("", _) => "At the top of the file".into(),
            (path, true) => format!("`[[{path}]]`"),
            (path, false) => format!("`[{path}]`"),
        };
        let (own, inner): (Vec<_>, Vec<_>) = fields.iter().partition(|field| self.inner(field).is_none());
        let rows: Vec<String> = own.into_iter().map(|field| self.row(field, path, is_list)).collect();
        let inner: Vec<_> =
            inner.into_iter().map(|field| (join(path, &field.name), self.inner(field).unwrap())).collect();
        let head = "| key | unit | default | allowed | meaning |\n| --- | --- | --- | --- | --- |";
        // The documentation of a section begins with its name.
        let intro = plain(doc);
        let intro = intro.split_once("]`: ").map_or(intro.clone(), |(_, text)| capitalised(text));
        // Without keys of its own, a section only groups others.
        if !rows.is_empty() {
            writeln!(self.text, "### {title}\n\n{intro}\n\n{head}\n{}\n", rows.join("\n")).unwrap();
        }
        for (path, (name, is_list)) in inner {
            self.section(&name, &path, is_list);
        }
    }

    /// The struct of a field that is a section, and whether it is a list of them.
    fn inner(&self, field: &Field) -> Option<(String, bool)> {
        let bare = |kind: &str, of: &str| Some(kind.strip_prefix(of)?.strip_suffix('>')?.to_owned());
        let kind = bare(&field.kind, "Option<").unwrap_or_else(|| field.kind.clone());
        let (kind, is_list) = bare(&kind, "Vec<").map_or((kind, false), |kind| (kind, true));
        matches!(self.types.get(&kind), Some(Documented::Struct { .. })).then_some((kind, is_list))
    }

    fn row(&self, field: &Field, path: &str, is_list: bool) -> String {
        let key = join(&if is_list { format!("{path}.0") } else { path.into() }, &field.name);
        let unit = unit_symbol(&key).unwrap_or_default();
        let default = if is_list { default_in_list(field) } else { self.default(&key) };
        let meaning = [plain(&field.doc), self.variants(field)].concat();
        format!("| `{}` | {unit} | {default} | {} | {meaning} |", field.name, self.allowed(field, &key))
    }

    /// The value of a scenario that says nothing; where the law decides, that of each law.
    fn default(&self, key: &str) -> String {
        match (find(&self.paper, key), find(&self.resilient, key)) {
            // The law itself is what differs between the two.
            (Some(paper), Some(resilient)) if paper == resilient || key == "control.law" => {
                format!("`{paper}`")
            }
            (Some(paper), Some(resilient)) => format!("`{paper}`; resilient law: `{resilient}`"),
            _ => "none".into(),
        }
    }

    fn allowed(&self, field: &Field, key: &str) -> String {
        let kind = field.kind.trim_start_matches("Option<").trim_end_matches('>');
        match kind {
            "f64" => self.example.bounds(key, false),
            "u32" | "u64" => self.example.bounds(key, true),
            "bool" => "`true`, `false`".into(),
            "String" => "text".into(),
            "[f64;2]" => "two numbers".into(),
            "Vec<String" => "texts".into(),
            "Vec<Fault" | "Vec<Fault>" => "see [Faults](faults.md)".into(),
            _ => match self.types.get(kind) {
                Some(Documented::Enum(variants)) => {
                    let names = variants.iter().map(|(name, _)| format!("`\"{name}\"`"));
                    names.collect::<Vec<_>>().join(", ")
                }
                _ => String::new(),
            },
        }
    }

    /// What each value of an enum means.
    fn variants(&self, field: &Field) -> String {
        let kind = field.kind.trim_start_matches("Option<").trim_end_matches('>');
        let Some(Documented::Enum(variants)) = self.types.get(kind) else { return String::new() };
        let each = variants.iter().map(|(name, doc)| format!("<br>`{name}`: {}", plain(doc)));
        each.collect()
    }
}

/// Documentation without links to items of the code: a section's struct becomes the section's name.
fn plain(doc: &str) -> String {
    let mut text = String::new();
    let mut rest = doc;
    while let Some((before, link)) = rest.split_once("[`") {
        let Some((item, after)) = link.split_once("`]") else { break };
        let after =
            after.strip_prefix('(').and_then(|to| to.split_once(')')).map_or(after, |(_, after)| after);
        write!(text, "{before}`{}`", key_of(item)).unwrap();
        rest = after;
    }
    (text + rest).replace('|', "\\|")
}

fn default_in_list(field: &Field) -> String {
    if field.has_default || field.kind.starts_with("Option<") { "may be left out" } else { "required" }.into()
}

/// `SafetySection` as `[safety]`, `ControlSection::ring_closes` as `control.ring_closes`.
fn key_of(item: &str) -> String {
    let (name, field) = item.split_once("::").unwrap_or((item, ""));
    let Some(section) = name.strip_suffix("Section") else { return item.into() };
    let section = section.to_lowercase();
    if field.is_empty() { format!("[{section}]") } else { format!("{section}.{field}") }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.into() } else { format!("{path}.{name}") }
}

fn find(table: &toml::Table, key: &str) -> Option<toml::Value> {
    let mut value = toml::Value::Table(table.clone());
    for part in key.split('.') {
        value = value.get(part)?.clone();
    }
    Some(value)
}
