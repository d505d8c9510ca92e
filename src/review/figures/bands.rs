//! The shades behind the lines of all figures over time: faults, losses, and passages of obstacles.

use super::{ALARM, GREY};
use crate::review::{flight::LoggedFlight, periods::Cause};
use ringwing_drawing::{RGBColor, chart::Band};

/// The shade of link faults and slow processes.
const FAULT: RGBColor = RGBColor(0x56, 0xb4, 0xe9);
/// Most bands in a figure. More would shade everything, and nothing would stand out; the figure of events has all.
const SHOWN: usize = 60;

/// The bands of the flight. Of very many, those that last longest.
pub(super) fn bands(flight: &LoggedFlight) -> Vec<Band> {
    let mut periods: Vec<_> = flight.periods.all().iter().collect();
    // Sort by length to choose, and below by time again, because that is how a reader meets them.
    periods.sort_by(|one, other| (other.to_s - other.from_s).total_cmp(&(one.to_s - one.from_s)));
    periods.truncate(SHOWN);
    periods.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
    let band = |period: &crate::review::periods::Period| Band {
        name: period.name.clone(),
        colour: match period.cause {
            Cause::Fault => FAULT,
            Cause::Loss => ALARM,
            Cause::Passage => GREY,
        },
        from: period.from_s,
        to: period.to_s,
    };
    periods.into_iter().map(band).collect()
}
