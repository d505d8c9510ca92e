//! The process that keeps time and integrates the airframes.

use crate::{Airframe, Sky, answers::Answers, ports::Ports, tally::Tally};
use ringwing_bus::{
    BusError, Deadlines, DomainId, Due, Gate, Member, PacedTick, Proceed, Stamps, StopFlag, TickProbe, Waker,
    channel, monotonic_ns, patience::crowd, report,
};
use ringwing_flight::{Event, EventMessage, Part, Tick, TimedEvent, UavId};
use ringwing_scenario::{Scenario, ScenarioError, start};
use std::{
    thread,
    time::{Duration, Instant},
};

/// Which run to be the world of.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The run's domain, as `ringwing run` prints it.
    #[arg(long)]
    pub domain: DomainId,
    /// Process id of the launcher to end with.
    #[arg(long, hide = true)]
    pub launcher: Option<u32>,
}

/// Why there can be no world.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The rest of the run cannot be reached.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The run's scenario is not readable.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// How far the recorder may lag behind in lockstep: what it has not fetched dies with it, and with what it has not
/// written yet that must be less than a second.
const RECORDER_LAG_S: f64 = 0.4;
/// How long the world sleeps before it looks for itself at what it waits for.
const LOOK_AGAIN: Duration = Duration::from_millis(2);

/// Integrates the run until its last tick, or until it is asked to stop.
///
/// `probe` observes every tick and may end the run; pass [`NoProbe`](ringwing_bus::NoProbe) where nobody measures.
pub fn run(args: &Args, probe: impl TickProbe) -> Result<(), WorldError> {
    let member = Member::join(&args.domain, Part::World, args.launcher)?;
    let scenario = Scenario::resolved(&member.domain().scenario()?)?;
    let sky = Sky::new(&scenario, &start::places(&scenario)?);
    let ports = Ports::open(&member, scenario.formation.uavs, scenario.ipc.payload_bytes)?;
    let waker = Waker::of_world(&member, scenario.ipc.wake, scenario.time.real_time)?;
    let gate = member.attend()?;
    let mut world = World::new(&member, gate, waker, ports, sky, &scenario, probe);
    if world.wait_for_roster()? {
        world.fly()?;
    }
    world.probe.run_ended(&world.gate)?;
    member.domain().leave_report(report::WORLD, &world.report())?;
    world.gate.close();
    world.waker.call()?;
    world.wait_for_recorder();
    Ok(())
}

fn is_stopped(gate: &Gate, stop: &StopFlag) -> bool {
    gate.stop_requested() || gate.is_closed() || stop.is_set()
}

struct World<'a, P> {
    member: &'a Member,
    gate: Gate,
    ports: Ports,
    sky: Sky,
    answers: Answers,
    tally: Tally,
    waker: Waker,
    probe: P,
    /// The deadlines, in real time.
    schedule: Option<Deadlines>,
    rate_hz: u32,
    last_tick: Tick,
    answer_timeout: Duration,
    hold_timeout: Duration,
    recorder_lag_ticks: i64,
    /// The recorder was given up waiting for when it had recorded this.
    stuck_at: Option<Tick>,
    failed_connections: u64,
    /// No replacement came in time, and none is waited for until there is one.
    gave_up_holding: bool,
    /// Nudges answered so far.
    nudges: u32,
}

impl<'a, P: TickProbe> World<'a, P> {
    fn new(
        member: &'a Member,
        gate: Gate,
        waker: Waker,
        ports: Ports,
        sky: Sky,
        scenario: &Scenario,
        probe: P,
    ) -> Self {
        let rate_hz = scenario.time.rate_hz;
        let real_time = scenario.time.real_time;
        Self {
            member,
            gate,
            ports,
            sky,
            answers: Answers::new(scenario.formation.uavs),
            tally: Tally::new(),
            waker,
            probe,
            schedule: real_time
                .then(|| Deadlines::new(rate_hz, crowd(scenario.formation.uavs + 2), monotonic_ns())),
            rate_hz,
            last_tick: Tick(scenario.last_tick()),
            answer_timeout: Duration::from_secs_f64(scenario.supervision.answer_timeout_s),
            hold_timeout: Duration::from_secs_f64(scenario.supervision.start_timeout_s) * 2,
            recorder_lag_ticks: (f64::from(rate_hz) * RECORDER_LAG_S).ceil() as i64,
            stuck_at: None,
            failed_connections: 0,
            gave_up_holding: false,
            nudges: 0,
        }
    }

    /// Waits for the launcher to say who flies; false when asked to stop before.
    fn wait_for_roster(&mut self) -> Result<bool, BusError> {
        while self.answers.roster().revision == 0 {
            if self.is_stopped() {
                return Ok(false);
            }
            self.gate.wait_for_nudge(self.nudges, LOOK_AGAIN);
            self.refresh_roster()?;
        }
        self.restart_schedule();
        Ok(true)
    }

    fn restart_schedule(&mut self) {
        if let Some(schedule) = &mut self.schedule {
            schedule.restart(monotonic_ns());
        }
    }

    fn fly(&mut self) -> Result<(), BusError> {
        loop {
            if self.schedule.is_none() {
                self.wait_for_faults()?;
                self.wait_for_replacement()?;
                self.wait_for_lagging_recorder()?;
            }
            if self.measured_enough() {
                return Ok(());
            }
            self.open_tick()?;
            if self.schedule.is_some() {
                self.wait_for_deadline()?;
            } else {
                self.wait_for_answers()?;
            }
            self.finish_tick()?;
            if self.sky.now() >= self.last_tick || self.is_stopped() {
                return Ok(());
            }
            for event in self.sky.step() {
                self.tally.count_event(self.sky.now().seconds(self.rate_hz), &event);
                self.log_event(event)?;
            }
        }
    }

    /// Asks the probe how to go on.
    fn measured_enough(&mut self) -> bool {
        let proceed = self.probe.before_tick(&self.gate);
        if proceed == Proceed::RestartDeadlines {
            self.restart_schedule();
        }
        proceed == Proceed::End
    }

    fn is_stopped(&self) -> bool {
        is_stopped(&self.gate, self.member.stop())
    }

    /// Lets no time pass while the launcher does what is to be done before this tick, for a bounded time.
    fn wait_for_faults(&mut self) -> Result<(), BusError> {
        let next = self.sky.now();
        if self.answers.roster().free_before > next {
            return Ok(());
        }
        let since = Instant::now();
        self.gate.hold_before(next);
        while self.answers.roster().free_before <= next && !self.is_stopped() {
            if since.elapsed() > self.hold_timeout {
                self.log_event(Event::FaultOverdue)?;
                break;
            }
            self.gate.wait_for_nudge(self.nudges, LOOK_AGAIN);
            self.refresh_roster()?;
        }
        self.gate.release();
        self.wait_for_thawed()
    }

    /// Whoever was thawed answers the tick that it was frozen for first; what chance would make of that, waiting spares.
    fn wait_for_thawed(&mut self) -> Result<(), BusError> {
        let since = Instant::now();
        while self.answers.owing().next().is_some()
            && since.elapsed() < self.answer_timeout
            && !self.is_stopped()
        {
            thread::sleep(Duration::from_micros(50));
            self.collect()?;
        }
        Ok(())
    }

    /// Lets no time pass while a lost process is replaced, for a bounded time in all.
    fn wait_for_replacement(&mut self) -> Result<(), BusError> {
        let since = Instant::now();
        while self.answers.roster().holds() && !self.gave_up_holding && !self.is_stopped() {
            if since.elapsed() > self.hold_timeout {
                self.gave_up_holding = true;
                self.log_event(Event::ReplacementOverdue)?;
            }
            self.gate.wait_for_nudge(self.nudges, LOOK_AGAIN);
            self.refresh_roster()?;
        }
        Ok(())
    }

    /// Lets no time pass while the recorder lags, for a bounded time each time that it does.
    fn wait_for_lagging_recorder(&mut self) -> Result<(), BusError> {
        if !self.recorder_lags() {
            return Ok(());
        }
        let since = Instant::now();
        self.gate.call_recorder();
        while self.recorder_lags() && !self.is_stopped() {
            if since.elapsed() > self.answer_timeout {
                self.stuck_at = Some(self.gate.recorded());
                self.log_event(Event::RecorderSilent)?;
            }
            self.gate.wait_for_nudge(self.nudges, LOOK_AGAIN);
            self.refresh_roster()?;
        }
        Ok(())
    }

    fn recorder_lags(&self) -> bool {
        let recorded = self.gate.recorded();
        self.answers.roster().has_recorder()
            && self.sky.now().since(recorded) > self.recorder_lag_ticks
            && self.stuck_at != Some(recorded)
    }

    /// Tells every UAV what it senses, then opens the tick for all.
    fn open_tick(&mut self) -> Result<(), BusError> {
        let opened_ns = monotonic_ns();
        let now = self.sky.now();
        self.probe.tick_opened(now, opened_ns);
        let stamps = Stamps { woke_ns: opened_ns, read_ns: opened_ns, sent_ns: opened_ns, sending_ns: 0 };
        for (uav, port) in UavId::all(self.ports.sensed.len() as u32).zip(&self.ports.sensed) {
            if let Some(sensed) = self.sky.senses(uav) {
                self.tally.hash_sensed(&sensed);
                port.send(sensed, stamps)?;
            }
        }
        self.ports.ballast.iter().try_for_each(|ballast| ballast.send(now))?;
        self.refresh_roster()?;
        self.answers.begin(now, opened_ns, self.sky.airframes().iter().map(Airframe::mode));
        self.probe.inputs_published();
        if let Some(schedule) = &self.schedule {
            self.gate.set_due(schedule.due());
        }
        self.gate.open_tick(now, self.answers.expected());
        self.waker.call()
    }

    /// In lockstep: waits until everybody has answered who can be expected to.
    fn wait_for_answers(&mut self) -> Result<(), BusError> {
        let since = Instant::now();
        loop {
            self.waker.wait_for_answers(&self.gate, LOOK_AGAIN)?;
            self.collect()?;
            if self.answers.missing().next().is_none() {
                return Ok(());
            }
            self.refresh_roster()?;
            let holds = self.answers.roster().holds() && !self.gave_up_holding;
            let limit = if holds { self.hold_timeout } else { self.answer_timeout };
            if since.elapsed() > limit || self.is_stopped() {
                return self.give_up();
            }
            // Somebody's answer was counted who is not waited for; the count no longer tells when to look.
            if self.gate.is_answered() {
                thread::sleep(Duration::from_micros(50));
            }
        }
    }

    fn give_up(&mut self) -> Result<(), BusError> {
        if self.is_stopped() {
            return Ok(());
        }
        self.tally.unanswered_ticks += 1;
        for part in self.answers.give_up() {
            self.log_event(Event::ProcessSilent { part, waited_s: self.answer_timeout.as_secs_f64() })?;
        }
        Ok(())
    }

    /// In real time: waits for the deadline, whoever has answered.
    fn wait_for_deadline(&mut self) -> Result<(), BusError> {
        let due = self.schedule.as_ref().map_or_else(Due::default, Deadlines::due);
        let (gate, stop) = (&self.gate, self.member.stop());
        self.waker.wait_until(due, || is_stopped(gate, stop));
        self.waker.forget()?;
        self.collect()
    }

    /// Takes in what has come: of each UAV the newest command.
    fn collect(&mut self) -> Result<(), BusError> {
        let now = self.sky.now();
        let probe = &mut self.probe;
        probe.collecting_answers();
        for (uav, port) in UavId::all(self.ports.commands.len() as u32).zip(&self.ports.commands) {
            let mut newest = None;
            port.drain_until(|command, stamps| {
                newest = Some((*command, *stamps));
                probe.answer_seen(command.uav, command.tick, stamps);
                command.tick >= now
            })?;
            let Some((command, stamps)) = newest else { continue };
            match self.sky.accept(uav, &command) {
                Ok(()) => self.answers.note(&command, &stamps, monotonic_ns()),
                Err(_) => self.tally.refused_commands += 1,
            }
        }
        for ballast in &self.ports.ballast {
            ballast.receive()?;
        }
        self.answers.note_leader(self.gate.led());
        self.probe.answers_collected();
        Ok(())
    }

    /// Learns who runs, if there is news.
    fn refresh_roster(&mut self) -> Result<(), BusError> {
        let nudges = self.gate.nudges();
        if nudges == self.nudges {
            return Ok(());
        }
        self.nudges = nudges;
        let answers = &mut self.answers;
        self.ports.roster.drain(|roster, _| answers.set_roster(roster))?;
        self.gave_up_holding &= self.answers.roster().holds();
        Ok(())
    }

    /// Counts the tick, and says how long it took.
    fn finish_tick(&mut self) -> Result<(), BusError> {
        let mut timing = self.answers.timing();
        let mut paced = None;
        if let Some(schedule) = &mut self.schedule {
            let due_ns = schedule.due().at_ns;
            let lateness = schedule.meet(monotonic_ns());
            (timing.late_ns, timing.missed_deadlines) = (lateness.late_ns, lateness.missed_deadlines);
            paced = Some(PacedTick { due_ns, skipped: lateness.missed_deadlines });
        }
        self.probe.tick_finished(timing.reused, paced);
        self.tally.add_tick(self.answers.commands(), &timing);
        self.ports.timing.send(timing, Stamps::now())?;
        self.watch_connections()
    }

    fn watch_connections(&mut self) -> Result<(), BusError> {
        let failed = channel::failed_connections();
        if failed == self.failed_connections {
            return Ok(());
        }
        self.failed_connections = failed;
        self.log_event(Event::ConnectionsFailed { count: failed })
    }

    fn log_event(&self, event: Event) -> Result<(), BusError> {
        let event = TimedEvent { tick: self.sky.now(), event };
        self.ports.events.send(EventMessage::new(&event), Stamps::now())
    }

    fn report(&self) -> ringwing_flight::WorldReport {
        let now = self.sky.now();
        self.tally.report(now.0, now >= self.last_tick || self.probe.is_done())
    }

    /// Stays until the recorder has fetched the last tick: what a sender leaves behind may leave with it.
    fn wait_for_recorder(&mut self) {
        let since = Instant::now();
        while self.answers.roster().has_recorder() && self.gate.recorded() < self.sky.now() {
            let gone = self.refresh_roster().is_err() || self.member.stop().is_set();
            if gone || since.elapsed() > self.answer_timeout {
                return;
            }
            self.gate.wait_for_nudge(self.nudges, LOOK_AGAIN);
        }
    }
}
