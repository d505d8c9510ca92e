//! Which UAVs a program of the user's flies instead of the built-in law.

use ringwing_flight::UavId;
use serde::{Deserialize, Serialize};

/// Stands for every UAV.
const ALL: &str = "all";

/// `[[agents]]`: UAVs that a program of your own flies instead of the built-in law. Where two sections name the same UAV, the
/// later one counts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgentSection {
    /// The UAVs: `"all"`, or their numbers, such as `"3"` or `"1, 4"`.
    pub uavs: String,
    /// The program and its arguments. ringwing adds arguments that name the run and the UAV.
    pub command: Vec<String>,
    /// The folder that the program starts in, from which relative paths in `command` count. A relative one counts from the
    /// folder of the scenario's file, which is also what it is if left out.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub folder: String,
}

impl AgentSection {
    /// The section of `--agent UAVS=COMMAND`.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let usage = "expected UAVS=COMMAND, such as \"3=python3 mine.py\" or \"all=./controller\"";
        // At the first `=` only: the command may have more of them, such as `--gain=2`.
        let (uavs, line) = text.split_once('=').ok_or(usage)?;
        let command = shell_words::split(line).map_err(|error| format!("the command: {error}"))?;
        let section = Self { uavs: uavs.trim().into(), command, folder: String::new() };
        match section.named() {
            Some(_) if !section.command.is_empty() => Ok(section),
            _ => Err(usage.into()),
        }
    }

    /// As `--agent` names it: UAVS=COMMAND.
    pub fn flag(&self) -> String {
        format!("{}={}", self.uavs, self.command_line())
    }

    /// Whether it names `uav`.
    pub fn has(&self, uav: UavId) -> bool {
        match self.named() {
            Some(NamedUavs::All) => true,
            Some(NamedUavs::Numbers(numbers)) => numbers.contains(&uav.0),
            None => false,
        }
    }

    /// The UAVs that it names; `None` if the text names none.
    pub(crate) fn named(&self) -> Option<NamedUavs> {
        if self.uavs.trim() == ALL {
            return Some(NamedUavs::All);
        }
        // One wrong word makes the whole list wrong; otherwise a typing error would leave a UAV to the built-in law.
        let numbers: Option<Vec<u32>> = self.uavs.split(',').map(|word| word.trim().parse().ok()).collect();
        numbers.map(NamedUavs::Numbers)
    }

    /// The command as one types it in a shell.
    pub fn command_line(&self) -> String {
        shell_words::join(&self.command)
    }
}

/// The UAVs that a section names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NamedUavs {
    All,
    /// At least one.
    Numbers(Vec<u32>),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_argument_is_taken_apart_as_a_shell_does() {
        let section = AgentSection::parse("1, 4=python3 'my law.py' --gain 2").unwrap();
        assert_eq!(section.command, ["python3", "my law.py", "--gain", "2"]);
        assert_eq!([1, 2, 4].map(|uav| section.has(UavId(uav))), [true, false, true]);
        assert_eq!(
            AgentSection::parse(&format!("all={}", section.command_line())).unwrap().command,
            section.command
        );
        for text in ["", "3", "=./mine", "3=", "x=./mine", "3,=./mine", "-1=./mine", "3='./mine"] {
            assert!(AgentSection::parse(text).is_err(), "{text}");
        }
    }
}
