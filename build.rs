//! Tells the command which commit it is built from, and for which machine, for `ringwing --version`; and links it so that its
//! processes share as much memory as possible.

use std::{env, fs, path::Path, process::Command};

/// What `--version` says of a build from neither a repository nor a package.
const UNKNOWN: &str = "commit unknown";
/// Digits of a commit. Fewer may stand for two commits; more make the line long.
const DIGITS: usize = 12;

fn main() {
    let target = env::var("TARGET").expect("cargo tells the target");
    println!("cargo::rustc-env=RINGWING_TARGET={target}");
    // A program that may be loaded anywhere holds 17,000 addresses that each process fills in for itself: 300 KB that the
    // agents do not share. Without it, an agent needs 1.1 MB instead of 1.45, and with 100 and 200 UAVs a tick takes 15 and
    // 22 % less time, because the caches hold these pages once and not a hundred times.
    if target.ends_with("-linux-gnu") {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
    let commit = of_package().or_else(of_repository).unwrap_or_else(|| UNKNOWN.into());
    println!("cargo::rustc-env=RINGWING_COMMIT={commit}");
}

/// The commit that cargo notes in a package of the source code.
fn of_package() -> Option<String> {
    let file = Path::new(".cargo_vcs_info.json");
    // Cargo would run this script each time if it watched a file that does not exist.
    let text = fs::read_to_string(file).ok()?;
    println!("cargo::rerun-if-changed={}", file.display());
    let (_, rest) = text.split_once("\"sha1\": \"")?;
    Some(rest.get(..DIGITS)?.to_owned())
}

/// The commit of the repository, and whether files differ from it.
fn of_repository() -> Option<String> {
    // Git adds a line to this file with each commit and each change of branch.
    println!("cargo::rerun-if-changed={}", git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    source_folders().for_each(|folder| println!("cargo::rerun-if-changed={folder}"));
    let commit = git(&["rev-parse", &format!("--short={DIGITS}"), "HEAD"])?;
    let is_changed = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(commit + if is_changed { "-changed" } else { "" })
}

/// The folders of this crate and of its neighbours in the workspace with what the command is built from.
fn source_folders() -> impl Iterator<Item = String> {
    let crates = fs::read_dir(".").into_iter().flatten().flatten().map(|entry| entry.path());
    let sources = crates.map(|folder| folder.join("src")).filter(|folder| folder.is_dir());
    sources.map(|folder| folder.display().to_string()).chain(["src".into()])
}

/// The first line of what git says, if there is a git and a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output =
        Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.lines().next().unwrap_or_default().to_owned())
}
