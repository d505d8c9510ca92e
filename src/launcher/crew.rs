//! The processes of a run: who is there, in what state, and who should be.

use super::{LaunchError, Plan};
use ringwing_bench::MeasureArgs;
use ringwing_bus::{DomainId, Placement, member::is_running};
use ringwing_flight::{Part, Roster, Tick, UavId};
use ringwing_scenario::{Scenario, fault::schedule::Act};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    os::unix::process::CommandExt,
    path::PathBuf,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

/// How many times as long as a start the copy of a log may take.
const LONGEST_COPY: u32 = 30;

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// By itself, with this status.
    Exited(i32),
    /// By this signal.
    Killed(i32),
    /// It was not our child: its end was seen, but not how.
    Unknown,
}

impl End {
    /// Whether it gave up with an error; a successor would meet the same.
    pub(crate) fn is_failure(self) -> bool {
        matches!(self, Self::Exited(status) if status != 0)
    }
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exited(0) => f.write_str("has left"),
            Self::Exited(status) => write!(f, "gave up (exit status {status})"),
            Self::Killed(signal) => write!(f, "was killed by signal {signal}"),
            Self::Unknown => f.write_str("has ended"),
        }
    }
}

/// Where a process is between its start and its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    /// Spawned or awaited, not ready yet.
    Starting,
    /// Ready.
    Ready,
    /// Not there.
    Gone,
}

#[derive(Debug)]
struct Station {
    state: State,
    /// Stopped by a signal, in whatever state.
    frozen: bool,
    /// When `state` or `frozen` changed last.
    since: Instant,
    process: Option<u32>,
    adopted: bool,
    replacements: u32,
    /// It is gone, going or stopped because somebody asked for that.
    asked: Option<Act>,
    /// It was thawed, and not started anew since.
    thawed: bool,
}

/// All processes of a run.
#[derive(Debug)]
pub(super) struct Crew {
    stations: BTreeMap<Part, Station>,
    domain: DomainId,
    uavs: u32,
    log: Option<PathBuf>,
    timing: bool,
    by_hand: BTreeSet<Part>,
    measure: Option<MeasureArgs>,
    placement: Placement,
    start_timeout: Duration,
    freeze_timeout: Duration,
    roster: Roster,
    /// No tick from this one on is free to be opened.
    free_before: Tick,
    failures: Vec<String>,
}

impl Crew {
    pub(super) fn new(scenario: &Scenario, domain: &DomainId, log: Option<PathBuf>, plan: &Plan) -> Self {
        let is_wanted = |part| part != Part::Recorder || plan.recorder;
        let station = |part| Station {
            state: if is_wanted(part) { State::Starting } else { State::Gone },
            frozen: false,
            since: Instant::now(),
            process: None,
            adopted: false,
            replacements: 0,
            asked: None,
            thawed: false,
        };
        Self {
            stations: Part::all(scenario.formation.uavs).map(|part| (part, station(part))).collect(),
            domain: domain.clone(),
            uavs: scenario.formation.uavs,
            log,
            timing: plan.timing,
            by_hand: plan.by_hand.clone(),
            measure: plan.measure.clone(),
            placement: plan.placement.clone(),
            start_timeout: Duration::from_secs_f64(scenario.supervision.start_timeout_s),
            freeze_timeout: Duration::from_secs_f64(scenario.supervision.answer_timeout_s),
            roster: Roster::empty(),
            free_before: Roster::empty().free_before,
            failures: Vec::new(),
        }
    }

    /// The arguments of the process `part`.
    fn arguments(&self, part: Part) -> Vec<String> {
        let domain = ["--domain".to_owned(), self.domain.to_string()];
        let mut arguments: Vec<String> = match part {
            Part::World => vec!["world".into()],
            Part::Leader => vec!["leader".into()],
            Part::Recorder => vec!["recorder".into()],
            Part::Agent(uav) => vec!["agent".into(), "--uav".into(), uav.0.to_string()],
        };
        arguments.extend(domain);
        if let (Part::Recorder, Some(log)) = (part, &self.log) {
            arguments.extend(["--log".into(), log.display().to_string()]);
            arguments.extend((!self.timing).then(|| "--no-timing".into()));
        }
        if let (Part::World, Some(measure)) = (part, &self.measure) {
            arguments.extend(measure.to_arguments());
        }
        arguments
    }

    /// What a user types to start `part` by hand.
    pub(super) fn command_line(&self, part: Part) -> String {
        format!("ringwing {}", self.arguments(part).join(" "))
    }

    pub(super) fn spawn_all(&mut self) -> Result<(), LaunchError> {
        let ours: Vec<Part> = self
            .stations
            .iter()
            .filter(|(part, station)| station.state == State::Starting && !self.by_hand.contains(part))
            .map(|(part, _)| *part)
            .collect();
        ours.into_iter().try_for_each(|part| self.spawn(part))
    }

    fn spawn(&mut self, part: Part) -> Result<(), LaunchError> {
        // Not the path of this program: the file may be replaced by a new build while the run goes on.
        let mut command = Command::new("/proc/self/exe");
        command
            .arg0("ringwing")
            .args(self.arguments(part))
            .args(["--launcher", &std::process::id().to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            // A group of its own: the terminal's Ctrl-C is for the launcher, which ends the others in order.
            .process_group(0);
        let child = self
            .placement
            .start(part.index(), || command.spawn())
            .map_err(|source| LaunchError::Spawn { what: part.to_string(), source })?;
        let station = self.station(part);
        (station.state, station.since) = (State::Starting, Instant::now());
        (station.frozen, station.adopted, station.thawed) = (false, false, false);
        station.process = Some(child.id());
        Ok(())
    }

    pub(super) fn respawn(&mut self, part: Part) -> Result<(), LaunchError> {
        self.station(part).replacements += 1;
        self.spawn(part)
    }

    fn station(&mut self, part: Part) -> &mut Station {
        self.stations.get_mut(&part).expect("every part of the scenario has a station")
    }

    pub(super) fn replacements(&self, part: Part) -> u32 {
        self.stations[&part].replacements
    }

    pub(super) fn part_of(&self, pid: u32) -> Option<Part> {
        self.stations.iter().find(|(_, station)| station.process == Some(pid)).map(|(part, _)| *part)
    }

    pub(super) fn is_any(&self, state: State) -> bool {
        self.stations.values().any(|station| station.state == state)
    }

    pub(super) fn is_any_running(&self) -> bool {
        self.stations.values().any(|station| station.process.is_some())
    }

    pub(super) fn is_adopted(&self, part: Part) -> bool {
        self.stations[&part].adopted
    }

    pub(super) fn running_names(&self) -> String {
        let running = self.stations.iter().filter(|(_, station)| station.process.is_some());
        running.map(|(part, _)| part.to_string()).collect::<Vec<_>>().join(", ")
    }

    /// Whether there is a world, or one is to come.
    pub(super) fn has_world(&self) -> bool {
        self.stations[&Part::World].state != State::Gone
    }

    /// Whether the flight has begun.
    pub(super) fn is_flying(&self) -> bool {
        self.roster.revision > 0
    }

    pub(super) fn set_frozen(&mut self, part: Part, frozen: bool) {
        let station = self.station(part);
        (station.frozen, station.since) = (frozen, Instant::now());
    }

    /// Why `act` cannot be done to `part` now, if it cannot.
    pub(super) fn refusal(&self, part: Part, act: Act) -> Option<&'static str> {
        let station = &self.stations[&part];
        match (act, station.process.is_some(), station.frozen) {
            (Act::Start, true, _) => Some("is there already"),
            (Act::Start, false, _) => self.by_hand.contains(&part).then_some("is started by hand"),
            (_, false, _) => Some("is gone already"),
            (Act::Freeze | Act::Thaw, ..) if station.adopted => {
                Some("was started by hand, and is not seen to freeze")
            }
            (Act::Thaw, true, false) => Some("is not frozen"),
            (Act::Freeze, true, true) => Some("is frozen already"),
            (Act::Stop, true, true) => Some("is frozen: thaw or kill it"),
            _ => None,
        }
    }

    /// Does `act` to `part`; that it is done shows later.
    pub(super) fn meet(&mut self, part: Part, act: Act) -> Result<(), LaunchError> {
        let signal = match act {
            Act::Start => {
                self.station(part).asked = None;
                return self.spawn(part);
            }
            Act::Kill { .. } => Signal::KILL,
            Act::Stop => Signal::TERM,
            Act::Freeze => Signal::STOP,
            Act::Thaw => Signal::CONT,
        };
        self.station(part).asked = (act != Act::Thaw).then_some(act);
        self.station(part).thawed |= act == Act::Thaw;
        self.send(part, signal);
        Ok(())
    }

    /// Whether `act` shows in `part`.
    pub(super) fn has_met(&self, part: Part, act: Act) -> bool {
        let station = &self.stations[&part];
        match act {
            Act::Kill { .. } | Act::Stop => station.process.is_none() || self.asked(part).is_none(),
            Act::Freeze => station.frozen || station.process.is_none(),
            Act::Thaw => !station.frozen,
            Act::Start => station.state != State::Starting,
        }
    }

    /// What was asked to be done to `part`, and lasts.
    pub(super) fn asked(&self, part: Part) -> Option<Act> {
        self.stations[&part].asked
    }

    /// Nothing that was asked for lasts any longer for `part`.
    pub(super) fn forget_asked(&mut self, part: Part) {
        self.station(part).asked = None;
    }

    /// No tick from this one on is free to be opened, from the next roster on.
    pub(super) fn set_free_before(&mut self, tick: Tick) {
        self.free_before = tick;
    }

    /// Kills whoever is frozen: nobody else can end it. Returns who could not leave in order.
    pub(super) fn kill_frozen(&mut self) -> Vec<Part> {
        let frozen = self.stations.iter().filter(|(_, station)| station.frozen && station.process.is_some());
        let frozen: Vec<Part> = frozen.map(|(part, _)| *part).collect();
        for part in &frozen {
            self.kill(*part);
        }
        frozen
    }

    /// Notes the end of `part`; returns whether it had been ready.
    pub(super) fn set_ended(&mut self, part: Part) -> bool {
        let station = self.station(part);
        let was_ready = station.state != State::Starting;
        (station.state, station.frozen, station.process) = (State::Gone, false, None);
        was_ready
    }

    /// Notes who says to be ready; returns who is so since the last call.
    pub(super) fn note_attendance(&mut self, attendant: impl Fn(Part) -> Option<u32>) -> Vec<Part> {
        let mut ready = Vec::new();
        for (part, station) in &mut self.stations {
            let waiting = matches!(station.state, State::Starting | State::Gone);
            let Some(pid) = attendant(*part).filter(|_| waiting) else { continue };
            let is_ours = station.process == Some(pid);
            if is_ours || (station.process.is_none() && is_running(pid)) {
                station.adopted = !is_ours;
                (station.state, station.process) = (State::Ready, Some(pid));
                ready.push(*part);
            }
        }
        ready
    }

    /// Processes that take too long to start, or are frozen for too long where the run cannot do without them.
    pub(super) fn overdue(&self) -> Vec<(Part, &'static str)> {
        let judge = |(part, station): (&Part, &Station)| {
            let spent = station.since.elapsed();
            let is_needed = matches!(part, Part::World | Part::Leader);
            if station.state == State::Starting
                && station.process.is_some()
                && spent > self.start_limit(*part)
            {
                Some((*part, "was not ready in time"))
            } else if station.frozen
                && station.asked.is_none()
                && station.state == State::Ready
                && is_needed
                && spent > self.freeze_timeout
            {
                Some((*part, "stayed frozen for too long"))
            } else {
                None
            }
        };
        self.stations.iter().filter_map(judge).collect()
    }

    /// How long `part` may take to become ready. A recorder that takes over copies a log first.
    fn start_limit(&self, part: Part) -> Duration {
        let station = &self.stations[&part];
        let copies = part == Part::Recorder && station.replacements > 0 && !station.frozen;
        self.start_timeout * if copies { LONGEST_COPY } else { 1 }
    }

    pub(super) fn kill(&mut self, part: Part) {
        self.send(part, Signal::KILL);
    }

    fn send(&mut self, part: Part, signal: Signal) {
        if let Some(pid) = self.stations[&part].process.and_then(|pid| Pid::from_raw(pid.cast_signed())) {
            // It may have ended at this moment; then its end is on its way to us.
            let _ = kill_process(pid, signal);
            self.station(part).since = Instant::now();
        }
    }

    pub(super) fn kill_all(&mut self) {
        let everybody: Vec<Part> = self.stations.keys().copied().collect();
        for part in everybody {
            self.kill(part);
        }
    }

    /// Who runs now, for the world.
    pub(super) fn next_roster(&mut self) -> Roster {
        let runs = |part: Part| self.stations[&part].state == State::Ready && !self.stations[&part].frozen;
        let mut roster = Roster::empty();
        roster.revision = self.roster.revision + 1;
        roster.leader = runs(Part::Leader);
        let recorder = &self.stations[&Part::Recorder];
        // A frozen recorder still has its buffers: the world waits for it as for one that lags, unless it was asked for.
        roster.recorder = recorder.state == State::Ready && !(recorder.frozen && recorder.asked.is_some());
        let leader = &self.stations[&Part::Leader];
        roster.hold = (!roster.leader && leader.asked.is_none()) || recorder.state == State::Starting;
        (roster.free_before, roster.leader_thawed) = (self.free_before, leader.thawed);
        for uav in UavId::all(self.uavs) {
            roster.set(uav, runs(Part::Agent(uav)));
            roster.set_thawed(uav, self.stations[&Part::Agent(uav)].thawed);
        }
        self.roster = roster;
        roster
    }

    pub(super) fn remember_failure(&mut self, failure: String) {
        self.failures.push(failure);
    }

    pub(super) fn take_failures(&mut self) -> Vec<String> {
        std::mem::take(&mut self.failures)
    }
}
