//! The dependencies between crates and between modules that ARCHITECTURE.md allows.
//!
//! The tests read `cargo metadata` for the crates and every path in the parsed source for the modules.

use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};
use syn::{
    Attribute, ItemMod, UseTree,
    visit::{self, Visit},
};

/// A crate of the workspace, the crates that it uses, and its modules with I/O. All its other modules are pure.
struct Room {
    /// Folder of the crate; empty for the root package.
    folder: &'static str,
    uses: &'static [&'static str],
    /// Files and folders below `src/` that may do I/O; a single `""` exempts the whole crate.
    with_io: &'static [&'static str],
}

const ROOMS: [Room; 16] = [
    Room {
        folder: "",
        uses: &[
            "agent",
            "bench",
            "bus",
            "drawing",
            "flight",
            "leader",
            "programs",
            "recorder",
            "scenario",
            "simulation",
            "study",
            "viewer",
            "world",
        ],
        with_io: &[""],
    },
    Room {
        folder: "bench",
        uses: &["bus", "drawing", "flight", "scenario"],
        with_io: &[
            "lib.rs",
            "args.rs",
            "case_args.rs",
            "compare.rs",
            "doctor.rs",
            "error.rs",
            "histogram_files.rs",
            "measure.rs",
            "peer_program/processes.rs",
            "proc_files.rs",
            "report.rs",
            "runner.rs",
            "scratch.rs",
            "standstill.rs",
            "trace_file.rs",
            "transport",
        ],
    },
    Room {
        folder: "study",
        uses: &["drawing", "flight", "programs", "recorder", "scenario", "simulation"],
        with_io: &[
            "files.rs",
            "hunt/flights.rs",
            "margin/flights.rs",
            "recorded.rs",
            "sweep/check.rs",
            "sweep/parquet.rs",
            "sweep/results.rs",
            "sweep/runner.rs",
        ],
    },
    Room {
        folder: "simulation",
        uses: &["agent", "flight", "leader", "recorder", "scenario", "world"],
        with_io: &[],
    },
    Room { folder: "agent", uses: &["bus", "flight", "scenario"], with_io: &["lib.rs", "process"] },
    Room { folder: "programs", uses: &["agent", "bus", "flight", "scenario"], with_io: &[""] },
    Room { folder: "controller", uses: &["agent", "flight", "programs", "scenario"], with_io: &[""] },
    Room { folder: "controller/c", uses: &["controller"], with_io: &[""] },
    Room { folder: "leader", uses: &["bus", "flight", "scenario"], with_io: &["lib.rs", "process.rs"] },
    Room {
        folder: "recorder",
        uses: &["bus", "flight", "scenario"],
        with_io: &["error.rs", "lib.rs", "log", "log.rs", "process", "process.rs"],
    },
    Room { folder: "viewer", uses: &["bus", "recorder", "scenario"], with_io: &[""] },
    Room { folder: "world", uses: &["bus", "flight", "scenario"], with_io: &["lib.rs", "process"] },
    Room { folder: "bus", uses: &["flight", "scenario"], with_io: &[""] },
    Room { folder: "drawing", uses: &[], with_io: &[] },
    Room {
        folder: "scenario",
        uses: &["flight"],
        with_io: &["read/mod.rs", "read/source.rs", "read/track_file.rs", "fault/trace.rs"],
    },
    Room { folder: "flight", uses: &[], with_io: &[] },
];

/// Paths that a pure module must never name: shared memory, processes, threads, clocks, files, the command line.
const IMPURE: [&str; 15] = [
    "clap",
    "iceoryx2",
    "memmap2",
    "ringwing_bus",
    "rustix",
    "signal_hook",
    "std::env",
    "std::fs",
    "std::io",
    "std::net",
    "std::os",
    "std::process",
    "std::thread",
    "std::time::Instant",
    "std::time::SystemTime",
];

#[test]
fn crates_depend_only_as_the_architecture_allows() {
    let packages = packages();
    assert_eq!(packages.len(), ROOMS.len(), "the workspace and ROOMS list different crates");
    for Room { folder, uses, .. } in &ROOMS {
        let name = match *folder {
            "" => "ringwing".into(),
            folder => format!("ringwing-{}", folder.replace('/', "-")),
        };
        let package = packages.iter().find(|package| package["name"] == name.as_str()).unwrap();
        // Only what the crates are built of: the drawing leaves out what tests and build scripts use.
        let is_normal = |dependency: &&Value| dependency["kind"].is_null();
        let used: BTreeSet<&str> = package["dependencies"]
            .as_array()
            .unwrap()
            .iter()
            .filter(is_normal)
            .filter_map(|dependency| dependency["name"].as_str()?.strip_prefix("ringwing-"))
            .collect();
        assert_eq!(used, uses.iter().copied().collect(), "{name}");
    }
}

fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

#[test]
fn pure_modules_use_no_shared_memory_processes_clocks_or_files() {
    let mut wrong = Vec::new();
    for room in ROOMS.iter().filter(|room| room.with_io != [""]) {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(room.folder).join("src");
        for place in room.with_io {
            assert!(
                source.join(place).exists(),
                "{}: {place} does not exist; remove it from ROOMS",
                room.folder
            );
        }
        let forbidden = forbidden_in(room);
        for file in source_files(&source).iter().filter(|file| !has_io(room, &source, file)) {
            for path in paths_in(&source, file) {
                if let Some(rule) = forbidden.iter().find(|rule| is_within(&path, rule)) {
                    wrong.push(format!("{}: {path} ({rule} is not pure)", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Paths that the pure modules of `room` must not name: [`IMPURE`] and the modules of `room` that do I/O.
fn forbidden_in(room: &Room) -> Vec<String> {
    let module = |place: &&str| {
        let stem = place.trim_end_matches(".rs").replace('/', "::");
        // The items of `lib.rs` are paths of `crate` itself, so no path names it.
        (stem != "lib").then(|| format!("crate::{stem}"))
    };
    IMPURE.iter().map(ToString::to_string).chain(room.with_io.iter().filter_map(module)).collect()
}

fn has_io(room: &Room, source: &Path, file: &Path) -> bool {
    room.with_io.iter().any(|place| file.starts_with(source.join(place)))
}

fn is_within(path: &str, rule: &str) -> bool {
    // A whole name must follow: `std::io` forbids `std::io::Read`, and not a module whose name begins with `io`.
    path.strip_prefix(rule).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
}

/// Source files below `folder`, without files that only tests use.
fn source_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries
        .filter(|path| !path.ends_with("tests"))
        .flat_map(|path| if path.is_dir() { source_files(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .filter(|path| !path.ends_with("tests.rs") && !path.ends_with("testing.rs"))
        .collect();
    files.sort();
    files
}

/// Every path that `file` names outside its tests, absolute: `super` and `self` are resolved.
fn paths_in(source: &Path, file: &Path) -> Vec<String> {
    let parsed = syn::parse_file(&fs::read_to_string(file).unwrap()).unwrap();
    let mut paths = Paths { module: module_of(source, file), found: Vec::new() };
    paths.visit_file(&parsed);
    paths.found
}

/// The names of the modules on the way from the crate's root to `file`.
fn module_of(source: &Path, file: &Path) -> Vec<String> {
    let relative = file.strip_prefix(source).unwrap().with_extension("");
    let names = relative.iter().map(|name| name.to_str().unwrap().to_owned());
    names.filter(|name| !["mod", "lib"].contains(&name.as_str())).collect()
}

struct Paths {
    module: Vec<String>,
    found: Vec<String>,
}

impl Paths {
    fn note(&mut self, names: &[String]) {
        let mut place = vec!["crate".to_owned()];
        place.extend(self.module.iter().cloned());
        let above = names.iter().take_while(|name| *name == "super").count();
        let whole = if above > 0 {
            place.truncate(place.len().saturating_sub(above));
            place.extend_from_slice(&names[above..]);
            place
        } else if names.first().is_some_and(|name| name == "self") {
            place.extend_from_slice(&names[1..]);
            place
        } else {
            names.to_vec()
        };
        self.found.push(whole.join("::"));
    }

    fn note_tree(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.note_tree(&with(&path.ident), &path.tree),
            UseTree::Name(name) => self.note(&with(&name.ident)),
            UseTree::Rename(name) => self.note(&with(&name.ident)),
            UseTree::Glob(_) => self.note(before),
            UseTree::Group(group) => group.items.iter().for_each(|item| self.note_tree(before, item)),
        }
    }
}

impl<'ast> Visit<'ast> for Paths {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.note_tree(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.note(&names);
        visit::visit_path(self, path);
    }

    /// Reads the macros in derives, such as `#[derive(clap::Args)]`: `syn` leaves their tokens unparsed.
    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Ok(list) = attribute.meta.require_list() {
            for word in list.tokens.to_string().replace(' ', "").split(',') {
                self.found.push(word.to_owned());
            }
        }
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if !is_for_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    let says_test = |attribute: &Attribute| {
        let list = attribute.meta.require_list();
        list.is_ok_and(|list| list.path.is_ident("cfg") && list.tokens.to_string() == "test")
    };
    attributes.iter().any(says_test)
}

#[test]
fn modules_of_a_crate_do_not_depend_on_each_other_in_a_cycle() {
    for room in &ROOMS {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(room.folder).join("src");
        let modules: BTreeMap<String, PathBuf> = source_files(&source)
            .into_iter()
            .map(|file| (module_of(&source, &file).join("::"), file))
            .collect();
        let needs = |module: &String| -> BTreeSet<String> {
            let paths = paths_in(&source, &modules[module]);
            let named = paths.iter().filter_map(|path| module_named(path, &modules));
            // A module may re-export what its submodules define and its submodules may use it, so ignore these pairs.
            named.filter(|other| !is_inside(module, other) && !is_inside(other, module)).collect()
        };
        let graph: BTreeMap<&String, BTreeSet<String>> =
            modules.keys().map(|module| (module, needs(module))).collect();
        for module in modules.keys() {
            let cycle = cycle_from(module, &graph);
            assert!(cycle.is_none(), "{}: {}", room.folder, cycle.unwrap_or_default().join(" -> "));
        }
    }
}

/// The module whose item `path` names: the longest prefix of the path that is a module.
fn module_named(path: &str, modules: &BTreeMap<String, PathBuf>) -> Option<String> {
    let mut name = path.strip_prefix("crate::")?;
    loop {
        if modules.contains_key(name) {
            return Some(name.to_owned());
        }
        name = name.rsplit_once("::")?.0;
    }
}

/// Whether the module `one` is `other` or inside it. The crate's root, which contains every module, does not count.
fn is_inside(one: &str, other: &str) -> bool {
    !other.is_empty() && is_within(one, other)
}

/// A chain of dependencies from `module` back to itself, if there is one.
fn cycle_from(module: &String, graph: &BTreeMap<&String, BTreeSet<String>>) -> Option<Vec<String>> {
    let mut chains: Vec<Vec<String>> = vec![vec![module.clone()]];
    let mut seen = BTreeSet::new();
    while let Some(chain) = chains.pop() {
        for next in graph.get(chain.last()?).into_iter().flatten() {
            let longer = [chain.as_slice(), std::slice::from_ref(next)].concat();
            if next == module {
                return Some(longer);
            }
            if seen.insert(next.clone()) {
                chains.push(longer);
            }
        }
    }
    None
}

#[test]
fn the_check_finds_imports_paths_and_derives_but_not_those_of_tests() {
    let text = "
        use std::{fs, time::{Duration, Instant as Now}};
        use super::process::run;
        #[derive(Debug, clap::Args)]
        struct Args;
        fn look() { let _ = std::thread::current(); }
        #[cfg(test)]
        mod tests { use std::net::TcpStream; }
    ";
    let mut paths = Paths { module: vec!["pilot".into()], found: Vec::new() };
    paths.visit_file(&syn::parse_file(text).unwrap());
    let sees = |rule: &str| paths.found.iter().any(|path| is_within(path, rule));
    for rule in ["std::fs", "std::time::Instant", "crate::process", "clap", "std::thread"] {
        assert!(sees(rule), "{rule}: {:?}", paths.found);
    }
    assert!(!sees("std::net"), "a path that only tests name was reported");
}
