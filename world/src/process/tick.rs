//! One tick: publish what the UAVs sense, open the gate, take in the commands, close the account.
//!
//! Every tick pays for this path. Never allocates, and reads the clock only for stamps and deadlines.

use super::{
    TickClock, World,
    wait::{RECHECK, RETRY, WaitEnd, wait_until},
};
use crate::{Airspace, CommandCounts, Refusal, Sensing};
use ringwing_bus::{BusError, Lateness, PacedTick, Stamps, TickProbe, monotonic_ns};
use ringwing_flight::{Command, Event, Tick, TickTiming, UavId};
use std::{hint::black_box, thread, time::Duration};

/// How long a flight in real time waits for the first answers. 1000 UAVs on two cores need about 0.1 s. A longer limit delays a flight
/// whose agents do not answer from the beginning; a shorter one lets a large swarm on a busy machine miss its first deadlines.
const FIRST_ANSWERS_LIMIT: Duration = Duration::from_secs(1);

/// A command that the world has read, and when.
struct SeenAnswer {
    command: Command,
    stamps: Stamps,
    seen_ns: u64,
}

impl<P: TickProbe> World<'_, P> {
    pub(super) fn fly_tick(&mut self) -> Result<(), BusError> {
        self.open_tick()?;
        match self.clock {
            TickClock::Lockstep => self.wait_for_answers()?,
            TickClock::RealTime(_) => {
                if self.airspace.now() <= Tick(0) {
                    self.wait_for_first_answers()?;
                }
                self.wait_for_deadline()?;
            }
        }
        self.end_tick()
    }

    /// Sends every UAV what it senses, then opens the tick.
    fn open_tick(&mut self) -> Result<(), BusError> {
        let opened_ns = monotonic_ns();
        let now = self.airspace.now();
        self.probe.tick_opened(now, opened_ns);
        let stamps = Stamps { woke_ns: opened_ns, read_ns: opened_ns, sent_ns: opened_ns, sending_ns: 0 };
        self.refresh_faults()?;
        self.ports.begin_journal(now);
        let ports = &mut self.ports;
        self.airspace.open_tick(|Sensing { sensed, traffic, truth }| {
            if let Some(traffic) = traffic {
                ports.traffic[sensed.uav.index()].post(now, *traffic, stamps);
            }
            ports.sensed[sensed.uav.index()].post(sensed, stamps);
            ports.journal.note_sensed(sensed, truth);
        });
        self.ports.ballast.iter().try_for_each(|ballast| ballast.send(now))?;
        // Read the roster as late as possible, so that the tick does not wait for a process that has just ended.
        self.refresh_roster()?;
        self.answers.begin(now, opened_ns);
        self.probe.inputs_published();
        if let TickClock::RealTime(deadlines) = &self.clock {
            self.ports.gate.set_due(deadlines.due());
        }
        self.ports.open_tick(now, self.answers.expected())?;
        // Only now, while the agents work: nobody waits for the hash and the journal.
        self.airspace.catch_up();
        self.ports.journal.send()
    }

    /// In lockstep: waits until every process on the roster has answered, and gives up those that do not.
    fn wait_for_answers(&mut self) -> Result<(), BusError> {
        let is_hold_over =
            |world: &Self| world.has_all_answers() || !world.holds.is_for_replacement(world.answers.roster());
        let (answer_timeout, hold_timeout) = (self.holds.answer_timeout, self.holds.hold_timeout);
        // Wait even if no answer is missing, so that a process that was given up is heard when it answers again.
        self.await_answers()?;
        let mut end =
            wait_until(self, answer_timeout, Self::has_all_answers, Self::wait_mode, Self::look_again)?;
        if end == WaitEnd::Overdue && self.holds.is_for_replacement(self.answers.roster()) {
            // A leader that replaces a lost one needs the time to start, and then its own time to answer.
            wait_until(self, hold_timeout, is_hold_over, Self::wait_mode, Self::look_again)?;
            end = wait_until(self, answer_timeout, Self::has_all_answers, Self::wait_mode, Self::look_again)?;
        }
        if end == WaitEnd::Overdue { self.give_up() } else { Ok(()) }
    }

    fn has_all_answers(&self) -> bool {
        self.answers.missing().next().is_none()
    }

    fn await_answers(&mut self) -> Result<(), BusError> {
        self.ports.wait_for_answers(RECHECK)?;
        self.collect()
    }

    fn look_again(&mut self) -> Result<(), BusError> {
        self.refresh_roster()?;
        // The gate counted the answer of a process that is not waited for: its count no longer tells when to look.
        if self.ports.gate.is_answered() {
            thread::sleep(RETRY);
        }
        self.await_answers()
    }

    /// Goes on without the answers that are missing.
    fn give_up(&mut self) -> Result<(), BusError> {
        self.wall_clock.count_unanswered();
        let waited_s = self.holds.answer_timeout.as_secs_f64();
        for part in self.answers.give_up() {
            self.log_event(Event::ProcessSilent { part, waited_s })?;
        }
        Ok(())
    }

    /// In real time: starts the clock once all have answered the approach and tick 0. There each process touches its code and its
    /// memory for the first time, so a large swarm would miss the first deadlines.
    fn wait_for_first_answers(&mut self) -> Result<(), BusError> {
        self.await_answers()?;
        wait_until(self, FIRST_ANSWERS_LIMIT, Self::has_all_answers, Self::wait_mode, Self::look_again)?;
        self.restart_deadlines();
        Ok(())
    }

    /// In real time: waits for the deadline, whoever has answered.
    fn wait_for_deadline(&mut self) -> Result<(), BusError> {
        if let TickClock::RealTime(deadlines) = &self.clock {
            let airspace = &self.airspace;
            self.ports.wait_until(deadlines.due(), || rehearse(airspace))?;
        }
        self.collect()
    }

    /// Takes in what has arrived: the newest command of each UAV, and whether the leader has answered.
    pub(super) fn collect(&mut self) -> Result<(), BusError> {
        self.probe.collecting_answers();
        let now = self.airspace.now();
        for uav in self.answers.uavs() {
            if let Some(answer) = self.newest_answer(uav, now)? {
                self.take(uav, &answer);
            }
        }
        for ballast in &self.ports.ballast {
            ballast.receive()?;
        }
        self.answers.note_leader(self.ports.read_leader(now)?);
        self.probe.answers_collected();
        Ok(())
    }

    /// The newest command of `uav`'s agent up to that of `now`, if it was not read yet.
    fn newest_answer(&mut self, uav: UavId, now: Tick) -> Result<Option<SeenAnswer>, BusError> {
        let Self { ports, probe, .. } = self;
        let mut newest = None;
        ports.read_commands(uav, now, |command, stamps| {
            // Read the clock once for the probe and the timing: a large swarm gives hundreds of answers in a tick.
            let seen_ns = monotonic_ns();
            probe.answer_seen(uav, command.tick, stamps, seen_ns);
            newest = Some(SeenAnswer { command: *command, stamps: *stamps, seen_ns });
        })?;
        Ok(newest)
    }

    fn take(&mut self, from: UavId, answer: &SeenAnswer) {
        // A foreign command is no answer of this agent, and its number may be outside the swarm: it comes from shared
        // memory.
        if self.airspace.take(from, &answer.command) != Err(Refusal::NotItsOwn) {
            self.answers.note(&answer.command, &answer.stamps, answer.seen_ns);
        }
    }

    /// Closes the tick's account, and sends how long it took.
    fn end_tick(&mut self) -> Result<(), BusError> {
        // Read the clock first, so that hashing the answers does not count as lateness.
        let (lateness, paced) = self.pass_deadline();
        let CommandCounts { answered, reused } = self.airspace.end_tick();
        self.probe.tick_finished(reused, paced);
        let Lateness { late_ns, missed_deadlines } = lateness;
        let timing = TickTiming { answered, reused, late_ns, missed_deadlines, ..self.answers.timing() };
        self.wall_clock.add(&timing);
        self.ports.journal.note_timing(&timing);
        self.ports.log_failed_connections(self.airspace.now())
    }

    /// In real time: ends the tick at this moment, and sets the next deadline.
    fn pass_deadline(&mut self) -> (Lateness, Option<PacedTick>) {
        let TickClock::RealTime(deadlines) = &mut self.clock else { return (Lateness::default(), None) };
        let due_ns = deadlines.due().at_ns;
        let lateness = deadlines.advance(monotonic_ns());
        (lateness, Some(PacedTick { due_ns, skipped: lateness.missed_deadlines }))
    }
}

/// Does with a copy of `airspace` what has to be done at the deadline, and forgets the outcome: after a wait the caches are
/// cold, and all agents would wait for the world to warm them.
fn rehearse(airspace: &Airspace) {
    let mut rehearsal = airspace.clone();
    rehearsal.end_tick();
    black_box(rehearsal.step());
    rehearsal.open_tick(|senses| {
        black_box(senses);
    });
}
