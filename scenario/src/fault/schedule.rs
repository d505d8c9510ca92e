//! What faults come to, tick by tick: which process is met when, and which links are troubled from when to when.

use super::{Action, Deed, Fault, Links, Targets, Trouble};
use crate::draw::Draws;

/// A process that can be met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Target {
    /// The world.
    World,
    /// The leader.
    Leader,
    /// The recorder.
    Recorder,
    /// The agent of this UAV.
    Uav(u32),
}

/// What a process is met with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// SIGKILL.
    Kill {
        /// It is to be started again later.
        returns: bool,
    },
    /// SIGTERM.
    Stop,
    /// SIGSTOP.
    Freeze,
    /// SIGCONT.
    Thaw,
    /// A new process.
    Start,
}

/// One process, met at one tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Intervention {
    /// Before this tick is opened.
    pub tick: i64,
    /// Who.
    pub target: Target,
    /// With what.
    pub act: Act,
    /// The sentence that asked for it.
    pub sentence: String,
}

/// Links that are troubled for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFault {
    /// What is sent from this tick on is concerned.
    pub begin: i64,
    /// What is sent from this tick on no longer is; none if it lasts.
    pub end: Option<i64>,
    /// Which links.
    pub links: Links,
    /// What is wrong with them.
    pub trouble: Trouble,
    /// The sentence that asked for it, without its time.
    pub sentence: String,
}

impl LinkFault {
    /// Whether what is sent at `tick` is concerned.
    pub fn is_on(&self, tick: i64) -> bool {
        self.begin <= tick && self.end.is_none_or(|end| tick < end)
    }
}

/// A process that answers late for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slowness {
    /// Who.
    pub target: Target,
    /// From this tick on.
    pub begin: i64,
    /// To the tick before this one.
    pub end: i64,
    /// How much later, by the wall clock.
    pub by_s: f64,
}

/// Something to tell of a fault that no process meets by itself: `fault.link`, `fault.slow`, `fault.healed`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Announcement {
    /// When.
    pub tick: i64,
    /// What kind of event it is.
    pub name: &'static str,
    /// The sentence concerned.
    pub text: String,
}

/// Faults as one run meets them.
#[derive(Debug, Clone, Copy)]
pub struct Schedule<'f> {
    /// What is asked for, in the order in which it was.
    pub faults: &'f [Fault],
    /// Seed of what is drawn.
    pub seed: u64,
    /// Ticks a second.
    pub rate_hz: u32,
    /// Number of UAVs.
    pub uavs: u32,
}

/// Set apart from every other use of the seed.
const RANDOM_TARGETS: u64 = 0x7461_7267_6574;

impl Schedule<'_> {
    /// The tick at `time_s`.
    pub fn tick(&self, time_s: f64) -> i64 {
        (time_s * f64::from(self.rate_hz)).round() as i64
    }

    /// A duration in ticks; what is above 0 lasts for one at least.
    fn ticks(&self, time_s: f64) -> i64 {
        self.tick(time_s).max(1)
    }

    /// Who is met when, in order of ticks; within a tick in the order in which it was asked for.
    pub fn interventions(&self) -> Vec<Intervention> {
        let mut all = Vec::new();
        for (tick, deed, targets, fault) in self.deeds() {
            let moments = self.moments(deed, tick);
            for target in targets {
                let meet = |(tick, act): &(i64, Act)| {
                    let (tick, act) = (*tick, *act);
                    Intervention { tick, target, act, sentence: fault.action.to_string() }
                };
                all.extend(moments.iter().map(meet));
            }
        }
        all.sort_by_key(|intervention: &Intervention| intervention.tick);
        all
    }

    /// Everything that is done to processes: from which tick on, what, to whom, and why.
    fn deeds(&self) -> Vec<(i64, Deed, Vec<Target>, &Fault)> {
        let mut deeds = Vec::new();
        let mut drawn = Vec::new();
        for fault in self.faults {
            let Action::Process { deed, targets } = &fault.action else { continue };
            let tick = self.tick(fault.at_s);
            let rank = drawn.iter().filter(|before| **before == tick).count();
            if matches!(targets, Targets::Random(_)) {
                drawn.push(tick);
            }
            deeds.push((tick, *deed, self.named(targets, tick, rank as u64), fault));
        }
        deeds
    }

    /// The processes of `targets`; a draw depends on its tick, and on its rank among those of the same tick.
    fn named(&self, targets: &Targets, tick: i64, rank: u64) -> Vec<Target> {
        let uavs = match targets {
            Targets::World => return vec![Target::World],
            Targets::Leader => return vec![Target::Leader],
            Targets::Recorder => return vec![Target::Recorder],
            Targets::Uavs(uavs) => uavs.clone(),
            Targets::Random(count) => Draws::new(self.seed, [RANDOM_TARGETS, rank, 0], tick.cast_unsigned())
                .choose(*count, self.uavs),
            Targets::AllUavs => (1..=self.uavs).collect(),
        };
        uavs.into_iter().map(Target::Uav).collect()
    }

    fn moments(&self, deed: Deed, tick: i64) -> Vec<(i64, Act)> {
        let kill = Act::Kill { returns: true };
        match deed {
            Deed::Kill => vec![(tick, Act::Kill { returns: false })],
            Deed::Stop => vec![(tick, Act::Stop)],
            Deed::Thaw => vec![(tick, Act::Thaw)],
            Deed::Start => vec![(tick, Act::Start)],
            Deed::Freeze { for_s: None } => vec![(tick, Act::Freeze)],
            Deed::Freeze { for_s: Some(for_s) } => {
                vec![(tick, Act::Freeze), (tick + self.ticks(for_s), Act::Thaw)]
            }
            Deed::Restart { after_s } => vec![(tick, kill), (tick + self.ticks(after_s), Act::Start)],
            Deed::Flap { every_s, for_s } => {
                let (every, last) = (self.ticks(every_s).max(2), tick + self.ticks(for_s));
                let deaths = (tick..last).step_by(every as usize);
                deaths.flat_map(|death| [(death, kill), (death + every / 2, Act::Start)]).collect()
            }
            Deed::Slow { .. } => Vec::new(),
        }
    }

    /// Which links are troubled from when to when, in the order in which it was asked for.
    pub fn link_faults(&self) -> Vec<LinkFault> {
        let mut all: Vec<LinkFault> = Vec::new();
        let mut in_order: Vec<&Fault> = self.faults.iter().collect();
        in_order.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        for fault in in_order {
            let begin = self.tick(fault.at_s);
            match &fault.action {
                Action::Link { links, trouble, for_s } => all.push(LinkFault {
                    begin,
                    end: for_s.map(|for_s| begin + self.ticks(for_s)),
                    links: links.clone(),
                    trouble: trouble.clone(),
                    sentence: fault.action.to_string(),
                }),
                Action::Heal(links) => {
                    let on = |fault: &&mut LinkFault| {
                        fault.is_on(begin) && (*links == Links::All || *links == fault.links)
                    };
                    all.iter_mut().filter(on).for_each(|fault| fault.end = Some(begin));
                }
                Action::Process { .. } => {}
            }
        }
        all
    }

    /// Who answers late from when to when.
    pub fn slownesses(&self) -> Vec<Slowness> {
        let slow = |(begin, deed, targets, _): (i64, Deed, Vec<Target>, &Fault)| {
            let Deed::Slow { by_s, for_s } = deed else { return Vec::new() };
            let end = for_s.map_or(i64::MAX, |for_s| begin + self.ticks(for_s));
            targets.into_iter().map(|target| Slowness { target, begin, end, by_s }).collect()
        };
        self.deeds().into_iter().flat_map(slow).collect()
    }

    /// What is to be told of links and slow processes, in order of ticks.
    pub fn announcements(&self) -> Vec<Announcement> {
        let told = |tick, name, text: &str| Announcement { tick, name, text: text.to_owned() };
        let mut all = Vec::new();
        for fault in self.link_faults() {
            all.push(told(fault.begin, "fault.link", &fault.sentence));
            all.extend(fault.end.map(|end| told(end, "fault.healed", &fault.sentence)));
        }
        for (begin, deed, _, fault) in self.deeds() {
            let Deed::Slow { for_s, .. } = deed else { continue };
            let sentence = fault.action.to_string();
            all.push(told(begin, "fault.slow", &sentence));
            all.extend(for_s.map(|for_s| told(begin + self.ticks(for_s), "fault.healed", &sentence)));
        }
        all.sort_by_key(|one| one.tick);
        all
    }
}
