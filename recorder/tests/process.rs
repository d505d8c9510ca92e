//! The recorder's process over real shared memory; the test plays all other processes.
#![expect(clippy::unwrap_used, reason = "what fails here fails the test")]

use mcap::{MessageStream, Summary};
use ringwing_bus::{
    DomainId, DomainOwner, Gate, JournalWriter, MemberArgs, Publisher, Services, Stamps, create_node, report,
    services,
};
use ringwing_flight::{
    Account, Command, Event, EventMessage, FlightMode, JournalEntry, JournalHeader, LeaderState, Part,
    Sensed, SensedObstacle, Tick, TimedEvent, Truth, UavId, WorldReport,
};
use ringwing_recorder::{RecorderArgs, RecorderError, RecorderReport, run};
use ringwing_scenario::Scenario;
use std::{
    path::PathBuf,
    thread,
    time::{Duration, Instant},
};

const UAVS: u32 = 6;

/// Plays launcher, world, leader and agents of a formation at rest.
struct Everybody {
    scenario: Scenario,
    journal: JournalWriter,
    events: Publisher<EventMessage>,
    gate: Gate,
    _services: Services,
    owner: DomainOwner,
}

impl Everybody {
    fn new() -> Self {
        let scenario = Scenario::default();
        let (owner, gate) = DomainOwner::create(&scenario.to_toml()).unwrap();
        let node = create_node(owner.domain(), "everybody").unwrap();
        Self {
            _services: Services::create(&node, owner.domain(), &scenario, 1024).unwrap(),
            scenario,
            journal: JournalWriter::open(&node, UAVS).unwrap(),
            events: services::world_events().publisher(&node).unwrap(),
            gate,
            owner,
        }
    }

    fn domain(&self) -> DomainId {
        self.owner.domain().id().clone()
    }

    fn await_recorder(&self) {
        wait_until("the recorder is there", || self.gate.ready_process(Part::Recorder).is_some());
    }

    fn fly(&self, ticks: std::ops::Range<i64>) {
        for tick in ticks.map(Tick) {
            wait_until("the recorder keeps up", || tick.since(self.gate.recorded()) < 512);
            self.publish(tick);
        }
    }

    fn publish(&self, tick: Tick) {
        let formation = self.scenario.formation();
        let centre = [15.0 * tick.seconds(100), 0.0];
        let mut header = JournalHeader::of(tick);
        header.set_leader(&LeaderState {
            tick,
            position_m: centre,
            heading_rad: 0.0,
            speed_m_s: 15.0,
            turn_rate_rad_s: 0.0,
        });
        let entry = |uav: UavId| {
            let mut entry = JournalEntry::empty();
            let sensed = sensed(tick, uav, formation.slot(uav.0, centre.into()).into());
            let Sensed { position_m, heading_rad, speed_m_s, turn_rate_rad_s, .. } = sensed;
            let truth = Truth { position_m, heading_rad, speed_m_s, turn_rate_rad_s, wind_m_s: [0.0; 2] };
            entry.set_sensed(&sensed, &truth);
            // Its agent knows exactly where it is.
            let estimate =
                Account { estimate_m: position_m, estimate_heading_rad: heading_rad, ..account(tick, uav) };
            entry.set_account(&estimate);
            entry
        };
        let entries: Vec<JournalEntry> = UavId::all(UAVS).map(entry).collect();
        self.gate.open_tick(tick, UAVS);
        self.journal.send(&header, &entries).unwrap();
    }

    fn land(&self, last_tick: i64) {
        let world = WorldReport {
            last_tick,
            complete: true,
            payload_hash: "00ff".into(),
            collisions: Vec::new(),
            failsafes: 0,
            refused_commands: 0,
            reused_commands: 0,
            missed_deadlines: 0,
            unanswered_ticks: 0,
            late_max_us: 0.0,
            latency: None,
        };
        self.owner.domain().write_report(report::WORLD, &world).unwrap();
        self.gate.close();
    }

    fn report(&self) -> RecorderReport {
        self.owner.domain().report(report::RECORDER).unwrap().unwrap()
    }
}

fn sensed(tick: Tick, uav: UavId, position_m: [f64; 2]) -> Sensed {
    Sensed {
        tick,
        position_m,
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav,
        mode: FlightMode::COMMANDED,
        obstacle_count: 0,
        obstacles_omitted: 0,
        obstacles: [SensedObstacle::default(); 8],
        position_age_ticks: 0,
        heading_age_ticks: 0,
    }
}

fn account(tick: Tick, uav: UavId) -> Account {
    let command = Command::new(tick, uav, 15.0, 0.0);
    Account::without_leader(&command)
}

fn wait_until(what: &str, condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(10), "never: {what}");
        thread::sleep(Duration::from_micros(50));
    }
}

fn start(domain: DomainId, log: Option<PathBuf>) -> thread::JoinHandle<Result<(), RecorderError>> {
    thread::spawn(move || {
        run(&RecorderArgs {
            member: MemberArgs { domain, launcher: None },
            log,
            no_timing: false,
            started_at: None,
        })
    })
}

#[test]
fn a_flight_over_shared_memory_is_recorded_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let everybody = Everybody::new();
    let recorder = start(everybody.domain(), Some(path.clone()));
    everybody.await_recorder();
    everybody.fly(-1..1500);
    let event = TimedEvent { tick: Tick(1499), event: Event::RunInterrupted };
    everybody.events.send(EventMessage::new(&event), Stamps::now()).unwrap();
    everybody.land(1499);
    recorder.join().unwrap().unwrap();

    let report = everybody.report();
    assert_eq!((report.summary.ticks, report.summary.last_tick, report.gaps.len()), (1500, Some(1499), 0));
    assert_eq!((report.summary.settling_s, report.problem), (Some(0.0), None));
    let file = std::fs::read(path).unwrap();
    let summary = Summary::read(&file).unwrap().unwrap();
    let result = mcap::read::metadata(&file, &summary.metadata_indexes[1]).unwrap();
    assert_eq!(result.metadata["verdict"], "passed");
    let each_tick = 6 + 6 + 1; // state, control, timing
    let twenty_a_second = 4; // leader, frames, swarm, metrics
    let slower = 75 + 5 * 15 + 4; // links; trails, map twice, faults, percentiles; what stands still, and the path
    let lines_and_events = 2 + 1;
    let messages = 1500 * each_tick + 300 * twenty_a_second + slower + lines_and_events;
    assert_eq!(MessageStream::new(&file).unwrap().count(), messages);
    assert_eq!(report.messages, messages as u64);
}

#[test]
fn without_a_log_the_flight_is_only_measured() {
    let everybody = Everybody::new();
    let recorder = start(everybody.domain(), None);
    everybody.await_recorder();
    everybody.fly(-1..300);
    everybody.land(299);
    recorder.join().unwrap().unwrap();
    assert_eq!((everybody.report().summary.ticks, everybody.report().messages), (300, 0));
}

#[test]
fn a_log_that_vanishes_ends_the_recorder_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let everybody = Everybody::new();
    let recorder = start(everybody.domain(), Some(path.clone()));
    everybody.await_recorder();
    std::fs::remove_file(&path).unwrap();
    everybody.fly(-1..300);
    everybody.land(299);
    let error = recorder.join().unwrap().unwrap_err().to_string();
    assert!(error.contains("run.mcap: cannot be written: the file was removed; leave the log"), "{error}");
    assert_eq!(everybody.report().problem, Some(error));
}
