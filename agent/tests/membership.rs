//! That all who hear each other agree on who lives, whatever is lost, late, cut or restarted: the membership alone, in
//! rings that a few lines stand in for.

use proptest::prelude::*;
use ringwing_agent::membership::Membership;
use ringwing_flight::{Tick, UavId, UavState};
use std::collections::{BTreeMap, BTreeSet};

const TIMEOUT_TICKS: i64 = 10;
/// As long as patience may have to grow, once for each of several that were lost side by side.
const LONGEST_TICKS: i64 = 64 * TIMEOUT_TICKS * 6;
/// So long nothing may change once all agree.
const QUIET_TICKS: i64 = 60 * TIMEOUT_TICKS;

/// What the link from one to another does to messages.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Link {
    delay_ticks: i64,
    jitter_ticks: i64,
    /// Of 100 messages, so many are lost.
    loss: i64,
}

const PERFECT: Link = Link { delay_ticks: 1, jitter_ticks: 0, loss: 0 };

/// A swarm that only talks.
struct Swarm {
    now: Tick,
    members: Vec<Option<Membership>>,
    links: Vec<Vec<Link>>,
    /// Receiver and message, by when they arrive.
    under_way: BTreeMap<Tick, Vec<(usize, UavState)>>,
    chance: u64,
}

impl Swarm {
    fn new(count: usize, seed: u64) -> Self {
        Self {
            now: Tick::APPROACH,
            members: (0..count).map(|index| Some(Self::member(index, count))).collect(),
            links: vec![vec![PERFECT; count]; count],
            under_way: BTreeMap::new(),
            chance: seed | 1,
        }
    }

    fn member(index: usize, count: usize) -> Membership {
        Membership::new(UavId(index as u32 + 1), count as u32, TIMEOUT_TICKS)
    }

    /// Xorshift: good enough for who loses what.
    fn draw(&mut self, below: i64) -> i64 {
        self.chance ^= self.chance << 13;
        self.chance ^= self.chance >> 7;
        self.chance ^= self.chance << 17;
        (self.chance >> 11).cast_signed() % below
    }

    fn step(&mut self) {
        let now = self.now;
        let arrived = self.under_way.remove(&now).unwrap_or_default();
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
                member.hear(&state, self.now);
            }
        }
    }

    fn send(&mut self, from: usize, state: &UavState) {
        for to in (0..self.members.len()).filter(|to| *to != from) {
            let Link { delay_ticks, jitter_ticks, loss } = self.links[from][to];
            let (lost, late) = (self.draw(100) < loss, self.draw(jitter_ticks + 1));
            let listens =
                self.members[to].as_ref().is_some_and(|member| member.listened().contains(&state.uav));
            if listens && !lost {
                self.under_way.entry(Tick(self.now.0 + delay_ticks + late)).or_default().push((to, *state));
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
        let member = self.members[index].as_ref().expect("one that lives");
        (0..self.members.len()).filter(|other| member.lives(UavId(*other as u32 + 1))).collect()
    }

    /// Whether everybody of `group` holds just those of `group` for living.
    fn agrees(&self, group: &BTreeSet<usize>) -> bool {
        group.iter().all(|index| self.view(*index) == *group)
    }

    fn revisions(&self) -> Vec<u64> {
        self.members.iter().flatten().map(Membership::revision).collect()
    }

    /// Ticks until everybody agrees with the truth, if ever.
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

    fn assert_agrees_for_good(&mut self) {
        let ticks = self.ticks_to_agree();
        let views: Vec<_> = self.truth().into_iter().map(|index| (index, self.view(index))).collect();
        assert!(ticks.is_some(), "{:?} live, but {views:?} is thought", self.truth());
        let revisions = self.revisions();
        self.run(QUIET_TICKS);
        assert!(self.agrees(&self.truth()));
        assert_eq!(self.revisions(), revisions, "flaps although nothing happens");
    }
}

fn state(index: usize, now: Tick, member: &mut Membership) -> UavState {
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
enum Event {
    Kill(usize),
    Restart(usize),
    Link(usize, usize, Link),
    /// Whoever's bit is set hears nobody whose bit is not, nor the other way round.
    Partition(u32),
    AllLinks(Link),
}

impl Event {
    fn befall(&self, swarm: &mut Swarm) {
        let count = swarm.members.len();
        match *self {
            Self::Kill(index) => swarm.kill(index % count),
            Self::Restart(index) => swarm.restart(index % count),
            Self::Link(from, to, link) => swarm.links[from % count][to % count] = link,
            Self::Partition(side) => {
                let cut = Link { loss: 100, ..PERFECT };
                swarm.set_links(cut, |from, to| (side >> from & 1) != (side >> to & 1));
            }
            Self::AllLinks(link) => swarm.set_links(link, |_, _| true),
        }
    }
}

fn link() -> impl Strategy<Value = Link> {
    prop_oneof![
        Just(PERFECT),
        Just(Link { loss: 100, ..PERFECT }),
        (1_i64..40, 0_i64..20, 0_i64..60).prop_map(|(delay_ticks, jitter_ticks, loss)| Link {
            delay_ticks,
            jitter_ticks,
            loss
        }),
    ]
}

fn event() -> impl Strategy<Value = (i64, Event)> {
    let what = prop_oneof![
        3 => (0_usize..12).prop_map(Event::Kill),
        3 => (0_usize..12).prop_map(Event::Restart),
        3 => (0_usize..12, 0_usize..12, link()).prop_map(|(from, to, link)| Event::Link(from, to, link)),
        1 => any::<u32>().prop_map(Event::Partition),
        1 => link().prop_map(Event::AllLinks),
    ];
    (0_i64..60, what)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn once_the_links_are_whole_all_agree_with_the_truth_and_nothing_flaps(
        count in 3_usize..10, seed: u64, events in prop::collection::vec(event(), 0..14),
    ) {
        let mut swarm = Swarm::new(count, seed);
        for (pause, event) in events {
            event.befall(&mut swarm);
            swarm.run(pause);
        }
        swarm.set_links(PERFECT, |_, _| true);
        // What is under way arrives, and the next silence shows.
        swarm.run(8 * TIMEOUT_TICKS);
        swarm.assert_agrees_for_good();
    }

    #[test]
    fn links_that_stay_bad_on_one_side_of_each_take_nobody_out_of_the_ring(
        count in 3_usize..10, seed: u64, to in 0_usize..10, both_ways: bool, delay_ticks in 1_i64..60, is_cut: bool,
    ) {
        // Chance has no longest silence: what is to be learned for good is silence for ever, or none.
        let bad = Link { delay_ticks, jitter_ticks: 0, loss: if is_cut { 100 } else { 0 } };
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
    fn losses_are_agreed_on_within_a_timeout_for_each_side_by_side_and_a_round_of_the_ring(
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
        prop_assert!(ticks <= bound, "{ticks} ticks for {widest} of {count} side by side");
    }

    #[test]
    fn each_side_of_a_partition_is_a_ring_of_its_own_until_it_heals(
        count in 4_usize..12, seed: u64, first in 0_usize..12, length in 1_usize..11,
    ) {
        let mut swarm = Swarm::new(count, seed);
        let one: BTreeSet<usize> = (0..length % count).map(|place| (first + place) % count).collect();
        let other: BTreeSet<usize> = (0..count).filter(|index| !one.contains(index)).collect();
        swarm.set_links(Link { loss: 100, ..PERFECT }, |a, b| one.contains(&a) != one.contains(&b));
        swarm.run((count.cast_signed() as i64 + 2) * (TIMEOUT_TICKS + 4));
        prop_assert!(swarm.agrees(&one) && swarm.agrees(&other), "{:?}", swarm.view(0));
        swarm.set_links(PERFECT, |_, _| true);
        let ticks = swarm.ticks_to_agree();
        prop_assert!(ticks.is_some_and(|ticks| ticks <= 3 * count.cast_signed() as i64 + 4), "{ticks:?}");
        swarm.assert_agrees_for_good();
    }
}

fn widest_gap(living: &BTreeSet<usize>, count: usize) -> usize {
    let first = *living.first().expect("somebody lives");
    let places: Vec<_> = living.iter().copied().chain([first + count]).collect();
    places.windows(2).map(|pair| pair[1] - pair[0] - 1).max().unwrap_or(0)
}
