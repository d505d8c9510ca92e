//! Completes the command line in a shell, and prints the script that makes the shell ask for that.
//!
//! What an argument stands for follows from its name, so a new verb gets its completions by naming its arguments like
//! the others: `scenario`, `settings`, `faults`, `log`, `run`.
//!
//! Must never start or change anything: a shell asks while the user types.

use crate::{WrongUsage, output::tell};
use clap::Command;
use clap_complete::{
    ArgValueCompleter, CompletionCandidate, PathCompleter, Shell, engine::ValueCompleter, env::Shells,
};
use ringwing_scenario::{fault, keys, preset};
use std::{ffi::OsStr, path::Path, process::ExitCode};

/// Prints the completion script of a shell. The script asks this command, which knows the live runs.
pub(crate) fn run(shell: Shell) -> anyhow::Result<ExitCode> {
    tell(String::from_utf8_lossy(&script(shell)?).trim_end());
    Ok(ExitCode::SUCCESS)
}

/// The script with which a shell asks this command for completions.
pub(crate) fn script(shell: Shell) -> anyhow::Result<Vec<u8>> {
    let shells = Shells::builtins();
    let name = shell.to_string();
    let completer =
        shells.completer(&name).ok_or_else(|| WrongUsage(format!("there is no completion for {name}")))?;
    let mut script = Vec::new();
    completer.write_registration("COMPLETE", "ringwing", "ringwing", "ringwing", &mut script)?;
    Ok(script)
}

/// `command` with a completer for each argument of each verb that takes one.
pub(crate) fn with_completers(command: Command) -> Command {
    // The files of a benchmark are no logs. For them the shell completes any path.
    if command.get_name() == "bench" {
        return command;
    }
    command
        .mut_args(|argument| match completer(argument.get_id().as_str()) {
            Some(completer) => argument.add(completer),
            None => argument,
        })
        .mut_subcommands(with_completers)
}

/// What completes the argument with this name.
fn completer(argument: &str) -> Option<ArgValueCompleter> {
    Some(match argument {
        "scenario" => ArgValueCompleter::new(scenarios),
        "settings" => ArgValueCompleter::new(settings),
        "faults" | "sentence" => ArgValueCompleter::new(sentences),
        "log" | "a" | "b" => ArgValueCompleter::new(PathCompleter::any().filter(is_log)),
        "run" => ArgValueCompleter::new(runs),
        _ => return None,
    })
}

/// Presets, and files that may be scenarios.
fn scenarios(current: &OsStr) -> Vec<CompletionCandidate> {
    let describe =
        |preset: &preset::Preset| CompletionCandidate::new(preset.name).help(Some(preset.description.into()));
    let mut candidates = beginning_with(current, preset::all().iter().map(describe));
    let is_scenario = |path: &Path| path.extension().is_some_and(|extension| extension == "toml");
    candidates.extend(PathCompleter::any().filter(is_scenario).complete(current));
    candidates
}

/// Keys of a scenario, each with the `=` that follows it.
fn settings(current: &OsStr) -> Vec<CompletionCandidate> {
    beginning_with(current, keys().into_iter().map(|key| CompletionCandidate::new(key + "=")))
}

/// Whole starts of sentences: what is typed, and a word that may follow.
fn sentences(current: &OsStr) -> Vec<CompletionCandidate> {
    let Some(current_text) = current.to_str() else { return Vec::new() };
    // The last word may be incomplete, so only the words before it say what may follow.
    let start = current_text.rfind(' ').map_or("", |space| &current_text[..=space]);
    let next = fault::next_words(start).into_iter();
    beginning_with(current, next.map(|word| CompletionCandidate::new(format!("{start}{word}"))))
}

/// The domains of all live runs, and folders of runs.
fn runs(current: &OsStr) -> Vec<CompletionCandidate> {
    let ids = ringwing_bus::domain::all().into_iter();
    let mut candidates = beginning_with(current, ids.map(|id| CompletionCandidate::new(id.to_string())));
    candidates.extend(PathCompleter::dir().complete(current));
    candidates
}

/// Whether a log may be called so, or is in the folder.
fn is_log(path: &Path) -> bool {
    let is_named = |ending: &str| path.to_string_lossy().ends_with(ending);
    is_named(".mcap") || is_named(".mcap.zst") || is_named(".mcap.lz4") || path.join("summary.json").exists()
}

fn beginning_with(
    current: &OsStr,
    candidates: impl Iterator<Item = CompletionCandidate>,
) -> Vec<CompletionCandidate> {
    let current = current.as_encoded_bytes();
    candidates.filter(|candidate| candidate.get_value().as_encoded_bytes().starts_with(current)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(candidates: &[CompletionCandidate]) -> Vec<String> {
        candidates.iter().map(|candidate| candidate.get_value().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_fault_is_completed_word_by_word() {
        let completed = |text: &str| values(&sentences(OsStr::new(text)));
        assert_eq!(completed("ki"), ["kill"]);
        assert_eq!(completed("freeze uav 3 f"), ["freeze uav 3 for"]);
        assert_eq!(completed("at 30 s ki"), ["at 30 s kill"]);
        assert!(completed("link all b").contains(&"link all blackout".to_owned()));
        assert_eq!(completed("kill nobody "), [""; 0]);
    }

    #[test]
    fn a_key_is_completed_with_its_equals_sign() {
        assert_eq!(values(&settings(OsStr::new("formation.ua"))), ["formation.uavs="]);
    }

    #[test]
    fn every_argument_of_a_known_kind_gets_a_completer() {
        let command = with_completers(<crate::Cli as clap::CommandFactory>::command());
        for (verb, argument) in [
            ("run", "scenario"),
            ("run", "settings"),
            ("run", "faults"),
            ("fault", "run"),
            ("fault", "sentence"),
            ("review", "log"),
            ("verify", "log"),
            ("recover", "log"),
            ("compare", "a"),
            ("compare", "b"),
        ] {
            let verb = command.find_subcommand(verb).unwrap();
            let argument = verb.get_arguments().find(|known| known.get_id() == argument).unwrap();
            assert!(
                argument.get::<ArgValueCompleter>().is_some(),
                "{} {}",
                verb.get_name(),
                argument.get_id()
            );
        }
    }
}
