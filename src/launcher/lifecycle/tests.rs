use super::*;
use proptest::prelude::*;
use ringwing_flight::UavId;

const AGENT: Part = Part::Agent(UavId(3));
const LIMITS: SupervisionLimits =
    SupervisionLimits { start: Duration::from_secs(10), freeze: Duration::from_secs(2), replacements: 2 };
const KILLED: ProcessEnd = ProcessEnd::Killed(9);
const KILL: ProcessAction = ProcessAction::Kill { returns: false };

/// A process with its inputs at a clock that the test sets.
struct Bench {
    process: Lifecycle,
    now: Duration,
    stage: RunStage,
}

impl Bench {
    fn of(part: Part) -> Self {
        let process = Lifecycle::new(part, LIMITS, false);
        Self { process, now: Duration::ZERO, stage: RunStage::Flying }
    }

    /// A process of the run that was spawned as 7 and is ready.
    fn ready(part: Part) -> Self {
        let mut bench = Self::of(part);
        bench.stage = RunStage::Preparing;
        bench.on(Input::Spawned { pid: 7 });
        bench.on(Input::Ready { pid: 7 });
        bench.stage = RunStage::Flying;
        bench
    }

    fn frozen_by_fault(part: Part) -> Self {
        let mut bench = Self::ready(part);
        bench.ask(ProcessAction::Freeze);
        bench.on(Input::Stopped);
        bench
    }

    /// A process that somebody outside the run has stopped, for so long that the run has taken note.
    fn frozen_by_accident(part: Part) -> Self {
        let mut bench = Self::ready(part);
        assert_eq!(bench.on(Input::Stopped), []);
        bench.now += STOP_GRACE + Duration::from_millis(1);
        let frozen = Event::ProcessFrozen { part };
        assert_eq!(bench.on(Input::ClockTicked), [Effect::Log(frozen), Effect::PublishRoster]);
        bench
    }

    fn on(&mut self, input: Input) -> Vec<Effect> {
        self.process.on(input, self.now, self.stage)
    }

    fn ask(&mut self, action: ProcessAction) -> Vec<Effect> {
        self.on(Input::Asked(action))
    }
}

fn signal(signal: ProcessSignal) -> Effect {
    Effect::Signal { pid: 7, signal }
}

fn planned_cleanup() -> Effect {
    Effect::CleanUp { is_planned: true }
}

fn cleanup() -> Effect {
    Effect::CleanUp { is_planned: false }
}

#[test]
fn a_process_takes_part_once_it_is_ready() {
    let mut bench = Bench::of(AGENT);
    assert!(!bench.process.is_starting() && bench.process.pid().is_none());
    assert_eq!(bench.on(Input::Spawned { pid: 7 }), []);
    assert!(bench.process.is_starting() && !bench.process.is_running());
    assert_eq!(bench.process.expects(), Attendant::Child(7));
    let ready = Event::ProcessReady { part: AGENT };
    assert_eq!(bench.on(Input::Ready { pid: 7 }), [Effect::Log(ready), Effect::PublishRoster]);
    assert!(bench.process.is_running() && !bench.process.is_starting());
    assert_eq!(bench.process.expects(), Attendant::Nobody);
}

#[test]
fn before_the_flight_a_ready_process_is_no_news() {
    let mut bench = Bench::of(AGENT);
    bench.stage = RunStage::Preparing;
    bench.on(Input::Spawned { pid: 7 });
    assert_eq!(bench.on(Input::Ready { pid: 7 }), [Effect::PublishRoster]);
}

#[test]
fn a_process_started_by_hand_is_awaited_without_limit_adopted_and_watched() {
    let mut bench = Bench::of(AGENT);
    bench.process = Lifecycle::new(AGENT, LIMITS, true);
    assert!(bench.process.is_starting());
    assert_eq!(bench.process.expects(), Attendant::Stranger);
    bench.now = LIMITS.start * 100;
    assert_eq!(bench.on(Input::ClockTicked), []);
    let effects = bench.on(Input::Ready { pid: 9 });
    assert_eq!(effects.first(), Some(&Effect::Watch { pid: 9 }));
    assert!(bench.process.is_running());
    assert_eq!(
        bench.process.refusal(ProcessAction::Freeze),
        Some("was started by hand, so the launcher cannot see it freeze")
    );
    bench.on(Input::Ended(ProcessEnd::Unknown));
    assert_eq!(bench.process.refusal(ProcessAction::Start), Some("is started by hand"));
}

#[test]
fn what_a_fault_asked_of_a_process_does_not_concern_the_stranger_who_takes_its_place() {
    let mut bench = Bench::ready(AGENT);
    bench.ask(KILL);
    bench.on(Input::Ended(KILLED));
    bench.on(Input::Ready { pid: 9 });
    let then = AfterLoss::Failsafe { before_flight: false };
    let lost = Event::ProcessLost { part: AGENT, end: ProcessEnd::Unknown, then };
    assert!(bench.on(Input::Ended(ProcessEnd::Unknown)).contains(&Effect::Log(lost)));
}

#[test]
fn a_fault_kills_stops_freezes_and_thaws_by_signal() {
    for (action, sent) in [
        (KILL, ProcessSignal::Kill),
        (ProcessAction::Stop, ProcessSignal::Terminate),
        (ProcessAction::Freeze, ProcessSignal::Stop),
    ] {
        assert_eq!(Bench::ready(AGENT).ask(action), [signal(sent)]);
    }
    let mut frozen = Bench::frozen_by_fault(AGENT);
    assert_eq!(frozen.ask(ProcessAction::Thaw), [signal(ProcessSignal::Continue)]);
}

#[test]
fn an_agent_that_a_fault_kills_or_stops_stays_away_without_an_alarm() {
    for action in [KILL, ProcessAction::Stop, ProcessAction::Kill { returns: true }] {
        let mut bench = Bench::ready(AGENT);
        bench.ask(action);
        assert!(bench.process.has_pending_action());
        assert_eq!(bench.on(Input::Ended(KILLED)), [planned_cleanup(), Effect::PublishRoster]);
        assert!(!bench.process.has_pending_action() && bench.process.pid().is_none());
    }
}

#[test]
fn a_frozen_process_is_left_out_and_a_thawed_one_is_taken_back() {
    let mut bench = Bench::ready(AGENT);
    bench.ask(ProcessAction::Freeze);
    assert!(bench.process.is_running(), "until the kernel reports that it is stopped");
    assert_eq!(bench.on(Input::Stopped), [Effect::PublishRoster]);
    assert!(bench.process.is_frozen() && !bench.process.is_running() && !bench.process.has_pending_action());
    bench.ask(ProcessAction::Thaw);
    assert!(bench.process.is_frozen() && bench.process.has_pending_action());
    assert_eq!(bench.on(Input::Continued), [Effect::PublishRoster]);
    assert!(bench.process.is_running() && !bench.process.has_pending_action());
}

#[test]
fn a_freeze_or_thaw_that_no_fault_asked_for_is_logged() {
    let mut bench = Bench::frozen_by_accident(AGENT);
    assert!(bench.process.is_frozen() && !bench.process.is_running());
    let thawed = Event::ProcessThawed { part: AGENT };
    assert_eq!(bench.on(Input::Continued), [Effect::Log(thawed), Effect::PublishRoster]);
    assert!(bench.process.is_running());
}

#[test]
fn a_process_that_is_stopped_for_a_moment_stays_on_the_roster() {
    let mut bench = Bench::ready(AGENT);
    assert_eq!(bench.on(Input::Stopped), []);
    assert!(bench.process.is_running() && !bench.process.is_frozen());
    assert_eq!(bench.process.refusal(ProcessAction::Freeze), Some("is frozen already"));
    bench.now += STOP_GRACE;
    assert_eq!(bench.on(Input::ClockTicked), []);
    assert_eq!(bench.on(Input::Continued), []);
    bench.now += STOP_GRACE * 100;
    assert_eq!(bench.on(Input::ClockTicked), []);
    assert!(bench.process.is_running());
}

#[test]
fn a_fault_thaws_a_process_that_was_stopped_a_moment_ago() {
    let mut bench = Bench::ready(AGENT);
    bench.on(Input::Stopped);
    assert_eq!(bench.ask(ProcessAction::Thaw), [signal(ProcessSignal::Continue)]);
    assert_eq!(bench.on(Input::Continued), []);
    assert!(bench.process.is_running() && !bench.process.has_pending_action());
}

#[test]
fn a_fault_starts_a_killed_process_again() {
    let mut bench = Bench::frozen_by_fault(AGENT);
    bench.ask(ProcessAction::Thaw);
    bench.on(Input::Continued);
    bench.ask(ProcessAction::Kill { returns: true });
    bench.on(Input::Ended(KILLED));
    assert_eq!(bench.ask(ProcessAction::Start), [Effect::Spawn]);
    bench.on(Input::Spawned { pid: 8 });
    assert!(bench.process.has_pending_action());
    assert_eq!(
        bench.on(Input::Ready { pid: 8 }),
        [Effect::PublishRoster],
        "logged as the fault, not as news"
    );
    assert!(bench.process.is_running() && !bench.process.has_pending_action());
}

#[test]
fn a_start_that_fails_no_longer_waits() {
    let mut bench = Bench::ready(AGENT);
    bench.ask(ProcessAction::Kill { returns: true });
    bench.on(Input::Ended(KILLED));
    bench.ask(ProcessAction::Start);
    bench.on(Input::Spawned { pid: 8 });
    bench.on(Input::Ended(ProcessEnd::Exited(1)));
    assert!(!bench.process.has_pending_action() && bench.process.pid().is_none());
}

#[test]
fn what_cannot_be_done_is_refused_with_the_reason() {
    let start = ProcessAction::Start;
    let gone = Bench::of(AGENT).process;
    for action in [KILL, ProcessAction::Stop, ProcessAction::Freeze, ProcessAction::Thaw] {
        assert_eq!(gone.refusal(action), Some("is gone already"));
    }
    assert_eq!(gone.refusal(start), None);
    let ready = Bench::ready(AGENT).process;
    assert_eq!(ready.refusal(start), Some("is there already"));
    assert_eq!(ready.refusal(ProcessAction::Thaw), Some("is not frozen"));
    assert_eq!(ready.refusal(ProcessAction::Freeze), None);
    let frozen = Bench::frozen_by_fault(AGENT).process;
    assert_eq!(frozen.refusal(start), Some("is there already"));
    assert_eq!(frozen.refusal(ProcessAction::Freeze), Some("is frozen already"));
    assert_eq!(frozen.refusal(ProcessAction::Stop), Some("is frozen: thaw or kill it"));
    assert_eq!((frozen.refusal(KILL), frozen.refusal(ProcessAction::Thaw)), (None, None));
}

#[test]
fn the_same_action_twice_in_one_batch_is_settled_by_one_end() {
    let mut bench = Bench::ready(AGENT);
    bench.ask(KILL);
    assert_eq!(bench.ask(KILL), [signal(ProcessSignal::Kill)]);
    bench.on(Input::Ended(KILLED));
    assert!(!bench.process.has_pending_action());
}

#[test]
fn a_lost_agent_leaves_its_airframe_to_the_failsafe() {
    for (mut bench, before_flight) in [(Bench::ready(AGENT), false), (Bench::of(AGENT), true)] {
        if before_flight {
            bench.on(Input::Spawned { pid: 7 });
        }
        let then = AfterLoss::Failsafe { before_flight };
        let lost = Event::ProcessLost { part: AGENT, end: KILLED, then };
        assert_eq!(bench.on(Input::Ended(KILLED)), [cleanup(), Effect::Log(lost), Effect::PublishRoster]);
        assert!(!bench.process.is_starting());
    }
}

#[test]
fn a_lost_leader_is_replaced_and_holds_the_flight_until_its_successor_is_ready() {
    let mut bench = Bench::ready(Part::Leader);
    assert!(!bench.process.holds_flight());
    let lost = Event::ProcessLost { part: Part::Leader, end: KILLED, then: AfterLoss::Replaced };
    assert_eq!(
        bench.on(Input::Ended(KILLED)),
        [cleanup(), Effect::Log(lost), Effect::Spawn, Effect::PublishRoster]
    );
    assert!(bench.process.holds_flight());
    bench.on(Input::Spawned { pid: 8 });
    assert!(bench.process.holds_flight());
    bench.on(Input::Ready { pid: 8 });
    assert!(!bench.process.holds_flight());
}

#[test]
fn a_leader_that_was_replaced_too_often_ends_the_run() {
    let mut bench = Bench::ready(Part::Leader);
    for pid in 8..10 {
        bench.on(Input::Ended(KILLED));
        bench.on(Input::Spawned { pid });
    }
    let why = "the leader was killed by signal 9, after 2 replacements";
    let lost = Event::ProcessLost { part: Part::Leader, end: KILLED, then: AfterLoss::RunEnds };
    assert_eq!(bench.on(Input::Ended(KILLED)), [cleanup(), Effect::Log(lost), Effect::EndRun(why.into())]);
}

#[test]
fn a_leader_that_a_fault_took_away_is_neither_replaced_nor_waited_for() {
    let mut bench = Bench::frozen_by_fault(Part::Leader);
    assert!(!bench.process.holds_flight());
    bench.ask(KILL);
    assert_eq!(bench.on(Input::Ended(KILLED)), [planned_cleanup(), Effect::PublishRoster]);
    assert!(!bench.process.holds_flight());
}

#[test]
fn a_frozen_leader_that_dies_by_accident_is_replaced() {
    let mut bench = Bench::frozen_by_fault(Part::Leader);
    assert!(bench.on(Input::Ended(KILLED)).contains(&Effect::Spawn));
    assert!(bench.process.holds_flight());
}

#[test]
fn a_recorder_that_a_fault_ends_is_replaced_unless_the_fault_restarts_it() {
    for action in [KILL, ProcessAction::Stop] {
        let mut bench = Bench::ready(Part::Recorder);
        bench.ask(action);
        let respawned = [planned_cleanup(), Effect::Spawn, Effect::PublishRoster];
        assert_eq!(bench.on(Input::Ended(KILLED)), respawned);
        bench.on(Input::Spawned { pid: 8 });
        assert!(bench.process.holds_flight() && !bench.process.has_pending_action());
    }
    let mut bench = Bench::ready(Part::Recorder);
    bench.ask(ProcessAction::Kill { returns: true });
    assert_eq!(bench.on(Input::Ended(KILLED)), [planned_cleanup(), Effect::PublishRoster]);
    assert!(!bench.process.holds_flight());
}

#[test]
fn a_recorder_that_gives_up_fails_the_run_and_lets_it_fly_on() {
    let mut bench = Bench::ready(Part::Recorder);
    let why = "the recorder gave up (exit status 1): the log is incomplete";
    let effects = [cleanup(), Effect::FailAtEnd(why.into()), Effect::PublishRoster];
    assert_eq!(bench.on(Input::Ended(ProcessEnd::Exited(1))), effects);
}

#[test]
fn a_recorder_frozen_by_accident_is_waited_for_and_one_frozen_by_a_fault_is_not() {
    assert!(Bench::frozen_by_accident(Part::Recorder).process.is_reading());
    assert!(!Bench::frozen_by_fault(Part::Recorder).process.is_reading());
}

#[test]
fn the_end_of_the_world_is_the_end_of_the_run() {
    let mut bench = Bench::ready(Part::World);
    let ends_run = Effect::EndRun("the world was killed by signal 9".into());
    let lost = Effect::Log(Event::ProcessLost { part: Part::World, end: KILLED, then: AfterLoss::RunEnds });
    assert_eq!(bench.on(Input::Ended(KILLED)), [cleanup(), lost, ends_run, Effect::PublishRoster]);
    let mut bench = Bench::ready(Part::World);
    bench.ask(KILL);
    let effects = bench.on(Input::Ended(KILLED));
    let [_, Effect::EndRun(why), _] = effects.as_slice() else { panic!("{effects:?}") };
    assert_eq!(why, "the world was ended as asked: the flight did not come to its end");
}

#[test]
fn after_the_flight_an_end_is_no_loss_unless_the_recorder_fails() {
    for part in [Part::World, Part::Leader, AGENT] {
        let mut bench = Bench::ready(part);
        bench.stage = RunStage::Over;
        assert_eq!(bench.on(Input::Ended(KILLED)), [cleanup()], "{part}");
    }
    for (end, fails) in [(ProcessEnd::Exited(0), false), (ProcessEnd::Exited(1), true), (KILLED, true)] {
        let mut bench = Bench::ready(Part::Recorder);
        bench.stage = RunStage::Over;
        let effects = bench.on(Input::Ended(end));
        assert_eq!(matches!(effects.as_slice(), [_, Effect::FailAtEnd(_)]), fails, "{end:?}");
    }
}

#[test]
fn a_start_that_takes_too_long_is_killed_once() {
    let mut bench = Bench::of(AGENT);
    bench.on(Input::Spawned { pid: 7 });
    bench.now = LIMITS.start;
    assert_eq!(bench.on(Input::ClockTicked), []);
    bench.now += Duration::from_millis(1);
    let overdue = Effect::Log(Event::StartOverdue { part: AGENT });
    assert_eq!(bench.on(Input::ClockTicked), [signal(ProcessSignal::Kill), overdue]);
    bench.now += Duration::from_millis(1);
    assert_eq!(bench.on(Input::ClockTicked), [], "the kernel is given time to end it");
}

#[test]
fn a_recorder_that_takes_over_may_take_longer_to_start() {
    let mut bench = Bench::ready(Part::Recorder);
    bench.on(Input::Ended(KILLED));
    bench.on(Input::Spawned { pid: 7 });
    bench.now = LIMITS.start * START_LIMITS_PER_COPY;
    assert_eq!(bench.on(Input::ClockTicked), []);
    bench.now += Duration::from_millis(1);
    assert_ne!(bench.on(Input::ClockTicked), []);
}

#[test]
fn only_a_world_or_leader_that_is_frozen_by_accident_is_killed_for_it() {
    for (part, is_needed) in
        [(Part::World, true), (Part::Leader, true), (Part::Recorder, false), (AGENT, false)]
    {
        let mut bench = Bench::frozen_by_accident(part);
        bench.now = LIMITS.freeze + Duration::from_millis(1);
        assert_eq!(!bench.on(Input::ClockTicked).is_empty(), is_needed, "{part}");
    }
    let mut asked = Bench::frozen_by_fault(Part::Leader);
    asked.now = LIMITS.freeze * 100;
    assert_eq!(asked.on(Input::ClockTicked), []);
}

#[test]
fn a_process_that_is_gone_needs_no_kill() {
    assert_eq!(Bench::ready(AGENT).on(Input::Killed), [signal(ProcessSignal::Kill)]);
    assert_eq!(Bench::of(AGENT).on(Input::Killed), []);
}

#[test]
#[should_panic(expected = "is refused")]
fn a_refused_action_must_not_be_applied() {
    Bench::of(AGENT).ask(KILL);
}

#[test]
#[should_panic(expected = "spawned beside a process that lives")]
fn two_processes_never_have_one_place() {
    Bench::ready(AGENT).on(Input::Spawned { pid: 8 });
}

/// What may happen next, as a number that is read for the state at hand.
fn any_step() -> impl Strategy<Value = (u8, u64)> {
    (0_u8..13, 0_u64..15_000)
}

/// The input that `choice` stands for, if this process can have it.
fn possible_input(process: &Lifecycle, choice: u8, pid: u32) -> Option<Input> {
    let asked = |action| process.refusal(action).is_none().then_some(Input::Asked(action));
    let lives = process.pid().is_some();
    match choice {
        0 => match process.expects() {
            Attendant::Child(pid) => Some(Input::Ready { pid }),
            Attendant::Stranger => Some(Input::Ready { pid }),
            Attendant::Nobody => None,
        },
        1 => lives.then_some(Input::Stopped),
        2 => lives.then_some(Input::Continued),
        3 => lives.then_some(Input::Ended(KILLED)),
        4 => lives.then_some(Input::Ended(ProcessEnd::Exited(0))),
        5 => asked(KILL),
        6 => asked(ProcessAction::Kill { returns: true }),
        7 => asked(ProcessAction::Stop),
        8 => asked(ProcessAction::Freeze),
        9 => asked(ProcessAction::Thaw),
        10 => asked(ProcessAction::Start),
        11 => Some(Input::Killed),
        _ => Some(Input::ClockTicked),
    }
}

/// What must hold between a process before an input, its effects, and the process after them.
fn assert_possible(before: &Lifecycle, effects: &[Effect], after: &Lifecycle) {
    assert!(after.pid().is_some() || !(after.is_running() || after.is_frozen() || after.is_reading()));
    assert!(!(after.is_running() && after.is_frozen()));
    for effect in effects {
        match effect {
            Effect::Signal { pid, .. } => assert_eq!(before.pid(), Some(*pid), "only its own process"),
            Effect::Spawn => assert_eq!(after.pid(), None, "nobody is spawned beside a living process"),
            Effect::Watch { pid } => assert_eq!(after.pid(), Some(*pid)),
            Effect::CleanUp { .. } => assert!(before.pid().is_some() && after.pid().is_none()),
            Effect::EndRun(_) | Effect::FailAtEnd(_) => assert_eq!(after.pid(), None),
            Effect::Log(_) | Effect::PublishRoster => {}
        }
    }
    // Whoever looks at the roster must hear of every change of who takes part.
    let told = |process: &Lifecycle| (process.is_running(), process.is_frozen());
    if told(before) != told(after) {
        let ends_run = effects.iter().any(|effect| matches!(effect, Effect::EndRun(_)));
        assert!(effects.contains(&Effect::PublishRoster) || ends_run, "{before:?} {effects:?} {after:?}");
    }
}

proptest! {
    #[test]
    fn no_sequence_of_inputs_reaches_an_impossible_state(
        part in prop_oneof![Just(Part::World), Just(Part::Leader), Just(Part::Recorder), Just(AGENT)],
        is_by_hand in any::<bool>(),
        steps in prop::collection::vec(any_step(), 1..80),
    ) {
        let mut process = Lifecycle::new(part, LIMITS, is_by_hand);
        let (mut now, mut next_pid, mut replacements) = (Duration::ZERO, 1, 0);
        for (choice, milliseconds) in steps {
            next_pid += 1;
            now += Duration::from_millis(milliseconds);
            let Some(input) = possible_input(&process, choice, next_pid) else { continue };
            let before = process.clone();
            let effects = process.on(input, now, RunStage::Flying);
            assert_possible(&before, &effects, &process);
            if effects.contains(&Effect::Spawn) {
                let is_loss = effects.iter().any(|effect| matches!(effect, Effect::Log(Event::ProcessLost { .. })));
                replacements += u32::from(is_loss);
                next_pid += 1;
                process.on(Input::Spawned { pid: next_pid }, now, RunStage::Flying);
                prop_assert!(process.is_starting());
            }
        }
        prop_assert!(replacements <= LIMITS.replacements);
    }
}
