//! Which rumours a UAV puts into its states: changes first, then the standings of all others in turn.
//!
//! Never decides who is alive, only what to tell about it.

use super::record::MemberRecord;
use ringwing_flight::{Rumour, payload::RUMOURS};

/// What was sent, and what to send next.
#[derive(Debug, Clone, Default)]
pub(super) struct Dissemination {
    /// Set by the first change. Until then all rumours are empty, so that a flight without losses sends the same states
    /// with and without a membership.
    has_changes: bool,
    /// The index of the member to repeat next once the news is sent.
    next_in_turn: usize,
}

impl Dissemination {
    /// Marks the standing of `member` as news.
    pub(super) fn spread(&mut self, member: &mut MemberRecord) {
        self.has_changes = true;
        member.make_news();
    }

    /// The rumours to send in this tick; entries that are left over are empty.
    pub(super) fn rumours(&mut self, members: &mut [MemberRecord]) -> [Rumour; RUMOURS] {
        let mut rumours = [Rumour::default(); RUMOURS];
        if self.has_changes {
            let news = add_news(members, &mut rumours);
            self.add_in_turn(members, &mut rumours, news);
        }
        rumours
    }

    /// Fills the entries after the first `news` with the standings of other members, in turn.
    ///
    /// Repeated standings reach a UAV that was cut off or restarted after the news had spread.
    fn add_in_turn(&mut self, members: &[MemberRecord], rumours: &mut [Rumour; RUMOURS], news: usize) {
        let (mut filled, count) = (news, members.len());
        for index in (self.next_in_turn..self.next_in_turn + count).map(|index| index % count) {
            let rumour = rumour(index, &members[index]);
            // Skip the standing that every UAV assumes anyway: alive in the first incarnation.
            if rumour.standing == 0 || rumours[..news].contains(&rumour) {
                continue;
            }
            let Some(place) = rumours.get_mut(filled) else { return };
            *place = rumour;
            filled += 1;
            // The next state continues here: all standings come round, even if they do not fit into one state.
            self.next_in_turn = index + 1;
        }
    }
}

/// Fills `rumours` with news and returns how many there are.
fn add_news(members: &mut [MemberRecord], rumours: &mut [Rumour; RUMOURS]) -> usize {
    let mut filled = 0;
    for (index, member) in members.iter_mut().enumerate() {
        // Members with lower numbers go first. They use up their copies in a few ticks, so the rest does not wait
        // long.
        if filled == RUMOURS {
            break;
        }
        if member.take_news_copy() {
            rumours[filled] = rumour(index, member);
            filled += 1;
        }
    }
    filled
}

fn rumour(index: usize, member: &MemberRecord) -> Rumour {
    Rumour { uav: index as u32 + 1, standing: member.standing.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty members, all in their second incarnation.
    fn members() -> Vec<MemberRecord> {
        let mut member = MemberRecord::new(10);
        member.standing = 3.into();
        vec![member; 20]
    }

    fn uavs(rumours: &[Rumour]) -> Vec<u32> {
        rumours.iter().map(|rumour| rumour.uav).collect()
    }

    #[test]
    fn without_a_change_all_rumours_are_empty() {
        assert_eq!(Dissemination::default().rumours(&mut members()), [Rumour::default(); RUMOURS]);
    }

    #[test]
    fn news_comes_first_four_times_and_the_rest_takes_turns() {
        let (mut dissemination, mut members) = (Dissemination::default(), members());
        dissemination.spread(&mut members[4]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [5, 1, 2, 3, 4, 6, 7, 8]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [5, 9, 10, 11, 12, 13, 14, 15]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [5, 16, 17, 18, 19, 20, 1, 2]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [5, 3, 4, 6, 7, 8, 9, 10]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [11, 12, 13, 14, 15, 16, 17, 18]);
    }

    #[test]
    fn members_that_were_never_suspected_need_no_rumour() {
        let (mut dissemination, mut members) = (Dissemination::default(), members());
        members[2..].fill(MemberRecord::new(10));
        dissemination.spread(&mut members[0]);
        assert_eq!(uavs(&dissemination.rumours(&mut members)), [1, 2, 0, 0, 0, 0, 0, 0]);
    }
}
