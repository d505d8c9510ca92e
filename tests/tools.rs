//! The tools that read logs: each agrees with the run or reports what is wrong with the file.

use crate::harness::{Finished, Swarm, ringwing};
use ringwing_flight::Part;
use rustix::process::Signal;
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

fn tool(arguments: &[&str]) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = ringwing().args(arguments).output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

fn log_of(run: &Finished) -> PathBuf {
    run.log_path()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn review_computes_the_summary_of_the_run_from_its_log() {
    let run = Swarm::fly("paper-4.2").finish();
    let (code, json, _) = tool(&["review", text(&log_of(&run)), "--json"]);
    let reviewed: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(code, Some(0));
    for key in
        ["verdict", "flight", "obstacles", "collisions", "payload_hash", "settling_s", "ticks", "violations"]
    {
        assert_eq!(reviewed[key], run.summary[key], "{key}");
    }
    assert!(!run.folder.join("review").exists());
}

#[test]
fn review_and_run_give_the_same_figures() {
    // With collisions, faults and a violation, so that every kind of figure is there.
    let run = Swarm::fly("storm").with("--law paper --seed 9").finish();
    assert!(run.number("collisions") > 0.0, "{:#}", run.summary);
    let (code, json, _) = tool(&["review", text(&log_of(&run)), "--json"]);
    let reviewed: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(code, run.status.code());
    for (key, value) in run.summary.as_object().unwrap() {
        // A log holds neither the wall-clock times of its run nor the command that started it.
        if !["start_s", "wall_s", "real_time_factor", "command"].contains(&key.as_str()) {
            assert_eq!(reviewed[key], *value, "{key}");
        }
    }
}

#[test]
fn review_draws_a_self_contained_page() {
    let run = Swarm::fly("paper-4.2").finish();
    let (code, table, stderr) = tool(&["review", text(&log_of(&run))]);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(table.contains("clearance of Obstacle 1") && table.contains("verdict  passed"), "{table}");
    let page = fs::read_to_string(run.folder.join("review/index.html")).unwrap();
    let (own, library) = page.split_at(page.find("<script type=\"text/javascript\">").unwrap());
    for foreign in ["src=", "<link", "@import", "url(", "http:", "https:"] {
        assert!(!own.contains(foreign), "{foreign}");
    }
    assert!(library.contains("plotly.js v"), "the page holds what draws it");
    assert!(page.len() < 7_000_000, "{} bytes", page.len());
    for figure in
        ["trajectories", "leader-distances", "speeds", "obstacle-2-repulsion", "lyapunov", "latency"]
    {
        let svg = fs::read_to_string(run.folder.join(format!("review/{figure}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<polyline"), "{figure}");
        assert!(page.contains(&format!("id=\"plot-{figure}\"")));
        assert!(page.contains(&format!("\"{figure}\":{{\"figure\"")));
    }
    assert!(!run.folder.join("review/events.svg").exists(), "a flight without events has no timeline");
    let csv = fs::read_to_string(run.folder.join("review/speeds.csv")).unwrap();
    assert!(csv.starts_with("time_s,uav 1,uav 2"));
    assert_eq!(csv.lines().count(), 9002, "a table has a header and a row per tick");
}

#[test]
fn two_flights_are_drawn_over_each_other() {
    let [a, b] = ["paper", "resilient"]
        .map(|law| Swarm::fly("paper-4.1").with(&format!("--duration 20 --law {law}")).finish());
    let out = a.folder.join("both");
    let (_, table, stderr) = tool(&["review", text(&log_of(&a)), text(&log_of(&b)), "--out", text(&out)]);
    assert_eq!(table.matches("verdict  ").count(), 2, "{table}{stderr}");
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("<h1>A: paper-4.1</h1>") && page.contains("<h1>B: paper-4.1</h1>"));
    assert!(page.contains("\"name\":\"A: uav 1\"") && page.contains("\"name\":\"B: uav 1\""));
    for data in ["speeds.csv", "speeds.b.csv", "speeds.svg"] {
        assert!(out.join(data).exists(), "{data}");
    }
}

#[test]
fn review_leaves_a_folder_with_other_files_alone() {
    let run = Swarm::fly("paper-4.1").with("--duration 3").finish();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("mine.txt"), "").unwrap();
    let (code, _, stderr) = tool(&["review", text(&log_of(&run)), "--out", text(folder.path())]);
    assert!(code == Some(2) && stderr.contains("has files that no review has made"), "{stderr}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    // The folder of an earlier review is its own.
    for _ in 0..2 {
        let (code, _, stderr) =
            tool(&["review", text(&log_of(&run)), "--out", text(&folder.path().join("pages"))]);
        assert_ne!(code, Some(2), "{stderr}");
    }
}

#[test]
fn review_draws_a_timeline_of_the_events() {
    let run = Swarm::fly("dropout").with("--duration 32").finish();
    tool(&["review", text(&log_of(&run))]);
    let page = fs::read_to_string(run.folder.join("review/index.html")).unwrap();
    assert!(page.contains("id=\"events\"") && page.contains("uav 3 is killed: kill uav 3"));
    assert!(fs::read_to_string(run.folder.join("review/events.svg")).unwrap().starts_with("<svg"));
}

#[test]
fn verify_repeats_a_flight_and_finds_a_flipped_bit() {
    let run = Swarm::fly("paper-4.1").with("--duration 3").finish();
    let log = log_of(&run);
    let (code, stdout, stderr) = tool(&["verify", text(&log)]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(stdout.contains("repeated to the bit"), "{stdout}");
    let changed = run.folder.join("changed.mcap");
    rewrite(&log, &changed, |topic, tick, data| {
        if (topic, tick) == ("/uav/003/state", 123) {
            // 0x19 is the tag of x_m in the encoded message. The lowest byte of the double follows it.
            let at = data.iter().position(|byte| *byte == 0x19).unwrap() + 1;
            data[at] ^= 1;
        }
    });
    let (code, stdout, _) = tool(&["verify", text(&changed)]);
    assert_eq!(code, Some(3), "{stdout}");
    assert!(stdout.contains("tick 123, /uav/003/state: x_m is "), "{stdout}");
}

/// Copies a log and passes the topic, tick and data of each message to `change`, which may modify the data.
fn rewrite(from: &Path, to: &Path, mut change: impl FnMut(&str, u32, &mut Vec<u8>)) {
    let bytes = fs::read(from).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut writer = mcap::Writer::new(fs::File::create(to).unwrap()).unwrap();
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index).unwrap()).unwrap();
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(&bytes, index).unwrap()).unwrap();
    }
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        change(&message.channel.topic, message.sequence, message.data.to_mut());
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn verify_reports_why_a_flight_cannot_be_repeated() {
    let real_time = Swarm::fly("paper-4.1").with("--real-time --duration 1").finish();
    let running = Swarm::fly("paper-4.1").with("--duration 60").start();
    running.wait_for_second(1.0);
    running.signal(Part::Leader, Signal::KILL);
    let gap = Swarm::fly("paper-4.1").with("--duration 10").fault("at 5 s kill recorder").finish();
    for (run, reason) in [
        (real_time, "real-time run"),
        (running.finish(), "happened by chance: the leader"),
        (gap, "which ticks it lacks is chance"),
    ] {
        let (code, _, stderr) = tool(&["verify", text(&log_of(&run))]);
        assert_eq!(code, Some(1));
        assert!(stderr.contains("is not repeatable") && stderr.contains(reason), "{stderr}");
    }
}

#[test]
fn compare_shows_what_differs() {
    let [a, b] = ["off", "tick"].map(|value| {
        Swarm::fly("paper-4.1").with(&format!("--duration 20 --set control.dead_reckoning={value}")).finish()
    });
    let (a, b) = (log_of(&a), log_of(&b));
    let (code, json, _) = tool(&["compare", text(&a), text(&b), "--json"]);
    let compared: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(code, Some(0));
    assert!(compared["slot_error_max_m"]["difference"].as_f64().unwrap() < -0.1);
    assert_eq!(compared["uavs"]["equal"], true);
    let (_, table, _) = tool(&["compare", text(&a), text(&a)]);
    assert!(table.contains("slot_error_max_m") && !table.contains("differs"), "{table}");
}

#[test]
fn the_log_of_a_killed_recorder_can_be_reviewed_and_recovered() {
    let whole = messages(&log_of(&Swarm::fly("paper-4.1").with("--no-timing").finish()));
    for second in [0.0, 3.3, 17.7, 41.9] {
        let run = Swarm::fly("paper-4.1").with("--no-timing --set supervision.replacements=0").start();
        run.wait_for_second(second);
        run.signal(Part::Recorder, Signal::KILL);
        let run = run.finish();
        let out = run.folder.join("recovered.mcap");
        let before = fs::read(log_of(&run)).unwrap();
        let (code, stdout, stderr) = tool(&["recover", text(&log_of(&run)), "--out", text(&out)]);
        assert_eq!(code, Some(1), "{stderr}");
        assert!(stdout.contains("and a new index") && stdout.contains("lost: the result"), "{stdout}");
        assert_eq!(fs::read(log_of(&run)).unwrap(), before, "recover changed its input");
        let recovered = messages(&out);
        assert!(second < 1.0 || recovered.len() > 100, "killed at {second} s");
        assert_eq!(recovered[..], whole[..recovered.len()], "killed at {second} s");
        assert!(mcap::Summary::read(&fs::read(&out).unwrap()).unwrap().unwrap().stats.is_some());
        let (code, stdout, _) = tool(&["review", text(&log_of(&run)), "--json"]);
        assert_eq!(code, Some(1));
        assert!(stdout.contains("the log breaks off at"), "{stdout}");
        let (code, _, stderr) = tool(&["recover", text(&log_of(&run)), "--out", text(&out)]);
        assert_eq!(code, Some(1));
        assert!(stderr.contains("exists, and is left as it is"), "{stderr}");
    }
}

fn messages(path: &Path) -> Vec<(String, u32, Vec<u8>)> {
    let bytes = fs::read(path).unwrap();
    let stream = mcap::MessageStream::new(&bytes).unwrap();
    let message =
        |message: mcap::Message| (message.channel.topic.clone(), message.sequence, message.data.into_owned());
    stream.map(|found| message(found.unwrap())).collect()
}

#[test]
fn every_tool_refuses_a_file_that_is_not_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    for (content, reason) in [
        (b"".as_slice(), "is empty"),
        (b"dear diary, today I flew", "is not an MCAP file"),
        (&mcap::MAGIC[..4], "is cut off"),
        (mcap::MAGIC, "not a log of ringwing"),
    ] {
        fs::write(&file, content).unwrap();
        for arguments in
            [&["review", text(&file)][..], &["verify", text(&file)], &["compare", text(&file), text(&file)]]
        {
            let (code, _, stderr) = tool(arguments);
            assert_eq!(code, Some(1), "{arguments:?}: {stderr}");
            assert!(stderr.contains(reason) && stderr.contains(text(&file)), "{arguments:?}: {stderr}");
        }
    }
    let (code, _, stderr) = tool(&["review", "/nowhere/run.mcap"]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("/nowhere/run.mcap: cannot be read"), "{stderr}");
}
