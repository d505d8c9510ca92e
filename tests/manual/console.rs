//! Every command in a `console` block of README and manual is run, and prints what the page shows below it.
//!
//! The commands of a page run one after the other in one shell, in a folder of their own. A block `toml file=my.toml` is
//! saved there before. In an expected output, `[..]` stands for the rest of a line or a part of it, `...` alone on a line for
//! any number of lines, and the names of runs may differ. A command that fails must be followed by `$ echo $?`: a reader must
//! know that it is meant to fail. A picture whose title names a file must be equal to what the commands wrote there. The
//! command of a block `console background` runs beside the commands below it, as in another terminal.

use super::{
    REMEDY,
    markdown::{Block, Page},
    overwrites, pages, root,
};
use snapbox::{IntoData, filter::NormalizeToExpected};
use std::{fmt::Write, fs, os::unix::fs::symlink, path::Path, process::Command, sync::Mutex, thread};

/// Pages whose examples run at the same time. More take longer on the two cores of a small machine, because flights with
/// processes then wait for each other.
const WORKERS: usize = 2;
/// Longest time for the commands of a page. Less fails on a busy machine; more delays the report of a hang.
const LONGEST: &str = "300";
/// Stands before the exit code of a command in the output of the shell. No command prints it.
const MARK: char = '\u{1e}';
/// What the shell knows beside `ringwing`. The build and the tests of the repository have run before this test does.
const PREAMBLE: &str = r#"exec 2>&1 </dev/null
cargo() {
  [ "$1 $2" = "run --release" ] || { echo "only cargo run --release stands for ringwing here"; return 1; }
  shift 2; [ "$1" = -- ] && shift; ringwing "$@"
}
# Runs a flight beside the other commands, and returns once it is in the air: only then there is nothing to heal.
beside() {
  "$@" > background.txt 2>&1 & background=$!
  until ringwing fault runs/latest "heal all" 2>&1 | grep -q 'nothing to heal'; do
    kill -0 $background || break
    sleep 0.05
  done
}
finish() { local code=$?; printf '\n\036%s\n' "$code"; return $code; }
"#;

/// A command of a page and the output that the page shows.
struct Example {
    command: String,
    expected: String,
    is_background: bool,
    /// Which block of the page it is in.
    block: usize,
}

#[test]
fn every_example_prints_what_its_page_shows() {
    let pages = Mutex::new(pages().into_iter());
    let faults = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                loop {
                    let Some(page) = pages.lock().unwrap().next() else { return };
                    let found = run(&page);
                    faults.lock().unwrap().extend(found);
                }
            });
        }
    });
    let faults = faults.into_inner().unwrap();
    assert!(faults.is_empty(), "{}\n{REMEDY}", faults.join("\n"));
}

/// Runs the examples of a page; returns what differs from it.
fn run(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let page = Page::parse(&text);
    let examples = examples(&page.blocks);
    if examples.is_empty() {
        return Vec::new();
    }
    let name = path.strip_prefix(root()).unwrap().display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let outputs = outputs(&page.blocks, &examples, folder.path());
    assert_eq!(outputs.len(), examples.len(), "{name}: the shell ended early:\n{outputs:#?}");
    let mut faults: Vec<_> =
        unannounced(&examples, &outputs).map(|fault| format!("{name}: {fault}")).collect();
    let shown = shown(&page.blocks, &examples, &outputs);
    for (block, shown) in page.blocks.iter().zip(&shown) {
        if block.text != *shown && !overwrites() {
            faults.push(format!("{name} shows\n{}but the commands print\n{shown}", block.text));
        }
    }
    if overwrites() {
        fs::write(path, replaced(&text, &page.blocks, &shown)).unwrap();
    }
    faults.extend(pictures(path, &page, folder.path()).map(|fault| format!("{name}: {fault}")));
    faults
}

/// The commands of the `console` blocks. A command goes on in the next line, which begins with `>`, as in a shell.
fn examples(blocks: &[Block]) -> Vec<Example> {
    let mut examples: Vec<Example> = Vec::new();
    for (index, block) in blocks.iter().enumerate() {
        if !is_console(block) {
            continue;
        }
        for line in block.text.lines() {
            let is_background = block.info.ends_with("background");
            if let Some(command) = line.strip_prefix("$ ") {
                let expected = String::new();
                examples.push(Example { command: command.into(), expected, is_background, block: index });
            } else if let Some(example) = examples.last_mut() {
                match line.strip_prefix("> ") {
                    Some(more) if example.expected.is_empty() => write!(example.command, "\n{more}").unwrap(),
                    _ => writeln!(example.expected, "{line}").unwrap(),
                }
            }
        }
    }
    examples
}

fn is_console(block: &Block) -> bool {
    block.info.split(' ').next() == Some("console")
}

/// What each command printed, with its exit code.
fn outputs(blocks: &[Block], examples: &[Example], folder: &Path) -> Vec<(String, i32)> {
    let tools = tempfile::tempdir().unwrap();
    symlink(env!("CARGO_BIN_EXE_ringwing"), tools.path().join("ringwing")).unwrap();
    symlink(root().join("bench"), folder.join("bench")).unwrap();
    for block in blocks {
        if let Some((_, file)) = block.info.split_once("file=") {
            fs::write(folder.join(file), &block.text).unwrap();
        }
    }
    let mut script = PREAMBLE.to_owned();
    for example in examples {
        let beside = if example.is_background { "beside " } else { "" };
        writeln!(script, "{beside}{}\nfinish", example.command).unwrap();
    }
    // A background flight must not outlive its page. A shell makes background commands ignore SIGINT.
    script.push_str("[ -z \"$background\" ] || { kill -TERM $background; wait $background; }\n");
    let path = format!("{}:{}", tools.path().display(), std::env::var("PATH").unwrap());
    let output = Command::new("timeout")
        .args([LONGEST, "env", "--default-signal=INT,HUP,TSTP", "bash", "-c", &script])
        .current_dir(folder)
        .env("PATH", path)
        // The files of whoever runs the tests do not count, but those of a page do.
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("RINGWING_CONFIG")
        .env_remove("CLICOLOR_FORCE")
        .env_remove("COLUMNS")
        .output()
        .unwrap();
    split(&String::from_utf8(output.stdout).unwrap())
}

/// Splits the output of the shell after each command.
fn split(output: &str) -> Vec<(String, i32)> {
    let mut outputs = Vec::new();
    let mut parts = output.split(MARK);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (code, rest) = part.split_once('\n').unwrap();
        // The shell puts a line break before the mark.
        let printed = text.strip_suffix('\n').unwrap_or(&text).to_owned();
        outputs.push((printed, code.parse().unwrap()));
        rest.clone_into(&mut text);
    }
    outputs
}

/// The commands that fail although the page does not say so.
fn unannounced<'e>(
    examples: &'e [Example],
    outputs: &'e [(String, i32)],
) -> impl Iterator<Item = String> + 'e {
    examples.iter().zip(outputs).enumerate().filter_map(|(index, (example, (output, code)))| {
        let is_announced = examples.get(index + 1).is_some_and(|next| next.command == "echo $?");
        (*code != 0 && !is_announced)
            .then(|| format!("`{}` exits with {code}, and no `echo $?` follows:\n{output}", example.command))
    })
}

/// Each block as the page should show it: with the new output where the shown one does not match it.
fn shown(blocks: &[Block], examples: &[Example], outputs: &[(String, i32)]) -> Vec<String> {
    let mut shown: Vec<String> = blocks
        .iter()
        .map(|block| if is_console(block) { String::new() } else { block.text.clone() })
        .collect();
    for (example, (output, _)) in examples.iter().zip(outputs) {
        let command = example.command.replace('\n', "\n> ");
        write!(shown[example.block], "$ {command}\n{}", matched(&example.expected, output)).unwrap();
    }
    shown
}

/// `expected` if it matches `output`, or else `output` with the parts of `expected` that do match.
fn matched(expected: &str, output: &str) -> String {
    let (expected_masked, output_masked) = (masked(expected), masked(output));
    let normal = NormalizeToExpected::new().redact();
    let compare = |output: &str, expected: &str| {
        normal.normalize(output.into_data(), &expected.into_data()).render().unwrap()
    };
    if compare(&output_masked, &expected_masked) == expected_masked {
        return expected.to_owned();
    }
    compare(output, expected)
}

/// `text` with the same name for every run: six letters and digits, after `domain ` or a dash.
fn masked(text: &str) -> String {
    let mut masked = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(['-', ' ']) {
        let (before, after) = rest.split_at(at + 1);
        masked.push_str(before);
        let length =
            after.find(|c: char| !c.is_ascii_lowercase() && !c.is_ascii_digit()).unwrap_or(after.len());
        let is_name = length == 6 && (before.ends_with('-') || before.ends_with("domain "));
        rest = if is_name { &after[6..] } else { after };
        masked.push_str(if is_name { "NAME" } else { "" });
    }
    masked + rest
}

/// The page with its blocks replaced.
fn replaced(text: &str, blocks: &[Block], shown: &[String]) -> String {
    let mut page = String::new();
    let mut at = 0;
    for (block, shown) in blocks.iter().zip(shown) {
        page.push_str(&text[at..block.place.start]);
        page.push_str(shown);
        at = block.place.end;
    }
    page + &text[at..]
}

/// The pictures of the page that are not what its commands drew, or writes them.
fn pictures(path: &Path, page: &Page, folder: &Path) -> impl Iterator<Item = String> {
    let beside = path.parent().unwrap().to_owned();
    let drawn = page.links.iter().filter(|link| link.is_picture && !link.title.is_empty());
    drawn.filter_map(move |link| {
        let picture = beside.join(&link.target);
        let Ok(drawn) = fs::read(folder.join(&link.title)) else {
            return Some(format!("no command wrote {}", link.title));
        };
        if overwrites() {
            fs::write(&picture, &drawn).unwrap();
        }
        let is_same = fs::read(&picture).is_ok_and(|shown| shown == drawn);
        (!is_same).then(|| format!("{} is not the {} that the commands wrote", link.target, link.title))
    })
}

#[test]
fn a_page_shows_the_output_of_its_commands_but_for_names_and_figures_of_the_machine() {
    assert_eq!(matched("folder runs/a-xxxxxx\n", "folder runs/a-k3x9ab\n"), "folder runs/a-xxxxxx\n");
    assert_eq!(matched("one\n...\nfour [..] s\n", "one\n2\n3\nfour 4.1 s\n"), "one\n...\nfour [..] s\n");
    assert_eq!(matched("one\n...\nfour [..] s\n", "one\n2\n3\nfive 4.1 s\n"), "one\n2\n3\nfive 4.1 s\n");
    assert_eq!(matched("error 3\n", "error 4\n"), "error 4\n");
}

#[test]
fn commands_have_their_output_and_their_exit_code() {
    let text = "```console\n$ printf '%s\\n' a \\\n> b\na\nb\n$ false\n$ echo $?\n1\n```\n";
    let page = Page::parse(text);
    let examples = examples(&page.blocks);
    let folder = tempfile::tempdir().unwrap();
    let outputs = outputs(&page.blocks, &examples, folder.path());
    assert_eq!(outputs, [("a\nb\n".into(), 0), (String::new(), 1), ("1\n".into(), 0)]);
    assert_eq!(shown(&page.blocks, &examples, &outputs), [page.blocks[0].text.clone()]);
    assert_eq!(unannounced(&examples, &outputs).count(), 0);
    assert_eq!(unannounced(&examples[..2], &outputs[..2]).count(), 1);
}
