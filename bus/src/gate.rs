//! The tick gate: one shared page that lets the processes of a run step through time together.
//!
//! A wake-up hint and an attendance list, nothing more: data, and the truth about which agent has answered, are in the
//! stamped samples. A process that is killed anywhere in here costs the others a system call, never a hang.

use crate::{BusError, Due, Patience, StopFlag, monotonic_ns};
use memmap2::MmapRaw;
use ringwing_flight::{Part, Tick, payload::MAX_UAVS};
use rustix::{
    io::Errno,
    thread::futex::{self, Flags},
    time::Timespec,
};
use std::{
    fs::OpenOptions,
    path::Path,
    sync::atomic::{AtomicI64, AtomicU32, AtomicU64, Ordering::SeqCst},
    time::Duration,
};

/// A word on a cache line of its own, so that its writers disturb no other word's readers.
#[repr(C, align(64))]
struct Line<T>(T);

#[repr(C)]
struct Page {
    /// 0 before the first tick, then tick + 2, in the end [`CLOSED`].
    round: Line<AtomicU32>,
    /// Processes that sleep on `round`.
    sleepers: Line<AtomicU32>,
    /// Answers to this round so far.
    done: Line<AtomicU32>,
    /// Answers that the world waits for.
    target: Line<AtomicU32>,
    /// The world sleeps on `done`.
    world_sleeps: Line<AtomicU32>,
    /// Grows whenever somebody wants the world to look at more than the answers.
    nudges: Line<AtomicU32>,
    /// Grows with each batch of ticks that the recorder should fetch.
    batch: Line<AtomicU32>,
    /// The last tick that the recorder has fetched.
    recorded: Line<AtomicI64>,
    /// The last round whose leader state has been sent to everybody who listens.
    led: Line<AtomicU32>,
    /// 1 when the user wants the run to end.
    stop: Line<AtomicU32>,
    /// The tick that the world does not open before something was done to the run, or [`NOT_HELD`].
    held: Line<AtomicI64>,
    /// Grows each time that the world begins to hold.
    holds: Line<AtomicU32>,
    /// Grows with each fault that is added while the run goes on.
    faults: Line<AtomicU32>,
    /// When the next tick is due, and how long before that is worth being awake: a hint, 0 where no clock tells.
    due_at_ns: Line<AtomicU64>,
    due_lead_ns: AtomicU64,
    /// Process id of each part that is ready, 0 for those that are not.
    attendance: [AtomicU32; 3 + MAX_UAVS as usize],
}

const CLOSED: u32 = u32::MAX;
const NOT_HELD: i64 = i64::MIN;
/// Sleeps are cut into pieces, so that nobody sleeps through a signal that came just before.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);
/// Ticks that make a batch for the recorder in lockstep.
const BATCH_TICKS: i64 = 16;

/// The page as one process sees it.
pub struct Gate {
    map: MmapRaw,
    missed: Option<Tick>,
}

/// What waiting at the gate ended with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wait {
    /// This tick is open.
    Tick(Tick),
    /// The flight is over.
    Closed,
    /// The process was asked to stop.
    Stopped,
}

impl Gate {
    /// Makes the page of a new domain.
    pub(crate) fn create(path: &Path) -> Result<Self, BusError> {
        let file = OpenOptions::new()
            .create_new(true)
            .read(true)
            .write(true)
            .open(path)
            .map_err(BusError::file(path))?;
        file.set_len(size_of::<Page>() as u64).map_err(BusError::file(path))?;
        let gate = Self { map: MmapRaw::map_raw(&file).map_err(BusError::file(path))?, missed: None };
        gate.release();
        Ok(gate)
    }

    /// Opens the page of a domain that somebody else made.
    pub(crate) fn open(path: &Path) -> Result<Self, BusError> {
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(BusError::file(path))?;
        let map = MmapRaw::map_raw(&file).map_err(BusError::file(path))?;
        if map.len() < size_of::<Page>() {
            let short = std::io::Error::other("shorter than a tick gate; it belongs to another version");
            return Err(BusError::file(path)(short));
        }
        Ok(Self { map, missed: None })
    }

    #[expect(unsafe_code, reason = "the one view of shared memory that iceoryx2 does not manage")]
    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins on a memory page")]
    fn page(&self) -> &Page {
        // SAFETY: the mapping is at least a `Page` long (made or checked so), page-aligned, lives as long as `self`, and
        // is only ever accessed as these atomics, by us and by the other processes; any bytes make valid atomics.
        unsafe { &*self.map.as_ptr().cast::<Page>() }
    }

    // --- the world's side ---

    /// Opens `tick`, to be answered by `expected` processes. Everything they need must be published before.
    ///
    /// A closed gate stays closed: the flight is over, whoever ended it.
    pub fn open_tick(&self, tick: Tick, expected: u32) {
        let page = self.page();
        page.target.0.store(expected, SeqCst);
        page.done.0.store(0, SeqCst);
        let open = |round| (round != CLOSED).then_some(round_of(tick));
        if page.round.0.fetch_update(SeqCst, SeqCst, open).is_err() {
            return;
        }
        if page.sleepers.0.load(SeqCst) > 0 {
            wake_all(&page.round.0);
        }
        if tick.0 % BATCH_TICKS == 0 {
            self.call_recorder();
        }
    }

    /// Says when the next tick is due, for those who can be awake by then.
    pub fn set_due(&self, due: Due) {
        self.page().due_at_ns.0.store(due.at_ns, SeqCst);
        self.page().due_lead_ns.store(due.lead_ns, SeqCst);
    }

    /// Lets the recorder fetch what there is.
    pub fn call_recorder(&self) {
        self.page().batch.0.fetch_add(1, SeqCst);
        wake_all(&self.page().batch.0);
    }

    /// Waits until all expected answers are in, at most for `limit`, or until somebody nudges the world.
    pub fn wait_for_answers(&self, patience: &mut Patience, limit: Duration) {
        let page = self.page();
        if patience.yield_until(|| self.is_answered()) || patience.is_restless() {
            return;
        }
        page.world_sleeps.0.store(1, SeqCst);
        let done = page.done.0.load(SeqCst);
        if done < page.target.0.load(SeqCst) {
            sleep_on(&page.done.0, done, limit);
        }
        page.world_sleeps.0.store(0, SeqCst);
    }

    /// Whether as many answers were counted as the world waits for.
    pub fn is_answered(&self) -> bool {
        self.page().done.0.load(SeqCst) >= self.page().target.0.load(SeqCst)
    }

    /// How often the world was nudged; where it has grown, there is news beside the answers.
    pub fn nudges(&self) -> u32 {
        self.page().nudges.0.load(SeqCst)
    }

    /// Waits for a nudge after the first `seen`, at most for `limit`.
    pub fn wait_for_nudge(&self, seen: u32, limit: Duration) {
        sleep_on(&self.page().nudges.0, seen, limit);
    }

    /// Says that `tick` is not opened before something was done to the run.
    pub fn hold_before(&self, tick: Tick) {
        self.page().held.0.store(tick.0, SeqCst);
        self.page().holds.0.fetch_add(1, SeqCst);
        wake_all(&self.page().holds.0);
    }

    /// Says that it is done.
    pub fn release(&self) {
        self.page().held.0.store(NOT_HELD, SeqCst);
    }

    /// Ends the flight for everybody.
    pub fn close(&self) {
        let page = self.page();
        page.round.0.store(CLOSED, SeqCst);
        wake_all(&page.round.0);
        self.call_recorder();
        self.nudge_world();
    }

    /// The last tick that the recorder has fetched.
    pub fn recorded(&self) -> Tick {
        Tick(self.page().recorded.0.load(SeqCst))
    }

    /// The last tick of which everybody has been told where the leader is.
    ///
    /// A sample of it in somebody's hands is no proof: the leader may have been killed between two of its readers.
    pub fn led(&self) -> Option<Tick> {
        Some(self.page().led.0.load(SeqCst)).filter(|round| *round != 0).map(tick_of)
    }

    /// Whether the user wants the run to end.
    pub fn stop_requested(&self) -> bool {
        self.page().stop.0.load(SeqCst) != 0
    }

    // --- the side of those who answer ---

    /// Waits for a tick other than `seen`.
    pub fn wait(&self, seen: Option<Tick>, patience: &mut Patience, stop: &StopFlag) -> Wait {
        let page = self.page();
        let old = seen.map_or(0, round_of);
        let is_over = || page.round.0.load(SeqCst) != old || stop.is_set();
        while patience.is_restless() && !is_over() {
            patience.yield_until(is_over);
        }
        if !patience.yield_until(is_over) {
            page.sleepers.0.fetch_add(1, SeqCst);
            let mut due = patience.stands_by_for(self.due());
            while !is_over() {
                let nap = due.until_stand_by(monotonic_ns());
                if nap.is_zero() {
                    patience.stand_by(due, is_over);
                    due = Due::default();
                } else {
                    sleep_on(&page.round.0, old, nap);
                }
            }
            page.sleepers.0.fetch_sub(1, SeqCst);
        }
        self.look(stop)
    }

    /// What there is at the gate now, if that is another tick than `seen`, or its end.
    pub(crate) fn news(&self, seen: Option<Tick>, stop: &StopFlag) -> Option<Wait> {
        let is_new = self.page().round.0.load(SeqCst) != seen.map_or(0, round_of) || stop.is_set();
        is_new.then(|| self.look(stop))
    }

    fn due(&self) -> Due {
        Due { at_ns: self.page().due_at_ns.0.load(SeqCst), lead_ns: self.page().due_lead_ns.load(SeqCst) }
    }

    fn look(&self, stop: &StopFlag) -> Wait {
        match self.page().round.0.load(SeqCst) {
            _ if stop.is_set() => Wait::Stopped,
            CLOSED => Wait::Closed,
            round => Wait::Tick(tick_of(round)),
        }
    }

    /// Says that this process has published all it has for this round.
    pub fn answer(&self) {
        let page = self.page();
        let done = page.done.0.fetch_add(1, SeqCst) + 1;
        if done >= page.target.0.load(SeqCst) && page.world_sleeps.0.load(SeqCst) != 0 {
            wake_all(&page.done.0);
        }
    }

    /// The tick that was open, and answered by all, when this process came: it has no part in that one.
    pub fn missed(&self) -> Option<Tick> {
        self.missed
    }

    /// To be called before the process says that it is there: from then on the world may go on.
    pub(crate) fn note_missed(&mut self) {
        self.missed = self.held().and_then(|_| self.tick());
    }

    /// How many faults were added while the run goes on.
    pub fn faults(&self) -> u32 {
        self.page().faults.0.load(SeqCst)
    }

    // --- the leader's side ---

    /// Says that everybody has been told where the leader is at `tick`, and answers.
    pub fn answer_as_leader(&self, tick: Tick) {
        self.page().led.0.store(round_of(tick), SeqCst);
        self.answer();
    }

    // --- the recorder's side ---

    /// The tick that is open now, if one is.
    pub fn tick(&self) -> Option<Tick> {
        match self.page().round.0.load(SeqCst) {
            0 | CLOSED => None,
            round => Some(tick_of(round)),
        }
    }

    /// Whether the flight is over.
    pub fn is_closed(&self) -> bool {
        self.page().round.0.load(SeqCst) == CLOSED
    }

    /// Waits for a batch other than `seen`, at most for `limit`; returns the newest batch.
    pub fn wait_for_batch(&self, seen: u32, limit: Duration) -> u32 {
        let batch = &self.page().batch.0;
        if batch.load(SeqCst) == seen {
            sleep_on(batch, seen, limit);
        }
        batch.load(SeqCst)
    }

    /// Says that everything up to `tick` is fetched.
    pub fn set_recorded(&self, tick: Tick) {
        self.page().recorded.0.store(tick.0, SeqCst);
        self.nudge_world();
    }

    // --- the launcher's side ---

    /// The tick that the world does not open before something was done to the run.
    pub fn held(&self) -> Option<Tick> {
        Some(self.page().held.0.load(SeqCst)).filter(|tick| *tick != NOT_HELD).map(Tick)
    }

    /// Waits until the world holds anew after the first `seen` times, at most for `limit`; returns how often it has.
    pub fn wait_for_hold(&self, seen: u32, limit: Duration) -> u32 {
        let holds = &self.page().holds.0;
        if holds.load(SeqCst) == seen {
            sleep_on(holds, seen, limit);
        }
        holds.load(SeqCst)
    }

    /// Says that there are `count` faults that were added while the run goes on.
    pub fn set_faults(&self, count: u32) {
        self.page().faults.0.store(count, SeqCst);
    }

    /// Wakes the world if it waits, to look again at what it waits for.
    pub fn nudge_world(&self) {
        let page = self.page();
        page.nudges.0.fetch_add(1, SeqCst);
        wake_all(&page.nudges.0);
        wake_all(&page.done.0);
    }

    /// Asks the world to end the flight after the tick it is in.
    pub fn request_stop(&self) {
        self.page().stop.0.store(1, SeqCst);
        self.nudge_world();
    }

    /// The process that said it is ready as `part`.
    pub fn attendant(&self, part: Part) -> Option<u32> {
        Some(self.page().attendance[part.index()].load(SeqCst)).filter(|pid| *pid != 0)
    }

    /// Notes `process` as ready in the place of `part`, or that nobody is.
    pub fn set_attendant(&self, part: Part, process: Option<u32>) {
        self.page().attendance[part.index()].store(process.unwrap_or(0), SeqCst);
    }
}

fn round_of(tick: Tick) -> u32 {
    u32::try_from(tick.0 + 2)
        .ok()
        .filter(|round| *round != CLOSED)
        .expect("a run has fewer than 2^32 - 3 ticks")
}

fn tick_of(round: u32) -> Tick {
    Tick(i64::from(round) - 2)
}

fn wake_all(word: &AtomicU32) {
    // Nobody sleeping is no error; there is no other way for this to fail on a mapped word.
    let _ = futex::wake(word, Flags::empty(), i32::MAX as u32);
}

/// Sleeps until `word` is no longer `old`, a wake-up, a signal, or `limit`: the caller looks again in any case.
fn sleep_on(word: &AtomicU32, old: u32, limit: Duration) {
    let limit = limit.min(LONGEST_SLEEP);
    let timeout = Timespec { tv_sec: 0, tv_nsec: i64::from(limit.subsec_nanos()) };
    match futex::wait(word, Flags::empty(), old, Some(&timeout)) {
        Ok(()) | Err(Errno::AGAIN | Errno::TIMEDOUT | Errno::INTR) => {}
        Err(errno) => unreachable!("a futex wait on mapped memory fails with {errno}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::Arc, thread};

    fn shared_gate() -> (tempfile::TempDir, Arc<Gate>) {
        let folder = tempfile::tempdir().unwrap();
        let gate = Gate::create(&folder.path().join("gate")).unwrap();
        (folder, Arc::new(gate))
    }

    #[test]
    fn a_closed_gate_stays_closed() {
        let (_folder, gate) = shared_gate();
        gate.open_tick(Tick(0), 1);
        gate.close();
        gate.open_tick(Tick(1), 1);
        assert!(gate.is_closed());
    }

    #[test]
    fn four_threads_step_through_a_thousand_ticks_together() {
        let (_folder, gate) = shared_gate();
        let workers: Vec<_> = (0..4)
            .map(|_| {
                let gate = gate.clone();
                thread::spawn(move || {
                    let (mut patience, stop, mut seen) = (Patience::eager(), StopFlag::default(), Vec::new());
                    while let Wait::Tick(tick) = gate.wait(seen.last().copied(), &mut patience, &stop) {
                        seen.push(tick);
                        gate.answer();
                    }
                    seen
                })
            })
            .collect();
        let mut patience = Patience::eager();
        let ticks: Vec<Tick> = (-1..1000).map(Tick).collect();
        for tick in &ticks {
            gate.open_tick(*tick, 4);
            while gate.page().done.0.load(SeqCst) < 4 {
                gate.wait_for_answers(&mut patience, Duration::from_secs(1));
            }
        }
        gate.close();
        for worker in workers {
            assert_eq!(worker.join().unwrap(), ticks);
        }
    }

    #[test]
    fn a_tick_is_heard_before_during_and_after_the_time_to_stand_by_for_it() {
        const MS: u64 = 1_000_000;
        let (_folder, gate) = shared_gate();
        let (mut patience, stop) = (Patience::punctual(), StopFlag::default());
        for (round, due_in_ms) in (0..).zip([50, 2, 0]) {
            let at_ns = monotonic_ns() + due_in_ms * MS;
            gate.set_due(Due { at_ns, lead_ns: MS });
            thread::scope(|scope| {
                scope.spawn(|| {
                    thread::sleep(Duration::from_millis(2));
                    gate.open_tick(Tick(round), 1);
                });
                let seen = (round > 0).then(|| Tick(round - 1));
                assert_eq!(gate.wait(seen, &mut patience, &stop), Wait::Tick(Tick(round)));
            });
        }
    }

    #[test]
    fn a_missing_answer_costs_the_limit_and_no_more() {
        let (_folder, gate) = shared_gate();
        gate.open_tick(Tick(0), 1);
        gate.wait_for_answers(&mut Patience::punctual(), Duration::from_millis(1));
        assert_eq!(gate.page().done.0.load(SeqCst), 0);
    }

    #[test]
    fn a_page_that_is_too_short_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gate");
        std::fs::write(&path, [0; 64]).unwrap();
        let error = Gate::open(&path).err().unwrap();
        assert!(error.to_string().contains("shorter than a tick gate"), "{error}");
    }
}
