//! Where the tools find a log, and what they say of one that another program has rewritten.

use crate::harness::{Finished, Swarm, ringwing};
use ringwing_recorder::log::reader::Reader;
use serde_json::Value;
use std::{
    fs::{self, File},
    io::Write,
    path::Path,
    process::{Command, Output, Stdio},
};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn said(command: &mut Command) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = command.output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

/// Asserts that `command`, a review as JSON, reports the figures of `run`.
fn assert_reviews(command: &mut Command, run: &Finished) {
    let (code, json, stderr) = said(command);
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{command:?}");
    let reviewed: Value = serde_json::from_str(&json).unwrap();
    for key in ["verdict", "flight", "payload_hash", "log_messages"] {
        assert_eq!(reviewed[key], run.summary[key], "{key}: {command:?}");
    }
}

#[test]
fn a_log_is_found_by_folder_link_compressed_file_and_standard_input() {
    let run = Swarm::fly("paper-4.1").with("--duration 25").finish();
    let log = run.log_path();
    let latest = run.folder.with_file_name("latest");
    let packed = run.folder.with_file_name("packed.mcap.zst");
    fs::write(&packed, zstd::encode_all(File::open(&log).unwrap(), 1).unwrap()).unwrap();
    for named in [&log, &run.folder, &latest, &packed] {
        assert_reviews(ringwing().args(["review", "--json"]).arg(named), &run);
    }
    let review_standard_input = || {
        let mut command = ringwing();
        command.args(["review", "--json", "-"]);
        command
    };
    assert_reviews(review_standard_input().stdin(File::open(&packed).unwrap()), &run);
    let mut piped = Command::new("bash");
    piped.arg("-c").arg(format!(
        "cat {} | {} review --json -",
        log.display(),
        env!("CARGO_BIN_EXE_ringwing")
    ));
    assert_reviews(&mut piped, &run);
    let (code, _, stderr) = said(ringwing().arg("verify").arg("-").stdin(File::open(&packed).unwrap()));
    assert_eq!(code, Some(0), "{stderr}");
    let (code, table, _) = said(ringwing().arg("compare").args([&latest, &packed]));
    assert!(code == Some(0) && !table.contains("differs"), "{table}");
}

#[test]
fn latest_is_the_newest_run_in_the_default_folder() {
    let folder = tempfile::tempdir().unwrap();
    let ringwing = || {
        let mut command = ringwing();
        command.current_dir(folder.path());
        command
    };
    let (code, _, stderr) = said(ringwing().args(["review", "latest"]));
    assert!(code == Some(1) && stderr.contains("latest: cannot be read: No such file"), "{stderr}");
    for seed in ["1", "2"] {
        said(ringwing().args(["run", "paper-4.1", "--duration", "1", "--seed", seed]));
        let (_, json, _) = said(ringwing().args(["review", "latest", "--json"]));
        let reviewed: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(reviewed["seed"].to_string(), seed);
        let log = reviewed["log"].as_str().unwrap();
        assert!(log.starts_with("runs/latest/paper-4.1-"), "{log}");
    }
}

#[test]
fn only_the_log_of_a_real_time_run_says_when_it_was_flown() {
    for (mode, is_stated) in [("", false), ("--real-time", true), ("--real-time --no-timing", false)] {
        let run = Swarm::fly("paper-4.1").with("--duration 0.5").with(mode).finish();
        let reader = Reader::open(&run.folder).unwrap();
        let started_at = reader.run().unwrap().get("started_at");
        assert_eq!(started_at.is_some(), is_stated, "{mode}: {started_at:?}");
        assert!(
            started_at.is_none_or(|time| time.starts_with("20") && time.ends_with('Z')),
            "{started_at:?}"
        );
    }
}

/// Copies the messages of a log whose topics are kept, and writes attachments and metadata after them.
fn filter(from: &Path, to: &Path, is_kept: fn(&str) -> bool) {
    let bytes = fs::read(from).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let options = mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4));
    let mut writer = options.create(File::create(to).unwrap()).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    for message in messages.filter(|message| is_kept(&message.channel.topic)) {
        writer.write(&message).unwrap();
    }
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index).unwrap()).unwrap();
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(&bytes, index).unwrap()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_filtered_log_is_judged_and_verified_unless_it_lacks_a_part_of_the_flight() {
    let run = Swarm::fly("paper-4.1").with("--duration 25").finish();
    let filtered = run.folder.with_file_name("filtered.mcap");
    filter(&run.log_path(), &filtered, |topic| !topic.starts_with("/scene/") && topic != "/tf");
    let (code, json, stderr) = said(ringwing().args(["review", "--json"]).arg(&filtered));
    let reviewed: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(reviewed["flight"], run.summary["flight"]);
    let (code, stdout, stderr) = said(ringwing().arg("verify").arg(&filtered));
    assert!(code == Some(0) && stdout.contains("repeated to the bit"), "{stdout}{stderr}");
    assert!(stderr.contains("not compared: /scene/") && stderr.contains("/tf"), "{stderr}");

    filter(&run.log_path(), &filtered, |topic| !topic.starts_with("/uav/004"));
    let (code, table, _) = said(ringwing().arg("review").arg(&filtered));
    assert_eq!(code, Some(1), "{table}");
    assert!(table.contains("FAILED") && table.contains("lacks 1 of 6 UAVs"), "{table}");
    let (code, _, stderr) = said(ringwing().arg("verify").arg(&filtered));
    assert!(code == Some(1) && stderr.contains("lacks 1 of 6 UAVs"), "{stderr}");
}

#[test]
fn recover_fails_if_it_lost_anything() {
    let run = Swarm::fly("paper-4.1").with("--duration 2").finish();
    let (code, stdout, _) = said(ringwing().arg("recover").arg(&run.folder));
    assert!(code == Some(0) && stdout.contains("lost: nothing"), "{stdout}");
    // The folder still stands for the run's own log.
    let (code, _, stderr) = said(ringwing().arg("verify").arg(&run.folder));
    assert_eq!(code, Some(0), "{stderr}");
    let broken = run.folder.with_file_name("broken.mcap");
    let mut bytes = fs::read(run.log_path()).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&broken, &bytes).unwrap();
    let (code, stdout, _) = said(ringwing().arg("recover").arg(&broken));
    assert!(code == Some(1) && stdout.contains("lost: "), "{stdout}");
    let out = run.folder.with_file_name("no-such-folder").join("out.mcap");
    let (code, _, stderr) = said(ringwing().arg("recover").arg(&broken).arg("--out").arg(out));
    assert!(code == Some(1) && stderr.contains("No such file or directory"), "{stderr}");
    let mut child =
        ringwing().args(["recover", "-"]).stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    // The command may end before it reads anything.
    let _ = child.stdin.take().unwrap().write_all(&bytes[..100]);
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

#[test]
fn what_is_no_log_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for (named, reason) in
        [(text(&pipe), "is a pipe"), (text(folder.path()), "holds no log"), ("/dev/zero", "is a device")]
    {
        for arguments in
            [&["review", named][..], &["verify", named], &["recover", named], &["compare", named, named]]
        {
            let (code, _, stderr) = said(ringwing().args(arguments));
            assert!(
                code == Some(1) && stderr.contains(reason) && stderr.contains(named),
                "{arguments:?}: {stderr}"
            );
        }
    }
}
