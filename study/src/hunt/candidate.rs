//! A candidate: one choice of everything that a budget leaves open, as numbers, and the faults that they mean.
//!
//! Every choice of numbers means faults within the budget, so a search needs no corrections. Never rates a candidate.

use super::budget::{Allowance, Budget, Impairments, Kind};
use ringwing_flight::UavId;
use ringwing_scenario::{
    Action, Fault, Scenario,
    fault::{Delay, LinkImpairment, Links, ProcessFault, Receiver, Sender, Targets},
};

/// Shortest period of a flap, in ticks. With a shorter one, the new process would be killed before its first answer.
const FLAP_TICKS_MIN: f64 = 4.0;
/// Losses are whole multiples of one part in this. More make sentences longer and change next to nothing.
const LOSS_STEPS: f64 = 1000.0;
/// By how many ticks rounding may move a time that is a whole number of them. More would let faults begin before the window.
const TICK_ROUNDING: f64 = 1e-6;

/// What is open about one fault of a budget, each as a number from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gene {
    /// When it begins, from the beginning of the window to its end.
    pub time: f64,
    /// Which UAV or link: the places are equal shares of the range, and the last one stands for no fault.
    pub target: f64,
    /// How long it lasts, as a share of what is allowed.
    pub length: f64,
    /// What a link fault does: the allowed impairments are equal shares of the range.
    pub kind: f64,
    /// How strong it is, as a share of what is allowed; for a flap, its period as a share of its length.
    pub magnitude: f64,
}

/// Which numbers of a gene mean anything; time and target always do. The others are left alone, because a change of them
/// would fly the same flight again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Whether it lasts for a time that is open.
    pub has_length: bool,
    /// Whether there are several impairments to choose from.
    pub has_kind: bool,
    /// Whether it can be stronger or weaker.
    pub has_magnitude: bool,
}

/// One choice for every fault of a budget, in its order.
pub type Candidate = Vec<Gene>;

/// A budget in a scenario: what its faults can be aimed at.
#[derive(Debug, Clone)]
pub struct Arena {
    faults: Vec<Allowance>,
    impairments: Impairments,
    /// When faults may begin, in ticks.
    window: (f64, f64),
    rate_hz: f64,
    uavs: u32,
    /// The links that a single link fault can be aimed at.
    links: Vec<Links>,
    /// The scenario's own faults, which are not the budget's.
    own: Vec<Fault>,
}

impl Arena {
    /// `budget` in `scenario`, which has been validated.
    ///
    /// Without a window, faults begin in the first half of the flight, so that the rest shows how the swarm recovers.
    ///
    /// # Errors
    /// The window lies outside the flight, or a bound is shorter than a tick.
    pub fn new(budget: &Budget, scenario: &Scenario) -> Result<Self, String> {
        let duration_s = scenario.time.duration_s;
        let (from_s, to_s) = budget.window_s.unwrap_or((0.0, duration_s / 2.0));
        if to_s > duration_s {
            return Err(format!("from {from_s} s to {to_s} s: the flight ends at {duration_s} s"));
        }
        let rate_hz = f64::from(scenario.time.rate_hz);
        let period_s = scenario.period_s();
        // Faults last whole ticks, so none would keep a bound that is shorter than one. A kill has the bound 0 and no
        // length.
        let times_s = budget.faults.iter().map(|fault| fault.most_s).chain(budget.impairments.delay_max_s);
        if let Some(short_s) = times_s.into_iter().find(|most_s| *most_s > 0.0 && *most_s < period_s) {
            return Err(format!("at most {short_s} s: a tick takes {period_s} s, so give at least that"));
        }
        // Round inwards: rounding to the nearest tick could begin a fault just outside the window.
        // A time such as 1.1 s is no binary number, and its product with the rate may lie just beside the tick.
        let window = ((from_s * rate_hz - TICK_ROUNDING).ceil(), (to_s * rate_hz + TICK_ROUNDING).floor());
        if window.1 < window.0 {
            return Err(format!("from {from_s} s to {to_s} s: no tick of {period_s} s begins in it"));
        }
        Ok(Self {
            faults: budget.faults.clone(),
            impairments: budget.impairments,
            window,
            rate_hz,
            uavs: scenario.formation.uavs,
            links: links(scenario),
            own: scenario.faults.clone(),
        })
    }

    /// The shape of each gene of a candidate.
    pub fn shapes(&self) -> Vec<Shape> {
        let Impairments { loss_max, delay_max_s, blackout } = self.impairments;
        let has_strength = loss_max.is_some() || delay_max_s.is_some();
        let choices = [loss_max.is_some(), delay_max_s.is_some(), blackout].into_iter().filter(|is| *is);
        let has_choice = choices.count() > 1;
        let shape = |fault: &Allowance| Shape {
            has_length: fault.kind != Kind::Kill,
            has_kind: fault.kind.is_of_links() && has_choice,
            has_magnitude: fault.kind == Kind::Flap || (fault.kind.is_of_links() && has_strength),
        };
        self.faults.iter().map(shape).collect()
    }

    /// When faults may begin, in seconds.
    pub fn window_s(&self) -> (f64, f64) {
        (self.window.0 / self.rate_hz, self.window.1 / self.rate_hz)
    }

    /// The faults that `candidate` stands for, in order of time.
    pub fn faults(&self, candidate: &Candidate) -> Vec<Fault> {
        let mut faults: Vec<_> =
            self.faults.iter().zip(candidate).filter_map(|(fault, gene)| self.fault(*fault, gene)).collect();
        faults.sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
        faults
    }

    fn fault(&self, Allowance { kind, most_s }: Allowance, gene: &Gene) -> Option<Fault> {
        let (from, to) = self.window;
        let at_s = (from + gene.time * (to - from)).round().clamp(from, to) / self.rate_hz;
        let for_s = self.time_s(gene.length, most_s);
        let process = |fault| {
            let uav = place(gene.target, self.uavs as usize)? as u32 + 1;
            Some(Action::Process { fault, targets: Targets::Uavs(vec![uav]) })
        };
        let action = match kind {
            Kind::Kill => process(ProcessFault::Kill),
            Kind::Restart => process(ProcessFault::Restart { after_s: for_s }),
            Kind::Freeze => process(ProcessFault::Freeze { for_s: Some(for_s) }),
            Kind::Flap => {
                let every_s = self.time_s(gene.magnitude, for_s).max(FLAP_TICKS_MIN / self.rate_hz);
                process(ProcessFault::Flap { every_s, for_s })
            }
            Kind::Link | Kind::Isolation | Kind::Network => self
                .links_of(kind, gene.target)
                .map(|links| Action::Link { links, impairment: self.impairment(gene), for_s: Some(for_s) }),
        };
        action.map(|action| Fault { at_s, action })
    }

    /// This share of a time, in whole ticks and at least one.
    fn time_s(&self, share: f64, most_s: f64) -> f64 {
        // The division may end a rounding error above the bound, and `excess` would then refuse the search's own
        // fault.
        ((share * most_s * self.rate_hz).floor().max(1.0) / self.rate_hz).min(most_s)
    }

    fn links_of(&self, kind: Kind, target: f64) -> Option<Links> {
        match kind {
            Kind::Isolation => place(target, self.uavs as usize).map(|uav| Links::Isolate(uav as u32 + 1)),
            Kind::Network => place(target, 1).map(|_| Links::All),
            _ => place(target, self.links.len()).map(|link| self.links[link].clone()),
        }
    }

    fn impairment(&self, gene: &Gene) -> LinkImpairment {
        let Impairments { loss_max, delay_max_s, blackout } = self.impairments;
        let loss = |most: f64| {
            let steps = (gene.magnitude * most * LOSS_STEPS).floor().max(1.0);
            LinkImpairment::Loss((steps / LOSS_STEPS).min(most))
        };
        let delay =
            |most_s| LinkImpairment::Delay(Delay::Constant { by_s: self.time_s(gene.magnitude, most_s) });
        let choices =
            [loss_max.map(loss), delay_max_s.map(delay), blackout.then_some(LinkImpairment::Blackout)];
        let mut allowed: Vec<_> = choices.into_iter().flatten().collect();
        // There is at least one: a budget with link faults and without bounds allows all three.
        let chosen = ((gene.kind * allowed.len() as f64) as usize).min(allowed.len() - 1);
        allowed.swap_remove(chosen)
    }

    /// Why `faults` are not within the budget; `None` if they are. The scenario's own faults count only if they are
    /// changed.
    pub fn excess(&self, faults: &[Fault]) -> Option<String> {
        let mut own = self.own.clone();
        let mut lengths: Vec<(Kind, f64)> = Vec::new();
        for fault in faults {
            // Each own fault excuses one fault only: a copy of it has to fit into the budget.
            if let Some(place) = own.iter().position(|known| known == fault) {
                own.swap_remove(place);
                continue;
            }
            let (from_s, to_s) = self.window_s();
            if fault.at_s < from_s || fault.at_s > to_s {
                return Some(format!("{fault} begins outside {from_s} s to {to_s} s"));
            }
            match self.cost(&fault.action) {
                Some(cost) => lengths.push(cost),
                None => return Some(format!("{fault} is in no budget like this")),
            }
        }
        // The longest faults need the longest allowances; where those fit, all others do.
        lengths.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let mut left = self.faults.clone();
        left.sort_by(|one, other| other.most_s.total_cmp(&one.most_s));
        lengths.into_iter().find_map(|(kind, for_s)| {
            let fits = |fault: &Allowance| fault.kind == kind && for_s <= fault.most_s;
            match left.iter().position(fits) {
                Some(place) => {
                    left.remove(place);
                    None
                }
                None => Some(format!("{} of {for_s} s: too long, or one too many", kind.name())),
            }
        })
    }

    /// What a fault takes of a budget: its kind and its length; `None` if no budget has such a fault.
    fn cost(&self, action: &Action) -> Option<(Kind, f64)> {
        match action {
            Action::Process { fault, targets: Targets::Uavs(uavs) } if uavs.len() == 1 => match *fault {
                ProcessFault::Kill => Some((Kind::Kill, 0.0)),
                ProcessFault::Restart { after_s } => Some((Kind::Restart, after_s)),
                ProcessFault::Freeze { for_s: Some(for_s) } => Some((Kind::Freeze, for_s)),
                ProcessFault::Flap { for_s, .. } => Some((Kind::Flap, for_s)),
                _ => None,
            },
            Action::Link { links, impairment, for_s: Some(for_s) } => {
                let kind = match links {
                    Links::Isolate(_) => Kind::Isolation,
                    Links::All => Kind::Network,
                    Links::Between(..) | Links::From(Sender::Uav(_) | Sender::Leader, Receiver::Uav(_)) => {
                        Kind::Link
                    }
                    Links::From(..) | Links::Partition(_) => return None,
                };
                self.impairments.allow(impairment).then_some((kind, *for_s))
            }
            _ => None,
        }
    }
}

impl Impairments {
    fn allow(&self, impairment: &LinkImpairment) -> bool {
        match impairment {
            LinkImpairment::Loss(loss) => self.loss_max.is_some_and(|most| *loss <= most),
            LinkImpairment::Delay(Delay::Constant { by_s }) => {
                self.delay_max_s.is_some_and(|most_s| *by_s <= most_s)
            }
            LinkImpairment::Blackout => self.blackout,
            _ => false,
        }
    }
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Kill => "a kill",
            Self::Restart => "a restart",
            Self::Flap => "a flap",
            Self::Freeze => "a freeze",
            Self::Link => "a link fault",
            Self::Isolation => "an isolation",
            Self::Network => "a network fault",
        }
    }
}

/// The place among `count` that a number from 0 to 1 stands for; `None` for the last share, which stands for no place.
fn place(number: f64, count: usize) -> Option<usize> {
    let place = (number * (count + 1) as f64) as usize;
    (place < count).then_some(place)
}

/// The links between ring neighbours, in each direction and in both, and those from the leader.
fn links(scenario: &Scenario) -> Vec<Links> {
    let ring = scenario.ring_order();
    let of = |uav: UavId| {
        // Only the next neighbour: the pair with the one before is listed at that one.
        let (one, other) = (uav.0, ring.next(uav).0);
        [
            Links::From(Sender::Uav(one), Receiver::Uav(other)),
            Links::From(Sender::Uav(other), Receiver::Uav(one)),
            Links::Between(one.min(other), one.max(other)),
            Links::From(Sender::Leader, Receiver::Uav(one)),
        ]
    };
    UavId::all(scenario.formation.uavs).flat_map(of).collect()
}

#[cfg(test)]
mod tests;
