use super::*;

fn loss(tick: i64, text: &str) -> Disturbance {
    Disturbance { tick, text: text.into(), is_fault: true }
}

fn wholeness(is_whole: bool) -> Wholeness {
    if is_whole { Wholeness::Whole } else { Wholeness::Broken }
}

/// The recoveries from faults at `faults`, at 10 Hz, in a flight of `ticks` whose formation is broken in `broken`.
fn flown(faults: &[i64], broken: std::ops::Range<i64>, ticks: i64) -> Recoveries {
    let mut watch = RecoveryWatch::new(10);
    for tick in 0..ticks {
        if faults.contains(&tick) {
            watch.on_disturbance(&loss(tick, &format!("loss {tick}")));
        }
        watch.observe(tick, wholeness(!broken.contains(&tick)));
    }
    watch.recoveries()
}

fn times(recoveries: &Recoveries) -> Vec<Option<f64>> {
    recoveries.listed.iter().map(|recovery| recovery.recovery_s).collect()
}

#[test]
fn recovery_ends_when_the_formation_is_whole_for_good() {
    assert_eq!(times(&flown(&[20], 25..60, 200)), [Some(4.0)]);
    assert_eq!(times(&flown(&[20], 0..10, 200)), [Some(0.0)]);
    assert_eq!(flown(&[20], 25..60, 200).longest_s, Some(4.0));
}

#[test]
fn a_recovery_that_the_flight_did_not_see_to_its_end_is_none() {
    assert_eq!(times(&flown(&[20], 25..100, 100)), [None], "broken at the end");
    assert_eq!(times(&flown(&[20], 25..60, 110)), [None], "whole for less than 5 s");
    assert_eq!(times(&flown(&[20], 25..60, 111)), [Some(4.0)]);
    assert_eq!(times(&flown(&[99], 0..0, 100)), [None], "a fault in the last tick");
    let recoveries = flown(&[99], 0..0, 100);
    assert_eq!((recoveries.longest_s, recoveries.cut_short, recoveries.moments), (None, 0, 1));
}

#[test]
fn a_fault_can_recover_only_until_the_next_one_and_says_so() {
    let recoveries = flown(&[20, 50], 25..60, 200);
    assert_eq!(times(&recoveries), [None, Some(1.0)]);
    let cut = &recoveries.listed[0];
    assert_eq!((cut.cut_short_s, cut.cut_short_by.as_deref()), (Some(5.0), Some("loss 50")));
    assert_eq!(recoveries.listed[1].cut_short_s, None);
    assert_eq!((recoveries.cut_short, recoveries.longest_s), (1, None));
    assert_eq!(times(&flown(&[20, 70], 25..60, 200)), [None, Some(0.0)], "whole for only a second");
    assert_eq!(times(&flown(&[20, 120], 25..60, 200)), [Some(4.0), Some(0.0)]);
}

#[test]
fn without_uavs_or_slots_nothing_recovers() {
    for wholeness in [Wholeness::of(0, None), Wholeness::of(6, None)] {
        let mut watch = RecoveryWatch::new(10);
        (0..20).for_each(|tick| watch.observe(tick, Wholeness::Whole));
        watch.on_disturbance(&loss(20, "all are killed"));
        // Airframes keep their last command for a moment, so the formation still looks whole.
        (20..25).for_each(|tick| watch.observe(tick, Wholeness::Whole));
        (25..200).for_each(|tick| watch.observe(tick, wholeness));
        assert_eq!(times(&watch.recoveries()), [None], "{wholeness:?}");
    }
}

#[test]
fn faults_of_one_tick_are_one_moment() {
    let mut watch = RecoveryWatch::new(10);
    for what in ["one", "two", "three", "four", "five"] {
        watch.on_disturbance(&loss(7, what));
    }
    let Recoveries { faults, moments, listed, .. } = watch.recoveries();
    assert_eq!((faults, moments, listed.len(), listed[0].faults), (5, 1, 1, 5));
    assert_eq!(listed[0].fault, "one; two; three; and 2 more at once");
}

#[test]
fn of_many_moments_the_first_ones_the_first_of_the_worst_and_the_last_are_listed() {
    let mut watch = RecoveryWatch::new(1);
    // A fault every 20 ticks, and the formation is whole again 1 tick later; after the faults 150 and 160, 9 ticks later.
    for tick in 0..=20 * 200 + 6 {
        if tick % 20 == 0 {
            watch.on_disturbance(&loss(tick, &format!("loss {}", tick / 20)));
        }
        let broken_for = if [150, 160].contains(&(tick / 20)) { 9 } else { 1 };
        watch.observe(tick, wholeness(tick % 20 >= broken_for));
    }
    let Recoveries { faults, moments, longest_s, listed, .. } = watch.recoveries();
    assert_eq!((faults, moments, listed.len(), longest_s), (201, 201, LISTED, Some(9.0)));
    let shown: Vec<&str> = listed.iter().map(|one| one.fault.as_str()).collect();
    assert_eq!(shown[LISTED - 3..], ["loss 97", "loss 150", "loss 200"]);
    assert_eq!(listed[LISTED - 1].recovery_s, Some(1.0));
}

#[test]
fn a_late_report_gives_the_same_recovery_as_one_in_time() {
    let (mut in_time, mut late) = (RecoveryWatch::new(10), RecoveryWatch::new(10));
    in_time.on_disturbance(&loss(7, "loss"));
    for tick in 7..10 {
        in_time.observe(tick, wholeness(tick == 9));
        late.observe(tick, wholeness(tick == 9));
    }
    late.on_disturbance(&loss(7, "loss"));
    for tick in 10..70 {
        in_time.observe(tick, Wholeness::Whole);
        late.observe(tick, Wholeness::Whole);
    }
    assert_eq!(late.recoveries(), in_time.recoveries());
    assert_eq!(times(&late.recoveries()), [Some(0.2)]);
}

#[test]
fn a_report_after_that_of_a_later_fault_is_listed_in_order_of_time() {
    let mut watch = RecoveryWatch::new(10);
    watch.on_disturbance(&loss(40, "second"));
    (40..100).for_each(|tick| watch.observe(tick, Wholeness::Whole));
    watch.on_disturbance(&loss(20, "first"));
    let recoveries = watch.recoveries();
    assert_eq!(times(&recoveries), [None, Some(0.0)]);
    let first = &recoveries.listed[0];
    assert_eq!((first.fault.as_str(), first.cut_short_by.as_deref()), ("first", Some("second")));
}

#[test]
fn a_manoeuvre_has_to_be_recovered_from_and_is_no_fault() {
    let mut watch = RecoveryWatch::new(10);
    for tick in 0..200 {
        if tick == 20 {
            watch.on_disturbance(&Disturbance { tick, text: "manoeuvre 1: vee".into(), is_fault: false });
        }
        watch.observe(tick, wholeness(!(20..70).contains(&tick)));
    }
    let recoveries = watch.recoveries();
    assert_eq!((recoveries.faults, recoveries.moments, recoveries.longest_s), (0, 1, Some(5.0)));
    assert_eq!((recoveries.listed[0].faults, &*recoveries.listed[0].fault), (0, "manoeuvre 1: vee"));
}
