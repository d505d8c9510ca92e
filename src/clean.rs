//! `ringwing clean`: removes what killed runs left in shared memory.

use std::process::ExitCode;

/// Removes every domain whose launcher is gone.
#[expect(clippy::unnecessary_wraps, reason = "every subcommand has this signature")]
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    let removed = ringwing_messages::domain::remove_abandoned();
    for domain in &removed {
        println!("removed {domain}");
    }
    if removed.is_empty() {
        println!("nothing to remove");
    }
    Ok(ExitCode::SUCCESS)
}
