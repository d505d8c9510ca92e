//! Names of cases and hops, and the format of numbers, wherever they are shown.
//!
//! Must never decide what is shown.

use crate::{
    case::{Carrier, Case, Load, Topology},
    result::Hop,
};
use ringwing_scenario::Wake;

/// Name of a carrier.
pub(crate) fn carrier(carrier: &Carrier) -> &str {
    match carrier {
        Carrier::Swarm => "swarm",
        Carrier::Gate => "gate alone",
        Carrier::Atomic => "atomic word",
        Carrier::Futex => "futex",
        Carrier::Pipe => "pipe",
        Carrier::PipePolled => "pipe, polled",
        Carrier::UnixDatagram => "Unix datagram",
        Carrier::Udp => "UDP",
        Carrier::Tcp => "TCP",
        Carrier::Peer(name) => name,
    }
}

/// Name of a load.
pub(crate) fn load(load: Load) -> String {
    match load {
        Load::Closed => "closed loop".into(),
        Load::Paced(rate_hz) => format!("paced at {rate_hz} Hz"),
    }
}

/// Name of a case without its load and its size: the carrier, and what differs from the default.
pub(crate) fn setup(case: &Case) -> String {
    let topology = match case.topology {
        Topology::Hub => "",
        Topology::Mesh => ", mesh",
    };
    let wake = match case.wake {
        Wake::Gate => "",
        Wake::Spin => ", spinning",
        Wake::Event => ", events",
    };
    let payload = if case.payload_bytes > 0 { format!(", {} B", case.payload_bytes) } else { String::new() };
    let recorded = if case.recorder { ", recorded" } else { "" };
    [carrier(&case.carrier), topology, wake, &payload, recorded].concat()
}

/// Number of UAVs, in words.
pub(crate) fn uavs(count: u32) -> String {
    if count == 1 { "1 UAV".into() } else { format!("{count} UAVs") }
}

/// Complete name of a case.
pub(crate) fn case(case: &Case) -> String {
    format!("{}, {}, {}", setup(case), uavs(case.uavs), load(case.load))
}

/// Name of a case in file names and tags: without spaces and commas.
pub(crate) fn file(case: &Case) -> String {
    let load = match case.load {
        Load::Closed => "closed".into(),
        Load::Paced(rate_hz) => format!("paced-{rate_hz}hz"),
    };
    let words: Vec<String> =
        setup(case).split([' ', ',']).filter(|word| !word.is_empty()).map(str::to_lowercase).collect();
    format!("{}-{}-{load}", words.join("-"), case.uavs)
}

/// Name of a hop.
pub(crate) fn hop(hop: Hop) -> &'static str {
    match hop {
        Hop::Wake => "wake",
        Hop::Read => "read",
        Hop::Compute => "compute",
        Hop::Return => "return",
        Hop::Tick => "whole tick",
    }
}

/// Name of a hop in file names and tags.
pub(crate) fn hop_file(hop: Hop) -> &'static str {
    match hop {
        Hop::Tick => "tick",
        stage => self::hop(stage),
    }
}

/// Nanoseconds as microseconds: three significant digits, but nothing below 10 ns: `0.51`, `13.8`, `1 204`.
pub(crate) fn us(ns: f64) -> String {
    let us = ns / 1e3;
    // The limits lie where rounding would add a digit.
    if us < 9.995 {
        format!("{us:.2}")
    } else if us < 99.95 {
        format!("{us:.1}")
    } else {
        grouped(us.round() as u64)
    }
}

/// A count with a space before every three digits.
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
        carrier: Carrier::Swarm,
        topology: Topology::Hub,
        load: Load::Closed,
        uavs: 6,
        wake: Wake::Gate,
        payload_bytes: 0,
        recorder: false,
    };

    #[test]
    fn a_name_tells_cases_apart() {
        assert_eq!(case(&PLAIN), "swarm, 6 UAVs, closed loop");
        let laden =
            Case { load: Load::Paced(100), wake: Wake::Event, payload_bytes: 4096, recorder: true, ..PLAIN };
        assert_eq!(case(&laden), "swarm, events, 4096 B, recorded, 6 UAVs, paced at 100 Hz");
        assert_eq!(file(&laden), "swarm-events-4096-b-recorded-6-paced-100hz");
        let alone = Case { carrier: Carrier::PipePolled, uavs: 1, ..PLAIN };
        assert_eq!(case(&alone), "pipe, polled, 1 UAV, closed loop");
        let meshed = Case { topology: Topology::Mesh, ..alone };
        assert_eq!(case(&meshed), "pipe, polled, mesh, 1 UAV, closed loop");
        assert_eq!(file(&meshed), "pipe-polled-mesh-1-closed");
    }

    #[test]
    fn microseconds_have_three_digits() {
        let shown = [0.0, 512.0, 9_994.0, 9_996.0, 99_949.0, 99_951.0, 1_204_300.0].map(us);
        assert_eq!(shown, ["0.00", "0.51", "9.99", "10.0", "99.9", "100", "1 204"]);
    }

    #[test]
    fn thousands_are_separated() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }
}
