//! The figures of a case: what the table tells, the page draws and a comparison compares, computed in one place.
//!
//! Never mixes loads: a case is measured by the floor of its own load.

use super::{
    label,
    result::{Hop, Load, Measured, Repeat, Results, Subject, Usage},
    samples::{PERCENTILES, Samples},
    statistics::{Spread, ratios},
};
use std::collections::BTreeSet;

/// One quantity of a case, a value for each repeat that has it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Figure {
    /// With its unit: `whole tick p99, us`.
    pub(crate) name: String,
    /// In the order of the repeats.
    pub(crate) values: Vec<f64>,
}

/// The tick time of each repeat, in nanoseconds: what the headline is about.
///
/// In a closed loop the mean time from tick to tick. Paced ticks come at their rate however fast they are answered:
/// there it is the median of the whole tick.
pub(crate) fn tick_times_ns(measured: &Measured) -> Vec<f64> {
    let median = |repeat: &Repeat| repeat.hops.get(&Hop::Tick).and_then(|tick| tick.at_share(0.5));
    let time = |repeat: &Repeat| match measured.case.load {
        Load::Closed => Some(repeat.tick_ns),
        Load::Paced(_) => median(repeat).map(|ns| ns as f64),
    };
    measured.repeats.iter().filter_map(time).collect()
}

/// The floor of `measured`: the gate alone, of the same load, with as many processes.
pub(crate) fn floor<'r>(results: &'r Results, measured: &Measured) -> Option<&'r Measured> {
    let case = &measured.case;
    let is_floor = |other: &&Measured| {
        let it = &other.case;
        it.subject == Subject::Gate && it.load == case.load && it.uavs == case.uavs && it.payload_bytes == 0
    };
    results.cases.iter().find(is_floor)
}

/// Tick times as multiples of the floor's, round by round; none where the floor was not measured.
pub(crate) fn floor_ratios(results: &Results, measured: &Measured) -> Vec<f64> {
    let floor = floor(results, measured).map(tick_times_ns).unwrap_or_default();
    ratios(&tick_times_ns(measured), &floor)
}

/// Ticks a second, of each repeat.
pub(crate) fn ticks_per_s(measured: &Measured) -> Vec<f64> {
    let per_s = |repeat: &Repeat| (repeat.took_s > 0.0).then_some(repeat.ticks as f64 / repeat.took_s);
    measured.repeats.iter().filter_map(per_s).collect()
}

/// The hops that were measured.
pub(crate) fn hops(measured: &Measured) -> BTreeSet<Hop> {
    measured.repeats.iter().flat_map(|repeat| repeat.hops.keys().copied()).collect()
}

/// All samples of `hop`, those of every repeat.
pub(crate) fn all_samples(measured: &Measured, hop: Hop) -> Samples {
    let mut all = Samples::new();
    measured.repeats.iter().filter_map(|repeat| repeat.hops.get(&hop)).for_each(|one| all.merge(one));
    all
}

/// What all processes used for a tick, in the mean of all repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Budget {
    /// Processor time, of all processes together.
    pub(crate) cpu_ns: f64,
    /// The share of it that was spent in the kernel.
    pub(crate) kernel: f64,
    /// The share that iceoryx2's send and receive took; none where there is no iceoryx2.
    pub(crate) ipc: Option<f64>,
    /// The share that the law took; none where no law flies.
    pub(crate) law: Option<f64>,
    /// Context switches.
    pub(crate) switches: f64,
    /// Those of them that the kernel forced.
    pub(crate) forced: f64,
}

/// What a tick of `measured` used; none if no processor time was counted.
pub(crate) fn budget(measured: &Measured) -> Option<Budget> {
    budget_of(&measured.repeats)
}

fn budget_of(repeats: &[Repeat]) -> Option<Budget> {
    let sum = |of: fn(&Usage) -> f64| repeats.iter().map(|repeat| of(&repeat.usage)).sum::<f64>();
    let weighted = |of: fn(&Usage) -> f64| {
        repeats.iter().map(|repeat| repeat.ticks as f64 * of(&repeat.usage)).sum::<f64>()
    };
    let ticks = repeats.iter().map(|repeat| repeat.ticks).sum::<u64>() as f64;
    let cpu_s = sum(|usage| usage.user_s + usage.system_s);
    let share = |ns: f64| (ns > 0.0).then_some(ns / (1e9 * cpu_s));
    (cpu_s > 0.0 && ticks > 0.0).then(|| Budget {
        cpu_ns: 1e9 * cpu_s / ticks,
        kernel: sum(|usage| usage.system_s) / cpu_s,
        ipc: share(weighted(|usage| usage.ipc_ns_per_tick)),
        law: share(weighted(|usage| usage.law_ns_per_tick)),
        switches: sum(|usage| (usage.voluntary_switches + usage.involuntary_switches) as f64) / ticks,
        forced: sum(|usage| usage.involuntary_switches as f64) / ticks,
    })
}

/// The largest agent's proportional set size in bytes; none where it was not readable.
pub(crate) fn agent_pss_bytes(measured: &Measured) -> Option<u64> {
    measured.repeats.iter().map(|repeat| repeat.usage.agent_pss_bytes).max().filter(|bytes| *bytes > 0)
}

/// Everything that can be compared, the most important first.
pub(crate) fn all(results: &Results, measured: &Measured) -> Vec<Figure> {
    let us = |values: Vec<f64>| values.into_iter().map(|ns| ns / 1e3).collect();
    let mut figures = vec![
        figure("tick time, us", us(tick_times_ns(measured))),
        figure("tick time over the floor", floor_ratios(results, measured)),
    ];
    figures.extend(hops(measured).into_iter().rev().flat_map(|hop| of_hop(measured, hop)));
    if measured.case.load != Load::Closed {
        figures.push(of_repeats(measured, "missed deadlines", |repeat| Some(repeat.missed_deadlines as f64)));
        figures.push(of_repeats(measured, "reused commands", |repeat| Some(repeat.reused_commands as f64)));
    }
    figures.extend(of_usage(measured));
    figures.retain(|figure| !figure.values.is_empty());
    figures
}

fn figure(name: &str, values: Vec<f64>) -> Figure {
    Figure { name: name.into(), values }
}

fn of_repeats(measured: &Measured, name: &str, get: impl Fn(&Repeat) -> Option<f64>) -> Figure {
    figure(name, measured.repeats.iter().filter_map(get).collect())
}

fn of_hop(measured: &Measured, hop: Hop) -> Vec<Figure> {
    let name = |what: &str| format!("{} {what}, us", label::hop(hop));
    let of = |what: &str, get: &dyn Fn(&Samples) -> Option<u64>| {
        of_repeats(measured, &name(what), |repeat| Some(get(repeat.hops.get(&hop)?)? as f64 / 1e3))
    };
    let mut figures: Vec<Figure> =
        PERCENTILES.iter().map(|(what, q)| of(what, &|samples| samples.percentile(*q))).collect();
    figures.push(of("max", &Samples::max_ns));
    figures
}

fn of_usage(measured: &Measured) -> Vec<Figure> {
    let of = |name: &str, get: fn(&Budget) -> Option<f64>| {
        of_repeats(measured, name, |repeat| get(&budget_of(std::slice::from_ref(repeat))?))
    };
    let pss = |repeat: &Repeat| match repeat.usage.agent_pss_bytes {
        0 => None,
        bytes => Some(bytes as f64 / 1e6),
    };
    vec![
        of("processor time a tick, us", |budget| Some(budget.cpu_ns / 1e3)),
        of("in the kernel, %", |budget| Some(100.0 * budget.kernel)),
        of("in iceoryx2, %", |budget| Some(100.0 * budget.ipc?)),
        of("in the law, %", |budget| Some(100.0 * budget.law?)),
        of("context switches a tick", |budget| Some(budget.switches)),
        of_repeats(measured, "memory of an agent (PSS), MB", pss),
    ]
}

/// `values` over repeats, in short: the median, and the range if there is one.
pub(crate) fn shown(values: &[f64], number: impl Fn(f64) -> String) -> String {
    match Spread::of(values) {
        None => "-".into(),
        Some(Spread { median, repeats: 1, .. }) => number(median),
        Some(Spread { median, least, most, .. }) => {
            format!("{} ({} to {})", number(median), number(least), number(most))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::example, *};

    #[test]
    fn the_floor_is_the_gate_of_the_same_size_and_load() {
        let results = example::results();
        let swarm = example::find(&results, Subject::Swarm, Load::Closed, 6);
        let found = floor(&results, swarm).unwrap();
        assert_eq!((found.case.subject, found.case.uavs, found.case.load), (Subject::Gate, 6, Load::Closed));
        let paced = example::find(&results, Subject::Swarm, Load::Paced(100), 6);
        assert_eq!(floor(&results, paced), None);
        assert!(floor_ratios(&results, paced).is_empty());
    }

    #[test]
    fn ratios_are_of_the_same_round() {
        let results = example::results();
        let swarm = example::find(&results, Subject::Swarm, Load::Closed, 6);
        // The example's rounds are 1.0, 1.5, 1.1 and 0.9 times as slow, floor and swarm alike: 14 us over 10 us.
        let times_ns: Vec<u64> = tick_times_ns(swarm).iter().map(|ns| ns.round() as u64).collect();
        assert_eq!(times_ns, [14_000, 21_000, 15_400, 12_600]);
        for ratio in floor_ratios(&results, swarm) {
            assert!((ratio - 1.4).abs() < 1e-12, "{ratio}");
        }
    }

    #[test]
    fn the_tick_time_of_a_paced_case_is_its_median_not_its_period() {
        let results = example::results();
        let paced = example::find(&results, Subject::Swarm, Load::Paced(100), 6);
        let periods = paced.repeats.iter().all(|repeat| repeat.tick_ns == 1e7);
        assert!(periods && tick_times_ns(paced).iter().all(|ns| *ns < 1e6), "{:?}", tick_times_ns(paced));
    }

    #[test]
    fn a_budget_is_made_of_all_repeats() {
        let results = example::results();
        let mut swarm = example::find(&results, Subject::Swarm, Load::Closed, 6).clone();
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
    fn all_samples_are_those_of_every_repeat() {
        let results = example::results();
        let swarm = example::find(&results, Subject::Swarm, Load::Closed, 6);
        let each: u64 = swarm.repeats.iter().map(|repeat| repeat.hops[&Hop::Tick].n()).sum();
        assert_eq!(all_samples(swarm, Hop::Tick).n(), each);
    }

    #[test]
    fn what_was_not_measured_is_no_figure() {
        let results = example::results();
        let gate = example::find(&results, Subject::Gate, Load::Closed, 6);
        let names: Vec<String> = all(&results, gate).into_iter().map(|figure| figure.name).collect();
        assert!(!names.iter().any(|name| name.contains("law") || name.contains("missed")), "{names:?}");
        assert!(names.contains(&"whole tick p99, us".into()), "{names:?}");
    }
}
