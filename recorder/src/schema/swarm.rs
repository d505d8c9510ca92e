//! The messages about the whole swarm, for tables and plots: `/swarm/state` and `/swarm/metrics`.
//!
//! Never measures anything: values come from the frame and from the metrics of its moment.

use crate::metrics::{FlownRing, Frame, Moment, TrueState, UavPair};

/// Every UAV in one message: `/swarm/state`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmState {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// The UAVs in the sky, by ascending number.
    #[prost(message, repeated, tag = "2")]
    pub uavs: Vec<SwarmUav>,
}

/// One UAV of [`SwarmState`], its values rounded for tables; `/uav/001/state` has the exact values.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmUav {
    /// The UAV's number, from 1.
    #[prost(uint32, tag = "1")]
    pub uav: u32,
    /// What controls the airframe: `commanded`, or the name of its failsafe.
    #[prost(string, tag = "2")]
    pub mode: String,
    /// True position, metres east.
    #[prost(double, tag = "3")]
    pub x_m: f64,
    /// True position, metres north.
    #[prost(double, tag = "4")]
    pub y_m: f64,
    /// Heading from the x axis, counterclockwise.
    #[prost(double, tag = "5")]
    pub heading_rad: f64,
    /// Speed flown.
    #[prost(double, tag = "6")]
    pub speed_m_s: f64,
    /// Turn rate flown.
    #[prost(double, tag = "7")]
    pub turn_rate_rad_s: f64,
    /// Distance to the next ring neighbour.
    #[prost(double, optional, tag = "8")]
    pub next_distance_m: Option<f64>,
    /// Distance to the leader.
    #[prost(double, optional, tag = "9")]
    pub leader_distance_m: Option<f64>,
    /// Distance from its slot.
    #[prost(double, optional, tag = "10")]
    pub slot_error_m: Option<f64>,
}

/// The metrics of one moment: `/swarm/metrics`. A value that does not exist at the moment is absent.
///
/// All values are rounded, because panels show every digit that a message has.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmMetrics {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// Number of UAVs that fly on command.
    #[prost(uint32, tag = "2")]
    pub alive: u32,
    /// Their largest slot error.
    #[prost(double, optional, tag = "3")]
    pub slot_error_max_m: Option<f64>,
    /// Root mean square of their slot errors.
    #[prost(double, optional, tag = "4")]
    pub slot_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours.
    #[prost(double, optional, tag = "5")]
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |`.
    #[prost(double, optional, tag = "6")]
    pub radius_error_max_m: Option<f64>,
    /// Distance of the closest two UAVs in the sky.
    #[prost(double, optional, tag = "7")]
    pub closest_pair_m: Option<f64>,
    /// Distance of the closest two ring neighbours.
    #[prost(double, optional, tag = "8")]
    pub closest_adjacent_m: Option<f64>,
    /// Distance of the closest two UAVs that are not ring neighbours.
    #[prost(double, optional, tag = "9")]
    pub closest_other_m: Option<f64>,
    /// The smallest distance to the edge of an obstacle; negative inside.
    #[prost(double, optional, tag = "10")]
    pub clearance_m: Option<f64>,
    /// Agreement of headings, from 0 to 1; 1 when all are equal.
    #[prost(double, optional, tag = "11")]
    pub order: Option<f64>,
    /// V of Eq. (7), from true states.
    #[prost(double, optional, tag = "12")]
    pub lyapunov_m2: Option<f64>,
    /// Number of ticks so far in which V rose although no UAV was saturated or repelled.
    #[prost(uint64, tag = "13")]
    pub lyapunov_rises: u64,
    /// Share of this tick's commands that the saturation of Eq. (12) cut.
    #[prost(double, optional, tag = "14")]
    pub saturated_share: Option<f64>,
    /// Number of connected pieces of the ring of UAVs that fly on command; 1 while it is whole.
    #[prost(uint32, tag = "15")]
    pub ring_pieces: u32,
    /// Age of the oldest data that an agent used in this tick.
    #[prost(double, optional, tag = "16")]
    pub age_max_s: Option<f64>,
    /// Mean age of the data that agents used in this tick.
    #[prost(double, optional, tag = "17")]
    pub age_mean_s: Option<f64>,
    /// Number of different views of who is alive; 1 when all UAVs that fly on command agree.
    #[prost(uint32, tag = "18")]
    pub views: u32,
    /// The radius of the ring that is flown: R, until the ring closes after a loss.
    #[prost(double, optional, tag = "19")]
    pub ring_radius_m: Option<f64>,
    /// The distance between its slots: L. Absent if the slots are not evenly spread.
    #[prost(double, optional, tag = "20")]
    pub ring_spacing_m: Option<f64>,
    /// Distance of the closest UAV from an intruder.
    #[prost(double, optional, tag = "21")]
    pub intruder_distance_m: Option<f64>,
    /// Number of near misses so far.
    #[prost(uint64, tag = "22")]
    pub near_misses: u64,
    /// Number of UAVs whose collision filter acts.
    #[prost(uint32, tag = "23")]
    pub filters_acting: u32,
    /// The largest angle between the heading that a filter takes and that of the law's course.
    #[prost(double, optional, tag = "24")]
    pub filter_turn_max_rad: Option<f64>,
    /// The largest difference between a commanded speed and the one that the law asked for, while a filter acts.
    #[prost(double, optional, tag = "25")]
    pub filter_speed_max_m_s: Option<f64>,
}

impl SwarmState {
    /// The UAVs of `frame`.
    pub(crate) fn of(frame: &Frame) -> Self {
        // A UAV that left the sky has no row: zeros would show it at the origin.
        let states = frame.uavs.iter().filter_map(|uav| uav.state.as_ref());
        Self { tick: frame.tick, uavs: states.map(SwarmUav::of).collect() }
    }
}

impl SwarmUav {
    fn of(state: &TrueState) -> Self {
        Self {
            uav: state.uav,
            mode: state.mode.name().into(),
            x_m: shown(state.x_m),
            y_m: shown(state.y_m),
            heading_rad: shown(state.heading_rad),
            speed_m_s: shown(state.speed_m_s),
            turn_rate_rad_s: shown(state.turn_rate_rad_s),
            next_distance_m: state.next_distance_m.map(shown),
            leader_distance_m: state.leader_distance_m.map(shown),
            slot_error_m: state.slot_error_m.map(shown),
        }
    }
}

impl SwarmMetrics {
    /// The metrics of `moment`, in which the swarm flies `ring`.
    pub(crate) fn of(moment: &Moment, ring: &FlownRing) -> Self {
        let distance = |pair: Option<UavPair>| pair.map(|pair| shown(pair.distance_m));
        let coherence = moment.coherence;
        Self {
            tick: moment.tick,
            // The log keeps this name for other programs, although a UAV in its failsafe is alive, too.
            alive: moment.commanded,
            slot_error_max_m: moment.slot_error_max_m.map(shown),
            slot_error_rms_m: moment.slot_error_rms_m.map(shown),
            neighbour_error_max_m: moment.neighbour_error_max_m.map(shown),
            radius_error_max_m: moment.radius_error_max_m.map(shown),
            closest_pair_m: distance(moment.closest.pair()),
            closest_adjacent_m: distance(moment.closest.adjacent),
            closest_other_m: distance(moment.closest.other),
            clearance_m: moment.clearance_m.map(shown),
            order: coherence.order.map(shown),
            lyapunov_m2: moment.lyapunov_m2.map(shown),
            lyapunov_rises: moment.lyapunov_rises,
            saturated_share: coherence.saturated_share.map(shown),
            ring_pieces: coherence.ring_pieces,
            age_max_s: coherence.age_max_s.map(shown),
            age_mean_s: coherence.age_mean_s.map(shown),
            views: moment.views,
            ring_radius_m: ring.radius_m().map(shown),
            ring_spacing_m: ring.spacing_m().map(shown),
            intruder_distance_m: moment.intruder_distance_m.map(shown),
            near_misses: moment.near_misses,
            filters_acting: moment.avoidance.acting,
            filter_turn_max_rad: moment.avoidance.turn_max_rad.map(shown),
            filter_speed_max_m_s: moment.avoidance.speed_max_m_s.map(shown),
        }
    }
}

/// Rounds to four decimals: below that, a distance is rounding noise, and a table cell has no room for more.
fn shown(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Rounds to 1/1024: finer than viewers show, and a quarter of the bytes once compressed, because the low bits are zero.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1024.0).round() / 1024.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Metrics, testing};

    #[test]
    fn the_state_lists_every_uav_in_the_sky() {
        let scenario = testing::ring_of(4, 40.0);
        let mut frame = testing::at_rest(&scenario, 7);
        frame.uavs[1].state = None;
        let state = SwarmState::of(&frame);
        assert_eq!(
            (state.tick, state.uavs.iter().map(|uav| uav.uav).collect::<Vec<_>>()),
            (7, vec![1, 3, 4])
        );
        assert_eq!(state.uavs[0].next_distance_m, Some(40.0));
    }

    #[test]
    fn the_message_holds_the_metrics_of_the_moment() {
        let mut scenario = testing::ring_of(4, 40.0);
        scenario.obstacles.push(testing::obstacle([0.0, 100.0]));
        let mut metrics = Metrics::new(&scenario);
        metrics.observe(&testing::at_rest(&scenario, 0));
        let frame = testing::at_rest(&scenario, 0);
        let message = SwarmMetrics::of(metrics.moment(), &frame.ring);
        let radius = scenario.formation().radius_m();
        assert!((message.clearance_m.unwrap() - (100.0 - radius - 10.0)).abs() < 1e-4);
        assert_eq!((message.ring_radius_m, message.ring_spacing_m), (Some(shown(radius)), Some(40.0)));
        assert!(message.lyapunov_m2.unwrap() < 1e-9);
        assert_eq!((message.alive, message.ring_pieces, message.order), (4, 1, Some(1.0)));
    }
}
