//! Which program to start as a peer: its name in tables, and its command line.
//!
//! Must never start it.

use std::{fmt, str::FromStr};

/// Longest name. A longer one makes lines of the table wider than a terminal.
const NAME_MAX: usize = 20;

/// A program that takes the places of world and agents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PeerProgram {
    /// Its name in tables.
    pub(crate) name: String,
    /// The program and its first arguments; never empty.
    pub(crate) command: Vec<String>,
}

/// Reads `NAME=COMMAND`, and splits the command into words as a shell does.
impl FromStr for PeerProgram {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, line) = text.split_once('=').ok_or("write NAME=COMMAND, such as mine=./my-peer")?;
        // The name becomes a part of the labels of cases, whose parts are set apart by commas and spaces.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || name.len() > NAME_MAX || !name.chars().all(is_plain) {
            return Err(format!(
                "give a name of at most {NAME_MAX} letters, digits, -, _ and . before the ="
            ));
        }
        let command = shell_words::split(line).map_err(|error| format!("the command: {error}"))?;
        if command.is_empty() {
            return Err("give a command after the =".into());
        }
        Ok(Self { name: name.into(), command })
    }
}

/// Writes what [`FromStr`] reads.
impl fmt::Display for PeerProgram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name, shell_words::join(&self.command))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_split_as_a_shell_splits_it() {
        let program: PeerProgram = r#"mine=python3 "my peer.py" --mode 'a b' x\ y k=v"#.parse().unwrap();
        assert_eq!(program.name, "mine");
        assert_eq!(program.command, ["python3", "my peer.py", "--mode", "a b", "x y", "k=v"]);
        assert_eq!(program.to_string().parse::<PeerProgram>().unwrap(), program);
    }

    #[test]
    fn a_wrong_peer_is_refused_with_what_to_write_instead() {
        for (text, remedy) in [
            ("python3 peer.py", "NAME=COMMAND"),
            ("=peer", "give a name"),
            ("my peer=peer", "give a name"),
            ("a-name-of-more-than-twenty=peer", "at most 20"),
            ("mine=", "give a command"),
            ("mine='peer", "the command"),
        ] {
            let error = text.parse::<PeerProgram>().unwrap_err();
            assert!(error.contains(remedy), "{text}: {error}");
        }
    }
}
