use super::*;
use crate::{create_node, domain::DomainOwner, services};
use ringwing_flight::{Command, UavId};
use ringwing_scenario::Scenario;

const UAV: UavId = UavId(2);

/// The services of a swarm of three, and what it takes to use them.
struct Run {
    services: services::Services,
    node: Node<ipc::Service>,
    gate: Gate,
    owner: DomainOwner,
}

impl Run {
    fn new() -> Self {
        let (owner, gate) = DomainOwner::create("").unwrap();
        let node = create_node(owner.domain(), "test").unwrap();
        let mut scenario = Scenario::default();
        scenario.formation.uavs = 3;
        let services = services::Services::create(&node, owner.domain(), &scenario, 8).unwrap();
        Self { services, node, gate, owner }
    }

    fn access(&self) -> BoardAccess<'_> {
        BoardAccess { node: &self.node, gate: &self.gate }
    }

    /// A process of UAV 2 has ended.
    fn replace_sender(&mut self) {
        self.services.renew(&self.node, self.owner.domain(), Part::Agent(UAV)).unwrap();
    }
}

fn board() -> Board<Command> {
    services::command(UAV, Pace::Lockstep)
}

fn post(writer: &BoardWriter<Command>, ticks: RangeInclusive<i64>) {
    for tick in ticks.map(Tick) {
        writer.post(tick, Command::withheld(tick, UAV), Stamps { sent_ns: 7, ..Stamps::default() });
    }
}

fn ticks(first: i64, last: i64) -> RangeInclusive<Tick> {
    Tick(first)..=Tick(last)
}

fn read(reader: &BoardReader<Command>, wanted: RangeInclusive<Tick>) -> Vec<i64> {
    let mut read = Vec::new();
    let newest = reader.read(wanted, |command, stamps| {
        assert_eq!((*command, stamps.sent_ns), (Command::withheld(command.tick, UAV), 7));
        read.push(command.tick.0);
    });
    assert_eq!(newest, read.last().copied().map(Tick));
    read
}

#[test]
fn a_board_keeps_the_last_two_ticks_and_shows_each_to_everybody() {
    let run = Run::new();
    let writer = board().writer(run.access()).unwrap();
    let readers = [(); 2].map(|()| board().reader(run.access()).unwrap());
    post(&writer, -1..=5);
    for reader in &readers {
        assert_eq!(read(reader, ticks(4, 4)), [4], "although tick 5 is there");
        assert_eq!(read(reader, ticks(-1, 5)), [4, 5]);
        assert_eq!(read(reader, ticks(3, 3)), [0_i64; 0], "it is overwritten");
        assert_eq!(read(reader, ticks(5, 6)), [5], "tick 6 has not come");
    }
}

#[test]
fn a_fresh_board_is_empty() {
    let run = Run::new();
    let reader = board().reader(run.access()).unwrap();
    assert_eq!(read(&reader, ticks(-1, 1)), [0_i64; 0]);
}

#[test]
fn a_tick_that_the_sender_skips_is_a_gap() {
    let run = Run::new();
    let writer = board().writer(run.access()).unwrap();
    let reader = board().reader(run.access()).unwrap();
    post(&writer, 0..=1);
    post(&writer, 3..=3);
    assert_eq!(read(&reader, ticks(2, 2)), [0_i64; 0]);
    assert_eq!(read(&reader, ticks(2, 3)), [3]);
}

#[test]
fn a_reader_uses_what_a_lost_sender_has_shown_and_then_moves_on_to_its_successor() {
    let mut run = Run::new();
    let writer = board().writer(run.access()).unwrap();
    let mut reader = board().reader(run.access()).unwrap();
    post(&writer, 0..=4);
    // A killed sender never frees its place: nobody can write here again.
    std::mem::forget(writer);
    run.replace_sender();
    let successor = board().writer(run.access()).unwrap();
    post(&successor, 5..=5);
    let mut newest = |run: &Run, tick| {
        let mut read = Vec::new();
        let take = |command: &Command, _: &Stamps| read.push(command.tick.0);
        reader.read_newest(run.access(), ticks(tick, tick), take).unwrap();
        read
    };
    assert_eq!(newest(&run, 4), [4]);
    assert_eq!(newest(&run, 5), [5]);
    post(&successor, 6..=6);
    assert_eq!(newest(&run, 6), [6]);
}

#[test]
fn what_a_lost_sender_has_shown_is_there_for_readers_that_skip_incarnations() {
    let mut run = Run::new();
    let mut late = board().reader(run.access()).unwrap();
    run.replace_sender();
    let second = board().writer(run.access()).unwrap();
    post(&second, 3..=4);
    std::mem::forget(second);
    // Neither the third nor the fourth incarnation has shown anything.
    run.replace_sender();
    run.replace_sender();
    let newcomer = board().reader(run.access()).unwrap();
    assert_eq!(read(&newcomer, ticks(3, 4)), [3, 4]);
    let mut read = Vec::new();
    let take = |command: &Command, _: &Stamps| read.push(command.tick.0);
    assert!(late.read_newest(run.access(), ticks(2, 5), take).unwrap());
    assert_eq!(read, [4], "the board for tick 5 and the one before");
}

#[test]
fn moving_on_hands_over_each_value_once() {
    let mut run = Run::new();
    let writer = board().writer(run.access()).unwrap();
    let mut reader = board().reader(run.access()).unwrap();
    post(&writer, 3..=4);
    std::mem::forget(writer);
    run.replace_sender();
    let mut read = Vec::new();
    let take = |command: &Command, _: &Stamps| read.push(command.tick.0);
    reader.read_newest(run.access(), ticks(4, 5), take).unwrap();
    assert_eq!(read, [4]);
}

#[test]
fn a_sender_that_is_replaced_many_times_always_finds_its_place() {
    let mut run = Run::new();
    let mut reader = board().reader(run.access()).unwrap();
    for tick in 0..30 {
        let writer = board().writer(run.access()).unwrap();
        let state = services::state(UAV, Pace::Lockstep).writer(run.access()).unwrap();
        post(&writer, tick..=tick);
        let mut read = 0;
        reader.read_newest(run.access(), ticks(tick, tick), |_, _| read += 1).unwrap();
        assert_eq!(read, 1, "at {tick}");
        std::mem::forget((writer, state));
        run.replace_sender();
    }
}

#[test]
fn two_payloads_share_a_service_and_do_not_mix() {
    let run = Run::new();
    let commands = board().writer(run.access()).unwrap();
    let accounts = commands.beside(&services::account(UAV, Pace::Lockstep)).unwrap();
    let reader = board().reader(run.access()).unwrap();
    let account_reader = reader.beside(&services::account(UAV, Pace::Lockstep)).unwrap();
    let account = ringwing_flight::Account::without_leader(&Command::withheld(Tick(3), UAV));
    accounts.post(Tick(3), account, Stamps::default());
    assert_eq!(read(&reader, ticks(3, 3)), [0_i64; 0]);
    let mut read = Vec::new();
    assert_eq!(account_reader.read(ticks(3, 3), |account, _| read.push(*account)), Some(Tick(3)));
    assert_eq!(read, [account]);
}
