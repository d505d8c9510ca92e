//! The world's process against agents and a launcher of this test's own, over real shared memory.
//!
//! Each flight is flown a second time by an [`Airspace`] without processes: both must give the same report.
#![expect(clippy::unwrap_used, reason = "what fails here fails the test")]

use ringwing_bus::{
    BoardAccess, BoardWriter, BusError, DomainOwner, Gate, JournalReader, MemberArgs, NoProbe, Publisher,
    Services, Stamps, Wire, create_node, report, services,
};
use ringwing_flight::{
    Account, Command, JournalEntry, JournalHeader, LeaderState, Part, Roster, Tick, UavId, WorldReport,
};
use ringwing_scenario::{Scenario, start};
use ringwing_world::{Airspace, WorldArgs, run};
use std::{
    thread,
    time::{Duration, Instant},
};

const UAVS: u32 = 3;

/// Plays launcher, leader and agents, and flies the airspace beside the process.
struct Everybody {
    airspace: Airspace,
    commands: Vec<BoardWriter<Command>>,
    accounts: Vec<BoardWriter<Account>>,
    leader: BoardWriter<LeaderState>,
    journal: JournalReader,
    rosters: Publisher<Roster>,
    roster: Roster,
    gate: Gate,
    world: Option<thread::JoinHandle<Result<(), BusError>>>,
    _services: Services,
    owner: DomainOwner,
}

impl Everybody {
    /// Starts a world of `text`, with the leader and all agents on the roster.
    fn new(text: &str) -> Self {
        let text = format!("name = \"unnamed\"\nformation.uavs = {UAVS}\n{text}");
        let scenario = Scenario::resolved(&text).unwrap();
        let (owner, gate) = DomainOwner::create(&text).unwrap();
        let node = create_node(owner.domain(), "everybody").unwrap();
        let held = Services::create(&node, owner.domain(), &scenario, 1024).unwrap();
        let boards = BoardAccess { node: &node, gate: &gate };
        let pace = scenario.pace();
        let commands: Vec<_> =
            UavId::all(UAVS).map(|uav| services::command(uav, pace).writer(boards).unwrap()).collect();
        let accounts = UavId::all(UAVS)
            .zip(&commands)
            .map(|(uav, command)| command.beside(&services::account(uav, pace)).unwrap())
            .collect();
        let leader = services::leader(UAVS, pace).writer(boards).unwrap();
        let args = WorldArgs { member: MemberArgs { domain: owner.domain().id().clone(), launcher: None } };
        let mut everybody = Self {
            airspace: Airspace::new(&scenario, &start::states(&scenario).unwrap()),
            commands,
            accounts,
            leader,
            journal: JournalReader::of_recorder(&node).unwrap(),
            rosters: services::roster().publisher(&node).unwrap(),
            roster: Roster::empty(),
            gate,
            world: Some(thread::spawn(move || run(&args, NoProbe))),
            _services: held,
            owner,
        };
        wait_until("the world is ready", || everybody.gate.ready_process(Part::World).is_some());
        everybody.change_roster(|roster| {
            roster.set_leader(true);
            UavId::all(UAVS).for_each(|uav| roster.set(uav, true));
        });
        everybody
    }

    fn change_roster(&mut self, change: impl FnOnce(&mut Roster)) {
        change(&mut self.roster);
        self.roster.revision += 1;
        self.rosters.send(self.roster, Stamps::now()).unwrap();
        self.gate.nudge_world();
    }

    /// Waits for the next tick, and opens it in the airspace too.
    fn await_tick(&mut self) -> Tick {
        let now = self.airspace.now();
        wait_until("the next tick opens", || self.gate.tick() == Some(now));
        self.airspace.open_tick(|_| ());
        now
    }

    /// Sends a command to the world's process and to the airspace.
    fn command(&mut self, command: Command) {
        if command.withheld == 0 {
            let account = Account::without_leader(&command);
            self.accounts[command.uav.index()].post(command.tick, account, Stamps::now());
        }
        self.commands[command.uav.index()].post(command.tick, command, Stamps::now());
        let _ = self.airspace.take(command.uav, &command);
    }

    fn answer(&mut self, command: Command) {
        self.command(command);
        self.gate.answer(Part::Agent(command.uav), command.tick);
    }

    fn lead(&mut self, tick: Tick) {
        self.leader.post(tick, leader_state(tick), Stamps::now());
        self.gate.answer(Part::Leader, tick);
    }

    /// Ends the tick in the airspace; the process does so once all have answered.
    fn end_tick(&mut self) {
        self.airspace.end_tick();
        if !self.airspace.is_over() {
            self.airspace.step();
        }
    }

    /// Flies through the ticks before `end`; each of the `uavs` answers as `decide` says.
    fn fly(&mut self, end: i64, uavs: &[u32], decide: impl Fn(Tick, UavId) -> Command) {
        while self.airspace.now() < Tick(end) {
            let now = self.await_tick();
            for uav in uavs {
                self.answer(decide(now, UavId(*uav)));
            }
            self.lead(now);
            self.end_tick();
        }
    }

    /// The last tick is answered as well, and nobody flies on from it.
    fn fly_last_tick(&mut self) {
        let last = self.await_tick();
        for uav in UavId::all(UAVS) {
            self.answer(turn(last, uav));
        }
        self.lead(last);
        self.end_tick();
    }

    /// Asserts that the process reports the airspace's flight.
    fn assert_same_report(&mut self) {
        self.world.take().unwrap().join().unwrap().unwrap();
        let report: WorldReport = self.owner.domain().report(report::WORLD).unwrap().unwrap();
        assert_eq!(report.unanswered_ticks, 0);
        // Only the process knows wall-clock times.
        assert_eq!(WorldReport { latency: None, late_max_us: 0.0, ..report }, self.airspace.report());
    }
}

fn turn(tick: Tick, uav: UavId) -> Command {
    let turn_rate_rad_s = 0.01 * f64::from(uav.0) + 1e-4 * tick.0 as f64;
    Command::new(tick, uav, 16.0, turn_rate_rad_s)
}

fn leader_state(tick: Tick) -> LeaderState {
    LeaderState {
        tick,
        position_m: [tick.0 as f64, 0.0],
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
    }
}

fn wait_until(what: &str, condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(10), "never: {what}");
        thread::sleep(Duration::from_micros(50));
    }
}

#[test]
fn a_flight_ends_at_its_last_tick_with_the_airspaces_report() {
    let mut everybody = Everybody::new("time.duration_s = 0.3");
    everybody.fly(30, &[1, 2, 3], turn);
    everybody.fly_last_tick();
    everybody.assert_same_report();
    assert!(everybody.airspace.report().complete);
}

#[test]
fn in_real_time_the_clock_starts_once_all_have_answered_for_the_first_time() {
    let mut everybody = Everybody::new("time.real_time = true\ntime.rate_hz = 10\ntime.duration_s = 0.3");
    for slow in [-1, 0] {
        assert_eq!(everybody.await_tick(), Tick(slow));
        // Four deadlines would pass meanwhile.
        thread::sleep(Duration::from_millis(400));
        UavId::all(UAVS).for_each(|uav| everybody.answer(turn(Tick(slow), uav)));
        everybody.lead(Tick(slow));
        everybody.end_tick();
    }
    everybody.fly(3, &[1, 2, 3], turn);
    everybody.fly_last_tick();
    // The airspace knows of no missed deadline and of no reused command.
    everybody.assert_same_report();
}

#[test]
fn a_thawed_agent_first_answers_the_tick_that_was_open() {
    let mut everybody = Everybody::new("time.duration_s = 0.3");
    // The world holds tick 10 until the agent of UAV 3 is frozen, and tick 15 until it is thawed.
    everybody.change_roster(|roster| roster.free_before = Tick(10));
    everybody.fly(10, &[1, 2, 3], turn);
    wait_until("the world holds tick 10", || everybody.gate.held() == Some(Tick(10)));
    everybody.change_roster(|roster| {
        roster.set(UavId(3), false);
        roster.free_before = Tick(15);
    });
    everybody.fly(15, &[1, 2], turn);
    wait_until("the world holds tick 15", || everybody.gate.held() == Some(Tick(15)));
    // The launcher releases tick 15 only after the thawed agent has answered tick 14.
    everybody.answer(turn(Tick(14), UavId(3)));
    everybody.change_roster(|roster| {
        roster.set(UavId(3), true);
        roster.free_before = Tick(i64::MAX);
    });
    everybody.fly(30, &[1, 2, 3], turn);
    everybody.fly_last_tick();
    assert_eq!(everybody.airspace.report().reused_commands, 5);
    everybody.assert_same_report();
}

#[test]
fn the_world_waits_for_the_agent_of_a_vanished_uav_that_withholds_its_commands() {
    let mut everybody = Everybody::new(
        "time.duration_s = 0.3\nairframe.failsafe = \"vanish\"\nairframe.command_timeout_s = 0.1",
    );
    let decide = |tick, uav: UavId| {
        if uav == UavId(3) { Command::withheld(tick, uav) } else { turn(tick, uav) }
    };
    everybody.fly(20, &[1, 2, 3], decide);
    let now = everybody.await_tick();
    for uav in [1, 2].map(UavId) {
        everybody.answer(turn(now, uav));
    }
    everybody.lead(now);
    thread::sleep(Duration::from_millis(5));
    assert_eq!(everybody.gate.tick(), Some(now), "one agent has not answered yet");
    everybody.answer(Command::withheld(now, UavId(3)));
    everybody.end_tick();
    everybody.fly(30, &[1, 2, 3], decide);
    everybody.fly_last_tick();
    assert_eq!(everybody.airspace.report().failsafes, 1);
    everybody.assert_same_report();
}

#[test]
fn the_journal_has_every_tick_with_what_was_sent_and_what_came_back() {
    let mut everybody = Everybody::new("time.duration_s = 0.3");
    everybody.gate.set_ready_process(Part::Recorder, Some(1));
    everybody.change_roster(|roster| {
        roster.set_recorder(true);
        roster.free_before = Tick(10);
    });
    everybody.fly(10, &[1, 2, 3], turn);
    wait_until("the world holds tick 10", || everybody.gate.held() == Some(Tick(10)));
    everybody.change_roster(|roster| {
        roster.set(UavId(3), false);
        roster.free_before = Tick(i64::MAX);
    });
    everybody.fly(30, &[1, 2], turn);
    let last = everybody.await_tick();
    [1, 2].map(UavId).into_iter().for_each(|uav| everybody.answer(turn(last, uav)));
    everybody.lead(last);
    everybody.end_tick();

    let (mut ticks, mut accounts) = (Vec::new(), [0; 3]);
    let mut take = |header: &JournalHeader, entries: &[Wire<JournalEntry>], ticks: &mut Vec<i64>| {
        ticks.push(header.tick().0);
        assert_eq!(header.leader(), Some(&leader_state(header.tick())));
        for (uav, entry) in UavId::all(UAVS).zip(entries) {
            let sensed = entry.0.sensed().unwrap();
            assert_eq!((sensed.tick, sensed.uav), (header.tick(), uav));
            if let Some(account) = entry.0.account() {
                assert_eq!((account.tick, account.uav), (header.tick(), uav));
                accounts[uav.index()] += 1;
            }
        }
    };
    // The world leaves once the last tick was read: what is in its queue would vanish with it.
    let since = Instant::now();
    while ticks.last() != Some(&30) {
        assert!(since.elapsed() < Duration::from_secs(10), "the journal ends with {:?}", ticks.last());
        everybody.journal.drain(|header, entries| take(header, entries, &mut ticks)).unwrap();
    }
    everybody.gate.set_recorded(last);
    everybody.assert_same_report();
    // Whether the first ticks are in it depends on when the recorder came.
    assert_eq!(ticks, (ticks[0]..=30).collect::<Vec<_>>());
    assert!(ticks[0] < 10, "{ticks:?}");
    assert_eq!(accounts, [ticks.len(), ticks.len(), ticks.iter().filter(|tick| **tick < 10).count()]);
}
