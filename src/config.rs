//! A user's own defaults, from files called `ringwing.toml`, and `ringwing config`, which shows them.
//!
//! Never decides over a flag or a `--set`: a default counts only where the command line says nothing.

use crate::{WrongUsage, output::tell};
use ringwing_recorder::log::run_folder::{self, DEFAULT_OUT};
use serde::Deserialize;
use std::{
    env, fs, io,
    num::NonZero,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::OnceLock,
    thread,
};

/// Name of such a file.
const FILE: &str = "ringwing.toml";
/// Environment variable that names the only file to read; empty for no file at all.
const VARIABLE: &str = "RINGWING_CONFIG";
/// The control laws that a default can name.
pub(crate) const LAWS: [&str; 2] = ["paper", "resilient"];

static DEFAULTS: OnceLock<Defaults> = OnceLock::new();

/// What one file sets.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    out: Option<PathBuf>,
    law: Option<String>,
    jobs: Option<NonZero<usize>>,
}

/// The files that were found, the nearest first. A key of a nearer file wins.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Defaults {
    files: Vec<(PathBuf, Keys)>,
}

/// Reads the files. Called once, before the verb begins.
pub(crate) fn load() -> anyhow::Result<()> {
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).map_err(|why| unreadable(&path, &why))?;
        let keys = parsed(&path, &text)?;
        Ok((path, keys))
    };
    let files = paths()?.into_iter().map(read).collect::<anyhow::Result<_>>()?;
    // Only a second call could find it set, and both would have read the same files.
    let _ = DEFAULTS.set(Defaults { files });
    Ok(())
}

/// The defaults; none before [`load`].
fn defaults() -> &'static Defaults {
    DEFAULTS.get_or_init(Defaults::default)
}

/// The folder for the folders of runs: as `given`, or the user's default, or `runs`.
pub(crate) fn out(given: Option<&Path>) -> PathBuf {
    given.map(Path::to_owned).or_else(|| defaults().out()).unwrap_or_else(|| DEFAULT_OUT.into())
}

/// The path of the log that a user means by `argument`, such as `latest` in the folder for the folders of runs.
pub(crate) fn log(argument: &Path) -> PathBuf {
    run_folder::named_in(&out(None), argument)
}

/// The control law that the user prefers to that of the scenario.
pub(crate) fn law() -> Option<String> {
    defaults().first(|keys| keys.law.clone()).map(|(_, law)| law)
}

/// How many flights to simulate at the same time: as `given`, or the user's default, or one per core.
pub(crate) fn jobs(given: Option<NonZero<usize>>) -> usize {
    let preferred = given.or_else(|| defaults().first(|keys| keys.jobs).map(|(_, jobs)| jobs));
    preferred.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZero::get)
}

impl Defaults {
    /// The value of a key in the nearest file that has it, and that file.
    fn first<T>(&self, key: impl Fn(&Keys) -> Option<T>) -> Option<(&Path, T)> {
        self.files.iter().find_map(|(path, keys)| Some((path.as_path(), key(keys)?)))
    }

    /// A relative folder is seen from the file that names it, so that it is the same wherever the command is started.
    fn out(&self) -> Option<PathBuf> {
        let (file, out) = self.first(|keys| keys.out.clone())?;
        Some(file.parent().unwrap_or(Path::new("")).join(out))
    }
}

/// The files to read, the nearest first.
fn paths() -> anyhow::Result<Vec<PathBuf>> {
    if let Some(only) = env::var_os(VARIABLE) {
        return Ok(if only.is_empty() { Vec::new() } else { vec![only.into()] });
    }
    let folder = env::current_dir()?;
    let upward = folder.ancestors().map(|folder| folder.join(FILE)).find(|path| path.is_file());
    let of_user = user_file().filter(|path| path.is_file() && upward.as_ref() != Some(path));
    Ok(upward.into_iter().chain(of_user).collect())
}

/// The file in the user's folder for configuration, whether it exists or not.
fn user_file() -> Option<PathBuf> {
    // The standard for these folders says that a relative one is to be ignored.
    let named = env::var_os("XDG_CONFIG_HOME").map(PathBuf::from).filter(|folder| folder.is_absolute());
    let folder = named.or_else(|| Some(env::home_dir()?.join(".config")))?;
    Some(folder.join("ringwing").join(FILE))
}

fn parsed(path: &Path, text: &str) -> Result<Keys, WrongUsage> {
    let keys: Keys = toml::from_str(text).map_err(|error| {
        let begin = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = 1 + text[..begin].matches('\n').count();
        WrongUsage(format!("{}:{line}: {}", path.display(), error.message()))
    })?;
    match &keys.law {
        Some(law) if !LAWS.contains(&law.as_str()) => Err(WrongUsage(format!(
            "{}: law = {law:?}: choose {}",
            path.display(),
            LAWS.map(|law| format!("{law:?}")).join(" or ")
        ))),
        _ => Ok(keys),
    }
}

fn unreadable(path: &Path, why: &io::Error) -> WrongUsage {
    WrongUsage(format!(
        "{}: cannot be read: {why}; mend it, or set {VARIABLE} to another file",
        path.display()
    ))
}

/// Prints each default and where it comes from.
#[expect(clippy::unnecessary_wraps, reason = "every subcommand has this signature")]
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    tell(&shown(defaults(), user_file().as_deref()));
    Ok(ExitCode::SUCCESS)
}

/// A line for each key, and which files there are.
fn shown(defaults: &Defaults, user_file: Option<&Path>) -> String {
    let line = |name: &str, set: Option<(&Path, String)>, built_in: &str| match set {
        Some((file, value)) => format!("{name:5} {value}  (from {})\n", file.display()),
        None => format!("{name:5} {built_in}\n"),
    };
    let out = defaults.out().map(|folder| folder.display().to_string());
    let out = defaults.first(|keys| keys.out.clone()).map(|(file, _)| file).zip(out);
    let law = defaults.first(|keys| keys.law.clone());
    let jobs = defaults.first(|keys| keys.jobs).map(|(file, jobs)| (file, jobs.to_string()));
    let mut text = line("out", out, DEFAULT_OUT)
        + &line("law", law, "as the scenario says")
        + &line("jobs", jobs, "one per core");
    if defaults.files.is_empty() {
        let places = user_file.map(|path| format!(" or {}", path.display())).unwrap_or_default();
        text.push_str("\nNo file sets a default: write ");
        text.push_str(FILE);
        text.push_str(" in this folder, in one above it,");
        text.push_str(&places);
    }
    text.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(text: &str) -> Keys {
        parsed(Path::new("/a/ringwing.toml"), text).unwrap()
    }

    #[test]
    fn the_nearest_file_wins_and_folders_are_seen_from_their_file() {
        let files = vec![
            ("/work/ringwing.toml".into(), keys("law = \"resilient\"\n")),
            (
                "/home/me/.config/ringwing/ringwing.toml".into(),
                keys("law = \"paper\"\nout = \"flights\"\njobs = 3\n"),
            ),
        ];
        let defaults = Defaults { files };
        assert_eq!(defaults.first(|keys| keys.law.clone()).unwrap().1, "resilient");
        assert_eq!(defaults.out().unwrap(), Path::new("/home/me/.config/ringwing/flights"));
        let text = shown(&defaults, None);
        assert!(text.contains("law   resilient  (from /work/ringwing.toml)"), "{text}");
        assert!(text.contains("jobs  3  (from /home/me"), "{text}");
    }

    #[test]
    fn without_files_the_built_in_defaults_are_shown_with_where_to_write_others() {
        let text = shown(&Defaults::default(), Some(Path::new("/home/me/.config/ringwing/ringwing.toml")));
        assert!(text.starts_with("out   runs\nlaw   as the scenario says\njobs  one per core\n"), "{text}");
        assert!(text.ends_with("or /home/me/.config/ringwing/ringwing.toml"), "{text}");
    }

    #[test]
    fn mistakes_are_named_with_file_and_line() {
        let refusal = |text: &str| parsed(Path::new("/a/ringwing.toml"), text).unwrap_err().to_string();
        assert!(
            refusal("out = \"x\"\nlwa = \"paper\"\n").starts_with("/a/ringwing.toml:2: unknown field `lwa`")
        );
        assert!(refusal("jobs = 0\n").starts_with("/a/ringwing.toml:1: "));
        assert!(refusal("law = \"newton\"\n").contains("choose \"paper\" or \"resilient\""));
    }
}
