use super::*;

const AGENT: Part = Part::Agent(UavId(3));

fn lost(part: Part, end: ProcessEnd, then: AfterLoss) -> Event {
    Event::ProcessLost { part, end, then }
}

fn fault(action: ProcessAction, sentence: &str) -> Event {
    Event::ProcessFault { part: AGENT, action, sentence: sentence.into() }
}

fn gap(first: i64, last: i64, cause: GapCause) -> Event {
    Event::RecorderGap { first_tick: Tick(first), last_tick: Tick(last), cause }
}

fn refused(part: Option<Part>, why: &str) -> Event {
    Event::FaultRefused { part, why: why.into(), sentence: "thaw uav 3".into() }
}

/// One event of each kind, with whatever else changes its text or level.
fn one_of_each() -> Vec<Event> {
    let (failsafe, early) =
        (AfterLoss::Failsafe { before_flight: false }, AfterLoss::Failsafe { before_flight: true });
    let position_m = [1.04, -2.0];
    let link = || "link 2->3 loss 30 % for 2 s".to_owned();
    vec![
        Event::Collision { uav: UavId(3), with: Collider::Uav(UavId(5)), position_m },
        Event::Collision { uav: UavId(3), with: Collider::Obstacle(1), position_m },
        Event::Collision { uav: UavId(3), with: Collider::Intruder(IntruderId(2)), position_m },
        Event::NearMiss {
            uav: UavId(3),
            with: Collider::Uav(UavId(5)),
            distance_m: 7.26,
            position_m,
            closest: Tick(5),
        },
        Event::Failsafe { uav: UavId(3), mode: FlightMode::LOITER },
        lost(AGENT, ProcessEnd::Killed(9), failsafe),
        lost(AGENT, ProcessEnd::Exited(1), early),
        lost(Part::Leader, ProcessEnd::Exited(0), AfterLoss::Replaced),
        lost(Part::Recorder, ProcessEnd::Unknown, AfterLoss::Replaced),
        lost(Part::World, ProcessEnd::Killed(11), AfterLoss::RunEnds),
        Event::ProcessReady { part: Part::Leader },
        Event::ProcessFrozen { part: AGENT },
        Event::ProcessThawed { part: AGENT },
        Event::StartOverdue { part: AGENT },
        Event::ThawOverdue { part: Part::Leader },
        Event::WishNotFinite { uav: UavId(3) },
        Event::NoteRefused { uav: UavId(3), name: "slot error".into(), why: NoteRefusal::Name },
        Event::NoteRefused { uav: UavId(3), name: "slot_error_m".into(), why: NoteRefusal::TooMany },
        Event::ProcessSilent { part: AGENT, waited_s: 0.25 },
        Event::ReplacementOverdue,
        Event::RecorderSilent,
        gap(4, 4, GapCause::StartedLate),
        gap(4, 5, GapCause::LostWithPredecessor),
        gap(4, 5, GapCause::FellBehind),
        Event::ConnectionsFailed { count: 2 },
        Event::RunInterrupted,
        Event::RunPaused { seconds: 3.25 },
        fault(ProcessAction::Kill { returns: false }, "kill uav 3"),
        fault(ProcessAction::Stop, "stop uav 3"),
        fault(ProcessAction::Freeze, "freeze uav 3"),
        fault(ProcessAction::Thaw, "thaw uav 3"),
        fault(ProcessAction::Start, "start uav 3"),
        refused(Some(AGENT), "is not frozen"),
        refused(None, "there is no uav 9"),
        Event::FaultRequested { sentence: "at 5 s kill uav 3".into() },
        Event::FaultOverdue,
        Event::FaultLate { part: AGENT, late_s: 1.5, sentence: "freeze uav 3 for 2 s".into() },
        Event::LinkFault { sentence: link() },
        Event::SlowFault { sentence: "slow uav 3 by 25 ms".into() },
        Event::AirframeFault { sentence: "weaken uav 3 to 14 m/s".into() },
        Event::FaultHealed { sentence: link() },
    ]
}

/// `!` by chance, `~` a disturbance; then the level, the name and the text.
fn described(event: &Event) -> String {
    let chance = if event.is_by_chance() { '!' } else { ' ' };
    let disturbance = if event.is_disturbance() { '~' } else { ' ' };
    let text = event.text(|index| format!("obstacle {index}"));
    format!("{chance}{disturbance}{:?} {}: {text}", event.level(), event.name())
}

#[test]
fn every_event_has_its_level_name_and_text() {
    let expected = "
         |  Error collision: uav 3 and uav 5 at (1.0, -2.0) m
         |  Error collision: uav 3 and obstacle 1 at (1.0, -2.0) m
         |  Error collision: uav 3 and intruder 2 at (1.0, -2.0) m
         |  Warning near miss: uav 3 and uav 5 passed at 7.3 m, at (1.0, -2.0) m
         |  Warning failsafe: uav 3 flies without its agent: loiter
         |!~Error process.lost: uav 3 was killed by signal 9; its airframe goes into its failsafe
         |!~Error process.lost: uav 3 gave up (exit status 1) before the flight; its airframe goes into its failsafe
         |!~Error process.lost: the leader has exited; a new one takes over
         |  Error process.lost: the recorder has ended; a new one takes over
         |!~Error process.lost: the world was killed by signal 11; the run ends
         |! Info process.ready: leader is ready
         |!~Warning process.frozen: uav 3 is frozen (SIGSTOP)
         |! Info process.thawed: uav 3 is thawed (SIGCONT)
         |! Error process.overdue: uav 3 was not ready in time; killed: raise supervision.start_timeout_s
         |! Error process.overdue: leader stayed frozen for too long; killed: raise supervision.answer_timeout_s
         |  Error controller.not_finite: uav 3 has a controller whose wish is not a finite number; such a command is withheld
         |  Warning controller.note: the note \"slot error\" of uav 3 is not recorded: a name has 1 to 32 letters (a to z, A to Z), digits and underscores, begins with a letter, and is not tick, time_s, uav
         |  Warning controller.note: the note \"slot_error_m\" of uav 3 is not recorded: a controller may note at most 16 numbers in a tick
         |! Warning process.silent: uav 3 has not answered for 0.2 s; flying on: raise supervision.answer_timeout_s if it is only slow
         |! Warning process.silent: no replacement was ready in time; flying on: raise supervision.start_timeout_s
         |  Warning recorder.silent: the recorder has stopped reading; flying on
         |  Warning recorder.gap: tick 4 was lost before the recorder joined
         |  Warning recorder.gap: ticks 4 to 5 were lost with the recorder's predecessor
         |  Warning recorder.gap: ticks 4 to 5 were lost: the recorder fell behind
         |! Error ipc.connection: 2 connections of the world failed; is `ulimit -n` large enough?
         |! Warning run.interrupted: interrupted; ending the flight (interrupt again to kill it)
         |! Warning run.paused: the run stood still for 3.2 s
         | ~Warning fault.kill: uav 3 is killed: kill uav 3
         | ~Warning fault.stop: uav 3 is stopped: stop uav 3
         | ~Warning fault.freeze: uav 3 is frozen: freeze uav 3
         | ~Info fault.thaw: uav 3 is thawed: thaw uav 3
         | ~Info fault.start: uav 3 is started: start uav 3
         |  Warning fault.refused: uav 3 is not frozen: thaw uav 3
         |  Warning fault.refused: there is no uav 9: thaw uav 3
         |  Info fault.requested: at 5 s kill uav 3
         |! Warning fault.overdue: a fault was not applied in time; flying on: raise supervision.start_timeout_s
         |! Warning fault.late: 1.50 s late, with its duration kept: freeze uav 3 for 2 s (uav 3)
         | ~Info fault.link: link 2->3 loss 30 % for 2 s
         | ~Info fault.slow: slow uav 3 by 25 ms
         | ~Info fault.airframe: weaken uav 3 to 14 m/s
         |  Info fault.healed: link 2->3 loss 30 % for 2 s";
    let expected: Vec<&str> =
        expected.lines().filter_map(|line| line.split_once('|').map(|(_, text)| text)).collect();
    let described: Vec<String> = one_of_each().iter().map(described).collect();
    assert_eq!(described, expected);
}

#[test]
fn what_happens_to_the_recorder_alone_is_never_by_chance() {
    for event in [
        lost(Part::Recorder, ProcessEnd::Killed(9), AfterLoss::Replaced),
        Event::ProcessReady { part: Part::Recorder },
        Event::ProcessFrozen { part: Part::Recorder },
        Event::ProcessThawed { part: Part::Recorder },
        Event::StartOverdue { part: Part::Recorder },
        Event::ProcessSilent { part: Part::Recorder, waited_s: 1.0 },
    ] {
        assert!(!event.is_by_chance(), "{event:?}");
    }
}

#[test]
fn a_log_that_tells_of_its_recorder_cannot_be_repeated() {
    for event in one_of_each() {
        let is_about_recorder = event.name().starts_with("recorder.")
            || matches!(event, Event::ProcessLost { part: Part::Recorder, .. });
        assert_eq!(event.makes_log_unrepeatable(), event.is_by_chance() || is_about_recorder, "{event:?}");
    }
}

#[test]
fn lockstep_is_broken_where_the_flight_went_on_without_waiting() {
    let broken: Vec<Event> = one_of_each().into_iter().filter(Event::breaks_lockstep).collect();
    let silent = Event::ProcessSilent { part: AGENT, waited_s: 0.25 };
    let overdue = [Event::ReplacementOverdue, Event::ConnectionsFailed { count: 2 }, Event::FaultOverdue];
    assert_eq!(broken, [vec![silent], overdue.to_vec()].concat());
    assert!(!Event::ProcessSilent { part: Part::Recorder, waited_s: 0.25 }.breaks_lockstep());
}

#[test]
fn the_cause_of_an_end_names_the_signal() {
    let causes = [
        (ProcessEnd::Killed(9), "killed by signal 9 (SIGKILL)"),
        (ProcessEnd::Killed(7), "killed by signal 7 (SIGBUS)"),
        (ProcessEnd::Killed(40), "killed by signal 40"),
        (ProcessEnd::Exited(3), "exited with status 3"),
        (ProcessEnd::Unknown, "ended; started by hand, so its exit status is unknown"),
    ];
    for (end, cause) in causes {
        assert_eq!(end.cause(), cause);
    }
}

#[test]
fn every_event_arrives_as_it_was_sent() {
    for event in one_of_each() {
        let sent = TimedEvent { tick: Tick(7), event };
        assert_eq!(crate::EventMessage::new(&sent).event(), Some(sent));
    }
}
