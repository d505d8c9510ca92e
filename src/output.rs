//! Everything that the command prints: results on standard output, diagnostics on standard error.
//!
//! Must never panic, and never stop a flight because nobody reads: the command goes on, writes its files, and
//! [`exit_code`] says at the end whether the results arrived.

use crate::{FAILED, READER_GONE};
use anstream::{AutoStream, ColorChoice, stream::RawStream};
use anstyle::{AnsiColor, Style};
use std::{
    fmt::Display,
    io::{self, ErrorKind, Write},
    os::fd::AsFd,
    path::Path,
    process::ExitCode,
    sync::OnceLock,
};

/// The style of `error:` and of everything that is as bad.
pub(crate) const BAD: Style = AnsiColor::Red.on_default().bold();
/// The style of what went well.
pub(crate) const GOOD: Style = AnsiColor::Green.on_default().bold();
/// The style of `warning:` and of what deserves a look.
pub(crate) const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();

/// Width where there is no terminal. More does not fit on most terminals when the output is shown later.
const COLUMNS_DEFAULT: usize = 80;

/// Why standard output could not be written the first time that this happened.
static FAILURE: OnceLock<io::Error> = OnceLock::new();

/// Prints a line on standard output.
pub(crate) fn tell(text: &str) {
    print(&format!("{text}\n"));
}

/// Prints `text` on standard output, byte for byte.
pub(crate) fn print(text: &str) {
    // After a failure the reader lacks a part, so the rest would mislead.
    if FAILURE.get().is_some() {
        return;
    }
    let mut out = io::stdout().lock();
    // Flush now: the standard library ignores errors of its last flush.
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        // `set` fails only if another thread has failed first, and the first reason counts.
        let _ = FAILURE.set(error);
    }
}

/// Prints an error on standard error; `text` is lower case and says what to do.
pub(crate) fn error(text: &dyn Display) {
    diagnose(BAD, "error", text);
}

/// Prints a warning on standard error; the command goes on.
pub(crate) fn warning(text: &dyn Display) {
    diagnose(DOUBTFUL, "warning", text);
}

/// Prints what the user should know of `log`, without a bearing on the exit code.
pub(crate) fn warn_of(log: &Path, texts: &[String]) {
    for text in texts {
        warning(&format!("{}: {text}", log.display()));
    }
}

fn diagnose(style: Style, level: &str, text: &dyn Display) {
    let level = painted(style, &format!("{level}:"), is_coloured(&io::stderr()));
    note(&format!("{level} {text}"));
}

/// Prints a line on standard error. Nobody can be told if that fails.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Whether a stream shows colours: it is a terminal, unless `NO_COLOR` or `CLICOLOR_FORCE` say otherwise.
pub(crate) fn is_coloured<S: RawStream>(stream: &S) -> bool {
    AutoStream::choice(stream) != ColorChoice::Never
}

/// The width of a stream: its terminal's, or else that of `COLUMNS` or of a usual terminal.
pub(crate) fn columns<S: AsFd>(stream: &S) -> usize {
    let terminal = terminal_size::terminal_size_of(stream).map(|(width, _)| usize::from(width.0));
    let variable = || std::env::var("COLUMNS").ok()?.parse().ok();
    // Some programs open a terminal without telling it its size.
    terminal.or_else(variable).filter(|columns| *columns > 0).unwrap_or(COLUMNS_DEFAULT)
}

/// `text` broken at spaces into lines of at most `columns`; a longer word has a line of its own.
pub(crate) fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= columns => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// `text` in `style` if `is_coloured`, or else as it is.
pub(crate) fn painted(style: Style, text: &str, is_coloured: bool) -> String {
    if is_coloured { format!("{style}{text}{style:#}") } else { text.to_owned() }
}

/// The exit code of the command, which would be `code` if all of its results were printed.
///
/// A missing result beats every other exit code: whoever reads the output must not take a part for the whole.
pub(crate) fn exit_code(code: ExitCode) -> ExitCode {
    match FAILURE.get() {
        None => code,
        // Other tools end silently by SIGPIPE here. This command must not: a launcher has a run to clean up.
        Some(failure) if failure.kind() == ErrorKind::BrokenPipe => ExitCode::from(READER_GONE),
        Some(failure) => {
            error(&format!("standard output: cannot be written: {failure}"));
            ExitCode::from(FAILED)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_broken_at_spaces_and_no_word_is_cut() {
        assert_eq!(wrapped("uav 3 at 58.50 s; repelled", 12), ["uav 3 at", "58.50 s;", "repelled"]);
        assert_eq!(wrapped("a/very/long/path b", 4), ["a/very/long/path", "b"]);
        assert_eq!(wrapped("", 4), [""]);
    }

    #[test]
    fn text_is_painted_only_where_colours_are_shown() {
        assert_eq!(painted(BAD, "error:", false), "error:");
        let coloured = painted(BAD, "error:", true);
        assert!(coloured.starts_with("\u{1b}[") && coloured.ends_with("\u{1b}[0m"), "{coloured:?}");
        assert!(coloured.contains("error:"));
    }
}
