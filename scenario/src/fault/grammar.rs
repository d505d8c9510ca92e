//! From a sentence to what it means.

use super::{
    Action, Delay, Fault, Links, Misunderstanding, ProcessFault, Receiver, Sender, Targets, Trouble,
    words::Words,
};

type Read<T> = Result<T, Misunderstanding>;

const DEEDS: [&str; 8] = ["kill", "stop", "freeze", "thaw", "start", "restart", "flap", "slow"];
const ACTIONS: [&str; 12] = [
    "kill",
    "stop",
    "freeze",
    "thaw",
    "start",
    "restart",
    "flap",
    "slow",
    "link",
    "partition",
    "isolate",
    "heal",
];
const TROUBLES: [&str; 10] =
    ["delay", "loss", "gilbert", "blackout", "duplicate", "reorder", "hold", "stuck", "bias", "noise"];
/// What a sample that is reordered is held back by, if it is not said.
const REORDERED_BY_S: f64 = 0.05;
/// Shape of a Pareto tail, if it is not said: the smallest whole one with a finite variance.
const PARETO_SHAPE: f64 = 3.0;

/// `at 30 s kill uav 3`.
pub(super) fn fault(text: &str) -> Read<Fault> {
    let mut words = Words::of(text);
    if !words.take("at") {
        return Err(words.wanted("when first, such as in: at 30 s kill uav 3", &["at"]));
    }
    let at_s = words.time_s()?;
    Ok(Fault { at_s, action: whole_action(&mut words)? })
}

/// `kill uav 3`.
pub(super) fn action(text: &str) -> Read<Action> {
    whole_action(&mut Words::of(text))
}

fn whole_action(words: &mut Words<'_>) -> Read<Action> {
    let action = match words.choose(&ACTIONS)? {
        "link" => {
            let links = links(words)?;
            on(links, trouble(words)?, words)?
        }
        "partition" => on(partition(words)?, cut(words)?, words)?,
        "isolate" => on(isolate(words)?, cut(words)?, words)?,
        "heal" => Action::Heal(healed(words)?),
        fault => process(fault, words)?,
    };
    words.end()?;
    Ok(action)
}

fn process(verb: &str, words: &mut Words<'_>) -> Read<Action> {
    debug_assert!(DEEDS.contains(&verb));
    let targets = targets(words)?;
    let fault = match verb {
        "kill" => ProcessFault::Kill,
        "stop" => ProcessFault::Stop,
        "freeze" => ProcessFault::Freeze { for_s: for_s(words)? },
        "thaw" => ProcessFault::Thaw,
        "start" => ProcessFault::Start,
        "restart" => {
            words.need("after")?;
            ProcessFault::Restart { after_s: words.duration_s()? }
        }
        "flap" => {
            words.need("every")?;
            let every_s = words.duration_s()?;
            words.need("for")?;
            ProcessFault::Flap { every_s, for_s: words.duration_s()? }
        }
        _ => {
            words.need("by")?;
            ProcessFault::Slow { by_s: words.duration_s()?, for_s: for_s(words)? }
        }
    };
    Ok(Action::Process { fault, targets })
}

fn targets(words: &mut Words<'_>) -> Read<Targets> {
    Ok(match words.choose(&["uav", "random", "all", "leader", "recorder", "world"])? {
        "uav" => Targets::Uavs(words.separated(uav)?),
        "random" => {
            let count = words.count("how many UAVs to draw, such as random 2 uavs")?;
            words.choose(&["uavs", "uav"])?;
            Targets::Random(count)
        }
        "all" => {
            words.need("uavs")?;
            Targets::AllUavs
        }
        "leader" => Targets::Leader,
        "recorder" => Targets::Recorder,
        _ => Targets::World,
    })
}

fn uav(words: &mut Words<'_>) -> Read<u32> {
    words.count("a UAV's number, from 1")
}

fn for_s(words: &mut Words<'_>) -> Read<Option<f64>> {
    if words.take("for") { words.duration_s().map(Some) } else { Ok(None) }
}

fn on(links: Links, trouble: Trouble, words: &mut Words<'_>) -> Read<Action> {
    Ok(Action::Link { links, trouble, for_s: for_s(words)? })
}

/// What a partition does if nothing else is said.
fn cut(words: &mut Words<'_>) -> Read<Trouble> {
    if words.peek().is_none_or(|word| word.eq_ignore_ascii_case("for")) {
        Ok(Trouble::Blackout)
    } else {
        trouble(words)
    }
}

/// `2->3`, `2<->3`, `all`, `leader->all`, `own->3`.
fn links(words: &mut Words<'_>) -> Read<Links> {
    let sender = if words.take("leader") {
        Sender::Leader
    } else if words.take("own") {
        Sender::Own
    } else if words.take("all") {
        if !matches!(words.peek(), Some("->")) {
            return Ok(Links::All);
        }
        Sender::All
    } else {
        Sender::Uav(words.count("a link, such as 2->3, 2<->3, leader->all, own->3 or all")?)
    };
    if let Sender::Uav(one) = sender
        && words.take("<->")
    {
        let other = uav(words)?;
        return Ok(Links::Between(one.min(other), one.max(other)));
    }
    words.need("->")?;
    Ok(Links::From(sender, if words.take("all") { Receiver::All } else { Receiver::Uav(uav(words)?) }))
}

/// `{1,2,3}|{4,5,6}`.
fn partition(words: &mut Words<'_>) -> Read<Links> {
    let mut groups = vec![words.braced(uav)?];
    words.need("|")?;
    groups.push(words.braced(uav)?);
    while words.take("|") {
        groups.push(words.braced(uav)?);
    }
    let mut named = groups.concat();
    named.sort_unstable();
    match named.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => Err(words.wanted(&format!("each UAV in one group: uav {} is in two", twice[0]), &[])),
        None => Ok(Links::Partition(groups)),
    }
}

fn isolate(words: &mut Words<'_>) -> Read<Links> {
    // Also `isolate uav 3`: as the processes are called.
    words.take("uav");
    uav(words).map(Links::Isolate)
}

fn healed(words: &mut Words<'_>) -> Read<Links> {
    match words.choose(&["all", "link", "partition", "isolate"])? {
        "all" => Ok(Links::All),
        "link" => links(words),
        "partition" => partition(words),
        _ => isolate(words),
    }
}

fn trouble(words: &mut Words<'_>) -> Read<Trouble> {
    Ok(match words.choose(&TROUBLES)? {
        "delay" => Trouble::Delay(delay(words)?),
        "loss" => Trouble::Loss(words.probability()?),
        "gilbert" => gilbert(words)?,
        "blackout" => Trouble::Blackout,
        "duplicate" => Trouble::Duplicate(words.probability()?),
        "reorder" => {
            let p = words.probability()?;
            Trouble::Reorder { p, by_s: if words.take("by") { words.duration_s()? } else { REORDERED_BY_S } }
        }
        "hold" => Trouble::Hold,
        "stuck" => Trouble::Stuck,
        "bias" => bias(words)?,
        _ => noise(words)?,
    })
}

fn delay(words: &mut Words<'_>) -> Read<Delay> {
    if words.take("trace") {
        return words.braced(Words::time_s).map(Delay::Trace);
    }
    if words.take("file") {
        return words.text("a file of delays in quotes, such as \"wifi.txt\"").map(Delay::File);
    }
    if !words.peek().is_some_and(|word| word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))) {
        return Err(words.wanted(
            "a time such as 200 ms, trace {20 ms, 35 ms}, or file \"wifi.txt\"",
            &["trace", "file"],
        ));
    }
    let by_s = words.time_s()?;
    Ok(if words.take("jitter") {
        Delay::Uniform { by_s, jitter_s: words.duration_s()? }
    } else if words.take("normal") {
        Delay::Normal { by_s, deviation_s: words.duration_s()? }
    } else if words.take("pareto") {
        let tail_s = words.duration_s()?;
        let shape = if words.take("shape") { words.above(1.0, "a shape such as 3")? } else { PARETO_SHAPE };
        Delay::Pareto { by_s, tail_s, shape }
    } else {
        Delay::Constant { by_s }
    })
}

/// `gilbert 1 % 10 %`, and then what comes through a bad and a good link: nothing and all, if it is not said.
fn gilbert(words: &mut Words<'_>) -> Read<Trouble> {
    let (p, r) = (words.probability()?, words.probability()?);
    let more =
        |words: &Words<'_>| words.peek().is_some_and(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    let h = if more(words) { words.probability()? } else { 0.0 };
    let k = if more(words) { words.probability()? } else { 1.0 };
    Ok(Trouble::Gilbert { p, r, h, k })
}

fn bias(words: &mut Words<'_>) -> Read<Trouble> {
    let (mut x_m, mut y_m, mut heading_rad) = (0.0, 0.0, 0.0);
    let mut which = Some(words.choose(&["x", "y", "heading"])?);
    while let Some(name) = which {
        match name {
            "x" => x_m = words.length_m()?,
            "y" => y_m = words.length_m()?,
            _ => heading_rad = words.angle_rad()?,
        }
        which = ["x", "y", "heading"].into_iter().find(|name| words.take(name));
    }
    Ok(Trouble::Bias { x_m, y_m, heading_rad })
}

fn noise(words: &mut Words<'_>) -> Read<Trouble> {
    let (mut position_m, mut heading_rad) = (0.0, 0.0);
    let mut which = Some(words.choose(&["position", "heading"])?);
    while let Some(name) = which {
        match name {
            "position" => position_m = words.length_m()?.abs(),
            _ => heading_rad = words.angle_rad()?.abs(),
        }
        which = ["position", "heading"].into_iter().find(|name| words.take(name));
    }
    Ok(Trouble::Noise { position_m, heading_rad })
}
