//! Computes latencies from the timestamps of a trace: the duration of each hop, and of the whole tick.
//!
//! A paced tick lasts from the time at which it *should* have begun. A stall is thus charged to every tick that it delayed,
//! and to every tick that it prevented; a benchmark without this correction hides stalls (coordinated omission).
//!
//! Must never read a clock.

use crate::{
    case::{Carrier, Case, Load},
    latencies::Latencies,
    result::{Hop, Repeat, TimeSlice, Usage},
    trace::{StepRecord, TickRecord, Trace, TraceHead},
};
use std::collections::BTreeMap;

/// Slices into which the time of a repeat is divided. More show shorter stalls, but are narrower than a pixel when four
/// repeats stand side by side.
const SLICES: usize = 60;

/// The repeat that `trace` describes. The caller fills in its place in the benchmark and when it began.
pub(crate) fn repeat(case: &Case, head: &TraceHead, trace: &Trace) -> Repeat {
    let delays = tick_delays(case, head.ended_ns, trace);
    let took_ns = took_ns(head, trace);
    let ticks = trace.ticks.len() as u64;
    Repeat {
        place: 0,
        began_s: 0.0,
        took_s: took_ns as f64 / 1e9,
        ticks,
        tick_ns: took_ns as f64 / ticks.max(1) as f64,
        hops: hops(case, trace, &delays),
        missed_deadlines: trace.ticks.iter().map(|tick| u64::from(tick.skipped)).sum(),
        reused_commands: trace.ticks.iter().map(|tick| u64::from(tick.reused)).sum(),
        usage: usage(case, head, trace),
        strip: strip(head, &delays),
    }
}

/// Time from the beginning of the first tick to the end of the last one.
fn took_ns(head: &TraceHead, trace: &Trace) -> u64 {
    // Count from tick to tick: what the probe does before the first and after the last one is part of no tick.
    let began_ns = trace.ticks.first().map_or(head.began_ns, |tick| tick.opened_ns);
    let ended_ns = trace.ticks.last().map_or(head.ended_ns, |tick| tick.collected_ns);
    ended_ns.saturating_sub(began_ns)
}

/// When a tick should have begun, and how long after that all agents had answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TickDelay {
    intended_ns: u64,
    delay_ns: u64,
}

/// The delay of every tick that should have begun.
///
/// If an agent never answers a tick, its next answer counts for that tick, too. Without a next answer, the tick lasts at
/// least until `ended_ns`.
fn tick_delays(case: &Case, ended_ns: u64, trace: &Trace) -> Vec<TickDelay> {
    let answers = answer_times(case, trace);
    let mut latest = vec![ended_ns; case.uavs as usize];
    let mut delays = Vec::with_capacity(trace.ticks.len());
    // Backwards, so that `latest` holds each agent's first answer at or after the tick.
    for (tick, answered) in trace.ticks.iter().zip(answers.chunks(latest.len())).rev() {
        for (latest, answered) in latest.iter_mut().zip(answered).filter(|(_, answered)| **answered != 0) {
            *latest = *answered;
        }
        let last_ns = latest.iter().max().copied().unwrap_or(ended_ns);
        // In reverse, like the ticks; the whole list is turned round at the end.
        delays.extend(
            intended_times(tick, period_ns(case))
                .rev()
                .map(|intended_ns| TickDelay { intended_ns, delay_ns: last_ns.saturating_sub(intended_ns) }),
        );
    }
    delays.reverse();
    delays
}

/// When each tick that `tick` stands for should have begun: the tick itself, and those that were skipped before it.
fn intended_times(tick: &TickRecord, period_ns: u64) -> impl DoubleEndedIterator<Item = u64> + use<> {
    // `intended_ns` is the deadline of the first tick that the stall delayed; the skipped ones follow at the rate.
    let first_ns = tick.intended_ns;
    (0..=u64::from(tick.skipped)).map(move |number| first_ns + number * period_ns)
}

fn period_ns(case: &Case) -> u64 {
    match case.load {
        // No deadlines, so no tick is ever skipped and the period is multiplied by 0.
        Load::Closed => 0,
        Load::Paced(rate_hz) => 1_000_000_000 / u64::from(rate_hz),
    }
}

/// For each tick, the time of each agent's answer, or 0.
///
/// A closed loop ends a tick when the last answer has been read. Where ticks are paced, an answer counts when it is sent:
/// the world reads it at its own next deadline, which says nothing about the agent.
fn answer_times(case: &Case, trace: &Trace) -> Vec<u64> {
    let members = case.uavs as usize;
    let mut times = vec![0; trace.ticks.len() * members];
    for step in &trace.steps {
        // The number comes from another process: a wrong one must not count as the answer of another agent.
        let index = tick_index(trace, step).filter(|_| (step.member as usize) < members);
        if let Some(index) = index {
            times[index * members + step.member as usize] =
                if case.load == Load::Closed { step.seen_ns } else { step.sent_ns };
        }
    }
    times
}

/// Index of a step's tick; ticks are numbered without a gap. `None` for a tick of the warm-up.
fn tick_index(trace: &Trace, step: &StepRecord) -> Option<usize> {
    let first = trace.ticks.first()?.tick;
    usize::try_from(step.tick - first).ok().filter(|index| *index < trace.ticks.len())
}

fn hops(case: &Case, trace: &Trace, delays: &[TickDelay]) -> BTreeMap<Hop, Latencies> {
    let mut hops: BTreeMap<Hop, Latencies> = BTreeMap::new();
    let mut record = |hop, from_ns: u64, to_ns: u64| {
        // The two stamps may come from different processes; a wrong one must not underflow to centuries.
        hops.entry(hop).or_default().record(to_ns.saturating_sub(from_ns));
    };
    for step in &trace.steps {
        let Some(index) = tick_index(trace, step) else { continue };
        record(Hop::Wake, trace.ticks[index].opened_ns, step.woke_ns);
        record(Hop::Read, step.woke_ns, step.read_ns);
        record(Hop::Compute, step.read_ns, step.sent_ns);
        if case.load == Load::Closed {
            record(Hop::Return, step.sent_ns, step.seen_ns);
        }
    }
    for delay in delays {
        record(Hop::Tick, 0, delay.delay_ns);
    }
    hops
}

fn usage(case: &Case, head: &TraceHead, trace: &Trace) -> Usage {
    let (user_s, system_s) = head.used.user_and_system_s();
    let ticks = trace.ticks.len().max(1) as f64;
    let sum_steps = |span: fn(&StepRecord) -> u64| trace.steps.iter().map(span).sum::<u64>();
    let sum_ticks = |span: fn(&TickRecord) -> u64| trace.ticks.iter().map(span).sum::<u64>();
    // Between reading its inputs and sending its answer, an agent does nothing but compute the law.
    let law_ns = sum_steps(|step| step.sent_ns.saturating_sub(step.read_ns));
    // Agents read and send through iceoryx2, and so does the world.
    let ipc_ns = sum_steps(|step| step.read_ns.saturating_sub(step.woke_ns) + step.sending_ns)
        + sum_ticks(|tick| tick.published_ns.saturating_sub(tick.opened_ns))
        + sum_ticks(|tick| tick.collected_ns.saturating_sub(tick.looked_ns));
    // Peers of other transports have neither a law nor iceoryx2.
    let is_swarm = if case.carrier == Carrier::Swarm { 1.0 } else { 0.0 };
    Usage {
        user_s,
        system_s,
        voluntary_switches: head.used.voluntary_switches,
        involuntary_switches: head.used.involuntary_switches,
        law_ns_per_tick: is_swarm * law_ns as f64 / ticks,
        ipc_ns_per_tick: is_swarm * ipc_ns as f64 / ticks,
        agent_pss_bytes: head.agent_pss_bytes,
    }
}

/// The whole tick over time. A tick belongs to the slice in which it should have begun.
fn strip(head: &TraceHead, delays: &[TickDelay]) -> Vec<TimeSlice> {
    let length_ns = head.ended_ns.saturating_sub(head.began_ns).max(1);
    let mut slices = vec![Vec::new(); SLICES];
    for delay in delays {
        let since_ns = delay.intended_ns.saturating_sub(head.began_ns);
        let slice = (u128::from(since_ns) * SLICES as u128 / u128::from(length_ns)) as usize;
        // A tick that was due exactly at the end belongs to the last slice.
        slices[slice.min(SLICES - 1)].push(delay.delay_ns);
    }
    slices.into_iter().map(time_slice).collect()
}

fn time_slice(mut delays_ns: Vec<u64>) -> TimeSlice {
    delays_ns.sort_unstable();
    TimeSlice {
        ticks: delays_ns.len() as u64,
        p50_ns: delays_ns.get(delays_ns.len().saturating_sub(1) / 2).copied().unwrap_or_default(),
        max_ns: delays_ns.last().copied().unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Topology;
    use ringwing_scenario::Wake;

    const MS: u64 = 1_000_000;

    fn case(load: Load, uavs: u32) -> Case {
        Case {
            carrier: Carrier::Swarm,
            topology: Topology::Hub,
            load,
            uavs,
            wake: Wake::Gate,
            payload_bytes: 0,
            recorder: false,
        }
    }

    fn tick(tick: i64, intended_ms: u64, skipped: u32, opened_ms: u64) -> TickRecord {
        let (intended_ns, opened_ns) = (intended_ms * MS, opened_ms * MS);
        TickRecord { tick, intended_ns, opened_ns, skipped, collected_ns: opened_ns, ..TickRecord::default() }
    }

    fn step(tick: i64, member: u32, sent_ms: u64) -> StepRecord {
        let sent_ns = sent_ms * MS;
        StepRecord {
            tick,
            member,
            woke_ns: sent_ns,
            read_ns: sent_ns,
            sent_ns,
            seen_ns: sent_ns + MS,
            sending_ns: 0,
            reserved: 0,
        }
    }

    fn delays_ms(case: &Case, trace: &Trace, ended_ms: u64) -> Vec<(u64, u64)> {
        let delays = tick_delays(case, ended_ms * MS, trace);
        delays.iter().map(|delay| (delay.intended_ns / MS, delay.delay_ns / MS)).collect()
    }

    /// At 100 Hz, each tick is answered within 1 ms. The world stalls from 21 ms to 67 ms, so the ticks due at 30, 40, 50 and
    /// 60 ms begin as one tick at 67 ms, answered at 68 ms. They took 38, 28, 18 and 8 ms; that is four samples, not one of
    /// 1 ms.
    #[test]
    fn a_planted_stall_is_charged_to_every_tick_that_it_delayed() {
        let trace = Trace {
            ticks: vec![
                tick(0, 0, 0, 0),
                tick(1, 10, 0, 10),
                tick(2, 20, 0, 20),
                tick(3, 30, 3, 67),
                tick(4, 70, 0, 70),
            ],
            steps: vec![step(0, 0, 1), step(1, 0, 11), step(2, 0, 21), step(3, 0, 68), step(4, 0, 71)],
        };
        let paced = case(Load::Paced(100), 1);
        let expected = [(0, 1), (10, 1), (20, 1), (30, 38), (40, 28), (50, 18), (60, 8), (70, 1)];
        assert_eq!(delays_ms(&paced, &trace, 80), expected);
        let head = TraceHead { began_ns: 0, ended_ns: 80 * MS, ..TraceHead::default() };
        let repeat = repeat(&paced, &head, &trace);
        assert_eq!((repeat.ticks, repeat.missed_deadlines), (5, 3));
        assert_eq!(repeat.hops[&Hop::Tick].n(), 8);
        assert_eq!(repeat.strip.iter().map(|piece| piece.ticks).sum::<u64>(), 8);
        assert!(!repeat.hops.contains_key(&Hop::Return));
    }

    /// Agent 1 sleeps through ticks 1 and 2, and answers tick 3 at 32 ms, so ticks 1 and 2 lasted until then.
    #[test]
    fn an_agent_that_skips_ticks_is_charged_for_them() {
        let ticks = (0..4).map(|number| tick(number, 10 * number as u64, 0, 10 * number as u64)).collect();
        let steps = vec![
            step(0, 0, 1),
            step(0, 1, 2),
            step(1, 0, 11),
            step(2, 0, 21),
            step(3, 0, 31),
            step(3, 1, 32),
        ];
        let trace = Trace { ticks, steps };
        let expected = [(0, 2), (10, 22), (20, 12), (30, 2)];
        assert_eq!(delays_ms(&case(Load::Paced(100), 2), &trace, 40), expected);
    }

    #[test]
    fn a_late_answer_counts_and_a_missing_one_lasts_until_the_end() {
        let ticks = vec![tick(0, 0, 0, 0), tick(1, 10, 0, 10)];
        let trace = Trace { ticks, steps: vec![step(0, 0, 14)] };
        assert_eq!(delays_ms(&case(Load::Paced(100), 1), &trace, 20), [(0, 14), (10, 10)]);
    }

    #[test]
    fn a_closed_loop_tick_lasts_until_its_last_answer_is_read() {
        let trace =
            Trace { ticks: vec![tick(5, 100, 0, 100)], steps: vec![step(5, 0, 103), step(5, 1, 101)] };
        let closed = case(Load::Closed, 2);
        assert_eq!(delays_ms(&closed, &trace, 200), [(100, 4)]);
        let repeat = repeat(&closed, &TraceHead::default(), &trace);
        assert_eq!(repeat.hops[&Hop::Return].n(), 2);
        assert_eq!(repeat.hops[&Hop::Wake].n(), 2);
    }

    #[test]
    fn time_in_the_law_and_in_iceoryx2_is_summed_over_all_agents() {
        let part =
            StepRecord { woke_ns: 10, read_ns: 30, sent_ns: 35, sending_ns: 3, ..StepRecord::default() };
        let open = TickRecord {
            opened_ns: 0,
            published_ns: 7,
            looked_ns: 40,
            collected_ns: 42,
            ..TickRecord::default()
        };
        let trace = Trace { ticks: vec![open], steps: vec![part, StepRecord { member: 1, ..part }] };
        let swarm = case(Load::Closed, 2);
        let usage = repeat(&swarm, &TraceHead::default(), &trace).usage;
        assert_eq!((usage.law_ns_per_tick, usage.ipc_ns_per_tick), (10.0, 55.0));
        let pipe = Case { carrier: Carrier::Pipe, ..swarm };
        let usage = repeat(&pipe, &TraceHead::default(), &trace).usage;
        assert_eq!((usage.law_ns_per_tick, usage.ipc_ns_per_tick), (0.0, 0.0));
    }

    #[test]
    fn an_empty_trace_gives_an_empty_repeat() {
        let repeat = repeat(&case(Load::Closed, 3), &TraceHead::default(), &Trace::default());
        assert_eq!((repeat.ticks, repeat.took_s), (0, 0.0));
        assert!(repeat.hops.is_empty() && repeat.strip.len() == SLICES);
    }
}
