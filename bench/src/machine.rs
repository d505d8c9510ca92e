//! The machine of a benchmark as text: its properties, and what about it spoils a measurement.
//!
//! Must never look at the machine itself: [`doctor`](crate::doctor) does.

use crate::result::Machine;

/// Value of a fact that cannot be read on this machine.
pub(crate) const UNREADABLE: &str = "not readable here";
/// Longest line, in characters. Longer lines break on narrow terminals; shorter ones make the list longer.
const WIDTH: usize = 106;

/// The facts in lines, then the warnings.
pub(crate) fn render(machine: &Machine) -> String {
    let mut text = String::from("Machine\n");
    let width = machine.facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    text.extend(machine.facts.iter().map(|(name, value)| format!("  {name:<width$}  {value}\n")));
    if machine.warnings.is_empty() {
        return text + "\nNothing was found that spoils a measurement.\n";
    }
    text.push_str("\nWhat spoils a measurement here\n");
    text.extend(machine.warnings.iter().map(|warning| list_item(warning)));
    text
}

/// An item of a list, broken into lines.
fn list_item(warning: &str) -> String {
    let mut text = String::from("  -");
    let mut column = text.len();
    for word in warning.split(' ') {
        let length = 1 + word.chars().count();
        if column + length > WIDTH {
            text.push_str("\n   ");
            column = 3;
        }
        text.extend([" ", word]);
        column += length;
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fact_is_shown_and_a_quiet_machine_is_called_so() {
        let facts = vec![("cores".to_owned(), "2".to_owned()), ("build".to_owned(), "release".to_owned())];
        let text = render(&Machine { facts, warnings: Vec::new() });
        assert!(text.starts_with("Machine\n  cores  2\n  build  release\n"), "{text}");
        assert!(text.ends_with("Nothing was found that spoils a measurement.\n"), "{text}");
    }

    #[test]
    fn long_warnings_are_broken_between_words() {
        let facts = vec![("cores".to_owned(), "2".to_owned())];
        let text = render(&Machine { facts, warnings: vec!["twelve words ".repeat(20).trim().into()] });
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(
            text.matches("twelve words").count() + text.matches("twelve\n    words").count(),
            20,
            "{text}"
        );
    }
}
