//! The tabs of the layout: the most common questions first, then obstacles, faults and ages, timing, the table and the
//! map.
//!
//! Never makes a tab for something that the log does not hold.

use super::{
    LISTED_UAVS, ShownLog,
    panel::{Panels, above, beside, stacked, tab},
    plots::PlotPanel,
    space,
};
use crate::{
    schema::topics::{self, UavTopic},
    show::palette,
};
use serde_json::{Value, json};

/// Obstacles with a close-up of their own. More would make all close-ups too small.
const CLOSE_UPS: usize = 2;
/// UAVs with a row in the panel of flight modes. More rows would push the other panels off the screen.
const LISTED_MODES: usize = 8;

/// All tabs that have something to show.
pub(super) fn all(shown: &ShownLog, panels: &mut Panels) -> Vec<Value> {
    let mut tabs = vec![tab("Flight", &flight(shown, panels))];
    if !shown.scenario.all_obstacles().is_empty() {
        tabs.push(tab("Obstacles", &obstacles(shown, panels)));
    }
    // Always there: faults may be requested in flight, long after this layout is written.
    tabs.push(tab("Faults and ages", &faults(shown, panels)));
    if shown.timing {
        tabs.push(tab("Timing", &timing(shown.scenario.time.real_time, panels)));
    }
    tabs.push(tab("Table", &table(shown, panels)));
    tabs.push(tab("Map", &space::map(panels)));
    tabs
}

fn flight(shown: &ShownLog, panels: &mut Panels) -> Value {
    let texts = beside(log(panels), 58.0, metrics(panels));
    let picture = above(space::following(shown, panels), 66.0, texts);
    let mut distances = vec![neighbours(shown, panels), leader_distances(shown, panels)];
    // The selected UAVs may all be in their slots while others are not.
    if shown.scenario.formation.uavs > LISTED_UAVS {
        distances.insert(0, slot_errors(shown, panels));
    }
    let inputs = stacked(vec![speeds(shown, panels), turn_rates(shown, panels)]);
    // The plots of inputs show two limits each and need more room for their legends.
    let share = if distances.len() == 2 { 46.0 } else { 58.0 };
    beside(picture, 50.0, above(stacked(distances), share, inputs))
}

fn neighbours(shown: &ShownLog, panels: &mut Panels) -> Value {
    PlotPanel::new("Distance to the next ring neighbour (m)")
        .reference(topics::SWARM_METRICS, "ring_spacing_m", "L of the ring flown")
        .uavs(shown, UavTopic::State, "next_distance_m")
        .within(0.0, 1.2 * shown.gap_m)
        .add_to(panels)
}

fn leader_distances(shown: &ShownLog, panels: &mut Panels) -> Value {
    PlotPanel::new("Distance to the leader (m)")
        .reference(topics::SWARM_METRICS, "ring_radius_m", "R of the ring flown")
        .uavs(shown, UavTopic::State, "leader_distance_m")
        // A lost UAV flies off for the rest of the flight. Following it, the axis would flatten all other lines.
        .within(0.0, 1.2 * shown.reach_m)
        .add_to(panels)
}

fn slot_errors(shown: &ShownLog, panels: &mut Panels) -> Value {
    let plot = if shown.scenario.formation.uavs <= LISTED_UAVS {
        PlotPanel::new("Distance from the slot (m)").uavs(shown, UavTopic::State, "slot_error_m")
    } else {
        PlotPanel::new("Distance from the slot, all UAVs (m)")
            .line(topics::SWARM_METRICS, "slot_error_max_m", "largest", palette::ALARM)
            .line(topics::SWARM_METRICS, "slot_error_rms_m", "RMS", palette::CALM)
    };
    plot.add_to(panels)
}

fn speeds(shown: &ShownLog, panels: &mut Panels) -> Value {
    let limits = &shown.scenario.airframe;
    PlotPanel::new("Speed (m/s)")
        .level(limits.speed_min_m_s, "v_min")
        .level(limits.speed_max_m_s, "v_max")
        .uavs(shown, UavTopic::State, "speed_m_s")
        // Keep both limits in view, however little the speeds vary.
        .within(limits.speed_min_m_s - 1.0, limits.speed_max_m_s + 1.0)
        .add_to(panels)
}

fn turn_rates(shown: &ShownLog, panels: &mut Panels) -> Value {
    let limit = shown.scenario.airframe.turn_rate_max_rad_s;
    PlotPanel::new("Turn rate (rad/s)")
        .level(limit, "omega_max")
        .level(-limit, "-omega_max")
        .uavs(shown, UavTopic::State, "turn_rate_rad_s")
        .within(-1.15 * limit, 1.15 * limit)
        .add_to(panels)
}

/// The panel that lists the events of the flight.
fn log(panels: &mut Panels) -> Value {
    panels.add("RosOut", "Log", json!({ "searchTerms": [], "minLogLevel": 1, "topicToRender": topics::LOG }))
}

fn metrics(panels: &mut Panels) -> Value {
    raw(topics::SWARM_METRICS, "Metrics", panels)
}

/// A panel that shows the current message of `topic`, field by field.
fn raw(topic: &str, title: &str, panels: &mut Panels) -> Value {
    let config = json!({
        "topicPath": topic,
        "diffEnabled": false,
        "diffMethod": "custom",
        "diffTopicPath": "",
        "showFullMessageForDiff": false,
        "expansion": "all",
        "fontSize": 11,
    });
    panels.add("RawMessages", title, config)
}

/// The paper's Figures 7 and 8: distance and repulsion, beside close-ups of the obstacles.
fn obstacles(shown: &ShownLog, panels: &mut Panels) -> Value {
    let obstacles = shown.scenario.all_obstacles();
    let farthest = obstacles.iter().map(|one| one.braking_distance_m).fold(0.0, f64::max);
    // Beyond the farthest reach nothing is repelled, and a larger range would flatten the curves that matter.
    let mut distances =
        PlotPanel::new("Distance to the centre of the nearest obstacle (m)").within(0.0, 2.0 * farthest);
    for obstacle in obstacles.iter().take(CLOSE_UPS) {
        distances = distances
            .level(obstacle.radius_m, &format!("R_obs of {}", obstacle.name))
            .level(obstacle.braking_distance_m, &format!("L_obs of {}", obstacle.name));
    }
    distances = distances.uavs(shown, UavTopic::State, "obstacle_distance_m");
    let plots = vec![
        distances.add_to(panels),
        PlotPanel::new("Repulsion of obstacles (m)")
            .uavs(shown, UavTopic::Control, "repulsion_m")
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Clearance: the smallest distance to an edge (m)")
            .line(topics::SWARM_METRICS, "clearance_m", "clearance", palette::CALM)
            .level(0.0, "edge")
            // Some metres below the edge, so that a collision shows.
            .within(-5.0, 2.0 * farthest)
            .add_to(panels),
    ];
    let close_ups = (1..).zip(&obstacles).take(CLOSE_UPS);
    let close_ups =
        close_ups.map(|(number, one)| space::above_obstacle(number, one, shown, panels)).collect();
    beside(stacked(plots), 58.0, stacked(close_ups))
}

fn faults(shown: &ShownLog, panels: &mut Panels) -> Value {
    let counts = PlotPanel::new("Faults (number of processes or UAVs)")
        .line(topics::FAULTS, "lost", "lost", palette::colour(1))
        .line(topics::FAULTS, "frozen", "frozen", palette::colour(2))
        .line(topics::FAULTS, "failsafe", "in failsafe", palette::colour(3))
        .line(topics::FAULTS, "collided", "collided", palette::ALARM)
        .line(topics::SWARM_METRICS, "ring_pieces", "pieces of the ring", palette::BRIGHT)
        .line(topics::SWARM_METRICS, "views", "views of who is alive", palette::CALM)
        .from(0.0)
        .add_to(panels);
    let mut texts = beside(raw(topics::FAULTS, "Current faults", panels), 45.0, log(panels));
    // The topic has messages only while a link has faults.
    if !shown.scenario.schedule().link_faults().is_empty() {
        texts = beside(texts, 68.0, raw(topics::LINKS, "Counts of the last link reported", panels));
    }
    let plots = vec![
        PlotPanel::new("Age of data of the previous neighbour (s)")
            .uavs(shown, UavTopic::Control, "previous_age_s")
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Age of data of the next neighbour (s)")
            .uavs(shown, UavTopic::Control, "next_age_s")
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Age of data of the leader (s)")
            .uavs(shown, UavTopic::Control, "leader_age_s")
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Age of data in the swarm (s)")
            .line(topics::SWARM_METRICS, "age_max_s", "largest", palette::ALARM)
            .line(topics::SWARM_METRICS, "age_mean_s", "mean", palette::CALM)
            .from(0.0)
            .add_to(panels),
    ];
    // The height of the mode panel grows with its rows.
    let listed = shown.uavs.len().min(LISTED_MODES) as f64;
    let left = above(modes(shown, panels), 4.0 + 6.6 * listed, above(counts, 50.0, texts));
    beside(left, 46.0, stacked(plots))
}

/// The panel that shows over time what controls each airframe.
fn modes(shown: &ShownLog, panels: &mut Panels) -> Value {
    let mode = |uav: &u32| {
        json!({
            "value": format!("{}.mode", shown.topic(*uav, UavTopic::State)),
            "label": format!("uav {uav}"),
            "timestampMethod": "receiveTime",
            "enabled": true,
        })
    };
    let paths: Vec<_> = shown.uavs.iter().take(LISTED_MODES).map(mode).collect();
    panels.add("StateTransitions", "What controls each airframe", json!({ "paths": paths, "isSynced": true }))
}

fn timing(real_time: bool, panels: &mut Panels) -> Value {
    let mut plots = vec![
        PlotPanel::new("Round trip of a tick, percentiles of each second (us of wall-clock time)")
            .line(topics::TIMING_PERCENTILES, "p50_us", "p50", palette::colour(3))
            .line(topics::TIMING_PERCENTILES, "p90_us", "p90", palette::colour(2))
            .line(topics::TIMING_PERCENTILES, "p99_us", "p99", palette::colour(1))
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Round trip of a tick, and its parts (us of wall-clock time)")
            .line(topics::TIMING, "round_trip_us", "round trip", palette::BRIGHT)
            .line(topics::TIMING, "wake_us", "wake", palette::colour(1))
            .line(topics::TIMING, "read_us", "read", palette::colour(2))
            .line(topics::TIMING, "compute_us", "compute", palette::colour(3))
            .line(topics::TIMING, "return_us", "return", palette::colour(7))
            .from(0.0)
            .add_to(panels),
        PlotPanel::new("Airframes by the command they used")
            .line(topics::TIMING, "answered", "answered in time", palette::CALM)
            .line(topics::TIMING, "reused", "on an older command", palette::colour(1))
            .from(0.0)
            .add_to(panels),
    ];
    // In lockstep there are no deadlines to be late for.
    if real_time {
        plots.push(
            PlotPanel::new("Lateness of ticks against their deadlines (us)")
                .line(topics::TIMING, "late_us", "late", palette::ALARM)
                .from(0.0)
                .add_to(panels),
        );
        plots.push(
            PlotPanel::new("Deadlines missed by a period or more")
                .line(topics::TIMING, "missed_deadlines", "missed", palette::ALARM)
                .from(0.0)
                .add_to(panels),
        );
    }
    stacked(plots)
}

fn table(shown: &ShownLog, panels: &mut Panels) -> Value {
    let swarm =
        // A path to an array: the panel makes a row of each UAV.
        panels.add("Table", "The swarm", json!({ "topicPath": format!("{}.uavs", topics::SWARM_STATE) }));
    let lyapunov = PlotPanel::new("Lyapunov value V, Eq. 7 (m2), and its unexplained rises")
        .line(topics::SWARM_METRICS, "lyapunov_m2", "V", palette::CALM)
        .line(topics::SWARM_METRICS, "lyapunov_rises", "rises", palette::ALARM)
        .from(0.0)
        .add_to(panels);
    let order = PlotPanel::new("Agreement of headings, share of saturated commands")
        .line(topics::SWARM_METRICS, "order", "order", palette::CALM)
        .line(topics::SWARM_METRICS, "saturated_share", "saturated", palette::ALARM)
        .within(0.0, 1.05)
        .add_to(panels);
    let closest = PlotPanel::new("Closest pairs (m)")
        .line(topics::SWARM_METRICS, "closest_adjacent_m", "ring neighbours", palette::CALM)
        .line(topics::SWARM_METRICS, "closest_other_m", "all others", palette::ALARM)
        .from(0.0)
        .add_to(panels);
    let left = stacked(vec![slot_errors(shown, panels), closest]);
    let right = stacked(vec![lyapunov, order]);
    above(swarm, 36.0, beside(left, 37.0, beside(right, 59.0, metrics(panels))))
}
