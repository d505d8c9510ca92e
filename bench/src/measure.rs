//! Keeps every timestamp of every tick while a case is measured: of the whole tick and of every agent's part in it.
//!
//! Used by the world of a measured flight and by the hub of a [`transport`](crate::transport).
//!
//! Must never choose what to keep: late answers, long ticks and ticks that never began all count.

use crate::{
    proc_files::{pss_bytes, usage_of},
    trace::{StepRecord, TickRecord, Trace, TraceHead},
    usage::ProcessUsage,
};
use ringwing_bus::{BusError, Gate, PacedTick, Proceed, Stamps, TickProbe, monotonic_ns};
use ringwing_flight::{Part, Tick, UavId, payload::MAX_UAVS};
use std::path::PathBuf;

/// What to measure, and where to write it: hidden arguments of the process that opens ticks.
#[derive(Debug, Clone, clap::Args)]
pub struct MeasureArgs {
    /// Write every timestamp of every tick to this file.
    #[arg(long, hide = true, value_name = "FILE", requires_all = ["warm_up_s", "measure_s"])]
    pub measure_into: Option<PathBuf>,
    /// Begin to measure after this time.
    #[arg(long, hide = true, value_name = "SECONDS", requires = "measure_into")]
    pub warm_up_s: Option<f64>,
    /// End the run after measuring for this time.
    #[arg(long, hide = true, value_name = "SECONDS", requires = "measure_into")]
    pub measure_s: Option<f64>,
}

impl MeasureArgs {
    /// The arguments as a command line has them; none if nothing is to be measured.
    pub fn to_arguments(&self) -> Vec<String> {
        let Some(file) = &self.measure_into else { return Vec::new() };
        let seconds = |seconds: Option<f64>| seconds.unwrap_or_default().to_string();
        let [file, warm_up, measure] =
            [file.display().to_string(), seconds(self.warm_up_s), seconds(self.measure_s)];
        let pairs = [("--measure-into", file), ("--warm-up-s", warm_up), ("--measure-s", measure)];
        pairs.into_iter().flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }
}

/// Memory reserved for ticks, as a multiple of what the rate during the warm-up predicts. Less may allocate while
/// measuring; more only takes memory.
const SPARE: f64 = 1.5;
/// Shortest warm-up whose rate predicts anything. In less, a handful of slow first ticks decide.
const MIN_WARM_UP_NS: u64 = 10_000_000;
/// Ticks that memory is reserved for after a shorter warm-up.
const UNPREDICTED_TICKS: usize = 10_000;
/// Most answers that memory is reserved for, 56 bytes each: 0.9 GB. Beyond that, the trace grows while measuring.
const MAX_RESERVED_STEPS: usize = 16 << 20;

/// A measurement in progress.
#[derive(Debug)]
pub struct Measure {
    path: PathBuf,
    phase: MeasurePhase,
    warm_up_ns: u64,
    measure_ns: u64,
    warm_up_ticks: u64,
    trace: Trace,
    head: TraceHead,
    /// What all processes had used when the warm-up ended.
    usage_before: ProcessUsage,
    /// When the next tick is due; `None` in a closed loop.
    due: Option<PacedTick>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MeasurePhase {
    WaitingForFirstTick,
    WarmingUp { since_ns: u64 },
    Measuring { until_ns: u64 },
    Done,
}

impl Measure {
    /// The measurement that `args` ask for, if any.
    pub fn new(args: &MeasureArgs) -> Option<Self> {
        let nanoseconds = |seconds: Option<f64>| (seconds.unwrap_or_default().max(0.0) * 1e9) as u64;
        Some(Self {
            path: args.measure_into.clone()?,
            phase: MeasurePhase::WaitingForFirstTick,
            warm_up_ns: nanoseconds(args.warm_up_s),
            measure_ns: nanoseconds(args.measure_s),
            warm_up_ticks: 0,
            trace: Trace::default(),
            head: TraceHead::default(),
            usage_before: ProcessUsage::default(),
            due: None,
        })
    }

    fn begin(&mut self, gate: &Gate) {
        self.reserve(agents(gate).count());
        self.usage_before = processes(gate).map(usage_of).sum::<ProcessUsage>();
        // Reserving and reading usage took time that belongs to no tick.
        let now_ns = monotonic_ns();
        (self.head.began_ns, self.due) = (now_ns, None);
        self.phase = MeasurePhase::Measuring { until_ns: now_ns + self.measure_ns };
    }

    /// Reserves memory for the trace of `agents` agents and touches it, so that no tick waits for a page fault.
    fn reserve(&mut self, agents: usize) {
        let agents = agents.max(1);
        let ticks = self.predicted_ticks().min(MAX_RESERVED_STEPS / agents);
        // Not zeros: the kernel maps zeroed pages only once they are written.
        self.trace.ticks.resize(ticks, TickRecord { tick: 1, ..TickRecord::default() });
        self.trace.ticks.clear();
        self.trace.steps.resize(ticks * agents, StepRecord { tick: 1, ..StepRecord::default() });
        self.trace.steps.clear();
    }

    fn predicted_ticks(&self) -> usize {
        if self.warm_up_ns < MIN_WARM_UP_NS {
            return UNPREDICTED_TICKS;
        }
        let warm_ups = self.measure_ns as f64 / self.warm_up_ns as f64;
        // Ten more, because a slow case may finish hardly a tick while it warms up.
        ((self.warm_up_ticks + 10) as f64 * warm_ups * SPARE) as usize
    }

    fn end(&mut self, gate: &Gate, now_ns: u64) {
        self.phase = MeasurePhase::Done;
        self.head.ended_ns = now_ns;
        // Read while all processes still live: the kernel forgets the usage of a process that ends.
        self.head.used = processes(gate).map(usage_of).sum::<ProcessUsage>() - self.usage_before;
        self.head.agent_pss_bytes = agents(gate).map(pss_bytes).max().unwrap_or_default();
    }

    fn is_measuring(&self) -> bool {
        matches!(self.phase, MeasurePhase::Measuring { .. })
    }

    fn stamp(&mut self, set: impl FnOnce(&mut TickRecord, u64)) {
        // During the warm-up there is no tick to stamp.
        if let Some(tick) = self.trace.ticks.last_mut() {
            set(tick, monotonic_ns());
        }
    }
}

impl TickProbe for Measure {
    fn before_tick(&mut self, gate: &Gate) -> Proceed {
        let now_ns = monotonic_ns();
        match self.phase {
            // The warm-up begins with the first tick: before it, the process waits for the others to join.
            MeasurePhase::WaitingForFirstTick => {
                self.phase = MeasurePhase::WarmingUp { since_ns: now_ns };
                Proceed::Fly
            }
            // Beginning takes long enough to miss deadlines, which must not be blamed on the swarm.
            MeasurePhase::WarmingUp { since_ns } if now_ns - since_ns >= self.warm_up_ns => {
                self.begin(gate);
                Proceed::RestartDeadlines
            }
            MeasurePhase::WarmingUp { .. } => {
                self.warm_up_ticks += 1;
                Proceed::Fly
            }
            MeasurePhase::Measuring { until_ns } if is_over(now_ns, until_ns, self.due) => {
                self.end(gate, now_ns);
                Proceed::End
            }
            MeasurePhase::Measuring { .. } => Proceed::Fly,
            MeasurePhase::Done => Proceed::End,
        }
    }

    fn tick_opened(&mut self, tick: Tick, opened_ns: u64) {
        if self.is_measuring() {
            // Without deadlines, a tick is due when it begins.
            let due = self.due.unwrap_or(PacedTick { due_ns: opened_ns, skipped: 0 });
            self.trace.ticks.push(TickRecord {
                tick: tick.0,
                intended_ns: due.due_ns,
                opened_ns,
                skipped: due.skipped,
                ..TickRecord::default()
            });
        }
    }

    fn inputs_published(&mut self) {
        self.stamp(|tick, now_ns| tick.published_ns = now_ns);
    }

    fn collecting_answers(&mut self) {
        self.stamp(|tick, now_ns| tick.looked_ns = now_ns);
    }

    fn answer_seen(&mut self, uav: UavId, tick: Tick, stamps: &Stamps, seen_ns: u64) {
        if self.is_measuring() {
            let Stamps { woke_ns, read_ns, sent_ns, sending_ns } = *stamps;
            // The number comes from another process, so a wrong 0 must not panic here.
            let member = uav.0.saturating_sub(1);
            let step = StepRecord {
                tick: tick.0,
                woke_ns,
                read_ns,
                sent_ns,
                seen_ns,
                sending_ns,
                member,
                reserved: 0,
            };
            self.trace.steps.push(step);
        }
    }

    fn answers_collected(&mut self) {
        self.stamp(|tick, now_ns| tick.collected_ns = now_ns);
    }

    fn tick_finished(&mut self, reused: u32, paced: Option<PacedTick>) {
        // The deadline of the next tick is its intended start.
        self.due = paced;
        if let Some(tick) = self.trace.ticks.last_mut() {
            tick.reused = reused;
        }
    }

    fn is_done(&self) -> bool {
        self.phase == MeasurePhase::Done
    }

    /// Writes the trace, even if the run ended before the measurement did.
    fn run_ended(&mut self, gate: &Gate) -> Result<(), BusError> {
        if self.is_measuring() {
            self.end(gate, monotonic_ns());
        }
        self.trace.save(&self.path, &self.head)
    }
}

/// Whether the measured time is over. A tick that was due in time is still measured, however late it begins: otherwise a
/// stall at the end would not count.
fn is_over(now_ns: u64, until_ns: u64, due: Option<PacedTick>) -> bool {
    due.map_or(now_ns, |paced| paced.due_ns) >= until_ns
}

/// All processes of the run that are ready.
fn processes(gate: &Gate) -> impl Iterator<Item = u32> {
    Part::all(MAX_UAVS).filter_map(|part| gate.ready_process(part))
}

fn agents(gate: &Gate) -> impl Iterator<Item = u32> {
    UavId::all(MAX_UAVS).filter_map(|uav| gate.ready_process(Part::Agent(uav)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_that_was_due_before_the_end_is_measured_however_late_it_begins() {
        let due = |due_ns| Some(PacedTick { due_ns, skipped: 40 });
        assert!(!is_over(999, 1000, None) && is_over(1000, 1000, None));
        assert!(!is_over(5000, 1000, due(990)), "the ticks that the stall delayed would be missing");
        assert!(is_over(5010, 1000, due(5010)));
    }

    #[test]
    fn arguments_are_written_only_for_a_measurement() {
        let mut args = MeasureArgs { measure_into: None, warm_up_s: None, measure_s: None };
        assert!(Measure::new(&args).is_none() && args.to_arguments().is_empty());
        (args.measure_into, args.warm_up_s) = (Some("trace".into()), Some(0.5));
        let expected = ["--measure-into", "trace", "--warm-up-s", "0.5", "--measure-s", "0"];
        assert_eq!(args.to_arguments(), expected);
    }
}
