//! Suggests the key that the user probably meant instead of an unknown one, and completes shortened keys.

use super::example;
use crate::{key, spelling};
use toml::de::{DeTable, DeValue};

/// The message for the unknown key `name` in `section`, whose keys are those of `known`.
pub(super) fn unknown_key(section: &str, name: &str, known: &DeTable<'_>) -> String {
    let here: Vec<_> = known.keys().map(|name| key::join(section, name.get_ref())).collect();
    // Search this section first: a misspelled name is likelier than a key in the wrong section.
    match nearest(name, &here).or_else(|| nearest(name, &example::keys())) {
        // In the same section the name is enough.
        Some(key) if key::split(&key).0 == section => did_you_mean(key::name(&key)),
        Some(key) => did_you_mean(&key),
        None => {
            let names: Vec<_> = known.keys().map(|key| key.get_ref().as_ref()).collect();
            format!("no such key; the keys here are {}", names.join(", "))
        }
    }
}

/// The full key that `key` in an override stands for: itself, or the one key that ends in it.
///
/// # Errors
/// No key ends in it, or several do; the message suggests what to write.
pub(super) fn full_key(key: &str) -> Result<String, String> {
    if example::at(key).is_some() {
        return Ok(key.to_owned());
    }
    // With the dot only whole names match, not the ends of longer ones.
    let ending = format!(".{key}");
    let mut matches = example::keys().into_iter().filter(|known| known.ends_with(&ending));
    match (matches.next(), matches.next()) {
        (Some(only), None) => Ok(only),
        (Some(one), Some(other)) => Err(format!("could be {one} or {other}: give the full key")),
        (None, _) => Err(unknown_setting(key)),
    }
}

fn unknown_setting(key: &str) -> String {
    let (section, name) = key::split(key);
    match if section.is_empty() { Some(example::tree()) } else { example::at(section) } {
        Some(DeValue::Table(known)) => unknown_key(section, name, known),
        Some(list) if example::is_section_list(list) => {
            format!("no such key; {section} is a list, so give an index from 0, such as {section}.0.{name}")
        }
        _ => nearest(name, &example::keys()).map_or_else(
            || "no such key; `ringwing scenario show paper-4.2` shows all keys".into(),
            |key| did_you_mean(&key),
        ),
    }
}

/// The known key nearest to `name`: one that differs only in its unit, or else the most similar one.
fn nearest(name: &str, known: &[String]) -> Option<String> {
    // Look for another unit first: by its letters, a key with a wrong unit may resemble a different key more.
    let other_unit = known.iter().find(|key| key::differs_only_in_unit(name, key::name(key)));
    other_unit.or_else(|| spelling::nearest(name, known, |known| key::name(known))).cloned()
}

fn did_you_mean(key: &str) -> String {
    match key::unit(key) {
        Some(unit) => format!("no such key; did you mean {key}, in {}?", unit.symbol),
        None => format!("no such key; did you mean {key}?"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknown(section: &str, name: &str) -> String {
        let known = if section.is_empty() { Some(example::tree()) } else { example::at(section) };
        unknown_key(section, name, known.unwrap().as_table().unwrap())
    }

    #[test]
    fn a_wrong_unit_a_misspelling_and_a_wrong_section_are_recognised() {
        assert_eq!(unknown("airframe", "speed_max_km_h"), "no such key; did you mean speed_max_m_s, in m/s?");
        assert_eq!(unknown("leader", "heading_rad"), "no such key; did you mean heading_deg, in degrees?");
        assert_eq!(unknown("time", "real_tiem"), "no such key; did you mean real_time?");
        assert_eq!(unknown("obstacles.3", "radius"), "no such key; did you mean radius_m, in m?");
        assert_eq!(unknown("", "airframes"), "no such key; did you mean airframe?");
        assert_eq!(unknown("", "uavs"), "no such key; did you mean formation.uavs?");
        assert_eq!(unknown("", "duration"), "no such key; did you mean time.duration_s, in s?");
        assert_eq!(
            unknown("time", "weather"),
            "no such key; the keys here are duration_s, rate_hz, real_time"
        );
    }

    #[test]
    fn the_key_of_an_override_may_be_shortened_while_it_is_unique() {
        assert_eq!(full_key("speed_max_m_s").unwrap(), "airframe.speed_max_m_s");
        assert_eq!(full_key("uavs").unwrap(), "formation.uavs");
        assert_eq!(full_key("draw.separation_m").unwrap(), "start.draw.separation_m");
        assert_eq!(full_key("name").unwrap(), "name");
        assert_eq!(full_key("obstacles.12.radius_m").unwrap(), "obstacles.12.radius_m");
        assert_eq!(full_key("obstacles").unwrap(), "obstacles");
        assert_eq!(
            full_key("heading_deg").unwrap(),
            "leader.heading_deg",
            "keys in lists of sections do not count"
        );
    }

    #[test]
    fn an_unknown_key_of_an_override_is_refused_with_a_suggestion() {
        let refusal = |key| full_key(key).unwrap_err();
        assert_eq!(refusal("speed_max"), "no such key; did you mean airframe.speed_max_m_s, in m/s?");
        assert_eq!(refusal("airframe.speed_max"), "no such key; did you mean speed_max_m_s, in m/s?");
        assert_eq!(
            refusal("obstacles.radius_m"),
            "no such key; obstacles is a list, so give an index from 0, such as obstacles.0.radius_m"
        );
        assert!(refusal("weather.gusts").contains("scenario show"));
        assert!(refusal("").starts_with("no such key"));
    }
}
