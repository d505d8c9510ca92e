use super::*;
use ringwing_flight::draw::Draws;

fn arena(budget: &str) -> Arena {
    Arena::new(&budget.parse().unwrap(), &Scenario::default()).unwrap()
}

fn gene(draws: &mut Draws) -> Gene {
    // A third of the numbers are at the ends of their range, where rounding would exceed a bound.
    let mut number = || match (draws.uniform() * 6.0) as u32 {
        0 => 0.0,
        1 => 1.0,
        _ => draws.uniform(),
    };
    Gene { time: number(), target: number(), length: number(), kind: number(), magnitude: number() }
}

fn drawn(arena: &Arena, moment: u64) -> Candidate {
    let mut draws = Draws::new(3, [1, 2, 3], moment);
    (0..arena.shapes().len()).map(|_| gene(&mut draws)).collect()
}

const BUDGETS: [&str; 5] = [
    "2 kills, 1 link fault of at most 1 s, loss at most 30 %",
    "3 restarts of at most 7.3 s, 2 flaps of at most 0.055 s, 1 freeze of at most 333 ms, from 10 s to 10.5 s",
    "2 isolations of at most 0.25 s, 1 network fault of at most 40 ms, delay at most 77 ms, blackout",
    "1 freeze of at most 1 s, 1 freeze of at most 9 s, 4 link faults of at most 3 s, loss at most 0.05 %",
    "6 link faults of at most 2 s, 1 isolation of at most 1 s",
];

#[test]
fn a_window_of_one_tick_is_that_tick_however_its_time_rounds() {
    // 1.1 and 2.3 are no binary numbers: times 100, one lies just above a whole number and the other just below.
    for at_s in [1.1, 2.3] {
        let arena = arena(&format!("1 kill, from {at_s} s to {at_s} s"));
        let faults = arena.faults(&drawn(&arena, 1));
        assert!(faults.iter().all(|fault| fault.at_s == at_s), "{faults:?}");
        assert_eq!(arena.excess(&faults), None);
    }
}

#[test]
fn no_candidate_ever_exceeds_its_budget() {
    for budget in BUDGETS {
        let arena = arena(budget);
        for moment in 0..2000 {
            let faults = arena.faults(&drawn(&arena, moment));
            assert!(faults.len() <= arena.shapes().len());
            assert_eq!(arena.excess(&faults), None, "{budget}: {faults:?}");
        }
    }
}

#[test]
fn every_candidate_is_a_scenario_that_its_own_text_reads_back() {
    for budget in BUDGETS {
        let arena = arena(budget);
        for moment in 0..50 {
            let faults = arena.faults(&drawn(&arena, moment));
            let scenario = Scenario::default().with_faults(&faults).unwrap();
            assert_eq!(Scenario::resolved(&scenario.to_toml()).unwrap().faults, faults, "{budget}");
        }
    }
}

#[test]
fn every_target_and_every_impairment_is_reached() {
    let arena = arena("1 link fault of at most 1 s");
    let faults: Vec<_> = (0..3000).flat_map(|moment| arena.faults(&drawn(&arena, moment))).collect();
    let has = |words: &str| faults.iter().any(|fault| fault.to_string().contains(words));
    for words in
        ["link 1->2 ", "link 2->1 ", "link 1<->2 ", "link 6->1 ", "leader->6", "blackout", "loss", "delay"]
    {
        assert!(has(words), "{words}");
    }
    assert!(faults.len() < 3000, "some candidates leave the fault out");
}

#[test]
fn what_exceeds_a_budget_is_named() {
    let excess = |budget: &str, faults: &[&str]| {
        let faults: Vec<_> = faults.iter().map(|text| text.parse().unwrap()).collect();
        arena(budget).excess(&faults)
    };
    let kills = "2 kills, from 5 s to 20 s";
    assert_eq!(excess(kills, &["at 5 s kill uav 1", "at 20 s kill uav 1"]), None);
    for (budget, faults) in [
        (kills, ["at 6 s kill uav 1", "at 7 s kill uav 2", "at 8 s kill uav 3"].as_slice()),
        (kills, &["at 4.99 s kill uav 1"]),
        (kills, &["at 6 s kill uav 1,2"]),
        (kills, &["at 6 s kill leader"]),
        (kills, &["at 6 s freeze uav 1 for 1 s"]),
        ("1 freeze of at most 1 s", &["at 6 s freeze uav 1 for 1.01 s"]),
        ("1 freeze of at most 1 s", &["at 6 s freeze uav 1"]),
        (
            "1 freeze of at most 1 s, 1 freeze of at most 3 s",
            &["at 6 s freeze uav 1 for 2 s", "at 9 s freeze uav 2 for 2 s"],
        ),
        ("1 link fault of at most 1 s, loss at most 30 %", &["at 6 s link 1->2 loss 31 % for 1 s"]),
        ("1 link fault of at most 1 s, loss at most 30 %", &["at 6 s link 1->2 blackout for 1 s"]),
        ("1 link fault of at most 1 s, loss at most 30 %", &["at 6 s link all loss 10 % for 1 s"]),
        ("1 link fault of at most 1 s, loss at most 30 %", &["at 6 s link 1->2 loss 10 %"]),
    ] {
        assert!(excess(budget, faults).is_some(), "{budget}: {faults:?}");
    }
}

#[test]
fn the_faults_of_the_scenario_itself_cost_nothing_unless_they_are_changed() {
    let own = vec!["at 30 s kill leader".parse().unwrap()];
    let scenario = Scenario { faults: own, ..Scenario::default() };
    let arena = Arena::new(&"1 kill".parse().unwrap(), &scenario).unwrap();
    let faults = |texts: &[&str]| texts.iter().map(|text| text.parse().unwrap()).collect::<Vec<Fault>>();
    assert_eq!(arena.excess(&faults(&["at 30 s kill leader", "at 1 s kill uav 1"])), None);
    assert_eq!(arena.excess(&faults(&["at 1 s kill uav 1"])), None);
    assert!(arena.excess(&faults(&["at 20 s kill leader"])).is_some());
    assert!(arena.excess(&faults(&["at 30 s kill leader", "at 30 s kill leader"])).is_some());
}

#[test]
fn a_window_outside_the_flight_and_times_below_a_tick_are_refused() {
    let refusal = |budget: &str| Arena::new(&budget.parse().unwrap(), &Scenario::default()).unwrap_err();
    assert!(refusal("1 kill, from 10 s to 91 s").contains("the flight ends at 90 s"));
    assert!(refusal("1 kill, from 10.001 s to 10.009 s").contains("no tick"));
    assert!(refusal("1 freeze of at most 9 ms").contains("a tick takes 0.01 s"));
    assert!(refusal("1 isolation of at most 1 s, delay at most 4 ms").contains("a tick takes 0.01 s"));
    assert_eq!(arena("1 kill").window_s(), (0.0, 45.0));
}

#[test]
fn only_numbers_that_mean_something_are_open() {
    let shapes = |budget: &str| {
        let shape = |shape: Shape| [shape.has_length, shape.has_kind, shape.has_magnitude];
        arena(budget).shapes().into_iter().map(shape).collect::<Vec<_>>()
    };
    assert_eq!(shapes("1 kill, 1 freeze of at most 1 s"), [[false; 3], [true, false, false]]);
    assert_eq!(shapes("1 flap of at most 9 s"), [[true, false, true]]);
    assert_eq!(shapes("1 link fault of at most 1 s, loss at most 30 %"), [[true, false, true]]);
    assert_eq!(shapes("1 link fault of at most 1 s, blackout"), [[true, false, false]]);
    assert_eq!(shapes("1 isolation of at most 1 s"), [[true; 3]]);
}
