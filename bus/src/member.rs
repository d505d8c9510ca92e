//! What every process of a run does to take part: join the domain, raise its limits, heed its signals, say it is ready.

use crate::{BusError, Domain, DomainId, Gate};
use iceoryx2::{
    node::{Node, NodeBuilder},
    prelude::{LogLevel, NodeName, SignalHandlingMode, ipc, set_log_level_from_env_or},
};
use ringwing_flight::Part;
use rustix::process::{
    Pid, Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit,
};
use rustix::thread::set_name;
use std::{
    ffi::CString,
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

/// Set once the process is asked to stop.
#[derive(Debug, Clone, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// A flag that SIGTERM and SIGINT set.
    pub fn on_signals() -> Result<Self, BusError> {
        let flag = Self::default();
        for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
            signal_hook::flag::register(signal, flag.0.clone())
                .map_err(|source| BusError::System { what: "cannot handle signals", source })?;
        }
        Ok(flag)
    }

    /// Sets the flag once `condition` no longer holds; looks twice a second.
    fn set_unless(&self, condition: impl Fn() -> bool + Send + 'static) -> Result<(), BusError> {
        let flag = self.0.clone();
        let watch = move || {
            while condition() {
                thread::sleep(Duration::from_millis(500));
            }
            flag.store(true, Relaxed);
        };
        let failed = |source| BusError::System { what: "cannot start a thread", source };
        thread::Builder::new().spawn(watch).map(drop).map_err(failed)
    }

    /// Whether the process is asked to stop.
    pub fn is_set(&self) -> bool {
        self.0.load(Relaxed)
    }
}

/// A process that takes part in a run.
#[derive(Debug)]
pub struct Member {
    part: Part,
    domain: Domain,
    node: Node<ipc::Service>,
    stop: StopFlag,
}

impl Member {
    /// Joins `domain` as `part`; the kernel ends it with the process `launcher` if that is given, and it ends by itself
    /// when the domain no longer has a launcher.
    pub fn join(domain: &DomainId, part: Part, launcher: Option<u32>) -> Result<Self, BusError> {
        if let Some(launcher) = launcher {
            die_with(launcher)?;
        }
        // What `top` and `ps` show; the program itself is the same for all.
        if let Ok(name) = CString::new(part.node_name()) {
            let _ = set_name(&name);
        }
        let domain = Domain::join(domain)?;
        let node = create_node(&domain, &part.node_name())?;
        let stop = StopFlag::on_signals()?;
        if launcher.is_none() {
            let domain = domain.clone();
            stop.set_unless(move || domain.has_launcher())?;
        }
        Ok(Self { part, domain, node, stop })
    }

    /// The run's place in shared memory.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The node that this process opens services with.
    pub fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }

    /// Set once this process is asked to stop.
    pub fn stop(&self) -> &StopFlag {
        &self.stop
    }

    /// Says that all ports are open, and hands over the gate to wait at.
    pub fn attend(&self) -> Result<Gate, BusError> {
        let mut gate = self.domain.gate()?;
        if let Some(other) = gate.attendant(self.part).filter(|pid| is_running(*pid)) {
            let problem = format!("process {other} already is the {} of this run", self.part);
            return Err(BusError::Domain { id: self.domain.id().to_string(), problem });
        }
        gate.note_missed();
        gate.set_attendant(self.part, Some(std::process::id()));
        Ok(gate)
    }
}

/// Makes an iceoryx2 node in `domain`, after raising the limit of open files: each connection takes some.
pub fn create_node(domain: &Domain, name: &str) -> Result<Node<ipc::Service>, BusError> {
    set_log_level_from_env_or(LogLevel::Error);
    raise_open_files_limit()?;
    let node_name = NodeName::new(name).map_err(|error| BusError::ipc(name, error))?;
    NodeBuilder::new()
        .name(&node_name)
        .config(&domain.config()?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .map_err(|error| BusError::ipc(format!("node {name}: cannot be created"), error))
}

/// Whether a process with this id runs.
pub fn is_running(process: u32) -> bool {
    std::path::Path::new("/proc").join(process.to_string()).exists()
}

fn raise_open_files_limit() -> Result<(), BusError> {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }).map_err(|errno| BusError::System {
        what: "cannot raise the limit of open files",
        source: errno.into(),
    })
}

/// Lets the kernel kill this process when its launcher ends, however that ends: also when this process is stopped.
pub fn die_with(launcher: u32) -> Result<(), BusError> {
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|errno| BusError::System {
        what: "cannot tie this process to its launcher",
        source: errno.into(),
    })?;
    let parent = getppid().map(Pid::as_raw_nonzero).map(|pid| pid.get().cast_unsigned());
    if parent == Some(launcher) {
        return Ok(());
    }
    let source = io::Error::other(format!("process {launcher} is not its parent, or is gone"));
    Err(BusError::System { what: "the launcher ended before this process began", source })
}
