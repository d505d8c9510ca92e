//! What one UAV knows of another: its standing, its last sign of life, and how long a silence it is allowed.
//!
//! Never knows where a UAV is in the ring.

use super::standing::Standing;
use ringwing_flight::{Tick, UavState};

/// Suspect a UAV after its patience divided by this. Larger suspects sooner, which spreads more rumours and leaves
/// more time for a refutation; at 1 nobody could refute before the loss.
const SUSPICION_DIVISOR: i64 = 4;
/// The longest patience, in loss timeouts. Larger tolerates worse links; a loss behind such a link shows later.
const PATIENCE_MAX_TIMEOUTS: i64 = 64;
/// The number of states that carry a change as news, ahead of older rumours. More survives more lost states, and delays
/// other news when many UAVs change at once.
const NEWS_COPIES: u32 = 4;

/// What the silence of a watched UAV means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Silence {
    /// Too short to mean anything.
    Short,
    /// Long enough to spread a suspicion, which the UAV can refute.
    Suspicious,
    /// As long as the patience: the UAV is lost.
    Over,
}

/// One UAV as another one knows it.
#[derive(Debug, Clone)]
pub(super) struct MemberRecord {
    pub(super) standing: Standing,
    /// The tick of the newest state that was received from it.
    newest_state: Option<Tick>,
    /// The tick of its last sign of life: a new state, or a new incarnation.
    last_sign: Option<Tick>,
    /// A silence of this length counts as a loss.
    patience_ticks: i64,
    patience_since: Tick,
    /// The longest silence between two signs of life since `patience_since`.
    longest_silence_ticks: i64,
    /// This UAV suspected it, and it has not refuted that yet.
    is_doubted: bool,
    /// The states that will still carry its standing as news.
    news_copies: u32,
}

impl MemberRecord {
    /// A UAV from which nothing was received yet; it is considered alive.
    pub(super) fn new(timeout_ticks: i64) -> Self {
        Self {
            standing: Standing::default(),
            newest_state: None,
            last_sign: None,
            patience_ticks: timeout_ticks,
            patience_since: Tick::APPROACH,
            longest_silence_ticks: 0,
            is_doubted: false,
            news_copies: 0,
        }
    }

    /// Counts a state received in `now` as a sign of life, unless a newer state came before.
    pub(super) fn receive(&mut self, state: &UavState, now: Tick, timeout_ticks: i64) {
        // A duplicate or an overtaken state may arrive long after its sender died, so it proves nothing.
        if self.newest_state >= Some(state.tick) {
            return;
        }
        self.newest_state = Some(state.tick);
        let silence = self.last_sign.map_or(0, |sign| now.since(sign));
        self.last_sign = Some(now);
        self.longest_silence_ticks = self.longest_silence_ticks.max(silence);
        self.shorten_patience(now, timeout_ticks);
    }

    /// Halves a patience that has grown, if for twice its length every silence was too short for a suspicion even at
    /// half the patience.
    fn shorten_patience(&mut self, now: Tick, timeout_ticks: i64) {
        let has_grown = self.patience_ticks > timeout_ticks;
        if has_grown && now.since(self.patience_since) >= 2 * self.patience_ticks {
            let half_is_enough = 2 * SUSPICION_DIVISOR * self.longest_silence_ticks < self.patience_ticks;
            let patience_ticks = if half_is_enough { self.patience_ticks / 2 } else { self.patience_ticks };
            // Begin a new stretch in either case: one old gap must not keep the patience long for ever.
            self.set_patience(patience_ticks, now);
        }
    }

    /// Counts a new incarnation as a sign of life. If this UAV had suspected it, the suspicion was wrong: the link has
    /// longer gaps than assumed, so the patience doubles.
    pub(super) fn refute(&mut self, now: Tick, timeout_ticks: i64) {
        self.last_sign = Some(now);
        if std::mem::take(&mut self.is_doubted) {
            let longest = PATIENCE_MAX_TIMEOUTS * timeout_ticks;
            self.set_patience((2 * self.patience_ticks).min(longest), now);
        }
    }

    fn set_patience(&mut self, ticks: i64, now: Tick) {
        (self.patience_ticks, self.patience_since, self.longest_silence_ticks) = (ticks, now, 0);
    }

    /// Judges its silence in `now`, if it has been watched since `watched_since`. Silence before that does not count,
    /// because nobody listened.
    pub(super) fn judge_silence(&mut self, watched_since: Tick, now: Tick) -> Silence {
        let begin = self.last_sign.map_or(watched_since, |sign| sign.max(watched_since));
        let silence = now.since(begin);
        // Multiply instead of dividing the patience: the quotient would be rounded down, and the suspicion would come
        // too soon.
        if SUSPICION_DIVISOR * silence < self.patience_ticks {
            return Silence::Short;
        }
        self.is_doubted = true;
        if silence < self.patience_ticks { Silence::Suspicious } else { Silence::Over }
    }

    /// Marks its standing as news.
    pub(super) fn make_news(&mut self) {
        self.news_copies = NEWS_COPIES;
    }

    /// Uses up one copy of the news, if there is any left.
    pub(super) fn take_news_copy(&mut self) -> bool {
        let has_news = self.news_copies > 0;
        self.news_copies -= u32::from(has_news);
        has_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reception::sample::test_state;

    const TIMEOUT: i64 = 40;

    fn doubted() -> MemberRecord {
        let mut member = MemberRecord::new(TIMEOUT);
        member.receive(&test_state(0), Tick(0), TIMEOUT);
        assert_eq!(member.judge_silence(Tick(0), Tick(10)), Silence::Suspicious);
        member
    }

    #[test]
    fn a_silence_is_suspicious_after_a_quarter_of_the_patience_and_over_after_all_of_it() {
        let mut member = doubted();
        let judged = [9, 10, 39, 40].map(|now| member.judge_silence(Tick(0), Tick(now)));
        assert_eq!(judged, [Silence::Short, Silence::Suspicious, Silence::Suspicious, Silence::Over]);
        assert_eq!(member.judge_silence(Tick(35), Tick(40)), Silence::Short, "it was not watched before");
    }

    #[test]
    fn a_state_that_was_overtaken_is_no_sign_of_life() {
        let mut member = MemberRecord::new(TIMEOUT);
        member.receive(&test_state(5), Tick(6), TIMEOUT);
        member.receive(&test_state(4), Tick(30), TIMEOUT);
        assert_eq!(member.judge_silence(Tick(0), Tick(46)), Silence::Over);
    }

    #[test]
    fn patience_doubles_after_a_refuted_suspicion_and_not_without_one() {
        let mut member = doubted();
        member.refute(Tick(100), TIMEOUT);
        assert_eq!(member.judge_silence(Tick(0), Tick(119)), Silence::Short);
        assert_eq!(member.patience_ticks, 2 * TIMEOUT);
        member.refute(Tick(120), TIMEOUT);
        assert_eq!(member.patience_ticks, 2 * TIMEOUT);
    }

    #[test]
    fn patience_has_a_limit() {
        let mut member = MemberRecord::new(TIMEOUT);
        for _ in 0..10 {
            member.is_doubted = true;
            member.refute(Tick(0), TIMEOUT);
        }
        assert_eq!(member.patience_ticks, 64 * TIMEOUT);
    }

    #[test]
    fn patience_that_has_grown_halves_after_a_long_time_without_gaps_only() {
        for (gap, halves) in [(9, true), (10, false)] {
            let mut member = doubted();
            member.refute(Tick(100), TIMEOUT);
            let mut now = 100;
            while now < 260 {
                assert_eq!(member.patience_ticks, 2 * TIMEOUT);
                now = (now + gap).min(260);
                member.receive(&test_state(now), Tick(now), TIMEOUT);
            }
            assert_eq!(member.patience_ticks == TIMEOUT, halves, "gaps of {gap} ticks");
        }
    }

    #[test]
    fn patience_that_has_not_grown_never_shrinks() {
        let mut member = MemberRecord::new(TIMEOUT);
        (0..4 * TIMEOUT).for_each(|now| member.receive(&test_state(now), Tick(now), TIMEOUT));
        assert_eq!(member.patience_ticks, TIMEOUT);
    }

    #[test]
    fn news_is_sent_a_few_times() {
        let mut member = doubted();
        assert!(!member.take_news_copy());
        member.make_news();
        let copies = std::iter::repeat_with(|| member.take_news_copy()).take(10).filter(|sent| *sent).count();
        assert_eq!(copies, 4);
    }
}
