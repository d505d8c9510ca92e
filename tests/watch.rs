//! The terminal view of a live run and of a log, driven through a pseudo-terminal as a person drives it.

use crate::harness::{Running, Swarm, send, terminal::Terminal};
use rustix::process::Signal;

/// A terminal that watches `run`.
fn watch(run: &Running, columns: u16, rows: u16) -> Terminal {
    Terminal::start(&["watch", &run.domain().id().to_string()], columns, rows, &[])
}

/// A flight in lockstep that is not over before it is paused.
fn lockstep() -> Running {
    let run = Swarm::fly("paper-4.2").fault("at 1 s slow uav 3 by 100 ms for 100 s").start();
    run.wait_for_second(1.2);
    run
}

/// The tick in a screen that shows `paused before tick N`.
fn paused_tick(screen: &str) -> Option<i64> {
    screen.split("paused before tick ").nth(1)?.split(' ').next()?.parse().ok()
}

#[test]
fn a_lockstep_run_is_paused_stepped_and_given_a_fault() {
    let run = lockstep();
    let mut terminal = watch(&run, 80, 24);
    let shown = terminal.wait_for("six UAVs fly", |screen| screen.contains("6 of 6 fly"));
    for text in ["paper-4.2, paper law", "  3 commanded", "slot error", "closest", "data age", "q quit"] {
        assert!(shown.contains(text), "no {text:?} in\n{shown}");
    }
    assert!(terminal.has_colours());
    terminal.type_keys("p");
    let before =
        paused_tick(&terminal.wait_for("it is paused", |screen| paused_tick(screen).is_some())).unwrap();
    terminal.type_keys("s");
    terminal.wait_for("it has stepped", |screen| paused_tick(screen) == Some(before + 1));
    terminal.type_keys("S");
    terminal.wait_for("it has stepped a second", |screen| paused_tick(screen) == Some(before + 101));
    // A fault that is not confirmed is not sent.
    terminal.type_keys("fkill uav 4\r");
    terminal.wait_for("it asks", |screen| screen.contains("send \"kill uav 4\" to the run? y/n"));
    terminal.type_keys("n");
    terminal.type_keys("fkill uav 5\r");
    terminal.wait_for("it asks", |screen| screen.contains("send \"kill uav 5\" to the run? y/n"));
    terminal.type_keys("y");
    let answer = format!("tick {}, ", before + 101);
    terminal.wait_for("the run has answered", |screen| {
        screen.lines().any(|line| line.starts_with(&answer) && line.contains("kill uav 5"))
    });
    terminal.type_keys("p");
    terminal.wait_for("the fault is an event", |screen| screen.contains("uav 5 is killed"));
    terminal.type_keys("q");
    assert!(terminal.wait_for_end().success());
    send(run.launcher(), Signal::INT);
    let lines = run.finish().log().lines();
    assert!(lines.iter().any(|line| line.contains("uav 5 is killed")), "{lines:#?}");
    assert!(!lines.iter().any(|line| line.contains("uav 4 is killed")), "{lines:#?}");
}

#[test]
fn the_terminal_is_given_back_when_the_run_is_killed_when_watch_is_terminated_and_at_ctrl_c() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").start();
    run.wait_for_second(0.2);
    let mut terminals = [0, 1, 2].map(|_| watch(&run, 100, 30));
    for terminal in &terminals {
        terminal.wait_for("six UAVs fly", |screen| screen.contains("6 of 6 fly"));
    }
    send(terminals[0].process(), Signal::TERM);
    assert!(terminals[0].wait_for_end().success());
    terminals[1].type_keys("\u{3}");
    assert!(terminals[1].wait_for_end().success());
    send(run.launcher(), Signal::KILL);
    assert!(terminals[2].wait_for_end().success());
    terminals[2].wait_for("it says why", |screen| screen.contains("the run is over; tick "));
    drop(run);
}

#[test]
fn watchers_that_were_killed_leave_their_places_to_others() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").start();
    run.wait_for_second(0.2);
    for _ in 0..7 {
        let terminal = watch(&run, 80, 24);
        terminal.wait_for("six UAVs fly", |screen| screen.contains("6 of 6 fly"));
        send(terminal.process(), Signal::KILL);
    }
}

#[test]
fn a_real_time_run_refuses_to_pause_and_the_picture_follows_the_size_of_the_terminal() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600 --uavs 14").start();
    run.wait_for_second(0.2);
    let id = run.domain().id().to_string();
    let mut terminal = Terminal::start(&["watch", &id], 80, 24, &[("NO_COLOR", "1")]);
    terminal.wait_for("fourteen UAVs fly", |screen| screen.contains("14 of 14 fly"));
    assert!(!terminal.has_colours());
    terminal.type_keys("p");
    terminal.wait_for("it is refused", |screen| screen.contains("refused: a flight in real time follows"));
    assert!(!terminal.text().contains(" 14 commanded"), "24 rows show fewer UAVs");
    terminal.resize(120, 50);
    terminal.wait_for("all UAVs have a row", |screen| screen.contains(" 14 commanded"));
    terminal.resize(40, 10);
    terminal.wait_for("it is too small", |screen| screen.contains("make the terminal larger"));
    terminal.type_keys("q");
    assert!(terminal.wait_for_end().success());
}

#[test]
fn a_log_is_watched_with_pauses_steps_and_speeds_and_takes_no_faults() {
    let run = Swarm::fly("dropout").with("--law resilient --duration 40").finish();
    let mut terminal = Terminal::start(&["watch", run.folder.to_str().unwrap()], 80, 24, &[]);
    terminal.wait_for("it plays", |screen| screen.contains("log, 1x") && screen.contains("6 of 6 fly"));
    terminal.type_keys("++++++");
    terminal.wait_for("it plays to its end", |screen| screen.contains("log, at its end"));
    let shown = terminal.text();
    assert!(
        shown.contains("5 of 6 fly") && shown.contains("uav 3 is killed") && shown.contains("tick 4000"),
        "{shown}"
    );
    terminal.type_keys("fkill uav 1\ry");
    terminal.wait_for("it is refused", |screen| screen.contains("only a live run takes faults"));
    terminal.type_keys("q");
    assert!(terminal.wait_for_end().success());

    let mut terminal = Terminal::start(&["watch", run.folder.to_str().unwrap()], 80, 24, &[]);
    terminal.wait_for("it plays", |screen| screen.contains("6 of 6 fly"));
    terminal.type_keys(" ");
    let tick = |screen: &str| -> i64 {
        screen.split(", tick ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap()
    };
    let before = tick(&terminal.wait_for("it is paused", |screen| screen.contains("log, paused")));
    terminal.type_keys("s");
    terminal.wait_for("it has stepped", |screen| tick(screen) == before + 1);
    terminal.type_keys("q");
    assert!(terminal.wait_for_end().success());
}

#[test]
fn without_a_terminal_watch_says_what_it_needs() {
    let output = crate::harness::ringwing().arg("watch").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("watch needs a terminal"));
}
