//! `ringwing bench`: what it measures, which options it takes, and how it ends.

use crate::harness::{
    Swarm,
    bench::{Bench, Benched, assert_gone, domain_in, processes_with, samples, samples_above},
    log::Log,
    ringwing, send, status_of, wait_until,
};
use ringwing_bus::Domain;
use ringwing_flight::Tick;
use rustix::process::Signal;
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

const SHORT: &str = "--warm-up 0.02 --seconds 0.1";

fn number(value: &Value, key: &str) -> u64 {
    value[key].as_u64().unwrap_or_else(|| panic!("no number {key} in {value:#}"))
}

fn repeats(case: &Value) -> &[Value] {
    case["repeats"].as_array().unwrap()
}

/// Asserts that the only repeat of `case` has a sample of every tick, and of every hop of every answer.
fn assert_every_sample(case: &Value) {
    let (what, uavs) = (&case["case"], number(&case["case"], "uavs"));
    let [repeat] = repeats(case) else { panic!("{case:#}") };
    let (ticks, missed) = (number(repeat, "ticks"), number(repeat, "missed_deadlines"));
    assert!(ticks > 0, "{case:#}");
    // A tick that should have begun but did not is a sample, too.
    assert_eq!(samples(repeat, "tick"), ticks + missed, "{what}");
    let answers = samples(repeat, "wake");
    if what["load"] == "closed" {
        assert_eq!((answers, missed), (ticks * uavs, 0), "{what}");
        assert_eq!(samples(repeat, "return"), answers, "{what}");
    } else {
        // Only the swarm's world does not wait for late agents.
        let may_miss = what["subject"] == "swarm";
        assert!(answers == ticks * uavs || may_miss && answers <= ticks * uavs, "{what}");
        assert_eq!(samples(repeat, "return"), 0, "{what}");
    }
    for hop in ["read", "compute"] {
        assert_eq!(samples(repeat, hop), answers, "{what}");
    }
    let strip = repeat["strip"].as_array().unwrap();
    assert_eq!(strip.iter().map(|piece| number(piece, "ticks")).sum::<u64>(), ticks + missed);
    assert!(number(&repeat["usage"], "agent_pss_bytes") > 0, "{what}");
}

#[test]
fn every_transport_is_measured_in_both_loads_without_losing_a_sample() {
    let bench = Benched::by(&format!("--uavs 2 --rate 200 --repeat 1 {SHORT}"));
    let kinds = bench.cases().iter().map(|case| {
        assert_every_sample(case);
        (case["case"]["subject"].as_str().unwrap(), case["case"]["load"] == "closed")
    });
    let seen: BTreeSet<_> = kinds.collect();
    assert_eq!(seen.len(), 18, "{seen:?}");
}

#[test]
fn a_mesh_is_measured_in_both_loads_without_losing_a_sample() {
    let bench = Benched::by(&format!(
        "--topology hub,mesh --transport pipe,pipe-polled,unix-datagram --uavs 1,2,5 --rate 200 --repeat 1 {SHORT}"
    ));
    bench.cases().iter().for_each(assert_every_sample);
    let count = |subject: &str, topology: &str| {
        let is_it =
            |case: &&Value| case["case"]["subject"] == subject && case["case"]["topology"] == topology;
        bench.cases().iter().filter(is_it).count()
    };
    // Three sizes and two loads.
    for transport in ["pipe", "pipe-polled", "unix-datagram"] {
        assert_eq!((count(transport, "hub"), count(transport, "mesh")), (6, 6), "{transport}");
    }
    assert_eq!((count("swarm", "hub"), count("swarm", "mesh")), (6, 0), "the swarm appears once");
}

#[test]
fn a_mesh_of_two_hundred_and_one_with_large_payloads_are_measured() {
    for arguments in ["--uavs 200", "--uavs 3 --payload 65536"] {
        let bench = Benched::by(&format!(
            "{arguments} --topology mesh --transport pipe,unix-datagram --load closed --repeat 1 {SHORT}"
        ));
        bench.cases().iter().for_each(assert_every_sample);
        assert_eq!(bench.cases().len(), 3, "the swarm and two meshes");
    }
}

#[test]
fn a_killed_leader_of_a_mesh_ends_all_peers_and_fails_only_its_case() {
    let bench = Bench::start(
        "--topology mesh --uavs 3 --load closed --transport pipe --repeat 1 --warm-up 0 --seconds 3",
    );
    let (peer, _) = bench.wait_for(" --member 1 ");
    let is_leader = |line: &str| line.contains(" bench-peer ") && !line.contains(" --member ");
    let leader = wait_until("the leader runs", || {
        bench.processes().into_iter().find(|(_, line)| is_leader(line)).map(|(process, _)| process)
    });
    send(leader, Signal::KILL);
    wait_until("a peer is gone", || (!fs::exists(format!("/proc/{peer}")).unwrap()).then_some(()));
    let bench = bench.finish();
    assert_eq!(bench.code, Some(1));
    let failed = bench.results["cases"].as_array().unwrap().iter().filter(|case| case["failure"].is_string());
    assert_eq!(failed.map(|case| &case["case"]["subject"]).collect::<Vec<_>>(), ["pipe"]);
}

/// The peer in `bench/peers/example.py`; `None` if this machine cannot run it.
fn example_peer() -> Option<String> {
    let runs = Command::new("python3").arg("--version").stdout(Stdio::null()).status();
    if !runs.is_ok_and(|status| status.success()) {
        eprintln!("skipped: there is no python3, which runs bench/peers/example.py");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("bench/peers/example.py");
    Some(format!("example=python3 '{}'", script.display()))
}

#[test]
fn the_example_of_a_peer_is_measured_in_both_loads_without_losing_a_sample() {
    let Some(peer) = example_peer() else { return };
    let line = format!("--uavs 1,3 --payload 0,65536 --rate 200 --transport none --repeat 1 {SHORT}");
    let bench = Bench::start_with_peers(&line, &[&peer]).finish();
    bench.cases().iter().for_each(assert_every_sample);
    let of_peer = bench.cases().iter().filter(|case| case["case"]["subject"]["peer"] == "example");
    assert_eq!(of_peer.count(), 8);
}

/// A shell script as a peer. Its world reports everything that it should without running a tick; then the processes run
/// `at_the_end`.
fn script_peer(name: &str, at_the_end: &str) -> String {
    // Arguments 1 to 4 are --role, the role, --dir, and the folder.
    let agent = "while [ ! -e end ]; do sleep 0.01; done";
    let world = "echo warm; read line; echo done; read line; touch end";
    let script = format!(r#"cd "$4"; if [ $2 = agent ]; then {agent}; else {world}; fi; {at_the_end}"#);
    format!("{name}=sh -c '{script}' sh")
}

#[test]
fn a_peer_that_fails_or_lies_fails_only_its_cases() {
    let peers = [
        ("nowhere=/no/such/program", "/no/such/program: cannot be started"),
        ("fails=sh -c 'echo it broke >&2; exit 7'", "it broke"),
        ("early=sh -c 'exit 7'", "ended early: exit status: 7"),
        ("talks=sh -c 'echo hello; exec sleep 98761'", "printed \"hello\" where `warm` was expected"),
        ("hangs=sh -c 'exec sleep 98762'", "did not print `warm` within 10."),
        (&script_peer("silent", ""), "world.trace: cannot be read"),
        (&script_peer("late", "exit 5"), "failed: exit status: 5"),
        (
            &script_peer("torn", "printf xyz > world.trace; touch agent-1.trace"),
            "3 bytes are not a number of records",
        ),
        (&script_peer("empty", "touch world.trace agent-1.trace"), "no tick was opened between"),
    ];
    let commands = peers.map(|(peer, _)| peer);
    let line = format!("--uavs 1 --load closed --transport pipe --repeat 1 {SHORT}");
    let bench = Bench::start_with_peers(&line, &commands).finish();
    assert_eq!(bench.code, Some(1), "{}", bench.stderr);
    let cases = bench.results["cases"].as_array().unwrap();
    let (of_peers, others): (Vec<&Value>, Vec<&Value>) =
        cases.iter().partition(|case| case["case"]["subject"].is_object());
    others.into_iter().for_each(assert_every_sample);
    for (peer, problem) in peers {
        let name = peer.split('=').next().unwrap();
        let case = of_peers.iter().find(|case| case["case"]["subject"]["peer"] == name).unwrap();
        let failure = case["failure"].as_str().unwrap_or_else(|| panic!("{case:#}"));
        assert!(failure.contains(problem), "{name}: {failure}");
    }
    for command in ["sleep 98761", "sleep 98762"] {
        assert_eq!(processes_with(command), Vec::<u32>::new(), "{command}");
    }
}

#[test]
fn the_processes_of_a_peer_end_with_a_killed_benchmark() {
    let line = "--uavs 2 --load closed --transport none --repeat 1 --warm-up 0 --seconds 0.05";
    let bench = Bench::start_with_peers(line, &["hangs=sh -c 'exec sleep 98763'"]);
    wait_until("the peer runs", || (processes_with("sleep 98763").len() == 3).then_some(()));
    let (case, _) = bench.wait_for("\"peer\":\"hangs\"");
    send(case, Signal::KILL);
    wait_until("the peer is gone", || processes_with("sleep 98763").is_empty().then_some(()));
    assert_eq!(bench.finish().code, Some(1));
}

#[test]
fn the_swarm_is_measured_with_every_wait_payload_and_recorder() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("results");
    let bench = Benched::by(&format!(
        "--uavs 3 --load closed --transport none --wake gate,spin,event --payload 0,65536 \
         --recorder off,on --mcap --out {} --repeat 1 {SHORT}",
        folder.display()
    ));
    assert_eq!(bench.cases().len(), 12);
    for case in bench.cases() {
        let [repeat] = repeats(case) else { panic!("{case:#}") };
        assert!(samples(repeat, "wake") > 0, "{case:#}");
        assert!(repeat["usage"]["law_ns_per_tick"].as_f64().unwrap() > 0.0, "{case:#}");
    }
    let written: Value = serde_json::from_slice(&fs::read(folder.join("results.json")).unwrap()).unwrap();
    assert_eq!(written, bench.results);
    let logs: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let logs: Vec<_> = logs.iter().filter(|path| path.extension().is_some_and(|end| end == "mcap")).collect();
    assert_eq!(logs.len(), 6, "{logs:?}");
    assert!(logs.iter().all(|log| Log::read(log).topics.contains_key("/timing")));
}

#[test]
fn neither_waiting_nor_ballast_changes_what_flies() {
    let hash = |settings: &str| {
        let run = Swarm::fly("paper-4.1").with(&format!("--duration 2 --no-record {settings}")).finish();
        run.text("payload_hash").to_owned()
    };
    let usual = hash("");
    for settings in ["--set ipc.wake=spin", "--set ipc.wake=event --set ipc.payload_bytes=5000"] {
        assert_eq!(hash(settings), usual, "{settings}");
    }
}

#[test]
fn each_round_measures_every_case_once_in_the_order_of_the_seed() {
    let places = |seed: u32| {
        let bench = Benched::by(&format!(
            "--uavs 1,2 --load closed --transport gate,futex --repeat 3 --seed {seed} --warm-up 0 --seconds 0.02"
        ));
        assert_eq!(bench.results["seed"], seed);
        let places =
            bench.cases().iter().map(|case| repeats(case).iter().map(|one| number(one, "place")).collect());
        places.collect::<Vec<Vec<u64>>>()
    };
    let first = places(5);
    assert!(first.iter().all(|places| places.iter().map(|place| place / 6).eq([0, 1, 2])), "{first:?}");
    let all: BTreeSet<u64> = first.concat().into_iter().collect();
    assert_eq!(all.len(), 18);
    assert_eq!(first, places(5));
    assert_ne!(first, places(6));
}

#[test]
fn a_stall_is_charged_to_every_tick_that_it_delayed() {
    let bench =
        Bench::start("--uavs 3 --load paced --rate 100 --transport none --repeat 1 --warm-up 0 --seconds 3");
    let (world, line) = bench.wait_for(" world --domain ");
    let gate = Domain::join(&domain_in(&line)).unwrap().gate().unwrap();
    wait_until("the flight is under way", || gate.tick().filter(|tick| *tick > Tick(10)));
    send(world, Signal::STOP);
    thread::sleep(Duration::from_millis(400));
    send(world, Signal::CONT);
    let bench = bench.finish();
    let repeat = &repeats(&bench.cases()[0])[0];
    // At 100 Hz, 40 ticks should begin in 0.4 s. The stall delays the first by 0.4 s, the next by 0.39 s, and so on.
    assert!(number(repeat, "missed_deadlines") >= 38, "{repeat}");
    for (delay_ms, delayed) in [(350, 4), (200, 19), (100, 29), (20, 37)] {
        let count = samples_above(repeat, "tick", delay_ms * 1_000_000);
        assert!(
            count >= delayed,
            "only {count} ticks took {delay_ms} ms or more, expected at least {delayed}"
        );
    }
}

#[test]
fn an_interrupted_benchmark_reports_what_it_has_and_leaves_nothing() {
    let bench =
        Bench::start("--uavs 3 --load closed --transport pipe,udp --repeat 1000 --warm-up 0 --seconds 0.1");
    let mut cases = BTreeSet::new();
    let mut domains = BTreeSet::new();
    wait_until("some cases are done and another is running", || {
        cases.extend(bench.cases());
        let lines = bench.processes().into_iter().map(|(_, line)| line);
        domains.extend(lines.filter(|line| line.contains("--domain ")).map(|line| domain_in(&line)));
        (cases.len() > 4).then_some(())
    });
    bench.interrupt();
    let bench = bench.finish();
    assert_eq!(bench.code, Some(1), "{}", bench.stderr);
    assert_eq!(bench.results["interrupted"], true);
    let done: usize = bench.results["cases"].as_array().unwrap().iter().map(|case| repeats(case).len()).sum();
    assert!((4..3000).contains(&done), "{done}");
    domains.iter().for_each(assert_gone);
}

#[test]
fn ctrl_z_stops_a_benchmark_with_all_its_processes_and_the_case_is_measured_again() {
    for (transport, part) in [("none", " agent "), ("pipe", " bench-peer ")] {
        let bench = Bench::start(&format!(
            "--uavs 2 --load closed --transport {transport} --repeat 1 --warm-up 0 --seconds 3"
        ));
        let (process, _) = bench.wait_for(part);
        // A process that has just ended stays a zombie while its parent stands still. One that was starting another process waits
        // in the kernel (D) until that one, which stands still, runs its program.
        let is_stopped = |process: u32| {
            let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
            stat.rsplit_once(')').is_some_and(|(_, rest)| rest.trim_start().starts_with(['T', 'Z', 'D']))
        };
        bench.suspend();
        wait_until("everything stands", || {
            (is_stopped(bench.id()) && bench.processes().iter().all(|(process, _)| is_stopped(*process)))
                .then_some(())
        });
        assert!(is_stopped(process), "{transport}: process {process} runs on");
        // Longer than any tick may take.
        thread::sleep(Duration::from_millis(1500));
        send(bench.id(), Signal::CONT);
        let bench = bench.finish();
        for case in bench.cases() {
            let [repeat] = repeats(case) else { panic!("{case:#}") };
            assert_eq!(samples_above(repeat, "tick", 1_400_000_000), 0, "{transport}: {case:#}");
        }
    }
}

#[test]
fn a_killed_hub_ends_its_peers_and_fails_only_its_case() {
    let bench = Bench::start("--uavs 2 --load closed --transport tcp --repeat 1 --warm-up 0 --seconds 3");
    let (peer, _) = bench.wait_for(" bench-peer ");
    let (hub, line) = bench.wait_for("\"subject\":\"tcp\"");
    assert!(line.contains("bench-case"), "{line}");
    send(hub, Signal::KILL);
    wait_until("its peer is gone", || (!fs::exists(format!("/proc/{peer}")).unwrap()).then_some(()));
    let bench = bench.finish();
    assert_eq!(bench.code, Some(1));
    let failed: Vec<&Value> = bench.results["cases"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|case| case["failure"].is_string())
        .collect();
    assert!(failed.len() == 1 && failed[0]["case"]["subject"] == "tcp", "{}", bench.results);
}

#[test]
fn pinned_processes_run_on_one_core_each_and_on_all_cores_together() {
    let bench =
        Bench::start("--pin --uavs 2 --load closed --transport gate --repeat 1 --warm-up 0 --seconds 0.5");
    // The order of both cases depends on the seed, so look for the processes of both at once.
    let mut cores: BTreeMap<&str, u32> = BTreeMap::new();
    wait_until("two agents and two peers have run", || {
        for text in [" agent --uav 1 ", " agent --uav 2 ", "--member 0 ", "--member 1 "] {
            let processes = bench.processes();
            let process = processes.iter().find(|(_, line)| line.contains(text));
            if let Some(allowed) = process.and_then(|(pid, _)| status_of(*pid, "Cpus_allowed_list")) {
                let core =
                    allowed.parse().unwrap_or_else(|_| panic!("{text}: more than one core: {allowed}"));
                cores.insert(text, core);
            }
        }
        (cores.len() == 4).then_some(())
    });
    if thread::available_parallelism().is_ok_and(|count| count.get() > 1) {
        assert_ne!(cores[" agent --uav 1 "], cores[" agent --uav 2 "], "agents");
        assert_ne!(cores["--member 0 "], cores["--member 1 "], "peers");
    }
    assert_eq!(bench.finish().cases().len(), 2);
}

#[test]
fn a_priority_is_applied_or_refused_before_anything_starts() {
    let mut bench = Bench::start(
        // Paced: in a closed loop, processes of a real-time class would take both cores from this test.
        "--priority 7 --uavs 2 --load paced --transport none --repeat 1 --warm-up 0 --seconds 1",
    );
    let world = wait_until("the world runs or the benchmark has ended", || {
        let ended = bench.has_ended();
        let world = bench.processes().into_iter().find(|(_, line)| line.contains(" world "));
        (ended || world.is_some()).then_some(world)
    });
    let Some((world, _)) = world else {
        let refused = bench.finish();
        assert!(refused.code == Some(2) && refused.stderr.contains("ulimit -r"), "{}", refused.stderr);
        return;
    };
    let stat = fs::read_to_string(format!("/proc/{world}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    // Fields 40 and 41 of the line, counted from 1, are the priority and the policy, where 1 is SCHED_FIFO. The first two
    // fields end at the bracket.
    assert_eq!((fields[37], fields[38]), ("7", "1"));
    assert_eq!(bench.finish().cases().len(), 1);
}

#[test]
fn a_quick_benchmark_measures_six_uavs_once_by_default() {
    let bench = Benched::by("--quick --transport gate --load closed");
    assert!(bench.cases().iter().all(|case| case["case"]["uavs"] == 6 && repeats(case).len() == 1));
    let bench = Benched::by("--quick --transport none --load closed --uavs 1 --repeat 2 --seconds 0.05");
    assert!(bench.cases().iter().all(|case| case["case"]["uavs"] == 1 && repeats(case).len() == 2));
}

#[test]
fn contradictions_are_refused_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let full = folder.path().join("full");
    fs::create_dir(&full).unwrap();
    fs::write(full.join("results.json"), "{}").unwrap();
    let full = format!("--out {}", full.display());
    for (arguments, remedy) in [
        ("--uavs 1025", "1..=1024"),
        ("--load closed --rate 100", "add --load paced"),
        ("--transport none,udp", "none alone"),
        ("--topology mesh --transport udp", "add --topology hub,mesh"),
        ("--wake poll", "event"),
        ("--payload 70000", "0..=65536"),
        ("--recorder maybe", "off"),
        ("--mcap", "--out"),
        ("--priority 5 --wake spin", "leave one of them out"),
        ("--repeat 0", "--repeat"),
        ("--seconds 1e9", "from 0.01 to 60"),
        ("--warm-up=-1", "from 0 to 60"),
        ("--out /proc/nowhere", "choose a folder that can be written"),
        (&full, "choose another folder"),
    ] {
        let bench = Benched::by(arguments);
        assert_eq!(bench.code, Some(2), "{arguments}: {}", bench.stderr);
        assert!(bench.stderr.contains(remedy), "{arguments}: {}", bench.stderr);
        assert!(bench.results.is_null());
    }
}

#[test]
fn the_doctor_measures_nothing() {
    let output = ringwing().args(["bench", "--doctor"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let stdout = String::from_utf8(output.stdout).unwrap();
    for fact in ["processor", "cores usable", "kernel", "clock source", "load average"] {
        assert!(stdout.lines().any(|line| line.trim_start().starts_with(fact)), "no {fact}:\n{stdout}");
    }
    assert!(!stdout.contains("whole tick"), "{stdout}");
}

#[test]
fn two_results_are_compared_and_other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    for (out, payload) in [(&a, "0"), (&b, "0,64")] {
        let out = out.display();
        let line = format!(
            "--uavs 1 --load closed --transport pipe --payload {payload} --repeat 4 {SHORT} --out {out}"
        );
        assert_eq!(Benched::by(&line).code, Some(0));
    }
    let compare =
        |a: &Path, b: &Path| ringwing().args(["bench", "compare", "--json"]).args([a, b]).output().unwrap();
    let output = compare(&a, &b.join("results.json"));
    assert_eq!(output.status.code(), Some(0));
    let comparison: Value = serde_json::from_slice(&output.stdout).unwrap();
    let count = |key: &str| comparison[key].as_array().unwrap().len();
    assert_eq!((count("cases"), count("only_in_a"), count("only_in_b")), (2, 0, 2));
    let figures = comparison["cases"][0]["figures"].as_array().unwrap();
    let tick = figures.iter().find(|figure| figure["name"] == "tick time, us").unwrap();
    assert!(tick["a"]["median"].as_f64() > Some(0.0) && tick["b"]["median"].as_f64() > Some(0.0));
    let page = a.join("index.html");
    let refused = compare(&page, &b);
    let stderr = String::from_utf8(refused.stderr).unwrap();
    assert_ne!(refused.status.code(), Some(0));
    assert!(stderr.contains("index.html: not a result of"), "{stderr}");
}
