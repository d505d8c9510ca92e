//! `ringwing watch`: shows a live run, or a log as it was flown, in the terminal.
//!
//! A live run is watched as its viewer watches it, by a subscription of its own. So it needs no `--live` server, and nobody waits
//! for it.
//!
//! Must never change a flight, except as the user asks for it and confirms. Must always give the terminal back.

mod feed;
mod live;
mod model;
mod paint;
mod played;
mod prompt;
mod ring;
mod view;

use crate::{
    WrongUsage, config, live_run,
    output::{self, tell},
};
use feed::Feed;
use live::LiveFeed;
use model::Model;
use played::PlayedLog;
use prompt::{Prompt, Wish};
use ratatui::{
    DefaultTerminal,
    crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers},
};
use ringwing_bus::{Domain, DomainId, StopFlag, domain};
use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, SystemTime},
};

/// The longest wait for a key between two pictures. Longer makes the picture jerk; shorter takes the processor from the flight.
const REFRESH: Duration = Duration::from_millis(50);

/// What to watch.
#[derive(Debug, clap::Args)]
pub(crate) struct WatchArgs {
    /// Domain of a live run, the folder of a run, a log, or `latest`; without it, the newest live run, or else the newest log
    #[arg(value_name = "RUN")]
    run: Option<PathBuf>,
}

/// Shows the run until the user quits, or until it is over.
pub(crate) fn run(args: &WatchArgs) -> anyhow::Result<ExitCode> {
    if !(io::stdout().is_terminal() && io::stdin().is_terminal()) {
        return Err(WrongUsage("watch needs a terminal; `ringwing review` prints a log".into()).into());
    }
    let stop = StopFlag::on_signals()?;
    // Before the terminal changes: whoever names no run gets an error as from every other verb.
    let (feed, scenario) = open(args.run.as_deref())?;
    let is_coloured = output::is_coloured(&io::stdout());
    let mut watch = Watch { feed, model: Model::new(scenario, is_coloured), prompt: Prompt::default() };
    // The closure owns the screen, so the terminal is given back before an error or the last words are printed.
    let shown = Screen::enter().and_then(|mut screen| watch.show(&mut screen.0, &stop));
    shown?;
    tell(&watch.model.last_words());
    Ok(ExitCode::SUCCESS)
}

/// The run that `name` stands for, and its scenario.
fn open(name: Option<&Path>) -> anyhow::Result<(Feed, ringwing_scenario::Scenario)> {
    // Look for a live run first: its folder may have a log already, which still grows.
    let live = match name {
        Some(name) => live_domain(name),
        None => domain::all().into_iter().filter(is_live).max_by_key(begun),
    };
    if let Some(id) = live {
        let (feed, scenario) = LiveFeed::open(&id)?;
        return Ok((Feed::Live(Box::new(feed)), scenario));
    }
    let log = config::log(name.unwrap_or(Path::new("latest")));
    let (feed, scenario) = PlayedLog::open(&log)?;
    Ok((Feed::Log(Box::new(feed)), scenario))
}

/// The domain of the live run that `name` stands for, if there is one.
fn live_domain(name: &Path) -> Option<DomainId> {
    live_run::domain(name.to_str()?).ok().filter(is_live)
}

fn is_live(id: &DomainId) -> bool {
    // A domain outlives a killed launcher until the next run or `ringwing clean` removes it.
    Domain::join(id).is_ok_and(|domain| domain.has_launcher())
}

/// When the run began: its socket was made then.
fn begun(id: &DomainId) -> Option<SystemTime> {
    Domain::join(id).ok()?.request_path().metadata().ok()?.modified().ok()
}

/// The terminal while it shows pictures. Gives it back when dropped; if the program panics, `ratatui` does.
struct Screen(DefaultTerminal);

impl Screen {
    fn enter() -> io::Result<Self> {
        ratatui::try_init().map(Self)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// What is watched, and how far the user has come with a wish.
struct Watch {
    feed: Feed,
    model: Model,
    prompt: Prompt,
}

impl Watch {
    /// Shows one picture after the other until the user or a signal ends it, or the run is over.
    fn show(&mut self, terminal: &mut DefaultTerminal, stop: &StopFlag) -> io::Result<()> {
        while !stop.is_set() {
            // Ask before fetching, so that the last picture shows everything.
            let is_over = self.feed.is_over();
            if let Err(problem) = self.feed.fetch(&mut self.model) {
                self.model.set_notice(&problem);
            }
            terminal.draw(|frame| view::draw(frame, &self.model, &self.prompt))?;
            if is_over {
                self.model.note_over();
                return Ok(());
            }
            let mut is_waiting = event::poll(REFRESH)?;
            // Take all keys that wait before the next picture: at one a picture, a pasted fault would come in slowly.
            while is_waiting {
                // A new size needs no care: every picture is drawn for the size of the moment.
                if let Event::Key(key) = event::read()?
                    && key.kind != KeyEventKind::Release
                    && self.on_key(key)
                {
                    return Ok(());
                }
                is_waiting = event::poll(Duration::ZERO)?;
            }
        }
        Ok(())
    }

    /// Does what a key asks for; returns whether the user quits.
    fn on_key(&mut self, key: KeyEvent) -> bool {
        let has_control = key.modifiers.contains(KeyModifiers::CONTROL);
        // The terminal is in raw mode, where Ctrl-C is a key and sends no signal.
        if has_control {
            return matches!(key.code, KeyCode::Char('c' | 'd'));
        }
        if self.prompt.is_open() {
            if let Some(wish) = self.prompt.on_key(key.code) {
                self.feed.ask(wish, &mut self.model);
            }
            return false;
        }
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => return true,
            KeyCode::Char('f') => self.prompt.open(),
            KeyCode::Char('p' | ' ') => self.feed.ask(Wish::Toggle, &mut self.model),
            KeyCode::Char('s') => self.feed.ask(Wish::Step(1), &mut self.model),
            KeyCode::Char('S') => self.feed.ask(Wish::Step(self.model.ticks_per_s()), &mut self.model),
            KeyCode::Char('+') => self.feed.ask(Wish::Faster, &mut self.model),
            KeyCode::Char('-') => self.feed.ask(Wish::Slower, &mut self.model),
            KeyCode::Down => self.model.scroll(1),
            KeyCode::Up => self.model.scroll(-1),
            _ => {}
        }
        false
    }
}
