//! The life of one process of a run, as a state machine: absent, starting, ready, frozen, asked to end, absent again.
//!
//! Must never start, signal or watch a process, and must never read a clock. Time comes in as an argument, counted
//! from any fixed moment. [`Effect`]s come out, and the supervisor carries them out.

mod effect;
mod input;
#[cfg(test)]
mod tests;

pub(super) use effect::{Effect, ProcessSignal};
pub(super) use input::Input;
use ringwing_flight::{AfterLoss, Event, Part, ProcessAction, ProcessEnd, ProcessState};
use std::time::Duration;

/// How many times the usual start limit a recorder may take: one that takes over copies its predecessor's log before
/// it is ready. A smaller factor kills recorders of long flights while they copy; a larger one notices a stuck
/// recorder later.
const START_LIMITS_PER_COPY: u32 = 30;
/// How long a process may be stopped, if no fault asked for that, before the run takes note. With a shorter time, a run that
/// was stopped as a whole flies on without those that wake last; with a longer one it waits longer for a frozen process.
const STOP_GRACE: Duration = Duration::from_millis(250);
/// The grace is at most one part in this many of the freeze limit: else the world gives up a leader that is to be replaced.
const STOP_GRACES_PER_LIMIT: u32 = 4;

/// How long the launcher waits for a process, and how often it replaces one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SupervisionLimits {
    /// How long a process may take to become ready.
    pub(super) start: Duration,
    /// How long the world or the leader may stay frozen if no fault asked for that.
    pub(super) freeze: Duration,
    /// How many times a lost leader or recorder is replaced.
    pub(super) replacements: u32,
}

/// The stage of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RunStage {
    /// The processes start; the world has no roster yet.
    Preparing,
    /// The world has a roster and flies.
    Flying,
    /// The flight has ended or failed. Processes now end because they should.
    Over,
}

/// A process of the run, whether it exists at the moment or not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Lifecycle {
    part: Part,
    limits: SupervisionLimits,
    is_by_hand: bool,
    phase: LifePhase,
    /// What a fault asked for, as long as it lasts.
    requested: Option<Requested>,
    /// An action that a fault asked for and that has not taken effect yet.
    pending: Option<ProcessAction>,
    replacements: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LifePhase {
    /// There is no process: not yet, no longer, or not at all in this run.
    Absent,
    /// There is no process yet; the user is to start it by hand.
    Awaited,
    /// The process opens its ports.
    Starting(LiveProcess),
    /// The process takes part, unless it is frozen.
    Ready(LiveProcess),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct LiveProcess {
    pid: u32,
    /// Started by hand: the launcher is not its parent.
    is_adopted: bool,
    /// Whether a signal has stopped it.
    halt: Halt,
    /// When it was last spawned, stopped, thawed or signalled. Its time limits count from this moment.
    since: Duration,
}

/// Whether a signal has stopped a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Halt {
    /// It runs.
    Runs,
    /// It has been stopped for a moment, perhaps with the whole run. The run still counts on it.
    Stopped,
    /// It is frozen: the run goes on without it.
    Frozen,
}

/// A fault's lasting effect on a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Requested {
    /// It ends, or has ended.
    End {
        /// The same fault starts it again later.
        returns: bool,
    },
    /// It stays frozen.
    Freeze,
}

impl LiveProcess {
    fn is_frozen(&self) -> bool {
        self.halt == Halt::Frozen
    }

    /// How long its time limits have counted at `now`.
    fn waited(&self, now: Duration) -> Duration {
        now.saturating_sub(self.since)
    }
}

impl Lifecycle {
    /// A process that has not been spawned yet, and will not be if the user starts it by hand.
    pub(super) fn new(part: Part, limits: SupervisionLimits, is_by_hand: bool) -> Self {
        let phase = if is_by_hand { LifePhase::Awaited } else { LifePhase::Absent };
        Self { part, limits, is_by_hand, phase, requested: None, pending: None, replacements: 0 }
    }

    /// The process id, if the process exists.
    pub(super) fn pid(&self) -> Option<u32> {
        self.live().map(|live| live.pid)
    }

    /// Whether the run waits for this process to become ready, or for the user to start it.
    pub(super) fn is_starting(&self) -> bool {
        matches!(self.phase, LifePhase::Starting(_) | LifePhase::Awaited)
    }

    /// Whether a signal has stopped it.
    pub(super) fn is_frozen(&self) -> bool {
        self.live().is_some_and(LiveProcess::is_frozen)
    }

    /// Whether the user started it by hand, so that it is not a child of the launcher.
    pub(super) fn is_adopted(&self) -> bool {
        self.live().is_some_and(|live| live.is_adopted)
    }

    /// Whether a fault keeps it frozen, or is about to freeze it.
    pub(super) fn is_kept_frozen(&self) -> bool {
        self.requested == Some(Requested::Freeze)
    }

    /// Whether it takes part in the flight now.
    pub(super) fn is_running(&self) -> bool {
        matches!(self.phase, LifePhase::Ready(live) if !live.is_frozen())
    }

    /// Whether the world may wait for this recorder to read.
    ///
    /// A recorder that is frozen by accident keeps its buffers, so the world waits for it as for a slow recorder. If a
    /// fault froze it, the flight goes on.
    pub(super) fn is_reading(&self) -> bool {
        matches!(self.phase, LifePhase::Ready(live) if !live.is_frozen() || self.requested.is_none())
    }

    /// Whether a lockstep flight has to pause until this process is back.
    pub(super) fn holds_flight(&self) -> bool {
        match self.part {
            Part::Leader => !self.is_running() && self.requested.is_none(),
            Part::Recorder => self.is_starting(),
            Part::World | Part::Agent(_) => false,
        }
    }

    /// Whether an action that a fault asked for has not taken effect yet.
    pub(super) fn has_pending_action(&self) -> bool {
        self.pending.is_some()
    }

    /// Who may announce itself as ready at this moment.
    pub(super) fn expects(&self) -> Attendant {
        match self.phase {
            LifePhase::Starting(live) => Attendant::Child(live.pid),
            // A process that is started by hand may also take the place of a lost one.
            LifePhase::Absent | LifePhase::Awaited => Attendant::Stranger,
            LifePhase::Ready(_) => Attendant::Nobody,
        }
    }

    /// Why a fault cannot do `action` to this process now, if it cannot.
    pub(super) fn refusal(&self, action: ProcessAction) -> Option<&'static str> {
        use ProcessAction::{Freeze, Start, Thaw};
        let state = match self.live() {
            None => ProcessState::Gone,
            Some(live) if live.halt != Halt::Runs => ProcessState::Frozen,
            Some(_) => ProcessState::Running,
        };
        match (action, self.live()) {
            (Start, None) if self.is_by_hand => Some("is started by hand"),
            (Freeze | Thaw, Some(live)) if live.is_adopted => {
                Some("was started by hand, so the launcher cannot see it freeze")
            }
            _ => state.after(action).err(),
        }
    }

    /// Takes in what happened at `now`, in a run that is at `stage`; returns the effects to carry out.
    ///
    /// # Panics
    /// On an input that this process cannot have: a bug of the caller.
    pub(super) fn on(&mut self, input: Input, now: Duration, stage: RunStage) -> Vec<Effect> {
        let effects = match input {
            Input::Spawned { pid } => self.on_spawned(pid, now),
            Input::Ready { pid } => self.on_ready(pid, now, stage),
            Input::Stopped => self.on_stopped(now),
            Input::Continued => self.on_continued(now),
            Input::Ended(end) => self.on_ended(end, stage),
            Input::Asked(action) => self.on_asked(action, now),
            Input::Killed => self.signal(ProcessSignal::Kill, now),
            Input::ClockTicked => self.on_clock(now),
        };
        self.assert_consistent();
        effects
    }

    fn live(&self) -> Option<&LiveProcess> {
        match &self.phase {
            LifePhase::Starting(live) | LifePhase::Ready(live) => Some(live),
            LifePhase::Absent | LifePhase::Awaited => None,
        }
    }

    fn live_mut(&mut self) -> Option<&mut LiveProcess> {
        match &mut self.phase {
            LifePhase::Starting(live) | LifePhase::Ready(live) => Some(live),
            LifePhase::Absent | LifePhase::Awaited => None,
        }
    }

    fn on_spawned(&mut self, pid: u32, now: Duration) -> Vec<Effect> {
        assert_eq!(self.pid(), None, "{}: spawned beside a process that lives", self.part);
        self.phase =
            LifePhase::Starting(LiveProcess { pid, is_adopted: false, halt: Halt::Runs, since: now });
        // A request concerned the predecessor. If it stayed, the loss of this process would count as asked for.
        self.requested = None;
        Vec::new()
    }

    fn on_ready(&mut self, pid: u32, now: Duration, stage: RunStage) -> Vec<Effect> {
        let live = match self.phase {
            LifePhase::Starting(live) if live.pid == pid => live,
            LifePhase::Absent | LifePhase::Awaited => {
                // A request that concerned the predecessor ends with it.
                self.requested = None;
                LiveProcess { pid, is_adopted: true, halt: Halt::Runs, since: now }
            }
            _ => panic!("{}: process {pid} is ready beside {:?}", self.part, self.phase),
        };
        self.phase = LifePhase::Ready(live);
        let mut effects = Vec::new();
        effects.extend(live.is_adopted.then_some(Effect::Watch { pid }));
        // A start that a fault asked for is logged as that fault.
        let is_news = stage != RunStage::Preparing && self.pending.is_none();
        effects.extend(is_news.then_some(Effect::Log(Event::ProcessReady { part: self.part })));
        self.settle(ProcessAction::Start);
        effects.push(Effect::PublishRoster);
        effects
    }

    fn on_stopped(&mut self, now: Duration) -> Vec<Effect> {
        // Nobody asked for this, and perhaps the whole run is stopped. The clock decides later whether to take note.
        if self.requested.is_none() && !self.is_frozen() {
            self.set_halt(Halt::Stopped, now);
            return Vec::new();
        }
        self.set_halt(Halt::Frozen, now);
        self.settle(ProcessAction::Freeze);
        vec![Effect::PublishRoster]
    }

    fn on_continued(&mut self, now: Duration) -> Vec<Effect> {
        let was_noted = self.is_frozen();
        self.set_halt(Halt::Runs, now);
        // Somebody outside the run thawed a process that a fault had frozen. While a freeze is pending, the report may
        // still come from an earlier signal.
        if self.requested == Some(Requested::Freeze) && self.pending.is_none() {
            self.requested = None;
        }
        let event = Event::ProcessThawed { part: self.part };
        // A process that was stopped too briefly to be noted has nothing to report, and a thaw by a fault is logged
        // as that fault.
        let is_news = was_noted && self.pending.is_none();
        self.settle(ProcessAction::Thaw);
        let effects = is_news.then_some(Effect::Log(event)).into_iter();
        effects.chain(was_noted.then_some(Effect::PublishRoster)).collect()
    }

    fn set_halt(&mut self, halt: Halt, now: Duration) {
        let part = self.part;
        let live = self.live_mut().unwrap_or_else(|| panic!("{part}: stopped or continued, but gone"));
        (live.halt, live.since) = (halt, now);
    }

    /// Notes that `action` has taken effect, if it was pending.
    fn settle(&mut self, action: ProcessAction) {
        if self.pending == Some(action) {
            self.pending = None;
        }
    }

    fn on_ended(&mut self, end: ProcessEnd, stage: RunStage) -> Vec<Effect> {
        assert!(self.live().is_some(), "{}: ended twice", self.part);
        let was_starting = self.is_starting();
        (self.phase, self.pending) = (LifePhase::Absent, None);
        // A freeze ends with its process. A request to end stays, because it says that the absence is wanted.
        if self.requested == Some(Requested::Freeze) {
            self.requested = None;
        }
        let consequences = match (stage, self.requested) {
            // After the flight every process ends, so whether a fault asked for it no longer matters.
            (RunStage::Over, _) => self.on_late_end(end),
            (_, Some(Requested::End { returns })) => self.on_requested_end(returns),
            _ => self.on_loss(end, was_starting),
        };
        let is_planned = self.requested.is_some();
        [Effect::CleanUp { is_planned }].into_iter().chain(consequences).collect()
    }

    /// An end after the flight is expected. Only the recorder's end can still do damage: its log may be incomplete.
    fn on_late_end(&self, end: ProcessEnd) -> Vec<Effect> {
        // The launcher is not the parent of a process that was started by hand, so it cannot know how that one ended.
        let is_in_order = matches!(end, ProcessEnd::Exited(0) | ProcessEnd::Unknown);
        if self.part != Part::Recorder || is_in_order {
            return Vec::new();
        }
        vec![Effect::FailAtEnd(format!("the recorder {end} while it closed the log: the log is incomplete"))]
    }

    fn on_requested_end(&mut self, returns: bool) -> Vec<Effect> {
        match self.part {
            Part::World => {
                let why = "the world was ended as asked: the flight did not come to its end";
                vec![Effect::EndRun(why.into()), Effect::PublishRoster]
            }
            // Without a recorder, the rest of the flight would be neither logged nor measured.
            Part::Recorder if !returns => self.respawn(),
            _ => vec![Effect::PublishRoster],
        }
    }

    fn on_loss(&mut self, end: ProcessEnd, was_starting: bool) -> Vec<Effect> {
        let part = self.part;
        match part {
            Part::World => {
                let event = Event::ProcessLost { part, end, then: AfterLoss::RunEnds };
                vec![Effect::Log(event), Effect::EndRun(format!("the world {end}")), Effect::PublishRoster]
            }
            // A successor would run into the same error.
            Part::Recorder if end.is_failure() => {
                let why = format!("the recorder {end}: the log is incomplete");
                vec![Effect::FailAtEnd(why), Effect::PublishRoster]
            }
            Part::Leader | Part::Recorder if self.replacements >= self.limits.replacements => {
                let limit = self.limits.replacements;
                let event = Event::ProcessLost { part, end, then: AfterLoss::RunEnds };
                vec![
                    Effect::Log(event),
                    Effect::EndRun(format!("the {part} {end}, after {limit} replacements")),
                ]
            }
            Part::Leader | Part::Recorder => {
                let event = Event::ProcessLost { part, end, then: AfterLoss::Replaced };
                [Effect::Log(event)].into_iter().chain(self.respawn()).collect()
            }
            Part::Agent(_) => {
                let then = AfterLoss::Failsafe { before_flight: was_starting };
                vec![Effect::Log(Event::ProcessLost { part, end, then }), Effect::PublishRoster]
            }
        }
    }

    fn respawn(&mut self) -> Vec<Effect> {
        self.replacements += 1;
        vec![Effect::Spawn, Effect::PublishRoster]
    }

    fn on_asked(&mut self, action: ProcessAction, now: Duration) -> Vec<Effect> {
        assert_eq!(self.refusal(action), None, "{}: {action:?} is refused", self.part);
        self.pending = Some(action);
        self.requested = match action {
            ProcessAction::Kill { returns } => Some(Requested::End { returns }),
            ProcessAction::Stop => Some(Requested::End { returns: false }),
            ProcessAction::Freeze => Some(Requested::Freeze),
            ProcessAction::Thaw | ProcessAction::Start => None,
        };
        match action {
            ProcessAction::Kill { .. } => self.signal(ProcessSignal::Kill, now),
            ProcessAction::Stop => self.signal(ProcessSignal::Terminate, now),
            ProcessAction::Freeze => self.signal(ProcessSignal::Stop, now),
            ProcessAction::Thaw => self.signal(ProcessSignal::Continue, now),
            ProcessAction::Start => vec![Effect::Spawn],
        }
    }

    fn signal(&mut self, signal: ProcessSignal, now: Duration) -> Vec<Effect> {
        let Some(live) = self.live_mut() else { return Vec::new() };
        // Restart the time limit: the kernel needs a moment, and the process must not be signalled again meanwhile.
        live.since = now;
        vec![Effect::Signal { pid: live.pid, signal }]
    }

    fn on_clock(&mut self, now: Duration) -> Vec<Effect> {
        if self.live().is_some_and(|live| live.halt == Halt::Stopped && live.waited(now) > self.stop_grace())
        {
            return self.note_frozen();
        }
        let Some(event) = self.overdue(now) else { return Vec::new() };
        self.signal(ProcessSignal::Kill, now).into_iter().chain([Effect::Log(event)]).collect()
    }

    /// How long a process may be stopped before the run takes note: less than the world waits for an answer.
    fn stop_grace(&self) -> Duration {
        STOP_GRACE.min(self.limits.freeze / STOP_GRACES_PER_LIMIT)
    }

    /// Takes note of a process that somebody has stopped and that does not go on. Its time limits go on counting.
    fn note_frozen(&mut self) -> Vec<Effect> {
        self.live_mut().into_iter().for_each(|live| live.halt = Halt::Frozen);
        vec![Effect::Log(Event::ProcessFrozen { part: self.part }), Effect::PublishRoster]
    }

    /// Why the process has to be killed at `now`: it takes too long to start, or it stays frozen and the flight cannot
    /// go on without it.
    fn overdue(&self, now: Duration) -> Option<Event> {
        let part = self.part;
        match self.phase {
            LifePhase::Starting(live) if live.waited(now) > self.start_limit(&live) => {
                Some(Event::StartOverdue { part })
            }
            LifePhase::Ready(live)
                if live.is_frozen()
                    && self.requested.is_none()
                    && matches!(part, Part::World | Part::Leader)
                    && live.waited(now) > self.limits.freeze =>
            {
                Some(Event::ThawOverdue { part })
            }
            _ => None,
        }
    }

    fn start_limit(&self, live: &LiveProcess) -> Duration {
        let copies_log = self.part == Part::Recorder && self.replacements > 0 && !live.is_frozen();
        self.limits.start * if copies_log { START_LIMITS_PER_COPY } else { 1 }
    }

    /// Panics in a state that no sequence of inputs may reach.
    fn assert_consistent(&self) {
        let live = self.live();
        assert!(
            !matches!(self.phase, LifePhase::Starting(live) if live.is_adopted),
            "a process started by hand is first seen when it is ready: {self:?}"
        );
        match self.pending {
            Some(ProcessAction::Start) => assert!(
                matches!(self.phase, LifePhase::Absent | LifePhase::Starting(_)),
                "a start is pending until the process is ready: {self:?}"
            ),
            Some(_) => assert!(live.is_some(), "an action is pending on a process that is gone: {self:?}"),
            None => {}
        }
        if self.requested == Some(Requested::Freeze) {
            let freezes = self.is_frozen() || self.pending == Some(ProcessAction::Freeze);
            assert!(live.is_some() && freezes, "a fault's freeze lasts, but the process runs: {self:?}");
        }
    }
}

/// Who may announce itself as ready.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Attendant {
    /// The launcher's child with this process id.
    Child(u32),
    /// A process that the user starts by hand.
    Stranger,
    /// Nobody: a process is ready already.
    Nobody,
}
