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

/// The ticks of the samples that are used in `now`, when those of `kept` can be read; and the ticks that were read.
fn received(receiver: &mut LinkReceiver<UavState>, now: i64, kept: &[i64]) -> (Vec<i64>, Option<[i64; 2]>) {
    let (mut used, mut asked) = (Vec::new(), None);
    let read = |ticks: RangeInclusive<Tick>, take: &mut Take<UavState>| -> Result<(), Infallible> {
        asked = Some([ticks.start().0, ticks.end().0]);
        kept.iter().filter(|tick| ticks.contains(&Tick(**tick))).for_each(|tick| take(&test_state(*tick)));
        Ok(())
    };
    let Ok(()) = receiver.receive(Tick(now), read, |state| used.push(state.tick.0));
    (used, asked)
}

#[test]
fn a_tick_uses_the_sample_of_the_tick_before_with_and_without_faults() {
    for sentences in [&[] as &[&str], &["at 9 s link all blackout"]] {
        let mut receiver = receiver(sentences);
        assert_eq!(received(&mut receiver, 0, &[-1, 0]), (vec![], None), "a newcomer");
        assert_eq!(received(&mut receiver, 1, &[0, 1]), (vec![0], Some([0, 0])));
        assert_eq!(received(&mut receiver, 2, &[1, 2]), (vec![1], Some([1, 1])));
        assert_eq!(received(&mut receiver, 3, &[1]), (vec![], Some([2, 2])), "the sender is silent");
    }
}

#[test]
fn a_closed_receiver_reads_nothing_and_is_a_newcomer_when_it_opens_again() {
    let mut receiver = receiver(&[]);
    received(&mut receiver, 0, &[0]);
    receiver.close();
    assert!(!receiver.is_open());
    assert_eq!(received(&mut receiver, 1, &[0, 1]), (vec![], None));
    receiver.open();
    assert!(receiver.is_open());
    assert_eq!(received(&mut receiver, 2, &[1, 2]), (vec![], None), "sent before its first tick");
    assert_eq!(received(&mut receiver, 3, &[2, 3]), (vec![2], Some([2, 2])));
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
fn only_a_link_with_faults_has_counts() {
    assert_eq!(receiver(&["at 0 s link 3->2 blackout"]).counts(Tick(0)), None);
    assert!(receiver(&["at 0 s link 2->3 blackout"]).counts(Tick(0)).is_some());
}
