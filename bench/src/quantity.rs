//! The quantities of a case: the table, the page and a comparison all take them from here.
//!
//! Must never mix loads: a case is compared with the floor of its own load.

use crate::{
    case::{Carrier, Load},
    label,
    latencies::{Latencies, PERCENTILES},
    result::{Hop, Measured, Repeat, Results, Usage},
    statistics::{Spread, ratios},
};
use std::collections::BTreeSet;

/// One quantity of a case, with a value for each repeat that has one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CaseQuantity {
    /// Its name and unit: `whole tick p99, us`.
    pub(crate) name: String,
    /// Its values, in the order of the repeats.
    pub(crate) values: Vec<f64>,
}

/// The tick time of each repeat, in nanoseconds: the headline of a benchmark.
///
/// In a closed loop, it is the mean time from one tick to the next. Paced ticks always come at their rate, however fast they
/// are answered, so there it is the median of the whole tick.
pub(crate) fn tick_times_ns(measured: &Measured) -> Vec<f64> {
    let median = |repeat: &Repeat| repeat.hops.get(&Hop::Tick).and_then(|tick| tick.at_share(0.5));
    let time = |repeat: &Repeat| match measured.case.load {
        Load::Closed => Some(repeat.tick_ns),
        Load::Paced(_) => median(repeat).map(|ns| ns as f64),
    };
    measured.repeats.iter().filter_map(time).collect()
}

/// The floor of `measured`: the gate alone, with the same load and the same number of processes.
pub(crate) fn floor<'r>(results: &'r Results, measured: &Measured) -> Option<&'r Measured> {
    let case = &measured.case;
    // The gate alone has one way to wake and no recorder, so those two need not match.
    let is_floor = |other: &&Measured| {
        let other = &other.case;
        other.carrier == Carrier::Gate
            && other.load == case.load
            && other.uavs == case.uavs
            && other.payload_bytes == 0
    };
    results.cases.iter().find(is_floor)
}

/// Tick times as multiples of the floor's in the same round; empty if the floor was not measured.
pub(crate) fn floor_ratios(results: &Results, measured: &Measured) -> Vec<f64> {
    let floor = floor(results, measured).map(tick_times_ns).unwrap_or_default();
    ratios(&tick_times_ns(measured), &floor)
}

/// Ticks per second of each repeat.
pub(crate) fn ticks_per_s(measured: &Measured) -> Vec<f64> {
    let per_s = |repeat: &Repeat| (repeat.took_s > 0.0).then_some(repeat.ticks as f64 / repeat.took_s);
    measured.repeats.iter().filter_map(per_s).collect()
}

/// The hops that were measured.
pub(crate) fn hops(measured: &Measured) -> BTreeSet<Hop> {
    measured.repeats.iter().flat_map(|repeat| repeat.hops.keys().copied()).collect()
}

/// The samples of `hop` in all repeats.
pub(crate) fn all_samples(measured: &Measured, hop: Hop) -> Latencies {
    let mut all = Latencies::new();
    measured.repeats.iter().filter_map(|repeat| repeat.hops.get(&hop)).for_each(|one| all.merge(one));
    all
}

/// What all processes together use per tick: the mean of all repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Budget {
    /// CPU time.
    pub(crate) cpu_ns: f64,
    /// Share of the CPU time that was spent in the kernel.
    pub(crate) kernel: f64,
    /// Share of iceoryx2's send and receive; `None` without iceoryx2.
    pub(crate) ipc: Option<f64>,
    /// Share of the law; `None` without a law.
    pub(crate) law: Option<f64>,
    /// Context switches.
    pub(crate) switches: f64,
    /// Context switches that the kernel forced.
    pub(crate) forced: f64,
}

/// What a tick of `measured` uses; `None` if no CPU time was counted.
pub(crate) fn budget(measured: &Measured) -> Option<Budget> {
    budget_of(&measured.repeats)
}

fn budget_of(repeats: &[Repeat]) -> Option<Budget> {
    let sum = |of: fn(&Usage) -> f64| repeats.iter().map(|repeat| of(&repeat.usage)).sum::<f64>();
    // Means per tick have to be weighted with the ticks of their repeat.
    let weighted_sum = |of: fn(&Usage) -> f64| {
        repeats.iter().map(|repeat| repeat.ticks as f64 * of(&repeat.usage)).sum::<f64>()
    };
    let ticks = repeats.iter().map(|repeat| repeat.ticks).sum::<u64>() as f64;
    let cpu_s = sum(|usage| usage.user_s + usage.system_s);
    let share = |ns: f64| (ns > 0.0).then_some(ns / (1e9 * cpu_s));
    (cpu_s > 0.0 && ticks > 0.0).then(|| Budget {
        cpu_ns: 1e9 * cpu_s / ticks,
        kernel: sum(|usage| usage.system_s) / cpu_s,
        ipc: share(weighted_sum(|usage| usage.ipc_ns_per_tick)),
        law: share(weighted_sum(|usage| usage.law_ns_per_tick)),
        switches: sum(|usage| (usage.voluntary_switches + usage.involuntary_switches) as f64) / ticks,
        forced: sum(|usage| usage.involuntary_switches as f64) / ticks,
    })
}

/// The largest proportional set size of an agent in bytes; `None` if unreadable.
pub(crate) fn agent_pss_bytes(measured: &Measured) -> Option<u64> {
    measured.repeats.iter().map(|repeat| repeat.usage.agent_pss_bytes).max().filter(|bytes| *bytes > 0)
}

/// All quantities that can be compared, the most important first; those without a value are left out.
pub(crate) fn all(results: &Results, measured: &Measured) -> Vec<CaseQuantity> {
    let us = |values: Vec<f64>| values.into_iter().map(|ns| ns / 1e3).collect();
    let mut quantities = vec![
        quantity("tick time, us", us(tick_times_ns(measured))),
        quantity("tick time over the floor", floor_ratios(results, measured)),
    ];
    // The whole tick comes last in the order of hops, and is the most important.
    quantities.extend(hops(measured).into_iter().rev().flat_map(|hop| of_hop(measured, hop)));
    // A closed loop has no deadline to miss: its zeros would look like a result.
    if measured.case.load != Load::Closed {
        quantities
            .push(of_repeats(measured, "missed deadlines", |repeat| Some(repeat.missed_deadlines as f64)));
        quantities
            .push(of_repeats(measured, "reused commands", |repeat| Some(repeat.reused_commands as f64)));
    }
    quantities.extend(of_usage(measured));
    quantities.retain(|quantity| !quantity.values.is_empty());
    quantities
}

fn quantity(name: &str, values: Vec<f64>) -> CaseQuantity {
    CaseQuantity { name: name.into(), values }
}

fn of_repeats(measured: &Measured, name: &str, get: impl Fn(&Repeat) -> Option<f64>) -> CaseQuantity {
    quantity(name, measured.repeats.iter().filter_map(get).collect())
}

fn of_hop(measured: &Measured, hop: Hop) -> Vec<CaseQuantity> {
    let of = |what: &str, get: &dyn Fn(&Latencies) -> Option<u64>| {
        let name = format!("{} {what}, us", label::hop(hop));
        of_repeats(measured, &name, |repeat| Some(get(repeat.hops.get(&hop)?)? as f64 / 1e3))
    };
    let mut quantities: Vec<CaseQuantity> =
        PERCENTILES.iter().map(|(what, q)| of(what, &|samples| samples.percentile(*q))).collect();
    quantities.push(of("max", &Latencies::max_ns));
    quantities
}

fn of_usage(measured: &Measured) -> Vec<CaseQuantity> {
    let of = |name: &str, get: fn(&Budget) -> Option<f64>| {
        // Each repeat for itself, so that a comparison sees how they spread.
        of_repeats(measured, name, |repeat| get(&budget_of(std::slice::from_ref(repeat))?))
    };
    let pss_mb = |repeat: &Repeat| match repeat.usage.agent_pss_bytes {
        0 => None,
        bytes => Some(bytes as f64 / 1e6),
    };
    vec![
        of("CPU time per tick, us", |budget| Some(budget.cpu_ns / 1e3)),
        of("in the kernel, %", |budget| Some(100.0 * budget.kernel)),
        of("in iceoryx2, %", |budget| Some(100.0 * budget.ipc?)),
        of("in the law, %", |budget| Some(100.0 * budget.law?)),
        of("context switches per tick", |budget| Some(budget.switches)),
        of_repeats(measured, "memory of an agent (PSS), MB", pss_mb),
    ]
}

/// Values over repeats in short: the median, and the range if there are several repeats.
pub(crate) fn summary(values: &[f64], format: impl Fn(f64) -> String) -> String {
    match Spread::of(values) {
        None => "-".into(),
        Some(Spread { median, repeats: 1, .. }) => format(median),
        Some(Spread { median, least, most, .. }) => {
            format!("{} ({} to {})", format(median), format(least), format(most))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example;

    #[test]
    fn the_floor_is_the_gate_of_the_same_size_and_load() {
        let results = example::results();
        let swarm = example::find(&results, Carrier::Swarm, Load::Closed, 6);
        let found = floor(&results, swarm).unwrap();
        assert_eq!(found.case.carrier, Carrier::Gate);
        assert_eq!((found.case.uavs, found.case.load), (6, Load::Closed));
        let paced = example::find(&results, Carrier::Swarm, Load::Paced(100), 6);
        assert_eq!(floor(&results, paced), None);
        assert!(floor_ratios(&results, paced).is_empty());
    }

    #[test]
    fn ratios_compare_repeats_of_the_same_round() {
        let results = example::results();
        let swarm = example::find(&results, Carrier::Swarm, Load::Closed, 6);
        // In the example, rounds are 1.0, 1.5, 1.1 and 0.9 times as slow for floor and swarm alike: 14 us over 10 us.
        let times_ns: Vec<u64> = tick_times_ns(swarm).iter().map(|ns| ns.round() as u64).collect();
        assert_eq!(times_ns, [14_000, 21_000, 15_400, 12_600]);
        for ratio in floor_ratios(&results, swarm) {
            assert!((ratio - 1.4).abs() < 1e-12, "{ratio}");
        }
    }

    #[test]
    fn the_tick_time_of_a_paced_case_is_its_median_not_its_period() {
        let results = example::results();
        let paced = example::find(&results, Carrier::Swarm, Load::Paced(100), 6);
        let periods = paced.repeats.iter().all(|repeat| repeat.tick_ns == 1e7);
        assert!(periods && tick_times_ns(paced).iter().all(|ns| *ns < 1e6), "{:?}", tick_times_ns(paced));
    }

    #[test]
    fn a_budget_weighs_repeats_by_their_ticks() {
        let results = example::results();
        let mut swarm = example::find(&results, Carrier::Swarm, Load::Closed, 6).clone();
        let mut repeat = swarm.repeats[0].clone();
        repeat.ticks = 1000;
        repeat.usage = Usage {
            user_s: 0.03,
            system_s: 0.01,
            voluntary_switches: 7_000,
            involuntary_switches: 500,
            law_ns_per_tick: 2_000.0,
            ipc_ns_per_tick: 0.0,
            agent_pss_bytes: 0,
        };
        swarm.repeats = vec![repeat.clone(), Repeat { ticks: 3000, usage: Usage::default(), ..repeat }];
        // 40 ms for 4000 ticks are 10 us each; 1000 ticks with 2 us of law are 2 ms of the 40 ms.
        let budget = budget(&swarm).unwrap();
        assert_eq!((budget.cpu_ns, budget.kernel, budget.ipc), (10_000.0, 0.25, None));
        assert!((budget.law.unwrap() - 0.05).abs() < 1e-12);
        assert_eq!((budget.switches, budget.forced), (1.875, 0.125));
        assert_eq!(agent_pss_bytes(&swarm), None);
    }

    #[test]
    fn all_samples_include_every_repeat() {
        let results = example::results();
        let swarm = example::find(&results, Carrier::Swarm, Load::Closed, 6);
        let each: u64 = swarm.repeats.iter().map(|repeat| repeat.hops[&Hop::Tick].n()).sum();
        assert_eq!(all_samples(swarm, Hop::Tick).n(), each);
    }

    #[test]
    fn what_was_not_measured_is_left_out() {
        let results = example::results();
        let gate = example::find(&results, Carrier::Gate, Load::Closed, 6);
        let names: Vec<String> = all(&results, gate).into_iter().map(|quantity| quantity.name).collect();
        assert!(!names.iter().any(|name| name.contains("law") || name.contains("missed")), "{names:?}");
        assert!(names.contains(&"whole tick p99, us".into()), "{names:?}");
    }
}
