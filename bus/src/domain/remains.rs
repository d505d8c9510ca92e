//! Removes what killed processes leave in a domain and iceoryx2 0.10 cannot remove.
//!
//! Must never touch what a living process has made, nor what iceoryx2 still needs to clean up after a dead one.

use super::{Domain, entries, name_of};
use crate::is_running;
use std::{fs, os::unix::fs::MetadataExt, path::Path, time::Duration};

/// How old a segment without a size must be to count as abandoned. A lower age removes segments that are still being
/// created; a higher one blocks each process that opens an abandoned segment for longer.
const STILLBORN_AGE: Duration = Duration::from_millis(100);

impl Domain {
    /// Removes segments whose creator was killed after it created the file and before it set the size.
    ///
    /// iceoryx2 0.10 waits for that size without a limit, in every process that opens or cleans up the segment.
    pub fn remove_stillborn_segments(&self) {
        for entry in entries().filter(|entry| name_of(entry).starts_with(&self.id.segment_prefix())) {
            let Ok(meta) = entry.metadata() else { continue };
            let age = meta.modified().ok().and_then(|time| time.elapsed().ok()).unwrap_or_default();
            // iceoryx2 lets nobody read a segment before it is complete, so a readable one is not stillborn even if it
            // is empty.
            if meta.len() == 0 && meta.mode() & 0o400 == 0 && age > STILLBORN_AGE {
                // Its creator may have removed it in between.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Removes the node files of processes that were killed while they created their node.
    ///
    /// iceoryx2 0.10 lists such a node as dead again and again without removing it, so that each cleanup takes longer
    /// than the one before.
    pub fn remove_unfinished_nodes(&self) {
        let folder = self.root().join("nodes");
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let name = name_of(&entry);
            let is_unfinished = |node: &u128| !is_running(process_of(*node)) && !has_tags(&folder, *node);
            if self.node_in(&name).as_ref().is_some_and(is_unfinished) {
                // One of the two fails: an entry is either a file or a folder.
                let _ = fs::remove_file(entry.path());
                let _ = fs::remove_dir_all(entry.path());
            }
        }
    }

    /// The node to which the file `name` in the folder of nodes belongs: `<prefix><node>.<kind>`, or a folder `<node>`.
    fn node_in(&self, name: &str) -> Option<u128> {
        let name = name.strip_prefix(&self.id.segment_prefix()).unwrap_or(name);
        name.split('.').next()?.parse().ok()
    }
}

/// The process that created `node`. iceoryx2 makes the number of four fields of 32 bits, lowest first: seconds, nanoseconds,
/// process, counter.
fn process_of(node: u128) -> u32 {
    (node >> 64) as u32
}

/// Whether `node` has used a service. Then iceoryx2 needs its files to free its places in that service.
fn has_tags(folder: &Path, node: u128) -> bool {
    let tags = fs::read_dir(folder.join(node.to_string()));
    tags.into_iter().flatten().flatten().any(|entry| name_of(&entry).ends_with("_tag"))
}

#[cfg(test)]
mod tests {
    use super::process_of;
    use crate::{create_node, domain::DomainOwner};
    use std::{collections::BTreeSet, ffi::OsString, fs};

    #[test]
    fn only_nodes_without_a_process_and_without_tags_are_removed() {
        let (owner, _gate) = DomainOwner::create("").unwrap();
        let domain = owner.domain();
        let _node = create_node(domain, "test").unwrap();
        let folder = domain.root().join("nodes");
        let names = || {
            fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect::<BTreeSet<_>>()
        };
        let living = names();
        let is_own = |name: &OsString| {
            domain.node_in(&name.to_string_lossy()).map(process_of) == Some(std::process::id())
        };
        assert!(!living.is_empty() && living.iter().all(is_own), "{living:?}");
        // No process has this id: the largest one on Linux is 2^22.
        let [unfinished, busy] = [1_u128, 2].map(|time| (u128::from(u32::MAX) << 64) | time);
        let prefix = domain.id().segment_prefix();
        for node in [unfinished, busy] {
            fs::write(folder.join(format!("{prefix}{node}.node_monitor")), "").unwrap();
            fs::create_dir(folder.join(node.to_string())).unwrap();
        }
        fs::write(folder.join(busy.to_string()).join("x.service_tag"), "").unwrap();
        domain.remove_unfinished_nodes();
        assert!(names().is_superset(&living), "{living:?}: this process lives");
        let left: Vec<_> =
            names().difference(&living).map(|name| name.to_string_lossy().into_owned()).collect();
        assert_eq!(left, [busy.to_string(), format!("{prefix}{busy}.node_monitor")]);
    }
}
