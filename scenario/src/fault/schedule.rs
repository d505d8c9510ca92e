//! Turns the faults of a run into ticks: what happens to which process before which tick, and which links are impaired
//! when.
//!
//! Never depends on how a run goes: the same faults, seed and swarm give the same schedule in every process.

use super::{Action, Fault, LinkImpairment, Links, ProcessFault, SensorDrift, Targets};
use crate::AirframeSection;
use ringwing_flight::{Event, LinkSource, Part, ProcessAction, Tick, TimedEvent, UavId, draw::Draws};

/// One thing to do to one process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScheduledAction {
    /// Which of the run's faults asks for it, counted from 1 in the order of the scenario; added ones come last.
    pub number: u32,
    /// The action takes effect before this tick opens.
    pub tick: Tick,
    /// The process.
    pub part: Part,
    /// What to do to it.
    pub action: ProcessAction,
    /// The action of the fault that asked for it, as a sentence without its time.
    pub sentence: String,
}

/// An impairment of links and the ticks for which it lasts.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFault {
    /// Which of the run's faults it is, counted from 1 in the order of the scenario; added ones come last.
    pub number: u32,
    /// The first tick whose samples are impaired.
    pub begin: Tick,
    /// The first tick whose samples are no longer impaired; `None` if the fault lasts to the end.
    pub end: Option<Tick>,
    /// The links.
    pub links: Links,
    /// What they do to their samples.
    pub impairment: LinkImpairment,
    /// The action of the fault that asked for it, as a sentence without its time.
    pub sentence: String,
}

impl LinkFault {
    /// Whether samples sent at `tick` are impaired.
    pub fn is_on(&self, tick: Tick) -> bool {
        is_on(self.begin, self.end, tick)
    }

    /// Whether it concerns the link from `source` to `to`, a link that a UAV may listen on.
    pub fn concerns(&self, source: LinkSource, to: UavId) -> bool {
        source != LinkSource::uav(to) && self.links.includes(source, to)
    }
}

/// A broken airframe or sensor, and the ticks for which it is broken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirframeFault {
    /// Which of the run's faults it is, counted from 1 in the order of the scenario; added ones come last.
    pub number: u32,
    /// Whose airframe it is.
    pub uav: UavId,
    /// The first tick that is flown so.
    pub begin: Tick,
    /// The first tick that is flown as commanded again; `None` if the fault lasts to the end.
    pub end: Option<Tick>,
    /// What it cannot do.
    pub failure: AirframeFailure,
}

/// What a broken airframe cannot do, or how its sensors err.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AirframeFailure {
    /// Fly faster than this, in m/s.
    Weak(f64),
    /// Turn at another rate than this, in rad/s.
    Jammed(f64),
    /// Measure its position or its heading without this error, which grows with time.
    Drifting(SensorDrift),
}

impl AirframeFailure {
    /// What it leaves of an airframe with these limits. Even a broken airframe keeps them: it never flies slower than it can, nor
    /// turns faster.
    #[must_use]
    pub fn within(self, limits: &AirframeSection) -> Self {
        let turn_rate_max = limits.turn_rate_max_rad_s;
        match self {
            Self::Weak(most_m_s) => Self::Weak(most_m_s.max(limits.speed_min_m_s)),
            Self::Jammed(rate_rad_s) => Self::Jammed(rate_rad_s.clamp(-turn_rate_max, turn_rate_max)),
            Self::Drifting(drift) => Self::Drifting(drift),
        }
    }
}

impl AirframeFault {
    /// Whether `tick` is flown so.
    pub fn is_on(&self, tick: Tick) -> bool {
        is_on(self.begin, self.end, tick)
    }
}

/// A process that answers late, and the ticks for which it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowAnswers {
    /// Which of the run's faults it is, counted from 1 in the order of the scenario; added ones come last.
    pub number: u32,
    /// The process.
    pub part: Part,
    /// The first tick with a late answer.
    pub begin: Tick,
    /// The first tick with a timely answer again; `None` if the fault lasts to the end.
    pub end: Option<Tick>,
    /// Delay of each answer by the wall clock, in seconds.
    pub by_s: f64,
}

impl SlowAnswers {
    /// Whether the answer to `tick` is late.
    pub fn is_on(&self, tick: Tick) -> bool {
        is_on(self.begin, self.end, tick)
    }
}

fn is_on(begin: Tick, end: Option<Tick>, tick: Tick) -> bool {
    begin <= tick && end.is_none_or(|end| tick < end)
}

/// The faults of a run together with what their ticks and targets depend on.
#[derive(Debug, Clone, Copy)]
pub struct FaultSchedule<'f> {
    /// The faults, in the order of the scenario; those added to a live run come last.
    pub faults: &'f [Fault],
    /// Seed of the randomly drawn targets.
    pub seed: u64,
    /// Ticks per second.
    pub rate_hz: u32,
    /// Number of UAVs.
    pub uavs: u32,
}

/// A process fault with its tick and the processes that it names or draws.
struct AssignedFault {
    number: u32,
    tick: Tick,
    fault: ProcessFault,
    parts: Vec<Part>,
    sentence: String,
}

/// The link faults of a run, and what their healings found.
struct LinkTimeline {
    faults: Vec<LinkFault>,
    idle_healings: Vec<u32>,
}

/// Separates these draws from all others of the seed ("target" in ASCII). Another value would draw other targets.
const TARGET_DRAWS: u64 = 0x7461_7267_6574;

impl FaultSchedule<'_> {
    /// The tick nearest to `time_s`.
    pub fn tick(&self, time_s: f64) -> Tick {
        Tick((time_s * f64::from(self.rate_hz)).round() as i64)
    }

    /// The tick a duration after `start`, at least one later: otherwise a short fault would end as it begins.
    fn tick_after(&self, start: Tick, duration_s: f64) -> Tick {
        Tick(start.0 + self.ticks(duration_s))
    }

    fn ticks(&self, duration_s: f64) -> i64 {
        self.tick(duration_s).0.max(1)
    }

    /// What to do to processes, in order of ticks, and within a tick in order of the faults.
    pub fn scheduled_actions(&self) -> Vec<ScheduledAction> {
        let mut all = Vec::new();
        for AssignedFault { number, tick, fault, parts, sentence } in self.process_faults() {
            let steps = self.steps(fault, tick);
            for part in parts {
                let scheduled = |&(tick, action)| ScheduledAction {
                    number,
                    tick,
                    part,
                    action,
                    sentence: sentence.clone(),
                };
                all.extend(steps.iter().map(scheduled));
            }
        }
        // The sort is stable, so the actions of one tick stay in the order of the faults.
        all.sort_by_key(|scheduled: &ScheduledAction| scheduled.tick);
        all
    }

    fn process_faults(&self) -> Vec<AssignedFault> {
        let mut all = Vec::new();
        let mut draw_ticks = Vec::new();
        for (number, requested) in (1..).zip(self.faults) {
            let Action::Process { fault, targets } = &requested.action else { continue };
            let tick = self.tick(requested.at_s);
            // Only draws have ranks, so faults with named targets leave the draws as they are.
            let rank = draw_ticks.iter().filter(|before| **before == tick).count();
            if matches!(targets, Targets::Random(_)) {
                draw_ticks.push(tick);
            }
            let parts = self.parts(targets, tick, rank as u64);
            let sentence = requested.action.to_string();
            all.push(AssignedFault { number, tick, fault: *fault, parts, sentence });
        }
        all
    }

    /// The processes of `targets`.
    ///
    /// A draw depends on its tick and on its `rank` among the draws of that tick, so that one more draw elsewhere
    /// does not change it.
    fn parts(&self, targets: &Targets, tick: Tick, rank: u64) -> Vec<Part> {
        let uavs = match targets {
            Targets::World => return vec![Part::World],
            Targets::Leader => return vec![Part::Leader],
            Targets::Recorder => return vec![Part::Recorder],
            Targets::Uavs(uavs) => uavs.clone(),
            Targets::Random(count) => Draws::new(self.seed, [TARGET_DRAWS, rank, 0], tick.0.cast_unsigned())
                .choose(*count, self.uavs),
            Targets::AllUavs => (1..=self.uavs).collect(),
        };
        uavs.into_iter().map(|uav| Part::Agent(UavId(uav))).collect()
    }

    /// The single actions that make up `fault` when it begins at `tick`.
    fn steps(&self, fault: ProcessFault, tick: Tick) -> Vec<(Tick, ProcessAction)> {
        let kill = ProcessAction::Kill { returns: true };
        match fault {
            ProcessFault::Kill => vec![(tick, ProcessAction::Kill { returns: false })],
            ProcessFault::Stop => vec![(tick, ProcessAction::Stop)],
            ProcessFault::Thaw => vec![(tick, ProcessAction::Thaw)],
            ProcessFault::Start => vec![(tick, ProcessAction::Start)],
            ProcessFault::Freeze { for_s: None } => vec![(tick, ProcessAction::Freeze)],
            ProcessFault::Freeze { for_s: Some(for_s) } => {
                vec![(tick, ProcessAction::Freeze), (self.tick_after(tick, for_s), ProcessAction::Thaw)]
            }
            ProcessFault::Restart { after_s } => {
                vec![(tick, kill), (self.tick_after(tick, after_s), ProcessAction::Start)]
            }
            ProcessFault::Flap { every_s, for_s } => {
                // A period of two ticks leaves one for the kill and one for the start.
                let (period, end) = (self.ticks(every_s).max(2), self.tick_after(tick, for_s));
                let kills = (tick.0..end.0).step_by(period as usize);
                // The last start may come after `end`: without it the process would stay dead.
                let pair = |at| [(Tick(at), kill), (Tick(at + period / 2), ProcessAction::Start)];
                kills.flat_map(pair).collect()
            }
            // No process acts on another here: the agent delays its own answers, see `slow_answers`, and the world breaks
            // airframes, see `airframe_faults`.
            ProcessFault::Slow { .. }
            | ProcessFault::Weaken { .. }
            | ProcessFault::Jam { .. }
            | ProcessFault::Drift { .. } => Vec::new(),
        }
    }

    /// The link faults in order of time. A healed fault ends at the tick of its healing.
    pub fn link_faults(&self) -> Vec<LinkFault> {
        self.link_timeline().faults
    }

    /// The numbers of the healings that have nothing to heal, counted as in [`LinkFault::number`].
    pub fn idle_healings(&self) -> Vec<u32> {
        self.link_timeline().idle_healings
    }

    fn link_timeline(&self) -> LinkTimeline {
        let (mut all, mut idle_healings) = (Vec::new(), Vec::new());
        let mut in_order: Vec<(u32, &Fault)> = (1..).zip(self.faults).collect();
        // A stable sort: at equal times, a `heal` ends only the faults that the scenario lists before it.
        in_order.sort_by(|(_, a), (_, b)| a.at_s.total_cmp(&b.at_s));
        for (number, fault) in in_order {
            let begin = self.tick(fault.at_s);
            match &fault.action {
                Action::Link { links, impairment, for_s } => all.push(LinkFault {
                    number,
                    begin,
                    end: for_s.map(|for_s| self.tick_after(begin, for_s)),
                    links: links.clone(),
                    impairment: impairment.clone(),
                    sentence: fault.action.to_string(),
                }),
                Action::Heal(links) => {
                    let has_healed = heal(&mut all, links, begin);
                    idle_healings.extend((!has_healed).then_some(number));
                }
                Action::Process { .. } => {}
            }
        }
        LinkTimeline { faults: all, idle_healings }
    }

    /// The processes that answer late, and when.
    pub fn slow_answers(&self) -> Vec<SlowAnswers> {
        let slow = |AssignedFault { number, tick: begin, fault, parts, .. }: AssignedFault| {
            let ProcessFault::Slow { by_s, for_s } = fault else { return Vec::new() };
            let end = for_s.map(|for_s| self.tick_after(begin, for_s));
            parts.into_iter().map(|part| SlowAnswers { number, part, begin, end, by_s }).collect()
        };
        self.process_faults().into_iter().flat_map(slow).collect()
    }

    /// The airframes and sensors that are broken, and when.
    pub fn airframe_faults(&self) -> Vec<AirframeFault> {
        let broken = |AssignedFault { number, tick: begin, fault, parts, .. }: AssignedFault| {
            let (failure, for_s) = match fault {
                ProcessFault::Weaken { to_m_s, for_s } => (AirframeFailure::Weak(to_m_s), for_s),
                ProcessFault::Jam { turn_rate_rad_s, for_s } => {
                    (AirframeFailure::Jammed(turn_rate_rad_s), for_s)
                }
                ProcessFault::Drift { drift, for_s } => (AirframeFailure::Drifting(drift), for_s),
                _ => return Vec::new(),
            };
            let end = for_s.map(|for_s| self.tick_after(begin, for_s));
            let of = |part| match part {
                Part::Agent(uav) => Some(AirframeFault { number, uav, begin, end, failure }),
                _ => None,
            };
            parts.into_iter().filter_map(of).collect()
        };
        self.process_faults().into_iter().flat_map(broken).collect()
    }

    /// The events of link faults, slow processes and broken airframes, in order of ticks.
    ///
    /// The scenario alone decides them. The events of other process faults are left out, because the launcher reports
    /// what it really did.
    pub fn announcements(&self) -> Vec<TimedEvent> {
        let mut all = Vec::new();
        for LinkFault { begin, end, sentence, .. } in self.link_faults() {
            all.push(TimedEvent { tick: begin, event: Event::LinkFault { sentence: sentence.clone() } });
            all.extend(end.map(|end| healed(end, sentence)));
        }
        for AssignedFault { tick, fault, sentence, .. } in self.process_faults() {
            let (event, for_s) = match fault {
                ProcessFault::Slow { for_s, .. } => (Event::SlowFault { sentence: sentence.clone() }, for_s),
                ProcessFault::Weaken { for_s, .. }
                | ProcessFault::Jam { for_s, .. }
                | ProcessFault::Drift { for_s, .. } => {
                    (Event::AirframeFault { sentence: sentence.clone() }, for_s)
                }
                _ => continue,
            };
            all.push(TimedEvent { tick, event });
            all.extend(for_s.map(|for_s| healed(self.tick_after(tick, for_s), sentence)));
        }
        all.sort_by_key(|announcement| announcement.tick);
        all
    }
}

/// Ends those of `faults` that are on at `tick` and concern exactly `links`, or any links if those are [`Links::All`].
/// Returns whether there are any.
fn heal(faults: &mut [LinkFault], links: &Links, tick: Tick) -> bool {
    // A fault that is over keeps its own end, and does not count as healed.
    let is_healed =
        |fault: &&mut LinkFault| fault.is_on(tick) && (*links == Links::All || *links == fault.links);
    let mut has_healed = false;
    for fault in faults.iter_mut().filter(is_healed) {
        fault.end = Some(tick);
        has_healed = true;
    }
    has_healed
}

fn healed(tick: Tick, sentence: String) -> TimedEvent {
    TimedEvent { tick, event: Event::FaultHealed { sentence } }
}
