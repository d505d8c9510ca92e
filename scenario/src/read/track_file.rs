//! Reads the file of a leader's track: CSV with a time and a place on each line.
//!
//! The points become part of the scenario, so that a run's log holds everything needed to repeat the flight. Never judges
//! the track: `validate` does, and [`TrackFile::line`] says on which line of the file a point stands.

use ringwing_flight::TrackPoint;
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// Largest file in bytes: enough for the most points of a track with all their digits. A larger limit lets a device that is named by
/// mistake fill the memory.
const BYTES_MAX: u64 = 1 << 20;
/// The columns, as the first line names them. Others are ignored.
const COLUMNS: [&str; 3] = ["time_s", "x_m", "y_m"];
/// Larger numbers are mistakes, as in the scenario itself.
const MAGNITUDE_MAX: f64 = 1e7;

/// The points of a file, with their lines.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TrackFile {
    name: String,
    pub(super) points: Vec<TrackPoint>,
    lines: Vec<u64>,
}

impl TrackFile {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// It cannot be read, lacks a column, or has something other than a number; the message names file and line.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let name = format!("path file \"{}\"", path.display());
        let bytes = read_bytes(path).map_err(|error| format!("{name}: {error}"))?;
        if bytes.len() as u64 > BYTES_MAX {
            return Err(format!("{name}: the file is larger than 1 MiB: give a file of times and places"));
        }
        // Editors on Windows put a byte-order mark in front.
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        let (points, lines) = parse(text).map_err(|error| format!("{name}{error}"))?;
        Ok(Self { name, points, lines })
    }

    /// The file's name and the line of this point, as messages begin.
    pub(super) fn line(&self, point: usize) -> String {
        self.lines.get(point).map_or_else(|| self.name.clone(), |line| format!("{}, line {line}", self.name))
    }
}

fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte too many tells a file that is too large from one that just fits.
    File::open(path)?.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The points in `text` and their lines. An error begins with the punctuation that follows the file's name.
fn parse(text: &[u8]) -> Result<(Vec<TrackPoint>, Vec<u64>), String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
    let headers = reader.headers().map_err(|error| described(text, &error))?;
    let column = |name: &str| {
        let found = headers.iter().position(|header| header == name);
        found.ok_or_else(|| {
            format!(", line 1: there is no column {name}: begin the file with the line time_s,x_m,y_m")
        })
    };
    let [time, x, y] = COLUMNS.map(column);
    let columns = [time?, x?, y?];
    let (mut points, mut lines) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let record = record.map_err(|error| described(text, &error))?;
        let line = record.position().map_or(0, |position| line_of(text, position));
        let number = |place: usize| number(record.get(columns[place]).unwrap_or_default(), COLUMNS[place]);
        let point =
            || Ok::<_, String>(TrackPoint { time_s: number(0)?, position_m: [number(1)?, number(2)?] });
        points.push(point().map_err(|problem| format!(", line {line}: {problem}"))?);
        lines.push(line);
    }
    Ok((points, lines))
}

/// The number that `text` says, or what is wrong with it.
fn number(text: &str, column: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.abs() <= MAGNITUDE_MAX => Ok(number),
        Ok(number) if number.is_finite() => {
            Err(format!("{column} {text} is larger than {MAGNITUDE_MAX:e} in magnitude"))
        }
        _ => Err(format!("{column} {text:?} is not a number: give one without a unit, such as 12.5")),
    }
}

/// The line of the record that begins at or after `position`: the reader counts comments and empty lines to the record.
fn line_of(text: &[u8], position: &csv::Position) -> u64 {
    let rest = text.get(position.byte() as usize..).unwrap_or_default();
    let is_skipped = |line: &&[u8]| line.starts_with(b"#") || line.is_empty() || **line == *b"\r";
    position.line() + rest.split(|byte| *byte == b'\n').take_while(is_skipped).count() as u64
}

/// What is wrong with the file as CSV.
fn described(text: &[u8], error: &csv::Error) -> String {
    let line = error.position().map_or_else(String::new, |place| format!(", line {}", line_of(text, place)));
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{line}: there are {len} values, but {expected_len} columns")
        }
        csv::ErrorKind::Utf8 { .. } => format!("{line}: not UTF-8 text: save the file as UTF-8"),
        _ => format!("{line}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_by_the_names_of_their_columns() {
        let (points, lines) =
            parse(b"x_m, y_m, time_s, note\n1, 2, 0, start\n# a comment\n3, 4.5, 1.5, \n").unwrap();
        let point = |time_s, position_m| TrackPoint { time_s, position_m };
        assert_eq!(points, [point(0.0, [1.0, 2.0]), point(1.5, [3.0, 4.5])]);
        assert_eq!(lines, [2, 4]);
    }

    #[test]
    fn an_error_names_the_line_and_what_to_do() {
        for (text, problem) in [
            ("0,0,0\n", ", line 1: there is no column time_s: begin the file with the line time_s,x_m,y_m"),
            ("time_s,x_m,y_m\n0,0,0\n1 s,2,3\n", ", line 3: time_s \"1 s\" is not a number"),
            ("time_s,x_m,y_m\n0,nan,0\n", ", line 2: x_m \"nan\" is not a number"),
            ("time_s,x_m,y_m\n0,1e9,0\n", ", line 2: x_m 1e9 is larger than 1e7 in magnitude"),
            ("time_s,x_m,y_m\n0,0\n", ", line 2: there are 2 values, but 3 columns"),
        ] {
            assert!(
                parse(text.as_bytes()).unwrap_err().starts_with(problem),
                "{text}: {:?}",
                parse(text.as_bytes())
            );
        }
        assert!(parse(b"time_s,x_m,y_m\n0,\xff,0\n").unwrap_err().contains("not UTF-8"));
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = TrackFile::read(Path::new("/nowhere/track.csv")).unwrap_err();
        assert!(error.starts_with("path file \"/nowhere/track.csv\": "), "{error}");
        assert!(TrackFile::read(Path::new("/dev/zero")).unwrap_err().contains("larger than 1 MiB"));
    }
}
