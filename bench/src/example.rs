//! A made-up result, for the tests of everything that shows results.

use crate::{
    case::{Carrier, Case, Load, Topology},
    latencies::Latencies,
    result::{FORMAT, Hop, Machine, Measured, Repeat, Results, TimeSlice, Usage},
};
use ringwing_scenario::Wake;
use std::collections::BTreeMap;

/// Tick times of each round, as multiples of those of the first.
const ROUNDS: [f64; 4] = [1.0, 1.5, 1.1, 0.9];
const TICKS: u64 = 2_000;

/// Three sizes of swarm, gate and pipe in a closed loop, and a paced swarm without its floor.
pub(crate) fn results() -> Results {
    let closed = [
        (1, 7_000.0, 5_000.0, 30_000.0),
        (6, 14_000.0, 10_000.0, 66_000.0),
        (30, 80_000.0, 48_000.0, 230_000.0),
    ];
    let mut cases = Vec::new();
    for (uavs, swarm, gate, pipe) in closed {
        cases.push(measured(Carrier::Swarm, Load::Closed, uavs, swarm));
        cases.push(measured(Carrier::Gate, Load::Closed, uavs, gate));
        cases.push(measured(Carrier::Pipe, Load::Closed, uavs, pipe));
    }
    cases.push(measured(Carrier::Swarm, Load::Paced(100), 6, 180_000.0));
    Results {
        format: FORMAT.into(),
        ringwing: "0.1.0".into(),
        began: "2026-11-22T20:00:00Z".into(),
        command: "ringwing bench --uavs 1,6,30 --rate 100 --seed 7".into(),
        seed: 7,
        seed_text: "7".into(),
        machine: machine(),
        interrupted: false,
        cases,
    }
}

fn machine() -> Machine {
    let facts = [("processor", "Example 3000"), ("cores", "2 of 2")];
    Machine {
        facts: facts.map(|(name, value)| (name.into(), value.into())).into(),
        warnings: vec!["the cores are 60 % busy with other work: stop it, or measure later".into()],
    }
}

/// The case of `results` with these properties.
#[expect(clippy::needless_pass_by_value, reason = "callers write the carrier in place")]
pub(crate) fn find(results: &Results, carrier: Carrier, load: Load, uavs: u32) -> &Measured {
    let is_it = |measured: &&Measured| {
        let case = &measured.case;
        case.carrier == carrier && (case.load, case.uavs) == (load, uavs)
    };
    results.cases.iter().find(is_it).expect("the example has this case")
}

fn measured(carrier: Carrier, load: Load, uavs: u32, typical_ns: f64) -> Measured {
    let case = Case {
        carrier,
        topology: Topology::Hub,
        load,
        uavs,
        wake: Wake::Gate,
        payload_bytes: 0,
        recorder: false,
    };
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
        hops: hops(&case.carrier, typical_ns, is_paced),
        missed_deadlines: if is_paced { u64::from(round) } else { 0 },
        reused_commands: if is_paced { 6 * u64::from(round) } else { 0 },
        usage: usage(case, typical_ns),
        strip: strip(typical_ns),
    }
}

fn hops(carrier: &Carrier, typical_ns: f64, is_paced: bool) -> BTreeMap<Hop, Latencies> {
    let shares: &[(Hop, f64)] = match (carrier, is_paced) {
        (Carrier::Swarm, true) => {
            &[(Hop::Wake, 0.5), (Hop::Read, 0.2), (Hop::Compute, 0.1), (Hop::Tick, 1.0)]
        }
        (Carrier::Swarm, false) => {
            &[(Hop::Wake, 0.3), (Hop::Read, 0.2), (Hop::Compute, 0.1), (Hop::Return, 0.3), (Hop::Tick, 1.0)]
        }
        _ => &[(Hop::Tick, 1.0)],
    };
    shares.iter().map(|(hop, share)| (*hop, tailed(share * typical_ns))).collect()
}

/// Latencies with a long tail: the i-th of n is the slower the nearer i is to n.
fn tailed(typical_ns: f64) -> Latencies {
    let mut samples = Latencies::new();
    for i in 0..TICKS {
        let left = (TICKS - i) as f64 / TICKS as f64;
        samples.record((typical_ns * (0.8 + 0.2 / left.sqrt())) as u64);
    }
    samples
}

fn usage(case: &Case, typical_ns: f64) -> Usage {
    let is_swarm = case.carrier == Carrier::Swarm;
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

fn strip(typical_ns: f64) -> Vec<TimeSlice> {
    let slice = |index: u64| TimeSlice {
        ticks: TICKS / 50,
        p50_ns: (typical_ns * (1.0 + 0.01 * (index % 7) as f64)) as u64,
        max_ns: (typical_ns * if index == 31 { 40.0 } else { 1.5 + 0.3 * (index % 5) as f64 }) as u64,
    };
    (0..50).map(slice).collect()
}
