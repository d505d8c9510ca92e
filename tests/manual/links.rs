//! Links inside the repository lead to files and headings that exist. Links to other places are not followed: the tests need
//! no network.

use super::{files, markdown::Page, pages, read, root};
use std::{fs, path::Path};

#[test]
fn every_link_leads_to_a_file_or_a_heading_that_exists() {
    let mut dead = Vec::new();
    let other = ["ARCHITECTURE.md", "bench/PEERS.md"].map(|file| root().join(file));
    for path in pages().into_iter().chain(other) {
        let page = Page::parse(&read(&path));
        let targets = page.links.iter().map(|link| link.target.as_str());
        for target in targets.filter(|target| !target.contains("://")) {
            dead.extend(fault(&path, target).map(|fault| format!("{}: {target}: {fault}", path.display())));
        }
    }
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

/// What is wrong with the link from `page` to `target`, if anything is.
fn fault(page: &Path, target: &str) -> Option<String> {
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let path = if file.is_empty() { page.to_owned() } else { page.parent()?.join(file) };
    if !path.exists() {
        return Some("no such file".into());
    }
    let has_anchor = || Page::parse(&read(&path)).anchors.contains(&anchor.to_owned());
    (!anchor.is_empty() && !has_anchor()).then(|| "no such heading".into())
}

#[test]
fn the_table_of_contents_names_every_page_of_the_manual() {
    let folder = root().join("docs/src");
    let contents = Page::parse(&fs::read_to_string(folder.join("SUMMARY.md")).unwrap());
    for page in files(&folder, "md") {
        let name = page.strip_prefix(&folder).unwrap().to_str().unwrap();
        let is_listed = contents.links.iter().any(|link| link.target == name);
        assert!(is_listed || name == "SUMMARY.md", "{name} is not in SUMMARY.md");
    }
}

#[test]
fn every_picture_of_the_manual_is_shown_on_a_page() {
    let folder = root().join("docs/src");
    let shown: Vec<_> = pages()
        .iter()
        .flat_map(|path| {
            let page = Page::parse(&fs::read_to_string(path).unwrap());
            let beside = path.parent().unwrap().to_owned();
            page.links.into_iter().map(move |link| beside.join(link.target).canonicalize())
        })
        .flatten()
        .collect();
    for picture in ["svg", "png"].iter().flat_map(|kind| files(&folder, kind)) {
        assert!(shown.contains(&picture.canonicalize().unwrap()), "{} is shown nowhere", picture.display());
    }
}
