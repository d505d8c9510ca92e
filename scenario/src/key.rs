//! Keys of a scenario, written as in `--set`, and the units that their names end in.
//!
//! `airframe.speed_max_m_s` is a key of a section; in a list, an index follows: `obstacles.0.radius_m`.
//!
//! Never knows which keys a scenario has.

/// The unit that a key's name ends in.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Unit {
    /// The ending: `_m_s`.
    suffix: &'static str,
    /// As written after a number: 12 m/s.
    pub(crate) symbol: &'static str,
    /// As used in a sentence: a number of metres per second.
    pub(crate) plural: &'static str,
}

/// The first match counts, so `_m` must come after the longer endings that end in it, such as `_rad_per_m`.
static UNITS: [Unit; 11] = [
    Unit { suffix: "_rad_per_m", symbol: "rad/m", plural: "radians per metre" },
    Unit { suffix: "_rad_s2", symbol: "rad/s2", plural: "radians per second squared" },
    Unit { suffix: "_m_s2", symbol: "m/s2", plural: "metres per second squared" },
    Unit { suffix: "_rad_s", symbol: "rad/s", plural: "radians per second" },
    Unit { suffix: "_m_s", symbol: "m/s", plural: "metres per second" },
    Unit { suffix: "_spacings", symbol: "spacings", plural: "formation spacings" },
    Unit { suffix: "_radii", symbol: "radii", plural: "formation radii" },
    Unit { suffix: "_deg", symbol: "degrees", plural: "degrees" },
    Unit { suffix: "_hz", symbol: "Hz", plural: "hertz" },
    Unit { suffix: "_m", symbol: "m", plural: "metres" },
    Unit { suffix: "_s", symbol: "s", plural: "seconds" },
];

/// What people write for a unit at the end of a key, right or wrong. A missing word only costs a suggestion.
const UNIT_WORDS: [&str; 31] = [
    "centimetres",
    "cm",
    "deg",
    "degrees",
    "feet",
    "ft",
    "h",
    "hours",
    "hz",
    "khz",
    "km",
    "kmh",
    "kn",
    "knots",
    "kph",
    "m",
    "meters",
    "metres",
    "min",
    "minutes",
    "mm",
    "mph",
    "mps",
    "ms",
    "per",
    "rad",
    "radians",
    "radii",
    "s",
    "seconds",
    "spacings",
];

/// The key of `name` in `section`; the section of the scenario itself is empty.
pub(crate) fn join(section: &str, name: &str) -> String {
    if section.is_empty() { name.to_owned() } else { format!("{section}.{name}") }
}

/// The section and the name of `key`.
pub(crate) fn split(key: &str) -> (&str, &str) {
    key.rsplit_once('.').unwrap_or(("", key))
}

/// The last part of `key`.
pub(crate) fn name(key: &str) -> &str {
    split(key).1
}

/// The unit of `key`, if its name ends in one.
pub(crate) fn unit(key: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| key.ends_with(unit.suffix))
}

/// The symbol of the unit of `key`, as written after a number: `m/s`.
pub fn unit_symbol(key: &str) -> Option<&'static str> {
    unit(key).map(|unit| unit.symbol)
}

/// `value` with the unit of `key`: `12 m/s`.
pub(crate) fn with_unit(key: &str, value: f64) -> String {
    unit(key).map_or_else(|| value.to_string(), |unit| format!("{value} {}", unit.symbol))
}

/// Whether the names `wrong` and `known` differ only in their unit: `speed_max_km_h` or `speed_max` for
/// `speed_max_m_s`.
pub(crate) fn differs_only_in_unit(wrong: &str, known: &str) -> bool {
    // Whatever follows the stem of the known key must consist of words for units.
    let stem = unit(known).and_then(|unit| known.strip_suffix(unit.suffix)).unwrap_or(known);
    let ending = wrong.strip_prefix(stem).filter(|_| wrong != known);
    ending.is_some_and(|ending| ending.is_empty() || ending.strip_prefix('_').is_some_and(is_unit))
}

fn is_unit(words: &str) -> bool {
    words.split('_').all(|word| UNIT_WORDS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_splits_into_its_section_and_its_name() {
        assert_eq!(split("start.draw.separation_m"), ("start.draw", "separation_m"));
        assert_eq!((split("seed"), name("obstacles.0.name")), (("", "seed"), "name"));
        assert_eq!([join("", "seed"), join("time", "rate_hz")], ["seed", "time.rate_hz"]);
    }

    #[test]
    fn a_name_ends_in_its_unit() {
        let symbol = |key| unit(key).map(|unit| unit.symbol);
        assert_eq!(symbol("airframe.speed_max_m_s"), Some("m/s"));
        assert_eq!(symbol("turn_rate_max_rad_s"), Some("rad/s"));
        assert_eq!(symbol("heading_gain_rad_per_m"), Some("rad/m"));
        assert_eq!(symbol("position_m"), Some("m"));
        assert_eq!(symbol("uavs"), None);
        assert_eq!(with_unit("time.duration_s", 0.5), "0.5 s");
        assert_eq!(with_unit("control.slot_gain", -1.0), "-1");
    }

    #[test]
    fn a_wrong_or_missing_unit_differs_from_another_name() {
        for key in ["speed_max_km_h", "speed_max", "speed_max_mps", "speed_max_m"] {
            assert!(differs_only_in_unit(key, "speed_max_m_s"), "{key}");
        }
        for key in ["speed_max_m_s", "speed_min_m_s", "speed_maximum", "speed_max_of_all"] {
            assert!(!differs_only_in_unit(key, "speed_max_m_s"), "{key}");
        }
    }
}
