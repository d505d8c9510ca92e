//! Whether an impairment can change a sample at all, and what rounding to whole ticks makes of its delay.
//!
//! Never knows a swarm or a flight: `fault_check` looks at whole scenarios.

use super::{Delay, LinkImpairment};

/// How much rounding to whole ticks may change a delay before a warning says so, as a share of the delay. A smaller share
/// warns of changes that nobody notices; a larger one lets a delay of two ticks become one without a word.
const ROUNDING_SHARE: f64 = 0.1;

/// Why `impairment` leaves every sample as it is at `rate_hz` ticks a second, or `None` if it may change one.
pub fn idle_reason(impairment: &LinkImpairment, rate_hz: u32) -> Option<String> {
    let is_nothing = match impairment {
        LinkImpairment::Delay(delay) => return idle_delay(longest_s(delay)?, rate_hz),
        LinkImpairment::Reorder { p, by_s } if *p > 0.0 => return idle_delay(*by_s, rate_hz),
        LinkImpairment::Loss(p)
        | LinkImpairment::Corrupt(p)
        | LinkImpairment::Duplicate(p)
        | LinkImpairment::Reorder { p, .. } => *p == 0.0,
        LinkImpairment::GilbertBurst { loss, .. } => *loss == 0.0,
        // The chain starts good, so its bad state does not matter if it never turns bad.
        LinkImpairment::Gilbert { p, h, k, .. } => *k == 1.0 && (*p == 0.0 || *h == 1.0),
        LinkImpairment::Rate { samples_per_s, .. } => {
            let is_wide = *samples_per_s >= f64::from(rate_hz);
            return is_wide.then(|| {
                format!("{samples_per_s} samples/s are enough for the {rate_hz} that each sender sends")
            });
        }
        LinkImpairment::Bias { x_m, y_m, heading_rad } => [*x_m, *y_m, *heading_rad] == [0.0; 3],
        LinkImpairment::Noise { position_m, heading_rad } => [*position_m, *heading_rad] == [0.0; 2],
        LinkImpairment::Blackout | LinkImpairment::Hold | LinkImpairment::Stuck => false,
    };
    is_nothing.then(|| "its magnitude is 0".into())
}

fn idle_delay(longest_s: f64, rate_hz: u32) -> Option<String> {
    let is_idle = ticks(longest_s, rate_hz) == 0.0;
    is_idle.then(|| format!("{} rounds to no tick at {rate_hz} Hz", milliseconds(longest_s)))
}

/// The longest delay, or `None` for one without a bound.
fn longest_s(delay: &Delay) -> Option<f64> {
    match delay {
        Delay::Constant { by_s } => Some(*by_s),
        Delay::Uniform { by_s, jitter_s } => Some(by_s + jitter_s),
        Delay::Trace(delays_s) => delays_s.iter().copied().reduce(f64::max),
        Delay::Normal { .. } | Delay::Pareto { .. } | Delay::File(_) => None,
    }
}

/// What rounding to whole ticks makes of a constant delay, as a sentence, if it changes the delay noticeably.
pub fn rounded_delay(impairment: &LinkImpairment, rate_hz: u32) -> Option<String> {
    let (LinkImpairment::Delay(Delay::Constant { by_s }) | LinkImpairment::Reorder { by_s, .. }) = impairment
    else {
        return None;
    };
    let rounded_s = ticks(*by_s, rate_hz) / f64::from(rate_hz);
    ((rounded_s - by_s).abs() > ROUNDING_SHARE * by_s).then(|| {
        let (asked, rounded) = (milliseconds(*by_s), milliseconds(rounded_s));
        format!("delays are whole ticks: {asked} becomes {rounded} at {rate_hz} Hz")
    })
}

fn ticks(delay_s: f64, rate_hz: u32) -> f64 {
    (delay_s * f64::from(rate_hz)).round()
}

fn milliseconds(time_s: f64) -> String {
    // A tenth of a microsecond is far below every tick, and hides the rounding error of the product.
    format!("{} ms", (time_s * 1e7).round() / 1e4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_leaves_no_delay_as_it_is() {
        let delay = |by_s| LinkImpairment::Delay(Delay::Constant { by_s });
        assert_eq!(rounded_delay(&delay(0.0), 100), None);
        assert!(rounded_delay(&delay(0.014), 100).is_some());
    }
}
