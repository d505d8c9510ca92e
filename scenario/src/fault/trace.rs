//! Loads measured link delays from files into the faults that name them, so that a run's log holds everything needed to
//! repeat the flight.

use super::{Action, Delay, Fault, LinkImpairment};

/// Most delays in one trace. It is replayed one value per tick, so this is 17 minutes at 100 Hz. Every value is
/// written into the log and sent to every agent: a much larger limit makes both slow.
const DELAYS_MAX: usize = 100_000;

/// Replaces every [`Delay::File`] in `faults` by the [`Delay::Trace`] in that file.
///
/// A file has one number of seconds per line; `#` starts a comment.
///
/// # Errors
/// The file cannot be read, or holds something other than delays; the message names the file and the line.
pub fn read_all(faults: &mut [Fault]) -> Result<(), String> {
    for fault in faults {
        if let Action::Link { impairment: LinkImpairment::Delay(delay), .. } = &mut fault.action
            && let Delay::File(path) = &*delay
        {
            *delay = Delay::Trace(read(path)?);
        }
    }
    Ok(())
}

fn read(path: &str) -> Result<Vec<f64>, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("delay file \"{path}\": {error}"))?;
    parse(&text).map_err(|error| format!("delay file \"{path}\"{error}"))
}

/// The delays in `text`. An error begins with the punctuation that follows the file's name.
fn parse(text: &str) -> Result<Vec<f64>, String> {
    let mut delays_s = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let value = line.split('#').next().unwrap_or_default().trim();
        if !value.is_empty() {
            delays_s.push(delay_s(value).ok_or_else(|| {
                format!(", line {number}: {value:?} is not a delay: give seconds, such as 0.035")
            })?);
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

fn delay_s(text: &str) -> Option<f64> {
    text.parse().ok().filter(|delay_s: &f64| delay_s.is_finite() && *delay_s >= 0.0)
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
        assert!(parse("-1").is_err() && parse("nan").is_err());
        assert!(parse("#").unwrap_err().contains("has no delays"));
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
