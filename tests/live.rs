//! A flight that is shown in Foxglove while it goes on, and a log that is played as if it went on now.

use crate::harness::{
    Running, Swarm,
    foxglove::{Viewer, address_in},
    processes_of, ringwing, send, wait_until,
};
use rustix::process::Signal;
use serde_json::json;
use std::{
    io::{BufRead, BufReader},
    process::Stdio,
    thread,
    time::Duration,
};

/// How long a viewer does not read.
const HANG: Duration = Duration::from_secs(10);

/// Waits until the run says where it is shown.
fn address(run: &mut Running) -> String {
    address_in(&run.wait_for_line("live at ws://"))
}

/// The process id of the run's viewer.
fn viewer_process(run: &Running) -> u32 {
    let id = run.domain().id().clone();
    wait_until("the viewer runs", || {
        let line = processes_of(&id).into_iter().find(|line| line.contains(" viewer "))?;
        line.strip_prefix("/proc/")?.split(' ').next()?.parse().ok()
    })
}

#[test]
fn a_viewer_of_a_live_run_decodes_what_the_log_gets_and_kills_a_uav() {
    let mut run = Swarm::fly("paper-4.2").with("--real-time --duration 600 --seed 7 --live=0").start();
    let address = address(&mut run);
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    run.wait_for_second(1.0);
    let mut viewer = Viewer::connect(&address, "/uav/006/state");
    assert_eq!(viewer.info["name"], "ringwing: paper-4.2, seed 7");
    let parameters = viewer.parameters(&["formation.uavs", "control.law"]);
    assert_eq!(parameters["formation.uavs"], 6);
    assert_eq!(parameters["control.law"], "paper");

    viewer.subscribe(&["/uav/003/state", "/scene/obstacles", "/log"]);
    let scene = viewer.next("/scene/obstacles");
    let scene = viewer.decode(&scene).to_string();
    assert!(scene.contains("Obstacle 1"), "whoever joins late gets what is written once: {scene}");
    let introduction = viewer.next("/log");
    assert!(viewer.decode(&introduction).to_string().contains("6 UAVs, paper law, 100 Hz, real time"));
    let [first, second] = [0, 1].map(|_| {
        let message = viewer.next("/uav/003/state");
        let state = viewer.decode(&message);
        let of = |field: &str| state.get_field_by_name(field).unwrap().into_owned();
        assert_eq!(of("uav").as_u32(), Some(3));
        assert!((5.0..40.0).contains(&of("speed_m_s").as_f64().unwrap()));
        of("tick").as_i64().unwrap()
    });
    assert!(second > first);

    let answer = viewer.call("/fault", &json!({ "sentence": "kill uav 3" })).unwrap();
    let answer = answer["answer"].as_str().unwrap();
    assert!(answer.starts_with("tick ") && answer.ends_with("kill uav 3"), "{answer}");
    let refusal = viewer.call("/fault", &json!({ "sentence": "kill uav 9" })).unwrap_err();
    assert_eq!(refusal, "refused: there is no uav 9: this run has UAVs 1 to 6");
    assert!(viewer.call("/fault", &json!({ "sentence": "kil uav 3" })).unwrap_err().contains("did you mean"));
    wait_until("the viewer sees the fault", || {
        let line = viewer.next("/log");
        viewer.decode(&line).to_string().contains("uav 3 is killed").then_some(())
    });

    let log_topics: Vec<String> = viewer.channels.keys().cloned().collect();
    send(run.launcher(), Signal::INT);
    let run = run.finish();
    run.assert_ended_with(1);
    let log = run.log();
    assert!(log.lines().iter().any(|line| line == "fault.kill: uav 3 is killed: kill uav 3"));
    assert!(log.topics.keys().all(|topic| log_topics.contains(topic)), "{log_topics:?}");
    assert!(!run.stderr.contains("the viewer"), "{}", run.stderr);
}

#[test]
fn a_viewer_that_hangs_or_dies_costs_a_flight_in_lockstep_nothing() {
    let flight = || Swarm::fly("paper-4.1").fault("at 1 s slow uav 3 by 60 ms for 1 s").with("--duration 20");
    let undisturbed = flight().finish();
    for signal in [Signal::STOP, Signal::KILL] {
        let mut run = flight().with("--live=0").start();
        address(&mut run);
        send(viewer_process(&run), signal);
        let run = run.finish();
        run.assert_nothing_left();
        assert_eq!(run.text("payload_hash"), undisturbed.text("payload_hash"));
        assert_eq!(run.text("verdict"), undisturbed.text("verdict"), "{}", run.stderr);
        let said = "the viewer was killed by signal 9: the flight goes on without it";
        assert_eq!(run.stderr.contains(said), signal == Signal::KILL, "{}", run.stderr);
    }
}

#[test]
fn a_viewer_that_does_not_read_for_ten_seconds_costs_no_tick_and_no_deadline() {
    let flight = || Swarm::fly("paper-4.1").with("--real-time --uavs 12 --duration 12");
    let mut run = flight().with("--live=0").start();
    let alone = flight().start();
    let mut viewer = Viewer::connect(&address(&mut run), "/uav/012/state");
    let topics: Vec<String> = viewer.channels.keys().cloned().collect();
    viewer.subscribe(&topics.iter().map(String::as_str).collect::<Vec<_>>());
    let socket = viewer.into_socket();
    thread::sleep(HANG);
    let [run, alone] = [run, alone].map(Running::finish);
    drop(socket);
    assert_eq!(run.log().states(1).len(), 1201, "every tick is in the log");
    // Two flights on one busy machine never miss the same deadlines. A flight that waited would miss most of a thousand.
    let [seen, unseen] = [&run, &alone].map(|run| run.number("missed_deadlines"));
    assert!(seen <= unseen + 100.0, "{seen} deadlines missed, and {unseen} without a viewer");
}

#[test]
fn an_address_that_is_taken_or_open_to_others_is_told_and_the_flight_goes_on() {
    let mut first = Swarm::fly("paper-4.1").with("--real-time --duration 600 --live=0").start();
    let taken = address(&mut first);
    let run = Swarm::fly("paper-4.1").with(&format!("--real-time --duration 2 --live={taken}")).finish();
    let said = [format!("error: viewer: cannot listen at {taken}"), "the flight goes on without it".into()];
    assert!(said.iter().all(|text| run.stderr.contains(text)), "{}", run.stderr);
    assert_eq!(run.number("ticks"), 200.0);
    let mut open = Swarm::fly("paper-4.1").with("--real-time --duration 600 --live=0.0.0.0:0").start();
    address(&mut open);
    send(open.launcher(), Signal::INT);
    let said = "warning: --live=0.0.0.0:0: everybody who reaches this address can watch the flight and ask for faults";
    let open = open.finish();
    assert!(open.stderr.contains(said), "{}", open.stderr);
}

#[test]
fn a_log_is_played_at_any_speed_with_pauses_and_seeks() {
    let run = Swarm::fly("paper-4.1").with("--duration 20").finish();
    let mut replay = ringwing()
        .arg("replay")
        .arg(&run.folder)
        .args(["--live=0", "--speed", "1"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(replay.stdout.take().unwrap()).lines();
    let address = address_in(&lines.next().unwrap().unwrap());
    let mut viewer = Viewer::connect(&address, "/uav/001/state");
    assert!(viewer.info["capabilities"].as_array().unwrap().contains(&json!("playbackControl")));
    viewer.subscribe(&["/uav/001/state", "/scene/formation"]);
    let start = 1_767_225_600_000_000_000_u64;
    let second = 1_000_000_000;
    assert!(viewer.next("/uav/001/state").log_time < start + 10 * second);
    let (paused, _) = viewer.control(false, 1.0, None);
    assert_eq!(paused, 1);
    let (playing, time) = viewer.control(true, 20.0, Some(start + 12 * second));
    assert_eq!((playing, time), (0, start + 12 * second));
    // Messages that were on their way come first.
    let mut message = viewer.next("/scene/formation");
    wait_until("the seek acts", || {
        message = viewer.next("/uav/001/state");
        (message.log_time > start + 12 * second).then_some(())
    });
    let state = viewer.decode(&message);
    assert_eq!(state.get_field_by_name("uav").unwrap().as_u32(), Some(1));
    let (ended, time) = viewer.playback();
    assert!(ended == 3 && time >= start + 20 * second, "{ended} at {time}");
    let (_, again) = viewer.control(true, 1.0, Some(start));
    assert_eq!(again, start);
    wait_until("it begins anew", || (viewer.next("/uav/001/state").log_time < start + second).then_some(()));
    send(replay.id(), Signal::INT);
    assert!(replay.wait().unwrap().success());
}
