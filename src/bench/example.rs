//! A result made by hand, for the tests of what is made of results.

use super::{
    result::{Case, FORMAT, Hop, Load, Machine, Measured, Piece, Repeat, Results, Subject, Usage, Wake},
    samples::Samples,
};
use std::collections::BTreeMap;

/// How much slower than the first each round was.
const ROUNDS: [f64; 4] = [1.0, 1.5, 1.1, 0.9];
const TICKS: u64 = 2_000;

/// Two sizes of swarm, gate and pipe in a closed loop, and a paced swarm without its floor.
pub(crate) fn results() -> Results {
    let closed = [
        (1, 7_000.0, 5_000.0, 30_000.0),
        (6, 14_000.0, 10_000.0, 66_000.0),
        (30, 80_000.0, 48_000.0, 230_000.0),
    ];
    let mut cases = Vec::new();
    for (uavs, swarm, gate, pipe) in closed {
        cases.push(measured(Subject::Swarm, Load::Closed, uavs, swarm));
        cases.push(measured(Subject::Gate, Load::Closed, uavs, gate));
        cases.push(measured(Subject::Pipe, Load::Closed, uavs, pipe));
    }
    cases.push(measured(Subject::Swarm, Load::Paced(100), 6, 180_000.0));
    Results {
        format: FORMAT.into(),
        ringwing: "0.1.0".into(),
        began: "2026-11-22T20:00:00Z".into(),
        command: "ringwing bench --uavs 1,6,30 --rate 100 --seed 7".into(),
        seed: 7,
        machine: machine(),
        interrupted: false,
        cases,
    }
}

fn machine() -> Machine {
    let facts = [("processor", "Example 3000"), ("cores", "2 of 2")];
    Machine {
        facts: facts.map(|(name, value)| (name.into(), value.into())).into(),
        warnings: vec!["the machine is busy: 60 % of its time goes elsewhere; end what else runs".into()],
    }
}

/// The case of `results` that is all this.
pub(crate) fn find(results: &Results, subject: Subject, load: Load, uavs: u32) -> &Measured {
    let is_it = |measured: &&Measured| {
        let case = &measured.case;
        (case.subject, case.load, case.uavs) == (subject, load, uavs)
    };
    results.cases.iter().find(is_it).expect("the example has this case")
}

fn measured(subject: Subject, load: Load, uavs: u32, typical_ns: f64) -> Measured {
    let case = Case { subject, load, uavs, wake: Wake::Gate, payload_bytes: 0, recorder: false };
    let repeat = |(round, slower): (u32, f64)| repeat(&case, round, slower * typical_ns);
    let repeats = (0..).zip(ROUNDS).map(repeat).collect();
    Measured { case, repeats, failure: None }
}

fn repeat(case: &Case, round: u32, typical_ns: f64) -> Repeat {
    let is_paced = case.load != Load::Closed;
    let tick_ns = if is_paced { 1e7 } else { typical_ns };
    Repeat {
        place: round,
        began_s: f64::from(round) * 5.0,
        took_s: TICKS as f64 * tick_ns / 1e9,
        ticks: TICKS,
        tick_ns,
        hops: hops(case.subject, typical_ns, is_paced),
        missed_deadlines: if is_paced { u64::from(round) } else { 0 },
        reused_commands: if is_paced { 6 * u64::from(round) } else { 0 },
        usage: usage(case, typical_ns),
        strip: strip(typical_ns),
    }
}

fn hops(subject: Subject, typical_ns: f64, is_paced: bool) -> BTreeMap<Hop, Samples> {
    let shares: &[(Hop, f64)] = match (subject, is_paced) {
        (Subject::Swarm, true) => {
            &[(Hop::Wake, 0.5), (Hop::Read, 0.2), (Hop::Compute, 0.1), (Hop::Tick, 1.0)]
        }
        (Subject::Swarm, false) => {
            &[(Hop::Wake, 0.3), (Hop::Read, 0.2), (Hop::Compute, 0.1), (Hop::Return, 0.3), (Hop::Tick, 1.0)]
        }
        _ => &[(Hop::Tick, 1.0)],
    };
    shares.iter().map(|(hop, share)| (*hop, tailed(share * typical_ns))).collect()
}

/// Samples with a long tail: the i-th of n is the slower the nearer i is to n.
fn tailed(typical_ns: f64) -> Samples {
    let mut samples = Samples::new();
    for i in 0..TICKS {
        let left = (TICKS - i) as f64 / TICKS as f64;
        samples.record((typical_ns * (0.8 + 0.2 / left.sqrt())) as u64);
    }
    samples
}

fn usage(case: &Case, typical_ns: f64) -> Usage {
    let is_swarm = case.subject == Subject::Swarm;
    let busy_s = TICKS as f64 * typical_ns / 1e9;
    Usage {
        user_s: busy_s,
        system_s: 0.6 * busy_s,
        voluntary_switches: TICKS * u64::from(case.uavs),
        involuntary_switches: TICKS / 10,
        law_ns_per_tick: if is_swarm { 0.1 * typical_ns } else { 0.0 },
        ipc_ns_per_tick: if is_swarm { 0.25 * typical_ns } else { 0.0 },
        agent_pss_bytes: if is_swarm { 2_900_000 } else { 0 },
    }
}

fn strip(typical_ns: f64) -> Vec<Piece> {
    let piece = |place: u64| Piece {
        ticks: TICKS / 50,
        p50_ns: (typical_ns * (1.0 + 0.01 * (place % 7) as f64)) as u64,
        max_ns: (typical_ns * if place == 31 { 40.0 } else { 1.5 + 0.3 * (place % 5) as f64 }) as u64,
    };
    (0..50).map(piece).collect()
}
