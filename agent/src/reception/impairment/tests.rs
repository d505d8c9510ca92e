use super::*;
use crate::reception::sample::test_state as state;
use proptest::{collection::vec, prelude::*};
use ringwing_flight::UavState;
use ringwing_scenario::{Fault, Schedule};

const RATE_HZ: u32 = 100;

fn link_faults(sentences: &[&str]) -> Vec<LinkFault> {
    let faults: Vec<Fault> = sentences.iter().map(|text| text.parse().unwrap()).collect();
    Schedule { faults: &faults, seed: 1, rate_hz: RATE_HZ, uavs: 6 }.link_faults()
}

fn link(source: Source, to: u32, seed: u64, sentences: &[&str]) -> Impairment<UavState> {
    let mut link = Impairment::new(Route { source, to: UavId(to), latency_ticks: 1 }, seed, RATE_HZ);
    link.set_faults(&link_faults(sentences));
    link
}

/// What arrives at which tick while one sample is sent in each of `0..ticks`, and then for a while longer.
fn flown(link: &mut Impairment<UavState>, ticks: i64) -> Vec<(i64, UavState)> {
    let mut arrived = Vec::new();
    for now in 0..ticks + 200 {
        if now < ticks {
            link.offer(state(now));
        }
        link.deliver(Tick(now), |sample| arrived.push((now, sample)));
    }
    arrived
}

/// When what arrived, as (arrival, sending).
fn times(sentences: &[&str], ticks: i64) -> Vec<(i64, i64)> {
    let arrived = flown(&mut link(Source::Uav(2), 3, 1, sentences), ticks);
    arrived.into_iter().map(|(now, sample)| (now, sample.tick.0)).collect()
}

#[test]
fn a_sound_link_is_clear_and_a_troubled_one_without_a_fault_at_the_moment_delivers_the_next_tick() {
    assert!(link(Source::Uav(2), 3, 1, &["at 0 s link 3->2 blackout"]).is_clear());
    let late = link(Source::Uav(2), 3, 1, &["at 9 s link 2->3 blackout"]);
    assert!(!late.is_clear());
    assert_eq!(times(&["at 9 s link 2->3 blackout"], 3), [(1, 0), (2, 1), (3, 2)]);
}

#[test]
fn a_delay_holds_what_is_sent_while_it_lasts() {
    let arrived = times(&["at 0.01 s link 2->3 delay 50 ms for 20 ms"], 5);
    assert_eq!(arrived, [(1, 0), (4, 3), (5, 4), (7, 1), (8, 2)]);
}

#[test]
fn delays_of_several_faults_add_up() {
    let arrived = times(&["at 0 s link 2->3 delay 30 ms", "at 0 s link all delay 20 ms"], 2);
    assert_eq!(arrived, [(6, 0), (7, 1)]);
}

#[test]
fn a_trace_is_followed_sample_by_sample_and_begins_again() {
    let arrived = times(&["at 0.01 s link 2->3 delay trace {0 s, 20 ms}"], 5);
    assert_eq!(arrived, [(1, 0), (2, 1), (4, 3), (5, 2), (7, 4)]);
}

#[test]
fn what_is_held_comes_at_once() {
    let arrived = times(&["at 0.01 s link 2->3 hold for 30 ms"], 6);
    assert_eq!(arrived, [(1, 0), (4, 1), (4, 2), (4, 3), (5, 4), (6, 5)]);
    let healed = times(&["at 0.01 s link 2->3 hold", "at 0.04 s heal link 2->3"], 6);
    assert_eq!(arrived, healed);
}

#[test]
fn a_blackout_loses_what_is_sent_in_it_and_nothing_else() {
    assert_eq!(times(&["at 0.01 s isolate 3 for 20 ms"], 5), [(1, 0), (4, 3), (5, 4)]);
}

#[test]
fn a_stuck_link_shows_the_last_value_as_if_it_were_new() {
    let arrived = flown(&mut link(Source::Uav(2), 3, 1, &["at 0.02 s link 2->3 stuck for 20 ms"]), 5);
    let shown: Vec<_> = arrived.iter().map(|(_, sample)| (sample.tick.0, sample.position_m[0])).collect();
    assert_eq!(shown, [(0, 0.0), (1, 1.0), (2, 1.0), (3, 1.0), (4, 4.0)]);
}

#[test]
fn values_are_off_by_what_was_said() {
    let arrived =
        flown(&mut link(Source::Uav(2), 3, 1, &["at 0 s link all bias x 3 m y -1 m heading 0.5 rad"]), 1);
    let (_, sample) = arrived[0];
    assert_eq!((sample.position_m, sample.heading_rad), ([3.0, -1.0], 0.5));
    let noisy = flown(&mut link(Source::Uav(2), 3, 1, &["at 0 s link all noise position 2 m"]), 4000);
    let squares: f64 =
        noisy.iter().map(|(_, sample)| (sample.position_m[0] - sample.tick.0 as f64).powi(2)).sum();
    assert!((squares / 4000.0 - 4.0).abs() < 0.3, "variance {}", squares / 4000.0);
    assert!(noisy.iter().all(|(_, sample)| sample.heading_rad == 0.0));
}

#[test]
fn samples_are_lost_as_often_as_said_and_two_losses_are_independent() {
    let share = |sentences: &[&str]| 1.0 - times(sentences, 20_000).len() as f64 / 20_000.0;
    assert!((share(&["at 0 s link all loss 30 %"]) - 0.3).abs() < 0.01);
    assert!((share(&["at 0 s link all loss 30 %", "at 0 s link 2->3 loss 30 %"]) - 0.51).abs() < 0.01);
    // Bad for a tenth of the time on the average.
    assert!((share(&["at 0 s link all gilbert 1 % 9 %"]) - 0.1).abs() < 0.02);
    assert!((share(&["at 0 s link all gilbert 1 % 9 % 1 0.5"]) - 0.45).abs() < 0.02);
}

#[test]
fn losses_of_a_gilbert_link_come_in_bursts() {
    let arrived = times(&["at 0 s link all gilbert 1 % 10 %"], 100_000);
    let bursts = arrived.windows(2).filter(|pair| pair[1].1 > pair[0].1 + 1).count();
    let lost = 100_000 - arrived.len();
    let mean = lost as f64 / bursts as f64;
    assert!((9.0..11.0).contains(&mean), "bursts of {mean} on the average");
}

#[test]
fn what_is_held_back_is_overtaken() {
    let arrived = times(&["at 0 s link all reorder 25 %"], 1000);
    assert_eq!(arrived.len(), 1000);
    let overtaken = arrived.windows(2).filter(|pair| pair[1].1 < pair[0].1).count();
    assert!(overtaken > 100, "{overtaken}");
    assert!(arrived.iter().all(|(now, sent)| now - sent == 1 || now - sent == 6));
}

#[test]
fn a_fault_on_another_link_changes_no_draw() {
    let alone = times(&["at 0 s link 2->3 loss 50 %"], 500);
    assert_eq!(
        alone,
        times(&["at 0 s link 3->2 loss 50 %", "at 0 s link 2->3 loss 50 %", "at 0 s isolate 5"], 500)
    );
    let other = flown(&mut link(Source::Uav(4), 3, 1, &["at 0 s link all loss 50 %"]), 500);
    assert_ne!(alone, other.into_iter().map(|(now, sample)| (now, sample.tick.0)).collect::<Vec<_>>());
}

const WEATHER: [&str; 5] = [
    "at 0 s link all loss 20 %",
    "at 0 s link 2->3 gilbert 5 % 20 %",
    "at 0 s link 2->3 delay 40 ms jitter 40 ms",
    "at 0 s link all duplicate 20 %",
    "at 0 s link all noise position 2 m heading 1 deg",
];

#[test]
fn a_receiver_that_is_started_again_meets_the_same_weather() {
    let all = flown(&mut link(Source::Uav(2), 3, 7, &WEATHER), 600);
    let mut again = link(Source::Uav(2), 3, 7, &WEATHER);
    let mut later = Vec::new();
    for now in 300..800 {
        if now < 600 {
            again.offer(state(now));
        }
        again.deliver(Tick(now), |sample| later.push((now, sample)));
    }
    let sent_later: Vec<_> = all.into_iter().filter(|(_, sample)| sample.tick.0 >= 300).collect();
    assert!(later.len() > 150);
    assert_eq!(later, sent_later);
}

proptest! {
    #[test]
    fn the_sums_balance_whatever_is_wrong(
        which in vec(0..9_usize, 1..6), seed: u64, ticks in 1..300_i64,
        order in vec(0..3_i64, 300),
    ) {
        let all = [
            &WEATHER[..], &["at 0.5 s link 2->3 hold for 1 s", "at 1 s isolate 3 for 500 ms",
            "at 0 s link all reorder 30 % by 90 ms", "at 0.2 s link all stuck for 1 s"],
        ].concat();
        let sentences: Vec<&str> = which.iter().map(|index| all[*index]).collect();
        let mut link = link(Source::Uav(2), 3, seed, &sentences);
        let mut delivered = 0;
        for now in 0..ticks {
            // Some come a tick early, some together.
            (0..order[now as usize]).for_each(|ahead| link.offer(state(now + ahead)));
            link.deliver(Tick(now), |sample| {
                assert!(sample.tick < Tick(now), "never before it can be used");
                delivered += 1;
            });
            let counts = link.counts(Tick(now));
            prop_assert_eq!(counts.offered + counts.duplicated, counts.delivered + counts.lost + counts.in_flight);
            prop_assert!(counts.delivered == delivered && counts.late <= delivered);
        }
    }
}
