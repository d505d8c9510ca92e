//! Writes a fault as its sentence. Parsing the sentence gives the same fault, to the last bit.
//!
//! Never checks a fault.

use super::{
    Action, Delay, Fault, LinkImpairment, Links, ProcessFault, Receiver, Sender, SensorDrift, Targets,
};
use std::fmt::{self, Display, Formatter};

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "at {} {}", time(self.at_s), self.action)
    }
}

impl Display for Action {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Process { fault, targets } => write!(f, "{} {targets}{}", fault.verb(), fault.parameters()),
            Self::Link { links, impairment, for_s } => {
                // The grammar assumes a blackout when a partition or an isolation names no impairment.
                let is_implied = matches!(links, Links::Partition(_) | Links::Isolate(_))
                    && *impairment == LinkImpairment::Blackout;
                write!(f, "{links}")?;
                if !is_implied {
                    write!(f, " {impairment}")?;
                }
                f.write_str(&duration(*for_s))
            }
            Self::Heal(Links::All) => f.write_str("heal all"),
            Self::Heal(links) => write!(f, "heal {links}"),
        }
    }
}

impl From<Action> for String {
    fn from(action: Action) -> Self {
        action.to_string()
    }
}

impl ProcessFault {
    fn verb(self) -> &'static str {
        match self {
            Self::Kill => "kill",
            Self::Stop => "stop",
            Self::Freeze { .. } => "freeze",
            Self::Thaw => "thaw",
            Self::Start => "start",
            Self::Restart { .. } => "restart",
            Self::Flap { .. } => "flap",
            Self::Slow { .. } => "slow",
            Self::Weaken { .. } => "weaken",
            Self::Jam { .. } => "jam",
            Self::Drift { .. } => "drift",
        }
    }

    fn parameters(self) -> String {
        match self {
            Self::Kill | Self::Stop | Self::Thaw | Self::Start => String::new(),
            Self::Freeze { for_s } => duration(for_s),
            Self::Restart { after_s } => format!(" after {}", time(after_s)),
            Self::Flap { every_s, for_s } => format!(" every {}{}", time(every_s), duration(Some(for_s))),
            Self::Slow { by_s, for_s } => format!(" by {}{}", time(by_s), duration(for_s)),
            Self::Weaken { to_m_s, for_s } => format!(" to {to_m_s} m/s{}", duration(for_s)),
            Self::Jam { turn_rate_rad_s, for_s } => {
                format!(" turn at {}/s{}", angle(turn_rate_rad_s), duration(for_s))
            }
            Self::Drift { drift, for_s } => format!(" {drift}{}", duration(for_s)),
        }
    }
}

impl Display for SensorDrift {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position { speed_m_s, toward_rad } => {
                write!(f, "position at {speed_m_s} m/s toward {}", angle(*toward_rad))
            }
            Self::Heading { rate_rad_s } => write!(f, "heading at {}/s", angle(*rate_rad_s)),
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
            Self::Traffic => f.write_str("traffic"),
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

impl Display for LinkImpairment {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delay(delay) => delay.fmt(f),
            Self::Loss(p) => write!(f, "loss {}", probability(*p)),
            Self::Gilbert { p, r, h, k } => {
                write!(
                    f,
                    "gilbert {} {} {} {}",
                    probability(*p),
                    probability(*r),
                    probability(*h),
                    probability(*k)
                )
            }
            Self::GilbertBurst { loss, burst_s } => {
                write!(f, "gilbert loss {} burst {}", probability(*loss), time(*burst_s))
            }
            Self::Blackout => f.write_str("blackout"),
            Self::Corrupt(p) => write!(f, "corrupt {}", probability(*p)),
            Self::Rate { samples_per_s, queue } => write!(f, "rate {samples_per_s} samples/s queue {queue}"),
            Self::Duplicate(p) => write!(f, "duplicate {}", probability(*p)),
            Self::Reorder { p, by_s } => write!(f, "reorder {} by {}", probability(*p), time(*by_s)),
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

fn duration(for_s: Option<f64>) -> String {
    for_s.map_or_else(String::new, |for_s| format!(" for {}", time(for_s)))
}

/// In milliseconds below a second, if those parse to the same value.
fn time(value_s: f64) -> String {
    let value_ms = value_s * 1000.0;
    shorter(
        format!("{value_s} s"),
        (value_s != 0.0 && value_s < 1.0 && value_ms / 1000.0 == value_s).then(|| format!("{value_ms} ms")),
    )
}

/// In per cent, if that is short and parses to the same value.
fn probability(value: f64) -> String {
    let percent = value * 100.0;
    shorter(
        format!("{value}"),
        (percent / 100.0 == value).then(|| format!("{percent} %")).filter(|_| percent != 0.0),
    )
}

/// In degrees, if those are short and parse to the same value.
fn angle(value_rad: f64) -> String {
    let degrees = value_rad.to_degrees();
    // Converting 5 degrees to radians and back leaves a rounding error: try the round number that was probably written.
    let rounded = (degrees * 1e6).round() / 1e6;
    shorter(format!("{value_rad} rad"), (rounded.to_radians() == value_rad).then(|| format!("{rounded} deg")))
}

/// `other` unless it is longer than `one`. Its unit may be up to two letters longer.
fn shorter(one: String, other: Option<String>) -> String {
    const LONGER_UNIT: usize = 2;
    other.filter(|other| other.len() <= one.len() + LONGER_UNIT).unwrap_or(one)
}
