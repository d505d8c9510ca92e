use super::{sample::test_state, *};
use ringwing_flight::LinkSource;
use ringwing_scenario::{Fault, FaultSchedule, fault::schedule::LinkFault};
use std::convert::Infallible;

/// The link from UAV 2 to UAV 3 in lockstep, with the faults of `sentences`.
fn receiver(sentences: &[&str]) -> LinkReceiver<UavState> {
    let faults: Vec<Fault> = sentences.iter().map(|text| text.parse().unwrap()).collect();
    let faults: Vec<LinkFault> =
        FaultSchedule { faults: &faults, seed: 1, rate_hz: 100, uavs: 6 }.link_faults();
    let route = Route { source: LinkSource::uav(UavId(2)), to: UavId(3), latency_ticks: 1 };
    LinkReceiver::new(route, LinkSettings { seed: 1, rate_hz: 100, pace: Pace::Lockstep }, &faults)
}

/// The ticks of the samples that are used in `now`, when those of `available` can be polled; and how many were polled.
fn received(receiver: &mut LinkReceiver<UavState>, now: i64, available: &[i64]) -> (Vec<i64>, usize) {
    let (mut used, mut polled) = (Vec::new(), 0);
    let poll = |take: &mut Take<UavState>| -> Result<(), Infallible> {
        for tick in available {
            polled += 1;
            if take(&test_state(*tick)) {
                break;
            }
        }
        Ok(())
    };
    let Ok(()) = receiver.receive(Tick(now), poll, |state| used.push(state.tick.0));
    (used, polled)
}

#[test]
fn polling_stops_at_the_newest_usable_sample_with_and_without_faults() {
    for sentences in [&[] as &[&str], &["at 9 s link all blackout"]] {
        let mut receiver = receiver(sentences);
        received(&mut receiver, 0, &[]);
        assert_eq!(received(&mut receiver, 1, &[0, 1]), (vec![0], 1));
        assert_eq!(received(&mut receiver, 2, &[2, 1]), (vec![1], 2));
        assert_eq!(received(&mut receiver, 3, &[3]), (vec![2], 0), "it has arrived before");
    }
}

#[test]
fn a_closed_receiver_polls_nothing_and_is_a_newcomer_when_it_opens_again() {
    let mut receiver = receiver(&[]);
    received(&mut receiver, 0, &[0]);
    receiver.close();
    assert_eq!(received(&mut receiver, 1, &[0, 1]), (vec![], 0));
    receiver.open();
    assert_eq!(received(&mut receiver, 2, &[1, 2]), (vec![], 2), "sent before its first tick");
    assert_eq!(received(&mut receiver, 3, &[3]), (vec![2], 0));
}

#[test]
fn closing_loses_what_is_in_flight_and_keeps_the_counts() {
    let mut receiver = receiver(&["at 0 s link 2->3 delay 1 s"]);
    for now in 0..5 {
        received(&mut receiver, now, &[now - 1]);
    }
    receiver.close();
    let counts = receiver.counts(Tick(5)).unwrap();
    assert_eq!((counts.offered, counts.lost, counts.in_flight), (4, 4, 0));
}

#[test]
fn a_sample_that_a_fault_loses_has_arrived_all_the_same() {
    let mut receiver = receiver(&["at 0 s link 2->3 blackout"]);
    received(&mut receiver, 0, &[]);
    assert_eq!(receiver.newest_arrived(), None);
    assert_eq!(received(&mut receiver, 1, &[0]), (vec![], 1));
    assert_eq!(receiver.newest_arrived(), Some(Tick(0)));
}

#[test]
fn only_a_link_with_faults_has_counts() {
    assert_eq!(receiver(&["at 0 s link 3->2 blackout"]).counts(Tick(0)), None);
    assert!(receiver(&["at 0 s link 2->3 blackout"]).counts(Tick(0)).is_some());
}
