//! README and manual: every example runs and prints what the page says, every link leads somewhere, and the reference pages
//! list what the code has.
//!
//! `SNAPSHOTS=overwrite cargo test --release manual` writes what the code says now into the pages; look at the difference
//! before you commit it.

mod bounds;
mod console;
mod links;
mod log_fields;
mod markdown;
mod rust_docs;
mod scenario_keys;

use std::{
    env, fs,
    path::{Path, PathBuf},
};

/// How to bring a page up to date, at the end of every message about one.
const REMEDY: &str = "run `SNAPSHOTS=overwrite cargo test --release manual`, and look at the difference";

/// The repository.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README and the pages of the manual.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![root().join("README.md")];
    pages.extend(files(&root().join("docs/src"), "md"));
    pages
}

/// The text of a page, with what it includes from other files.
fn read(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let Some((before, rest)) = text.split_once("{{#include ") else { return text };
    let (include, after) = rest.split_once("}}").unwrap();
    let (file, anchor) = include.split_once(':').unwrap_or((include, ""));
    let included = fs::read_to_string(path.with_file_name(file)).unwrap();
    let part =
        included.split_once(&format!("<!-- ANCHOR: {anchor} -->")).map_or(&*included, |(_, part)| part);
    [before, part, after].concat()
}

/// All files below `folder` with this extension, in order.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|ending| ending == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Whether the pages are to be brought up to date instead of compared.
fn overwrites() -> bool {
    env::var("SNAPSHOTS").is_ok_and(|action| action == "overwrite")
}

/// Compares the part of `page` between the comments that name `part` with `text`, or replaces it.
fn check_part(page: &str, part: &str, text: &str) {
    let path = root().join("docs/src").join(page);
    let (begin, end) = (format!("<!-- generated: {part} -->\n"), format!("<!-- end: {part} -->"));
    let whole = fs::read_to_string(&path).unwrap();
    let (before, rest) = whole.split_once(&begin).unwrap_or_else(|| panic!("{page} has no {begin}"));
    let (current, after) = rest.split_once(&end).unwrap_or_else(|| panic!("{page} has no {end}"));
    if current == text {
        return;
    }
    assert!(overwrites(), "{page}: the part \"{part}\" does not say what the code does: {REMEDY}\n{text}");
    fs::write(&path, [before, &begin, text, &end, after].concat()).unwrap();
}
