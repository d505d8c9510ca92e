//! The units in the names of keys.

/// The unit that a key's name ends in.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Unit {
    /// The ending, `_m_s`.
    suffix: &'static str,
    /// After a number: 12 m/s.
    pub(crate) symbol: &'static str,
    /// In a sentence: a number of metres per second.
    pub(crate) plural: &'static str,
}

/// An ending that is part of another comes after it.
static UNITS: [Unit; 9] = [
    Unit { suffix: "_rad_per_m", symbol: "rad/m", plural: "radians per metre" },
    Unit { suffix: "_rad_s", symbol: "rad/s", plural: "radians per second" },
    Unit { suffix: "_m_s", symbol: "m/s", plural: "metres per second" },
    Unit { suffix: "_spacings", symbol: "spacings", plural: "formation spacings" },
    Unit { suffix: "_radii", symbol: "radii", plural: "formation radii" },
    Unit { suffix: "_deg", symbol: "degrees", plural: "degrees" },
    Unit { suffix: "_hz", symbol: "Hz", plural: "hertz" },
    Unit { suffix: "_m", symbol: "m", plural: "metres" },
    Unit { suffix: "_s", symbol: "s", plural: "seconds" },
];

/// Words that people end a key with when they mean a unit.
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

/// The unit of `key`, if it has one.
pub(crate) fn of(key: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| key.ends_with(unit.suffix))
}

/// `value` with the unit of `key`.
pub(crate) fn measure(key: &str, value: f64) -> String {
    of(key).map_or_else(|| value.to_string(), |unit| format!("{value} {}", unit.symbol))
}

/// Whether `key` is `known` but for its unit: `speed_max_km_h` or `speed_max` for `speed_max_m_s`.
pub(crate) fn differs_in_unit(key: &str, known: &str) -> bool {
    let stem = of(known).and_then(|unit| known.strip_suffix(unit.suffix)).unwrap_or(known);
    key != known
        && match key.strip_prefix(stem) {
            Some("") => true,
            Some(rest) => rest.strip_prefix('_').is_some_and(is_unit),
            None => false,
        }
}

fn is_unit(words: &str) -> bool {
    words.split('_').all(|word| UNIT_WORDS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_names_its_unit() {
        let symbol = |key| of(key).map(|unit| unit.symbol);
        assert_eq!(symbol("airframe.speed_max_m_s"), Some("m/s"));
        assert_eq!(symbol("turn_rate_max_rad_s"), Some("rad/s"));
        assert_eq!(symbol("heading_gain_rad_per_m"), Some("rad/m"));
        assert_eq!(symbol("position_m"), Some("m"));
        assert_eq!(symbol("uavs"), None);
        assert_eq!(measure("time.duration_s", 0.5), "0.5 s");
        assert_eq!(measure("control.slot_gain", -1.0), "-1");
    }

    #[test]
    fn a_wrong_or_a_missing_unit_is_told_from_another_key() {
        for key in ["speed_max_km_h", "speed_max", "speed_max_mps", "speed_max_m"] {
            assert!(differs_in_unit(key, "speed_max_m_s"), "{key}");
        }
        for key in ["speed_max_m_s", "speed_min_m_s", "speed_maximum", "speed_max_of_all"] {
            assert!(!differs_in_unit(key, "speed_max_m_s"), "{key}");
        }
    }
}
