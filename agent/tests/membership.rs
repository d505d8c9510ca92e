//! All UAVs that hear from each other agree on who is alive, whatever states are lost, late, cut off or restarted.
//!
//! The membership alone: a few lines here stand in for links and agents.

use proptest::prelude::*;
use ringwing_agent::membership::MembershipView;
use ringwing_flight::{RingOrder, Tick, UavId, UavState, draw::Draws};
use std::collections::{BTreeMap, BTreeSet};

const TIMEOUT_TICKS: i64 = 10;
/// Longest time to agreement: patience may have to grow to its limit, once for each of several neighbours in a row.
const LONGEST_TICKS: i64 = 64 * TIMEOUT_TICKS * 6;
/// Once all agree, nothing may change for this long.
const QUIET_TICKS: i64 = 60 * TIMEOUT_TICKS;

/// What the link from one UAV to another does to states.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Link {
    delay_ticks: i64,
    jitter_ticks: i64,
    /// States lost, in per cent.
    loss_percent: i64,
}

const PERFECT: Link = Link { delay_ticks: 1, jitter_ticks: 0, loss_percent: 0 };

/// A swarm whose UAVs only exchange states.
struct Swarm {
    now: Tick,
    members: Vec<Option<MembershipView>>,
    links: Vec<Vec<Link>>,
    /// Receiver and state, by their tick of arrival.
    in_flight: BTreeMap<Tick, Vec<(usize, UavState)>>,
    /// Decides what is lost, and what comes late.
    draws: Draws,
}

impl Swarm {
    fn new(count: usize, seed: u64) -> Self {
        Self {
            now: Tick::APPROACH,
            members: (0..count).map(|index| Some(Self::member(index, count))).collect(),
            links: vec![vec![PERFECT; count]; count],
            in_flight: BTreeMap::new(),
            draws: Draws::new(seed, [0; 3], 0),
        }
    }

    fn member(index: usize, count: usize) -> MembershipView {
        MembershipView::new(UavId(index as u32 + 1), RingOrder::by_number(count as u32), TIMEOUT_TICKS)
    }

    /// A number from 0 up to, but not including, `below`.
    fn draw(&mut self, below: i64) -> i64 {
        (self.draws.uniform() * below as f64) as i64
    }

    fn step(&mut self) {
        let now = self.now;
        let arrived = self.in_flight.remove(&now).unwrap_or_default();
        self.deliver(arrived);
        for index in 0..self.members.len() {
            if let Some(member) = &mut self.members[index] {
                member.update(now);
                let state = state(index, now, member);
                self.send(index, &state);
            }
        }
        self.now = now.next();
    }

    fn deliver(&mut self, arrived: Vec<(usize, UavState)>) {
        for (receiver, state) in arrived {
            if let Some(member) = &mut self.members[receiver] {
                member.receive(&state, self.now);
            }
        }
    }

    fn send(&mut self, from: usize, state: &UavState) {
        for to in (0..self.members.len()).filter(|to| *to != from) {
            let Link { delay_ticks, jitter_ticks, loss_percent } = self.links[from][to];
            let (lost, late) = (self.draw(100) < loss_percent, self.draw(jitter_ticks + 1));
            let listens =
                self.members[to].as_ref().is_some_and(|member| member.listened().contains(&state.uav));
            if listens && !lost {
                self.in_flight.entry(Tick(self.now.0 + delay_ticks + late)).or_default().push((to, *state));
            }
        }
    }

    fn run(&mut self, ticks: i64) {
        for _ in 0..ticks {
            self.step();
        }
    }

    fn kill(&mut self, index: usize) {
        self.members[index] = None;
    }

    fn restart(&mut self, index: usize) {
        self.members[index] = Some(Self::member(index, self.members.len()));
    }

    fn set_links(&mut self, link: Link, between: impl Fn(usize, usize) -> bool) {
        let count = self.members.len();
        for (from, to) in (0..count).flat_map(|from| (0..count).map(move |to| (from, to))) {
            if between(from, to) {
                self.links[from][to] = link;
            }
        }
    }

    fn truth(&self) -> BTreeSet<usize> {
        (0..self.members.len()).filter(|index| self.members[*index].is_some()).collect()
    }

    fn view(&self, index: usize) -> BTreeSet<usize> {
        let member = self.members[index].as_ref().expect("it runs");
        (0..self.members.len()).filter(|other| member.is_alive(UavId(*other as u32 + 1))).collect()
    }

    /// Whether each member of `group` holds exactly the members of `group` for alive.
    fn agrees(&self, group: &BTreeSet<usize>) -> bool {
        group.iter().all(|index| self.view(*index) == *group)
    }

    fn revisions(&self) -> Vec<u64> {
        self.members.iter().flatten().map(MembershipView::revision).collect()
    }

    /// Ticks until all agree with the truth; `None` if that takes too long.
    fn ticks_to_agree(&mut self) -> Option<i64> {
        let truth = self.truth();
        (0..LONGEST_TICKS).find(|_| {
            let agrees = self.agrees(&truth);
            if !agrees {
                self.step();
            }
            agrees
        })
    }

    fn assert_agrees_and_stays_so(&mut self) {
        let ticks = self.ticks_to_agree();
        let views: Vec<_> = self.truth().into_iter().map(|index| (index, self.view(index))).collect();
        assert!(ticks.is_some(), "{:?} are alive, but the views are {views:?}", self.truth());
        let revisions = self.revisions();
        self.run(QUIET_TICKS);
        assert!(self.agrees(&self.truth()));
        assert_eq!(self.revisions(), revisions, "a view changes although nothing happens");
    }
}

fn state(index: usize, now: Tick, member: &mut MembershipView) -> UavState {
    UavState {
        tick: now,
        position_m: [0.0; 2],
        heading_rad: 0.0,
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        uav: UavId(index as u32 + 1),
        reserved: 0,
        rumours: member.rumours(),
    }
}

/// Something that happens to a swarm.
#[derive(Debug, Clone)]
enum Incident {
    Kill(usize),
    Restart(usize),
    Link(usize, usize, Link),
    /// UAVs whose bit is set and UAVs whose bit is not set do not hear from each other.
    Partition(u32),
    AllLinks(Link),
}

impl Incident {
    fn apply_to(&self, swarm: &mut Swarm) {
        let count = swarm.members.len();
        match *self {
            Self::Kill(index) => swarm.kill(index % count),
            Self::Restart(index) => swarm.restart(index % count),
            Self::Link(from, to, link) => swarm.links[from % count][to % count] = link,
            Self::Partition(side) => {
                let cut = Link { loss_percent: 100, ..PERFECT };
                swarm.set_links(cut, |from, to| (side >> from & 1) != (side >> to & 1));
            }
            Self::AllLinks(link) => swarm.set_links(link, |_, _| true),
        }
    }
}

fn link() -> impl Strategy<Value = Link> {
    prop_oneof![
        Just(PERFECT),
        Just(Link { loss_percent: 100, ..PERFECT }),
        (1_i64..40, 0_i64..20, 0_i64..60).prop_map(|(delay_ticks, jitter_ticks, loss_percent)| Link {
            delay_ticks,
            jitter_ticks,
            loss_percent
        }),
    ]
}

fn incident() -> impl Strategy<Value = (i64, Incident)> {
    let what = prop_oneof![
        3 => (0_usize..12).prop_map(Incident::Kill),
        3 => (0_usize..12).prop_map(Incident::Restart),
        3 => (0_usize..12, 0_usize..12, link()).prop_map(|(from, to, link)| Incident::Link(from, to, link)),
        1 => any::<u32>().prop_map(Incident::Partition),
        1 => link().prop_map(Incident::AllLinks),
    ];
    (0_i64..60, what)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn once_all_links_work_all_views_become_true_and_stay_so(
        count in 3_usize..10, seed: u64, incidents in prop::collection::vec(incident(), 0..14),
    ) {
        let mut swarm = Swarm::new(count, seed);
        for (pause, incident) in incidents {
            incident.apply_to(&mut swarm);
            swarm.run(pause);
        }
        swarm.set_links(PERFECT, |_, _| true);
        // Let everything in flight arrive, and the next silence show.
        swarm.run(8 * TIMEOUT_TICKS);
        swarm.assert_agrees_and_stays_so();
    }

    #[test]
    fn a_link_that_stays_bad_takes_no_living_uav_out_of_the_ring(
        count in 3_usize..10, seed: u64, to in 0_usize..10, both_ways: bool, delay_ticks in 1_i64..60, is_cut: bool,
    ) {
        // With random loss there is no longest silence to learn, so the link is either cut or late.
        let bad = Link { delay_ticks, jitter_ticks: 0, loss_percent: if is_cut { 100 } else { 0 } };
        let mut swarm = Swarm::new(count, seed);
        let (from, to) = (to % count, (to + 1) % count);
        swarm.set_links(bad, |a, b| (a, b) == (from, to) || both_ways && (a, b) == (to, from));
        swarm.run(200 * TIMEOUT_TICKS);
        let revisions = swarm.revisions();
        swarm.run(200 * TIMEOUT_TICKS);
        prop_assert!(swarm.agrees(&swarm.truth()));
        prop_assert_eq!(swarm.revisions(), revisions);
    }

    #[test]
    fn a_loss_is_agreed_on_within_a_timeout_for_each_of_a_row_and_a_round_of_the_ring(
        count in 3_usize..14, seed: u64, dead in any::<u32>(),
    ) {
        let mut swarm = Swarm::new(count, seed);
        swarm.run(30);
        (0..count).filter(|index| dead >> index & 1 == 1).for_each(|index| swarm.kill(index));
        let truth = swarm.truth();
        prop_assume!(!truth.is_empty());
        let widest = widest_gap(&truth, count).cast_signed() as i64;
        let ticks = swarm.ticks_to_agree().unwrap();
        let bound = (TIMEOUT_TICKS + 4) * (widest + 1) / 2 + TIMEOUT_TICKS + count.cast_signed() as i64 + 4;
        prop_assert!(ticks <= bound, "{ticks} ticks for {widest} of {count} in a row");
    }

    #[test]
    fn each_side_of_a_partition_forms_its_own_ring_until_the_partition_heals(
        count in 4_usize..12, seed: u64, first in 0_usize..12, length in 1_usize..11,
    ) {
        let mut swarm = Swarm::new(count, seed);
        let one: BTreeSet<usize> = (0..length % count).map(|place| (first + place) % count).collect();
        let other: BTreeSet<usize> = (0..count).filter(|index| !one.contains(index)).collect();
        swarm.set_links(Link { loss_percent: 100, ..PERFECT }, |a, b| one.contains(&a) != one.contains(&b));
        swarm.run((count.cast_signed() as i64 + 2) * (TIMEOUT_TICKS + 4));
        prop_assert!(swarm.agrees(&one) && swarm.agrees(&other), "{:?}", swarm.view(0));
        swarm.set_links(PERFECT, |_, _| true);
        let ticks = swarm.ticks_to_agree();
        prop_assert!(ticks.is_some_and(|ticks| ticks <= 3 * count.cast_signed() as i64 + 4), "{ticks:?}");
        swarm.assert_agrees_and_stays_so();
    }
}

fn widest_gap(living: &BTreeSet<usize>, count: usize) -> usize {
    let first = *living.first().expect("somebody is alive");
    let places: Vec<_> = living.iter().copied().chain([first + count]).collect();
    places.windows(2).map(|pair| pair[1] - pair[0] - 1).max().unwrap_or(0)
}
