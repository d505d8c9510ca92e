//! The timestamps that the processes of a peer program leave, and the checks that they can be true.
//!
//! Each file holds records of four little-endian 64-bit integers, one for every tick from the first to the last. All times
//! are nanoseconds of `CLOCK_MONOTONIC`.
//!
//! Must never repair a record: a program with a wrong one measures something else than it says.

use crate::{
    case::{Case, Load},
    trace::{StepRecord, TickRecord, Trace, TraceHead},
};

/// Size of an integer, in bytes.
const WORD: usize = 8;
/// Integers in a record.
const WORDS: usize = 4;
/// By how much of a period two due times may miss a whole number of periods. Less refuses programs that compute with
/// floating-point seconds; more accepts programs whose schedule slips.
const DUE_TOLERANCE: f64 = 0.01;

/// The files that the processes of a peer program left.
#[derive(Debug)]
pub(super) struct RecordFiles {
    /// The world's: tick, due, opened, collected.
    pub(super) world: Vec<u8>,
    /// Each agent's: tick, woke, read, sent.
    pub(super) agents: Vec<Vec<u8>>,
}

/// Name of the world's file.
pub(super) const WORLD_FILE: &str = "world.trace";

/// Name of the file of UAV `uav`.
pub(super) fn agent_file(uav: usize) -> String {
    format!("agent-{uav}.trace")
}

#[derive(Debug, Clone, Copy)]
struct WorldRecord {
    tick: i64,
    due_ns: u64,
    opened_ns: u64,
    collected_ns: u64,
}

impl RecordFiles {
    /// The ticks that began within the measured time of `head`, with all answers.
    ///
    /// # Errors
    /// What is wrong with which file.
    pub(super) fn trace(&self, case: &Case, head: &TraceHead) -> Result<Trace, String> {
        let world = world_records(&self.world).map_err(|why| format!("{WORLD_FILE}: {why}"))?;
        let is_measured = |record: &WorldRecord| (head.began_ns..=head.ended_ns).contains(&record.opened_ns);
        // Ticks of the warm-up come first.
        let warm_up = world.iter().take_while(|record| !is_measured(record)).count();
        let measured: Vec<WorldRecord> = world[warm_up..].iter().copied().take_while(is_measured).collect();
        if measured.is_empty() {
            return Err(format!(
                "{WORLD_FILE}: no tick was opened between the lines `warm` and `done`; times have to be \
                 nanoseconds of CLOCK_MONOTONIC"
            ));
        }
        // Only measured ticks: the schedule starts anew after the warm-up, so due times across it fit no grid.
        let ticks = tick_records(case.load, &measured).map_err(|why| format!("{WORLD_FILE}: {why}"))?;
        let mut steps = Vec::with_capacity(ticks.len() * self.agents.len());
        for (member, file) in self.agents.iter().enumerate() {
            let answers = answers(file, &world, member as u32);
            let answers = answers.map_err(|why| format!("{}: {why}", agent_file(member + 1)))?;
            steps.extend_from_slice(&answers[warm_up..warm_up + measured.len()]);
        }
        Ok(Trace { ticks, steps })
    }
}

/// The records in `bytes`: a tick and three times.
fn records(bytes: &[u8]) -> Result<Vec<(i64, [u64; 3])>, String> {
    let (records, rest) = bytes.as_chunks::<{ WORD * WORDS }>();
    if !rest.is_empty() {
        return Err(format!("{} bytes are not a number of records of {} bytes", bytes.len(), WORD * WORDS));
    }
    Ok(records.iter().map(record).collect())
}

fn record(bytes: &[u8; WORD * WORDS]) -> (i64, [u64; 3]) {
    let (words, _) = bytes.as_chunks::<WORD>();
    (i64::from_le_bytes(words[0]), [1, 2, 3].map(|index| u64::from_le_bytes(words[index])))
}

fn world_records(bytes: &[u8]) -> Result<Vec<WorldRecord>, String> {
    let mut world: Vec<WorldRecord> = Vec::new();
    for (tick, [due_ns, opened_ns, collected_ns]) in records(bytes)? {
        if let Some(last) = world.last() {
            if tick != last.tick + 1 {
                return Err(format!("tick {tick} follows tick {}", last.tick));
            }
            // A world that does not wait for all answers measures how fast it sends, and not how long a tick takes.
            if opened_ns < last.collected_ns {
                return Err(format!("tick {tick} was opened before tick {} was answered", last.tick));
            }
        }
        if collected_ns < opened_ns {
            return Err(format!("tick {tick} was answered before it was opened"));
        }
        world.push(WorldRecord { tick, due_ns, opened_ns, collected_ns });
    }
    Ok(world)
}

fn tick_records(load: Load, world: &[WorldRecord]) -> Result<Vec<TickRecord>, String> {
    let skipped = match load {
        Load::Closed => vec![0; world.len()],
        Load::Paced(rate_hz) => skipped(world, 1e9 / f64::from(rate_hz))?,
    };
    let tick = |(record, skipped): (&WorldRecord, u32)| TickRecord {
        tick: record.tick,
        intended_ns: if load == Load::Closed { record.opened_ns } else { record.due_ns },
        opened_ns: record.opened_ns,
        // The records hold no such times. Equal stamps make these steps 0 instead of inventing a share.
        published_ns: record.opened_ns,
        looked_ns: record.collected_ns,
        collected_ns: record.collected_ns,
        skipped,
        reused: 0,
    };
    Ok(world.iter().zip(skipped).map(tick).collect())
}

/// For each tick, how many ticks after it were due and never began.
fn skipped(world: &[WorldRecord], period_ns: f64) -> Result<Vec<u32>, String> {
    let early = world.iter().find(|record| record.opened_ns < record.due_ns);
    if let Some(early) = early {
        return Err(format!("tick {} was opened before it was due", early.tick));
    }
    let to_next = |pair: &[WorldRecord]| {
        let periods = (pair[1].due_ns as f64 - pair[0].due_ns as f64) / period_ns;
        if periods < 0.5 || (periods - periods.round()).abs() > DUE_TOLERANCE {
            return Err(format!(
                "tick {} was due {periods:.3} periods after tick {}; due times have to be a whole number of \
                 periods apart, however late a tick begins",
                pair[1].tick, pair[0].tick
            ));
        }
        Ok(periods.round() as u32 - 1)
    };
    let last = world.iter().rev().take(1);
    let of_last = last.map(|record| Ok(((record.opened_ns - record.due_ns) as f64 / period_ns) as u32));
    world.windows(2).map(to_next).chain(of_last).collect()
}

/// The answers of agent `member` to all ticks of `world`.
fn answers(bytes: &[u8], world: &[WorldRecord], member: u32) -> Result<Vec<StepRecord>, String> {
    let answers = records(bytes)?;
    if answers.len() != world.len() {
        return Err(format!("{} of {} ticks have an answer", answers.len(), world.len()));
    }
    let answer = |((tick, [woke_ns, read_ns, sent_ns]), record): ((i64, [u64; 3]), &WorldRecord)| {
        if tick != record.tick {
            return Err(format!("tick {tick} stands in place of tick {}", record.tick));
        }
        let seen_ns = record.collected_ns;
        if ![record.opened_ns, woke_ns, read_ns, sent_ns, seen_ns].is_sorted() {
            return Err(format!(
                "tick {tick}: its times are not between the world's `opened` and `collected`, in order"
            ));
        }
        Ok(StepRecord { tick, woke_ns, read_ns, sent_ns, seen_ns, sending_ns: 0, member, reserved: 0 })
    };
    answers.into_iter().zip(world).map(answer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Carrier, Topology};
    use ringwing_scenario::Wake;

    const MS: i64 = 1_000_000;
    const HEAD: TraceHead = TraceHead {
        ticks: 0,
        steps: 0,
        began_ns: 15 * MS as u64,
        ended_ns: 100 * MS as u64,
        used: crate::usage::ProcessUsage {
            run_ns: 0,
            user_ticks: 0,
            system_ticks: 0,
            voluntary_switches: 0,
            involuntary_switches: 0,
        },
        agent_pss_bytes: 0,
    };

    fn case(load: Load) -> Case {
        let carrier = Carrier::Peer("mine".into());
        let (topology, wake) = (Topology::Hub, Wake::Gate);
        Case { carrier, topology, load, uavs: 1, wake, payload_bytes: 0, recorder: false }
    }

    fn bytes(records: &[[i64; 4]]) -> Vec<u8> {
        records.iter().flatten().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// One warm-up tick and three measured ticks at 100 Hz; the second measured tick is late. Times in ms.
    const WORLD: [[i64; 4]; 4] = [
        [0, 10 * MS, 10 * MS, 12 * MS],
        [1, 20 * MS, 20 * MS, 22 * MS],
        [2, 30 * MS, 56 * MS, 58 * MS],
        [3, 60 * MS, 60 * MS, 62 * MS],
    ];

    /// Answers to `world`, each half a millisecond after its tick was opened.
    fn agent(world: &[[i64; 4]]) -> Vec<[i64; 4]> {
        let answer = |[tick, _, opened, _]: &[i64; 4]| [*tick, opened + 1000, opened + 2000, opened + MS / 2];
        world.iter().map(answer).collect()
    }

    fn trace(load: Load, world: &[[i64; 4]], agent: &[[i64; 4]]) -> Result<Trace, String> {
        RecordFiles { world: bytes(world), agents: vec![bytes(agent)] }.trace(&case(load), &HEAD)
    }

    #[test]
    fn the_measured_ticks_are_kept_and_skipped_ones_counted() {
        let trace = trace(Load::Paced(100), &WORLD, &agent(&WORLD)).unwrap();
        let ticks: Vec<_> = trace.ticks.iter().map(|tick| (tick.tick, tick.skipped)).collect();
        assert_eq!(ticks, [(1, 0), (2, 2), (3, 0)], "ticks were due at 40 and 50 ms, too");
        assert_eq!(trace.ticks[1].intended_ns, 30 * MS as u64);
        let steps: Vec<_> = trace.steps.iter().map(|step| (step.tick, step.seen_ns / MS as u64)).collect();
        assert_eq!(steps, [(1, 22), (2, 58), (3, 62)]);
    }

    #[test]
    fn a_closed_loop_is_never_late() {
        let trace = trace(Load::Closed, &WORLD, &agent(&WORLD)).unwrap();
        assert!(trace.ticks.iter().all(|tick| tick.skipped == 0 && tick.intended_ns == tick.opened_ns));
    }

    /// The error for the example's records after `change`.
    fn error(change: impl FnOnce(&mut Vec<[i64; 4]>, &mut Vec<[i64; 4]>)) -> String {
        let (mut world, mut agent) = (WORLD.to_vec(), agent(&WORLD));
        change(&mut world, &mut agent);
        trace(Load::Paced(100), &world, &agent).unwrap_err()
    }

    #[test]
    fn records_that_cannot_be_true_are_refused() {
        for (problem, found) in [
            ("world.trace: no tick was opened between", error(|world, _| world.clear())),
            ("world.trace: tick 3 follows tick 1", error(|world, _| world.retain(|record| record[0] != 2))),
            ("opened before tick 2 was answered", error(|world, _| world[3][2] = 57 * MS)),
            ("tick 2 was answered before it was opened", error(|world, _| world[2][3] = 55 * MS)),
            ("tick 1 was opened before it was due", error(|world, _| world[1][1] = 21 * MS)),
            ("due 0.400 periods after", error(|world, _| (world[2][1], world[3][1]) = (24 * MS, 60 * MS))),
            ("agent-1.trace: 3 of 4 ticks", error(|_, agent| agent.truncate(3))),
            ("tick 7 stands in place of tick 1", error(|_, agent| agent[1][0] = 7)),
            ("agent-1.trace: tick 1: its times", error(|_, agent| agent[1][1] = 19 * MS)),
            ("agent-1.trace: tick 1: its times", error(|_, agent| agent[1][3] = 23 * MS)),
        ] {
            assert!(found.contains(problem), "expected {problem:?}: {found}");
        }
        let torn = RecordFiles { world: vec![0; 33], agents: Vec::new() };
        assert!(torn.trace(&case(Load::Closed), &HEAD).unwrap_err().contains("records of 32 bytes"));
    }
}
