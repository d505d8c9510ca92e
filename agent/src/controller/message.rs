//! A situation and a wish as bytes, for a controller that does not run in its agent's process.
//!
//! Must never lose a bit: a flight does not depend on where its controller runs.

use super::Wish;
use crate::{
    law::Limits,
    pilot::{EstimatedLeader, Membership, PeerTrack, RingNeighbour, Situation},
};
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_read_unaligned};
use nalgebra::{Point2, Vector2};
use ringwing_flight::{FormationFrame, Notes, Pose, Sensed, Tick, Traffic, UavId};

/// Number of this layout. Increase it when a field is added, moves, or changes its meaning.
pub const LAYOUT: u32 = 1;
/// Size of a wish as bytes.
pub const WISH_BYTES: usize = size_of::<WishBytes>();
/// Size of a situation as bytes, without the numbers of the lost UAVs, which follow.
pub const SITUATION_BYTES: usize = size_of::<SituationBytes>();

/// A situation that has arrived as bytes.
#[derive(Debug, Clone)]
pub struct ReceivedSituation {
    bytes: Box<SituationBytes>,
    limits: Limits,
    tracks: [Option<PeerTrack>; 2],
    lost: Vec<UavId>,
}

/// The fixed part of a [`Situation`].
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SituationBytes {
    sensed: Sensed,
    /// Zeroed if nobody reports traffic.
    traffic: Traffic,
    neighbours: [NeighbourBytes; 2],
    leader: LeaderBytes,
    own: PoseBytes,
    tick: Tick,
    period_s: f64,
    speed_min_m_s: f64,
    speed_max_m_s: f64,
    turn_rate_max_rad_s: f64,
    wind_m_s: [f64; 2],
    slot_offset_m: [f64; 2],
    radius_m: f64,
    lost_fingerprint: u64,
    uav: UavId,
    living: u32,
    has_traffic: u32,
    has_leader: u32,
    leader_is_silent: u32,
    turns_with_leader: u32,
    slots_are_moving: u32,
    /// How many numbers of lost UAVs follow.
    lost: u32,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct PoseBytes {
    position_m: [f64; 2],
    heading_rad: f64,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TrackBytes {
    tick: Tick,
    pose: PoseBytes,
    speed_m_s: f64,
    turn_rate_rad_s: f64,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct LeaderBytes {
    track: TrackBytes,
    pose: PoseBytes,
    frame_rad: f64,
}

/// Whether a neighbour is there, and whether anything has been heard of it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct NeighbourBytes {
    track: TrackBytes,
    rest_m: f64,
    uav: UavId,
    is_there: u16,
    has_track: u16,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct WishBytes {
    speed_m_s: f64,
    turn_rate_rad_s: f64,
    notes: Notes,
}

impl PoseBytes {
    fn of(pose: &Pose) -> Self {
        Self { position_m: pose.position.into(), heading_rad: pose.heading_rad }
    }

    fn pose(&self) -> Pose {
        Pose { position: Point2::from(self.position_m), heading_rad: self.heading_rad }
    }
}

impl TrackBytes {
    fn of(track: &PeerTrack) -> Self {
        let PeerTrack { tick, pose, speed_m_s, turn_rate_rad_s } = *track;
        Self { tick, pose: PoseBytes::of(&pose), speed_m_s, turn_rate_rad_s }
    }

    fn track(&self) -> PeerTrack {
        let Self { tick, pose, speed_m_s, turn_rate_rad_s } = *self;
        PeerTrack { tick, pose: pose.pose(), speed_m_s, turn_rate_rad_s }
    }
}

impl LeaderBytes {
    fn of(leader: &EstimatedLeader) -> Self {
        let EstimatedLeader { track, pose, frame_rad } = leader;
        Self { track: TrackBytes::of(track), pose: PoseBytes::of(pose), frame_rad: *frame_rad }
    }

    fn leader(&self) -> EstimatedLeader {
        EstimatedLeader { track: self.track.track(), pose: self.pose.pose(), frame_rad: self.frame_rad }
    }
}

impl NeighbourBytes {
    fn of(neighbour: Option<&RingNeighbour<'_>>) -> Self {
        let Some(RingNeighbour { uav, rest_m, track }) = neighbour else { return Self::zeroed() };
        Self {
            track: track.map_or_else(Zeroable::zeroed, TrackBytes::of),
            rest_m: *rest_m,
            uav: *uav,
            is_there: 1,
            has_track: u16::from(track.is_some()),
        }
    }
}

impl SituationBytes {
    fn of(situation: &Situation<'_>) -> Self {
        let Situation { limits, membership, .. } = situation;
        Self {
            sensed: *situation.sensed,
            traffic: situation.traffic.copied().unwrap_or_else(Zeroable::zeroed),
            neighbours: situation
                .neighbours
                .each_ref()
                .map(|neighbour| NeighbourBytes::of(neighbour.as_ref())),
            leader: situation.leader.as_ref().map_or_else(Zeroable::zeroed, LeaderBytes::of),
            own: PoseBytes::of(&situation.own),
            tick: situation.tick,
            period_s: situation.period_s,
            speed_min_m_s: limits.speed_min_m_s(),
            speed_max_m_s: limits.speed_max_m_s(),
            turn_rate_max_rad_s: limits.turn_rate_max_rad_s(),
            wind_m_s: situation.wind_m_s.into(),
            slot_offset_m: situation.slot_offset_m.into(),
            radius_m: situation.radius_m,
            lost_fingerprint: membership.lost_fingerprint,
            uav: situation.uav,
            living: membership.living,
            has_traffic: u32::from(situation.traffic.is_some()),
            has_leader: u32::from(situation.leader.is_some()),
            leader_is_silent: u32::from(situation.leader_is_silent),
            turns_with_leader: u32::from(situation.frame == FormationFrame::Leader),
            slots_are_moving: u32::from(membership.slots_are_moving),
            lost: membership.lost.len() as u32,
        }
    }
}

/// The bytes of `situation`.
pub fn situation_bytes(situation: &Situation<'_>) -> Vec<u8> {
    [bytes_of(&SituationBytes::of(situation)), cast_slice(situation.membership.lost)].concat()
}

impl ReceivedSituation {
    /// The situation of these bytes; `None` if no agent sends such bytes.
    pub fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let (fixed, lost) = bytes.split_at_checked(SITUATION_BYTES)?;
        let fixed: SituationBytes = pod_read_unaligned(fixed);
        let (lost, rest) = lost.as_chunks::<{ size_of::<UavId>() }>();
        if lost.len() != fixed.lost as usize || !rest.is_empty() {
            return None;
        }
        let limits = Limits::new(fixed.speed_min_m_s, fixed.speed_max_m_s, fixed.turn_rate_max_rad_s).ok()?;
        let track = |neighbour: NeighbourBytes| (neighbour.has_track != 0).then(|| neighbour.track.track());
        Some(Self {
            limits,
            tracks: fixed.neighbours.map(track),
            lost: lost.iter().map(|number| pod_read_unaligned(number)).collect(),
            bytes: Box::new(fixed),
        })
    }

    /// The situation.
    pub fn situation(&self) -> Situation<'_> {
        let bytes = &*self.bytes;
        let [previous, next] = [0, 1].map(|place| self.neighbour(place));
        Situation {
            tick: bytes.tick,
            period_s: bytes.period_s,
            uav: bytes.uav,
            limits: self.limits,
            own: bytes.own.pose(),
            sensed: &bytes.sensed,
            neighbours: [previous, next],
            leader: (bytes.has_leader != 0).then(|| bytes.leader.leader()),
            wind_m_s: Vector2::from(bytes.wind_m_s),
            leader_is_silent: bytes.leader_is_silent != 0,
            slot_offset_m: Vector2::from(bytes.slot_offset_m),
            radius_m: bytes.radius_m,
            frame: if bytes.turns_with_leader == 0 { FormationFrame::Fixed } else { FormationFrame::Leader },
            traffic: (bytes.has_traffic != 0).then_some(&bytes.traffic),
            membership: Membership {
                living: bytes.living,
                lost: &self.lost,
                lost_fingerprint: bytes.lost_fingerprint,
                slots_are_moving: bytes.slots_are_moving != 0,
            },
        }
    }

    fn neighbour(&self, place: usize) -> Option<RingNeighbour<'_>> {
        let NeighbourBytes { uav, rest_m, is_there, .. } = self.bytes.neighbours[place];
        (is_there != 0).then(|| RingNeighbour { uav, rest_m, track: self.tracks[place].as_ref() })
    }
}

/// The bytes of `wish`.
pub fn wish_bytes(wish: &Wish) -> Vec<u8> {
    let Wish { speed_m_s, turn_rate_rad_s, notes } = *wish;
    bytes_of(&WishBytes { speed_m_s, turn_rate_rad_s, notes }).to_vec()
}

/// The wish of these bytes; `None` if no controller sends such bytes.
pub fn wish_of_bytes(bytes: &[u8]) -> Option<Wish> {
    (bytes.len() == WISH_BYTES).then(|| {
        let WishBytes { speed_m_s, turn_rate_rad_s, notes } = pod_read_unaligned(bytes);
        Wish { speed_m_s, turn_rate_rad_s, notes }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(x: f64) -> PeerTrack {
        let pose = Pose { position: Point2::new(x, -2.5), heading_rad: 0.25 };
        PeerTrack { tick: Tick(40), pose, speed_m_s: 15.5, turn_rate_rad_s: -0.125 }
    }

    /// A situation in which every part that can be there is there.
    fn full<'a>(
        sensed: &'a Sensed,
        traffic: &'a Traffic,
        heard: &'a PeerTrack,
        lost: &'a [UavId],
    ) -> Situation<'a> {
        let neighbour = |uav, rest_m, track| Some(RingNeighbour { uav: UavId(uav), rest_m, track });
        Situation {
            tick: Tick(42),
            period_s: 0.01,
            uav: UavId(3),
            limits: Limits::new(10.0, 20.0, 0.5).unwrap(),
            own: Pose { position: Point2::new(0.1, 1e300), heading_rad: -3.0 },
            sensed,
            neighbours: [neighbour(2, 40.0, Some(heard)), neighbour(5, 80.0, None)],
            leader: Some(EstimatedLeader { track: track(7.0), pose: track(8.0).pose, frame_rad: 0.2 }),
            wind_m_s: Vector2::new(1.0, -0.0),
            leader_is_silent: true,
            slot_offset_m: Vector2::new(-40.0, 5e-324),
            radius_m: 40.0,
            frame: FormationFrame::Leader,
            traffic: Some(traffic),
            membership: Membership { living: 4, lost, lost_fingerprint: u64::MAX, slots_are_moving: true },
        }
    }

    #[test]
    fn a_situation_arrives_as_it_was_sent_to_the_bit() {
        let sensed = Sensed { tick: Tick(41), position_m: [f64::MIN_POSITIVE, -1.0], ..Sensed::zeroed() };
        let traffic = Traffic { tick: Tick(42), ..Traffic::zeroed() };
        let (heard, lost) = (track(1.0), [UavId(4), UavId(6)]);
        let sent = full(&sensed, &traffic, &heard, &lost);
        let without = Situation {
            neighbours: [None, None],
            leader: None,
            traffic: None,
            frame: FormationFrame::Fixed,
            membership: Membership { lost: &[], ..sent.membership },
            ..sent
        };
        for situation in [sent, without] {
            let received = ReceivedSituation::of_bytes(&situation_bytes(&situation)).unwrap();
            // Debug shows each number with all its digits.
            assert_eq!(format!("{:?}", received.situation()), format!("{situation:?}"));
        }
    }

    #[test]
    fn a_wish_arrives_with_its_notes_even_if_it_is_nan() {
        let wish = Wish::new(15.0, f64::NAN).with_note("gain", 2.0);
        let received = wish_of_bytes(&wish_bytes(&wish)).unwrap();
        assert_eq!(format!("{received:?}"), format!("{wish:?}"));
        assert_eq!(wish_of_bytes(&wish_bytes(&wish)[1..]), None);
    }

    #[test]
    fn bytes_that_no_agent_sends_are_refused() {
        let (sensed, traffic) = (Sensed::zeroed(), Traffic::zeroed());
        let bytes = situation_bytes(&full(&sensed, &traffic, &track(1.0), &[UavId(4)]));
        for wrong in [
            &bytes[..bytes.len() - 1],
            &bytes[..bytes.len() - 4],
            &bytes[..10],
            &[bytes.as_slice(), &[0; 4]].concat(),
        ] {
            assert!(ReceivedSituation::of_bytes(wrong).is_none(), "{} bytes", wrong.len());
        }
        // Without limits, no wish could be cut to them.
        assert!(ReceivedSituation::of_bytes(&[0; SITUATION_BYTES]).is_none());
    }
}
