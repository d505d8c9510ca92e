//! Overrides: values on the command line that replace those of the file.
//!
//! Never knows which keys a scenario has.

use super::shape;
use std::fmt::Display;

/// One value given on the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// As the user wrote it, for messages: `--set airframe.speed_max_m_s=27`, `--uavs 200`.
    pub written: String,
    /// The key: `airframe.speed_max_m_s`, `obstacles.0.radius_m`, or only the end of one, `speed_max_m_s`.
    pub key: String,
    /// The value as TOML, or a text without its quotes.
    pub value: String,
}

impl Setting {
    /// Parses the `key=value` of a `--set`.
    ///
    /// # Errors
    /// There is no `=`, or nothing before it; the message shows the right form.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            Some((key, value)) if !key.is_empty() => {
                Ok(Self { written: format!("--set {text}"), key: key.into(), value: value.into() })
            }
            _ => {
                Err(format!("{} is not a setting: give key=value, such as duration_s=30", shape::quote(text)))
            }
        }
    }

    /// The setting of `key` by its own flag: `--uavs 200`.
    pub fn of_flag(flag: &str, key: &str, value: impl Display) -> Self {
        Self { written: format!("{flag} {value}"), key: key.into(), value: value.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_a_key_and_a_value() {
        let setting = Setting::parse("control.law = paper").unwrap();
        assert_eq!((setting.key.as_str(), setting.value.as_str()), ("control.law", "paper"));
        assert_eq!(setting.written, "--set control.law = paper");
        assert_eq!(Setting::of_flag("--uavs", "formation.uavs", 200).written, "--uavs 200");
        for text in ["", "x", "=3", " = 3"] {
            assert!(Setting::parse(text).unwrap_err().contains("give key=value"), "{text}");
        }
    }
}
