//! Finds the text of a scenario: a preset or a file.
//!
//! Never parses it.

use super::problem::{Problem, ScenarioError};
use crate::{preset, spelling};
use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

/// Largest scenario file in bytes. A scenario has a page or two; a larger limit would let a device or a log that was
/// given by mistake fill the memory. The error names the limit.
const BYTES_MAX: u64 = 16 << 20;

/// A scenario as its author wrote it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Its name in messages: the preset's name or the file's path.
    pub name: String,
    /// Its TOML.
    pub text: String,
}

impl Source {
    /// The preset called `wanted`, or else the file at that path.
    ///
    /// # Errors
    /// There is neither, or the file is not a readable UTF-8 text of at most 16 MiB.
    pub fn find(wanted: &str) -> Result<Self, ScenarioError> {
        // A preset comes before a file of the same name; a path such as `./paper-4.2` still means the file.
        let text = match preset::all().iter().find(|preset| preset.name == wanted) {
            Some(preset) => preset.text.to_owned(),
            None => read_text(wanted).map_err(|message| Problem::of_scenario(wanted, message))?,
        };
        Ok(Self { name: wanted.to_owned(), text })
    }
}

impl Source {
    /// The folder from which relative paths in the text count: that of the file; the working folder for a preset.
    pub(super) fn folder(&self) -> PathBuf {
        let is_preset = preset::all().iter().any(|preset| preset.name == self.name);
        let folder = Path::new(&self.name).parent().filter(|_| !is_preset);
        folder.map_or_else(PathBuf::new, Path::to_path_buf)
    }
}

fn read_text(path: &str) -> Result<String, String> {
    let bytes = read_bytes(Path::new(path)).map_err(|error| io_message(path, &error))?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err("the file is larger than 16 MiB: give a scenario file".into());
    }
    String::from_utf8(bytes).map_err(|error| {
        format!(
            "the file is not UTF-8 text (byte {}): save it as UTF-8",
            error.utf8_error().valid_up_to() + 1
        )
    })
}

fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // Read one byte too many instead of asking for the size: pipes and devices have none.
    File::open(path)?.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn io_message(path: &str, error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => {
            let presets: Vec<_> = preset::all().iter().map(|preset| preset.name).collect();
            let meant = spelling::nearest(path, presets.iter().copied(), |preset| preset);
            let start = match meant {
                Some(preset) => format!("did you mean {preset}? There"),
                None => "there".into(),
            };
            format!(
                "{start} is no such preset, and no such file{}: give a preset ({}) or the path of a scenario file",
                searched_folder(path),
                presets.join(", ")
            )
        }
        io::ErrorKind::IsADirectory => "this is a folder: give a scenario file in it".into(),
        _ => format!("cannot read the file: {error}"),
    }
}

/// ` in FOLDER` for a relative path, because the current folder is easily the wrong one.
fn searched_folder(path: &str) -> String {
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
    fn a_name_that_is_neither_preset_nor_file_is_refused_with_what_was_tried() {
        let folder = std::env::current_dir().unwrap();
        assert_eq!(
            refusal("paper-4.3"),
            format!(
                "scenario \"paper-4.3\": did you mean paper-4.2? There is no such preset, and no such file in {}: give a preset (paper-4.1, paper-4.2, vee, shape-change, dropout, \
                 dropout-return, delay, lossy, partition, leader-loss, storm, field, traffic, racetrack, gusts, sensors) or the path of a scenario file",
                folder.display()
            )
        );
        let far = refusal("/nowhere/x.toml");
        assert!(!far.contains(&folder.display().to_string()) && !far.contains("did you mean"), "{far}");
        for (wrong, meant) in
            [("strom", "storm"), ("paper4.1", "paper-4.1"), ("dropout_return", "dropout-return")]
        {
            assert!(refusal(wrong).contains(&format!("did you mean {meant}?")), "{wrong}");
        }
    }

    #[test]
    fn an_unreadable_file_is_refused_with_its_path() {
        assert_eq!(refusal("/tmp"), "scenario \"/tmp\": this is a folder: give a scenario file in it");
        let path = temporary("latin1.toml", b"name = \"\xe9\"");
        assert_eq!(
            refusal(&path),
            format!("scenario \"{path}\": the file is not UTF-8 text (byte 9): save it as UTF-8")
        );
        std::fs::remove_file(path).unwrap();
        assert!(refusal("/dev/zero").ends_with("the file is larger than 16 MiB: give a scenario file"));
        assert!(refusal("a\0b").contains("cannot read the file"));
    }
}
