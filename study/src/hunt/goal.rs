//! What a hunt makes as bad as it can: a figure of the summary, as low or as high as possible.
//!
//! Never computes a figure: [`Figure`] does.

use crate::{
    figure::{Better, FIGURES, Figure},
    flight::Outcome,
};
use std::fmt::{self, Display, Formatter};

/// Figures that a flight lacks if it never got that far, which is worse than any number.
const NEVER_IS_WORST: [&str; 6] = [
    "settling_s",
    "recovery_max_s",
    "slot_error_max_m",
    "slot_error_rms_m",
    "neighbour_error_max_m",
    "radius_error_max_m",
];
/// Figures that one moment of a flight decides, whatever comes later.
const AT_ONE_MOMENT: [&str; 8] = [
    "closest_pair_m",
    "closest_adjacent_m",
    "closest_other_m",
    "clearance_m",
    "speed_min_m_s",
    "speed_max_m_s",
    "turn_rate_max_rad_s",
    "collisions",
];

/// A figure, and which end of it is hunted.
#[derive(Clone, Copy)]
pub struct Goal {
    /// The figure.
    pub figure: &'static Figure,
    /// Whether high values are hunted.
    pub is_highest: bool,
}

/// How bad a flight is for a goal; what is worse is larger.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub enum Badness {
    /// The flight says nothing about the figure, such as a recovery without a fault.
    Nothing,
    /// By the value of the figure: its negative where low values are hunted.
    Of(f64),
    /// The flight lacks the figure because it never got that far, such as a swarm that never recovered.
    Never,
}

impl Goal {
    /// The goal of the bad end of the figure `name`, or of the end that is asked for.
    ///
    /// # Errors
    /// There is no such figure.
    pub fn new(name: &str, is_highest: Option<bool>) -> Result<Self, String> {
        // A hunt flies nothing beside its flights.
        let is_known = |figure: &&Figure| !figure.needs_baseline();
        let figure = Figure::named(name).filter(is_known).ok_or_else(|| {
            let names: Vec<_> = FIGURES.iter().filter(is_known).map(|figure| figure.name).collect();
            format!("{name}: there is no such figure; the figures are {}", names.join(", "))
        })?;
        Ok(Self { figure, is_highest: is_highest.unwrap_or(figure.better == Better::Lower) })
    }

    /// How bad `outcome` is.
    pub fn badness(&self, outcome: &Outcome) -> Badness {
        match self.figure.of(outcome) {
            Some(value) => Badness::Of(if self.is_highest { value } else { -value }),
            None if self.is_highest && self.has_never(outcome) => Badness::Never,
            None => Badness::Nothing,
        }
    }

    fn has_never(&self, outcome: &Outcome) -> bool {
        if self.figure.name == "recovery_max_s" {
            // A recovery that the next fault cuts short says nothing; one that is not seen to the end of the flight does.
            return outcome.summary.recoveries.last().is_some_and(|last| last.recovery_s.is_none());
        }
        NEVER_IS_WORST.contains(&self.figure.name)
    }

    /// The value of the figure at this badness, as a text.
    pub fn text(&self, badness: Badness) -> String {
        match badness {
            Badness::Of(value) if self.is_highest => value.to_string(),
            // Zero has no sign.
            Badness::Of(value) => (0.0 - value).to_string(),
            Badness::Nothing => "nothing".into(),
            Badness::Never => "never".into(),
        }
    }

    /// As [`Self::text`], with at most four decimals, for people.
    pub fn brief(&self, badness: Badness) -> String {
        match self.text(badness).parse::<f64>() {
            Ok(value) => brief(value),
            Err(_) => self.text(badness),
        }
    }

    /// The badness that [`Self::text`] has written; `None` if the text is something else.
    pub fn parse(&self, text: &str) -> Option<Badness> {
        Some(match text {
            "nothing" => Badness::Nothing,
            "never" => Badness::Never,
            number => {
                let value: f64 = number.parse().ok().filter(|value: &f64| value.is_finite())?;
                Badness::Of(if self.is_highest { value } else { -value })
            }
        })
    }

    /// Whether the figure is decided at one moment of the flight, so that the rest may be cut off.
    pub fn is_at_one_moment(&self) -> bool {
        AT_ONE_MOMENT.contains(&self.figure.name)
    }
}

/// `value` with at most four decimals.
pub fn brief(value: f64) -> String {
    // Zero has no sign.
    (0.0 + (value * 1e4).round() / 1e4).to_string()
}

impl Display for Goal {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", if self.is_highest { "highest" } else { "lowest" }, self.figure.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::fly;
    use ringwing_scenario::Scenario;

    fn outcome(duration_s: f64, faults: &[&str]) -> Outcome {
        let mut scenario = Scenario::default();
        scenario.time.duration_s = duration_s;
        scenario.formation.uavs = 3;
        scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
        fly(&scenario).unwrap()
    }

    #[test]
    fn the_bad_end_of_a_figure_is_hunted_unless_the_other_is_asked_for() {
        assert_eq!(Goal::new("closest_pair_m", None).unwrap().to_string(), "lowest closest_pair_m");
        assert_eq!(Goal::new("recovery_max_s", None).unwrap().to_string(), "highest recovery_max_s");
        assert_eq!(Goal::new("closest_pair_m", Some(true)).unwrap().to_string(), "highest closest_pair_m");
        let unknown = Goal::new("closest_par_m", None).err().unwrap();
        assert!(unknown.contains("no such figure; the figures are settling_s, "), "{unknown}");
    }

    #[test]
    fn closer_pairs_and_larger_errors_are_worse() {
        let flight = outcome(1.0, &[]);
        let pair = flight.summary.closest_pair.unwrap().distance_m;
        assert_eq!(Goal::new("closest_pair_m", None).unwrap().badness(&flight), Badness::Of(-pair));
        assert_eq!(Goal::new("closest_pair_m", Some(true)).unwrap().badness(&flight), Badness::Of(pair));
        assert!(Badness::Of(-1.0) > Badness::Of(-2.0) && Badness::Never > Badness::Of(f64::MAX));
        assert!(Badness::Nothing < Badness::Of(f64::MIN));
    }

    #[test]
    fn what_never_happened_is_worst_and_what_was_not_asked_says_nothing() {
        let badness = |name: &str, flight: &Outcome| Goal::new(name, None).unwrap().badness(flight);
        let [quiet, killed] = [outcome(1.0, &[]), outcome(1.0, &["at 0.5 s kill uav 1"])];
        assert_eq!(badness("settling_s", &quiet), Badness::Never);
        assert_eq!(badness("recovery_max_s", &quiet), Badness::Nothing, "there was no fault");
        assert_eq!(badness("recovery_max_s", &killed), Badness::Never);
        assert_eq!(badness("clearance_m", &quiet), Badness::Nothing, "there is no obstacle");
    }

    #[test]
    fn people_read_four_decimals() {
        let goal = Goal::new("settling_s", None).unwrap();
        assert_eq!(
            [12.000_04, 0.1 + 0.2, -1e-9].map(|value| goal.brief(Badness::Of(value))),
            ["12", "0.3", "0"]
        );
    }

    #[test]
    fn a_badness_reads_back_as_it_was_written() {
        for goal in [Goal::new("closest_pair_m", None).unwrap(), Goal::new("settling_s", None).unwrap()] {
            for badness in [Badness::Nothing, Badness::Of(0.1 + 0.2), Badness::Of(-3.0), Badness::Never] {
                assert_eq!(goal.parse(&goal.text(badness)), Some(badness));
            }
            assert_eq!((goal.text(Badness::Of(0.0)), goal.brief(Badness::Of(0.0))), ("0".into(), "0".into()));
            assert_eq!(goal.brief(Badness::Never), "never");
            assert_eq!((goal.parse("NaN"), goal.parse("")), (None, None));
        }
    }
}
