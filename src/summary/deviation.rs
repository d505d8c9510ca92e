//! The lines of the summary about what faults have cost.
//!
//! Never computes a value; each is in the summary already.

use super::line::{NOT_SEEN, line};
use ringwing_recorder::metrics::{Deviation, OFF_COURSE_M, UavDeviation};
use std::fmt;

/// Writes how far the UAVs were from where they would have been, and how long.
pub(super) fn write_deviation(f: &mut fmt::Formatter<'_>, cost: &Deviation) -> fmt::Result {
    let worst = cost.uavs.iter().filter(|uav| uav.peak_m.is_some() && uav.peak_m == cost.peak_m);
    let peak = cost.peak_m.map_or_else(|| "-".into(), |peak_m| format!("{peak_m:.3} m"));
    let who = worst.map(place).next().unwrap_or_default();
    line(f, "largest deviation by the faults", &peak, &who)?;
    line(f, "deviation of all UAVs over time", &format!("{:.2} m s", cost.area_m_s), "")?;
    let (back, remark) = match cost.back_s {
        Some(back_s) => (format!("{back_s:.2} s"), String::new()),
        None => (NOT_SEEN.into(), off_course(cost)),
    };
    line(f, &format!("time back to within {OFF_COURSE_M} m"), &back, &remark)
}

fn place(uav: &UavDeviation) -> String {
    uav.peak_time_s.map_or_else(String::new, |time_s| format!("uav {} at {time_s:.2} s", uav.uav))
}

/// Which UAVs are off their undisturbed course at the end.
fn off_course(cost: &Deviation) -> String {
    let off = cost.uavs.iter().filter(|uav| uav.back_s.is_none()).map(|uav| uav.uav.to_string());
    format!("uav {}", off.collect::<Vec<_>>().join(", "))
}
