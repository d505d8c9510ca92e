//! What somebody who wrote a key that does not exist may have meant.

use crate::{example, unit};
use toml::de::{DeTable, DeValue};

/// How alike two words are to be taken for one another; 1 is equal.
const ALIKE: f64 = 0.7;

/// What to say of `name`, which the section `section` (all of whose keys `known` has) does not have.
pub(crate) fn unknown_key(section: &str, name: &str, known: &DeTable<'_>) -> String {
    let here: Vec<_> = known.keys().map(|key| example::join(section, key.get_ref())).collect();
    match nearest(name, &here).or_else(|| nearest(name, &example::keys())) {
        Some(key) if key.strip_suffix(example::last(&key)) == Some(&dotted(section)) => {
            meant(example::last(&key))
        }
        Some(key) => meant(&key),
        None => {
            let names: Vec<_> = known.keys().map(|key| key.get_ref().as_ref()).collect();
            format!("no such key; known here are {}", names.join(", "))
        }
    }
}

/// The full key that an override's key stands for: itself, or the one key that ends in it.
pub(crate) fn full_key(key: &str) -> Result<String, String> {
    if example::at(key).is_some() {
        return Ok(key.to_owned());
    }
    let ending = format!(".{key}");
    let mut ends = example::keys().into_iter().filter(|known| known.ends_with(&ending));
    match (ends.next(), ends.next()) {
        (Some(only), None) => Ok(only),
        (Some(one), Some(other)) => {
            Err(format!("stands for {one} as well as for {other}: give the key in full"))
        }
        (None, _) => Err(unknown_setting(key)),
    }
}

fn unknown_setting(key: &str) -> String {
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    match if section.is_empty() { Some(example::tree()) } else { example::at(section) } {
        Some(DeValue::Table(known)) => unknown_key(section, name, known),
        Some(list) if example::is_section_list(list) => {
            format!("no such key; {section} is a list, so give an index from 0, such as {section}.0.{name}")
        }
        _ => nearest(name, &example::keys())
            .map_or("no such key; `ringwing scenario show paper-4.2` shows them all".into(), |key| {
                meant(&key)
            }),
    }
}

/// The known key most like `name`: the same but for its unit, or little different in its letters.
fn nearest(name: &str, known: &[String]) -> Option<String> {
    let likeness = |key: &String| strsim::normalized_damerau_levenshtein(name, example::last(key));
    let same = known.iter().find(|key| unit::differs_in_unit(name, example::last(key)));
    let alike = || known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    same.or_else(|| alike().filter(|key| likeness(key) >= ALIKE)).cloned()
}

/// The one of `known` that `word` may be a misspelling of.
pub(crate) fn nearest_word<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let likeness = |known: &&str| strsim::normalized_damerau_levenshtein(&word.to_lowercase(), known);
    let alike = known.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    alike.filter(|known| likeness(known) >= ALIKE)
}

fn meant(key: &str) -> String {
    match unit::of(key) {
        Some(unit) => format!("no such key; did you mean {key}, in {}?", unit.symbol),
        None => format!("no such key; did you mean {key}?"),
    }
}

fn dotted(section: &str) -> String {
    if section.is_empty() { String::new() } else { format!("{section}.") }
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
        assert_eq!(unknown("time", "wind"), "no such key; known here are duration_s, rate_hz, real_time");
    }

    #[test]
    fn an_overrides_key_may_be_shortened_while_it_is_clear() {
        assert_eq!(full_key("speed_max_m_s").unwrap(), "airframe.speed_max_m_s");
        assert_eq!(full_key("uavs").unwrap(), "formation.uavs");
        assert_eq!(full_key("draw.separation_m").unwrap(), "start.draw.separation_m");
        assert_eq!(full_key("name").unwrap(), "name");
        assert_eq!(full_key("obstacles.12.radius_m").unwrap(), "obstacles.12.radius_m");
        assert_eq!(full_key("obstacles").unwrap(), "obstacles");
    }

    #[test]
    fn an_overrides_key_that_is_none_is_refused_with_what_was_meant() {
        let refusal = |key| full_key(key).unwrap_err();
        assert_eq!(refusal("speed_max"), "no such key; did you mean airframe.speed_max_m_s, in m/s?");
        assert_eq!(refusal("airframe.speed_max"), "no such key; did you mean speed_max_m_s, in m/s?");
        assert_eq!(
            refusal("obstacles.radius_m"),
            "no such key; obstacles is a list, so give an index from 0, such as obstacles.0.radius_m"
        );
        assert!(refusal("wind.gusts").contains("scenario show"));
        assert!(refusal("").starts_with("no such key"));
    }
}
