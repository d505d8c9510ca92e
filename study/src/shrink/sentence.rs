//! Smaller numbers, alone and in the sentence of a fault.
//!
//! Never touches a number that names a UAV or a link.

use ringwing_scenario::{Action, Fault, fault::Targets};

/// Units after a number that can be made smaller. A rate of samples has none of them: a smaller rate is a worse fault.
const UNITS: [&str; 6] = ["s", "ms", "%", "m", "deg", "uavs"];
/// Numbers below this are left alone. A smaller limit makes numbers that read worse and change nothing in a flight of
/// 10 ms ticks; a larger one leaves short faults long.
const SMALLEST: f64 = 0.01;

/// Smaller values than `value`, with at most two digits, the smallest first. Empty where it is small enough.
pub(super) fn smaller(value: f64) -> Vec<f64> {
    smaller_to(SMALLEST, value)
}

fn smaller_to(least: f64, value: f64) -> Vec<f64> {
    let rounded = |share: f64, digits: usize| format!("{:.*e}", digits - 1, value * share).parse().ok();
    let all = [rounded(0.5, 1), rounded(0.75, 2), rounded(0.9, 2), rounded(1.0, 1), rounded(1.0, 2)];
    all.into_iter().flatten().filter(|new| *new < value && *new >= least).collect()
}

/// Every fault that differs from `fault` by one smaller number, or by one UAV less.
pub(super) fn smaller_faults(fault: &Fault) -> Vec<Fault> {
    let text = fault.to_string();
    let words: Vec<_> = text.split(' ').collect();
    let mut faults = fewer_uavs(fault);
    for index in numbers(&words) {
        let value: f64 = words[index].parse().unwrap_or_default();
        // A tick has 10 ms: the same time as in seconds.
        let least = if words[index + 1] == "ms" { 1000.0 * SMALLEST } else { SMALLEST };
        for new in smaller_to(least, value).into_iter().map(|new| new.to_string()) {
            let mut words = words.clone();
            words[index] = &new;
            // The grammar refuses some numbers, such as half a UAV.
            faults.extend(words.join(" ").parse::<Fault>());
        }
    }
    faults
}

/// The fault for all but one of the UAVs that it names, for each of them.
fn fewer_uavs(fault: &Fault) -> Vec<Fault> {
    let Action::Process { fault: what, targets: Targets::Uavs(uavs) } = &fault.action else {
        return Vec::new();
    };
    let without = |gone: usize| {
        let mut left = uavs.clone();
        left.remove(gone);
        let action = Action::Process { fault: *what, targets: Targets::Uavs(left) };
        Fault { at_s: fault.at_s, action }
    };
    if uavs.len() > 1 { (0..uavs.len()).map(without).collect() } else { Vec::new() }
}

/// Positions of the numbers that can be made smaller.
fn numbers(words: &[&str]) -> Vec<usize> {
    let is_number = |index: &usize| {
        words[*index].parse::<f64>().is_ok() && words.get(index + 1).is_some_and(|unit| UNITS.contains(unit))
    };
    let all = (0..words.len()).filter(is_number);
    match words.iter().position(|word| *word == "gilbert") {
        // All probabilities after the first one are better when they are larger.
        Some(gilbert) => all.filter(|index| words[index + 1] != "%" || *index == gilbert + 1).collect(),
        None => all.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentences(fault: &str) -> Vec<String> {
        smaller_faults(&fault.parse().unwrap()).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn smaller_numbers_have_few_digits_and_end_at_the_smallest() {
        assert_eq!(smaller(37.3), [20.0, 28.0, 34.0, 37.0]);
        assert_eq!(smaller(0.01), [0.0; 0]);
        let mut value = 150.0;
        while let Some(next) = smaller(value).first() {
            assert!(*next < value);
            value = *next;
        }
        assert!(value < 2.0 * SMALLEST, "{value}");
    }

    #[test]
    fn the_numbers_of_uavs_and_links_stay() {
        assert!(sentences("at 4 s link 2->3 loss 20 %").iter().all(|text| text.contains("2->3 loss")));
        assert!(sentences("at 4 s kill uav 3").iter().all(|text| text.ends_with("kill uav 3")));
        assert!(sentences("at 4 s kill random 2 uavs").contains(&"at 4 s kill random 1 uavs".to_owned()));
        assert!(sentences("at 4 s link 2->3 loss 20 %").contains(&"at 4 s link 2->3 loss 10 %".to_owned()));
    }

    #[test]
    fn each_of_several_uavs_may_be_left_out() {
        let smaller = sentences("at 4 s kill uav 2,3");
        assert!(
            ["at 4 s kill uav 2", "at 4 s kill uav 3"].iter().all(|text| smaller.contains(&(*text).into()))
        );
        assert!(sentences("at 4 s kill uav 3").iter().all(|text| text.ends_with("kill uav 3")));
    }

    #[test]
    fn a_gilbert_fault_is_never_made_worse() {
        for text in sentences("at 1 s link all->all gilbert 2 % 6 % for 4 s") {
            assert!(text.contains("6 %"), "{text}");
        }
    }
}
