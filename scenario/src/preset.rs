//! The scenarios that come with ringwing, each a commented file to start from.

/// A scenario that comes with ringwing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// What to call it on the command line.
    pub name: &'static str,
    /// One line on what it shows.
    pub description: &'static str,
    /// Its TOML, with a comment on every key that it has.
    pub text: &'static str,
}

static PRESETS: [Preset; 9] = [
    Preset {
        name: "paper-4.1",
        description: "six UAVs form the standard formation in free sky and keep it, the paper's Section 4.1",
        text: include_str!("../presets/paper-4.1.toml"),
    },
    Preset {
        name: "paper-4.2",
        description: "six UAVs form the standard formation and pass the two obstacles of the paper's Section 4.2",
        text: include_str!("../presets/paper-4.2.toml"),
    },
    Preset {
        name: "dropout",
        description: "a UAV drops out of the formation for good, and the ring closes",
        text: include_str!("../presets/dropout.toml"),
    },
    Preset {
        name: "dropout-return",
        description: "two UAVs drop out, one after the other, and come back",
        text: include_str!("../presets/dropout-return.toml"),
    },
    Preset {
        name: "delay",
        description: "what ring neighbours tell each other is half a second old",
        text: include_str!("../presets/delay.toml"),
    },
    Preset {
        name: "lossy",
        description: "links lose, repeat and reorder what is sent, in bursts too, from the formed ring on",
        text: include_str!("../presets/lossy.toml"),
    },
    Preset {
        name: "partition",
        description: "the swarm falls into halves that do not hear each other, and finds together again",
        text: include_str!("../presets/partition.toml"),
    },
    Preset {
        name: "leader-loss",
        description: "the leader is gone for 20 s, and back",
        text: include_str!("../presets/leader-loss.toml"),
    },
    Preset {
        name: "storm",
        description: "everything at once for half a minute: deaths, freezes, losses, delays, a partition",
        text: include_str!("../presets/storm.toml"),
    },
];

/// All of them, in the order in which to list them.
pub fn all() -> &'static [Preset] {
    &PRESETS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scenario, Source, example};
    use toml::{Table, Value};

    fn scenario(preset: &Preset) -> Scenario {
        Scenario::read(&Source::find(preset.name).unwrap(), &[]).unwrap()
    }

    /// Those to begin a scenario of one's own with; the others show what is particular to them.
    fn templates() -> impl Iterator<Item = &'static Preset> {
        all().iter().filter(|preset| preset.name.starts_with("paper"))
    }

    /// Every key of `table`, those of listed sections once.
    fn keys(table: &Table, section: &str) -> Vec<String> {
        let inner = |(name, value): (&String, &Value)| {
            let key = example::join(section, name);
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

    /// The text with the keys that it shows commented out.
    fn uncommented(text: &str) -> String {
        let is_key = |line: &str| {
            line.starts_with("[[") || line.split_once(" = ").is_some_and(|(key, _)| !key.contains(' '))
        };
        let shown =
            |line: &str| line.strip_prefix("# ").filter(|rest| is_key(rest)).unwrap_or(line).to_owned();
        text.lines().map(shown).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn each_preset_is_sound_and_called_what_it_calls_itself() {
        for preset in all() {
            let scenario = scenario(preset);
            assert_eq!(
                (scenario.name.as_str(), scenario.description.as_str()),
                (preset.name, preset.description)
            );
        }
    }

    #[test]
    fn each_template_shows_every_key_there_is() {
        let every = keys(&Table::try_from(example::scenario()).unwrap(), "");
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
