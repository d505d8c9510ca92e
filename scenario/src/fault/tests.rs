use super::{
    Action, Delay, Fault, LinkImpairment, Links, ProcessFault, Receiver, Sender, SensorDrift, Targets,
    next_words,
    schedule::{AirframeFailure, FaultSchedule},
};
use crate::AirframeSection;
use proptest::{collection::vec, option, prelude::*};
use ringwing_flight::{LinkSource, Part, ProcessAction, Tick, TimedEvent, UavId};

fn action(text: &str) -> Action {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn syntax_error(text: &str) -> String {
    text.parse::<Action>().unwrap_err().to_string()
}

#[test]
fn every_spelling_of_a_fault_is_written_back_in_one_form() {
    for (spelling, canonical) in [
        ("kill uav 3", "kill uav 3"),
        ("KILL  UAV 3 , 5", "kill uav 3,5"),
        ("stop all uavs", "stop all uavs"),
        ("freeze leader for 2000 ms", "freeze leader for 2 s"),
        ("thaw random 2 uavs", "thaw random 2 uavs"),
        ("restart recorder after 0.5 s", "restart recorder after 500 ms"),
        ("flap uav 3 every 4s for 20s", "flap uav 3 every 4 s for 20 s"),
        ("slow uav 3 by 20ms", "slow uav 3 by 20 ms"),
        ("link 2 -> 3 delay 0.2 s", "link 2->3 delay 200 ms"),
        ("link 2->3 delay 200 ms jitter 50 ms for 10 s", "link 2->3 delay 200 ms jitter 50 ms for 10 s"),
        ("link 3<->2 delay 1 s normal 0.1 s", "link 2<->3 delay 1 s normal 100 ms"),
        ("link all delay 0 s pareto 30 ms", "link all delay 0 s pareto 30 ms shape 3"),
        ("link all delay 0 s pareto 30 ms shape 1.5", "link all delay 0 s pareto 30 ms shape 1.5"),
        ("link all->all delay trace {20 ms,0.035 s}", "link all->all delay trace {20 ms, 35 ms}"),
        ("link own->3 loss 0.3", "link own->3 loss 30 %"),
        ("link Traffic -> all stuck", "link traffic->all stuck"),
        ("link leader->all gilbert 1% 10%", "link leader->all gilbert 1 % 10 % 0 1"),
        ("link 2->3 gilbert loss 5% burst 80ms", "link 2->3 gilbert loss 5 % burst 80 ms"),
        ("link 2->3 corrupt 0.1", "link 2->3 corrupt 10 %"),
        ("link 2->3 rate 20 samples / s", "link 2->3 rate 20 samples/s queue 10"),
        ("link 2->3 rate 0.5 samples/s queue 3 for 1 s", "link 2->3 rate 0.5 samples/s queue 3 for 1 s"),
        ("link all reorder 25 %", "link all reorder 25 % by 50 ms"),
        ("link all duplicate 20%", "link all duplicate 20 %"),
        ("link 4->2 bias x 3 m heading 5 deg", "link 4->2 bias x 3 m y 0 m heading 5 deg"),
        ("link 4->2 noise position 2 m", "link 4->2 noise position 2 m heading 0 deg"),
        ("partition {1,2,3}|{4,5,6}", "partition {1,2,3}|{4,5,6}"),
        ("partition {1}|{4}|{5} hold for 1 s", "partition {1}|{4}|{5} hold for 1 s"),
        ("isolate uav 3 blackout for 5 s", "isolate 3 for 5 s"),
        ("heal all", "heal all"),
        ("heal link 2->3", "heal link 2->3"),
        ("heal isolate 3", "heal isolate 3"),
    ] {
        assert_eq!(action(spelling).to_string(), canonical);
    }
    assert_eq!("at 30 s kill uav 3".parse::<Fault>().unwrap().to_string(), "at 30 s kill uav 3");
    assert_eq!(String::from(action("KILL UAV 3")), "kill uav 3");
}

/// Sentences with a mistake, and what the error says of each.
const SYNTAX_ERRORS: [(&str, &str); 25] = [
    (
        "",
        "the sentence is empty: expected kill, stop, freeze, thaw, start, restart, flap, slow, weaken, jam, drift, link, partition, isolate or heal",
    ),
    (
        "kil uav 3",
        "word 1, \"kil\": did you mean kill? Expected kill, stop, freeze, thaw, start, restart, flap, slow, weaken, jam, drift, link, partition, isolate or heal",
    ),
    ("kill", "after \"kill\": expected uav, random, all, leader, recorder or world"),
    ("kill 3", "word 2, \"3\": expected uav, random, all, leader, recorder or world"),
    ("kill uav three", "word 3, \"three\": expected the number of a UAV, from 1"),
    ("kill uav 0", "word 3, \"0\": expected the number of a UAV, from 1"),
    ("kill uav 3 now", "word 4, \"now\": expected the end of the sentence"),
    ("freeze uav 3 for 2", "after \"2\": expected s or ms"),
    ("freeze uav 3 for 2 sec", "word 6, \"sec\": expected s or ms"),
    (
        "freeze uav 3 for 0 s",
        "word 5, \"0\": out of range, expected a time above 0 of at most a day, such as 10 s",
    ),
    ("restart uav 3 5 s", "word 4, \"5\": expected after"),
    ("link 2>3 loss 3 %", "word 3, \">\": expected ->"),
    (
        "link 2->3",
        "after \"3\": expected delay, loss, gilbert, blackout, corrupt, rate, duplicate, reorder, hold, stuck, bias or noise",
    ),
    (
        "link 2->3 dealy 3 s",
        "word 5, \"dealy\": did you mean delay? Expected delay, loss, gilbert, blackout, corrupt, rate, duplicate, reorder, hold, stuck, bias or noise",
    ),
    ("link 2->3 loss 30", "word 6, \"30\": not between 0 and 1, expected a probability, such as 30 % or 0.3"),
    (
        "link 2->3 delay soon",
        "word 6, \"soon\": expected a time such as 200 ms, trace {20 ms, 35 ms}, or file \"wifi.txt\"",
    ),
    ("link 2->3 delay 1 s pareto 1 s shape 1", "word 12, \"1\": not above 1, expected a shape such as 3"),
    (
        "link 2->3 gilbert",
        "after \"gilbert\": expected loss, as in: gilbert loss 5 % burst 80 ms; or two probabilities, as in: gilbert 1 % 10 %",
    ),
    ("link 2->3 gilbert loss 5 %", "after \"%\": expected burst"),
    (
        "link 2->3 rate 0 samples/s",
        "word 6, \"0\": out of range, expected a capacity above 0, such as 20 samples/s, of at most 1000000",
    ),
    ("link 2->3 rate 20 Hz", "word 7, \"Hz\": expected samples"),
    (
        "link 2->3 rate 20 samples/s queue 0",
        "word 11, \"0\": expected the places of the queue, from 1 to 10000",
    ),
    ("partition {1,2}", "after \"}\": expected |"),
    ("partition {1,2}|{2}", "after \"}\": expected each UAV once, but uav 2 is named twice"),
    ("heal uav 3", "word 2, \"uav\": expected all, link, partition or isolate"),
];

#[test]
fn a_syntax_error_names_the_word_and_what_was_expected() {
    for (text, message) in SYNTAX_ERRORS {
        assert_eq!(syntax_error(text), message, "{text}");
    }
    let late = "kill uav 3".parse::<Fault>().unwrap_err().to_string();
    assert_eq!(late, "word 1, \"kill\": expected a time first, such as in: at 30 s kill uav 3");
}

#[test]
fn a_fault_that_the_swarm_cannot_have_is_refused_with_the_reason() {
    for (text, message) in [
        ("kill uav 7", Some("there is no uav 7: this run has UAVs 1 to 6")),
        ("isolate 9", Some("there is no uav 9: this run has UAVs 1 to 6")),
        ("link 2->8 hold", Some("there is no uav 8: this run has UAVs 1 to 6")),
        ("link 9->2 hold", Some("there is no uav 9: this run has UAVs 1 to 6")),
        ("stop random 6 uavs", None),
        ("stop random 7 uavs", Some("cannot draw 7 UAVs: this run has only 6")),
        ("kill world", None),
        ("partition {1,2}|{5,6}", None),
    ] {
        assert_eq!(action(text).refusal(6).as_deref(), message, "{text}");
    }
    assert!(action("freeze world for 1 s").refusal(6).unwrap().starts_with("the world keeps time"));
    assert!(action("slow leader by 20 ms").refusal(6).unwrap().contains("link leader->all delay 20 ms"));
    assert!(action("weaken leader to 14 m/s").refusal(6).unwrap().starts_with("only UAVs have airframes"));
    assert!(action("slow recorder by 20 ms").refusal(6).unwrap().ends_with("freeze it instead"));
}

#[test]
fn bursts_that_no_chain_has_at_the_rate_of_the_run_are_refused() {
    for (text, rate_hz, why) in [
        ("link all gilbert loss 5 % burst 80 ms", 100, None),
        ("link all gilbert loss 5 % burst 10 ms", 100, None),
        ("link all gilbert loss 50 % burst 10 ms", 100, None),
        ("link all gilbert loss 0 % burst 80 ms", 100, None),
        ("link all gilbert loss 5 % burst 9 ms", 100, Some("shorter than a tick at 100 Hz")),
        ("link all gilbert loss 60 % burst 10 ms", 100, Some("too many for bursts of this length")),
        ("link all gilbert loss 100 % burst 1 s", 100, Some("use blackout")),
        ("link all gilbert 5 % 10 %", 100, None),
    ] {
        let refusal = action(text).refusal_at(rate_hz);
        assert_eq!(refusal.is_some(), why.is_some(), "{text}: {refusal:?}");
        assert!(why.is_none_or(|why| refusal.as_ref().unwrap().contains(why)), "{text}: {refusal:?}");
    }
}

#[test]
fn a_set_of_links_includes_those_that_it_names() {
    let included = |text: &str| {
        let (Action::Link { links, .. } | Action::Heal(links)) = action(text) else { panic!("{text}") };
        let uavs = || UavId::all(4);
        let others = [LinkSource::LEADER, LinkSource::OWN, LinkSource::TRAFFIC];
        let sources = uavs().map(LinkSource::uav).chain(others);
        let pairs = sources.flat_map(|from| uavs().map(move |to| (from, to)));
        let named = pairs.filter(|(from, to)| *from != LinkSource::uav(*to) && links.includes(*from, *to));
        named.map(|(from, to)| format!("{from}->{}", to.0)).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(included("link 2->3 hold"), "2->3");
    assert_eq!(included("link 2<->4 hold"), "2->4 4->2");
    assert_eq!(included("link all->3 hold"), "1->3 2->3 4->3");
    assert_eq!(included("link leader->2 hold"), "leader->2");
    assert_eq!(included("link own->all hold"), "own->1 own->2 own->3 own->4");
    assert_eq!(included("link traffic->2 hold"), "traffic->2");
    assert_eq!(included("isolate 1"), "1->2 1->3 1->4 2->1 3->1 4->1 leader->1");
    assert_eq!(included("partition {1,2}|{3}"), "1->3 2->3 3->1 3->2");
    assert_eq!(included("link all hold").split(' ').count(), 12 + 4);
}

fn schedule(faults: &[Fault], seed: u64) -> FaultSchedule<'_> {
    FaultSchedule { faults, seed, rate_hz: 100, uavs: 6 }
}

fn faults(sentences: &[&str]) -> Vec<Fault> {
    sentences.iter().map(|text| text.parse().unwrap()).collect()
}

#[test]
fn each_process_fault_is_scheduled_at_its_tick() {
    let faults = faults(&[
        "at 2 s flap uav 2 every 1 s for 2 s",
        "at 1 s restart leader after 5 s",
        "at 3 s freeze uav 4,5 for 10 ms",
        "at 0 s slow uav 1 by 3 ms for 1 s",
    ]);
    let actions: Vec<_> = schedule(&faults, 1)
        .scheduled_actions()
        .iter()
        .map(|one| (one.tick.0, one.part, one.action))
        .collect();
    let (kill, uav) = (ProcessAction::Kill { returns: true }, |uav| Part::Agent(UavId(uav)));
    assert_eq!(
        actions,
        [
            (100, Part::Leader, kill),
            (200, uav(2), kill),
            (250, uav(2), ProcessAction::Start),
            (300, uav(2), kill),
            (300, uav(4), ProcessAction::Freeze),
            (300, uav(5), ProcessAction::Freeze),
            (301, uav(4), ProcessAction::Thaw),
            (301, uav(5), ProcessAction::Thaw),
            (350, uav(2), ProcessAction::Start),
            (600, Part::Leader, ProcessAction::Start),
        ]
    );
    let slow = schedule(&faults, 1).slow_answers();
    assert!(slow[0].is_on(Tick(99)) && !slow[0].is_on(Tick(100)));
    assert_eq!((slow.len(), slow[0].part, slow[0].begin, slow[0].end), (1, uav(1), Tick(0), Some(Tick(100))));
}

#[test]
fn link_faults_and_slow_processes_are_announced_with_their_ends() {
    let faults = faults(&[
        "at 2 s slow uav 1 by 3 ms for 1 s",
        "at 1 s link 2->3 hold",
        "at 4 s heal all",
        "at 1 s kill uav 4",
    ]);
    let announced: Vec<_> = schedule(&faults, 1)
        .announcements()
        .into_iter()
        .map(|TimedEvent { tick, event }| (tick.0, event.name()))
        .collect();
    let expected = [(100, "fault.link"), (200, "fault.slow"), (300, "fault.healed"), (400, "fault.healed")];
    assert_eq!(announced, expected);
}

#[test]
fn failures_of_airframes_are_scheduled_for_their_uavs_and_announced_with_their_ends() {
    let faults = faults(&["at 1 s weaken uav 2,3 to 14 m/s for 2 s", "at 2 s jam uav 1 turn at -0.1 rad/s"]);
    let scheduled = schedule(&faults, 1).airframe_faults();
    let of: Vec<_> =
        scheduled.iter().map(|one| (one.number, one.uav.0, one.begin.0, one.end, one.failure)).collect();
    let (weak, jammed) = (AirframeFailure::Weak(14.0), AirframeFailure::Jammed(-0.1));
    let end = Some(Tick(300));
    assert_eq!(of, [(1, 2, 100, end, weak), (1, 3, 100, end, weak), (2, 1, 200, None, jammed)]);
    let is_on = |index: usize| [99, 100, 299, 300].map(|tick| scheduled[index].is_on(Tick(tick)));
    assert_eq!((is_on(0), is_on(2)), ([false, true, true, false], [false, false, true, true]));
    let announced: Vec<_> =
        schedule(&faults, 1).announcements().iter().map(|one| (one.tick.0, one.event.name())).collect();
    assert_eq!(announced, [(100, "fault.airframe"), (200, "fault.airframe"), (300, "fault.healed")]);
}

#[test]
fn a_failure_leaves_an_airframe_within_its_limits() {
    let limits = AirframeSection::default();
    for (failure, within) in [
        (AirframeFailure::Weak(5.0), AirframeFailure::Weak(12.0)),
        (AirframeFailure::Weak(14.0), AirframeFailure::Weak(14.0)),
        (AirframeFailure::Jammed(-0.3), AirframeFailure::Jammed(-0.3)),
        (AirframeFailure::Jammed(-2.0), AirframeFailure::Jammed(-0.5)),
        (AirframeFailure::Jammed(2.0), AirframeFailure::Jammed(0.5)),
    ] {
        assert_eq!(failure.within(&limits), within);
    }
}

#[test]
fn a_healing_is_idle_if_no_fault_is_on_that_it_could_end() {
    let faults = faults(&[
        "at 1 s link 2->3 hold",
        "at 2 s link 3->4 hold for 1 s",
        "at 4 s heal link 3->4",
        "at 5 s heal all",
        "at 6 s heal all",
    ]);
    assert_eq!(schedule(&faults, 1).idle_healings(), [3, 5]);
}

#[test]
fn a_link_fault_concerns_only_links_that_a_uav_may_listen_on() {
    let faults = faults(&["at 1 s link all->3 hold"]);
    let fault = &schedule(&faults, 1).link_faults()[0];
    let from = |number| LinkSource::uav(UavId(number));
    assert!(fault.concerns(from(2), UavId(3)));
    assert!(!fault.concerns(from(3), UavId(3)), "nobody listens to itself");
    assert!(!fault.concerns(from(2), UavId(4)));
}

#[test]
fn random_targets_depend_on_the_seed_and_the_tick_alone() {
    let faults =
        faults(&["at 2 s kill random 2 uavs", "at 3 s kill random 2 uavs", "at 3 s stop random 2 uavs"]);
    let drawn = |seed| {
        let actions = schedule(&faults, seed).scheduled_actions();
        actions.chunks(2).map(|pair| [pair[0].part, pair[1].part]).collect::<Vec<_>>()
    };
    assert_eq!(drawn(1), drawn(1));
    assert!((2..9).any(|seed| drawn(seed) != drawn(1)));
    assert!((1..9).any(|seed| drawn(seed)[1] != drawn(seed)[2]), "draws of one tick are independent");
    let without_first: Vec<_> = schedule(&faults[1..], 1)
        .scheduled_actions()
        .chunks(2)
        .map(|pair| [pair[0].part, pair[1].part])
        .collect();
    assert_eq!(drawn(1)[1..], without_first);
}

#[test]
fn a_link_fault_lasts_for_its_duration_or_until_it_is_healed() {
    let faults = faults(&[
        "at 5 s heal link 2->3",
        "at 1 s link 2->3 hold",
        "at 2 s isolate 4 for 10 s",
        "at 3 s link all loss 3 %",
        "at 8 s heal all",
    ]);
    let spans: Vec<_> = schedule(&faults, 1)
        .link_faults()
        .iter()
        .map(|fault| (fault.begin.0, fault.end.map(|end| end.0)))
        .collect();
    assert_eq!(spans, [(100, Some(500)), (200, Some(800)), (300, Some(800))]);
}

fn time() -> impl Strategy<Value = f64> {
    prop_oneof![(1..100_000_u32).prop_map(|ms| f64::from(ms) / 1000.0), 1e-9..80_000.0_f64]
}

fn probability() -> impl Strategy<Value = f64> {
    prop_oneof![(0..=100_u32).prop_map(|percent| f64::from(percent) / 100.0), 0.0..=1.0_f64]
}

fn heading() -> impl Strategy<Value = f64> {
    prop_oneof![(-180..180_i32).prop_map(|deg| f64::from(deg).to_radians()), -6.0..6.0_f64]
}

fn targets() -> impl Strategy<Value = Targets> {
    prop_oneof![
        Just(Targets::World),
        Just(Targets::Leader),
        Just(Targets::Recorder),
        Just(Targets::AllUavs),
        (1..9_u32).prop_map(Targets::Random),
        vec(1..99_u32, 1..5).prop_map(Targets::Uavs),
    ]
}

fn fault() -> impl Strategy<Value = ProcessFault> {
    prop_oneof![
        Just(ProcessFault::Kill),
        Just(ProcessFault::Stop),
        Just(ProcessFault::Thaw),
        Just(ProcessFault::Start),
        option::of(time()).prop_map(|for_s| ProcessFault::Freeze { for_s }),
        time().prop_map(|after_s| ProcessFault::Restart { after_s }),
        (time(), time()).prop_map(|(every_s, for_s)| ProcessFault::Flap { every_s, for_s }),
        (time(), option::of(time())).prop_map(|(by_s, for_s)| ProcessFault::Slow { by_s, for_s }),
        (0.1..100.0, option::of(time())).prop_map(|(to_m_s, for_s)| ProcessFault::Weaken { to_m_s, for_s }),
        (-3.0..3.0, option::of(time()))
            .prop_map(|(turn_rate_rad_s, for_s)| ProcessFault::Jam { turn_rate_rad_s, for_s }),
        (drift(), option::of(time())).prop_map(|(drift, for_s)| ProcessFault::Drift { drift, for_s }),
    ]
}

fn drift() -> impl Strategy<Value = SensorDrift> {
    prop_oneof![
        (0.01..9.0, -6.0..6.0)
            .prop_map(|(speed_m_s, toward_rad)| SensorDrift::Position { speed_m_s, toward_rad }),
        (-3.0..3.0).prop_map(|rate_rad_s| SensorDrift::Heading { rate_rad_s }),
    ]
}

fn links() -> impl Strategy<Value = Links> {
    let sender = prop_oneof![
        Just(Sender::All),
        Just(Sender::Leader),
        Just(Sender::Own),
        Just(Sender::Traffic),
        (1..99_u32).prop_map(Sender::Uav)
    ];
    let receiver = prop_oneof![Just(Receiver::All), (1..99_u32).prop_map(Receiver::Uav)];
    prop_oneof![
        (sender, receiver).prop_map(|(from, to)| Links::From(from, to)),
        (1..50_u32, 50..99_u32).prop_map(|(one, other)| Links::Between(one, other)),
        Just(Links::All),
        (1..9_u32, 9..20_u32).prop_map(|(cut, last)| {
            Links::Partition(vec![(1..=cut).collect(), (cut + 1..=last).collect()])
        }),
        (1..99_u32).prop_map(Links::Isolate),
    ]
}

fn delay() -> impl Strategy<Value = Delay> {
    prop_oneof![
        time().prop_map(|by_s| Delay::Constant { by_s }),
        (time(), time()).prop_map(|(by_s, jitter_s)| Delay::Uniform { by_s, jitter_s }),
        (time(), time()).prop_map(|(by_s, deviation_s)| Delay::Normal { by_s, deviation_s }),
        (time(), time(), 1.01..9.0_f64).prop_map(|(by_s, tail_s, shape)| Delay::Pareto {
            by_s,
            tail_s,
            shape
        }),
        vec(time(), 1..9).prop_map(Delay::Trace),
        "[a-z/. ]{1,12}".prop_map(Delay::File),
    ]
}

fn impairment() -> impl Strategy<Value = LinkImpairment> {
    prop_oneof![
        delay().prop_map(LinkImpairment::Delay),
        probability().prop_map(LinkImpairment::Loss),
        (probability(), probability(), probability(), probability())
            .prop_map(|(p, r, h, k)| LinkImpairment::Gilbert { p, r, h, k }),
        (probability(), time()).prop_map(|(loss, burst_s)| LinkImpairment::GilbertBurst { loss, burst_s }),
        Just(LinkImpairment::Blackout),
        probability().prop_map(LinkImpairment::Corrupt),
        (time(), 1..=10_000_u32)
            .prop_map(|(samples_per_s, queue)| LinkImpairment::Rate { samples_per_s, queue }),
        Just(LinkImpairment::Hold),
        Just(LinkImpairment::Stuck),
        probability().prop_map(LinkImpairment::Duplicate),
        (probability(), time()).prop_map(|(p, by_s)| LinkImpairment::Reorder { p, by_s }),
        (-1e3..1e3_f64, -1e3..1e3_f64, heading()).prop_map(|(x_m, y_m, heading_rad)| LinkImpairment::Bias {
            x_m,
            y_m,
            heading_rad
        }),
        (0.0..1e3_f64, heading()).prop_map(|(position_m, heading)| LinkImpairment::Noise {
            position_m,
            heading_rad: heading.abs()
        }),
    ]
}

fn any_action() -> impl Strategy<Value = Action> {
    prop_oneof![
        (fault(), targets()).prop_map(|(fault, targets)| Action::Process { fault, targets }),
        (links(), impairment(), option::of(time())).prop_map(|(links, impairment, for_s)| Action::Link {
            links,
            impairment,
            for_s
        }),
        links().prop_map(Action::Heal),
    ]
}

proptest! {
    #[test]
    fn a_written_fault_parses_to_the_same_fault(at_s in time(), action in any_action()) {
        let fault = Fault { at_s, action };
        prop_assert_eq!(fault.to_string().parse::<Fault>(), Ok(fault.clone()));
    }

    #[test]
    fn no_sentence_makes_the_parser_panic(text in ".{0,60}", words in vec("[a-z{},|<>\\-%0-9. ]{0,6}|kill|link|all|delay|for", 0..9)) {
        let _ = text.parse::<Fault>();
        let _ = words.join(" ").parse::<Action>();
        let _ = format!("at 3 s {}", words.join(" ")).parse::<Fault>();
    }

    #[test]
    fn a_schedule_is_in_order_and_thaws_what_it_freezes_for_a_time(at_s in vec(0.0..99.0_f64, 1..9), for_s in time()) {
        let freeze = |at_s| Fault { at_s, action: Action::Process {
            fault: ProcessFault::Freeze { for_s: Some(for_s) }, targets: Targets::Random(2),
        } };
        let faults: Vec<_> = at_s.into_iter().map(freeze).collect();
        let actions = schedule(&faults, 3).scheduled_actions();
        prop_assert!(actions.is_sorted_by_key(|one| one.tick));
        let count = |action| actions.iter().filter(|one| one.action == action).count();
        prop_assert_eq!(count(ProcessAction::Freeze), count(ProcessAction::Thaw));
    }
}

#[test]
fn the_words_that_may_follow_come_from_the_grammar() {
    assert!(next_words("").contains(&"kill".to_owned()) && next_words("").contains(&"at".to_owned()));
    assert_eq!(next_words("freeze uav 3"), ["for"]);
    assert_eq!(next_words("at 30"), ["s", "ms"]);
    assert_eq!(next_words("at 30 s restart random 2"), ["uavs", "uav"]);
    assert_eq!(next_words("link leader->"), ["all"]);
    assert!(next_words("link all").contains(&"blackout".to_owned()));
    assert_eq!(next_words("kill nobody"), [""; 0]);
}
