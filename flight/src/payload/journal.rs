//! What the world keeps for the log: everything that it sent in a tick, and everything that came back.

use crate::{Account, LeaderState, Sensed, Tick, TickTiming, Truth};
use bytemuck::{Pod, Zeroable};

/// What the journal says of a tick as a whole. A [`JournalEntry`] for each UAV follows, UAV 1 first.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalHeader {
    /// How long the tick took. Wall-clock times: they differ between two flights that are otherwise equal.
    pub timing: TickTiming,
    /// Where the leader was, if `has_leader` is 1, else zero.
    leader: LeaderState,
    /// 1 if the leader's state of this tick came, else 0.
    has_leader: u32,
    /// Zero; keeps the layout free of padding.
    reserved: u32,
}

impl JournalHeader {
    /// The header of a tick without a leader.
    pub fn of(tick: Tick) -> Self {
        Self { timing: TickTiming { tick: tick.0, ..TickTiming::default() }, ..Self::zeroed() }
    }

    /// The tick.
    pub fn tick(&self) -> Tick {
        Tick(self.timing.tick)
    }

    /// Where the leader was, if it sent its state of this tick.
    pub fn leader(&self) -> Option<&LeaderState> {
        (self.has_leader == 1).then_some(&self.leader)
    }

    /// Takes the leader's state.
    pub fn set_leader(&mut self, leader: &LeaderState) {
        (self.leader, self.has_leader) = (*leader, 1);
    }
}

/// What the journal says of one UAV in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalEntry {
    /// What the UAV sensed, if `is_in_sky` is 1, else zero.
    sensed: Sensed,
    /// What its agent commanded and why, if `has_account` is 1, else zero.
    account: Account,
    /// How it truly flew, if `is_in_sky` is 1, else zero.
    truth: Truth,
    /// 1 if the UAV was in the sky, else 0.
    is_in_sky: u32,
    /// 1 if an account came, else 0.
    has_account: u32,
}

impl JournalEntry {
    /// An entry without any data.
    pub fn empty() -> Self {
        Self::zeroed()
    }

    /// What the UAV sensed; `None` once it has left the sky.
    pub fn sensed(&self) -> Option<&Sensed> {
        (self.is_in_sky == 1).then_some(&self.sensed)
    }

    /// How the UAV truly flew; `None` once it has left the sky.
    pub fn truth(&self) -> Option<&Truth> {
        (self.is_in_sky == 1).then_some(&self.truth)
    }

    /// What the UAV's agent commanded and why; `None` if it gave no command. In real time it may be the account of an
    /// earlier tick that came late.
    pub fn account(&self) -> Option<&Account> {
        (self.has_account == 1).then_some(&self.account)
    }

    /// Takes what the UAV sensed, and how it truly flew.
    pub fn set_sensed(&mut self, sensed: &Sensed, truth: &Truth) {
        (self.sensed, self.truth, self.is_in_sky) = (*sensed, *truth, 1);
    }

    /// Takes the agent's account.
    pub fn set_account(&mut self, account: &Account) {
        (self.account, self.has_account) = (*account, 1);
    }

    /// Empties the entry. The bytes of the values stay, and only the flags say that they are void: clearing all
    /// entries of a large swarm each tick would take longer than filling them.
    pub fn clear(&mut self) {
        (self.is_in_sky, self.has_account) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Command, UavId};

    #[test]
    fn an_entry_shows_only_what_it_was_given_since_it_was_cleared() {
        let mut entry = JournalEntry::empty();
        assert_eq!((entry.sensed(), entry.account()), (None, None));
        let account = Account::without_leader(&Command::withheld(Tick(5), UavId(2)));
        entry.set_account(&account);
        assert_eq!((entry.sensed(), entry.account()), (None, Some(&account)));
        entry.clear();
        assert_eq!((entry.sensed(), entry.account()), (None, None));
    }
}
