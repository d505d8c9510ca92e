//! The built-in sweeps, each a commented file that can serve as a template.

/// A built-in sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preset {
    /// Its name on the command line, which is also that of its file.
    pub name: &'static str,
    /// What it shows, in one line.
    pub description: &'static str,
    /// Its TOML.
    pub text: &'static str,
}

/// A sweep whose file has the same name. A test keeps the description equal to that of the file.
macro_rules! preset {
    ($name:literal, $description:literal) => {
        Preset {
            name: $name,
            description: $description,
            text: include_str!(concat!("../../presets/", $name, ".toml")),
        }
    };
}

static PRESETS: [Preset; 3] = [
    preset!("delay-loss", "success over delay and loss between ring neighbours, for both laws"),
    preset!("dropout-count", "what the loss of one to nine UAVs of twelve costs, for both laws"),
    preset!(
        "gain-delay",
        "success over the gain G and the delay between ring neighbours, under the paper's law"
    ),
];

/// All built-in sweeps, in the order in which to list them.
pub fn all() -> &'static [Preset] {
    &PRESETS
}

/// The built-in sweep of this name.
pub fn named(name: &str) -> Option<&'static Preset> {
    all().iter().find(|preset| preset.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Draft, check};

    #[test]
    fn every_built_in_sweep_is_valid_in_all_its_cells() {
        for preset in all() {
            let sweep = Draft::parse(preset.name, preset.text).and_then(Draft::finish).unwrap();
            assert_eq!((sweep.name.as_str(), sweep.description.as_str()), (preset.name, preset.description));
            assert_eq!(check(&sweep, 1, true, || false), Vec::<String>::new(), "{}", preset.name);
        }
    }
}
