//! Keeps every stamp of every tick, when somebody measures: of all agents and of the whole tick, for a time.
//!
//! Never there when nobody asks, and never chooses: late answers, long ticks and ticks that never began are all kept.

use ringwing_bus::{
    BusError, Gate, Stamps, StepRecord, TickRecord, Trace, TraceHead, Used, monotonic_ns, usage::pss_bytes,
};
use ringwing_flight::Part;
use std::path::PathBuf;

/// What to measure, and where to leave it.
#[derive(Debug, Clone, clap::Args)]
pub struct MeasureArgs {
    /// Leave every stamp of every tick in this file.
    #[arg(long, hide = true, value_name = "FILE", requires_all = ["warm_up_s", "measure_s"])]
    pub measure_into: Option<PathBuf>,
    /// Begin after so long.
    #[arg(long, hide = true, value_name = "SECONDS", requires = "measure_into")]
    pub warm_up_s: Option<f64>,
    /// End the flight after so long.
    #[arg(long, hide = true, value_name = "SECONDS", requires = "measure_into")]
    pub measure_s: Option<f64>,
}

/// How many times as many ticks as the warm-up promises have room from the beginning.
const ROOM: f64 = 1.5;
/// A warm-up that is shorter promises nothing.
const SHORTEST_PROMISE_NS: u64 = 10_000_000;
/// Room for so many ticks then.
const UNPROMISED_TICKS: usize = 10_000;
/// No more room than for so many answers is made beforehand: 768 MB.
const MOST_STEPS: usize = 16 << 20;

/// A measurement, of the world or of whatever opens ticks in its place.
pub struct Measure {
    path: PathBuf,
    phase: Phase,
    warm_up_ns: u64,
    measure_ns: u64,
    parts: Vec<Part>,
    warm_up_ticks: u64,
    trace: Trace,
    head: TraceHead,
    before: Used,
    /// When the next tick should begin, and how many after it should have, before it does.
    due: Option<(u64, u32)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    WaitingForTheFirst,
    WarmingUp { since_ns: u64 },
    Measuring { until_ns: u64 },
    Done,
}

/// What there is to do before the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Fly on.
    Fly,
    /// The warm-up is over, and noting so took time: deadlines begin anew.
    Begin,
    /// All is measured: fly no further.
    End,
}

impl Measure {
    /// The measurement that `args` ask for, if any, of a swarm of `uavs`.
    pub fn new(args: &MeasureArgs, uavs: u32) -> Option<Self> {
        let nanoseconds = |seconds: Option<f64>| (seconds.unwrap_or_default().max(0.0) * 1e9) as u64;
        Some(Self {
            path: args.measure_into.clone()?,
            phase: Phase::WaitingForTheFirst,
            warm_up_ns: nanoseconds(args.warm_up_s),
            measure_ns: nanoseconds(args.measure_s),
            parts: Part::all(uavs).collect(),
            warm_up_ticks: 0,
            trace: Trace::default(),
            head: TraceHead::default(),
            before: Used::default(),
            due: None,
        })
    }

    pub(crate) fn is_done(&self) -> bool {
        self.phase == Phase::Done
    }

    /// Between two ticks.
    pub fn turn(&mut self, gate: &Gate) -> Turn {
        let now_ns = monotonic_ns();
        match self.phase {
            Phase::WaitingForTheFirst => {
                self.phase = Phase::WarmingUp { since_ns: now_ns };
                Turn::Fly
            }
            Phase::WarmingUp { since_ns } if now_ns - since_ns >= self.warm_up_ns => {
                self.begin(gate);
                Turn::Begin
            }
            Phase::WarmingUp { .. } => {
                self.warm_up_ticks += 1;
                Turn::Fly
            }
            Phase::Measuring { until_ns } if is_over(now_ns, until_ns, self.due) => {
                self.end(gate, now_ns);
                Turn::End
            }
            Phase::Measuring { .. } => Turn::Fly,
            Phase::Done => Turn::End,
        }
    }

    fn begin(&mut self, gate: &Gate) {
        self.reserve();
        self.before = Used::by_all(&self.processes(gate));
        let now_ns = monotonic_ns();
        (self.head.began_ns, self.due) = (now_ns, None);
        self.phase = Phase::Measuring { until_ns: now_ns + self.measure_ns };
    }

    /// Makes room, and touches it, so that the kernel finds no page to hand out while ticks are measured.
    fn reserve(&mut self) {
        let agents = self.parts.iter().filter(|part| matches!(part, Part::Agent(_))).count().max(1);
        let ticks = self.expected_ticks().min(MOST_STEPS / agents);
        // Not zeros, which the kernel would hand out when they are written.
        self.trace.ticks.resize(ticks, TickRecord { tick: 1, ..TickRecord::default() });
        self.trace.ticks.clear();
        self.trace.steps.resize(ticks * agents, StepRecord { tick: 1, ..StepRecord::default() });
        self.trace.steps.clear();
    }

    /// As the warm-up promises, if it was long enough to promise anything.
    fn expected_ticks(&self) -> usize {
        if self.warm_up_ns < SHORTEST_PROMISE_NS {
            return UNPROMISED_TICKS;
        }
        let times = self.measure_ns as f64 / self.warm_up_ns as f64;
        ((self.warm_up_ticks + 10) as f64 * times * ROOM) as usize
    }

    fn end(&mut self, gate: &Gate, now_ns: u64) {
        self.phase = Phase::Done;
        self.head.ended_ns = now_ns;
        self.head.used = Used::by_all(&self.processes(gate)) - self.before;
        let agents = self.parts.iter().filter(|part| matches!(part, Part::Agent(_)));
        let pss = agents.filter_map(|part| gate.ready_process(*part)).map(pss_bytes);
        self.head.agent_pss_bytes = pss.max().unwrap_or_default();
    }

    fn processes(&self, gate: &Gate) -> Vec<u32> {
        self.parts.iter().filter_map(|part| gate.ready_process(*part)).collect()
    }

    fn is_measuring(&self) -> bool {
        matches!(self.phase, Phase::Measuring { .. })
    }

    /// A tick begins at `opened_ns`.
    pub fn open(&mut self, tick: i64, opened_ns: u64) {
        if self.is_measuring() {
            let (intended_ns, skipped) = self.due.unwrap_or((opened_ns, 0));
            let record = TickRecord { tick, intended_ns, opened_ns, skipped, ..TickRecord::default() };
            self.trace.ticks.push(record);
        }
    }

    /// All that the tick needs is sent.
    pub fn publish(&mut self) {
        self.stamp(|tick, now_ns| tick.published_ns = now_ns);
    }

    /// Answers are looked for now.
    pub(crate) fn look(&mut self) {
        self.stamp(|tick, now_ns| tick.looked_ns = now_ns);
    }

    /// They are fetched.
    pub fn collect(&mut self) {
        self.stamp(|tick, now_ns| tick.collected_ns = now_ns);
    }

    fn stamp(&mut self, set: impl FnOnce(&mut TickRecord, u64)) {
        if let Some(tick) = self.trace.ticks.last_mut() {
            set(tick, monotonic_ns());
        }
    }

    /// An answer has come, to whatever tick.
    pub(crate) fn note(&mut self, tick: i64, member: u32, stamps: &Stamps) {
        if self.is_measuring() {
            let Stamps { woke_ns, read_ns, sent_ns, sending_ns } = *stamps;
            let seen_ns = monotonic_ns();
            let step =
                StepRecord { tick, woke_ns, read_ns, sent_ns, seen_ns, sending_ns, member, reserved: 0 };
            self.trace.steps.push(step);
        }
    }

    /// The tick is over; where ticks are paced, the next is due at `due_ns`, and `missed` after it have passed too.
    pub fn finish(&mut self, reused: u32, paced: Option<(u64, u32)>) {
        self.due = paced;
        if let Some(tick) = self.trace.ticks.last_mut() {
            tick.reused = reused;
        }
    }

    /// Leaves all that was measured, also when the flight ended before its time.
    pub fn leave(&mut self, gate: &Gate) -> Result<(), BusError> {
        if self.is_measuring() {
            self.end(gate, monotonic_ns());
        }
        self.trace.save(&self.path, &self.head)
    }
}

/// Whether no further tick is to be measured: one that was `due` in time is, however late, so that a stall counts to its end.
fn is_over(now_ns: u64, until_ns: u64, due: Option<(u64, u32)>) -> bool {
    due.map_or(now_ns, |(due_ns, _)| due_ns) >= until_ns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stall_beyond_the_end_is_charged_to_the_tick_that_was_due_before() {
        assert!(!is_over(999, 1000, None) && is_over(1000, 1000, None));
        assert!(!is_over(5000, 1000, Some((990, 40))), "the ticks that the stall delayed were never told");
        assert!(is_over(5010, 1000, Some((5010, 0))));
    }
}
