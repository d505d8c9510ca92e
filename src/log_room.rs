//! Whether the disk has room for the log of a flight.
//!
//! Must never stop a run: the estimate is rough, and a log that ends early does not end the flight.

use ringwing_scenario::Scenario;
use rustix::{
    fs::statvfs,
    process::{Resource, getrlimit},
};
use std::path::Path;

/// Bytes of a log for each UAV in each tick, compressed: 170 to 206 were measured. A larger figure warns of logs that would
/// fit; a smaller one overlooks logs that do not.
const BYTES_PER_UAV_AND_TICK: f64 = 210.0;
const MB: f64 = 1e6;

/// A warning if the log of `scenario` hardly fits below `out`.
pub(crate) fn warning(scenario: &Scenario, out: &Path) -> Option<String> {
    warning_for(scenario, out, free_bytes(out)?)
}

fn warning_for(scenario: &Scenario, out: &Path, free: u64) -> Option<String> {
    let needed = BYTES_PER_UAV_AND_TICK * f64::from(scenario.formation.uavs) * scenario.last_tick() as f64;
    (needed > free as f64).then(|| {
        format!(
            "the log will have about {:.0} MB, and {} has room for {:.0} MB: make room, choose another folder with `--out`, \
             or fly with `--no-record`",
            needed / MB,
            out.display(),
            free as f64 / MB
        )
    })
}

/// How large a file below `out` can become: the space on its disk, or `ulimit -f`.
fn free_bytes(out: &Path) -> Option<u64> {
    // The folder may not exist yet. Then it will be made on the disk of the folder above.
    let space = out.ancestors().map(|folder| if folder == Path::new("") { Path::new(".") } else { folder });
    let on_disk = space.flat_map(statvfs).next().map(|space| space.f_bavail * space.f_frsize);
    on_disk.into_iter().chain(getrlimit(Resource::Fsize).current).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_that_does_not_fit_is_announced_with_its_size() {
        let mut scenario = Scenario::default();
        (scenario.formation.uavs, scenario.time.duration_s, scenario.time.rate_hz) = (100, 100.0, 100);
        let out = Path::new("runs");
        assert_eq!(warning_for(&scenario, out, 300 << 20), None);
        let warning = warning_for(&scenario, out, 10 << 20).unwrap();
        assert!(warning.contains("about 210 MB, and runs has room for 10 MB"), "{warning}");
    }

    #[test]
    fn a_folder_that_does_not_exist_yet_is_on_the_disk_above_it() {
        let folder = tempfile::tempdir().unwrap();
        assert!(free_bytes(&folder.path().join("not/there/yet")).unwrap() > 0);
        assert!(free_bytes(Path::new("runs-that-do-not-exist")).unwrap() > 0);
    }
}
