//! What cases, hops and quantities are called wherever they are shown.

use super::result::{Case, Hop, Load, Subject, Wake};

/// Of what carries the data.
pub(crate) fn subject(subject: Subject) -> &'static str {
    match subject {
        Subject::Swarm => "swarm",
        Subject::Gate => "gate alone",
        Subject::Atomic => "atomic word",
        Subject::Futex => "futex",
        Subject::Pipe => "pipe",
        Subject::PipePolled => "pipe, polled",
        Subject::UnixDatagram => "Unix datagram",
        Subject::Udp => "UDP",
        Subject::Tcp => "TCP",
    }
}

/// Of when ticks begin.
pub(crate) fn load(load: Load) -> String {
    match load {
        Load::Closed => "closed loop".into(),
        Load::Paced(rate_hz) => format!("paced at {rate_hz} Hz"),
    }
}

/// Of what carries the data and in which way: all of a case but its load and its size.
pub(crate) fn way(case: &Case) -> String {
    let wake = match case.wake {
        Wake::Gate => "",
        Wake::Spin => ", spinning",
        Wake::Event => ", events",
    };
    let payload = if case.payload_bytes > 0 { format!(", {} B", case.payload_bytes) } else { String::new() };
    let recorded = if case.recorder { ", recorded" } else { "" };
    [subject(case.subject), wake, &payload, recorded].concat()
}

/// All of a case.
pub(crate) fn case(case: &Case) -> String {
    let agents = if case.uavs == 1 { "1 UAV".into() } else { format!("{} UAVs", case.uavs) };
    format!("{}, {agents}, {}", way(case), load(case.load))
}

/// A case as file names and tags have it: no spaces, no commas.
pub(crate) fn file(case: &Case) -> String {
    let load = match case.load {
        Load::Closed => "closed".into(),
        Load::Paced(rate_hz) => format!("paced-{rate_hz}hz"),
    };
    let way: Vec<String> =
        way(case).split([' ', ',']).filter(|word| !word.is_empty()).map(str::to_lowercase).collect();
    format!("{}-{}-{load}", way.join("-"), case.uavs)
}

/// Of a part of a tick's way.
pub(crate) fn hop(hop: Hop) -> &'static str {
    match hop {
        Hop::Wake => "wake",
        Hop::Read => "read",
        Hop::Compute => "compute",
        Hop::Return => "return",
        Hop::Tick => "whole tick",
    }
}

/// The same as file names and tags have it.
pub(crate) fn hop_file(hop: Hop) -> &'static str {
    match hop {
        Hop::Tick => "tick",
        part => self::hop(part),
    }
}

/// Nanoseconds as microseconds, with three figures or down to a nanosecond: `0.51`, `13.8`, `1 204`.
pub(crate) fn us(ns: f64) -> String {
    let us = ns / 1e3;
    if us < 9.995 {
        format!("{us:.2}")
    } else if us < 99.95 {
        format!("{us:.1}")
    } else {
        grouped(us.round() as u64)
    }
}

/// A count with its thousands apart.
pub(crate) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Case = Case {
        subject: Subject::Swarm,
        load: Load::Closed,
        uavs: 6,
        wake: Wake::Gate,
        payload_bytes: 0,
        recorder: false,
    };

    #[test]
    fn a_case_is_called_by_what_sets_it_apart() {
        assert_eq!(case(&PLAIN), "swarm, 6 UAVs, closed loop");
        let laden =
            Case { load: Load::Paced(100), wake: Wake::Event, payload_bytes: 4096, recorder: true, ..PLAIN };
        assert_eq!(case(&laden), "swarm, events, 4096 B, recorded, 6 UAVs, paced at 100 Hz");
        assert_eq!(file(&laden), "swarm-events-4096-b-recorded-6-paced-100hz");
        let alone = Case { subject: Subject::PipePolled, uavs: 1, ..PLAIN };
        assert_eq!(case(&alone), "pipe, polled, 1 UAV, closed loop");
    }

    #[test]
    fn microseconds_have_three_figures() {
        let shown = [0.0, 512.0, 9_994.0, 9_996.0, 99_949.0, 99_951.0, 1_204_300.0].map(us);
        assert_eq!(shown, ["0.00", "0.51", "9.99", "10.0", "99.9", "100", "1 204"]);
    }

    #[test]
    fn thousands_stand_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }
}
