//! Where a live server listens: on the loopback device unless the user names another address.
//!
//! Must never open a socket.

use std::{
    fmt,
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    str::FromStr,
};

/// The port that Foxglove suggests for a connection.
const FIRST_PORT: u16 = 8765;
/// How many ports are tried, one after the other. With fewer, a machine with many live runs has no port for the next one; more
/// only delay the error on a machine without a free port.
const PORTS: u16 = 100;

/// Where a live server listens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveAddress {
    host: IpAddr,
    /// `None` stands for the first free one from [`FIRST_PORT`] on; 0 lets the operating system choose.
    port: Option<u16>,
}

impl LiveAddress {
    /// The address of the network device.
    pub fn host(&self) -> IpAddr {
        self.host
    }

    /// The ports to try, in order.
    pub fn ports(&self) -> impl Iterator<Item = u16> {
        match self.port {
            Some(port) => port..=port,
            None => FIRST_PORT..=FIRST_PORT + PORTS - 1,
        }
    }

    /// Why this address deserves a second thought, if it does.
    pub fn warning(&self) -> Option<String> {
        (!self.host.is_loopback()).then(|| {
            format!(
                "--live={self}: everybody who reaches this address can watch the flight and ask for faults"
            )
        })
    }
}

impl Default for LiveAddress {
    fn default() -> Self {
        Self { host: Ipv4Addr::LOCALHOST.into(), port: None }
    }
}

impl fmt::Display for LiveAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.port, self.host) {
            (Some(port), host) => SocketAddr::new(host, port).fmt(f),
            (None, host) => host.fmt(f),
        }
    }
}

impl FromStr for LiveAddress {
    type Err = String;

    /// Reads a port, an address, or both: `9000`, `0.0.0.0`, `192.168.1.5:9000`, `[::1]:9000`, `localhost`.
    fn from_str(text: &str) -> Result<Self, String> {
        // The standard library parses no host names, and resolving one would take a network. So this is the only
        // name.
        let text = text.replace("localhost", "127.0.0.1");
        let loopback = Self::default();
        if let Ok(port) = text.parse() {
            return Ok(Self { port: Some(port), ..loopback });
        }
        // An IPv6 address alone may have brackets, which only the parser of a `SocketAddr` accepts.
        if let Ok(host) = text.trim_matches(['[', ']']).parse() {
            return Ok(Self { host, ..loopback });
        }
        let address: SocketAddr = text.parse().map_err(|_| {
            "expected a port, an IP address, or both, such as 9000, 0.0.0.0 or 192.168.1.5:9000".to_owned()
        })?;
        Ok(Self { host: address.ip(), port: Some(address.port()) })
    }
}

/// How a program on this machine reaches a server that listens at `host`.
pub(crate) fn reachable(host: IpAddr) -> IpAddr {
    match host {
        // An unspecified address listens on every device, but is no address to connect to. The loopback device is
        // always there.
        IpAddr::V4(host) if host.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(host) if host.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        host => host,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> LiveAddress {
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn an_address_is_a_port_or_a_host_or_both() {
        for (text, shown, first, count) in [
            ("9000", "127.0.0.1:9000", 9000, 1),
            ("0", "127.0.0.1:0", 0, 1),
            ("65535", "127.0.0.1:65535", 65535, 1),
            ("localhost", "127.0.0.1", 8765, 100),
            ("localhost:9000", "127.0.0.1:9000", 9000, 1),
            ("0.0.0.0", "0.0.0.0", 8765, 100),
            ("192.168.1.5:9000", "192.168.1.5:9000", 9000, 1),
            ("::1", "::1", 8765, 100),
            ("[::1]:9000", "[::1]:9000", 9000, 1),
        ] {
            let address = address(text);
            assert_eq!(address.to_string(), shown);
            let ports: Vec<u16> = address.ports().collect();
            assert_eq!((ports.first(), ports.len()), (Some(&first), count), "{text}");
        }
        for text in ["", "paper-4.1", "example.org:80", "70000", "1.2.3"] {
            assert!(text.parse::<LiveAddress>().is_err(), "{text}");
        }
    }

    #[test]
    fn only_an_address_that_others_can_reach_has_a_warning() {
        assert_eq!(LiveAddress::default().warning(), None);
        assert_eq!(address("[::1]:9000").warning(), None);
        assert!(address("0.0.0.0").warning().unwrap().starts_with("--live=0.0.0.0: everybody"));
        assert_eq!(reachable(address("0.0.0.0").host()), LiveAddress::default().host());
    }
}
