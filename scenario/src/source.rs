//! Where a scenario's text comes from: a preset or a file.

use crate::{Problem, ScenarioError, preset};
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// A scenario is a page or two; what is larger is something else.
const BYTES_MAX: u64 = 16 << 20;

/// A scenario as its author wrote it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// What to call it in messages: the preset's name or the file's path.
    pub name: String,
    /// Its TOML.
    pub text: String,
}

impl Source {
    /// The preset or else the file that `wanted` names.
    pub fn find(wanted: &str) -> Result<Self, ScenarioError> {
        let text = match preset::all().iter().find(|preset| preset.name == wanted) {
            Some(preset) => preset.text.to_owned(),
            None => text_of(wanted).map_err(|message| Problem::of_scenario(wanted, message))?,
        };
        Ok(Self { name: wanted.to_owned(), text })
    }
}

fn text_of(path: &str) -> Result<String, String> {
    let bytes = bytes_of(Path::new(path)).map_err(|error| reason(path, &error))?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err("is larger than 16 MiB: give a scenario file".into());
    }
    String::from_utf8(bytes).map_err(|error| {
        format!("is not UTF-8 text (byte {}): save it as UTF-8", error.utf8_error().valid_up_to() + 1)
    })
}

fn bytes_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn reason(path: &str, error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => {
            let presets: Vec<_> = preset::all().iter().map(|preset| preset.name).collect();
            format!(
                "neither a preset nor a file{}: give a preset ({}) or the path of a scenario file",
                looked_in(path),
                presets.join(", ")
            )
        }
        io::ErrorKind::IsADirectory => "is a folder: give a scenario file in it".into(),
        _ => format!("cannot be read: {error}"),
    }
}

/// A relative path is looked up from the current folder, which is easily not the one meant.
fn looked_in(path: &str) -> String {
    match std::env::current_dir() {
        Ok(folder) if Path::new(path).is_relative() => format!(" in {}", folder.display()),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(wanted: &str) -> String {
        Source::find(wanted).unwrap_err().to_string()
    }

    fn temporary(name: &str, bytes: &[u8]) -> String {
        let path = std::env::temp_dir().join(format!("ringwing-source-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_preset_is_found_by_its_name_and_a_file_by_its_path() {
        assert!(Source::find("paper-4.2").unwrap().text.contains("Obstacle 2"));
        let path = temporary("good.toml", b"seed = 7");
        let source = Source::find(&path).unwrap();
        assert_eq!((source.name.as_str(), source.text.as_str()), (path.as_str(), "seed = 7"));
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn what_is_neither_is_refused_with_all_that_was_tried() {
        let folder = std::env::current_dir().unwrap();
        assert_eq!(
            refusal("paper-4.3"),
            format!(
                "scenario \"paper-4.3\": neither a preset nor a file in {}: give a preset (paper-4.1, paper-4.2, dropout, \
                 dropout-return, delay, lossy, partition, leader-loss, storm) or the path of a scenario file",
                folder.display()
            )
        );
        assert!(!refusal("/nowhere/x.toml").contains(&folder.display().to_string()));
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_its_path() {
        assert_eq!(refusal("/tmp"), "scenario \"/tmp\": is a folder: give a scenario file in it");
        let path = temporary("latin1.toml", b"name = \"\xe9\"");
        assert_eq!(
            refusal(&path),
            format!("scenario \"{path}\": is not UTF-8 text (byte 9): save it as UTF-8")
        );
        std::fs::remove_file(path).unwrap();
        assert!(refusal("/dev/zero").ends_with("is larger than 16 MiB: give a scenario file"));
        assert!(refusal("a\0b").contains("cannot be read"));
    }
}
