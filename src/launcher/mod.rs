//! Starts the processes of a run, watches over them, and cleans up after them.
//!
//! Never flies, and never touches a sample on the tick path.

mod crew;
mod faults;
mod janitor;
mod notice;
mod progress;

use crew::{Crew, End, State};
use faults::Agenda;
use janitor::Janitor;
use notice::{Change, Desk, Notice};
use progress::Progress;
use ringwing_bench::MeasureArgs;
use ringwing_bus::{
    BusError, Domain, Gate, Placement, Publisher, Stamps, Subscriber, channel, domain::DomainOwner,
    member::create_node, report,
};
use ringwing_flight::{Event, FormationError, Level, Part, Roster, Tick, WorldReport};
use ringwing_recorder::RecorderReport;
use ringwing_scenario::{Scenario, Wake, fault::schedule::Act};
use std::{
    collections::BTreeSet,
    io,
    path::PathBuf,
    time::{Duration, Instant},
};

/// What to launch.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
pub(crate) struct Plan {
    /// The scenario to fly, validated.
    pub(crate) scenario: Scenario,
    /// The folder that the run's own folder is made in.
    pub(crate) out: PathBuf,
    /// Write a log.
    pub(crate) record: bool,
    /// Put wall-clock timing into the log.
    pub(crate) timing: bool,
    /// Parts that the user starts.
    pub(crate) by_hand: BTreeSet<Part>,
    /// Say what goes on.
    pub(crate) quiet: bool,
    /// Start a recorder; without one nothing is known of the flight.
    pub(crate) recorder: bool,
    /// What the world measures of itself.
    pub(crate) measure: Option<MeasureArgs>,
    /// Where and how urgently the processes run.
    pub(crate) placement: Placement,
}

/// How a run went.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// The run's folder.
    pub(crate) folder: PathBuf,
    /// What the world saw; `None` if it died.
    pub(crate) world: Option<WorldReport>,
    /// What the recorder measured; `None` if it left no report.
    pub(crate) recorder: Option<RecorderReport>,
    /// Why the run failed, if it did.
    pub(crate) failures: Vec<String>,
    /// Simulated time flown.
    pub(crate) ticks: i64,
    /// Wall-clock time from the first tick to the last.
    pub(crate) flight_time: Duration,
    /// Wall-clock time from the command to the first tick.
    pub(crate) start_time: Duration,
}

/// Why a run cannot begin.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LaunchError {
    /// The run's folder cannot be made or written.
    #[error("{}: cannot be written: {source}; choose another folder with --out", path.display())]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The domain cannot be made.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A process or thread cannot be started.
    #[error("{what} cannot be started: {source}")]
    Spawn {
        /// The process or thread.
        what: String,
        /// The operating system's reason.
        source: io::Error,
    },
}

/// Name of the log in the run's folder.
pub(crate) const LOG: &str = "run.mcap";
/// Longest wait for news before looking at the gate again; short while everybody starts.
const LOOK_AGAIN_AT_START: Duration = Duration::from_millis(1);
const LOOK_AGAIN: Duration = Duration::from_millis(20);
/// How long processes may take to leave once the flight is over.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(10);

/// Flies `plan` to its end, whatever that is.
pub(crate) fn launch(plan: &Plan) -> Result<Outcome, LaunchError> {
    let begin = Instant::now();
    // First of all: an interrupt from here on is noticed, and ends the run in order.
    let desk = Desk::open()?;
    ringwing_bus::domain::remove_abandoned();
    let resolved = plan.scenario.to_toml();
    let (owner, gate) = DomainOwner::create(&resolved)?;
    let folder = make_folder(plan, owner.domain(), &resolved)?;
    let node = create_node(owner.domain(), "launcher")?;
    let Scenario { ipc, formation, .. } = &plan.scenario;
    let events = ipc.wake == Wake::Event;
    let _services = channel::Services::create(&node, formation.uavs, events, ipc.payload_bytes > 0)?;
    let wires = Wires::open(&node)?;
    let janitor = Janitor::start(owner.domain())?;
    let log = plan.record.then(|| folder.join(LOG));
    let crew = Crew::new(&plan.scenario, owner.domain().id(), log, plan);
    let progress = Progress::new(&plan.scenario, plan.quiet);
    desk.watch_requests(&owner.domain().request_path())?;
    if !plan.scenario.time.real_time {
        desk.watch_holds(owner.domain().gate()?)?;
    }
    let mut launcher = Launcher {
        plan,
        domain: owner.domain(),
        agenda: Agenda::new(&plan.scenario),
        gate,
        wires,
        desk,
        janitor,
        crew,
        progress,
        failures: Vec::new(),
        interrupted: false,
        started: false,
    };
    launcher.say_where(&folder);
    let flown = launcher.run(begin);
    let outcome = launcher.outcome(folder, &flown);
    launcher.janitor.stop();
    outcome
}

/// Makes `<out>/<name>-<domain>/` with the resolved scenario and what `iox2` needs to look in.
fn make_folder(plan: &Plan, domain: &Domain, resolved: &str) -> Result<PathBuf, LaunchError> {
    let folder = plan.out.join(format!("{}-{}", plan.scenario.name, domain.id()));
    let write = |path: PathBuf, text: &str| {
        std::fs::write(&path, text).map_err(|source| LaunchError::Folder { path, source })
    };
    let config = folder.join("config");
    std::fs::create_dir_all(&config)
        .map_err(|source| LaunchError::Folder { path: folder.clone(), source })?;
    write(folder.join("scenario.toml"), resolved)?;
    write(config.join("iceoryx2.toml"), &domain.iox2_config())?;
    Ok(folder)
}

/// The launcher's own ends of the services.
struct Wires {
    roster: Publisher<Roster>,
    events: Publisher<Event>,
    world_events: Subscriber<Event>,
    formation_error: Subscriber<FormationError>,
}

impl Wires {
    fn open(node: &iceoryx2::node::Node<iceoryx2::prelude::ipc::Service>) -> Result<Self, BusError> {
        Ok(Self {
            roster: channel::roster().publisher(node)?,
            events: channel::launcher_events().publisher(node)?,
            world_events: channel::world_events().subscriber(node, channel::RECORDER_DEPTH)?,
            formation_error: channel::formation_error().subscriber(node, 1)?,
        })
    }
}

struct Launcher<'a> {
    plan: &'a Plan,
    domain: &'a Domain,
    agenda: Agenda,
    gate: Gate,
    wires: Wires,
    desk: Desk,
    janitor: Janitor,
    crew: Crew,
    progress: Progress,
    failures: Vec<String>,
    interrupted: bool,
    /// All processes were ready or lost once: the flight may begin.
    started: bool,
}

/// How long starting and flying took.
struct Flown {
    start_time: Duration,
    flight_time: Duration,
}

impl Launcher<'_> {
    fn say_where(&self, folder: &std::path::Path) {
        self.progress.say(&format!("domain {}, folder {}", self.domain.id(), folder.display()));
        for part in &self.plan.by_hand {
            self.progress.say(&format!("waiting for: {}", self.crew.command_line(*part)));
        }
    }

    /// From the first process to the last; whatever fails on the way is in `failures`.
    fn run(&mut self, begin: Instant) -> Flown {
        let mut flown = Flown { start_time: Duration::ZERO, flight_time: Duration::ZERO };
        let result = self.start_everybody().and_then(|()| {
            flown.start_time = begin.elapsed();
            let took_off = Instant::now();
            let result = self.watch_flight();
            flown.flight_time = took_off.elapsed();
            result
        });
        if let Err(error) = result {
            self.failures.push(error.to_string());
        }
        // The world must not go on at a closed gate.
        self.gate.request_stop();
        self.gate.close();
        if let Err(error) = self.see_everybody_out() {
            self.failures.push(error.to_string());
        }
        self.progress.finish();
        flown
    }

    /// Starts all processes and waits until each is ready or lost.
    fn start_everybody(&mut self) -> Result<(), LaunchError> {
        self.crew.spawn_all()?;
        while self.crew.is_any(State::Starting) && !self.is_over() {
            self.look(LOOK_AGAIN_AT_START)?;
        }
        self.started = true;
        self.crew.set_free_before(self.free_before());
        self.publish_roster()
    }

    fn watch_flight(&mut self) -> Result<(), LaunchError> {
        while !self.is_over() {
            let busy = self.crew.is_any(State::Starting) || self.agenda.is_busy();
            self.look(if busy { LOOK_AGAIN_AT_START } else { LOOK_AGAIN })?;
            self.meet_faults()?;
            self.progress.show(self.gate.tick());
        }
        Ok(())
    }

    /// Waits until all have left by themselves, and ends those that do not.
    fn see_everybody_out(&mut self) -> Result<(), LaunchError> {
        let since = Instant::now();
        let mut killed = false;
        while self.crew.is_any_running() {
            for part in self.crew.kill_frozen() {
                self.progress.say(&format!("{part} was still frozen at the end; killed"));
            }
            if since.elapsed() > LEAVE_TIMEOUT && !killed {
                killed = true;
                self.failures.push(format!("{} did not leave and was killed", self.crew.running_names()));
                self.crew.kill_all();
            }
            self.look(LOOK_AGAIN_AT_START)?;
        }
        self.hear_events()
    }

    fn is_over(&self) -> bool {
        self.gate.is_closed() || !self.failures.is_empty() || !self.crew.has_world()
    }

    /// Takes in what happened, and does what it asks for.
    fn look(&mut self, pause: Duration) -> Result<(), LaunchError> {
        match self.desk.next(pause) {
            Some(Notice::Process { pid, change }) => self.note_change(pid, change)?,
            Some(Notice::Interrupt) => self.interrupt()?,
            Some(Notice::Request(request)) => self.take_request(request)?,
            Some(Notice::Held) | None => {}
        }
        self.note_attendance()?;
        self.note_timeouts()?;
        self.hear_events()
    }

    fn interrupt(&mut self) -> Result<(), LaunchError> {
        if self.interrupted {
            self.failures.push("interrupted twice: processes killed".into());
            self.crew.kill_all();
            return Ok(());
        }
        self.interrupted = true;
        self.gate.request_stop();
        self.event(Level::Warning, "run.interrupted", "interrupted; ending the flight (once more: at once)")?;
        if !self.crew.is_flying() {
            self.failures.push("interrupted before the flight began".into());
        }
        Ok(())
    }

    fn note_change(&mut self, pid: u32, change: Change) -> Result<(), LaunchError> {
        let Some(part) = self.crew.part_of(pid) else { return Ok(()) };
        match change {
            Change::Ended(end) => self.note_end(part, end),
            Change::Frozen => {
                self.crew.set_frozen(part, true);
                if self.crew.asked(part).is_none() {
                    self.event(Level::Warning, "process.frozen", &format!("{part} is frozen (SIGSTOP)"))?;
                }
                self.publish_roster()
            }
            Change::Thawed => {
                self.crew.set_frozen(part, false);
                if !self.agenda.is_meeting(part) {
                    self.event(Level::Info, "process.thawed", &format!("{part} goes on (SIGCONT)"))?;
                }
                self.publish_roster()
            }
        }
    }

    fn note_end(&mut self, part: Part, end: End) -> Result<(), LaunchError> {
        self.gate.set_attendant(part, None);
        let asked = self.crew.asked(part).filter(|act| matches!(act, Act::Kill { .. } | Act::Stop));
        if asked.is_some() {
            self.agenda.clean_later(self.gate.tick());
        } else {
            self.janitor.call();
        }
        let was_ready = self.crew.set_ended(part);
        if self.gate.is_closed() || !self.failures.is_empty() {
            self.note_late_end(part, end);
            return Ok(());
        }
        if let Some(act) = asked {
            return self.note_asked_end(part, act);
        }
        match part {
            Part::World => self.failures.push(format!("the world {end}")),
            Part::Recorder if end.is_failure() => {
                self.fail_later(format!("the recorder {end}: the log is incomplete"));
            }
            Part::Leader | Part::Recorder => return self.replace(part, end),
            Part::Agent(_) => {
                let when = if was_ready { "" } else { " before the flight" };
                let text = format!("{part} {end}{when}; its airframe goes into its failsafe");
                self.event(Level::Error, "process.lost", &text)?;
            }
        }
        self.publish_roster()
    }

    /// A process that ends after the flight does so as planned, unless it says otherwise.
    fn note_late_end(&mut self, part: Part, end: End) {
        if part == Part::Recorder && !matches!(end, End::Exited(0) | End::Unknown) {
            self.fail_later(format!("the recorder {end} while it closed the log: the log is incomplete"));
        }
    }

    /// A failure that does not end the flight.
    fn fail_later(&mut self, failure: String) {
        self.progress.say(&failure);
        self.crew.remember_failure(failure);
    }

    /// Puts a new process in the place of a lost one; in lockstep no time passes meanwhile.
    fn replace(&mut self, part: Part, end: End) -> Result<(), LaunchError> {
        let limit = self.plan.scenario.supervision.replacements;
        if self.crew.replacements(part) >= limit {
            self.failures.push(format!("the {part} {end}, after {limit} replacements"));
            return Ok(());
        }
        self.event(Level::Error, "process.lost", &format!("the {part} {end}; a new one takes over"))?;
        self.crew.respawn(part)?;
        self.publish_roster()
    }

    /// Notes who has become ready, be it our child or a process that somebody started by hand.
    fn note_attendance(&mut self) -> Result<(), LaunchError> {
        let gate = &self.gate;
        let ready = self.crew.note_attendance(|part| gate.attendant(part));
        for part in &ready {
            if self.crew.is_adopted(*part) {
                let pid = self.gate.attendant(*part).unwrap_or_default();
                self.desk.watch(pid)?;
            }
            if self.crew.is_flying() && !self.agenda.is_meeting(*part) {
                self.event(Level::Info, "process.ready", &format!("{part} is ready"))?;
            }
        }
        if !ready.is_empty() && self.crew.is_flying() { self.publish_roster() } else { Ok(()) }
    }

    /// Ends processes that take too long to start, or stay frozen where nobody can do without them.
    fn note_timeouts(&mut self) -> Result<(), LaunchError> {
        for (part, what) in self.crew.overdue() {
            self.event(Level::Error, "process.overdue", &format!("{part} {what}; killed"))?;
            self.crew.kill(part);
        }
        Ok(())
    }

    /// Says who runs, once the flight may begin: with the first roster it does.
    fn publish_roster(&mut self) -> Result<(), LaunchError> {
        if !self.started {
            return Ok(());
        }
        let roster = self.crew.next_roster();
        self.wires.roster.send(roster, Stamps::now())?;
        self.gate.nudge_world();
        Ok(())
    }

    fn event(&mut self, level: Level, name: &str, text: &str) -> Result<(), LaunchError> {
        self.event_at(self.gate.tick().unwrap_or(Tick(0)), level, name, text)
    }

    fn event_at(&mut self, tick: Tick, level: Level, name: &str, text: &str) -> Result<(), LaunchError> {
        let event = Event::new(tick, level, name, text);
        self.progress.tell(&event);
        Ok(self.wires.events.send(event, Stamps::now())?)
    }

    fn hear_events(&mut self) -> Result<(), LaunchError> {
        let progress = &mut self.progress;
        self.wires.world_events.drain(|event, _| progress.tell(event))?;
        self.wires.formation_error.drain(|error, _| progress.note(error))?;
        Ok(())
    }

    /// What became of the run, from what its processes left.
    fn outcome(&mut self, folder: PathBuf, flown: &Flown) -> Result<Outcome, LaunchError> {
        let domain = self.domain;
        // Left by a recorder that was killed while it took over; the log itself is whole.
        let _ = std::fs::remove_file(folder.join(LOG).with_extension("mcap.part"));
        let world: Option<WorldReport> = domain.report(report::WORLD)?;
        let mut failures = std::mem::take(&mut self.failures);
        failures.append(&mut self.crew.take_failures());
        if failures.is_empty() && world.as_ref().is_none_or(|world| !world.complete) {
            let why = if self.interrupted {
                "interrupted before the end"
            } else {
                "the world ended the flight early"
            };
            failures.push(why.into());
        }
        Ok(Outcome {
            folder,
            recorder: domain.report(report::RECORDER)?,
            ticks: world.as_ref().map_or_else(|| self.progress.last_tick(), |world| world.last_tick),
            world,
            failures,
            flight_time: flown.flight_time,
            start_time: flown.start_time,
        })
    }
}
