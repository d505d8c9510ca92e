//! The world's journal of the flight: what it sent in each tick and what came back, for the recorder.
//!
//! A tick is complete only when the next one opens: until then a thawed agent may still answer it. So there are two
//! pages: one that is being filled, and one that is complete and will be sent while the agents work on the next tick.
//!
//! Must never delay the opening of a tick, and costs nothing while nobody records.

use ringwing_bus::{BusError, JournalWriter, Member};
use ringwing_flight::{
    Account, JournalEntry, JournalHeader, LeaderState, Sensed, Tick, TickTiming, Truth, UavId,
};

/// The journal, open at the present tick.
pub(super) struct Journal {
    writer: JournalWriter,
    filling: JournalPage,
    complete: JournalPage,
}

struct JournalPage {
    header: JournalHeader,
    /// One of each UAV, UAV 1 first.
    entries: Vec<JournalEntry>,
    /// Whether somebody records this tick.
    is_wanted: bool,
}

impl JournalPage {
    fn blank(uavs: u32) -> Self {
        let entries = vec![JournalEntry::empty(); uavs as usize];
        Self { header: JournalHeader::of(Tick::APPROACH), entries, is_wanted: false }
    }
}

impl Journal {
    /// Opens the journal of the run.
    pub(super) fn open(member: &Member) -> Result<Self, BusError> {
        let uavs = member.scenario().formation.uavs;
        let writer = JournalWriter::open(member.node(), uavs)?;
        writer.pin(member.domain())?;
        Ok(Self { writer, filling: JournalPage::blank(uavs), complete: JournalPage::blank(uavs) })
    }

    /// How many ticks the recorder may lag behind before it loses the oldest.
    pub(super) fn depth(&self) -> usize {
        self.writer.depth()
    }

    /// Begins the page of `tick`, which `is_wanted` if somebody records. The page before is complete.
    pub(super) fn begin(&mut self, tick: Tick, is_wanted: bool) {
        // The other page was sent while the agents worked on the tick before, so its memory is free again.
        std::mem::swap(&mut self.filling, &mut self.complete);
        self.filling.is_wanted = is_wanted;
        if is_wanted {
            self.filling.header = JournalHeader::of(tick);
            self.filling.entries.iter_mut().for_each(JournalEntry::clear);
        }
    }

    /// Whether somebody records the present tick.
    pub(super) fn is_wanted(&self) -> bool {
        self.filling.is_wanted
    }

    /// Notes what a UAV senses, and how it truly flies.
    pub(super) fn note_sensed(&mut self, sensed: &Sensed, truth: &Truth) {
        // This is called for every UAV in every tick, so it copies nothing while nobody records.
        if self.filling.is_wanted {
            self.filling.entries[sensed.uav.index()].set_sensed(sensed, truth);
        }
    }

    /// Notes what `uav`'s agent commanded and why.
    pub(super) fn note_account(&mut self, uav: UavId, account: &Account) {
        self.filling.entries[uav.index()].set_account(account);
    }

    /// Notes where the leader is.
    pub(super) fn note_leader(&mut self, leader: &LeaderState) {
        self.filling.header.set_leader(leader);
    }

    /// Notes how long the tick took.
    pub(super) fn note_timing(&mut self, timing: &TickTiming) {
        self.filling.header.timing = *timing;
    }

    /// Sends the complete page, unless it was sent before.
    pub(super) fn send(&mut self) -> Result<(), BusError> {
        if std::mem::take(&mut self.complete.is_wanted) {
            self.writer.send(&self.complete.header, &self.complete.entries)?;
        }
        Ok(())
    }

    /// Sends the last page: no further tick will begin.
    pub(super) fn finish(&mut self) -> Result<(), BusError> {
        std::mem::swap(&mut self.filling, &mut self.complete);
        self.send()
    }
}
