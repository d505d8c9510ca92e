//! The domain: the place in shared memory that one run owns. It keeps runs on one machine apart.
//!
//! The domain `k3x9ab` consists of the folder `/dev/shm/ringwing_k3x9ab` (service files, tick gate, scenario, reports),
//! iceoryx2's segments `/dev/shm/ringwing_k3x9ab_*`, and the lock `/dev/shm/ringwing_k3x9ab.lock`. The launcher holds
//! the lock while it lives. A domain whose lock is free is abandoned, and any process may remove it.
//!
//! Must never remove anything of a domain whose launcher lives.

mod remains;
pub(crate) mod reserve;

pub use reserve::Reserve;

use crate::{BusError, Gate, files::write_whole};
use iceoryx2::prelude::{Config, FileName, Path as IpcPath, SemanticString};
use rustix::fs::{FlockOperation, flock};
use serde::{Serialize, de::DeserializeOwned};
use std::{
    fmt, fs,
    io::ErrorKind::PermissionDenied,
    os::unix::fs::{DirBuilderExt, MetadataExt},
    path::{Path, PathBuf},
    str::FromStr,
    time::{SystemTime, UNIX_EPOCH},
};

/// The folder of all domains: a tmpfs, because iceoryx2 would wait for a real disk with every service file.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// The prefix of all of ringwing's files there.
const PREFIX: &str = "ringwing_";
/// Length of a domain's name. A longer name is harder to type; with a shorter one, more runs collide and have to draw
/// another name.
const ID_LENGTH: usize = 6;
/// The name of a domain: six lower-case letters and digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct DomainId(String);

impl DomainId {
    /// A name drawn from time and process id. It has no influence on the flight.
    pub fn fresh() -> Self {
        const DIGITS: &[u8; 36] = b"0123456789abcdefghijklmnopqrstuvwxyz";
        let nanoseconds =
            SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos() as u64);
        // The process id tells runs apart that start within one step of the clock.
        let mut number =
            nanoseconds.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(std::process::id()).rotate_left(40);
        let digit = |_| {
            let digit = DIGITS[(number % 36) as usize];
            number /= 36;
            char::from(digit)
        };
        Self((0..ID_LENGTH).map(digit).collect())
    }

    fn root(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(format!("{PREFIX}{self}"))
    }

    fn lock_path(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(format!("{PREFIX}{self}.lock"))
    }

    fn segment_prefix(&self) -> String {
        format!("{PREFIX}{self}_")
    }
}

impl fmt::Display for DomainId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for DomainId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let valid =
            text.len() == ID_LENGTH && text.bytes().all(|b| b.is_ascii_digit() || b.is_ascii_lowercase());
        if valid {
            Ok(Self(text.to_owned()))
        } else {
            Err(format!(
                "a domain's name has {ID_LENGTH} lower-case letters and digits; `ringwing run` prints it"
            ))
        }
    }
}

/// A run's place in shared memory, as any of its processes sees it.
#[derive(Debug, Clone)]
pub struct Domain {
    id: DomainId,
}

/// Ownership of a domain: removes everything in it when dropped.
#[derive(Debug)]
pub struct DomainOwner {
    domain: Domain,
    _lock: fs::File,
}

impl DomainOwner {
    /// Creates a domain with a tick gate and the text of `scenario`, which every process of the run reads.
    pub fn create(scenario: &str) -> Result<(Self, Gate), BusError> {
        let (id, lock) = loop {
            let id = DomainId::fresh();
            if let Some(lock) = create_lock(&id)? {
                break (id, lock);
            }
        };
        // Own the domain before making its files: if a later step fails, dropping the owner removes what is there.
        let owner = Self { domain: Domain { id }, _lock: lock };
        let root = owner.domain.root();
        // Whoever may enter reaches the socket that takes faults.
        fs::DirBuilder::new().mode(0o700).create(&root).map_err(BusError::file(&root))?;
        let path = owner.domain.scenario_path();
        fs::write(&path, scenario).map_err(BusError::file(&path))?;
        let gate = Gate::create(&owner.domain.gate_path())?;
        Ok((owner, gate))
    }

    /// The domain that this value owns.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }
}

impl Drop for DomainOwner {
    fn drop(&mut self) {
        remove_all(self.domain.id());
    }
}

impl Domain {
    /// Finds the domain of a run that another process started.
    pub fn join(id: &DomainId) -> Result<Self, BusError> {
        if !id.root().is_dir() {
            return Err(BusError::Domain {
                id: id.to_string(),
                problem: "no run of this name is live".into(),
            });
        }
        let domain = Self { id: id.clone() };
        // Looking into the folder fails for users without permission.
        match fs::metadata(domain.scenario_path()) {
            Err(error) if error.kind() == PermissionDenied => Err(domain.permission_denied()),
            _ => Ok(domain),
        }
    }

    /// The error that this user may not use the domain.
    pub fn permission_denied(&self) -> BusError {
        // Only a domain that has just been removed has no owner, and root's number then does no harm.
        let owner = fs::metadata(self.root()).map_or(0, |folder| folder.uid());
        BusError::Permission { id: self.id.to_string(), owner }
    }

    /// Its name.
    pub fn id(&self) -> &DomainId {
        &self.id
    }

    fn root(&self) -> PathBuf {
        self.id.root()
    }

    fn scenario_path(&self) -> PathBuf {
        self.root().join("scenario.toml")
    }

    fn gate_path(&self) -> PathBuf {
        self.root().join("gate")
    }

    /// The Unix socket on which the launcher takes requests for faults.
    pub fn request_path(&self) -> PathBuf {
        self.root().join("requests")
    }

    /// The page of shared memory for benchmarks that compare a run with bare futexes and atomics.
    pub fn words_path(&self) -> PathBuf {
        self.root().join("words")
    }

    /// Whether the run's launcher lives: whether somebody holds the lock.
    pub fn has_launcher(&self) -> bool {
        let lock = fs::File::open(self.id.lock_path());
        // A shared lock: with exclusive ones, two processes that look at once would take each other for the launcher.
        lock.is_ok_and(|lock| flock(&lock, FlockOperation::NonBlockingLockShared).is_err())
    }

    /// The run's scenario as TOML, every value in full.
    pub fn scenario_text(&self) -> Result<String, BusError> {
        let path = self.scenario_path();
        fs::read_to_string(&path).map_err(BusError::file(path))
    }

    /// The run's tick gate.
    pub fn gate(&self) -> Result<Gate, BusError> {
        Gate::open(&self.gate_path())
    }

    /// Writes `report` for other processes of the run. They see the whole report, or no report.
    pub fn write_report<T: Serialize>(&self, name: &str, report: &T) -> Result<(), BusError> {
        let path = self.root().join(format!("{name}.json"));
        let text =
            serde_json::to_vec(report).map_err(|source| BusError::Report { path: path.clone(), source })?;
        // A report must not be lost because shared memory is full, and the last ones come when no successor is needed.
        self.release_part(Reserve::Successors, reserve::bytes_of_file(text.len()));
        write_whole(&path, text).map_err(BusError::file(path))
    }

    /// The report `name`, if a process has written it.
    pub fn report<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, BusError> {
        let path = self.root().join(format!("{name}.json"));
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read(&path).map_err(BusError::file(&path))?;
        serde_json::from_slice(&text).map(Some).map_err(|source| BusError::Report { path, source })
    }

    /// iceoryx2's configuration for this domain.
    ///
    /// Only the launcher cleans up after dead processes. By default each process would do so when it starts, which
    /// makes the start of a hundred processes four times slower.
    pub(crate) fn config(&self) -> Result<Config, BusError> {
        let mut config = Config::default();
        let prefix = self.id.segment_prefix();
        config.global.prefix =
            FileName::new(prefix.as_bytes()).map_err(|error| BusError::ipc(&prefix, error))?;
        let root = self.root().display().to_string();
        let root_path = IpcPath::new(root.as_bytes()).map_err(|error| BusError::ipc(&root, error))?;
        config.global.set_root_path(&root_path);
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        Ok(config)
    }

    /// A configuration file with which iceoryx2's own command line sees this domain.
    pub fn iox2_config(&self) -> String {
        format!(
            "# For iceoryx2's command line: while the run goes on, run `iox2 service list` in the folder above this one.\n\
             [global]\nroot-path = \"{}\"\nprefix = \"{}\"\n",
            self.root().display(),
            self.id.segment_prefix()
        )
    }
}

/// Creates and takes the lock of a new domain; `None` if another run has the name.
fn create_lock(id: &DomainId) -> Result<Option<fs::File>, BusError> {
    let path = id.lock_path();
    let lock = match fs::File::create_new(&path) {
        Ok(lock) => lock,
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Ok(None),
        Err(error) => return Err(BusError::file(path)(error)),
    };
    // Another process may have taken the free lock for abandoned and removed it. Then the file on disk is no longer
    // ours.
    let locked = flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok();
    let inode = |meta: std::io::Result<fs::Metadata>| meta.map(|meta| meta.ino()).ok();
    let ours = locked && inode(lock.metadata()) == inode(fs::metadata(&path));
    Ok(ours.then_some(lock))
}

/// All domains on this machine, abandoned or not.
pub fn all() -> Vec<DomainId> {
    let mut ids: Vec<DomainId> = entries().filter_map(|entry| id_in(&name_of(&entry))).collect();
    ids.sort();
    // A domain has several entries in the folder, and each of them gives its name.
    ids.dedup();
    ids
}

/// Removes all domains whose launcher is gone; returns their names.
pub fn remove_abandoned() -> Vec<DomainId> {
    let mut ids = all();
    ids.retain(|id| {
        let Ok(lock) = fs::OpenOptions::new().write(true).create(true).truncate(false).open(id.lock_path())
        else {
            return false;
        };
        // Hold the lock until everything is removed: two processes that clean up at once must not both take the domain.
        let abandoned = flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok();
        if abandoned {
            remove_all(id);
        }
        abandoned
    });
    ids
}

/// The abandoned domains that only their owners may remove.
pub fn abandoned_by_others() -> Vec<Domain> {
    let mut domains: Vec<Domain> = all().into_iter().map(|id| Domain { id }).collect();
    domains.retain(|domain| {
        let writable = fs::OpenOptions::new().write(true).open(domain.id.lock_path());
        writable.is_err_and(|error| error.kind() == PermissionDenied) && !domain.has_launcher()
    });
    domains
}

/// Removes all files of a domain, its lock last: until then no other run takes the name.
fn remove_all(id: &DomainId) {
    // A file that is already gone, or disappears meanwhile, is what we want.
    let _ = fs::remove_dir_all(id.root());
    for entry in entries().filter(|entry| name_of(entry).starts_with(&id.segment_prefix())) {
        let _ = fs::remove_file(entry.path());
    }
    let _ = fs::remove_file(id.lock_path());
}

fn id_in(name: &str) -> Option<DomainId> {
    // Anybody may put files there. `get` also refuses a name that is too short, or that would be cut within a
    // character.
    name.strip_prefix(PREFIX)?.get(..ID_LENGTH)?.parse().ok()
}

fn entries() -> impl Iterator<Item = fs::DirEntry> {
    fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten()
}

fn name_of(entry: &fs::DirEntry) -> String {
    entry.file_name().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_is_removed_with_its_owner_and_not_before() {
        let (owner, _gate) = DomainOwner::create("name = \"x\"").unwrap();
        let id = owner.domain().id().clone();
        assert!(!remove_abandoned().contains(&id) && owner.domain().has_launcher());
        assert_eq!(Domain::join(&id).unwrap().scenario_text().unwrap(), "name = \"x\"");
        assert_eq!(fs::metadata(id.root()).unwrap().mode() & 0o777, 0o700, "no other user may enter");
        drop(owner);
        assert!(!id.root().exists() && !id.lock_path().exists());
        assert!(Domain::join(&id).is_err());
        assert!(!Domain { id }.has_launcher());
    }

    #[test]
    fn the_domain_of_a_dead_launcher_is_found_and_removed() {
        let id: DomainId = "zzzz00".parse().unwrap();
        fs::create_dir_all(id.root()).unwrap();
        let segment = Path::new(SHARED_MEMORY).join(format!("{}segment", id.segment_prefix()));
        fs::write(&segment, "x").unwrap();
        // Another test that runs at the same time may remove it first.
        remove_abandoned();
        assert!(!id.root().exists() && !segment.exists() && !id.lock_path().exists());
    }

    #[test]
    fn a_report_is_read_as_it_was_written() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        assert_eq!(owner.domain().report::<Vec<f64>>("world").unwrap(), None);
        owner.domain().write_report("world", &vec![0.1, 2.5]).unwrap();
        assert_eq!(owner.domain().report::<Vec<f64>>("world").unwrap(), Some(vec![0.1, 2.5]));
    }

    #[test]
    fn invalid_names_are_refused() {
        for name in ["", "abc", "abcdefg", "ABCDEF", "../../", "abc_de"] {
            assert!(name.parse::<DomainId>().is_err(), "{name}");
        }
    }
}
