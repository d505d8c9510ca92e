//! Delays that were measured elsewhere, read from a file into the fault itself: a run's log then has all that it needs.

use super::{Action, Delay, Fault, Trouble};

/// Delays are for one sample after the other; a longer file is something else.
const DELAYS_MAX: usize = 100_000;

/// Reads every trace that `faults` name a file of: seconds, one number on each line, `#` before a remark.
pub fn read_all(faults: &mut [Fault]) -> Result<(), String> {
    for fault in faults {
        if let Action::Link { trouble: Trouble::Delay(delay), .. } = &mut fault.action
            && let Delay::File(path) = &*delay
        {
            *delay = Delay::Trace(read(path)?);
        }
    }
    Ok(())
}

fn read(path: &str) -> Result<Vec<f64>, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("delay file \"{path}\": {error}"))?;
    delays(&text).map_err(|why| format!("delay file \"{path}\"{why}"))
}

fn delays(text: &str) -> Result<Vec<f64>, String> {
    let mut delays = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let value = line.split('#').next().unwrap_or_default().trim();
        if value.is_empty() {
            continue;
        }
        let delay_s = value.parse().ok().filter(|delay_s: &f64| delay_s.is_finite() && *delay_s >= 0.0);
        delays.push(
            delay_s.ok_or_else(|| {
                format!(", line {number}: {value:?} is no delay: give seconds, such as 0.035")
            })?,
        );
    }
    match delays.len() {
        0 => Err(": holds no delays: give seconds, one number on each line".into()),
        count if count > DELAYS_MAX => {
            Err(format!(": {count} delays are more than {DELAYS_MAX}: leave some out"))
        }
        _ => Ok(delays),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_read_line_by_line_and_what_is_none_is_named() {
        assert_eq!(delays("# wifi\n0.02\n\n0.5 # slow\n"), Ok(vec![0.02, 0.5]));
        assert_eq!(
            delays("0.02\n20 ms").unwrap_err(),
            ", line 2: \"20 ms\" is no delay: give seconds, such as 0.035"
        );
        assert!(delays("-1").is_err() && delays("nan").is_err());
        assert!(delays("#").unwrap_err().contains("holds no delays"));
    }

    #[test]
    fn a_file_becomes_part_of_the_fault() {
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
