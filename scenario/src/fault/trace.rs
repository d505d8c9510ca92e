//! Loads measured link delays from files into the faults that name them, so that a run's log holds everything needed to
//! repeat the flight.

use super::{Action, Delay, Fault, LinkImpairment, lexer::TIME_MAX_S};
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// Most delays in one trace. It is replayed one value per tick, so this is 17 minutes at 100 Hz. Every value is
/// written into the log and sent to every agent: a much larger limit makes both slow.
const DELAYS_MAX: usize = 100_000;

/// Largest file of delays in bytes: enough for the most delays with all their digits. A larger limit lets a device that is
/// named by mistake fill the memory.
const BYTES_MAX: u64 = 4 << 20;

impl Action {
    /// Replaces a [`Delay::File`] by the [`Delay::Trace`] in that file. A relative path counts from `folder`.
    ///
    /// A file has one number of seconds per line; `#` starts a comment. Both kinds of line ends and a byte-order mark are
    /// fine.
    ///
    /// # Errors
    /// The file cannot be read, or holds something other than delays; the message names the file and the line.
    pub fn load_delays(&mut self, folder: &Path) -> Result<(), String> {
        if let Self::Link { impairment: LinkImpairment::Delay(delay), .. } = self
            && let Delay::File(path) = &*delay
        {
            *delay = Delay::Trace(read(&folder.join(path))?);
        }
        Ok(())
    }
}

/// Loads the files of delays that `faults` name; relative paths count from the working folder.
///
/// # Errors
/// As [`Action::load_delays`].
pub fn read_all(faults: &mut [Fault]) -> Result<(), String> {
    faults.iter_mut().try_for_each(|fault| fault.action.load_delays(Path::new("")))
}

fn read(path: &Path) -> Result<Vec<f64>, String> {
    let name = path.display();
    let bytes = read_bytes(path).map_err(|error| format!("delay file \"{name}\": {error}"))?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err(format!("delay file \"{name}\": the file is larger than 4 MiB: give a file of delays"));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        // The valid part ends in the line of the first wrong byte, so it has as many pieces as that line's number.
        let line = error.as_bytes()[..valid].split(|byte| *byte == b'\n').count();
        format!("delay file \"{name}\", line {line}: not UTF-8 text: save the file as UTF-8")
    })?;
    parse(&text).map_err(|error| format!("delay file \"{name}\"{error}"))
}

fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte too many tells a file that is too large from one that just fits.
    File::open(path)?.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The delays in `text`. An error begins with the punctuation that follows the file's name.
fn parse(text: &str) -> Result<Vec<f64>, String> {
    // Editors on Windows put a byte-order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut delays_s = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let value = line.split('#').next().unwrap_or_default().trim();
        if !value.is_empty() {
            delays_s.push(delay_s(value).map_err(|problem| format!(", line {number}: {value:?} {problem}"))?);
        }
    }
    match delays_s.len() {
        0 => Err(": the file has no delays: give seconds, one number per line".into()),
        count if count > DELAYS_MAX => {
            Err(format!(": {count} delays are more than {DELAYS_MAX}: shorten the file"))
        }
        _ => Ok(delays_s),
    }
}

/// The delay that `text` says, or what is wrong with it.
fn delay_s(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(delay_s) if (0.0..=TIME_MAX_S).contains(&delay_s) => Ok(delay_s),
        // `parse` also accepts `inf` and `nan`, which fall through to the last message.
        Ok(delay_s) if delay_s.is_finite() => {
            Err(format!("is outside 0 to {TIME_MAX_S} s: give a delay of at most a day"))
        }
        _ => Err("is not a delay: give seconds, such as 0.035".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_has_one_delay_per_line_and_an_error_names_the_line() {
        assert_eq!(parse("# wifi\n0.02\n\n0.5 # slow\n"), Ok(vec![0.02, 0.5]));
        assert_eq!(
            parse("0.02\n20 ms").unwrap_err(),
            ", line 2: \"20 ms\" is not a delay: give seconds, such as 0.035"
        );
        for (text, problem) in [
            ("-1", "line 1: \"-1\" is outside 0 to 86400 s"),
            ("0.1\n1e300", "line 2: \"1e300\" is outside 0 to 86400 s"),
            ("0.1\n0.2\nnan", "line 3: \"nan\" is not a delay"),
            ("inf", "line 1: \"inf\" is not a delay"),
        ] {
            assert!(parse(text).unwrap_err().contains(problem), "{text}: {:?}", parse(text));
        }
        assert!(parse("#").unwrap_err().contains("has no delays"));
    }

    #[test]
    fn a_file_from_another_system_reads_the_same() {
        assert_eq!(parse("\u{feff}0.02\r\n0.5 # slow\r\n\r\n"), Ok(vec![0.02, 0.5]));
    }

    #[test]
    fn a_path_counts_from_the_folder_that_it_is_given_with() {
        let folder = std::env::temp_dir().join(format!("ringwing-delays-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("wifi.txt"), "0.02").unwrap();
        std::fs::write(folder.join("binary.txt"), b"0.02\n\xff\xfe").unwrap();
        let mut action: Action = "link all delay file \"wifi.txt\"".parse().unwrap();
        assert!(action.load_delays(Path::new("/nowhere")).unwrap_err().contains("\"/nowhere/wifi.txt\""));
        action.load_delays(&folder).unwrap();
        assert_eq!(action.to_string(), "link all delay trace {20 ms}");
        let mut binary: Action = "link all delay file \"binary.txt\"".parse().unwrap();
        assert!(
            binary
                .load_delays(&folder)
                .unwrap_err()
                .ends_with("line 2: not UTF-8 text: save the file as UTF-8")
        );
        let mut endless: Action = "link all delay file \"/dev/zero\"".parse().unwrap();
        assert!(endless.load_delays(&folder).unwrap_err().contains("larger than 4 MiB"));
        let just_fits = format!("0.02 #{}", "x".repeat(BYTES_MAX as usize - 6));
        std::fs::write(folder.join("large.txt"), just_fits).unwrap();
        let mut large: Action = "link all delay file \"large.txt\"".parse().unwrap();
        assert_eq!(large.load_delays(&folder), Ok(()));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_trace_has_a_largest_length() {
        assert!(parse(&"0.02\n".repeat(DELAYS_MAX)).is_ok());
        assert_eq!(
            parse(&"0.02\n".repeat(DELAYS_MAX + 1)).unwrap_err(),
            ": 100001 delays are more than 100000: shorten the file"
        );
    }

    #[test]
    fn the_contents_of_a_file_become_part_of_the_fault() {
        let path = std::env::temp_dir().join(format!("ringwing-trace-{}", std::process::id()));
        std::fs::write(&path, "0.02\n0.035").unwrap();
        let mut faults =
            [format!("at 1 s link all delay file \"{}\"", path.display()).parse::<Fault>().unwrap()];
        read_all(&mut faults).unwrap();
        assert_eq!(faults[0].to_string(), "at 1 s link all delay trace {20 ms, 35 ms}");
        std::fs::remove_file(&path).unwrap();
        let mut gone = ["at 1 s link all delay file \"nowhere.txt\"".parse::<Fault>().unwrap()];
        assert!(read_all(&mut gone).unwrap_err().starts_with("delay file \"nowhere.txt\": "));
    }
}
