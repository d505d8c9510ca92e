//! The address of a running server, as viewers need it.
//!
//! Must never be read back by a program other than the launcher, which passes it on to the user.

use crate::address::reachable;
use foxglove::AppUrl;
use std::{
    fmt,
    net::{IpAddr, SocketAddr},
};

/// Where viewers find a running server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveUrl(SocketAddr);

impl LiveUrl {
    /// The address of a server that listens at `host` and `port`.
    pub(crate) fn new(host: IpAddr, port: u16) -> Self {
        Self(SocketAddr::new(reachable(host), port))
    }
}

impl fmt::Display for LiveUrl {
    /// Says it in one line: the address itself, and a link that opens it in Foxglove.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let address = format!("ws://{}", self.0);
        let link = AppUrl::new().with_websocket(&address);
        write!(f, "live at {address}: open it in Foxglove (Open connection, Foxglove WebSocket), or {link}")
    }
}
