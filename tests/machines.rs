//! Machines that are too small: the run says before it starts what it lacks, or flies to its end, and leaves nothing behind.
//! Machines with two cores: which of them a swarm uses. Machines with a few: how they share the work of a crowd.
//!
//! Some tests mount a small file system in a namespace of their own. Where that is not permitted, they say so and pass.

use crate::harness::{Swarm, log::Log, log_in, newest_run, ringwing, send, status_of, wait_until};
use ringwing_bus::{Demand, usable_cores};
use ringwing_flight::{Part, UavId};
use ringwing_scenario::{Scenario, Wake};
use rustix::process::Signal;
use std::{
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const BINARY: &str = env!("CARGO_BIN_EXE_ringwing");

/// What a script printed, and how it ended.
struct Said {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl From<Output> for Said {
    fn from(Output { status, stdout, stderr }: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
    }
}

/// Runs `script` in a shell whose limits it may lower.
fn shell(script: &str) -> Said {
    Command::new("bash").args(["-c", script]).output().unwrap().into()
}

/// Runs `script` where `mount` puts a tmpfs of this `size` at `place`; `None` if that is not permitted here.
fn with_tmpfs(place: &Path, size: &str, script: &str) -> Option<Said> {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs {}", place.display());
    let namespace = |script: &str| {
        Command::new("unshare").args(["--user", "--map-root-user", "--mount", "bash", "-c", script]).output()
    };
    if !namespace(&mount).is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: a tmpfs cannot be mounted in a namespace here");
        return None;
    }
    Some(namespace(&format!("{mount} && {{ {script}\n}}")).unwrap().into())
}

/// A flight of paper-4.1 with `arguments`, then a list of what it has left in shared memory.
fn flight_then_list(arguments: &str, out: &Path) -> String {
    format!(
        "{BINARY} run paper-4.1 {arguments} --out {}; code=$?; ls -A /dev/shm >&2; exit $code",
        out.display()
    )
}

#[test]
fn a_run_that_does_not_fit_into_shared_memory_says_what_it_needs_and_how_to_get_it() {
    let out = tempfile::tempdir().unwrap();
    let script = flight_then_list("--uavs 30", out.path());
    let Some(said) = with_tmpfs(Path::new("/dev/shm"), "1m", &script) else { return };
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    for part in ["a run of 30 UAVs needs", "free of 1.0 MB", "--shm-size=16m", "remount,size=16M"] {
        assert!(said.stderr.contains(part), "{}", said.stderr);
    }
    assert_eq!(said.stderr.lines().count(), 1, "one sentence, and nothing left: {}", said.stderr);
    assert_eq!(fs::read_dir(out.path()).unwrap().count(), 0);
}

#[test]
fn a_run_that_just_fits_flies_even_if_its_recorder_sleeps() {
    let out = tempfile::tempdir().unwrap();
    // 4 MB hold 12 UAVs and a journal of about a second; the recorder sleeps for longer.
    let arguments = "--uavs 12 --real-time --duration 3 --fault 'at 0.2 s freeze recorder for 2 s'";
    let script = flight_then_list(arguments, out.path());
    let Some(said) = with_tmpfs(Path::new("/dev/shm"), "4m", &script) else { return };
    assert!(matches!(said.code, Some(0 | 3)), "{}{}", said.stderr, said.stdout);
    assert!(said.stderr.lines().all(|line| line.starts_with("ringwing: ")), "left: {}", said.stderr);
    let lines = only_log(out.path()).lines();
    assert!(lines.iter().any(|line| line.contains("the recorder fell behind")), "{lines:#?}");
}

#[test]
fn a_run_flies_to_its_end_when_others_fill_shared_memory() {
    let out = tempfile::tempdir().unwrap();
    // The restart needs memory, and all that is left is what the run has set aside.
    let flight = format!(
        "{BINARY} run paper-4.1 --real-time --duration 3 --fault 'at 1.5 s restart uav 3 after 0.2 s' --out {}",
        out.path().display()
    );
    let script = format!(
        "{flight} & sleep 1; dd if=/dev/zero of=/dev/shm/others bs=4k status=none; wait $!; code=$?; rm /dev/shm/others; \
         ls -A /dev/shm >&2; exit $code"
    );
    let Some(said) = with_tmpfs(Path::new("/dev/shm"), "12m", &script) else { return };
    assert!(said.stderr.contains("No space left"), "the test has filled it: {}", said.stderr);
    assert!(matches!(said.code, Some(0 | 3)), "{}{}", said.stderr, said.stdout);
    assert!(said.stderr.contains("uav 3 is started"), "{}", said.stderr);
    let is_expected = |line: &str| line.starts_with("ringwing: ") || line.starts_with("dd: ");
    assert!(said.stderr.lines().all(is_expected), "left: {}", said.stderr);
}

#[test]
fn what_a_run_takes_of_shared_memory_is_a_little_less_than_it_asks_for() {
    let mut loaded = Scenario { name: "loaded".into(), ..Scenario::default() };
    (loaded.ipc.wake, loaded.ipc.payload_bytes) = (Wake::Event, 4096);
    let faulty = Scenario { name: "faulty".into(), ..Scenario::default() };
    let faulty = faulty.with_faults(&["at 0 s link all loss 30 %".parse().unwrap()]).unwrap();
    for mut scenario in [Scenario { name: "plain".into(), ..Scenario::default() }, loaded, faulty] {
        (scenario.time.real_time, scenario.time.duration_s) = (true, 3600.0);
        scenario.formation.uavs = 20;
        let asked = Demand::of(&scenario, true).memory_bytes(1024);
        let run = Swarm::fly_scenario(&scenario).start();
        run.process(Part::World);
        run.wait_for_second(2.0);
        let taken = memory_of(&run.domain().id().to_string());
        let name = &scenario.name;
        assert!(taken <= asked, "{name}: {taken} of {asked} bytes");
        assert!(taken as f64 > 0.7 * asked as f64, "{name}: {taken} of {asked} bytes");
    }
}

/// The memory that all files of the domain `id` take, in bytes.
fn memory_of(id: &str) -> u64 {
    let name = format!("ringwing_{id}");
    let entries = fs::read_dir("/dev/shm").unwrap().flatten();
    let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(&name));
    ours.map(|entry| memory_below(entry.path())).sum()
}

fn memory_below(path: PathBuf) -> u64 {
    let Ok(meta) = fs::symlink_metadata(&path) else { return 0 };
    if !meta.is_dir() {
        return meta.blocks() * 512;
    }
    fs::read_dir(path).into_iter().flatten().flatten().map(|entry| memory_below(entry.path())).sum()
}

#[test]
fn a_limit_that_is_too_low_is_named_before_anything_starts() {
    let out = tempfile::tempdir().unwrap();
    for (limit, said) in [
        ("ulimit -n 100", "needs 440 open files in one process, and `ulimit -n` allows 100"),
        ("ulimit -f 1000", "and `ulimit -f` allows 1.0 MB"),
    ] {
        let refused = shell(&format!("{limit}; exec {BINARY} run --uavs 30 --out {}", out.path().display()));
        assert_eq!(refused.code, Some(1), "{limit}: {}", refused.stderr);
        assert!(refused.stderr.contains(said), "{limit}: {}", refused.stderr);
        assert_eq!(fs::read_dir(out.path()).unwrap().count(), 0, "{limit}");
    }
}

#[test]
fn a_limit_of_processes_that_is_too_low_is_named_before_anything_starts() {
    // The kernel does not hold root to this limit.
    let is_root = rustix::process::getuid().is_root();
    let user = if is_root { "setpriv --reuid 65534 --regid 65534 --clear-groups" } else { "" };
    if !shell(&format!("{user} {BINARY} --version")).stdout.starts_with("ringwing ") {
        eprintln!("skipped: another user cannot run this command here");
        return;
    }
    let refused = shell(&format!("ulimit -u 20; exec {user} {BINARY} run --uavs 30 --out /tmp"));
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert!(
        refused.stderr.contains("starts 46 processes and threads, and `ulimit -u`"),
        "{}",
        refused.stderr
    );
}

#[test]
fn a_low_soft_limit_of_open_files_is_raised() {
    let out = tempfile::tempdir().unwrap();
    let flown = shell(&format!(
        "ulimit -Sn 40; exec {BINARY} run paper-4.1 --uavs 12 --duration 1 --out {}",
        out.path().display()
    ));
    assert!(matches!(flown.code, Some(0 | 3)), "{}", flown.stderr);
}

#[test]
fn a_disk_that_fills_up_ends_the_log_with_a_warning_beforehand_and_the_result_printed() {
    let out = tempfile::tempdir().unwrap();
    let place = out.path().display();
    // The log of this flight has 11 MB. Take the folder's list while the disk is still mounted.
    let script = format!("{BINARY} run paper-4.2 --out {place}; code=$?; ls {place}/* >&2; exit $code");
    let Some(said) = with_tmpfs(out.path(), "2m", &script) else { return };
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("the log will have about 11 MB"), "{}", said.stderr);
    assert!(
        said.stderr.contains("No space left on device") && said.stderr.contains("--no-record"),
        "{}",
        said.stderr
    );
    assert!(said.stdout.contains("the log is incomplete"), "{}", said.stdout);
    assert!(said.stdout.contains("90.0 s in"), "the flight goes on: {}", said.stdout);
    assert!(!said.stderr.contains(".draft"), "half a file is left: {}", said.stderr);
}

#[test]
fn a_benchmark_is_printed_although_its_results_cannot_be_written() {
    let out = tempfile::tempdir().unwrap();
    let script = format!(
        "{BINARY} bench --uavs 1 --load closed --transport pipe --repeat 1 --warm-up 0.02 --seconds 0.1 --out {place}; \
         code=$?; ls {place} >&2; exit $code",
        place = out.path().display()
    );
    let Some(said) = with_tmpfs(out.path(), "8k", &script) else { return };
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stdout.contains("pipe"), "the table: {}", said.stdout);
    assert!(said.stderr.contains("No space left on device"), "{}", said.stderr);
    assert!(!said.stderr.contains(".draft"), "half a file is left: {}", said.stderr);
}

#[test]
fn a_summary_that_cannot_be_written_is_printed_and_fails_the_command() {
    let out = tempfile::tempdir().unwrap();
    let run = ringwing()
        .args(["run", "paper-4.1", "--real-time", "--duration", "1.5", "--no-record", "--json", "--out"])
        .arg(out.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let folder = wait_until("the run's folder is there", || {
        let folder = newest_run(out.path())?;
        folder.join("scenario.toml").exists().then_some(folder)
    });
    // A folder at its place: the file cannot be renamed to there, whoever the user is.
    fs::create_dir_all(folder.join("summary.json/in the way")).unwrap();
    let said = Said::from(run.wait_with_output().unwrap());
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stdout.contains("\"verdict\": "), "{}", said.stdout);
    assert!(said.stderr.contains("summary.json: cannot be written"), "{}", said.stderr);
    assert!(!folder.join("summary.json.draft").exists());
}

#[test]
fn on_two_cores_a_recorded_swarm_in_lockstep_leaves_one_to_the_recorder() {
    if usable_cores() != 2 {
        eprintln!("skipped: this test needs a machine on which it may use two cores");
        return;
    }
    let allowed_cores = |process| status_of(process, "Cpus_allowed_list").unwrap();
    let all = allowed_cores(std::process::id());
    for (flags, keeps_together) in [("--duration 36000", true), ("--duration 36000 --no-record", false)] {
        let run = Swarm::fly("paper-4.2").with(flags).start();
        run.wait_for_second(0.1);
        let cores = |part| allowed_cores(run.process(part));
        let of_world = cores(Part::World);
        assert_eq!(of_world != all, keeps_together, "{flags}: the world may use {of_world}");
        for part in [Part::Leader, Part::Agent(UavId(1)), Part::Agent(UavId(6))] {
            assert_eq!(cores(part), of_world, "{flags}: {part}");
        }
        assert_eq!(cores(Part::Recorder), all, "{flags}");
        // A process on one core does not see the others, so it waits as the gate says.
        let shared = if keeps_together { 1 } else { 2 };
        assert_eq!(run.domain().gate().unwrap().cores(), shared, "{flags}");
        // A replacement takes the place of the process that it replaces.
        let killed = run.signal(Part::Leader, Signal::KILL);
        let replacement = wait_until("the leader is replaced", || {
            Some(run.process(Part::Leader)).filter(|process| *process != killed)
        });
        assert_eq!(allowed_cores(replacement), of_world, "{flags}: the replacement");
        send(run.launcher(), Signal::TERM);
        run.finish().assert_ended_with(1);
    }
}

#[test]
fn in_a_crowd_in_real_time_every_core_has_a_thread_that_runs_when_it_is_idle() {
    let cores = usable_cores();
    if !(2..=4).contains(&cores) {
        eprintln!("skipped: this test needs a machine on which it may use two to four cores");
        return;
    }
    // More than 32 agents per core.
    let crowd = format!("--uavs {} --real-time --duration 36000 --set time.rate_hz=20", 33 * cores);
    for (flags, threads) in [(crowd.clone(), cores), (format!("{crowd} --pin"), 0)] {
        let run = Swarm::fly("paper-4.1").with(&flags).start();
        run.wait_for_second(1.0);
        let idle = idle_core_threads(run.launcher());
        assert_eq!(idle.len(), threads as usize, "{flags}: {idle:?}");
        for (name, niceness, allowed) in &idle {
            assert_eq!(name, &format!("idle core {allowed}"), "{flags}");
            assert_eq!(niceness, "19", "{flags}: {name}");
        }
        assert_eq!(run.domain().gate().unwrap().cores(), cores, "{flags}: pinned processes share all cores");
        if threads > 0 {
            let all = status_of(std::process::id(), "Cpus_allowed_list");
            for uav in [1, 33 * cores] {
                let agent = run.process(Part::Agent(UavId(uav)));
                // An idle core may be moving it at this moment.
                wait_until("the agent may use all cores", || {
                    (status_of(agent, "Cpus_allowed_list") == all).then_some(())
                });
            }
        }
        send(run.launcher(), Signal::TERM);
        run.finish().assert_ended_with(1);
    }
}

/// Name, niceness and cores of each thread of `launcher` that moves processes to an idle core.
fn idle_core_threads(launcher: u32) -> Vec<(String, String, String)> {
    let tasks = fs::read_dir(format!("/proc/{launcher}/task")).unwrap().flatten();
    let thread = |task: fs::DirEntry| {
        let read = |file| fs::read_to_string(task.path().join(file)).ok();
        let name = read("comm")?.trim().to_owned();
        // The niceness is the 19th value, and the second, the name, may have spaces.
        let niceness = read("stat")?.rsplit_once(") ")?.1.split(' ').nth(16)?.to_owned();
        let status = read("status")?;
        let allowed =
            status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?.trim().to_owned();
        name.starts_with("idle core").then_some((name, niceness, allowed))
    };
    tasks.filter_map(thread).collect()
}

/// The log of the only run in `out`.
fn only_log(out: &Path) -> Log {
    let folder = newest_run(out).unwrap();
    Log::read(&log_in(&folder))
}
