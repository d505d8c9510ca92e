use super::*;
use ringwing_flight::{ProcessAction, UavId};

const KILL: ProcessAction = ProcessAction::Kill { returns: false };

fn scenario(faults: &[&str], pace: Pace) -> Scenario {
    let faults = faults.iter().map(|sentence| sentence.parse().unwrap()).collect();
    let mut scenario = Scenario { faults, ..Scenario::default() };
    scenario.time.real_time = pace == Pace::RealTime;
    scenario
}

fn agent(uav: u32) -> Part {
    Part::Agent(UavId(uav))
}

fn request(sentence: &str) -> LiveRequest<&'static str> {
    LiveRequest { sentence: sentence.into(), reply: "the user" }
}

/// Applies everything that is due at `now` to processes that do at once what they are told; returns the batches.
fn apply_all(queue: &mut FaultQueue<&str>, now: Tick) -> Vec<Vec<(Part, ProcessAction)>> {
    let mut batches = Vec::new();
    loop {
        queue.finish_batch(|_, _| true).unwrap();
        let batch = queue.take_batch(now, |_, _| false);
        if batch.is_empty() {
            return batches;
        }
        batches.push(batch.iter().map(|one| (one.part, one.action)).collect());
        for scheduled in batch {
            queue.note_applied(scheduled);
        }
    }
}

/// Decides a request at `now`, which must be accepted.
fn accept(queue: &mut FaultQueue<&'static str>, sentence: &str, now: Tick) -> Event {
    queue.decide(request(sentence), now).unwrap_or_else(|(_, why)| panic!("{sentence}: {why}"))
}

fn refuse(queue: &mut FaultQueue<&'static str>, sentence: &str, now: Tick) -> String {
    match queue.decide(request(sentence), now) {
        Ok(event) => panic!("{sentence}: {event:?}"),
        Err((_, why)) => why,
    }
}

#[test]
fn the_world_may_fly_up_to_the_next_fault_and_no_further() {
    let scenario = scenario(&["at 3 s kill uav 2", "at 1 s kill uav 1"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    assert_eq!(queue.free_before(), Tick(100));
    assert_eq!(apply_all(&mut queue, Tick(100)), [[(agent(1), KILL)]]);
    assert_eq!(queue.free_before(), Tick(100), "whoever publishes a roster now must not let the world go on");
    queue.release(Tick(100));
    assert_eq!(queue.free_before(), Tick(300));
    apply_all(&mut queue, Tick(300));
    queue.release(Tick(300));
    assert_eq!(queue.free_before(), Roster::empty().free_before);
}

#[test]
fn in_real_time_the_world_waits_for_no_fault() {
    let scenario = scenario(&["at 1 s kill uav 1"], Pace::RealTime);
    let mut queue = FaultQueue::new(&scenario);
    queue.submit(request("kill uav 2"));
    assert_eq!(queue.free_before(), Roster::empty().free_before);
}

#[test]
fn faults_of_one_tick_keep_their_order_and_those_of_a_kind_go_together() {
    let faults = [
        "at 1 s freeze uav 4",
        "at 1 s kill uav 2, 1",
        "at 1 s restart uav 3 after 1 s",
        "at 1 s stop uav 5",
        "at 1 s kill uav 6",
    ];
    let scenario = scenario(&faults, Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    let restart = ProcessAction::Kill { returns: true };
    assert_eq!(
        apply_all(&mut queue, Tick(100)),
        [
            vec![(agent(4), ProcessAction::Freeze)],
            vec![(agent(2), KILL), (agent(1), KILL), (agent(3), restart)],
            vec![(agent(5), ProcessAction::Stop)],
            vec![(agent(6), KILL)],
        ]
    );
    assert_eq!(apply_all(&mut queue, Tick(200)), [[(agent(3), ProcessAction::Start)]]);
}

#[test]
fn a_batch_lasts_until_each_of_its_actions_shows() {
    let scenario = scenario(&["at 1 s kill uav 1, 2", "at 1 s freeze uav 3"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    queue.finish_batch(|_, _| true).unwrap();
    queue.take_batch(Tick(100), |_, _| false).into_iter().for_each(|one| queue.note_applied(one));
    assert!(queue.is_busy());
    assert_eq!(queue.finish_batch(|part, _| part == agent(1)), None, "uav 2 still runs");
    let events = queue.finish_batch(|_, _| true).unwrap();
    let names: Vec<_> = events.iter().map(Event::name).collect();
    assert_eq!(names, ["fault.kill", "fault.kill"]);
    assert!(matches!(&events[0], Event::ProcessFault { part, .. } if *part == agent(1)));
    assert_eq!(queue.take_batch(Tick(100), |_, _| false)[0].action, ProcessAction::Freeze);
}

#[test]
fn a_second_action_on_the_same_process_waits_for_the_first() {
    let scenario = scenario(&["at 1 s kill uav 1, 2", "at 1 s kill uav 1"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    assert_eq!(
        apply_all(&mut queue, Tick(100)),
        [vec![(agent(1), KILL), (agent(2), KILL)], vec![(agent(1), KILL)]]
    );
}

#[test]
fn a_refused_action_comes_alone_in_its_turn() {
    let scenario = scenario(&["at 1 s kill uav 1, 2, 3"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    let parts = |batch: Vec<ScheduledAction>| batch.iter().map(|one| one.part).collect::<Vec<_>>();
    for expected in [1, 2, 3] {
        let batch = queue.take_batch(Tick(100), |part, _| part == agent(2));
        assert_eq!(parts(batch), [agent(expected)]);
    }
}

#[test]
#[should_panic(expected = "the batch before is not finished")]
fn no_batch_begins_before_the_last_has_ended() {
    let scenario = scenario(&["at 1 s kill uav 1", "at 1 s freeze uav 2"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    queue.take_batch(Tick(100), |_, _| false).into_iter().for_each(|one| queue.note_applied(one));
    queue.take_batch(Tick(100), |_, _| false);
}

#[test]
fn what_is_due_later_waits() {
    let scenario = scenario(&["at 1 s kill uav 1", "at 1.01 s kill uav 2"], Pace::Lockstep);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    assert_eq!(queue.take_batch(Tick(99), |_, _| false), []);
    assert_eq!(queue.take_batch(Tick(100), |_, _| false).len(), 1);
    queue.release(Tick(100));
    assert_eq!(queue.free_before(), Tick(101));
}

#[test]
fn in_real_time_a_late_launcher_catches_up_on_all_that_has_come() {
    let scenario = scenario(&["at 1 s kill uav 1", "at 1.01 s kill uav 2"], Pace::RealTime);
    let mut queue = FaultQueue::new(&scenario);
    assert_eq!(apply_all(&mut queue, Tick(107)), [[(agent(1), KILL), (agent(2), KILL)]]);
}

#[test]
fn a_released_tick_is_past_in_lockstep() {
    let [lockstep, real_time] = [Pace::Lockstep, Pace::RealTime].map(|pace| scenario(&[], pace));
    let mut queue: FaultQueue<&str> = FaultQueue::new(&lockstep);
    assert!(queue.is_open(Tick(100)));
    queue.release(Tick(100));
    assert!(!queue.is_open(Tick(100)) && queue.is_open(Tick(101)));
    let mut queue: FaultQueue<&str> = FaultQueue::new(&real_time);
    queue.release(Tick(100));
    assert!(queue.is_open(Tick(100)), "no tick is held, so more may be done in the same one");
}

#[test]
fn a_request_holds_the_next_tick_and_is_answered_once_it_is_done() {
    let scenario = scenario(&["at 5 s kill uav 1"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    queue.submit(request("kill uav 2"));
    assert_eq!(queue.free_before(), BEFORE_ALL_TICKS);
    assert!(queue.is_busy());
    let [waiting] = queue.take_requests().try_into().unwrap();
    let event = queue.decide(waiting, Tick(123)).unwrap();
    assert_eq!(event, Event::FaultRequested { sentence: "at 1.23 s kill uav 2".into() });
    assert_eq!(queue.added().len(), 1);
    assert_eq!(apply_all(&mut queue, Tick(123)), [[(agent(2), KILL)]]);
    assert_eq!(queue.release(Tick(123)), [("the user", "tick 123, 1.23 s: kill uav 2".into())]);
    assert!(!queue.is_busy());
    assert_eq!(queue.free_before(), Tick(500));
}

#[test]
fn what_is_refused_of_a_request_is_told_to_the_one_who_asked() {
    let scenario = scenario(&["at 1 s freeze uav 1"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    let scheduled = queue.take_batch(Tick(100), |_, _| false).remove(0);
    assert!(matches!(
        queue.note_refused(scheduled, "is gone already"),
        Event::FaultRefused { part: Some(part), .. } if part == agent(1)
    ));
    accept(&mut queue, "kill uav 2, 3", Tick(100));
    let mut batch = queue.take_batch(Tick(100), |_, _| false);
    queue.note_applied(batch.remove(0));
    queue.note_refused(batch.remove(0), "is gone already");
    queue.finish_batch(|_, _| true).unwrap();
    let answer = "refused: uav 3 is gone already (tick 100, 1.00 s: kill uav 2,3)";
    assert_eq!(queue.release(Tick(100)), [("the user", answer.into())]);
}

#[test]
fn of_two_requests_with_the_same_sentence_each_learns_of_its_own_refusals() {
    let scenario = scenario(&[], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    accept(&mut queue, "kill uav 2", Tick(100));
    accept(&mut queue, "kill uav 2", Tick(100));
    let mut batch = queue.take_batch(Tick(100), |_, _| false);
    queue.note_applied(batch.remove(0));
    queue.finish_batch(|_, _| true).unwrap();
    let second = queue.take_batch(Tick(100), |_, _| true).remove(0);
    queue.note_refused(second, "is gone already");
    let answers = queue.release(Tick(100)).into_iter().map(|(_, answer)| answer);
    assert_eq!(
        answers.collect::<Vec<_>>(),
        ["tick 100, 1.00 s: kill uav 2", "refused: uav 2 is gone already (tick 100, 1.00 s: kill uav 2)"]
    );
}

#[test]
fn a_request_in_real_time_begins_after_a_notice_and_is_answered_then() {
    let scenario = scenario(&[], Pace::RealTime);
    let mut queue = FaultQueue::new(&scenario);
    accept(&mut queue, "link 2->3 delay 200 ms", Tick(100));
    assert_eq!(queue.take_announcements(Tick(110)), []);
    assert_eq!(queue.release(Tick(110)), []);
    assert!(queue.is_busy());
    let begun = queue.take_announcements(Tick(111));
    assert_eq!((begun.len(), begun[0].event.tick, begun[0].is_live), (1, Tick(111), true));
    assert_eq!(queue.release(Tick(111)), [("the user", "tick 111, 1.11 s: link 2->3 delay 200 ms".into())]);
}

#[test]
fn a_request_stands_behind_what_is_due_in_the_same_tick_and_before_what_is_due_later() {
    let scenario = scenario(&["at 2 s kill uav 1", "at 1 s kill uav 2"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    accept(&mut queue, "restart uav 3 after 500 ms", Tick(100));
    let restart = ProcessAction::Kill { returns: true };
    assert_eq!(apply_all(&mut queue, Tick(100)), [[(agent(2), KILL), (agent(3), restart)]]);
    assert_eq!(apply_all(&mut queue, Tick(150)), [[(agent(3), ProcessAction::Start)]]);
    assert_eq!(apply_all(&mut queue, Tick(200)), [[(agent(1), KILL)]]);
}

#[test]
fn what_makes_no_sense_in_this_run_is_refused_and_changes_nothing() {
    let scenario = scenario(&[], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    for (sentence, why) in [
        ("kil uav 3", "did you mean kill?"),
        ("kill uav 9", "there is no uav 9"),
        ("freeze world", "the world keeps time"),
        ("heal link 3->2", "there is nothing to heal"),
        ("link 2->3 delay file \"wifi.txt\"", "reads no files"),
    ] {
        let answer = refuse(&mut queue, sentence, Tick(5));
        assert!(answer.contains(why), "{sentence}: {answer}");
    }
    assert!(!queue.is_busy() && queue.added().is_empty() && queue.list(Tick(5)) == "none");
}

/// The announcements of healings up to the end of time, with their ticks.
fn healings(queue: &mut FaultQueue<&str>) -> Vec<(i64, bool)> {
    let announced = queue.take_announcements(Tick(i64::MAX));
    let healed = announced.iter().filter(|one| matches!(one.event.event, Event::FaultHealed { .. }));
    healed.map(|one| (one.event.tick.0, one.is_live)).collect()
}

#[test]
fn a_fault_that_is_healed_before_its_end_is_healed_once() {
    let planned = scenario(&["at 1 s link 2->3 hold for 5 s", "at 1 s link all loss 5 %"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&planned);
    accept(&mut queue, "link 4->5 blackout for 9 s", Tick(150));
    accept(&mut queue, "heal all", Tick(200));
    assert_eq!(healings(&mut queue), [(200, true); 3]);
    // The end of a fault in the very tick of the healing is the scenario's own.
    let mut queue = FaultQueue::new(&planned);
    accept(&mut queue, "heal all", Tick(600));
    accept(&mut queue, "link 2->3 hold for 1 s", Tick(700));
    assert_eq!(healings(&mut queue), [(600, false), (600, true), (800, true)]);
}

#[test]
fn healing_ends_the_faults_of_its_links_and_announces_that() {
    let scenario = scenario(&["at 1 s link 2->3 loss 30 %", "at 1 s link 4->5 loss 30 %"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    assert_eq!(refuse(&mut queue, "heal link 2->3", Tick(99)), "there is nothing to heal");
    let begun = queue.take_announcements(Tick(150));
    assert!(begun.len() == 2 && begun.iter().all(|one| !one.is_live), "{begun:?}");
    accept(&mut queue, "heal link 2->3", Tick(150));
    let healed = queue.take_announcements(Tick(150));
    let sentence = "link 2->3 loss 30 %".to_owned();
    assert_eq!(healed.len(), 1);
    assert_eq!(healed[0].event, TimedEvent { tick: Tick(150), event: Event::FaultHealed { sentence } });
    assert_eq!(queue.list(Tick(150)), "since 1.00 s: link 4->5 loss 30 %");
    assert_eq!(refuse(&mut queue, "heal link 2->3", Tick(151)), "there is nothing to heal");
    accept(&mut queue, "heal all", Tick(151));
    assert_eq!(queue.list(Tick(151)), "none");
}

#[test]
fn the_list_tells_what_is_in_force_and_what_is_to_come() {
    let faults = ["at 1 s link 2->3 loss 30 % for 1 s", "at 3 s link 2->3 delay 20 ms", "at 4 s kill uav 1"];
    let scenario = scenario(&faults, Pace::Lockstep);
    let queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    let list = queue.list(Tick(150));
    let lines: Vec<_> = list.lines().collect();
    assert_eq!(
        lines,
        [
            "since 1.00 s: link 2->3 loss 30 % for 1 s",
            "from 3.00 s: link 2->3 delay 20 ms",
            "at 4.00 s: uav 1 is killed: kill uav 1",
        ]
    );
    assert_eq!(queue.list(Tick(200)).lines().count(), 2);
}

#[test]
fn in_real_time_a_fault_that_comes_late_says_so_and_keeps_its_duration() {
    let faults = ["at 1 s freeze uav 1 for 2 s", "at 1.5 s freeze uav 2 for 2 s", "at 4 s kill uav 3"];
    let scenario = scenario(&faults, Pace::RealTime);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    apply_all(&mut queue, Tick(260));
    let late = |part, late_s, sentence: &str| Event::FaultLate { part, late_s, sentence: sentence.into() };
    assert_eq!(
        queue.take_late(),
        [late(agent(1), 1.6, "freeze uav 1 for 2 s"), late(agent(2), 1.1, "freeze uav 2 for 2 s")]
    );
    // The kill is not late, and both thaws come two seconds after their freezes.
    assert_eq!(apply_all(&mut queue, Tick(401)), [[(agent(3), KILL)]]);
    assert!(apply_all(&mut queue, Tick(459)).is_empty());
    assert_eq!(
        apply_all(&mut queue, Tick(460)),
        [[(agent(2), ProcessAction::Thaw), (agent(1), ProcessAction::Thaw)]]
    );
    assert_eq!(queue.take_late(), [], "the thaws are in time");
}

#[test]
fn the_rhythm_of_the_launcher_makes_nothing_late() {
    let scenario = scenario(&["at 1 s freeze uav 1 for 2 s"], Pace::RealTime);
    let mut queue: FaultQueue<&str> = FaultQueue::new(&scenario);
    apply_all(&mut queue, Tick(109));
    assert_eq!(queue.take_late(), []);
    assert_eq!(apply_all(&mut queue, Tick(300)), [[(agent(1), ProcessAction::Thaw)]]);
}

#[test]
fn a_request_for_answers_that_the_world_would_not_wait_for_is_refused() {
    let lockstep = scenario(&["at 0 s slow uav 3 by 1 s"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&lockstep);
    let why = refuse(&mut queue, "slow uav 3 by 1 s for 1 s", Tick(100));
    assert!(why.starts_with("uav 3 would answer 2 s late"), "{why}");
    accept(&mut queue, "slow uav 2 by 1 s for 1 s", Tick(100));
    let real_time = scenario(&[], Pace::RealTime);
    accept(&mut FaultQueue::new(&real_time), "slow uav 3 by 9 s", Tick(100));
}

#[test]
fn the_answer_to_a_request_that_can_have_no_effect_warns_with_the_reason() {
    let scenario = scenario(&[], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    for (sentence, warning) in [
        ("link 2->5 blackout", "the fault will have no effect: uav 2 and uav 5 are not ring neighbours"),
        ("link 2->3 delay 4 ms", "the fault will have no effect: 4 ms rounds to no tick at 100 Hz"),
        ("link 2->3 delay 14 ms", "delays are whole ticks: 14 ms becomes 10 ms at 100 Hz"),
    ] {
        accept(&mut queue, sentence, Tick(100));
        let (_, answer) = queue.release(Tick(100)).pop().unwrap();
        let expected = format!("tick 100, 1.00 s: {sentence}\nwarning: {warning}");
        assert!(answer.starts_with(&expected), "{answer}");
    }
    accept(&mut queue, "link 2->3 delay 20 ms", Tick(100));
    assert_eq!(queue.release(Tick(100)), [("the user", "tick 100, 1.00 s: link 2->3 delay 20 ms".into())]);
}

#[test]
fn in_lockstep_the_world_holds_the_tick_in_which_a_requested_fault_ends() {
    let scenario = scenario(&["at 1 s link 2->3 blackout for 1 s"], Pace::Lockstep);
    let mut queue = FaultQueue::new(&scenario);
    accept(&mut queue, "link 3->4 blackout for 500 ms", Tick(50));
    assert_eq!(queue.take_announcements(Tick(50)).len(), 1);
    queue.release(Tick(50));
    assert_eq!(queue.free_before(), Tick(100), "whatever comes before the live end is passed first");
    queue.take_announcements(Tick(100));
    queue.release(Tick(100));
    assert_eq!(queue.free_before(), Roster::empty().free_before, "the scenario's own end needs no hold");
}
