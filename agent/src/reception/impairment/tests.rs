use super::*;
use crate::reception::sample::test_state as state;
use proptest::{collection::vec, prelude::*};
use ringwing_flight::{LinkSource, UavId, UavState};
use ringwing_scenario::{Fault, FaultSchedule};

const RATE_HZ: u32 = 100;

fn link_faults(sentences: &[&str]) -> Vec<LinkFault> {
    let faults: Vec<Fault> = sentences.iter().map(|text| text.parse().unwrap()).collect();
    FaultSchedule { faults: &faults, seed: 1, rate_hz: RATE_HZ, uavs: 6 }.link_faults()
}

fn link(source: LinkSource, to: u32, seed: u64, sentences: &[&str]) -> ImpairedLink<UavState> {
    let mut link = ImpairedLink::new(Route { source, to: UavId(to), latency_ticks: 1 }, seed, RATE_HZ);
    link.set_faults(&link_faults(sentences));
    link
}

/// What arrives in which tick, if one sample is sent in each of the ticks `0..ticks`.
fn arrivals_of(link: &mut ImpairedLink<UavState>, ticks: i64) -> Vec<(i64, UavState)> {
    let mut arrived = Vec::new();
    for now in 0..ticks + 200 {
        if now < ticks {
            link.offer(state(now));
        }
        link.deliver(Tick(now), |sample| arrived.push((now, sample)));
    }
    arrived
}

/// The same as pairs of ticks: (arrival, sending).
fn times(sentences: &[&str], ticks: i64) -> Vec<(i64, i64)> {
    let arrived = arrivals_of(&mut link(LinkSource::uav(UavId(2)), 3, 1, sentences), ticks);
    arrived.into_iter().map(|(now, sample)| (now, sample.tick.0)).collect()
}

#[test]
fn only_a_link_without_any_fault_is_clear_and_a_fault_to_come_changes_nothing_yet() {
    assert!(link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link 3->2 blackout"]).is_clear());
    let late = link(LinkSource::uav(UavId(2)), 3, 1, &["at 9 s link 2->3 blackout"]);
    assert!(!late.is_clear());
    assert_eq!(times(&["at 9 s link 2->3 blackout"], 3), [(1, 0), (2, 1), (3, 2)]);
}

#[test]
fn a_delay_applies_to_the_samples_that_are_sent_while_it_is_on() {
    let arrived = times(&["at 0.01 s link 2->3 delay 50 ms for 20 ms"], 5);
    assert_eq!(arrived, [(1, 0), (4, 3), (5, 4), (7, 1), (8, 2)]);
}

#[test]
fn the_delays_of_several_faults_add_up() {
    let arrived = times(&["at 0 s link 2->3 delay 30 ms", "at 0 s link all delay 20 ms"], 2);
    assert_eq!(arrived, [(6, 0), (7, 1)]);
}

#[test]
fn a_trace_gives_one_delay_per_tick_and_repeats() {
    let arrived = times(&["at 0.01 s link 2->3 delay trace {0 s, 20 ms}"], 5);
    assert_eq!(arrived, [(1, 0), (2, 1), (4, 3), (5, 2), (7, 4)]);
}

#[test]
fn held_samples_arrive_together_when_the_hold_ends() {
    let arrived = times(&["at 0.01 s link 2->3 hold for 30 ms"], 6);
    assert_eq!(arrived, [(1, 0), (4, 1), (4, 2), (4, 3), (5, 4), (6, 5)]);
    let healed = times(&["at 0.01 s link 2->3 hold", "at 0.04 s heal link 2->3"], 6);
    assert_eq!(arrived, healed);
}

#[test]
fn a_blackout_loses_only_the_samples_that_are_sent_during_it() {
    assert_eq!(times(&["at 0.01 s isolate 3 for 20 ms"], 5), [(1, 0), (4, 3), (5, 4)]);
}

#[test]
fn a_stuck_link_repeats_the_last_true_value_with_new_ticks() {
    let arrived =
        arrivals_of(&mut link(LinkSource::uav(UavId(2)), 3, 1, &["at 0.02 s link 2->3 stuck for 20 ms"]), 5);
    let shown: Vec<_> = arrived.iter().map(|(_, sample)| (sample.tick.0, sample.position_m[0])).collect();
    assert_eq!(shown, [(0, 0.0), (1, 1.0), (2, 1.0), (3, 1.0), (4, 4.0)]);
}

#[test]
fn bias_and_noise_displace_a_sample_by_the_given_amounts() {
    let arrived = arrivals_of(
        &mut link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link all bias x 3 m y -1 m heading 0.5 rad"]),
        1,
    );
    let (_, sample) = arrived[0];
    assert_eq!((sample.position_m, sample.heading_rad), ([3.0, -1.0], 0.5));
    let noisy = arrivals_of(
        &mut link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link all noise position 2 m"]),
        4000,
    );
    let squares: f64 =
        noisy.iter().map(|(_, sample)| (sample.position_m[0] - sample.tick.0 as f64).powi(2)).sum();
    assert!((squares / 4000.0 - 4.0).abs() < 0.3, "variance {}", squares / 4000.0);
    assert!(noisy.iter().all(|(_, sample)| sample.heading_rad == 0.0));
}

#[test]
fn noise_displaces_a_heading_by_the_given_amount() {
    let sentence = ["at 0 s link all noise heading 0.2 rad"];
    let noisy = arrivals_of(&mut link(LinkSource::uav(UavId(2)), 3, 1, &sentence), 4000);
    let variance = noisy.iter().map(|(_, sample)| sample.heading_rad.powi(2)).sum::<f64>() / 4000.0;
    assert!((variance - 0.04).abs() < 0.003, "{variance}");
    assert!(noisy.iter().all(|(_, sample)| sample.position_m == [sample.tick.0 as f64, 0.0]));
}

/// The mean and the standard deviation of the delays that this fault gives, and the extremes, in ticks.
fn delays(sentence: &str) -> (f64, f64, [i64; 2]) {
    let delays: Vec<i64> = times(&[sentence], 20_000).iter().map(|(now, sent)| now - sent - 1).collect();
    let mean_of = |of: &dyn Fn(f64) -> f64| {
        delays.iter().map(|delay| of(*delay as f64)).sum::<f64>() / delays.len() as f64
    };
    let mean = mean_of(&|delay| delay);
    let deviation = mean_of(&|delay| (delay - mean).powi(2)).sqrt();
    (mean, deviation, [delays.iter().copied().min().unwrap(), delays.iter().copied().max().unwrap()])
}

#[test]
fn a_delay_has_the_distribution_that_its_fault_names() {
    let (mean, _, extremes) = delays("at 0 s link all delay 200 ms jitter 150 ms");
    assert!((mean - 20.0).abs() < 0.2 && extremes == [5, 35], "uniform: {mean}, {extremes:?}");
    let (mean, deviation, _) = delays("at 0 s link all delay 500 ms normal 100 ms");
    assert!((mean - 50.0).abs() < 0.3 && (deviation - 10.0).abs() < 0.3, "normal: {mean}, {deviation}");
    let (mean, _, [least, _]) = delays("at 0 s link all delay 100 ms pareto 200 ms shape 8");
    assert!((mean - 30.0).abs() < 0.6 && least == 10, "Pareto: {mean}, at least {least}");
}

#[test]
fn losses_have_the_given_probability_and_two_losses_are_independent() {
    let share = |sentences: &[&str]| 1.0 - times(sentences, 20_000).len() as f64 / 20_000.0;
    assert!((share(&["at 0 s link all loss 30 %"]) - 0.3).abs() < 0.01);
    assert!((share(&["at 0 s link all loss 30 %", "at 0 s link 2->3 loss 30 %"]) - 0.51).abs() < 0.01);
    // The chain is in its bad state for a tenth of the time on average.
    assert!((share(&["at 0 s link all gilbert 1 % 9 %"]) - 0.1).abs() < 0.02);
    assert!((share(&["at 0 s link all gilbert 1 % 9 % 1 0.5"]) - 0.45).abs() < 0.02);
}

#[test]
fn a_gilbert_link_loses_samples_in_bursts() {
    let arrived = times(&["at 0 s link all gilbert 1 % 10 %"], 100_000);
    let bursts = arrived.windows(2).filter(|pair| pair[1].1 > pair[0].1 + 1).count();
    let lost = 100_000 - arrived.len();
    let mean = lost as f64 / bursts as f64;
    assert!((9.0..11.0).contains(&mean), "bursts of {mean} on average");
}

#[test]
fn a_gilbert_link_by_loss_and_burst_loses_as_much_and_in_such_bursts_as_it_says() {
    for (sentence, share, burst) in [
        ("at 0 s link all gilbert loss 5 % burst 80 ms", 0.05, 8.0),
        ("at 0 s link all gilbert loss 30 % burst 200 ms", 0.3, 20.0),
        ("at 0 s link all gilbert loss 20 % burst 10 ms", 0.2, 1.0),
    ] {
        let arrived = times(&[sentence], 100_000);
        let lost = (100_000 - arrived.len()) as f64;
        let bursts = arrived.windows(2).filter(|pair| pair[1].1 > pair[0].1 + 1).count() as f64;
        assert!((lost / 100_000.0 / share - 1.0).abs() < 0.12, "{sentence}: lost {}", lost / 100_000.0);
        assert!((lost / bursts / burst - 1.0).abs() < 0.12, "{sentence}: bursts of {}", lost / bursts);
    }
}

#[test]
fn a_gilbert_link_loses_the_same_samples_in_whatever_order_they_come() {
    let sentence = ["at 0 s link all gilbert 30 % 30 %"];
    let arrived = |order: &[i64]| {
        let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &sentence);
        let mut arrived = Vec::new();
        for (now, sent) in (1000..).zip(order) {
            link.offer(state(*sent));
            link.deliver(Tick(now), |sample| arrived.push(sample.tick));
        }
        arrived.sort_unstable();
        arrived
    };
    let in_order: Vec<i64> = (0..400).collect();
    let in_pairs: Vec<i64> = in_order.chunks(2).flat_map(|pair| [pair[1], pair[0]]).collect();
    assert_eq!(arrived(&in_order), arrived(&in_pairs));
}

#[test]
fn a_corrupted_sample_is_dropped_and_counted_apart_from_lost_ones() {
    let mut link =
        link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link all corrupt 20 %", "at 0 s link all loss 10 %"]);
    let counts = counts(&mut link, 19_999);
    assert!((counts.lost as f64 / 20_000.0 - 0.1).abs() < 0.01, "{counts:?}");
    // A sample that is lost arrives neither damaged nor whole.
    assert!((counts.corrupted as f64 / 20_000.0 - 0.18).abs() < 0.01, "{counts:?}");
    assert_eq!(counts.offered, counts.delivered + counts.lost + counts.corrupted + counts.in_flight);
}

#[test]
fn a_limited_link_carries_its_rate_and_delays_what_waits() {
    let sentence = "at 0 s link all rate 20 samples/s queue 3";
    let arrived = times(&[sentence], 1000);
    // Twenty a second for ten seconds, and nothing waits once the flow ends.
    assert_eq!(arrived.iter().filter(|(now, _)| *now <= 1000).count(), 200);
    let waits: Vec<i64> = arrived[5..150].iter().map(|(now, sent)| now - sent - 1).collect();
    assert!(
        waits.iter().all(|wait| *wait == 3),
        "the oldest of the queue has waited for three ticks: {waits:?}"
    );
    let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &[sentence]);
    let at_500 = counts(&mut link, 500);
    assert_eq!(at_500.offered, at_500.delivered + at_500.lost + at_500.in_flight);
    assert!(at_500.in_flight >= 3 && at_500.lost > 380, "{at_500:?}");
}

#[test]
fn what_waits_for_a_limited_link_arrives_when_the_limit_ends() {
    let arrived = times(&["at 0 s link all rate 1 samples/s queue 10 for 50 ms"], 8);
    assert_eq!(arrived, [(1, 0), (6, 1), (6, 2), (6, 3), (6, 4), (6, 5), (7, 6), (8, 7)]);
}

#[test]
fn a_restarted_receiver_of_a_limited_link_finds_the_same_openings_and_an_empty_queue() {
    let sentence = ["at 0 s link 2->3 rate 20 samples/s queue 1"];
    let openings = |first: i64| {
        let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &sentence);
        let mut arrived = Vec::new();
        for now in first..600 {
            link.offer(state(now));
            link.deliver(Tick(now), |sample| arrived.push((now, sample.tick.0)));
        }
        arrived.into_iter().filter(|(now, _)| *now > 320).collect::<Vec<_>>()
    };
    assert_eq!(openings(0), openings(303));
}

#[test]
fn a_delay_beyond_every_flight_is_a_loss_and_not_an_overflow() {
    assert_eq!(times(&["at 0 s link all delay 86400 s pareto 86400 s shape 1.01"], 50), []);
}

/// The numbers of the faults that altered a sample, if one sample is sent in each of the ticks `0..ticks`.
fn acted(sentences: &[&str], ticks: i64) -> Vec<u32> {
    let mut link = link(LinkSource::uav(UavId(2)), 3, 1, sentences);
    arrivals_of(&mut link, ticks);
    let mut numbers: Vec<u32> = link.news(Tick(ticks)).iter().map(|counts| counts.acted).collect();
    assert_eq!(link.news(Tick(ticks)), [], "each is news once");
    assert_eq!(link.all_acted(Tick(ticks)).len(), numbers.len());
    numbers.sort_unstable();
    numbers
}

#[test]
fn each_fault_that_alters_a_sample_is_reported_and_no_other() {
    let all = [
        "at 0 s link 3->2 blackout",
        "at 0.01 s link 2->3 loss 50 %",
        "at 0 s link 2->3 loss 0 %",
        "at 0 s link 2->3 delay 4 ms",
        "at 0 s link 2->3 delay 20 ms",
        "at 5 s link 2->3 blackout",
        "at 0 s link 2->3 hold for 1 s",
        "at 0 s link 2->3 stuck for 1 s",
        "at 0 s link 2->3 rate 20 samples/s",
        "at 0 s link 2->3 rate 200 samples/s",
        "at 0 s link 2->3 corrupt 50 %",
        "at 0 s link 2->3 duplicate 50 %",
        "at 0 s link 2->3 bias x 1 m",
        "at 0 s link 2->3 bias x 0 m",
        "at 0 s link 2->3 gilbert loss 50 % burst 50 ms",
    ];
    assert_eq!(acted(&all, 200), [2, 5, 7, 8, 9, 11, 12, 13, 15]);
    // A limit that nothing waits for changes nothing, and one under which samples wait has an effect before it drops one.
    assert_eq!(acted(&["at 0 s link 2->3 rate 200 samples/s"], 200), [0_u32; 0]);
    assert_eq!(acted(&["at 0 s link 2->3 rate 50 samples/s queue 1000"], 200), [1]);
    // The first sample that a stuck link repeats is a true one.
    assert_eq!(acted(&["at 0 s link 2->3 stuck"], 1), [0_u32; 0]);
    assert_eq!(acted(&["at 0 s link 2->3 stuck"], 2), [1]);
    // The sample of the held tick arrives after that tick anyway.
    assert_eq!(acted(&["at 0.5 s link 2->3 hold for 10 ms"], 200), [0_u32; 0]);
    assert_eq!(acted(&["at 0.5 s link 2->3 hold for 20 ms"], 200), [1]);
}

#[test]
fn a_reordered_sample_is_overtaken_by_later_ones() {
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
    let other = arrivals_of(&mut link(LinkSource::uav(UavId(4)), 3, 1, &["at 0 s link all loss 50 %"]), 500);
    assert_ne!(alone, other.into_iter().map(|(now, sample)| (now, sample.tick.0)).collect::<Vec<_>>());
}

const STORM: [&str; 7] = [
    "at 0 s link 2->3 corrupt 10 %",
    "at 0 s link 2->3 gilbert loss 10 % burst 50 ms",
    "at 0 s link all loss 20 %",
    "at 0 s link 2->3 gilbert 5 % 20 %",
    "at 0 s link 2->3 delay 40 ms jitter 40 ms",
    "at 0 s link all duplicate 20 %",
    "at 0 s link all noise position 2 m heading 1 deg",
];

#[test]
fn a_restarted_receiver_sees_the_same_faults() {
    let all = arrivals_of(&mut link(LinkSource::uav(UavId(2)), 3, 7, &STORM), 600);
    let mut again = link(LinkSource::uav(UavId(2)), 3, 7, &STORM);
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

/// The counts at the end of tick `now`, after one sample was sent in each of the ticks `0..=now`.
fn counts(link: &mut ImpairedLink<UavState>, now: i64) -> LinkCounts {
    for tick in 0..=now {
        link.offer(state(tick));
        link.deliver(Tick(tick), |_| ());
    }
    link.counts(Tick(now))
}

#[test]
fn every_sample_is_counted_once_as_delivered_lost_or_in_flight() {
    let none = LinkCounts::none(LinkSource::uav(UavId(2)), UavId(3));
    let faults = [
        // Sent in ticks 2 and 3, lost.
        "at 0.02 s link 2->3 blackout for 20 ms",
        // Sent in ticks 5 to 7: arrive in ticks 9, 10 and 11 instead of 6, 7 and 8.
        "at 0.05 s link 2->3 delay 30 ms for 30 ms",
    ];
    let at_10 = counts(&mut link(LinkSource::uav(UavId(2)), 3, 1, &faults), 10);
    // In flight: the sample of tick 7, and that of tick 10, which cannot be used yet.
    let expected = LinkCounts { offered: 11, delivered: 7, late: 2, lost: 2, in_flight: 2, ..none };
    assert_eq!(at_10, LinkCounts { tick: Tick(10), ..expected });
}

#[test]
fn every_copy_is_counted_as_duplicated_and_as_late() {
    let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link 2->3 duplicate 100 %"]);
    let at_4 = counts(&mut link, 4);
    // Delivered: the samples of ticks 0 to 3, and the copies of those of ticks 0 to 2, one tick later.
    assert_eq!((at_4.offered, at_4.duplicated, at_4.in_flight), (5, 5, 3));
    assert_eq!((at_4.delivered, at_4.late, at_4.lost), (7, 3, 0));
}

#[test]
fn samples_in_flight_are_lost_with_their_receiver() {
    let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &["at 0 s link 2->3 delay 1 s"]);
    counts(&mut link, 4);
    link.drop_all();
    let after = link.counts(Tick(4));
    assert_eq!((after.offered, after.lost, after.in_flight), (5, 5, 0));
    link.deliver(Tick(500), |sample| panic!("{sample:?} arrived"));
}

#[test]
fn what_waits_for_a_limited_link_is_lost_with_its_receiver_like_what_is_in_flight() {
    let sentences = ["at 0 s link 2->3 rate 50 samples/s queue 100", "at 0 s link 2->3 delay 1 s"];
    let mut link = link(LinkSource::uav(UavId(2)), 3, 1, &sentences);
    counts(&mut link, 19);
    link.drop_all();
    let after = link.counts(Tick(19));
    assert_eq!((after.offered, after.lost, after.in_flight), (20, 20, 0));
    link.deliver(Tick(500), |sample| panic!("{sample:?} arrived"));
}

proptest! {
    #[test]
    fn the_counts_balance_whatever_the_faults(
        which in vec(0..13_usize, 1..6), seed: u64, ticks in 1..300_i64,
        order in vec(0..3_i64, 300),
    ) {
        let all = [
            &STORM[..], &["at 0.5 s link 2->3 hold for 1 s", "at 1 s isolate 3 for 500 ms",
            "at 0 s link all reorder 30 % by 90 ms", "at 0.2 s link all stuck for 1 s",
            "at 0.3 s link all rate 20 samples/s for 1 s", "at 0 s link 2->3 rate 33 samples/s queue 2"],
        ].concat();
        let sentences: Vec<&str> = which.iter().map(|index| all[*index]).collect();
        let mut link = link(LinkSource::uav(UavId(2)), 3, seed, &sentences);
        let mut delivered = 0;
        for now in 0..ticks {
            // Some samples arrive a tick early, some together.
            (0..order[now as usize]).for_each(|ahead| link.offer(state(now + ahead)));
            link.deliver(Tick(now), |sample| {
                assert!(sample.tick < Tick(now), "no sample arrives before it can be used");
                delivered += 1;
            });
            let counts = link.counts(Tick(now));
            prop_assert_eq!(counts.offered + counts.duplicated, counts.delivered + counts.lost + counts.corrupted + counts.in_flight);
            prop_assert!(counts.delivered == delivered && counts.late <= delivered);
        }
    }
}
