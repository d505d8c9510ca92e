//! Supervises one run: reports to each process's [state machine](super::lifecycle) what happens, and carries out the
//! effects that it returns.
//!
//! Must never decide by itself what a change of a process means, and must never sleep through a notice.

use super::{
    LaunchError, Outcome, Plan,
    fault_queue::FaultQueue,
    inbox::{Inbox, Notice, ProcessChange, Reply},
    janitor::Janitor,
    lifecycle::{Attendant, Effect, Input, ProcessSignal, RunStage, SupervisionLimits},
    output_keeper::OutputKeeper,
    ports::LauncherPorts,
    process_table::ProcessTable,
    progress::Progress,
    spawner::{Spawner, send_signal},
    stepper::Stepper,
};
use ringwing_bus::{
    AwakeClock, Domain, Gate, IdleCores, Patience, Shortage, Stamps, Starter, domain::Reserve, is_running,
    report,
};
use ringwing_flight::{Event, EventMessage, Pace, Part, ProcessEnd, Tick, TimedEvent, WorldReport};
use ringwing_recorder::log::run_folder::log_in;
use ringwing_scenario::Scenario;
use signal_hook::consts::SIGBUS;
use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Longest wait for a notice while something should happen within moments: a start, or a fault that is being applied.
/// A process sends no notice when it becomes ready, so a longer wait delays the start; a shorter one burns CPU.
const BUSY_WAIT: Duration = Duration::from_millis(1);
/// Longest wait for a notice otherwise. Longer makes the progress line and real-time faults late; shorter wakes the
/// launcher for nothing while others need the processor.
const IDLE_WAIT: Duration = Duration::from_millis(20);
/// How long processes may take to leave at least, once the flight is over. The recorder closes its log meanwhile: a shorter
/// limit kills it on a slow disk.
const LEAVE_LIMIT: Duration = Duration::from_secs(10);

/// A run, from its first process to its last.
pub(super) struct Supervisor<'a> {
    pub(super) plan: &'a Plan,
    pub(super) domain: &'a Domain,
    pub(super) gate: Gate,
    ports: LauncherPorts,
    pub(super) inbox: Inbox,
    pub(super) janitor: Janitor,
    pub(super) spawner: Spawner<'a>,
    /// The viewer's process, as long as it lives.
    pub(super) viewer: Option<u32>,
    pub(super) processes: ProcessTable,
    pub(super) faults: FaultQueue<'a, Reply>,
    pub(super) stepper: Stepper<Reply>,
    pub(super) progress: Progress<'a>,
    folder: PathBuf,
    /// The lifecycles' clock. It stands still while the launcher is stopped, so that a run that was stopped as a whole
    /// finds no process late.
    pub(super) clock: AwakeClock,
    /// Whether every process has been ready or lost once. Only then does the world get its first roster.
    is_prepared: bool,
    /// The revision of the last roster; 0 before the first.
    revision: u64,
    is_interrupted: bool,
    /// Failures of the run. The first one ends the flight if it is still going on.
    failures: Vec<String>,
    /// Failures that let the flight go on.
    late_failures: Vec<String>,
}

/// How long starting and flying took, by the wall clock.
struct FlightTimes {
    start: Duration,
    flight: Duration,
}

impl<'a> Supervisor<'a> {
    /// Prepares the run of `plan`; starts no process yet.
    pub(super) fn new(
        plan: &'a Plan,
        domain: &'a Domain,
        gate: Gate,
        ports: LauncherPorts,
        inbox: Inbox,
        starter: Starter,
        folder: &Path,
    ) -> Result<Self, LaunchError> {
        let scenario = &plan.scenario;
        inbox.watch_requests(&domain.request_path())?;
        if scenario.pace() == Pace::Lockstep {
            inbox.watch_holds(domain.gate()?)?;
        }
        let log = plan.record.then(|| log_in(folder));
        let output = OutputKeeper::new(folder, inbox.sender());
        let spawner = Spawner::new(plan, domain.id(), log, output, starter);
        gate.set_cores(spawner.swarm_cores());
        let is_by_hand = |part| plan.needs(part) && plan.by_hand.contains(&part);
        Ok(Self {
            plan,
            domain,
            gate,
            ports,
            inbox,
            janitor: Janitor::start(domain, scenario.time.rate_hz)?,
            spawner,
            viewer: None,
            processes: ProcessTable::new(scenario.formation.uavs, limits(scenario), is_by_hand),
            faults: FaultQueue::new(scenario),
            stepper: Stepper::new(scenario.time.rate_hz),
            progress: Progress::new(scenario, plan.quiet),
            folder: folder.to_owned(),
            clock: AwakeClock::start(),
            is_prepared: false,
            revision: 0,
            is_interrupted: false,
            failures: Vec::new(),
            late_failures: Vec::new(),
        })
    }

    /// Flies the run, which the user asked for at `begin`, to its end, and says how it went.
    pub(super) fn run(mut self, begin: Instant) -> Result<Outcome, LaunchError> {
        self.print_place();
        let times = self.fly(begin);
        let outcome = self.outcome(&times);
        self.janitor.stop();
        outcome
    }

    fn print_place(&self) {
        self.progress.print(&format!("domain {}, folder {}", self.domain.id(), self.folder.display()));
        for part in &self.plan.by_hand {
            self.progress.print(&format!("waiting for: {}", self.spawner.command_line(*part)));
        }
    }

    /// Flies from the start of the first process to the end of the last one. Errors on the way end the flight and
    /// become failures of the run.
    fn fly(&mut self, begin: Instant) -> FlightTimes {
        let mut times = FlightTimes { start: Duration::ZERO, flight: Duration::ZERO };
        let result = self.start_processes().and_then(|()| {
            times.start = begin.elapsed();
            let takeoff = Instant::now();
            let result = self.watch_flight();
            times.flight = takeoff.elapsed();
            result
        });
        self.end_steps();
        self.note_error(result);
        // Ask the world to stop first: it must not go on behind a closed gate.
        self.gate.request_stop();
        self.gate.close();
        let result = self.wait_for_ends();
        self.note_error(result);
        self.progress.finish();
        times
    }

    fn note_error(&mut self, result: Result<(), LaunchError>) {
        self.failures.extend(result.err().map(|error| error.to_string()));
    }

    /// Starts all processes and waits until each is ready or lost.
    fn start_processes(&mut self) -> Result<(), LaunchError> {
        // The processes are about to use what is left of this memory.
        self.domain.release(Reserve::Swarm);
        for part in self.parts() {
            if self.plan.needs(part) && !self.plan.by_hand.contains(&part) {
                self.carry_out(part, Effect::Spawn)?;
            }
        }
        self.start_viewer()?;
        while self.processes.is_any_starting() && self.stage() != RunStage::Over {
            self.wait(BUSY_WAIT)?;
        }
        self.domain.pin_segments(self.plan.scenario.ipc.payload_bytes)?;
        self.is_prepared = true;
        self.publish_roster()
    }

    fn watch_flight(&mut self) -> Result<(), LaunchError> {
        let _helpers = self.share_idle_cores()?;
        while self.stage() != RunStage::Over {
            let is_busy = self.processes.is_any_starting() || self.faults.is_busy() || self.stepper.is_busy();
            self.wait(if is_busy { BUSY_WAIT } else { IDLE_WAIT })?;
            self.apply_faults()?;
            self.progress.update(self.gate.tick());
        }
        Ok(())
    }

    /// Starts the threads that let idle cores help busy ones, if this flight needs them.
    fn share_idle_cores(&self) -> Result<Option<IdleCores>, LaunchError> {
        let start = || IdleCores::start(&self.gate, &self.plan.scenario);
        let helpers = (self.plan.idle_core_threads() > 0).then(start);
        let failed = |source| LaunchError::Spawn { what: "a thread of an idle core".into(), source };
        helpers.transpose().map_err(failed)
    }

    /// Waits until all processes have left by themselves; kills frozen ones at once and late ones after a time limit.
    fn wait_for_ends(&mut self) -> Result<(), LaunchError> {
        // A large swarm takes as long to leave as to start.
        let limit = self.plan.scenario.start_limit().max(LEAVE_LIMIT);
        let (mut patience, mut is_late) = (Patience::of(limit), false);
        let (mut patience_with_own, mut is_own_late) =
            (Patience::of(self.plan.scenario.answer_limit()), false);
        while !self.processes.living().is_empty() {
            // A frozen process cannot leave by itself, so waiting for it is in vain.
            for part in self.processes.frozen() {
                self.progress.print_warning(&format!("{part} was still frozen at the end; killed"));
                self.report(part, Input::Killed)?;
            }
            if patience_with_own.is_over() && !is_own_late {
                is_own_late = true;
                self.kill_own_programs()?;
            }
            if patience.is_over() && !is_late {
                is_late = true;
                let names: Vec<String> = self.processes.living().iter().map(ToString::to_string).collect();
                self.failures.push(format!(
                    "{} did not leave within {:.0} s and was killed: raise supervision.start_timeout_s",
                    names.join(", "),
                    limit.as_secs_f64()
                ));
                self.kill_all()?;
            }
            self.wait(BUSY_WAIT)?;
        }
        self.end_viewer()?;
        self.spawner.output().finish();
        self.receive()
    }

    /// Kills the programs of the user's that have not left: a broken one must not spoil the end of the run.
    fn kill_own_programs(&mut self) -> Result<(), LaunchError> {
        let late = self.processes.living();
        let own: Vec<Part> =
            late.into_iter().filter(|part| self.spawner.own_program(*part).is_some()).collect();
        for part in own {
            self.progress.print_warning(&format!("{part} did not leave at the end of the flight; killed"));
            self.report(part, Input::Killed)?;
        }
        Ok(())
    }

    /// Sends `signal` to the process `pid` of `part`, and to the processes that a program of the user's has started.
    pub(super) fn send_to(&self, part: Part, pid: u32, signal: ProcessSignal) {
        send_signal(pid, signal, self.has_children(part));
    }

    /// Whether the process of `part` has a group of its own, with whatever a program of the user's starts.
    fn has_children(&self, part: Part) -> bool {
        // A process that was started by hand may share its group with others.
        self.spawner.own_program(part).is_some() && !self.processes.get(part).is_adopted()
    }

    /// Says where to read what the program of the user's has printed that flew as `part`.
    fn print_output_of(&self, part: Part) {
        if let Some((uav, own)) = self.spawner.own_program(part) {
            let file = self.spawner.output().file(uav);
            self.progress.print(&format!("what {} printed: {}", own.command_line(), file.display()));
        }
    }

    fn kill_all(&mut self) -> Result<(), LaunchError> {
        self.processes.living().into_iter().try_for_each(|part| self.report(part, Input::Killed))
    }

    fn parts(&self) -> impl Iterator<Item = Part> + use<> {
        Part::all(self.plan.scenario.formation.uavs)
    }

    pub(super) fn stage(&self) -> RunStage {
        if self.gate.is_closed() || !self.failures.is_empty() {
            RunStage::Over
        } else if self.revision == 0 {
            RunStage::Preparing
        } else {
            RunStage::Flying
        }
    }

    /// Waits for the next notice, at most for `limit`, and takes in everything that has happened meanwhile.
    pub(super) fn wait(&mut self, limit: Duration) -> Result<(), LaunchError> {
        match self.inbox.next(limit) {
            Some(Notice::Process { pid, change }) => self.on_process_change(pid, change)?,
            Some(Notice::Interrupt) => self.on_interrupt()?,
            Some(Notice::Suspend) => self.suspend(),
            Some(Notice::Request(request)) => self.on_request(request)?,
            Some(Notice::ViewerSays(line)) => self.progress.print(&line),
            Some(Notice::OutputCut { uav }) => {
                let file = self.spawner.output().file(uav);
                self.progress.print_warning(&format!("{uav} prints too much: {} is full", file.display()));
            }
            // A hold only ends the wait: the caller applies faults after every wait.
            Some(Notice::Held) | None => {}
        }
        // Do this before the time limits count: while the launcher was stopped, nobody was late.
        self.note_sleep()?;
        self.note_ready_processes()?;
        self.parts().try_for_each(|part| self.report(part, Input::ClockTicked))?;
        self.receive()
    }

    fn on_process_change(&mut self, pid: u32, change: ProcessChange) -> Result<(), LaunchError> {
        let Some(part) = self.processes.part_of(pid) else {
            self.on_other_change(pid, change);
            return Ok(());
        };
        match change {
            ProcessChange::Stopped => self.report(part, Input::Stopped),
            ProcessChange::Continued => self.report(part, Input::Continued),
            ProcessChange::Ended(end) => {
                // Otherwise its id, once the kernel gives it to another process, looks like one that was started by
                // hand.
                self.gate.set_ready_process(part, None);
                if self.has_children(part) {
                    // Whatever it has started ends with it.
                    send_signal(pid, ProcessSignal::Kill, true);
                }
                self.late_failures.extend(full_memory(part, end));
                // Whoever takes this part next, spawned or started by hand, finds its services ready. Nobody can take
                // that of the world.
                if self.stage() != RunStage::Over && part != Part::World {
                    self.ports.renew(self.domain, part)?;
                }
                self.report(part, Input::Ended(end))
            }
        }
    }

    /// The first interrupt ends the flight in order, the second one at once.
    fn on_interrupt(&mut self) -> Result<(), LaunchError> {
        if self.is_interrupted {
            self.failures.push("interrupted twice: processes killed".into());
            return self.kill_all();
        }
        self.is_interrupted = true;
        self.gate.request_stop();
        self.log_event(Event::RunInterrupted)?;
        // Without a roster the world does not fly, so no end of the flight would end the run.
        if self.revision == 0 {
            self.failures.push("interrupted before the flight began".into());
        }
        Ok(())
    }

    /// Looks at the gate for processes that have become ready: children, and those that the user started by hand.
    fn note_ready_processes(&mut self) -> Result<(), LaunchError> {
        for part in self.parts() {
            let Some(pid) = self.gate.ready_process(part) else { continue };
            let is_expected = match self.processes.get(part).expects() {
                Attendant::Child(child) => child == pid,
                Attendant::Stranger => is_running(pid),
                Attendant::Nobody => false,
            };
            if is_expected {
                self.report(part, Input::Ready { pid })?;
            }
        }
        Ok(())
    }

    /// Reports `input` to the process `part`, and carries out the effects.
    pub(super) fn report(&mut self, part: Part, input: Input) -> Result<(), LaunchError> {
        let (now, stage) = (self.clock.awake(), self.stage());
        let effects = self.processes.get_mut(part).on(input, now, stage);
        effects.into_iter().try_for_each(|effect| self.carry_out(part, effect))
    }

    fn carry_out(&mut self, part: Part, effect: Effect) -> Result<(), LaunchError> {
        match effect {
            Effect::Log(event) => {
                let is_loss = matches!(event, Event::ProcessLost { .. } | Event::StartOverdue { .. });
                self.log_event(event)?;
                if is_loss {
                    self.print_output_of(part);
                }
            }
            Effect::Signal { pid, signal } => self.send_to(part, pid, signal),
            Effect::Spawn => {
                let pid = self.spawner.spawn(part)?;
                self.report(part, Input::Spawned { pid })?;
            }
            Effect::Watch { pid } => self.inbox.watch_stranger(pid)?,
            // A recorder leaves nothing to read, and its successor needs its places at the services.
            Effect::CleanUp { is_planned: true } if part != Part::Recorder => {
                self.janitor.clean_later(self.gate.tick());
            }
            Effect::CleanUp { .. } => self.janitor.clean(),
            Effect::PublishRoster => self.publish_roster()?,
            Effect::EndRun(why) => self.failures.push(why),
            Effect::FailAtEnd(why) => {
                self.progress.print_error(&why);
                self.late_failures.push(why);
            }
        }
        Ok(())
    }

    /// Tells the world which processes run, once all are prepared: the first roster starts the flight.
    pub(super) fn publish_roster(&mut self) -> Result<(), LaunchError> {
        if !self.is_prepared {
            return Ok(());
        }
        self.revision += 1;
        let mut roster = self.processes.roster(self.revision);
        roster.free_before = self.faults.free_before().min(self.stepper.free_before());
        roster.set_paused(self.stepper.is_paused());
        self.ports.roster.send(roster, Stamps::now())?;
        // Wake the world only now: if it woke before, it would find the old roster and sleep again.
        self.gate.nudge_world();
        Ok(())
    }

    pub(super) fn log_event(&mut self, event: Event) -> Result<(), LaunchError> {
        self.log_event_at(self.gate.tick().unwrap_or(Tick(0)), event)
    }

    pub(super) fn log_event_at(&mut self, tick: Tick, event: Event) -> Result<(), LaunchError> {
        let event = TimedEvent { tick, event };
        self.progress.print_event(&event);
        Ok(self.ports.events.send(EventMessage::new(&event), Stamps::now())?)
    }

    /// Takes in what the world and the recorder have published, to show it.
    fn receive(&mut self) -> Result<(), LaunchError> {
        let progress = &mut self.progress;
        self.ports.world_events.drain(|message, _| {
            // The world is of the same build, so a message that cannot be read is damaged: show nothing.
            if let Some(event) = message.event() {
                progress.print_event(&event);
            }
        })?;
        self.ports.formation_error.drain(|error, _| progress.set_formation_error(error))?;
        Ok(())
    }

    /// How the run went, from what its processes have left.
    fn outcome(&mut self, times: &FlightTimes) -> Result<Outcome, LaunchError> {
        // Remove the draft of a recorder that was killed during a takeover. The log itself is whole.
        let _ = fs::remove_file(log_in(&self.folder).with_extension("mcap.part"));
        let world: Option<WorldReport> = self.domain.report(report::WORLD)?;
        let mut failures = std::mem::take(&mut self.failures);
        failures.append(&mut self.late_failures);
        if failures.is_empty() && world.as_ref().is_none_or(|world| !world.complete) {
            let is_interrupted = self.is_interrupted;
            let why = if is_interrupted {
                "interrupted before the end"
            } else {
                "the world ended the flight early"
            };
            failures.push(why.into());
        }
        Ok(Outcome {
            folder: self.folder.clone(),
            added_faults: self.faults.added().to_vec(),
            recorder: self.domain.report(report::RECORDER)?,
            ticks: world.as_ref().map_or_else(|| self.progress.last_tick().0, |world| world.last_tick),
            world,
            failures,
            flight_time: times.flight,
            start_time: times.start,
        })
    }
}

/// Why `part` came to its `end`, if the reason is that shared memory is full.
fn full_memory(part: Part, end: ProcessEnd) -> Option<String> {
    let full = (end == ProcessEnd::Killed(SIGBUS)).then(Shortage::of_full_memory)??;
    Some(format!("{part} {end} (SIGBUS): {full}"))
}

fn limits(scenario: &Scenario) -> SupervisionLimits {
    SupervisionLimits {
        start: scenario.start_limit(),
        freeze: scenario.answer_limit(),
        replacements: scenario.supervision.replacements,
    }
}
