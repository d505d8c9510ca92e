//! The clock that times ticks, and how punctually the scheduler wakes a process for one.

use super::{Check, Grade};
use std::{
    fs,
    time::{Duration, Instant},
};

/// Readings that are averaged. Fewer show the first, slow ones; more take longer and say the same.
const READINGS: u32 = 20_000;
/// A slower clock costs more than a process needs for its part of a tick.
const READING_MAX_NS: f64 = 250.0;
/// Sleeps that are timed. Fewer miss the occasional late one; more take longer than people wait for an answer.
const SLEEPS: usize = 150;
/// Length of each.
const SLEEP: Duration = Duration::from_millis(1);
/// A later typical wake-up is a third of a tick at 1000 Hz, or a sign of a coarse timer.
const LATE_TYPICAL: Duration = Duration::from_micros(300);
/// A later worst wake-up misses a deadline at 100 Hz.
const LATE_WORST: Duration = Duration::from_millis(10);

/// What one reading of the clock costs.
pub(super) fn check_source() -> Check {
    let begin = Instant::now();
    for _ in 0..READINGS {
        std::hint::black_box(Instant::now());
    }
    let cost_ns = begin.elapsed().as_secs_f64() * 1e9 / f64::from(READINGS);
    let source = fs::read_to_string("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    graded_source(cost_ns, source.ok().as_deref().map(str::trim))
}

fn graded_source(cost_ns: f64, source: Option<&str>) -> Check {
    let source = source.unwrap_or("of a kind that is not readable here");
    let (grade, advice) = if cost_ns > READING_MAX_NS {
        (
            Grade::Limited,
            ": each tick reads it often, so ticks take longer; boot with clocksource=tsc if the CPU has one",
        )
    } else {
        (Grade::Fit, "")
    };
    Check { name: "clock", grade, finding: format!("{source}, {cost_ns:.0} ns a reading{advice}") }
}

/// How late the scheduler wakes a thread that sleeps.
pub(super) fn check_timer() -> Check {
    let mut late: Vec<Duration> = (0..SLEEPS).map(|_| lateness()).collect();
    late.sort_unstable();
    graded_timer(late[SLEEPS / 2], late[SLEEPS - 1])
}

fn lateness() -> Duration {
    let begin = Instant::now();
    std::thread::sleep(SLEEP);
    begin.elapsed().saturating_sub(SLEEP)
}

fn graded_timer(typical: Duration, worst: Duration) -> Check {
    let is_punctual = typical <= LATE_TYPICAL && worst <= LATE_WORST;
    let advice = if is_punctual {
        ""
    } else {
        ": flights in real time miss deadlines, those in lockstep only take longer; end other programs, or use \
         --priority"
    };
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    Check {
        name: "scheduler",
        grade: if is_punctual { Grade::Fit } else { Grade::Limited },
        finding: format!(
            "wakes a sleeping process {:.2} ms late, at worst {:.2} ms{advice}",
            ms(typical),
            ms(worst)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_needs_a_system_call_is_named() {
        let slow = graded_source(900.0, Some("hpet"));
        assert!(slow.grade == Grade::Limited && slow.finding.starts_with("hpet, 900 ns"), "{slow:?}");
        assert_eq!(graded_source(25.0, Some("tsc")).grade, Grade::Fit);
        assert!(graded_source(25.0, None).finding.contains("not readable here"));
    }

    #[test]
    fn late_wake_ups_limit_real_time() {
        let [short, long] = [Duration::from_micros(60), Duration::from_millis(25)];
        assert_eq!(graded_timer(short, short).grade, Grade::Fit);
        assert_eq!(graded_timer(short, long).grade, Grade::Limited);
        let typical = graded_timer(Duration::from_millis(1), Duration::from_millis(2));
        assert!(typical.finding.starts_with("wakes a sleeping process 1.00 ms late, at worst 2.00 ms:"));
    }
}
