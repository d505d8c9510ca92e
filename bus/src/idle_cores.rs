//! Threads that move processes from a busy core to an idle one.
//!
//! Linux does this as well, but not reliably. Measured on Linux 6.18, with 1000 UAVs on two cores: when a kernel thread kept
//! one core for 15 ms, 440 agents waited for that core. The other core was idle, and got only 32 of them every 4 ms.
//!
//! Must never move a process that is restricted to some of the cores, and must never leave a process restricted to one.

use crate::{Due, Gate, deadlines::is_crowd, futex, monotonic_ns, placement, processes_per_core};
use ringwing_flight::{Pace, Part, Tick, UavId};
use ringwing_scenario::Scenario;
use rustix::{
    process::Pid,
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};
use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering::SeqCst},
    },
    thread,
    time::Duration,
};

/// A period has this many steps, and an idle core looks for waiting agents after each of them except the last. With fewer
/// steps, it finds them later; with more, it looks while the world is still waking them.
const LOOKS_PER_PERIOD: u64 = 4;
/// Agents are moved only while more answers than this are missing for each core. With a smaller number, most of the agents
/// in question are already running, and moving them interrupts them; with a larger one, the last agents of a late tick are
/// not moved.
const MISSING_PER_CORE: u32 = 8;
/// How many agents are moved before they get to run. With fewer, there are more context switches; with more, some of them
/// still wait here when the other core is free again.
const BATCH: usize = 16;

/// The threads, one for each core that this process may use. They end when this value is dropped.
#[derive(Debug)]
pub struct IdleCores {
    stop: Arc<AtomicU32>,
}

/// The thread of one core.
struct Helper {
    gate: Gate,
    stop: Arc<AtomicU32>,
    uavs: u32,
    period_ns: u64,
    /// All cores that the processes of the run may use.
    all: CpuSet,
    /// The core of this thread.
    here: CpuSet,
}

impl IdleCores {
    /// The number of threads in a flight of `scenario` on a machine with so many usable `cores`.
    ///
    /// A swarm with few processes per core needs none: its processes [stand by](crate::WaitStrategy::timed) for each tick. Nor
    /// does a flight in lockstep, where each tick waits for all answers, so that no answer is late.
    pub fn count(scenario: &Scenario, cores: u32) -> u32 {
        let crowd = processes_per_core(scenario.formation.uavs, cores);
        let helps = scenario.pace() == Pace::RealTime && is_crowd(crowd) && cores > 1;
        if helps { cores } else { 0 }
    }

    /// Starts the threads for a flight of `scenario` in real time.
    ///
    /// # Errors
    /// A thread cannot be started.
    pub fn start(gate: &Gate, scenario: &Scenario) -> io::Result<Self> {
        let all = sched_getaffinity(None)?;
        let helpers = Self { stop: Arc::default() };
        for core in (0..CpuSet::MAX_CPU).filter(|core| all.is_set(*core)) {
            let mut here = CpuSet::new();
            here.set(core);
            let helper = Helper {
                gate: gate.clone(),
                stop: helpers.stop.clone(),
                uavs: scenario.formation.uavs,
                period_ns: 1_000_000_000 / u64::from(scenario.time.rate_hz),
                all,
                here,
            };
            thread::Builder::new().name(format!("idle core {core}")).spawn(move || helper.work())?;
        }
        Ok(helpers)
    }
}

impl Drop for IdleCores {
    fn drop(&mut self) {
        self.stop.store(1, SeqCst);
        // Do not join the threads: on a busy machine, it can take a long time until they run again.
        futex::wake_all(&self.stop);
    }
}

impl Helper {
    /// Runs until the flight is over.
    fn work(&self) {
        // On another core, or with another priority, the thread would disturb the flight.
        if sched_setaffinity(None, &self.here).is_err() || placement::make_way().is_err() {
            return;
        }
        while self.stop.load(SeqCst) == 0 && !self.gate.is_closed() {
            let now_ns = monotonic_ns();
            let look_ns = next_look(self.gate.due().at_ns, self.period_ns, now_ns);
            futex::wait(&self.stop, 0, Duration::from_nanos(look_ns - now_ns));
            // `futex::wait` may return early.
            if monotonic_ns() >= look_ns {
                self.help();
            }
        }
    }

    /// Moves agents that have not answered the open tick to this core, until few answers are missing or the next tick
    /// opens. If the next tick is overdue, moves the world first. Returns the number of processes moved.
    fn help(&self) -> usize {
        let due = self.gate.due();
        let is_overdue = due != Due::default() && due.at_ns <= monotonic_ns();
        let mut moved = usize::from(is_overdue && self.take_over(Part::World));
        let Some(tick) = self.gate.tick() else { return moved };
        let mut agents = UavId::all(self.uavs).map(Part::Agent);
        while self.is_needed(tick) {
            let late = agents.by_ref().filter(|part| !self.gate.has_answered(*part));
            let batch = late.filter(|part| self.take_over(*part)).take(BATCH).count();
            moved += batch;
            if batch < BATCH {
                break;
            }
            // The moved agents run first, because this thread has the lowest priority.
            thread::yield_now();
        }
        moved
    }

    /// Whether `tick` is still open, with many answers missing.
    fn is_needed(&self, tick: Tick) -> bool {
        self.gate.missing_answers() > MISSING_PER_CORE * self.all.count() && self.gate.tick() == Some(tick)
    }

    /// Moves the process of `part` to this core if it is allowed to use all cores. Returns whether it was moved.
    fn take_over(&self, part: Part) -> bool {
        let ready = self.gate.ready_process(part).and_then(|pid| Pid::from_raw(pid.cast_signed()));
        let Some(process) = ready else { return false };
        // A user may have restricted a process to some of the cores, for example with `taskset`.
        let may_move = sched_getaffinity(Some(process)).is_ok_and(|cores| cores == self.all);
        // Lift the restriction at once, which does not move the process back. This thread may not run again for a long time,
        // and until then the process could not leave a core that has become busy.
        may_move
            && sched_setaffinity(Some(process), &self.here).is_ok()
            && sched_setaffinity(Some(process), &self.all).is_ok()
    }
}

/// The next time after `now_ns` at which an idle core looks for waiting agents. `due_ns` is any one of the deadlines. A core
/// does not look at a deadline itself, because the world is only about to open the tick.
fn next_look(due_ns: u64, period_ns: u64, now_ns: u64) -> u64 {
    let step_ns = period_ns / LOOKS_PER_PERIOD;
    let since_deadline_ns = (now_ns + period_ns - due_ns % period_ns) % period_ns;
    let step = since_deadline_ns / step_ns + 1;
    // The last step of a period ends at a deadline.
    let step = if step < LOOKS_PER_PERIOD { step } else { LOOKS_PER_PERIOD + 1 };
    now_ns - since_deadline_ns + step * step_ns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DomainOwner, Patience};
    use std::process::{Child, Command};

    const MS: u64 = 1_000_000;

    #[test]
    fn a_core_looks_three_times_between_two_deadlines() {
        let looks = |now_ms: u64| next_look(1020 * MS, 20 * MS, now_ms * MS) / MS;
        assert_eq!([1000, 1004, 1005, 1010, 1014].map(looks), [1005, 1005, 1010, 1015, 1015]);
        // At the deadline itself the world opens the tick.
        assert_eq!([1015, 1019, 1020].map(looks), [1025, 1025, 1025]);
        // A deadline long ago, as in a pause, and none so far.
        assert_eq!(looks(5000), 5005);
        assert_eq!(next_look(0, 20 * MS, 1001 * MS), 1005 * MS);
    }

    #[test]
    fn only_a_crowd_in_real_time_needs_help() {
        let mut scenario = Scenario::default();
        (scenario.formation.uavs, scenario.time.real_time) = (80, true);
        assert_eq!([1, 2, 3].map(|cores| IdleCores::count(&scenario, cores)), [0, 2, 0]);
        scenario.time.real_time = false;
        assert_eq!(IdleCores::count(&scenario, 2), 0);
    }

    /// A helper on the first usable core for two UAVs, and the processes that are ready as their agents.
    fn crowd(gate: &Gate) -> (Helper, [Sleeper; 2]) {
        let all = sched_getaffinity(None).unwrap();
        let mut here = CpuSet::new();
        here.set((0..CpuSet::MAX_CPU).find(|core| all.is_set(*core)).unwrap());
        let helper =
            Helper { gate: gate.clone(), stop: Arc::default(), uavs: 2, period_ns: 20 * MS, all, here };
        let agents = [1, 2].map(|uav| {
            let agent = Sleeper::start();
            gate.set_ready_process(Part::Agent(UavId(uav)), Some(agent.0.id()));
            agent
        });
        (helper, agents)
    }

    /// A process that sleeps as long as this value exists.
    struct Sleeper(Child);

    impl Sleeper {
        fn start() -> Self {
            Self(Command::new("sleep").arg("60").spawn().unwrap())
        }

        fn pid(&self) -> Pid {
            Pid::from_child(&self.0)
        }

        fn cores(&self) -> CpuSet {
            sched_getaffinity(Some(self.pid())).unwrap()
        }
    }

    impl Drop for Sleeper {
        fn drop(&mut self) {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }

    /// So many missing answers that a core without work helps.
    fn many(helper: &Helper) -> u32 {
        MISSING_PER_CORE * helper.all.count() + 1
    }

    #[test]
    fn an_agent_whose_answer_is_missing_moves_and_keeps_all_its_cores() {
        let (_owner, gate) = DomainOwner::create("").unwrap();
        let (helper, agents) = crowd(&gate);
        gate.open_tick(Tick(5), many(&helper) + 1);
        gate.answer(Part::Agent(UavId(1)), Tick(5));
        assert_eq!(helper.help(), 1, "the first has answered");
        assert!(agents[1].cores() == helper.all, "it may use all cores again");
    }

    #[test]
    fn an_agent_with_cores_of_its_own_keeps_them() {
        let (_owner, gate) = DomainOwner::create("").unwrap();
        let (helper, agents) = crowd(&gate);
        let mut other = CpuSet::new();
        let others =
            (0..CpuSet::MAX_CPU).filter(|core| helper.all.is_set(*core) && !helper.here.is_set(*core));
        others.for_each(|core| other.set(core));
        if other.count() == 0 {
            eprintln!("skipped: this machine has one core");
            return;
        }
        sched_setaffinity(Some(agents[0].pid()), &other).unwrap();
        gate.open_tick(Tick(5), many(&helper));
        assert_eq!(helper.help(), 1);
        assert!(agents[0].cores() == other);
    }

    #[test]
    fn nobody_moves_when_few_answers_are_missing_or_no_tick_is_open() {
        let (_owner, gate) = DomainOwner::create("").unwrap();
        let (helper, _agents) = crowd(&gate);
        assert_eq!(helper.help(), 0);
        gate.open_tick(Tick(5), many(&helper) - 1);
        assert_eq!(helper.help(), 0);
    }

    #[test]
    fn a_world_that_has_not_opened_the_tick_that_is_due_moves() {
        let (_owner, gate) = DomainOwner::create("").unwrap();
        let (helper, _agents) = crowd(&gate);
        let world = Sleeper::start();
        gate.set_ready_process(Part::World, Some(world.0.id()));
        gate.set_due(Due { at_ns: u64::MAX, lead_ns: 0 });
        assert_eq!(helper.help(), 0);
        gate.set_due(Due { at_ns: 1, lead_ns: 0 });
        gate.open_tick(Tick(5), 0);
        assert_eq!(helper.help(), 1);
        assert!(world.cores() == helper.all);
    }

    #[test]
    fn the_threads_end_with_the_flight() {
        let (_owner, gate) = DomainOwner::create("").unwrap();
        let mut scenario = Scenario::default();
        (scenario.formation.uavs, scenario.time.rate_hz) = (1, 50);
        let helpers = IdleCores::start(&gate, &scenario).unwrap();
        let stop = helpers.stop.clone();
        drop(helpers);
        let mut patience = Patience::of(Duration::from_secs(60));
        while Arc::strong_count(&stop) > 1 {
            assert!(!patience.is_over(), "threads still run");
            thread::sleep(Duration::from_millis(5));
        }
    }
}
