//! From stamps to latencies: how long each hop took, and the whole tick.
//!
//! Where ticks are paced, a tick takes from when it *should* have begun: a stall is charged to every tick that it delayed,
//! and to every one that it kept from beginning (coordinated omission). Pure: never reads a clock.

use super::{
    result::{Case, Hop, Load, Piece, Repeat, Subject, Usage},
    samples::Samples,
};
use ringwing_bus::{StepRecord, TickRecord, Trace, TraceHead};
use std::collections::BTreeMap;

/// Pieces that the time of a repeat is shown in.
const PIECES: usize = 60;

/// The repeat that `trace` tells of; its place and its beginning in the benchmark are left to fill in.
pub(super) fn repeat(case: &Case, head: &TraceHead, trace: &Trace) -> Repeat {
    let delays = delays(case, head.ended_ns, trace);
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

/// From the first tick's beginning to the end of the last.
fn took_ns(head: &TraceHead, trace: &Trace) -> u64 {
    let began_ns = trace.ticks.first().map_or(head.began_ns, |tick| tick.opened_ns);
    let ended_ns = trace.ticks.last().map_or(head.ended_ns, |tick| tick.collected_ns);
    ended_ns.saturating_sub(began_ns)
}

/// A tick that began, or should have, and how long after that all had answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Delay {
    intended_ns: u64,
    delay_ns: u64,
}

/// Of every tick that should have begun. One that somebody never answered is answered by that one's next answer, and if
/// there is none, it lasts at least until the end.
fn delays(case: &Case, ended_ns: u64, trace: &Trace) -> Vec<Delay> {
    let answers = answers(case, trace);
    let mut latest = vec![ended_ns; case.uavs as usize];
    let mut delays = Vec::with_capacity(trace.ticks.len());
    for (tick, answered) in trace.ticks.iter().zip(answers.chunks(latest.len())).rev() {
        for (latest, answered) in latest.iter_mut().zip(answered).filter(|(_, answered)| **answered != 0) {
            *latest = *answered;
        }
        let last_ns = latest.iter().max().copied().unwrap_or(ended_ns);
        delays.extend(
            intended(tick, period_ns(case))
                .rev()
                .map(|intended_ns| Delay { intended_ns, delay_ns: last_ns.saturating_sub(intended_ns) }),
        );
    }
    delays.reverse();
    delays
}

/// When the ticks should have begun that `tick` stands for: itself, and those that were skipped before it.
fn intended(tick: &TickRecord, period_ns: u64) -> impl DoubleEndedIterator<Item = u64> + use<> {
    let first_ns = tick.intended_ns;
    (0..=u64::from(tick.skipped)).map(move |number| first_ns + number * period_ns)
}

fn period_ns(case: &Case) -> u64 {
    match case.load {
        Load::Closed => 0,
        Load::Paced(rate_hz) => 1_000_000_000 / u64::from(rate_hz),
    }
}

/// For each tick, when each agent's answer was there, or 0: an answer is there once it is read, and where ticks are paced,
/// once it is handed over, for the world reads it at its own time.
fn answers(case: &Case, trace: &Trace) -> Vec<u64> {
    let members = case.uavs as usize;
    let mut answers = vec![0; trace.ticks.len() * members];
    for step in &trace.steps {
        let tick = place(trace, step).filter(|_| (step.member as usize) < members);
        if let Some(tick) = tick {
            answers[tick * members + step.member as usize] =
                if case.load == Load::Closed { step.seen_ns } else { step.sent_ns };
        }
    }
    answers
}

/// The place of a step's tick: ticks are numbered without a gap.
fn place(trace: &Trace, step: &StepRecord) -> Option<usize> {
    let first = trace.ticks.first()?.tick;
    usize::try_from(step.tick - first).ok().filter(|place| *place < trace.ticks.len())
}

fn hops(case: &Case, trace: &Trace, delays: &[Delay]) -> BTreeMap<Hop, Samples> {
    let mut hops: BTreeMap<Hop, Samples> = BTreeMap::new();
    let mut record = |hop, from_ns: u64, to_ns: u64| {
        hops.entry(hop).or_default().record(to_ns.saturating_sub(from_ns));
    };
    for step in &trace.steps {
        let Some(place) = place(trace, step) else { continue };
        record(Hop::Wake, trace.ticks[place].opened_ns, step.woke_ns);
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
    let of_steps = |span: fn(&StepRecord) -> u64| trace.steps.iter().map(span).sum::<u64>();
    let of_ticks = |span: fn(&TickRecord) -> u64| trace.ticks.iter().map(span).sum::<u64>();
    let law_ns = of_steps(|step| step.sent_ns.saturating_sub(step.read_ns));
    let ipc_ns = of_steps(|step| step.read_ns.saturating_sub(step.woke_ns) + step.sending_ns)
        + of_ticks(|tick| tick.published_ns.saturating_sub(tick.opened_ns))
        + of_ticks(|tick| tick.collected_ns.saturating_sub(tick.looked_ns));
    let of_swarm = if case.subject == Subject::Swarm { 1.0 } else { 0.0 };
    Usage {
        user_s,
        system_s,
        voluntary_switches: head.used.voluntary_switches,
        involuntary_switches: head.used.involuntary_switches,
        law_ns_per_tick: of_swarm * law_ns as f64 / ticks,
        ipc_ns_per_tick: of_swarm * ipc_ns as f64 / ticks,
        agent_pss_bytes: head.agent_pss_bytes,
    }
}

/// Each tick belongs to the piece of time that it should have begun in.
fn strip(head: &TraceHead, delays: &[Delay]) -> Vec<Piece> {
    let length_ns = head.ended_ns.saturating_sub(head.began_ns).max(1);
    let mut pieces = vec![Vec::new(); PIECES];
    for delay in delays {
        let since_ns = delay.intended_ns.saturating_sub(head.began_ns);
        let piece = (u128::from(since_ns) * PIECES as u128 / u128::from(length_ns)) as usize;
        pieces[piece.min(PIECES - 1)].push(delay.delay_ns);
    }
    pieces.into_iter().map(piece).collect()
}

fn piece(mut delays_ns: Vec<u64>) -> Piece {
    delays_ns.sort_unstable();
    Piece {
        ticks: delays_ns.len() as u64,
        p50_ns: delays_ns.get(delays_ns.len().saturating_sub(1) / 2).copied().unwrap_or_default(),
        max_ns: delays_ns.last().copied().unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::result::Wake;

    const MS: u64 = 1_000_000;

    fn case(load: Load, uavs: u32) -> Case {
        Case { subject: Subject::Swarm, load, uavs, wake: Wake::Gate, payload_bytes: 0, recorder: false }
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
        let delays = delays(case, ended_ms * MS, trace);
        delays.iter().map(|delay| (delay.intended_ns / MS, delay.delay_ns / MS)).collect()
    }

    /// At 100 Hz, answered within 1 ms; the world stalls from 21 ms to 67 ms. Ticks 3 to 6, due at 30, 40, 50 and 60 ms,
    /// begin as one tick at 67 ms, answered at 68 ms: they took 38, 28, 18 and 8 ms, and not 1 ms once.
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

    /// Agent 1 sleeps through ticks 1 and 2, and answers tick 3 at 32 ms: ticks 1 and 2 took until then.
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
    fn an_answer_that_comes_a_tick_late_counts_and_one_that_never_comes_lasts_until_the_end() {
        let ticks = vec![tick(0, 0, 0, 0), tick(1, 10, 0, 10)];
        let trace = Trace { ticks, steps: vec![step(0, 0, 14)] };
        assert_eq!(delays_ms(&case(Load::Paced(100), 1), &trace, 20), [(0, 14), (10, 10)]);
    }

    #[test]
    fn in_a_closed_loop_a_tick_lasts_until_its_last_answer_is_read() {
        let trace =
            Trace { ticks: vec![tick(5, 100, 0, 100)], steps: vec![step(5, 0, 103), step(5, 1, 101)] };
        let closed = case(Load::Closed, 2);
        assert_eq!(delays_ms(&closed, &trace, 200), [(100, 4)]);
        let repeat = repeat(&closed, &TraceHead::default(), &trace);
        assert_eq!(repeat.hops[&Hop::Return].n(), 2);
        assert_eq!(repeat.hops[&Hop::Wake].n(), 2);
    }

    #[test]
    fn the_law_and_the_messages_are_summed_over_all_agents() {
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
        let pipe = Case { subject: Subject::Pipe, ..swarm };
        let usage = repeat(&pipe, &TraceHead::default(), &trace).usage;
        assert_eq!((usage.law_ns_per_tick, usage.ipc_ns_per_tick), (0.0, 0.0));
    }

    #[test]
    fn nothing_measured_is_nothing_and_no_panic() {
        let repeat = repeat(&case(Load::Closed, 3), &TraceHead::default(), &Trace::default());
        assert_eq!((repeat.ticks, repeat.took_s), (0, 0.0));
        assert!(repeat.hops.is_empty() && repeat.strip.len() == PIECES);
    }
}
