//! The built-in scenarios, each a commented file that can serve as a template.

/// A built-in scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Its name on the command line, which is also that of its file.
    pub name: &'static str,
    /// What it shows, in one line.
    pub description: &'static str,
    /// Its TOML, with a comment on every key.
    pub text: &'static str,
}

/// A preset whose file has the same name. The description is repeated here so that a list needs no parsing; a test
/// keeps the two equal.
macro_rules! preset {
    ($name:literal, $description:literal) => {
        Preset {
            name: $name,
            description: $description,
            text: include_str!(concat!("../presets/", $name, ".toml")),
        }
    };
}

/// In the order in which `scenario list` shows them.
static PRESETS: [Preset; 16] = [
    preset!("paper-4.1", "six UAVs form the ring in free sky and keep it (Section 4.1)"),
    preset!("paper-4.2", "six UAVs form the ring and fly past two obstacles (Section 4.2)"),
    preset!("vee", "nine UAVs form a vee from drawn starts"),
    preset!("shape-change", "six UAVs fly as a ring, a vee, an echelon, and a ring again"),
    preset!("dropout", "one UAV drops out for good, and the ring closes"),
    preset!("dropout-return", "two UAVs drop out one after the other, and both come back"),
    preset!("delay", "what ring neighbours send each other arrives half a second late"),
    preset!("lossy", "links lose samples singly and in bursts, repeat and reorder them"),
    preset!("partition", "two halves of the swarm cannot hear each other, then reunite"),
    preset!("leader-loss", "the leader is gone for 20 s and comes back"),
    preset!("storm", "half a minute of kills, freezes, loss, delay and a partition"),
    preset!("field", "six UAVs cross a field of 20 obstacles that the seed draws"),
    preset!("traffic", "six UAVs among two obstacles that move and three intruders"),
    preset!("racetrack", "the ring turns with a leader that flies a racetrack"),
    preset!("gusts", "six UAVs form the ring in a wind of 6 m/s with moderate gusts"),
    preset!("sensors", "six UAVs in wind and gusts with the sensors of a small autopilot"),
];

/// All presets, in the order in which to list them.
pub fn all() -> &'static [Preset] {
    &PRESETS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scenario, Source, key, read};
    use toml::{Table, Value};

    fn scenario(preset: &Preset) -> Scenario {
        Scenario::read(&Source::find(preset.name).unwrap(), &[]).unwrap()
    }

    /// The presets that show every key. The others show only the keys that they change.
    fn templates() -> impl Iterator<Item = &'static Preset> {
        all().iter().filter(|preset| preset.name.starts_with("paper"))
    }

    /// Every key of `table`; those of listed sections count once.
    fn keys(table: &Table, section: &str) -> Vec<String> {
        let inner = |(name, value): (&String, &Value)| {
            let key = key::join(section, name);
            match value {
                Value::Table(table) => keys(table, &key),
                Value::Array(list) if list.iter().any(Value::is_table) => {
                    list.iter().filter_map(Value::as_table).flat_map(|table| keys(table, &key)).collect()
                }
                _ => vec![key],
            }
        };
        let mut keys: Vec<_> = table.iter().flat_map(inner).collect();
        keys.sort();
        keys.dedup();
        keys
    }

    /// The text with those keys uncommented that it shows in comments.
    fn uncommented(text: &str) -> String {
        let is_key = |line: &str| {
            line.starts_with("[[") || line.split_once(" = ").is_some_and(|(key, _)| !key.contains(' '))
        };
        let shown =
            |line: &str| line.strip_prefix("# ").filter(|rest| is_key(rest)).unwrap_or(line).to_owned();
        text.lines().map(shown).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn each_preset_is_valid_and_has_the_name_and_description_of_its_file() {
        for preset in all() {
            let scenario = scenario(preset);
            assert_eq!(
                (scenario.name.as_str(), scenario.description.as_str()),
                (preset.name, preset.description)
            );
        }
    }

    #[test]
    fn each_template_shows_every_key() {
        let every = keys(&Table::try_from(read::example_scenario()).unwrap(), "");
        for preset in templates() {
            let shown: Table = uncommented(preset.text).parse().unwrap();
            assert_eq!(keys(&shown, ""), every, "{}", preset.name);
        }
    }

    #[test]
    fn each_template_shows_the_defaults() {
        for preset in templates() {
            let Scenario { name, description, requirements, start, obstacles, .. } = scenario(preset);
            let mut wanted = Scenario { name, description, requirements, obstacles, ..Scenario::default() };
            wanted.start.uavs = start.uavs;
            assert_eq!(scenario(preset), wanted);
        }
    }

    #[test]
    fn each_key_is_commented_where_it_first_appears() {
        for preset in all() {
            let mut seen = Vec::new();
            for line in preset.text.lines().filter(|line| !line.starts_with(['#', '[', ' '])) {
                let Some((key, value)) = line.split_once(" = ") else { continue };
                let described = key == "description" || value.contains(" # ");
                assert!(described || seen.contains(&key), "{}: {line}", preset.name);
                seen.push(key);
            }
        }
    }
}
