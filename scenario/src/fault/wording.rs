//! From what is meant to the sentence that says it: read back, it means the same to the last bit.

use super::{Action, Delay, Fault, Links, ProcessFault, Receiver, Sender, Source, Targets, Trouble};
use std::fmt::{self, Display, Formatter};

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "at {} {}", time(self.at_s), self.action)
    }
}

impl Display for Action {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Process { fault, targets } => write!(f, "{} {targets}{}", fault.verb(), fault.rest()),
            Self::Link { links, trouble, for_s } => {
                match (links, trouble) {
                    (Links::Partition(_) | Links::Isolate(_), Trouble::Blackout) => write!(f, "{links}")?,
                    _ => write!(f, "{links} {trouble}")?,
                }
                f.write_str(&lasting(*for_s))
            }
            Self::Heal(Links::All) => f.write_str("heal all"),
            Self::Heal(links) => write!(f, "heal {links}"),
        }
    }
}

impl ProcessFault {
    pub(super) fn verb(self) -> &'static str {
        match self {
            Self::Kill => "kill",
            Self::Stop => "stop",
            Self::Freeze { .. } => "freeze",
            Self::Thaw => "thaw",
            Self::Start => "start",
            Self::Restart { .. } => "restart",
            Self::Flap { .. } => "flap",
            Self::Slow { .. } => "slow",
        }
    }

    fn rest(self) -> String {
        match self {
            Self::Kill | Self::Stop | Self::Thaw | Self::Start => String::new(),
            Self::Freeze { for_s } => lasting(for_s),
            Self::Restart { after_s } => format!(" after {}", time(after_s)),
            Self::Flap { every_s, for_s } => format!(" every {}{}", time(every_s), lasting(Some(for_s))),
            Self::Slow { by_s, for_s } => format!(" by {}{}", time(by_s), lasting(for_s)),
        }
    }
}

impl Display for Targets {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::World => f.write_str("world"),
            Self::Leader => f.write_str("leader"),
            Self::Recorder => f.write_str("recorder"),
            Self::Uavs(uavs) => write!(f, "uav {}", joined(uavs)),
            Self::Random(count) => write!(f, "random {count} uavs"),
            Self::AllUavs => f.write_str("all uavs"),
        }
    }
}

impl Display for Links {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::From(sender, receiver) => write!(f, "link {sender}->{receiver}"),
            Self::Between(one, other) => write!(f, "link {one}<->{other}"),
            Self::All => f.write_str("link all"),
            Self::Partition(groups) => {
                let groups: Vec<_> = groups.iter().map(|group| format!("{{{}}}", joined(group))).collect();
                write!(f, "partition {}", groups.join("|"))
            }
            Self::Isolate(uav) => write!(f, "isolate {uav}"),
        }
    }
}

impl Display for Sender {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uav(uav) => uav.fmt(f),
            Self::All => f.write_str("all"),
            Self::Leader => f.write_str("leader"),
            Self::Own => f.write_str("own"),
        }
    }
}

impl Display for Receiver {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uav(uav) => uav.fmt(f),
            Self::All => f.write_str("all"),
        }
    }
}

impl Display for Source {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uav(uav) => uav.fmt(f),
            Self::Leader => f.write_str("leader"),
            Self::Own => f.write_str("own"),
        }
    }
}

impl Display for Trouble {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delay(delay) => delay.fmt(f),
            Self::Loss(p) => write!(f, "loss {}", share(*p)),
            Self::Gilbert { p, r, h, k } => {
                write!(f, "gilbert {} {} {} {}", share(*p), share(*r), share(*h), share(*k))
            }
            Self::Blackout => f.write_str("blackout"),
            Self::Duplicate(p) => write!(f, "duplicate {}", share(*p)),
            Self::Reorder { p, by_s } => write!(f, "reorder {} by {}", share(*p), time(*by_s)),
            Self::Hold => f.write_str("hold"),
            Self::Stuck => f.write_str("stuck"),
            Self::Bias { x_m, y_m, heading_rad } => {
                write!(f, "bias x {x_m} m y {y_m} m heading {}", angle(*heading_rad))
            }
            Self::Noise { position_m, heading_rad } => {
                write!(f, "noise position {position_m} m heading {}", angle(*heading_rad))
            }
        }
    }
}

impl Display for Delay {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("delay ")?;
        match self {
            Self::Constant { by_s } => f.write_str(&time(*by_s)),
            Self::Uniform { by_s, jitter_s } => write!(f, "{} jitter {}", time(*by_s), time(*jitter_s)),
            Self::Normal { by_s, deviation_s } => write!(f, "{} normal {}", time(*by_s), time(*deviation_s)),
            Self::Pareto { by_s, tail_s, shape } => {
                write!(f, "{} pareto {} shape {shape}", time(*by_s), time(*tail_s))
            }
            Self::Trace(delays_s) => {
                let delays: Vec<_> = delays_s.iter().map(|delay_s| time(*delay_s)).collect();
                write!(f, "trace {{{}}}", delays.join(", "))
            }
            Self::File(path) => write!(f, "file \"{path}\""),
        }
    }
}

fn joined(uavs: &[u32]) -> String {
    uavs.iter().map(u32::to_string).collect::<Vec<_>>().join(",")
}

fn lasting(for_s: Option<f64>) -> String {
    for_s.map_or_else(String::new, |for_s| format!(" for {}", time(for_s)))
}

/// Below a second in milliseconds, where that says the same.
fn time(value_s: f64) -> String {
    let value_ms = value_s * 1000.0;
    shorter(
        format!("{value_s} s"),
        (value_s != 0.0 && value_s < 1.0 && value_ms / 1000.0 == value_s).then(|| format!("{value_ms} ms")),
    )
}

/// In per cent where that is shorter and says the same.
fn share(value: f64) -> String {
    let percent = value * 100.0;
    shorter(
        format!("{value}"),
        (percent / 100.0 == value).then(|| format!("{percent} %")).filter(|_| percent != 0.0),
    )
}

/// In degrees where that is shorter and says the same.
fn angle(value_rad: f64) -> String {
    let degrees = value_rad.to_degrees();
    // The nearest of few digits, which is what somebody wrote.
    let rounded = (degrees * 1e6).round() / 1e6;
    shorter(format!("{value_rad} rad"), (rounded.to_radians() == value_rad).then(|| format!("{rounded} deg")))
}

/// `other` if it is no longer than `one`, but for the unit's own letter or two.
fn shorter(one: String, other: Option<String>) -> String {
    const UNIT: usize = 2;
    other.filter(|other| other.len() <= one.len() + UNIT).unwrap_or(one)
}
