//! A user's own defaults, and what the command says of this machine and of itself.

use crate::harness::{newest_run, ringwing};
use serde_json::Value;
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

/// `ringwing` in `folder`, which reads the files with defaults that a user would have there.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = ringwing();
    command
        .args(arguments)
        .current_dir(folder)
        .env_remove("RINGWING_CONFIG")
        .env("XDG_CONFIG_HOME", folder.join("config"));
    command
}

fn output(mut command: Command) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = command.output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

#[test]
fn defaults_apply_in_folders_below_and_the_command_line_beats_them() {
    let home = tempfile::tempdir().unwrap();
    let below = home.path().join("a/b");
    fs::create_dir_all(&below).unwrap();
    fs::write(home.path().join("ringwing.toml"), "out = \"flights\"\nlaw = \"resilient\"\n").unwrap();
    let fly = |more: &[&str]| {
        let arguments = [&["run", "paper-4.1", "--simulated", "--json"][..], more].concat();
        let (code, json, stderr) = output(command(&below, &arguments));
        assert_eq!(code, Some(0), "{stderr}");
        serde_json::from_str::<Value>(&json).unwrap()
    };
    let flown = fly(&[]);
    let folder = newest_run(&home.path().join("flights")).expect("the run is where the default says");
    let scenario = fs::read_to_string(folder.join("scenario.toml")).unwrap();
    assert!(scenario.contains("law = \"resilient\""), "{scenario}");
    // The printed command gives the same flight without the defaults.
    assert!(flown["command"].as_str().unwrap().contains("--law resilient"), "{}", flown["command"]);
    assert!(!fly(&["--law", "paper"])["command"].as_str().unwrap().contains("resilient"));
    assert!(!fly(&["--set", "control.law=paper"])["command"].as_str().unwrap().contains("--law"));
    // `latest` is looked for where runs are written.
    let (code, _, stderr) = output(command(&below, &["review", "latest", "--json"]));
    assert_eq!(code, Some(0), "{stderr}");
}

#[test]
fn config_shows_each_default_and_its_file() {
    let home = tempfile::tempdir().unwrap();
    let of_user = home.path().join("config/ringwing");
    fs::create_dir_all(&of_user).unwrap();
    fs::write(of_user.join("ringwing.toml"), "jobs = 1\nlaw = \"paper\"\n").unwrap();
    fs::write(home.path().join("ringwing.toml"), "law = \"resilient\"\n").unwrap();
    let (code, text, _) = output(command(home.path(), &["config"]));
    assert_eq!(code, Some(0));
    let line =
        |key: &str| text.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{text}"));
    assert!(line("law").contains("resilient") && line("law").ends_with("/ringwing.toml)"), "{text}");
    assert!(line("jobs").contains("1  (from") && line("jobs").contains("config/ringwing/"), "{text}");
    assert_eq!(line("out"), "out   runs");
}

#[test]
fn a_mistake_in_the_defaults_ends_the_command_with_file_and_line() {
    let home = tempfile::tempdir().unwrap();
    fs::write(home.path().join("ringwing.toml"), "law = \"paper\"\nouts = \"x\"\n").unwrap();
    let (code, _, stderr) = output(command(home.path(), &["run", "--simulated"]));
    assert_eq!(code, Some(2), "{stderr}");
    assert!(
        stderr.starts_with("error: ") && stderr.contains("ringwing.toml:2: unknown field `outs`"),
        "{stderr}"
    );
    assert_eq!(newest_run(&home.path().join("runs")), None);
}

#[test]
fn the_doctor_looks_at_everything_that_a_flight_needs() {
    let folder = tempfile::tempdir().unwrap();
    let (code, json, stderr) = output(command(folder.path(), &["doctor", "--json"]));
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{json}");
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["fit"], true);
    let names: Vec<_> =
        report["checks"].as_array().unwrap().iter().map(|check| check["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["room", "clock", "scheduler", "cores", "real time", "flight"]);
    // It leaves nothing where it was started.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_version_names_the_commit_and_the_machine() {
    let folder = tempfile::tempdir().unwrap();
    let (code, text, _) = output(command(folder.path(), &["--version"]));
    assert_eq!(code, Some(0));
    assert!(text.starts_with(concat!("ringwing ", env!("CARGO_PKG_VERSION"), " (")), "{text}");
    assert!(text.contains("-linux-"), "{text}");
}

#[test]
fn packages_get_man_pages_and_completions() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, stderr) = output(command(folder.path(), &["package-files", "share"]));
    assert_eq!(code, Some(0), "{stderr}");
    let share = folder.path().join("share");
    for file in [
        "man/man1/ringwing.1",
        "man/man1/ringwing-sweep.1",
        "bash-completion/completions/ringwing",
        "zsh/vendor-completions/_ringwing",
    ] {
        assert!(share.join(file).metadata().unwrap().len() > 100, "{file}");
    }
}

#[test]
fn the_help_has_the_verbs_by_job_and_each_verb_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    let help = |arguments: &[&str]| output(command(folder.path(), arguments)).1;
    let text = help(&["--help"]);
    let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("no {words:?} in {text}"));
    assert!(place("Fly a swarm:") < place("  run "), "{text}");
    assert!(
        place("  run ") < place("Look at a flight:") && place("Look at a flight:") < place("  review "),
        "{text}"
    );
    assert!(!text.contains("bench-case"), "{text}");
    assert!(help(&["sweep", "--help"]).contains("Examples:\n  ringwing sweep delay-loss"));
}
