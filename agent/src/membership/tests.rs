use super::*;
use crate::reception::sample::test_state;
use std::ops::RangeInclusive;

const TIMEOUT: i64 = 40;
/// Standings in numbers: lost in the first incarnation, and alive in the second.
const LOST: u32 = 2;
const BACK: u32 = 3;

/// UAV 1's view of a ring of `count`.
fn view(count: u32) -> MembershipView {
    MembershipView::new(UavId(1), RingOrder::by_number(count), TIMEOUT)
}

/// The state of `uav` in `tick`, with rumours that each of `about` has this `standing`.
fn state(uav: u32, tick: i64, about: impl IntoIterator<Item = u32>, standing: u32) -> UavState {
    let mut state = UavState { uav: UavId(uav), ..test_state(tick) };
    for (place, uav) in state.rumours.iter_mut().zip(about) {
        *place = Rumour { uav, standing };
    }
    state
}

/// Takes in one state of each of `senders` in every tick of `ticks`, and judges.
fn hear(view: &mut MembershipView, ticks: RangeInclusive<i64>, senders: &[u32]) {
    for now in ticks {
        for uav in senders {
            view.receive(&state(*uav, now, [], 0), Tick(now));
        }
        view.update(Tick(now));
    }
}

/// Makes `view` take all of `lost` for lost.
fn lose(view: &mut MembershipView, lost: RangeInclusive<u32>) {
    let lost: Vec<u32> = lost.collect();
    for (tick, some) in (-10..).zip(lost.chunks(RUMOURS)) {
        view.receive(&state(40, tick, some.iter().copied(), LOST), Tick(tick));
    }
}

fn listens_to(view: &MembershipView, uav: u32) -> bool {
    view.listened().contains(&UavId(uav))
}

#[test]
fn a_state_from_itself_or_from_outside_the_swarm_is_ignored() {
    for sender in [0, 1, 5, u32::MAX] {
        let mut view = view(4);
        view.receive(&state(sender, 0, [3], LOST), Tick(0));
        assert!(view.is_alive(UavId(3)) && view.revision() == 0, "from {sender}");
    }
}

#[test]
fn a_loss_and_a_return_count_once_each_and_leave_the_fingerprint_of_nobody() {
    let mut view = view(6);
    view.receive(&state(2, 0, [4], LOST), Tick(0));
    view.receive(&state(2, 1, [4], LOST), Tick(1));
    assert!(!view.is_alive(UavId(4)) && view.revision() == 1 && view.lost_fingerprint() != 0);
    view.receive(&state(2, 2, [4], BACK), Tick(2));
    assert!(view.is_alive(UavId(4)) && view.revision() == 2 && view.lost_fingerprint() == 0);
    let suspected = BACK + 1;
    view.receive(&state(2, 3, [4], suspected), Tick(3));
    assert_eq!(view.revision(), 2, "a suspected UAV is alive");
}

#[test]
fn the_uav_beyond_a_suspect_is_listened_to_until_the_suspect_is_heard_again() {
    let mut view = view(6);
    hear(&mut view, 0..=0, &[2, 6]);
    hear(&mut view, 1..=9, &[6]);
    assert!(!listens_to(&view, 3));
    hear(&mut view, 10..=10, &[6]);
    assert!(listens_to(&view, 3) && view.is_alive(UavId(2)), "a quarter of the timeout has passed");
    hear(&mut view, 11..=11, &[2, 6]);
    assert!(!listens_to(&view, 3));
}

#[test]
fn a_suspicion_that_is_refuted_through_others_doubles_the_patience() {
    let mut view = view(3);
    hear(&mut view, 0..=0, &[2, 3]);
    hear(&mut view, 1..=11, &[3]);
    view.receive(&state(3, 12, [2], BACK), Tick(12));
    hear(&mut view, 13..=91, &[3]);
    assert!(view.is_alive(UavId(2)));
    hear(&mut view, 92..=92, &[3]);
    assert!(!view.is_alive(UavId(2)), "twice the timeout since the refutation");
}

#[test]
fn those_in_the_middle_of_one_long_gap_take_turns_to_be_listened_to() {
    let mut view = view(40);
    lose(&mut view, 2..=21);
    hear(&mut view, 0..=79, &[22, 40]);
    let near: Vec<UavId> = (2..=10).chain([22, 40]).map(UavId).collect();
    assert_eq!(view.listened(), near, "eight places, and that of the first turn");
    hear(&mut view, 80..=80, &[22, 40]);
    assert!(listens_to(&view, 11) && !listens_to(&view, 10));
}

#[test]
fn with_nobody_left_all_others_take_turns() {
    let mut view = view(40);
    lose(&mut view, 2..=40);
    // 39 others without the eight near ones make 31 turns. Then it is the first one's turn again.
    for (turn, [next, previous]) in [(0, [10, 32]), (30, [40, 2]), (31, [10, 32])] {
        view.update(Tick(2 * TIMEOUT * turn));
        assert!(listens_to(&view, next) && listens_to(&view, previous), "turn {turn}");
    }
}
