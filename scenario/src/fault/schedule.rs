//! The schedule of faults: what to do to which process before which tick, and which links have faults when.

use super::{Action, Fault, Links, ProcessFault, Targets, Trouble};
use ringwing_flight::{Event, Part, ProcessAction, Tick, TimedEvent, UavId, draw::Draws};

/// Something to do to one process at one tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScheduledAction {
    /// Before this tick is opened.
    pub tick: i64,
    /// The process.
    pub part: Part,
    /// What to do to it.
    pub action: ProcessAction,
    /// The sentence that asked for it.
    pub sentence: String,
}

/// A fault of links, with its ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFault {
    /// Applies to what is sent from this tick on.
    pub begin: i64,
    /// No longer applies to what is sent from this tick on; `None` if it lasts.
    pub end: Option<i64>,
    /// The links.
    pub links: Links,
    /// What is wrong with them.
    pub trouble: Trouble,
    /// The sentence that asked for it, without its time.
    pub sentence: String,
}

impl LinkFault {
    /// Whether it applies to what is sent at `tick`.
    pub fn is_on(&self, tick: i64) -> bool {
        self.begin <= tick && self.end.is_none_or(|end| tick < end)
    }
}

/// A process that answers late for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowAnswers {
    /// The process.
    pub part: Part,
    /// From this tick on.
    pub begin: i64,
    /// To the tick before this one.
    pub end: i64,
    /// How much later, by the wall clock.
    pub by_s: f64,
}

/// The faults of one run, to be put on its ticks.
#[derive(Debug, Clone, Copy)]
pub struct Schedule<'f> {
    /// The faults, in the order they were asked for.
    pub faults: &'f [Fault],
    /// Seed of the drawn targets.
    pub seed: u64,
    /// Ticks a second.
    pub rate_hz: u32,
    /// Number of UAVs.
    pub uavs: u32,
}

/// A process fault and the processes it was assigned to.
struct Assigned {
    tick: i64,
    fault: ProcessFault,
    parts: Vec<Part>,
    sentence: String,
}

/// The purpose of these draws. Another value draws other targets from the same seed.
const RANDOM_TARGETS: u64 = 0x7461_7267_6574;

impl Schedule<'_> {
    /// The tick at `time_s`.
    pub fn tick(&self, time_s: f64) -> i64 {
        (time_s * f64::from(self.rate_hz)).round() as i64
    }

    /// A duration in ticks: at least one.
    fn ticks(&self, time_s: f64) -> i64 {
        self.tick(time_s).max(1)
    }

    /// What to do to which process when, in order of ticks; within a tick in the order of the faults.
    pub fn scheduled_actions(&self) -> Vec<ScheduledAction> {
        let mut all = Vec::new();
        for Assigned { tick, fault, parts, sentence } in self.process_faults() {
            let moments = self.moments(fault, tick);
            for part in parts {
                let scheduled =
                    |&(tick, action)| ScheduledAction { tick, part, action, sentence: sentence.clone() };
                all.extend(moments.iter().map(scheduled));
            }
        }
        all.sort_by_key(|scheduled: &ScheduledAction| scheduled.tick);
        all
    }

    /// The process faults, each with its tick and the processes it names or draws.
    fn process_faults(&self) -> Vec<Assigned> {
        let mut all = Vec::new();
        let mut drawn = Vec::new();
        for asked in self.faults {
            let Action::Process { fault, targets } = &asked.action else { continue };
            let tick = self.tick(asked.at_s);
            let rank = drawn.iter().filter(|before| **before == tick).count();
            if matches!(targets, Targets::Random(_)) {
                drawn.push(tick);
            }
            let parts = self.named(targets, tick, rank as u64);
            all.push(Assigned { tick, fault: *fault, parts, sentence: asked.action.to_string() });
        }
        all
    }

    /// The processes of `targets`; a draw depends on its tick, and on its rank among those of the same tick.
    fn named(&self, targets: &Targets, tick: i64, rank: u64) -> Vec<Part> {
        let uavs = match targets {
            Targets::World => return vec![Part::World],
            Targets::Leader => return vec![Part::Leader],
            Targets::Recorder => return vec![Part::Recorder],
            Targets::Uavs(uavs) => uavs.clone(),
            Targets::Random(count) => Draws::new(self.seed, [RANDOM_TARGETS, rank, 0], tick.cast_unsigned())
                .choose(*count, self.uavs),
            Targets::AllUavs => (1..=self.uavs).collect(),
        };
        uavs.into_iter().map(|uav| Part::Agent(UavId(uav))).collect()
    }

    /// The single actions that `fault`, begun at `tick`, consists of.
    fn moments(&self, fault: ProcessFault, tick: i64) -> Vec<(i64, ProcessAction)> {
        let kill = ProcessAction::Kill { returns: true };
        match fault {
            ProcessFault::Kill => vec![(tick, ProcessAction::Kill { returns: false })],
            ProcessFault::Stop => vec![(tick, ProcessAction::Stop)],
            ProcessFault::Thaw => vec![(tick, ProcessAction::Thaw)],
            ProcessFault::Start => vec![(tick, ProcessAction::Start)],
            ProcessFault::Freeze { for_s: None } => vec![(tick, ProcessAction::Freeze)],
            ProcessFault::Freeze { for_s: Some(for_s) } => {
                vec![(tick, ProcessAction::Freeze), (tick + self.ticks(for_s), ProcessAction::Thaw)]
            }
            ProcessFault::Restart { after_s } => {
                vec![(tick, kill), (tick + self.ticks(after_s), ProcessAction::Start)]
            }
            ProcessFault::Flap { every_s, for_s } => {
                let (every, last) = (self.ticks(every_s).max(2), tick + self.ticks(for_s));
                let deaths = (tick..last).step_by(every as usize);
                deaths.flat_map(|death| [(death, kill), (death + every / 2, ProcessAction::Start)]).collect()
            }
            ProcessFault::Slow { .. } => Vec::new(),
        }
    }

    /// The link faults in order of time.
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
                    let heals = |fault: &&mut LinkFault| {
                        fault.is_on(begin) && (*links == Links::All || *links == fault.links)
                    };
                    all.iter_mut().filter(heals).for_each(|fault| fault.end = Some(begin));
                }
                Action::Process { .. } => {}
            }
        }
        all
    }

    /// Which processes answer late, and when.
    pub fn slow_answers(&self) -> Vec<SlowAnswers> {
        let slow = |Assigned { tick: begin, fault, parts, .. }: Assigned| {
            let ProcessFault::Slow { by_s, for_s } = fault else { return Vec::new() };
            let end = for_s.map_or(i64::MAX, |for_s| begin + self.ticks(for_s));
            parts.into_iter().map(|part| SlowAnswers { part, begin, end, by_s }).collect()
        };
        self.process_faults().into_iter().flat_map(slow).collect()
    }

    /// The events that tell of link faults and slow processes, in order of ticks.
    ///
    /// Known beforehand, unlike those of process faults, which tell what was really done.
    pub fn announcements(&self) -> Vec<TimedEvent> {
        let at = |tick, event| TimedEvent { tick: Tick(tick), event };
        let mut all = Vec::new();
        for LinkFault { begin, end, sentence, .. } in self.link_faults() {
            all.push(at(begin, Event::LinkFault { sentence: sentence.clone() }));
            all.extend(end.map(|end| at(end, Event::FaultHealed { sentence })));
        }
        for Assigned { tick, fault, sentence, .. } in self.process_faults() {
            let ProcessFault::Slow { for_s, .. } = fault else { continue };
            all.push(at(tick, Event::SlowFault { sentence: sentence.clone() }));
            all.extend(for_s.map(|for_s| at(tick + self.ticks(for_s), Event::FaultHealed { sentence })));
        }
        all.sort_by_key(|one| one.tick);
        all
    }
}
