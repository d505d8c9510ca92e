//! `ringwing package-files`: the man pages and completions that a package installs beside the command.
//!
//! Never describes the command itself: both come from the arguments that clap parses.

use crate::{Cli, completion::script, help, output::tell};
use anyhow::anyhow;
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use ringwing_bus::write_whole;
use std::{
    fs, io, iter,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Shells, and where their packages look for the completions of a command.
const COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "bash-completion/completions/ringwing"),
    (Shell::Zsh, "zsh/vendor-completions/_ringwing"),
    (Shell::Fish, "fish/vendor_completions.d/ringwing.fish"),
];

/// Where to write.
#[derive(Debug, clap::Args)]
pub(crate) struct PackageFilesArgs {
    /// Folder for the files, laid out as in `/usr/share`
    folder: PathBuf,
}

/// Writes the files, and names the folder.
pub(crate) fn run(args: &PackageFilesArgs) -> anyhow::Result<ExitCode> {
    for (name, page) in man_pages()? {
        write(&args.folder.join("man/man1").join(name), &page)?;
    }
    for (shell, place) in COMPLETIONS {
        write(&args.folder.join(place), &script(shell)?)?;
    }
    tell(&format!("man pages and completions are in {}", args.folder.display()));
    Ok(ExitCode::SUCCESS)
}

/// A page for the command and for each verb that users see, as `ringwing.1` and `ringwing-run.1`.
fn man_pages() -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut command = help::with_examples(Cli::command());
    // Only then a verb knows that it is called `ringwing run`.
    command.build();
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned();
    let page = |command: Command| {
        let man = Man::new(command).source(format!("ringwing {}", env!("CARGO_PKG_VERSION")));
        let mut page = Vec::new();
        man.render(&mut page)?;
        anyhow::Ok((man.get_filename(), page))
    };
    iter::once(command.clone()).chain(verbs).map(page).collect()
}

fn write(path: &Path, text: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let refused = |why: io::Error| anyhow!("{}: cannot be written: {why}", path.display());
    fs::create_dir_all(folder).map_err(refused)?;
    write_whole(path, text).map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_visible_verb_has_a_man_page_with_its_examples() {
        let pages = man_pages().unwrap();
        let names: Vec<_> = pages.iter().map(|(name, _)| name.as_str()).collect();
        for name in ["ringwing.1", "ringwing-run.1", "ringwing-scenario.1", "ringwing-doctor.1"] {
            assert!(names.contains(&name), "{names:?}");
        }
        assert!(!names.contains(&"ringwing-bench-case.1"), "a hidden verb has a page");
        let run = pages.iter().find(|(name, _)| name == "ringwing-run.1").unwrap();
        let text = String::from_utf8(run.1.clone()).unwrap();
        assert!(text.contains("ringwing run dropout") && text.contains("SYNOPSIS"), "{text}");
    }

    #[test]
    fn every_shell_gets_a_script_that_names_the_command() {
        for (shell, _) in COMPLETIONS {
            let script = String::from_utf8(script(shell).unwrap()).unwrap();
            assert!(script.contains("ringwing"), "{script}");
        }
    }
}
