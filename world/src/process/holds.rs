//! What keeps the world from opening the next tick: in lockstep, simulated time stands still for other processes.
//!
//! Faults are applied, lost processes replaced and the log written between two ticks, so that none of it depends on
//! scheduling. Every hold is bounded: a process that never comes back costs time, and an event says so. Only a pause that
//! the user asked for lasts until the user ends it, or the run.
//!
//! Never holds in real time, where time cannot stand still.

use super::{
    World,
    wait::{RECHECK, WaitEnd, WaitMode, wait_until},
};
use ringwing_bus::{BusError, TickProbe};
use ringwing_flight::{Event, Roster, Tick};
use ringwing_scenario::Scenario;
use std::time::Duration;

/// How far the recorder may lag behind in lockstep, in simulated seconds. A killed recorder loses what it has not
/// fetched and what it has not written; together that must stay below a second, which a larger lag would exceed. With a
/// smaller one, the world waits for the recorder more often.
const RECORDER_LAG_S: f64 = 0.4;
/// The fewest ticks that the recorder may lag behind: the one that is open, and the one whose journal is on its way.
const LAG_TICKS_MIN: i64 = 2;
/// How many start limits a replacement, or a fault that starts a process, may take: the launcher first has to notice
/// the loss. A larger factor lets a stuck launcher hold the flight longer; a smaller one gives up replacements that
/// are still starting.
const START_LIMITS: u32 = 2;

/// How long the world waits for other processes, and which ones it has given up.
#[derive(Debug)]
pub(super) struct Holds {
    /// Time limit for an answer, and for the recorder to catch up.
    pub(super) answer_timeout: Duration,
    /// Time limit for the launcher to apply a fault or to replace a process.
    pub(super) hold_timeout: Duration,
    recorder_lag_ticks: i64,
    /// The tick that is to be opened next, and whether the launcher has let the world open it.
    next: Tick,
    is_next_free: bool,
    /// Whether a replacement did not come in time. Then the world waits for no replacement until the launcher ends
    /// this hold.
    gave_up_replacement: bool,
    /// The last tick that the recorder had recorded when it was given up. The world waits for it again once it records
    /// more.
    recorder_stuck_at: Option<Tick>,
}

impl Holds {
    /// The limits of `scenario`, with a journal that keeps `journal_depth` ticks.
    pub(super) fn new(scenario: &Scenario, journal_depth: usize) -> Self {
        Self {
            answer_timeout: scenario.answer_limit(),
            hold_timeout: scenario.start_limit() * START_LIMITS,
            recorder_lag_ticks: recorder_lag_ticks(scenario, journal_depth),
            next: Tick::APPROACH,
            is_next_free: false,
            gave_up_replacement: false,
            recorder_stuck_at: None,
        }
    }

    /// Whether the flight waits for a process that is being replaced.
    pub(super) fn is_for_replacement(&self, roster: &Roster) -> bool {
        roster.holds() && !self.gave_up_replacement
    }

    /// Whether the flight waits at `now` for a recorder that has recorded the ticks up to `recorded`.
    fn is_for_recorder(&self, roster: &Roster, now: Tick, recorded: Tick) -> bool {
        roster.has_recorder()
            && now.since(recorded) > self.recorder_lag_ticks
            && self.recorder_stuck_at != Some(recorded)
    }

    /// Takes in a roster; each one has to come here, in order.
    ///
    /// Waits for replacements again once a roster needs none. A tick that the launcher has let the world open stays free,
    /// even if the next roster is there before the world has looked: the launcher takes that tick for past.
    pub(super) fn on_roster(&mut self, roster: &Roster) {
        self.gave_up_replacement &= roster.holds();
        self.is_next_free |= roster.free_before > self.next;
    }

    /// Turns to the tick `next`. Only the newest `roster` says whether the world may open it.
    fn turn_to(&mut self, next: Tick, roster: &Roster) {
        (self.next, self.is_next_free) = (next, roster.free_before > next);
    }
}

/// How many ticks the recorder may lag behind.
fn recorder_lag_ticks(scenario: &Scenario, journal_depth: usize) -> i64 {
    let ticks = (f64::from(scenario.time.rate_hz) * RECORDER_LAG_S).ceil() as i64;
    // The journal of a large swarm, or of a machine with little memory, keeps fewer ticks than that. Leave it room: the
    // recorder has read more than it has told so far.
    let most = journal_depth.cast_signed() as i64 / 2;
    // The journal of a tick is sent while the next one is open. With less than two ticks, at a low rate, the world would
    // wait for a journal that it has not sent.
    ticks.clamp(LAG_TICKS_MIN, most.max(LAG_TICKS_MIN))
}

impl<P: TickProbe> World<'_, P> {
    /// Waits for the first roster. Returns false if the run was stopped before.
    pub(super) fn wait_for_roster(&mut self) -> Result<bool, BusError> {
        let end = self.wait_for_news(Duration::MAX, |world| world.answers.roster().revision > 0)?;
        // The start of the processes took time. In real time, deadlines from before would count as missed.
        self.restart_deadlines();
        Ok(end == WaitEnd::Met)
    }

    /// Holds the next tick as long as anything has to happen before it.
    pub(super) fn hold_next_tick(&mut self) -> Result<(), BusError> {
        // Faults come first: they may end the leader or the recorder, which then has to be replaced and to catch up.
        self.hold_for_faults()?;
        self.hold_for_replacement()?;
        self.hold_for_recorder()
    }

    /// Holds until the launcher has applied the faults of the next tick.
    fn hold_for_faults(&mut self) -> Result<(), BusError> {
        let next = self.airspace.now();
        self.holds.turn_to(next, self.answers.roster());
        let is_free = |world: &Self| world.holds.is_next_free;
        if is_free(self) {
            return Ok(());
        }
        self.ports.gate.hold_before(next);
        if self.wait_for_news(self.holds.hold_timeout, is_free)? == WaitEnd::Overdue {
            self.log_event(Event::FaultOverdue)?;
        }
        self.ports.gate.release();
        // A thawed process has answered its open tick before the launcher let the world go on. Take in that late
        // command now: otherwise scheduling would decide when it reaches the airframe.
        self.collect()
    }

    /// Holds while a lost process is replaced.
    fn hold_for_replacement(&mut self) -> Result<(), BusError> {
        let is_there = |world: &Self| !world.holds.is_for_replacement(world.answers.roster());
        if self.wait_for_news(self.holds.hold_timeout, is_there)? == WaitEnd::Overdue {
            self.holds.gave_up_replacement = true;
            self.log_event(Event::ReplacementOverdue)?;
        }
        Ok(())
    }

    /// Holds while the recorder lags too far behind.
    fn hold_for_recorder(&mut self) -> Result<(), BusError> {
        let keeps_up = |world: &Self| {
            let recorded = world.ports.gate.recorded();
            !world.holds.is_for_recorder(world.answers.roster(), world.airspace.now(), recorded)
        };
        if keeps_up(self) {
            return Ok(());
        }
        // At a low rate a batch is longer than the lag allowed, and the recorder would sleep until the batch is full.
        self.ports.gate.call_recorder();
        // This limit runs during a pause as well: the user waits for a step that waits for the recorder.
        let end = wait_until(self, self.holds.answer_timeout, keeps_up, Self::timed, Self::await_news)?;
        if end == WaitEnd::Overdue {
            self.holds.recorder_stuck_at = Some(self.ports.gate.recorded());
            self.log_event(Event::RecorderSilent)?;
        }
        Ok(())
    }

    /// After the flight: waits until the recorder has fetched the last tick, because samples may vanish with their
    /// sender.
    pub(super) fn wait_for_last_fetch(&mut self) -> Result<(), BusError> {
        // The last batch may be a short one, for which nobody has called the recorder yet.
        self.ports.gate.call_recorder();
        let is_fetched = |world: &Self| {
            !world.answers.roster().has_recorder() || world.ports.gate.recorded() >= world.airspace.flown()
        };
        let mode = |world: &Self| {
            if world.ports.is_told_to_leave() { WaitMode::Stopped } else { WaitMode::Timed }
        };
        let limit = self.holds.answer_timeout;
        wait_until(self, limit, is_fetched, mode, Self::await_news).map(drop)
    }

    fn wait_for_news(
        &mut self,
        limit: Duration,
        is_met: impl Fn(&Self) -> bool,
    ) -> Result<WaitEnd, BusError> {
        wait_until(self, limit, is_met, Self::wait_mode, Self::await_news)
    }

    /// How the run affects a wait for what the launcher or an answering process does.
    pub(super) fn wait_mode(&self) -> WaitMode {
        match self.timed() {
            WaitMode::Timed if self.answers.roster().is_paused() => WaitMode::Untimed,
            mode => mode,
        }
    }

    /// How the run affects a wait whose limit always runs.
    fn timed(&self) -> WaitMode {
        if self.is_stopped() { WaitMode::Stopped } else { WaitMode::Timed }
    }

    /// Sleeps until somebody nudges the world, and takes in the newest roster if there is one.
    fn await_news(&mut self) -> Result<(), BusError> {
        self.ports.wait_for_nudge(RECHECK);
        self.refresh_roster()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds() -> Holds {
        Holds::new(&Scenario::default(), 1024)
    }

    #[test]
    fn a_recorder_may_lag_by_less_than_half_a_second() {
        let (holds, mut roster) = (holds(), Roster::empty());
        assert!(!holds.is_for_recorder(&roster, Tick(1000), Tick(0)), "there is no recorder");
        roster.set_recorder(true);
        assert!(!holds.is_for_recorder(&roster, Tick(140), Tick(100)));
        assert!(holds.is_for_recorder(&roster, Tick(141), Tick(100)));
    }

    #[test]
    fn a_recorder_may_lag_by_half_of_a_short_journal() {
        let mut roster = Roster::empty();
        roster.set_recorder(true);
        let holds = Holds::new(&Scenario::default(), 50);
        assert!(!holds.is_for_recorder(&roster, Tick(125), Tick(100)));
        assert!(holds.is_for_recorder(&roster, Tick(126), Tick(100)));
    }

    #[test]
    fn at_a_low_rate_a_recorder_may_lag_by_the_ticks_whose_journal_is_not_sent_yet() {
        let mut scenario = Scenario::default();
        scenario.time.rate_hz = 1;
        let (holds, mut roster) = (Holds::new(&scenario, 1024), Roster::empty());
        roster.set_recorder(true);
        assert!(!holds.is_for_recorder(&roster, Tick(10), Tick(8)));
        assert!(holds.is_for_recorder(&roster, Tick(10), Tick(7)));
    }

    #[test]
    fn a_tick_that_was_let_go_stays_free_whatever_the_next_roster_says() {
        let (mut holds, mut roster) = (holds(), Roster::empty());
        let free_before = |roster: &mut Roster, tick| roster.free_before = Tick(tick);
        free_before(&mut roster, 50);
        holds.turn_to(Tick(50), &roster);
        assert!(!holds.is_next_free);
        for limit in [50, 51, i64::MIN] {
            free_before(&mut roster, limit);
            holds.on_roster(&roster);
        }
        assert!(holds.is_next_free);
        holds.turn_to(Tick(51), &roster);
        assert!(!holds.is_next_free, "the newest roster holds the next tick");
    }

    #[test]
    fn a_recorder_that_was_given_up_is_waited_for_again_once_it_records() {
        let (mut holds, mut roster) = (holds(), Roster::empty());
        roster.set_recorder(true);
        holds.recorder_stuck_at = Some(Tick(100));
        assert!(!holds.is_for_recorder(&roster, Tick(200), Tick(100)));
        assert!(holds.is_for_recorder(&roster, Tick(200), Tick(101)));
    }

    #[test]
    fn a_replacement_that_was_given_up_is_waited_for_again_in_the_next_hold() {
        let (mut holds, mut roster) = (holds(), Roster::empty());
        roster.set_hold(true);
        assert!(holds.is_for_replacement(&roster));
        holds.gave_up_replacement = true;
        holds.on_roster(&roster);
        assert!(!holds.is_for_replacement(&roster));
        for held in [false, true] {
            roster.set_hold(held);
            holds.on_roster(&roster);
        }
        assert!(holds.is_for_replacement(&roster));
    }
}
