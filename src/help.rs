//! The help of the command: verbs grouped by the job that they are for, and examples for each verb.
//!
//! Never says what a verb does; the verbs themselves do, and this module arranges their words.

use crate::output;
use clap::Command;
use std::{fmt::Write, io};

/// Most columns that the list of verbs uses. Wider lines are hard to read; narrower ones break short sentences.
pub(crate) const COLUMNS_MAX: usize = 110;
/// Columns from the edge to what a verb does. Fewer do not fit the longest verb; more waste a narrow terminal.
const INDENT: usize = 14;

/// What people come for, and the verbs for it. Each visible verb is in one group.
const GROUPS: [(&str, &[&str]); 7] = [
    ("Fly a swarm", &["run", "watch", "fault", "pause", "step", "resume"]),
    ("Look at a flight", &["review", "replay", "verify", "compare", "recover"]),
    ("Find out what a formation can take", &["sweep", "margin", "hunt", "shrink"]),
    ("Check your own controller", &["conform"]),
    ("Measure how long a tick takes", &["bench"]),
    (
        "Scenarios, this machine, this command",
        &["scenario", "doctor", "config", "clean", "completion", "help"],
    ),
    ("Processes of a run, which `run` starts", &["agent", "world", "leader", "recorder", "viewer"]),
];

/// Examples for each verb, as they are typed.
const EXAMPLES: [(&str, &[&str]); 21] = [
    (
        "run",
        &[
            "ringwing run dropout",
            "ringwing run paper-4.1 --law resilient --fault \"at 30 s kill uav 3\"",
            "ringwing run mine.toml --set control.formation_gain=1.5 --seed 7 --simulated",
            "ringwing run paper-4.2 --real-time --pin --priority 50",
            "ringwing run paper-4.2 --real-time --live",
        ],
    ),
    (
        "fault",
        &[
            "ringwing fault runs/latest \"kill uav 3\"",
            "ringwing fault hr85rx \"link 2->3 delay 200 ms for 10 s\"",
            "ringwing fault runs/latest list",
        ],
    ),
    ("watch", &["ringwing watch", "ringwing watch runs/dropout-hr85rx"]),
    ("pause", &["ringwing pause latest"]),
    ("step", &["ringwing step latest", "ringwing step hr85rx 25"]),
    ("resume", &["ringwing resume latest"]),
    ("review", &["ringwing review latest", "ringwing review runs/a runs/b --out both"]),
    ("replay", &["ringwing replay latest --speed 2", "ringwing replay latest --live=9000"]),
    ("verify", &["ringwing verify latest", "ringwing verify latest --processes"]),
    ("compare", &["ringwing compare runs/a runs/b"]),
    ("recover", &["ringwing recover damaged.mcap --out whole.mcap"]),
    (
        "sweep",
        &[
            "ringwing sweep delay-loss",
            "ringwing sweep paper-4.2 --seeds 1000",
            "ringwing sweep compare sweeps/paper sweeps/resilient",
        ],
    ),
    ("margin", &["ringwing margin paper-4.1 --of \"link all->all delay {x} s\" --between 0..2 --theory"]),
    (
        "hunt",
        &[
            "ringwing hunt dropout --budget \"2 kills, 1 link fault of at most 1 s, loss at most 30 %\"",
            "ringwing hunt storm --budget \"1 freeze of at most 2 s, from 20 s to 60 s\" --goal recovery_max_s",
        ],
    ),
    ("shrink", &["ringwing shrink storm --set control.law=paper --set seed=1"]),
    ("conform", &["ringwing conform \"python3 mine.py\"", "ringwing conform \"./mine --gain 2\" --json"]),
    ("bench", &["ringwing bench", "ringwing bench --doctor", "ringwing bench --topology mesh"]),
    (
        "scenario",
        &["ringwing scenario list", "ringwing scenario show dropout", "ringwing scenario check mine.toml"],
    ),
    ("doctor", &["ringwing doctor", "ringwing doctor --json"]),
    ("config", &["ringwing config"]),
    ("completion", &["source <(ringwing completion bash)"]),
];

/// `command` with examples after the help of each verb.
pub(crate) fn with_examples(mut command: Command) -> Command {
    for (verb, examples) in EXAMPLES {
        let text = section(&command, "Examples", &lines_of(examples));
        command = command.mut_subcommand(verb, |verb| verb.after_help(text));
    }
    command
}

/// `command` with examples, and with its verbs in groups.
pub(crate) fn dressed(command: Command) -> Command {
    let mut command = with_examples(command);
    // Clap adds this verb only when it parses, and the groups below name it.
    command.build();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}{}\n{{options}}{{after-help}}",
        verbs(&command, output::columns(&io::stdout()).min(COLUMNS_MAX)),
        heading(&command, "Options"),
    );
    command.help_template(template)
}

/// All groups of verbs, each verb with the first line of its help, in lines of at most `columns`.
fn verbs(command: &Command, columns: usize) -> String {
    let mut text = String::new();
    for (group, verbs) in GROUPS {
        let lines: String = verbs
            .iter()
            .filter_map(|name| command.find_subcommand(name))
            .map(|verb| line(command, verb, columns))
            .collect();
        text += &section(command, group, &lines);
        text.push('\n');
    }
    text
}

/// A verb and what it does.
fn line(command: &Command, verb: &Command, columns: usize) -> String {
    let style = command.get_styles().get_literal();
    let about = verb.get_about().map(ToString::to_string).unwrap_or_default();
    let mut lines = output::wrapped(&about, columns.saturating_sub(INDENT)).into_iter();
    let name = verb.get_name();
    // Pad outside the style: escape sequences count as characters.
    let pad = " ".repeat(INDENT.saturating_sub(2 + name.len()));
    let mut text = format!("  {style}{name}{style:#}{pad}{}\n", lines.next().unwrap_or_default());
    for rest in lines {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "{:INDENT$}{rest}", "");
    }
    text
}

/// Examples, one in each line.
fn lines_of(examples: &[&str]) -> String {
    examples.iter().flat_map(|example| ["  ", example, "\n"]).collect()
}

fn section(command: &Command, title: &str, lines: &str) -> String {
    format!("{}\n{lines}", heading(command, title))
}

fn heading(command: &Command, title: &str) -> String {
    let style = command.get_styles().get_header();
    format!("{style}{title}:{style:#}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Cli;
    use clap::{CommandFactory, Parser};
    use std::collections::BTreeSet;

    #[test]
    fn every_visible_verb_is_in_one_group() {
        let mut command = Cli::command();
        command.build();
        let visible: BTreeSet<_> =
            command.get_subcommands().filter(|verb| !verb.is_hide_set()).map(Command::get_name).collect();
        let grouped: Vec<_> = GROUPS.iter().flat_map(|(_, verbs)| *verbs).copied().collect();
        assert_eq!(grouped.iter().copied().collect::<BTreeSet<_>>(), visible);
        assert_eq!(grouped.len(), visible.len(), "a verb is in two groups");
    }

    #[test]
    fn every_example_is_a_command_that_is_understood() {
        for (verb, examples) in EXAMPLES {
            for example in examples {
                // The one example that a shell takes apart before the command sees it.
                let line = example.strip_prefix("source <(").map_or(*example, |line| &line[..line.len() - 1]);
                let words = shell_words::split(line).unwrap();
                assert_eq!(words[1], verb, "{example}");
                if let Err(refusal) = Cli::try_parse_from(words) {
                    panic!("{example}: {refusal}");
                }
            }
        }
    }

    #[test]
    fn every_verb_for_users_has_examples() {
        let of_processes = GROUPS[GROUPS.len() - 1].1;
        let verbs = GROUPS.iter().flat_map(|(_, verbs)| *verbs);
        let lacking: Vec<_> = verbs
            .filter(|verb| !of_processes.contains(verb) && !["clean", "help"].contains(verb))
            .filter(|verb| EXAMPLES.iter().all(|(known, _)| known != *verb))
            .collect();
        assert!(lacking.is_empty(), "no example for {lacking:?}");
    }

    #[test]
    fn the_list_of_verbs_fits_a_narrow_terminal() {
        let mut command = Cli::command();
        command.build();
        for columns in [40, 80, COLUMNS_MAX] {
            // Without the escape sequences that colour it.
            let text = anstream::adapter::strip_str(&verbs(&command, columns)).to_string();
            assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
            assert!(text.contains("Fly a scenario"), "{text}");
        }
    }
}
