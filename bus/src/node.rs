//! iceoryx2's node: the identity under which a process opens services.
//!
//! Must never open a service.

use crate::{BusError, Domain, process::raise_open_files_limit};
use iceoryx2::{
    node::{Node, NodeBuilder},
    prelude::{LogLevel, NodeName, SignalHandlingMode, ipc, set_log_level_from_env_or},
};

/// A process's identity in a domain, with which it opens services.
pub type BusNode = Node<ipc::Service>;

/// Creates a node named `name` in `domain`, and raises this process's limit of open files for its connections.
pub fn create_node(domain: &Domain, name: &str) -> Result<BusNode, BusError> {
    set_log_level_from_env_or(LogLevel::Error);
    raise_open_files_limit()?;
    let node_name = NodeName::new(name).map_err(|error| BusError::ipc(name, error))?;
    NodeBuilder::new()
        .name(&node_name)
        .config(&domain.config()?)
        // Signals belong to the `StopFlag`. iceoryx2 would install handlers of its own for SIGINT and SIGTERM.
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .map_err(|error| BusError::ipc(format!("node {name}: cannot be created"), error))
}
