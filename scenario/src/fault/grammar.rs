//! Parses the sentence of a fault.
//!
//! Never checks a fault against a swarm: whether the UAVs named exist is [`Action::refusal`]'s question.

use super::{
    Action, Delay, Fault, FaultSyntaxError, LinkImpairment, Links, ProcessFault, Receiver, Sender,
    SensorDrift, Targets,
    lexer::{Lexer, Parsed},
};
use std::str::FromStr;

const ACTIONS: [&str; 15] = [
    "kill",
    "stop",
    "freeze",
    "thaw",
    "start",
    "restart",
    "flap",
    "slow",
    "weaken",
    "jam",
    "drift",
    "link",
    "partition",
    "isolate",
    "heal",
];
const IMPAIRMENTS: [&str; 12] = [
    "delay",
    "loss",
    "gilbert",
    "blackout",
    "corrupt",
    "rate",
    "duplicate",
    "reorder",
    "hold",
    "stuck",
    "bias",
    "noise",
];
/// Default places in the queue of a link with a limited rate. A longer queue delays samples for longer before it drops
/// any.
const QUEUE_DEFAULT: u32 = 10;
/// Time by which `reorder` holds a sample back by default: five ticks at 100 Hz. A time shorter than a tick would
/// reorder nothing.
const REORDER_DEFAULT_S: f64 = 0.05;
/// Default shape of a Pareto tail: the smallest whole number with a finite variance. A larger shape makes very late
/// samples rarer.
const PARETO_SHAPE_DEFAULT: f64 = 3.0;

impl FromStr for Fault {
    type Err = FaultSyntaxError;

    fn from_str(text: &str) -> Parsed<Self> {
        let mut words = Lexer::new(text);
        if !words.take("at") {
            return Err(words.expected("a time first, such as in: at 30 s kill uav 3", &["at"]));
        }
        let at_s = words.time_s()?;
        Ok(Self { at_s, action: action(&mut words)? })
    }
}

impl FromStr for Action {
    type Err = FaultSyntaxError;

    fn from_str(text: &str) -> Parsed<Self> {
        action(&mut Lexer::new(text))
    }
}

impl TryFrom<String> for Action {
    type Error = FaultSyntaxError;

    fn try_from(text: String) -> Parsed<Self> {
        text.parse()
    }
}

/// The words that may follow `start`, the start of a fault, to complete a command line.
///
/// A start without a time, such as `kill`, is that of a live fault. Numbers are not listed, only words.
pub fn next_words(start: &str) -> Vec<String> {
    let mut words = Lexer::new(start);
    let is_timed = words.take("at");
    // An error says that the sentence is incomplete, or that it is wrong. Then nothing was looked for at its end.
    let _ = if is_timed { words.time_s().and_then(|_| action(&mut words)) } else { action(&mut words) };
    let mut next = words.into_continuations();
    next.retain(|word| word.chars().all(char::is_alphabetic));
    next
}

/// An action, which must be all that is left of the sentence.
fn action(words: &mut Lexer<'_>) -> Parsed<Action> {
    let action = match words.choose(&ACTIONS)? {
        "link" => {
            let links = links(words)?;
            link_action(links, impairment(words)?, words)?
        }
        "partition" => link_action(partition(words)?, impairment_or_blackout(words)?, words)?,
        "isolate" => link_action(isolate(words)?, impairment_or_blackout(words)?, words)?,
        "heal" => Action::Heal(healed_links(words)?),
        verb => process_action(verb, words)?,
    };
    words.end()?;
    Ok(action)
}

fn process_action(verb: &str, words: &mut Lexer<'_>) -> Parsed<Action> {
    // The targets come before the times: `freeze uav 3 for 2 s`.
    let targets = targets(words)?;
    let fault = process_fault(verb, words)?;
    Ok(Action::Process { fault, targets })
}

fn process_fault(verb: &str, words: &mut Lexer<'_>) -> Parsed<ProcessFault> {
    Ok(match verb {
        "kill" => ProcessFault::Kill,
        "stop" => ProcessFault::Stop,
        "freeze" => ProcessFault::Freeze { for_s: for_s(words)? },
        "thaw" => ProcessFault::Thaw,
        "start" => ProcessFault::Start,
        "restart" => {
            words.expect("after")?;
            ProcessFault::Restart { after_s: words.duration_s()? }
        }
        "flap" => {
            words.expect("every")?;
            let every_s = words.duration_s()?;
            words.expect("for")?;
            ProcessFault::Flap { every_s, for_s: words.duration_s()? }
        }
        "slow" => {
            words.expect("by")?;
            ProcessFault::Slow { by_s: words.duration_s()?, for_s: for_s(words)? }
        }
        "weaken" => {
            words.expect("to")?;
            ProcessFault::Weaken { to_m_s: words.speed_m_s()?, for_s: for_s(words)? }
        }
        "jam" => {
            ["turn", "at"].into_iter().try_for_each(|word| words.expect(word))?;
            ProcessFault::Jam { turn_rate_rad_s: words.turn_rate_rad_s()?, for_s: for_s(words)? }
        }
        // "drift", the last of the process faults in ACTIONS.
        _ => ProcessFault::Drift { drift: drift(words)?, for_s: for_s(words)? },
    })
}

/// `position at 0.5 m/s toward 90 deg`, or `heading at 1 deg/s`.
fn drift(words: &mut Lexer<'_>) -> Parsed<SensorDrift> {
    let sensor = words.choose(&["position", "heading"])?;
    words.expect("at")?;
    if sensor == "heading" {
        return Ok(SensorDrift::Heading { rate_rad_s: words.turn_rate_rad_s()? });
    }
    let speed_m_s = words.speed_m_s()?;
    words.expect("toward")?;
    Ok(SensorDrift::Position { speed_m_s, toward_rad: words.angle_rad()? })
}

fn targets(words: &mut Lexer<'_>) -> Parsed<Targets> {
    Ok(match words.choose(&["uav", "random", "all", "leader", "recorder", "world"])? {
        "uav" => Targets::Uavs(words.separated(uav)?),
        "random" => {
            let count = words.count("the number of UAVs to draw, such as random 2 uavs")?;
            // Accept the singular for `random 1 uav`.
            words.choose(&["uavs", "uav"])?;
            Targets::Random(count)
        }
        "all" => {
            words.expect("uavs")?;
            Targets::AllUavs
        }
        "leader" => Targets::Leader,
        "recorder" => Targets::Recorder,
        _ => Targets::World,
    })
}

fn uav(words: &mut Lexer<'_>) -> Parsed<u32> {
    words.count("the number of a UAV, from 1")
}

/// `for 10 s`, or nothing.
fn for_s(words: &mut Lexer<'_>) -> Parsed<Option<f64>> {
    if words.take("for") { words.duration_s().map(Some) } else { Ok(None) }
}

fn link_action(links: Links, impairment: LinkImpairment, words: &mut Lexer<'_>) -> Parsed<Action> {
    Ok(Action::Link { links, impairment, for_s: for_s(words)? })
}

/// `partition` and `isolate` cut links unless the sentence names an impairment.
fn impairment_or_blackout(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    // `for` starts the duration, so a sentence that goes on with it has named no impairment.
    if words.peek().is_none_or(|word| word.eq_ignore_ascii_case("for")) {
        Ok(LinkImpairment::Blackout)
    } else {
        impairment(words)
    }
}

/// `2->3`, `2<->3`, `all`, `leader->all`, `own->3`, `traffic->3`.
fn links(words: &mut Lexer<'_>) -> Parsed<Links> {
    let sender = sender(words)?;
    // `all` alone means every link, but `all->3` begins with the same word.
    if sender == Sender::All && words.peek() != Some("->") {
        return Ok(Links::All);
    }
    if let Sender::Uav(one) = sender
        && words.take("<->")
    {
        let other = uav(words)?;
        // `heal` compares links, so `3<->2` must be the same value as `2<->3`.
        return Ok(Links::Between(one.min(other), one.max(other)));
    }
    words.expect("->")?;
    Ok(Links::From(sender, if words.take("all") { Receiver::All } else { Receiver::Uav(uav(words)?) }))
}

fn sender(words: &mut Lexer<'_>) -> Parsed<Sender> {
    Ok(if words.take("leader") {
        Sender::Leader
    } else if words.take("own") {
        Sender::Own
    } else if words.take("traffic") {
        Sender::Traffic
    } else if words.take("all") {
        Sender::All
    } else {
        Sender::Uav(words.count("a link, such as 2->3, 2<->3, leader->all, own->3, traffic->3 or all")?)
    })
}

/// `{1,2,3}|{4,5,6}`.
fn partition(words: &mut Lexer<'_>) -> Parsed<Links> {
    let mut groups = vec![words.braced(uav)?];
    words.expect("|")?;
    groups.push(words.braced(uav)?);
    while words.take("|") {
        groups.push(words.braced(uav)?);
    }
    // Only the first group of a UAV would count, so a second one must be a mistake.
    let mut named = groups.concat();
    named.sort_unstable();
    match named.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(words.expected(&format!("each UAV once, but uav {} is named twice", pair[0]), &[])),
        None => Ok(Links::Partition(groups)),
    }
}

/// `3`, or `uav 3` as in the process faults.
fn isolate(words: &mut Lexer<'_>) -> Parsed<Links> {
    words.take("uav");
    uav(words).map(Links::Isolate)
}

fn healed_links(words: &mut Lexer<'_>) -> Parsed<Links> {
    match words.choose(&["all", "link", "partition", "isolate"])? {
        "all" => Ok(Links::All),
        "link" => links(words),
        "partition" => partition(words),
        _ => isolate(words),
    }
}

fn impairment(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    Ok(match words.choose(&IMPAIRMENTS)? {
        "delay" => LinkImpairment::Delay(delay(words)?),
        "loss" => LinkImpairment::Loss(words.probability()?),
        "gilbert" => gilbert(words)?,
        "blackout" => LinkImpairment::Blackout,
        "corrupt" => LinkImpairment::Corrupt(words.probability()?),
        "rate" => rate(words)?,
        "duplicate" => LinkImpairment::Duplicate(words.probability()?),
        "reorder" => {
            let p = words.probability()?;
            let by_s = if words.take("by") { words.duration_s()? } else { REORDER_DEFAULT_S };
            LinkImpairment::Reorder { p, by_s }
        }
        "hold" => LinkImpairment::Hold,
        "stuck" => LinkImpairment::Stuck,
        "bias" => bias(words)?,
        _ => noise(words)?,
    })
}

fn delay(words: &mut Lexer<'_>) -> Parsed<Delay> {
    if words.take("trace") {
        return words.braced(Lexer::time_s).map(Delay::Trace);
    }
    if words.take("file") {
        return words.text("a file of delays in quotes, such as \"wifi.txt\"").map(Delay::File);
    }
    // Without this check the error would name only a time, and not the other two forms.
    if !words.is_at_number() {
        let what = "a time such as 200 ms, trace {20 ms, 35 ms}, or file \"wifi.txt\"";
        return Err(words.expected(what, &["trace", "file"]));
    }
    let by_s = words.time_s()?;
    Ok(if words.take("jitter") {
        Delay::Uniform { by_s, jitter_s: words.duration_s()? }
    } else if words.take("normal") {
        Delay::Normal { by_s, deviation_s: words.duration_s()? }
    } else if words.take("pareto") {
        let tail_s = words.duration_s()?;
        let has_shape = words.take("shape");
        let shape = if has_shape { words.above(1.0, "a shape such as 3")? } else { PARETO_SHAPE_DEFAULT };
        Delay::Pareto { by_s, tail_s, shape }
    } else {
        Delay::Constant { by_s }
    })
}

/// `rate 20 samples/s queue 10`: a link's capacity, and how many samples wait for it.
fn rate(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    let samples_per_s = words.samples_per_s()?;
    let queue = if words.take("queue") { words.places()? } else { QUEUE_DEFAULT };
    Ok(LinkImpairment::Rate { samples_per_s, queue })
}

/// `gilbert loss 5 % burst 80 ms`, by what people measure; or `gilbert 1 % 10 %`, by the probabilities of the chain: by
/// default a bad link loses every sample and a good one none.
fn gilbert(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    if words.take("loss") {
        let loss = words.probability()?;
        words.expect("burst")?;
        return Ok(LinkImpairment::GilbertBurst { loss, burst_s: words.duration_s()? });
    }
    // Without this check the error would name only a probability, and not the other form.
    if !words.is_at_number() {
        let what = "loss, as in: gilbert loss 5 % burst 80 ms; or two probabilities, as in: gilbert 1 % 10 %";
        return Err(words.expected(what, &["loss"]));
    }
    let (p, r) = (words.probability()?, words.probability()?);
    // Neither of the two has a keyword, so a number that follows can only belong to them.
    let h = if words.is_at_number() { words.probability()? } else { 0.0 };
    let k = if words.is_at_number() { words.probability()? } else { 1.0 };
    Ok(LinkImpairment::Gilbert { p, r, h, k })
}

/// `bias x 3 m heading 5 deg`: one or more errors in any order; the others are 0.
fn bias(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    const NAMES: [&str; 3] = ["x", "y", "heading"];
    let (mut x_m, mut y_m, mut heading_rad) = (0.0, 0.0, 0.0);
    // The first name is required, so `choose` reports a missing one. The others are optional.
    let mut next = Some(words.choose(&NAMES)?);
    while let Some(name) = next {
        match name {
            "x" => x_m = words.length_m()?,
            "y" => y_m = words.length_m()?,
            _ => heading_rad = words.angle_rad()?,
        }
        next = NAMES.into_iter().find(|name| words.take(name));
    }
    Ok(LinkImpairment::Bias { x_m, y_m, heading_rad })
}

/// `noise position 2 m heading 1 deg`: one or both, in any order; the other is 0.
fn noise(words: &mut Lexer<'_>) -> Parsed<LinkImpairment> {
    const NAMES: [&str; 2] = ["position", "heading"];
    let (mut position_m, mut heading_rad) = (0.0, 0.0);
    let mut next = Some(words.choose(&NAMES)?);
    while let Some(name) = next {
        match name {
            // A standard deviation has no sign.
            "position" => position_m = words.length_m()?.abs(),
            _ => heading_rad = words.angle_rad()?.abs(),
        }
        next = NAMES.into_iter().find(|name| words.take(name));
    }
    Ok(LinkImpairment::Noise { position_m, heading_rad })
}
