//! Planned faults: each takes effect at exactly its tick, is logged and counted, and repeats to the bit.

use crate::harness::{Finished, Running, Swarm, ringwing};
use ringwing_recorder::schema::UavState;
use std::process::Output;

fn flown(faults: &[&str], arguments: &str) -> Finished {
    let swarm =
        faults.iter().fold(Swarm::fly("paper-4.1").with(arguments), |swarm, fault| swarm.fault(fault));
    let run = swarm.finish();
    assert!(matches!(run.status.code(), Some(0 | 3)), "{}\n{:#}", run.stderr, run.summary);
    assert_eq!(run.summary["failures"].as_array().unwrap().len(), 0, "{}", run.stderr);
    run.assert_nothing_left();
    run
}

fn assert_logged(run: &Finished, line: &str) {
    let lines = run.log().lines();
    assert!(lines.iter().any(|logged| logged == line), "no {line:?} in {lines:#?}");
}

/// The ticks at which the mode changed, each with the new mode.
fn changes(states: &[UavState]) -> Vec<(i64, &str)> {
    let pairs = states.windows(2).filter(|pair| pair[0].mode != pair[1].mode);
    pairs.map(|pair| (pair[1].tick, pair[1].mode.as_str())).collect()
}

/// The first and the last tick up to `end` without a command from UAV `uav`; `None` if it commanded in every tick.
fn silence(run: &Finished, uav: u32, end: i64) -> Option<(i64, i64)> {
    let commanded: Vec<i64> = run.log().controls(uav).iter().map(|control| control.tick).collect();
    let silent: Vec<i64> = (0..=end).filter(|tick| !commanded.contains(tick)).collect();
    Some((*silent.first()?, *silent.last()?))
}

#[test]
fn a_process_is_killed_at_exactly_its_tick_and_the_flight_repeats_to_the_bit() {
    let faults = ["at 5 s kill uav 3", "at 6.5 s kill random 2 uavs"];
    let runs = [0, 1].map(|_| flown(&faults, "--duration 10"));
    assert_eq!(runs[0].text("payload_hash"), runs[1].text("payload_hash"));
    assert_eq!(silence(&runs[0], 3, 1000), Some((500, 1000)));
    assert_eq!(changes(&runs[0].log().states(3)), [(550, "loiter")]);
    assert_logged(&runs[0], "fault.kill: uav 3 is killed: kill uav 3");
    let undisturbed = flown(&[], "--duration 10");
    assert_ne!(runs[0].text("payload_hash"), undisturbed.text("payload_hash"));
}

#[test]
fn agents_return_at_exactly_their_tick() {
    let faults = [
        "at 3 s restart uav 2 after 2 s",
        "at 4 s freeze uav 5 for 1.5 s",
        "at 7 s flap uav 4 every 1 s for 2 s",
    ];
    let runs = [0, 1, 2].map(|_| flown(&faults, "--duration 12"));
    for run in &runs {
        assert_eq!(run.text("payload_hash"), runs[0].text("payload_hash"));
        assert_eq!(silence(run, 2, 1200), Some((300, 499)));
        // A thawed agent first answers the tick that is still open. That command is late and not used.
        assert_eq!(silence(run, 5, 1200).map(|(first, _)| first), Some(400));
        assert_eq!(changes(&run.log().states(2)), [(350, "loiter"), (501, "commanded")]);
    }
    assert_logged(&runs[0], "fault.start: uav 2 is started: restart uav 2 after 2 s");
    assert_logged(&runs[0], "fault.thaw: uav 5 is thawed: freeze uav 5 for 1.5 s");
    assert_eq!(runs[0].log().lines().iter().filter(|line| line.starts_with("fault.kill: uav 4")).count(), 2);
    let faults = runs[0].log().faults();
    assert!(faults.iter().any(|now| now.lost_names == ["uav 2"]), "{faults:?}");
    assert_eq!(faults.last().unwrap().summary, "none");
}

#[test]
fn a_leader_killed_by_a_fault_is_not_replaced() {
    let run = flown(&["at 5 s restart leader after 2 s"], "--duration 10");
    let again = flown(&["at 5 s restart leader after 2 s"], "--duration 10");
    assert_eq!(run.text("payload_hash"), again.text("payload_hash"));
    let ages: Vec<f64> = run.log().controls(1).iter().filter_map(|control| control.leader_age_s).collect();
    let oldest = ages.iter().copied().fold(0.0, f64::max);
    // Two seconds without a leader, and the one tick by which every sample is old.
    assert!((oldest - 2.01).abs() < 1e-9, "the leader's data were {oldest} s old at most, expected 2.01 s");
    assert_eq!(*ages.last().unwrap(), 0.01);
    let gone = flown(&["at 5 s kill leader"], "--duration 10");
    assert_eq!(gone.log().controls(1).last().unwrap().leader_age_s, Some(5.01));
    assert!(!gone.stderr.contains("a new one takes over"), "{}", gone.stderr);
}

#[test]
fn a_delay_ages_the_data_of_its_link_only() {
    let run = flown(&["at 5 s link 2->3 delay 200 ms for 2 s"], "--duration 10");
    let ages = |uav, of: fn(&ringwing_recorder::schema::UavControl) -> Option<f64>| -> Vec<f64> {
        run.log().controls(uav).iter().filter_map(of).collect()
    };
    let previous = ages(3, |control| control.previous_age_s);
    // The last sample without a delay is that of tick 499. It ages until that of tick 500 comes, at tick 521.
    assert_eq!((previous[500], previous[519], previous[600]), (0.01, 0.2, 0.21));
    assert_eq!(previous[702], 0.01, "samples sent after the delay ends arrive without delay");
    assert!(ages(3, |control| control.next_age_s).iter().all(|age| *age == 0.01));
    assert!(ages(1, |control| control.next_age_s).iter().all(|age| *age == 0.01));
    assert_logged(&run, "fault.link: link 2->3 delay 200 ms for 2 s");
    assert_logged(&run, "fault.healed: link 2->3 delay 200 ms for 2 s");
}

#[test]
fn every_sample_of_a_link_with_faults_is_counted() {
    let faults = [
        "at 0 s link all loss 30 %",
        "at 2 s link 1<->2 duplicate 50 %",
        "at 3 s link all delay 50 ms jitter 50 ms",
    ];
    let run = flown(&faults, "--duration 10");
    let counts = run.log().links();
    assert!(counts.iter().any(|one| one.late > 0 && one.duplicated > 0 && one.in_flight > 0), "{counts:#?}");
    for one in &counts {
        assert_eq!(
            one.offered + one.duplicated,
            one.delivered + one.lost + one.corrupted + one.in_flight,
            "{one:?}"
        );
    }
    let totals = run.summary["flight"]["links"].as_array().unwrap();
    assert_eq!(totals.len(), 6 * 3, "each UAV has three links: two neighbours and the leader");
    for total in totals {
        let of = |key: &str| total[key].as_u64().unwrap();
        assert_eq!(of("offered"), 1001, "{total}");
        assert_eq!(of("offered") + of("duplicated"), of("delivered") + of("lost") + of("in_flight"));
        assert!((200..400).contains(&of("lost")), "{total}");
    }
    assert_eq!(run.text("payload_hash"), flown(&faults, "--duration 10").text("payload_hash"));
}

/// Sends a request to a run with `ringwing fault`. Returns the exit code and the output.
fn ask(run: &Running, sentence: &str) -> (Option<i32>, String) {
    let id = run.domain().id().to_string();
    let Output { status, stdout, stderr } = ringwing().args(["fault", &id, sentence]).output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap() + &String::from_utf8(stderr).unwrap())
}

#[test]
fn a_live_run_answers_each_request_with_its_tick_or_a_reason() {
    for mode in ["--duration 36000", "--real-time --duration 3600"] {
        let run = Swarm::fly("paper-4.1").with(mode).start();
        run.wait_for_second(0.5);
        assert_eq!(ask(&run, "list"), (Some(0), "none\n".into()));
        for sentence in ["link 2->3 delay 200 ms", "freeze uav 5", "thaw uav 5", "restart uav 4 after 100 ms"]
        {
            let (code, output) = ask(&run, sentence);
            assert_eq!(code, Some(0), "{output}");
            assert!(output.starts_with("tick ") && output.trim_end().ends_with(sentence), "{output}");
        }
        assert!(ask(&run, "list").1.contains(" s: link 2->3 delay 200 ms"));
        for (sentence, code, why) in [
            ("kil uav 3", 2, "did you mean kill?"),
            ("kill uav 9", 1, "refused: there is no uav 9"),
            ("thaw uav 3", 1, "refused: uav 3 is not frozen"),
            ("heal link 3->2", 1, "refused: there is nothing to heal"),
        ] {
            let answer = ask(&run, sentence);
            assert!(answer.0 == Some(code) && answer.1.contains(why), "{sentence}: {answer:?}");
        }
        let (code, output) = ask(&run, "heal all");
        assert_eq!(code, Some(0), "{output}");
        // The request is answered before its tick begins. A run that ends before that tick heals nothing.
        let tick: u32 = output.split_whitespace().nth(1).unwrap().trim_end_matches(',').parse().unwrap();
        run.wait_for_second(f64::from(tick + 1) / 100.0);
        crate::harness::send(run.launcher(), rustix::process::Signal::INT);
        let run = run.finish();
        run.assert_ended_with(1);
        let lines = run.log().lines();
        for logged in [
            "fault.requested: at ",
            "fault.link: link 2->3 delay 200 ms",
            "fault.healed: link 2->3",
            "fault.refused: uav 3 is not frozen",
        ] {
            assert!(lines.iter().any(|line| line.starts_with(logged)), "no {logged:?} in {lines:#?}");
        }
    }
}

#[test]
fn late_senses_upset_the_papers_law_but_not_the_resilient_law() {
    let farthest = |law: &str| {
        let run = flown(&["at 20 s link own->3 delay 150 ms"], &format!("--law {law} --duration 40"));
        let of = |uav| {
            let states = run.log().states(uav);
            states[3000..].iter().filter_map(|state| state.slot_error_m).fold(0.0, f64::max)
        };
        (of(3), of(6))
    };
    let (own, _) = farthest("paper");
    assert!(own > 1.0, "150 ms should be too late for the heading loop, but the slot error is only {own} m");
    let (own, other) = farthest("resilient");
    assert!(own < 0.05 && other < 0.05, "slot errors: {own} m (uav 3), {other} m (uav 6)");
}

#[test]
fn lockstep_waits_for_a_slow_uav_and_real_time_reuses_its_commands() {
    let slow = ["at 0.5 s slow uav 3 by 25 ms for 1 s"];
    let undisturbed = flown(&[], "--duration 3");
    assert_eq!(flown(&slow, "--duration 3").text("payload_hash"), undisturbed.text("payload_hash"));
    let reused = flown(&slow, "--duration 3 --real-time").summary["reused_commands"].as_u64().unwrap();
    assert!(
        reused >= 50,
        "at most every third of 100 ticks is answered in time, but only {reused} commands were reused"
    );
}

#[test]
fn delays_are_replayed_from_a_file_in_any_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wifi.txt");
    std::fs::write(&path, "0.02\n0.05\n0\n").unwrap();
    let run =
        flown(&[&format!("at 5 s link 2->3 delay file \"{}\" for 3 s", path.display())], "--duration 10");
    let ages: Vec<i64> = run.log().controls(3)[500..800]
        .iter()
        .filter_map(|control| control.previous_age_s)
        .map(|age_s| (age_s * 100.0).round() as i64)
        .collect();
    // The delays repeat every three ticks: samples sent at ticks 500, 501 and 502 arrive at 503, 507 and 503.
    assert_eq!(ages[..9], [1, 2, 3, 1, 2, 3, 1, 2, 3]);
    assert_eq!(ages[150..153], ages[153..156]);
}

#[test]
fn a_delay_file_is_found_beside_its_scenario_and_checked_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = folder.path().join("wind.toml");
    let fault = "[[faults]]\nat_s = 1.0\ndo = \"link 2->3 delay file \\\"wifi.txt\\\"\"\n";
    std::fs::write(&scenario, format!("[time]\nduration_s = 2.0\n{fault}")).unwrap();
    let check = || ringwing().args(["scenario", "check"]).arg(&scenario).current_dir("/").output().unwrap();
    for (content, problem) in [
        ("0.02\n1e300\n", "wifi.txt\", line 2: \"1e300\" is outside 0 to 86400 s"),
        ("0.02\n-1\n", "line 2: \"-1\" is outside"),
        ("nan\n", "line 1: \"nan\" is not a delay"),
    ] {
        std::fs::write(folder.path().join("wifi.txt"), content).unwrap();
        let stderr = String::from_utf8(check().stderr).unwrap();
        assert!(stderr.contains("wind.toml:5") && stderr.contains(problem), "{stderr}");
    }
    std::fs::write(folder.path().join("wifi.txt"), "\u{feff}0.02\r\n0.05\r\n").unwrap();
    assert_eq!(check().status.code(), Some(0));
    let run = Swarm::fly(scenario.to_str().unwrap()).finish();
    assert!(run.summary["failures"].as_array().unwrap().is_empty(), "{}", run.stderr);
    let oldest =
        run.log().controls(3).iter().filter_map(|control| control.previous_age_s).fold(0.0, f64::max);
    assert!(oldest > 0.02, "the samples come {oldest} s late at most");
}

#[test]
fn faults_without_effect_are_warned_of_counted_and_may_violate() {
    let faults = [
        "at 1 s kill uav 3",
        "at 2 s kill uav 3",
        "at 2 s link 1->2 loss 50 %",
        "at 2 s link 2->5 blackout",
        "at 2 s link 1->2 delay 4 ms",
        "at 9 s link 1->2 blackout",
    ];
    let run = flown(&faults, "--duration 5 --set requirements={}");
    for (sentence, reason) in [
        (faults[1], "uav 3 is gone already"),
        (faults[3], "uav 2 and uav 5 are not ring neighbours"),
        (faults[4], "4 ms rounds to no tick at 100 Hz"),
        (faults[5], "it begins at 9 s, and the flight ends at 5 s"),
    ] {
        let start = format!("warning: --fault \"{sentence}\": the fault will have no effect: {reason}");
        assert!(run.stderr.lines().any(|line| line.contains(&start)), "no {start:?} in {}", run.stderr);
    }
    let effects = &run.summary["flight"]["fault_effects"];
    assert_eq!((&effects["asked"], &effects["acted"]), (&6.into(), &2.into()), "{effects:#}");
    let idle: Vec<_> =
        effects["without_effect"].as_array().unwrap().iter().map(|idle| &idle["reason"]).collect();
    assert_eq!(
        idle,
        [
            "uav 3 is gone already",
            "nobody listened on such a link",
            "4 ms rounds to no tick at 100 Hz",
            "it begins after the end of the flight at 5.00 s",
        ]
    );
    let strict = "--duration 5 --set requirements={faults_act=true}";
    let violated = flown(&faults, strict);
    assert_eq!(violated.status.code(), Some(3));
    let violations = violated.summary["violations"].as_array().unwrap();
    let is_named = |violation: &serde_json::Value| {
        violation.as_str().unwrap().starts_with("without effect: at 2 s kill uav 3")
    };
    assert!(violations.iter().any(is_named), "{violations:?}");
    assert_eq!(flown(&faults[..1], strict).status.code(), Some(0));
}

/// Flies these faults twice by processes and once in the simulation, and asserts that all three flights are the same.
fn assert_repeats_as_simulated(faults: &[&str], arguments: &str) {
    let runs = [(); 2].map(|()| flown(faults, arguments));
    let hash = runs[0].text("payload_hash");
    assert_eq!(hash, runs[1].text("payload_hash"), "{faults:?}");
    assert_eq!(runs[0].number("unanswered_ticks"), 0.0, "{faults:?}");
    let text = std::fs::read_to_string(runs[0].folder.join("scenario.toml")).unwrap();
    let simulated = ringwing_simulation::fly(&ringwing_scenario::Scenario::resolved(&text).unwrap()).unwrap();
    assert_eq!(hash, simulated.report.unwrap().payload_hash, "{faults:?}");
}

#[test]
fn agents_without_their_own_senses_answer_every_tick() {
    for fault in [
        "at 2 s link own->all blackout for 1.2 s",
        "at 2 s link own->3 delay 1.5 s",
        "at 2 s link own->all hold for 2 s",
        "at 2 s link own->all gilbert loss 60 % burst 800 ms",
        "at 2 s link own->3 blackout",
    ] {
        assert_repeats_as_simulated(&[fault], "--law resilient --duration 6");
    }
}

#[test]
fn links_with_a_rate_and_with_corruption_repeat_as_simulated() {
    let faults = [
        "at 1 s link all rate 20 samples/s queue 5 for 3 s",
        "at 2 s link all corrupt 20 %",
        "at 2 s link all gilbert loss 10 % burst 80 ms",
        "at 3 s restart uav 3 after 500 ms",
    ];
    assert_repeats_as_simulated(&faults, "--law resilient --duration 6");
    let corrupted =
        flown(&faults[1..2], "--duration 6").log().links().iter().map(|one| one.corrupted).sum::<u64>();
    assert!(corrupted > 0);
}

#[test]
fn every_restart_of_the_fastest_flapping_happens() {
    for (rate_hz, period_ms, kills) in [(2, 1000, 4), (10, 200, 5), (100, 20, 5)] {
        let for_s = f64::from(kills * period_ms) / 1000.0;
        for who in ["uav 3", "leader", "recorder"] {
            let fault = format!("at 2 s flap {who} every {period_ms} ms for {for_s} s");
            let arguments = format!("--duration 8 --set time.rate_hz={rate_hz}");
            let run = flown(&[&fault], &arguments);
            // The terminal tells of all of them: a recorder that is killed takes the last events with it.
            let told = |what: &str| run.stderr.lines().filter(|line| line.contains(what)).count();
            let happened = [told(&format!("{who} is killed")), told(&format!("{who} is started"))];
            assert_eq!(happened, [kills as usize; 2], "{fault} at {rate_hz} Hz\n{}", run.stderr);
            assert!(!run.stderr.contains("flying on"), "{}", run.stderr);
            if who != "recorder" {
                assert_repeats_as_simulated(&[&fault], &arguments);
            }
        }
    }
}

#[test]
fn a_recorder_that_returns_after_a_while_does_not_hold_the_flight() {
    let run = flown(&["at 1 s restart recorder after 2 s"], "--duration 5");
    assert!(!run.stderr.contains("flying on"), "{}", run.stderr);
    assert_eq!(run.log().states(1).last().unwrap().tick, 500);
}

#[test]
fn a_flight_with_live_faults_repeats_with_them() {
    let run = Swarm::fly("paper-4.1")
        .with("--duration 60 --set requirements={}")
        .fault("at 59 s link 1->2 loss 50 %")
        .start();
    run.wait_for_second(1.0);
    for sentence in
        ["kill uav 3", "link 4->5 delay 200 ms for 2 s", "link 2->5 blackout for 1 s", "heal link 9->9"]
    {
        let (code, answer) = ask(&run, sentence);
        assert_eq!(code == Some(0), !sentence.starts_with("heal"), "{answer}");
        assert_eq!(
            answer.contains("warning: the fault will have no effect"),
            sentence.contains("2->5"),
            "{answer}"
        );
    }
    let run = run.finish();
    assert_eq!(run.summary["flight"]["fault_effects"]["asked"], 4);
    let command = run.text("command");
    for sentence in ["kill uav 3'", "link 4->5 delay 200 ms for 2 s'", "link 2->5 blackout for 1 s'"] {
        assert!(command.contains(sentence), "{command}");
    }
    let again =
        std::process::Command::new("bash").args(["-c", &format!("{command} --json")]).output().unwrap();
    let again: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["payload_hash"], run.summary["payload_hash"]);
    let verified = ringwing().arg("verify").arg(run.log_path()).output().unwrap();
    let output =
        String::from_utf8_lossy(&verified.stdout).into_owned() + &String::from_utf8_lossy(&verified.stderr);
    assert_eq!(verified.status.code(), Some(0), "{output}");
}

#[test]
fn a_fault_that_a_stopped_launcher_applies_late_says_so_and_keeps_its_duration() {
    let run = Swarm::fly("paper-4.1")
        .with("--real-time --duration 8 --set requirements={}")
        .fault("at 2 s freeze uav 5 for 1 s");
    let run = run.start();
    run.wait_for_second(1.5);
    crate::harness::send(run.launcher(), rustix::process::Signal::STOP);
    run.wait_for_second(3.5);
    crate::harness::send(run.launcher(), rustix::process::Signal::CONT);
    let run = run.finish();
    let lines = run.log().lines();
    let late =
        lines.iter().find(|line| line.starts_with("fault.late: ")).expect("a line says how late it came");
    assert!(late.contains(" s late, with its duration kept: freeze uav 5 for 1 s (uav 5)"), "{late}");
    let commanded: Vec<i64> = run.log().controls(5).iter().map(|control| control.tick).collect();
    let gap = commanded.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    assert!((90..=150).contains(&gap), "frozen for {gap} ticks instead of 100");
}

#[test]
fn nobody_alive_is_no_success_and_what_was_not_seen_to_the_end_has_no_recovery_time() {
    let all = flown(&["at 20 s kill all uavs"], "--duration 40 --set requirements={}");
    all.assert_ended_with(3);
    assert_eq!(all.summary["violations"][0], "no UAV flies on command at the end");
    let last = flown(&["at 30 s kill uav 3"], "--duration 30 --law resilient");
    for run in [all, last] {
        assert!(run.summary["recovery_max_s"].is_null(), "{:#}", run.summary);
        assert!(run.summary["flight"]["recoveries"][0]["recovery_s"].is_null());
        let reviewed = ringwing().arg("review").arg(run.log_path()).output().unwrap();
        let table = String::from_utf8(reviewed.stdout).unwrap();
        let line = table.lines().find(|line| line.contains("settled again after a fault"));
        assert!(line.is_some_and(|line| line.contains("not seen to the end")), "{table}");
    }
}

#[test]
fn a_fault_that_somebody_heals_before_its_end_is_healed_once_in_the_log() {
    let run = Swarm::fly("paper-4.1").with("--duration 90").fault("at 1 s link 2->3 hold for 80 s").start();
    run.wait_for_second(2.0);
    for sentence in ["link 4->5 loss 5 % for 50 s", "heal all"] {
        assert_eq!(ask(&run, sentence).0, Some(0), "{sentence}");
    }
    let run = run.finish();
    let lines = run.log().lines();
    let healed: Vec<&String> = lines.iter().filter(|line| line.starts_with("fault.healed")).collect();
    assert_eq!(
        healed,
        ["fault.healed: link 2->3 hold for 80 s", "fault.healed: link 4->5 loss 5 % for 50 s"],
        "{lines:#?}"
    );
}

#[test]
fn a_recorder_killed_by_a_fault_is_replaced_and_the_flight_does_not_change() {
    let run = flown(&["at 3 s kill recorder", "at 5 s freeze recorder for 1 s"], "--duration 10");
    assert_eq!(run.text("payload_hash"), flown(&[], "--duration 10").text("payload_hash"));
    assert_eq!(run.log().states(1).last().unwrap().tick, 1000);
    assert_logged(&run, "fault.kill: recorder is killed: kill recorder");
}

#[test]
fn verify_and_the_printed_command_repeat_a_flight_with_faults() {
    let run = flown(&["at 1 s kill uav 3", "at 2 s isolate 5 for 1 s"], "--duration 6");
    let log = run.log_path();
    let verified = ringwing().arg("verify").arg(&log).output().unwrap();
    assert_eq!(verified.status.code(), Some(0), "{}", String::from_utf8_lossy(&verified.stderr));
    let again = std::process::Command::new("bash")
        .args(["-c", &format!("{} --json", run.text("command"))])
        .output()
        .unwrap();
    let again: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["payload_hash"], run.summary["payload_hash"]);
}

#[test]
fn impossible_faults_are_refused_before_anything_starts() {
    for (sentence, why) in [
        ("kill uav 3", "expected a time first"),
        ("at 3 s kill uav 9", "there is no uav 9"),
        ("at 3 s freeze world for 1 s", "the world keeps time"),
        ("at 3 s link 2->3 delay file \"nowhere.txt\"", "nowhere.txt"),
        ("at 3 s slow uav 3 by 3 s", "set answer_timeout_s to 3.75 s"),
        ("at 3 s link 2->3 gilbert loss 5 % burst 5 ms", "shorter than a tick"),
    ] {
        let output = ringwing().args(["run", "paper-4.1", "--fault", sentence]).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && stderr.contains(why), "{sentence}: {stderr}");
    }
}

#[test]
fn completion_prints_a_script_for_each_shell() {
    for shell in ["bash", "zsh", "fish"] {
        let output = ringwing().args(["completion", shell]).output().unwrap();
        let script = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success() && script.contains("COMPLETE") && script.contains("ringwing"),
            "{script}"
        );
    }
}
