//! What the command prints, and what it does when nobody reads, when others own the run, and in a shell that completes.

use crate::harness::{Swarm, log_in, newest_run, ringwing, wait_until};
use rustix::process::geteuid;
use std::{
    ffi::OsStr,
    fs::{self, File, Permissions},
    io,
    os::unix::{
        ffi::OsStrExt,
        fs::{PermissionsExt, symlink},
        process::CommandExt,
    },
    path::Path,
    process::{Command, Output, Stdio},
};

/// Exit code if the reader of standard output hung up.
const READER_GONE: i32 = 141;
/// A user who is not root and owns nothing.
const NOBODY: u32 = 65534;
/// A short flight with events on the terminal.
const FLIGHT: [&str; 6] =
    ["run", "paper-4.1", "--duration", "1", "--fault", "at 0.2 s freeze uav 3 for 0.1 s"];

/// `ringwing` with these arguments, in `folder`.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = ringwing();
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    // Whatever the tests run in must not colour the output.
    command.env_remove("CLICOLOR_FORCE").env_remove("COLUMNS");
    command
}

fn code_and_stderr(mut command: Command) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = command.stderr(Stdio::piped()).output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

fn stdout(mut command: Command) -> String {
    String::from_utf8(command.output().unwrap().stdout).unwrap()
}

/// A pipe whose reader has hung up.
fn closed_pipe() -> io::PipeWriter {
    let (reader, writer) = io::pipe().unwrap();
    drop(reader);
    writer
}

fn full_device() -> File {
    File::options().write(true).open("/dev/full").unwrap()
}

/// A folder with the log `a.mcap` of a short flight.
fn folder_with_log() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let run = Swarm::fly("paper-4.1").with("--duration 1").finish();
    fs::copy(run.log_path(), folder.path().join("a.mcap")).unwrap();
    folder
}

/// The arguments of every verb that ends by itself and prints something.
fn verbs() -> Vec<Vec<&'static str>> {
    let mut verbs: Vec<Vec<&str>> = [
        "--help",
        "--version",
        "run --help",
        "scenario list",
        "scenario show paper-4.2",
        "scenario check storm",
        "completion bash",
        "completion zsh",
        "completion fish",
        "review a.mcap",
        "review a.mcap --json",
        "verify a.mcap",
        "compare a.mcap a.mcap",
        "compare a.mcap a.mcap --json",
        "recover a.mcap",
        "clean",
        "bench --doctor",
        "bench --json --uavs 3 --transport none --load closed --repeat 1 --warm-up 0.02 --seconds 0.1",
        "run paper-4.1 --duration 1 --json",
    ]
    .map(|line| line.split(' ').collect())
    .into();
    verbs.push(FLIGHT.into());
    verbs
}

/// Runs each verb with the standard output that `stdout` makes, and returns its exit code and its stderr.
fn each_verb(stdout: impl Fn() -> Stdio) -> Vec<(String, Option<i32>, String)> {
    let folder = folder_with_log();
    let run = |arguments: Vec<&str>| {
        // `recover` never overwrites a file.
        let _ = fs::remove_file(folder.path().join("a-recovered.mcap"));
        let mut command = command(folder.path(), &arguments);
        command.stdout(stdout());
        let Output { status, stderr, .. } =
            command.stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        (arguments.join(" "), status.code(), String::from_utf8(stderr).unwrap())
    };
    verbs().into_iter().map(run).collect()
}

#[test]
fn every_verb_ends_silently_when_the_reader_has_hung_up() {
    for (verb, code, stderr) in each_verb(|| closed_pipe().into()) {
        assert_eq!(code, Some(READER_GONE), "{verb}: {stderr}");
        let silent = !stderr.contains("panicked") && !stderr.contains("standard output");
        assert!(silent, "{verb}: {stderr}");
    }
}

#[test]
fn every_verb_says_that_a_full_device_took_nothing_and_exits_with_1() {
    for (verb, code, stderr) in each_verb(|| full_device().into()) {
        assert_eq!(code, Some(1), "{verb}: {stderr}");
        assert!(
            stderr.contains("error: standard output: cannot be written: No space left"),
            "{verb}: {stderr}"
        );
    }
}

#[test]
fn a_flight_whose_summary_nobody_reads_still_writes_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = command(folder.path(), &FLIGHT);
    assert_eq!(
        command.stdout(closed_pipe()).stderr(Stdio::null()).status().unwrap().code(),
        Some(READER_GONE)
    );
    let run = newest_run(&folder.path().join("runs")).unwrap();
    assert!(run.join("summary.json").exists() && log_in(&run).exists());
}

#[test]
fn a_closed_or_full_standard_error_changes_no_result() {
    let folder = tempfile::tempdir().unwrap();
    let streams: [fn() -> Stdio; 2] = [|| closed_pipe().into(), || full_device().into()];
    for stream in streams {
        let mut flight = command(folder.path(), &FLIGHT);
        let output =
            flight.stdout(Stdio::piped()).stderr(stream()).spawn().unwrap().wait_with_output().unwrap();
        let table = String::from_utf8(output.stdout).unwrap();
        // The flight is too short to settle, but nothing failed.
        assert!(!table.contains("FAILED") && table.contains("payload"), "{table}");
        let wrong = command(folder.path(), &["run", "no-such-scenario"]).stderr(stream()).status();
        assert_eq!(wrong.unwrap().code(), Some(2));
    }
}

#[test]
fn a_live_run_answers_at_its_link_and_its_answer_is_needed() {
    let mut run = Swarm::fly("paper-4.1").with("--real-time --duration 30").start();
    run.wait_for_second(0.1);
    let place = tempfile::tempdir().unwrap();
    symlink(&run.folder, place.path().join("latest")).unwrap();
    let list = ["fault", "latest", "list"];
    assert_eq!(code_and_stderr(command(place.path(), &list)), (Some(0), String::new()));

    let status = |stream: Stdio| {
        command(place.path(), &list).stdout(stream).stderr(Stdio::null()).status().unwrap().code()
    };
    assert_eq!(status(closed_pipe().into()), Some(READER_GONE));
    assert_eq!(status(full_device().into()), Some(1));

    // The event names its kind.
    let fault = ["fault", "latest", "link 2->3 hold for 0.1 s"];
    assert_eq!(code_and_stderr(command(place.path(), &fault)).0, Some(0));
    run.wait_for_line("s  fault: link 2->3 hold");
    run.wait_for_line("s  healed: link 2->3 hold");
    crate::harness::send(run.launcher(), rustix::process::Signal::INT);
    run.finish().assert_nothing_left();
}

/// `ringwing` as a user who may not enter the domain `id`, which this makes.
fn as_other_user(id: &str, arguments: &[&str]) -> Command {
    let domain = Path::new("/dev/shm").join(format!("ringwing_{id}"));
    // Nobody but root may become another user. Without that, this user locks itself out.
    let is_root = geteuid().is_root();
    fs::create_dir_all(&domain).unwrap();
    fs::set_permissions(&domain, Permissions::from_mode(if is_root { 0o700 } else { 0 })).unwrap();
    let mut command = command(Path::new("/"), arguments);
    if is_root {
        command.uid(NOBODY);
    }
    command
}

#[test]
fn the_run_of_another_user_is_refused_as_such() {
    // Every run that starts meanwhile removes the domain, because it has no launcher. So try until one attempt sees it.
    wait_until("a fault is refused", || {
        let (code, stderr) = code_and_stderr(as_other_user("zzzz01", &["fault", "zzzz01", "heal all"]));
        assert_eq!(code, Some(1), "{stderr}");
        stderr.contains("error: domain zzzz01: permission denied: the run belongs to user").then_some(())
    });
    let _ = fs::remove_dir("/dev/shm/ringwing_zzzz01");
}

#[test]
fn paths_that_are_not_utf_8_work_or_are_refused_before_anything_starts() {
    let place = tempfile::tempdir().unwrap();
    let odd = OsStr::from_bytes(b"odd-\xff");
    let folder = place.path().join(odd);
    fs::create_dir(&folder).unwrap();
    let log = folder_with_log();
    fs::copy(log.path().join("a.mcap"), folder.join("a.mcap")).unwrap();
    for verb in ["review", "verify", "recover"] {
        let mut command = command(place.path(), &[verb]);
        command.arg(folder.join("a.mcap"));
        let (code, stderr) = code_and_stderr(command);
        assert!(code == Some(0) || verb == "review" && code == Some(3), "{verb}: {code:?} {stderr}");
    }
    for arguments in [&["run", "--out"][..], &["run"], &["scenario", "check"], &["fault"]] {
        let mut command = command(place.path(), arguments);
        command.arg(odd);
        let (code, stderr) = code_and_stderr(command);
        assert_eq!(code, Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains("UTF-8"), "{arguments:?}: {stderr}");
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 3, "the log, the recovered log and the review");
}

/// What a shell completes after `words`, the last of them the one that is being typed.
fn completions(shell: &str, folder: &Path, words: &[&str]) -> Vec<String> {
    let mut command = command(folder, &["--", "ringwing"]);
    let index = words.len().to_string();
    command.args(words).env("COMPLETE", shell).env("_CLAP_COMPLETE_INDEX", index).env("_CLAP_IFS", "\n");
    let value = |line: &str| line.split(['\t', ':']).next().unwrap().replace('\\', "");
    stdout(command).lines().map(value).collect()
}

#[test]
fn shells_complete_presets_files_keys_faults_and_runs() {
    let place = tempfile::tempdir().unwrap();
    for name in ["mine.toml", "a.mcap", "notes.txt"] {
        fs::write(place.path().join(name), "").unwrap();
    }
    fs::create_dir(place.path().join("paper-4.2-k3x9ab")).unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let complete = |words: &[&str]| completions(shell, place.path(), words);
        for (words, wanted) in [
            (&["run", "paper-4"][..], "paper-4.2"),
            (&["run", "mi"], "mine.toml"),
            (&["scenario", "show", "st"], "storm"),
            (&["run", "--set", "formation.ua"], "formation.uavs="),
            (&["run", "--law", "res"], "resilient"),
            (&["run", "--fault", "at 30 s ki"], "at 30 s kill"),
            (&["fault", "k3x9ab", "link all bl"], "link all blackout"),
            (&["fault", "pap"], "paper-4.2-k3x9ab/"),
            (&["review", ""], "a.mcap"),
            (&["compare", "a.mcap", "a"], "a.mcap"),
        ] {
            let found = complete(words);
            assert!(found.iter().any(|value| value == wanted), "{shell} {words:?}: {found:?}");
            assert!(!found.iter().any(|value| value == "notes.txt"), "{shell} {words:?}: {found:?}");
        }
    }
}

#[test]
fn colours_are_for_terminals_and_for_those_who_ask() {
    let coloured = |variables: &[(&str, &str)]| {
        let mut command = command(Path::new("/"), &["run", "no-such-scenario"]);
        command.env_remove("NO_COLOR").envs(variables.iter().copied());
        code_and_stderr(command).1.contains('\u{1b}')
    };
    assert!(!coloured(&[]));
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}

#[test]
fn lists_and_tables_fit_the_terminal() {
    let folder = folder_with_log();
    let flight = ["run", "paper-4.2", "--duration", "1", "--fault", "at 0.2 s freeze uav 3 for 0.1 s"];
    let verbs = [&["scenario", "list"][..], &["compare", "a.mcap", "a.mcap"], &["review", "a.mcap"], &flight];
    for (arguments, columns) in verbs.into_iter().flat_map(|verb| [(verb, 80), (verb, 40)]) {
        let table = stdout_with_columns(&mut command(folder.path(), arguments), columns);
        let too_wide = table.lines().find(|line| !is_to_copy(line) && line.chars().count() > columns);
        assert!(too_wide.is_none(), "{arguments:?} in {columns} columns: {too_wide:?}\n{table}");
        assert!(table.lines().count() > 5, "{table}");
    }
    let list = stdout(command(folder.path(), &["scenario", "list"]));
    assert!(
        list.lines().all(|line| !line.starts_with(' ')),
        "one line for each preset in 80 columns: {list}"
    );
}

/// Whether a line of the summary is a path, a hash or a command to copy, which is never broken.
fn is_to_copy(line: &str) -> bool {
    let starts = ["  log  ", "  payload  ", "  repeat  ", "  look  ", "  figures  ", "           open "];
    starts.iter().any(|start| line.starts_with(start))
}

fn stdout_with_columns(command: &mut Command, columns: usize) -> String {
    let output = command.env("COLUMNS", columns.to_string()).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_last_lines_of_a_run_say_how_to_look_further() {
    let folder = tempfile::tempdir().unwrap();
    let table = stdout(command(folder.path(), &FLIGHT));
    let [open, review] = table.lines().rev().take(2).collect::<Vec<_>>()[..] else { panic!("{table}") };
    let (_, log) = review.split_once(" review ").unwrap();
    assert!(folder.path().join(log).exists(), "{review}");
    let (_, layout) = open.split_once(" in Foxglove with ").unwrap();
    assert!(open.contains(log) && folder.path().join(layout).exists(), "{open}");
    // The printed command works as it is.
    let (code, _) = code_and_stderr(command(folder.path(), &["review", log]));
    assert!(matches!(code, Some(0 | 3)), "{code:?}");
}
