//! The world as an operating-system process: keeps time, and drives the airspace with what the other processes answer.
//!
//! [`run`] is the process from its start to its end. The child modules hold its parts: `tick` one tick, `holds` what
//! delays the next one, `answers` who has answered, `ports` the connections, `journal` what the log gets, `wait` the
//! bounded wait, `wall_clock` the latencies.
//!
//! Never decides anything about the flight: that is [`Airspace`]'s part, which the simulation uses as well.

mod answers;
mod holds;
mod journal;
mod ports;
mod tick;
mod wait;
mod wall_clock;

use crate::Airspace;
use answers::Answers;
use holds::Holds;
use ports::Ports;
use ringwing_bus::{
    BusError, Deadlines, FaultWatch, Member, MemberArgs, Proceed, TickProbe, monotonic_ns,
    processes_per_core, report,
};
use ringwing_flight::{Event, Pace, Part, WorldReport};
use ringwing_scenario::{Scenario, start};
use wall_clock::WallClock;

/// Which run the world belongs to.
#[derive(Debug, Clone, clap::Args)]
pub struct WorldArgs {
    /// The run.
    #[command(flatten)]
    pub member: MemberArgs,
}

/// Processes that share the machine with the agents: the world and the leader. The recorder sleeps most of the time.
const OTHERS: u32 = 2;

/// Flies the run until its last tick, or until it is asked to stop, and leaves the world's report.
///
/// `probe` observes every tick and may end the flight; [`NoProbe`](ringwing_bus::NoProbe) does neither.
pub fn run(args: &WorldArgs, probe: impl TickProbe) -> Result<(), BusError> {
    let member = Member::join(&args.member, Part::World)?;
    let scenario = member.scenario();
    let airspace = Airspace::new(scenario, &start::states(scenario)?);
    let ports = Ports::open(&member)?;
    let mut world = World::new(&member, airspace, ports, probe);
    if world.wait_for_roster()? {
        world.fly()?;
    }
    world.ports.journal.finish()?;
    // Before the gate is closed: agents leave then, and what they have sent may vanish with them. The flight itself is
    // complete, whatever becomes of this wait.
    let _ = world.wait_for_last_fetch();
    world.probe.run_ended(&world.ports.gate)?;
    // The report comes first: once the gate is closed, the others look for it.
    member.domain().write_report(report::WORLD, &world.report())?;
    world.ports.close()
}

/// What ends a tick.
#[derive(Debug)]
enum TickClock {
    /// In lockstep: the last answer.
    Lockstep,
    /// In real time: a deadline, whether or not everybody has answered.
    RealTime(Deadlines),
}

struct World<'m, P> {
    airspace: Airspace,
    answers: Answers,
    ports: Ports<'m>,
    clock: TickClock,
    holds: Holds,
    faults: FaultWatch<'m>,
    wall_clock: WallClock,
    probe: P,
}

impl<'m, P: TickProbe> World<'m, P> {
    fn new(member: &'m Member, airspace: Airspace, ports: Ports<'m>, probe: P) -> Self {
        let scenario = member.scenario();
        Self {
            airspace,
            answers: Answers::new(scenario.formation.uavs),
            holds: Holds::new(scenario, ports.journal.depth()),
            faults: FaultWatch::new(member),
            ports,
            clock: clock(scenario, member.cores()),
            wall_clock: WallClock::default(),
            probe,
        }
    }

    fn fly(&mut self) -> Result<(), BusError> {
        loop {
            if let TickClock::Lockstep = self.clock {
                self.hold_next_tick()?;
            }
            // Open no further tick after a stop during a hold: chance would decide which commands it gets.
            if self.is_stopped() {
                return Ok(());
            }
            match self.probe.before_tick(&self.ports.gate) {
                Proceed::Fly => {}
                Proceed::RestartDeadlines => self.restart_deadlines(),
                Proceed::End => return Ok(()),
            }
            self.fly_tick()?;
            if self.airspace.is_over() || self.is_stopped() {
                return Ok(());
            }
            for event in self.airspace.step() {
                self.log_event(event)?;
            }
        }
    }

    fn restart_deadlines(&mut self) {
        if let TickClock::RealTime(deadlines) = &mut self.clock {
            deadlines.restart(monotonic_ns());
        }
    }

    fn is_stopped(&self) -> bool {
        self.ports.is_stopped()
    }

    /// Takes over the faults that were added since the last tick. In lockstep the launcher adds them while it holds the tick in
    /// which they begin.
    fn refresh_faults(&mut self) -> Result<(), BusError> {
        if let Some(schedule) = self.faults.changed(&self.ports.gate)? {
            self.airspace.set_airframe_faults(schedule.airframe_faults());
        }
        Ok(())
    }

    /// Takes over the launcher's new rosters, if there are any.
    fn refresh_roster(&mut self) -> Result<(), BusError> {
        let (answers, holds) = (&mut self.answers, &mut self.holds);
        self.ports.drain_rosters(|roster| {
            answers.set_roster(roster);
            holds.on_roster(roster);
        })
    }

    fn log_event(&self, event: Event) -> Result<(), BusError> {
        self.ports.log_event(self.airspace.now(), event)
    }

    fn report(&self) -> WorldReport {
        let mut report = self.wall_clock.complete(self.airspace.report());
        // A measurement ends the flight early, as planned.
        report.complete |= self.probe.is_done();
        report
    }
}

fn clock(scenario: &Scenario, cores: u32) -> TickClock {
    let crowd = processes_per_core(scenario.formation.uavs + OTHERS, cores);
    match scenario.pace() {
        Pace::Lockstep => TickClock::Lockstep,
        Pace::RealTime => TickClock::RealTime(Deadlines::new(scenario.time.rate_hz, crowd, monotonic_ns())),
    }
}
