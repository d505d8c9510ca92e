//! Who is alive, as one UAV knows it from its ring neighbours' messages alone.
//!
//! Each UAV watches the nearest living before and after it. From one that is silent for a quarter of its patience it spreads the
//! suspicion; a suspect that lives hears of it, and refutes it with a higher incarnation. What is not refuted is lost, and
//! the next one beyond is watched. Of two reports of a member the higher standing is the newer, whatever way and however
//! late they came, so that all who hear each other agree in the end. After SWIM (Das, Gupta, Motivala 2002).
//!
//! Never takes lateness for loss: alive is who was heard anew, however old the news. Never knows places.

mod standing;

use ringwing_flight::{Rumour, Tick, UavId, UavState, payload::RUMOURS};
use standing::Standing;

/// The side before a UAV in the ring, and the one after it.
const SIDES: [usize; 2] = [0, 1];
/// A silence of this part of the patience makes suspect.
const SUSPICION: i64 = 4;
/// News go into so many messages before they take turns with older ones.
const TELLINGS: u32 = 4;
/// Patience never grows beyond so many loss timeouts.
const PATIENCE_MAX: i64 = 64;
/// So many lost ones are listened to on each side, for their return; of more, the nearest and one after the other.
const REACH: usize = 8;
/// How often another one of those takes its turn, in loss timeouts.
const TURN: i64 = 2;

/// One UAV's view of the swarm.
#[derive(Debug, Clone)]
pub struct Membership {
    own: UavId,
    timeout_ticks: i64,
    members: Vec<Member>,
    /// Those whose silence counts, with the tick from which on it does: on each side the nearest living, and while it is
    /// silent the next one beyond.
    watched: Vec<(UavId, Tick)>,
    /// The same of the tick before.
    watched_before: Vec<(UavId, Tick)>,
    listened: Vec<UavId>,
    /// Grows with each change of who lives.
    revision: u64,
    /// Of all who are lost.
    lost_fingerprint: u64,
    /// Something was heard that every UAV must know.
    is_disturbed: bool,
    /// Where the rumours that are not fresh go on.
    cursor: usize,
}

/// What is known of one member.
#[derive(Debug, Clone)]
struct Member {
    standing: Standing,
    /// When the newest state that was heard of it was sent.
    newest: Option<Tick>,
    /// When it last gave a sign of life: a new state, or a new incarnation.
    sign: Option<Tick>,
    /// How long a silence is taken for loss.
    patience_ticks: i64,
    /// When the patience changed.
    patient_since: Tick,
    /// The longest silence since then, between two signs of life.
    longest_ticks: i64,
    /// It was suspected here, and has not refuted it yet.
    is_doubted: bool,
    /// How many messages still carry its standing as news.
    tellings: u32,
}

impl Membership {
    /// What UAV `own` of a swarm of `count` knows at first: that all live.
    pub fn new(own: UavId, count: u32, timeout_ticks: i64) -> Self {
        let member = Member {
            standing: Standing::default(),
            newest: None,
            sign: None,
            patience_ticks: timeout_ticks,
            patient_since: Tick::APPROACH,
            longest_ticks: 0,
            is_doubted: false,
            tellings: 0,
        };
        let mut membership = Self {
            own,
            timeout_ticks,
            members: vec![member; count as usize],
            watched: Vec::new(),
            watched_before: Vec::new(),
            listened: Vec::new(),
            revision: 0,
            lost_fingerprint: 0,
            is_disturbed: false,
            cursor: 0,
        };
        membership.listen(Tick::APPROACH);
        membership
    }

    /// Whether `uav` is held for living.
    pub fn lives(&self, uav: UavId) -> bool {
        !self.members[uav.index()].standing.is_lost()
    }

    /// Grows with each change of who lives.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Whom to listen to: those watched, the lost between, for their return, and the neighbours in the whole ring.
    pub fn listened(&self) -> &[UavId] {
        &self.listened
    }

    /// A number for the set of the lost: 0 for none, and equal where two UAVs agree.
    pub fn lost_fingerprint(&self) -> u64 {
        self.lost_fingerprint
    }

    /// Takes in what `state`'s sender said, in tick `now`.
    pub fn hear(&mut self, state: &UavState, now: Tick) {
        let members = 1..=self.count();
        if state.uav == self.own || !members.contains(&state.uav.0) {
            return;
        }
        let sender = &mut self.members[state.uav.index()];
        if sender.newest < Some(state.tick) {
            sender.newest = Some(state.tick);
            sender.speaks(now, self.timeout_ticks);
        }
        for rumour in state.rumours.iter().filter(|rumour| members.contains(&rumour.uav)) {
            self.believe(UavId(rumour.uav), Standing::from(rumour.standing), now);
        }
    }

    /// Judges the silence of the neighbours in tick `now`, after everything was heard.
    pub fn update(&mut self, now: Tick) {
        std::mem::swap(&mut self.watched, &mut self.watched_before);
        self.watched.clear();
        for side in SIDES {
            self.watch(side, now);
        }
        if self.watched != self.watched_before || self.takes_turns() {
            self.listen(now);
        }
    }

    /// What to pass on in this tick: news first, then all the rest in turns.
    pub fn rumours(&mut self) -> [Rumour; RUMOURS] {
        let mut rumours = [Rumour::default(); RUMOURS];
        if self.is_disturbed {
            let mut told = 0;
            self.tell_news(&mut rumours, &mut told);
            self.tell_rest(&mut rumours, &mut told);
        }
        rumours
    }

    fn count(&self) -> u32 {
        self.members.len() as u32
    }

    /// Takes `standing` for `uav`'s if it is newer than what is known.
    fn believe(&mut self, uav: UavId, standing: Standing, now: Tick) {
        let timeout_ticks = self.timeout_ticks;
        let member = &mut self.members[uav.index()];
        if standing <= member.standing {
            return;
        }
        let lived = !member.standing.is_lost();
        if uav == self.own {
            member.standing = standing.refuted();
        } else {
            if standing.incarnation() > member.standing.incarnation() {
                member.refutes(now, timeout_ticks);
            }
            member.standing = standing;
        }
        member.tellings = TELLINGS;
        self.is_disturbed = true;
        if lived == member.standing.is_lost() {
            self.revision += 1;
            self.lost_fingerprint ^= fingerprint(uav);
            self.listen(now);
        }
    }

    /// Watches the living of one side, as far as the first that is not silent.
    fn watch(&mut self, side: usize, now: Tick) {
        for uav in self.around(side) {
            if !self.lives(uav) {
                continue;
            }
            let before = self.watched_before.iter().find(|(watched, _)| *watched == uav);
            let since = before.map_or(now, |(_, since)| *since);
            self.watched.push((uav, since));
            if !self.is_silent(uav, since, now) {
                break;
            }
        }
    }

    /// Whether `uav` has been silent for so long that it is suspected, or lost.
    fn is_silent(&mut self, uav: UavId, since: Tick, now: Tick) -> bool {
        let member = &mut self.members[uav.index()];
        let silence = now.since(member.sign.map_or(since, |sign| sign.max(since)));
        if SUSPICION * silence < member.patience_ticks {
            return false;
        }
        member.is_doubted = true;
        let is_over = silence >= member.patience_ticks;
        let standing = if is_over { member.standing.lost() } else { member.standing.suspected() };
        self.believe(uav, standing, now);
        true
    }

    /// All others, from the nearest before this UAV on, or from the nearest after it.
    fn around(&self, side: usize) -> impl Iterator<Item = UavId> + use<> {
        let (own, count) = (self.own, self.count());
        let step = move |uav: &UavId| Some(if side == 0 { uav.previous(count) } else { uav.next(count) });
        std::iter::successors(step(&own), step).take_while(move |uav| *uav != own)
    }

    /// Whether there are so many lost on a side that they are listened to in turns.
    fn takes_turns(&self) -> bool {
        self.listened.len() > 2 * REACH
    }

    fn listen(&mut self, now: Tick) {
        let mut listened = std::mem::take(&mut self.listened);
        listened.clear();
        for side in SIDES {
            let turn = (now.0 / (TURN * self.timeout_ticks)).unsigned_abs() as usize;
            let nearest = self.around(side).position(|uav| self.lives(uav));
            let lost = nearest.unwrap_or(self.members.len() - 1);
            let beyond = lost.saturating_sub(REACH);
            let whose_turn = (beyond > 0).then(|| REACH + turn % beyond.max(1));
            let is_heard = |place: usize| place < REACH.min(lost) || whose_turn == Some(place);
            let heard = |place: usize| place == 0 || nearest == Some(place) || is_heard(place);
            listened
                .extend(self.around(side).enumerate().filter(|(place, _)| heard(*place)).map(|(_, uav)| uav));
        }
        listened.extend(self.watched.iter().map(|(uav, _)| *uav));
        listened.sort_unstable();
        listened.dedup();
        self.listened = listened;
    }

    fn tell_news(&mut self, rumours: &mut [Rumour; RUMOURS], told: &mut usize) {
        for (index, member) in self.members.iter_mut().enumerate().filter(|(_, member)| member.tellings > 0) {
            let Some(place) = rumours.get_mut(*told) else { return };
            *place = Rumour { uav: index as u32 + 1, standing: member.standing.into() };
            member.tellings -= 1;
            *told += 1;
        }
    }

    fn tell_rest(&mut self, rumours: &mut [Rumour; RUMOURS], told: &mut usize) {
        let (news, count) = (*told, self.members.len());
        for index in (self.cursor..self.cursor + count).map(|index| index % count) {
            let rumour = Rumour { uav: index as u32 + 1, standing: self.members[index].standing.into() };
            if rumour.standing == 0 || rumours[..news].contains(&rumour) {
                continue;
            }
            let Some(place) = rumours.get_mut(*told) else { return };
            *place = rumour;
            *told += 1;
            self.cursor = index + 1;
        }
    }
}

/// A number for one member, which exclusive or makes one for a set.
fn fingerprint(uav: UavId) -> u64 {
    // The multiplier of Knuth's MMIX generator spreads the numbers over all bits.
    u64::from(uav.0).wrapping_mul(6_364_136_223_846_793_005).rotate_left(uav.0)
}

impl Member {
    /// It was heard: where half the patience would have lasted for long, half is enough.
    fn speaks(&mut self, now: Tick, timeout_ticks: i64) {
        let silence = self.sign.map_or(0, |sign| now.since(sign));
        self.sign = Some(now);
        self.longest_ticks = self.longest_ticks.max(silence);
        if self.patience_ticks > timeout_ticks && now.since(self.patient_since) >= 2 * self.patience_ticks {
            let is_too_much = 2 * SUSPICION * self.longest_ticks < self.patience_ticks;
            self.be_patient(if is_too_much { self.patience_ticks / 2 } else { self.patience_ticks }, now);
        }
    }

    /// It lives on: where it was doubted, its silence is no sign, and patience grows.
    fn refutes(&mut self, now: Tick, timeout_ticks: i64) {
        self.sign = Some(now);
        if self.is_doubted {
            self.is_doubted = false;
            self.be_patient((2 * self.patience_ticks).min(PATIENCE_MAX * timeout_ticks), now);
        }
    }

    fn be_patient(&mut self, ticks: i64, now: Tick) {
        (self.patience_ticks, self.patient_since, self.longest_ticks) = (ticks, now, 0);
    }
}
