//! The swarm as a whole, for tables and plots: `/swarm/state` and `/swarm/metrics`, 20 times a second.

use crate::{
    frame::Frame,
    metrics::{Moment, Pair},
    schema::UavState,
};

/// Every UAV in one message: `/swarm/state`.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmState {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// Those in the sky, the lowest number first.
    #[prost(message, repeated, tag = "2")]
    pub uavs: Vec<SwarmUav>,
}

/// One UAV of [`SwarmState`], rounded to a thousandth or so of each unit; `/uav/001/state` has it to the last bit.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmUav {
    /// Its number, from 1.
    #[prost(uint32, tag = "1")]
    pub uav: u32,
    /// Who flies the airframe.
    #[prost(string, tag = "2")]
    pub mode: String,
    /// True position, east.
    #[prost(double, tag = "3")]
    pub x_m: f64,
    /// True position, north.
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
    /// Distance to the ring neighbour after.
    #[prost(double, optional, tag = "8")]
    pub next_distance_m: Option<f64>,
    /// Distance to the leader.
    #[prost(double, optional, tag = "9")]
    pub leader_distance_m: Option<f64>,
    /// Distance from its slot.
    #[prost(double, optional, tag = "10")]
    pub slot_error_m: Option<f64>,
}

/// The flight measured: `/swarm/metrics`. What does not exist at the moment is absent.
#[derive(Clone, PartialEq, foxglove::Encode, prost::Message)]
pub struct SwarmMetrics {
    /// The tick.
    #[prost(sint64, tag = "1")]
    pub tick: i64,
    /// UAVs that fly on command.
    #[prost(uint32, tag = "2")]
    pub alive: u32,
    /// Their largest slot error.
    #[prost(double, optional, tag = "3")]
    pub slot_error_max_m: Option<f64>,
    /// The root of the mean of their squared slot errors.
    #[prost(double, optional, tag = "4")]
    pub slot_error_rms_m: Option<f64>,
    /// The largest `| |p_i - p_j| - L |` of ring neighbours.
    #[prost(double, optional, tag = "5")]
    pub neighbour_error_max_m: Option<f64>,
    /// The largest `| |p_i - p_c| - R |`.
    #[prost(double, optional, tag = "6")]
    pub radius_error_max_m: Option<f64>,
    /// The closest two in the sky.
    #[prost(double, optional, tag = "7")]
    pub closest_pair_m: Option<f64>,
    /// The closest ring neighbours.
    #[prost(double, optional, tag = "8")]
    pub closest_adjacent_m: Option<f64>,
    /// The closest two that are not ring neighbours.
    #[prost(double, optional, tag = "9")]
    pub closest_other_m: Option<f64>,
    /// The smallest distance to the edge of an obstacle; negative inside.
    #[prost(double, optional, tag = "10")]
    pub clearance_m: Option<f64>,
    /// How well headings agree, 1 when all are the same.
    #[prost(double, optional, tag = "11")]
    pub order: Option<f64>,
    /// V of Eq. (7), from true states.
    #[prost(double, optional, tag = "12")]
    pub lyapunov_m2: Option<f64>,
    /// How often V rose so far although nobody was saturated or repelled.
    #[prost(uint64, tag = "13")]
    pub lyapunov_rises: u64,
    /// Share of this tick's commands that Eq. (12) cut.
    #[prost(double, optional, tag = "14")]
    pub saturated_share: Option<f64>,
    /// Pieces that the ring of those that fly on command is in: 1 while it is connected.
    #[prost(uint32, tag = "15")]
    pub ring_pieces: u32,
    /// The oldest data that an agent used.
    #[prost(double, optional, tag = "16")]
    pub age_max_s: Option<f64>,
    /// The mean age of the data used.
    #[prost(double, optional, tag = "17")]
    pub age_mean_s: Option<f64>,
    /// Views of who lives: 1 where all that fly on command agree.
    #[prost(uint32, tag = "18")]
    pub views: u32,
}

impl SwarmState {
    /// Everybody in `frame`.
    pub(crate) fn of(frame: &Frame) -> Self {
        let states = frame.uavs.iter().filter_map(|uav| uav.state.as_ref());
        Self { tick: frame.tick, uavs: states.map(SwarmUav::of).collect() }
    }
}

impl SwarmUav {
    fn of(state: &UavState) -> Self {
        Self {
            uav: state.uav,
            mode: state.mode.clone(),
            x_m: rounded(state.x_m),
            y_m: rounded(state.y_m),
            heading_rad: rounded(state.heading_rad),
            speed_m_s: rounded(state.speed_m_s),
            turn_rate_rad_s: rounded(state.turn_rate_rad_s),
            next_distance_m: state.next_distance_m.map(rounded),
            leader_distance_m: state.leader_distance_m.map(rounded),
            slot_error_m: state.slot_error_m.map(rounded),
        }
    }
}

impl SwarmMetrics {
    /// The swarm at that `moment`.
    pub(crate) fn of(moment: &Moment) -> Self {
        let distance = |pair: Option<Pair>| pair.map(|pair| pair.distance_m);
        let coherence = moment.coherence;
        Self {
            tick: moment.tick,
            alive: moment.commanded,
            slot_error_max_m: moment.slot_error_max_m,
            slot_error_rms_m: moment.slot_error_rms_m,
            neighbour_error_max_m: moment.neighbour_error_max_m,
            radius_error_max_m: moment.radius_error_max_m,
            closest_pair_m: distance(moment.closest.pair()),
            closest_adjacent_m: distance(moment.closest.adjacent),
            closest_other_m: distance(moment.closest.other),
            clearance_m: moment.clearance_m,
            order: coherence.order,
            lyapunov_m2: moment.lyapunov_m2,
            lyapunov_rises: moment.lyapunov_rises,
            saturated_share: coherence.saturated_share,
            ring_pieces: coherence.ring_pieces,
            age_max_s: coherence.age_max_s,
            age_mean_s: coherence.age_mean_s,
            views: moment.views,
        }
    }
}

/// To 1/1024: whatever viewers can show, in a quarter of the bytes once compressed.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1024.0).round() / 1024.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Metrics, testing};

    #[test]
    fn everybody_in_the_sky_is_in_the_array() {
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
    fn the_metrics_are_those_of_the_moment() {
        let mut scenario = testing::ring_of(4, 40.0);
        scenario.obstacles.push(testing::obstacle([0.0, 100.0]));
        let mut metrics = Metrics::new(&scenario);
        metrics.observe(&testing::at_rest(&scenario, 0));
        let message = SwarmMetrics::of(metrics.moment());
        let radius = scenario.formation().radius_m();
        assert!((message.clearance_m.unwrap() - (100.0 - radius - 10.0)).abs() < 1e-9);
        assert!(message.lyapunov_m2.unwrap() < 1e-9);
        assert_eq!((message.alive, message.ring_pieces, message.order), (4, 1, Some(1.0)));
    }
}
