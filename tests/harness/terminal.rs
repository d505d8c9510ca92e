//! A terminal for the command under test: a pseudo-terminal, and what a person would see on it.

use super::{ringwing, wait_until};
use rustix::{
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
    termios::{Termios, Winsize, tcgetattr, tcsetwinsize},
};
use std::{
    fs::{File, OpenOptions},
    io::{Read, Write},
    num::NonZero,
    process::{Child, Command, ExitStatus},
    sync::{Arc, Mutex},
    thread,
};

/// A terminal in which `ringwing` runs.
pub struct Terminal {
    keyboard: File,
    screen: Arc<Mutex<vt100::Parser>>,
    /// The command's end of the terminal, to ask for its settings.
    inside: File,
    before: Termios,
    child: Child,
}

impl Terminal {
    /// Starts `ringwing` with `arguments` in a terminal of this size.
    pub fn start(arguments: &[&str], columns: u16, rows: u16, variables: &[(&str, &str)]) -> Self {
        let outside = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
        grantpt(&outside).and_then(|()| unlockpt(&outside)).expect("its other end");
        let name = ptsname(&outside, Vec::new()).expect("its name").into_string().expect("UTF-8");
        let inside = OpenOptions::new().read(true).write(true).open(name).expect("its other end opens");
        let mut keyboard = File::from(outside);
        resize(&keyboard, columns, rows);
        let before = tcgetattr(&inside).expect("a terminal");
        // `setsid --ctty` makes it the terminal of the command, which then hears of new sizes.
        let mut command = Command::new("setsid");
        let own = ringwing();
        command.args(["--ctty", "--wait"]).arg(own.get_program()).args(own.get_args()).args(arguments);
        let end = || inside.try_clone().expect("a descriptor");
        command.envs(own.get_envs().filter_map(|(name, value)| Some((name, value?))));
        command.envs(variables.iter().copied()).stdin(end()).stdout(end()).stderr(end());
        let child = command.spawn().expect("ringwing starts");
        let screen = Arc::new(Mutex::new(vt100::Parser::new(size(rows), size(columns), 0)));
        let (shown, mut output) = (Arc::clone(&screen), keyboard.try_clone().expect("a descriptor"));
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count) = output.read(&mut bytes)
                && count > 0
            {
                shown.lock().expect("the screen").process(&bytes[..count]);
            }
        });
        keyboard.flush().expect("a terminal");
        Self { keyboard, screen, inside, before, child }
    }

    /// The process id of the command.
    pub fn process(&self) -> u32 {
        // `setsid` forks if it leads a process group; then the command is its child.
        let id = self.child.id();
        let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children"));
        children.ok().and_then(|text| text.split(' ').next()?.parse().ok()).unwrap_or(id)
    }

    /// Types `keys`.
    pub fn type_keys(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).expect("the terminal takes keys");
    }

    /// Gives the terminal another size.
    pub fn resize(&mut self, columns: u16, rows: u16) {
        self.screen.lock().expect("the screen").screen_mut().set_size(size(rows), size(columns));
        resize(&self.keyboard, columns, rows);
    }

    /// What is on the screen, line by line.
    pub fn text(&self) -> String {
        self.screen.lock().expect("the screen").screen().contents()
    }

    /// What has been on the screen in colours.
    pub fn has_colours(&self) -> bool {
        let screen = self.screen.lock().expect("the screen");
        let screen = screen.screen();
        let (rows, columns) = screen.size();
        let mut cells = (0..rows.get()).flat_map(|row| (0..columns.get()).map(move |column| (row, column)));
        cells.any(|(row, column)| {
            screen.cell(row, column).is_some_and(|cell| cell.fgcolor() != vt100::Color::Default)
        })
    }

    /// Waits until the screen shows what `is_there` looks for; returns the screen.
    pub fn wait_for(&self, what: &str, is_there: impl Fn(&str) -> bool) -> String {
        let last = std::cell::RefCell::new(String::new());
        // The panic of `wait_until` does not show the screen, which is what tells why the test fails.
        let shown = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            wait_until(what, || {
                let text = self.text();
                last.borrow_mut().clone_from(&text);
                is_there(&text).then_some(text)
            })
        }));
        shown.unwrap_or_else(|_| panic!("waited until {what}; the screen shows:\n{}", last.borrow()))
    }

    /// Waits until the command has ended; asserts that the terminal is as it was before.
    pub fn wait_for_end(&mut self) -> ExitStatus {
        let status = wait_until("the command ends", || self.child.try_wait().expect("a child"));
        // The thread that reads the screen may be behind the command, so wait here too.
        wait_until("the terminal is given back", || {
            let now = tcgetattr(&self.inside).expect("a terminal");
            let is_same = now.local_modes == self.before.local_modes
                && now.input_modes == self.before.input_modes
                && now.output_modes == self.before.output_modes;
            let screen = self.screen.lock().expect("the screen");
            (is_same && !screen.screen().alternate_screen() && !screen.screen().hide_cursor()).then_some(())
        });
        status
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// As many rows or columns, which a terminal always has.
fn size(count: u16) -> NonZero<u16> {
    NonZero::new(count).expect("a terminal has rows and columns")
}

fn resize(terminal: &File, columns: u16, rows: u16) {
    let size = Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(terminal, size).expect("a terminal has a size");
}
