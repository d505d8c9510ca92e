//! The tabs: what a person asks first, then obstacles, faults and ages, timing, the table and the map.

use super::{
    LISTED_UAVS, Subject,
    panel::{Panels, above, beside, stacked, tab},
    plots::Plot,
    space,
};
use crate::palette;
use serde_json::{Value, json};

/// More obstacles than this have no picture of their own.
const OBSTACLES: usize = 2;
/// So many UAVs have a line of their own that tells who flies them.
const LISTED_MODES: usize = 8;

/// All tabs that have something to show.
pub(super) fn all(subject: &Subject, panels: &mut Panels) -> Vec<Value> {
    let mut tabs = vec![tab("Flight", &flight(subject, panels))];
    if !subject.scenario.obstacles.is_empty() {
        tabs.push(tab("Obstacles", &obstacles(subject, panels)));
    }
    tabs.push(tab("Faults and ages", &faults(subject, panels)));
    if subject.timing {
        tabs.push(tab("Timing", &timing(subject.scenario.time.real_time, panels)));
    }
    tabs.push(tab("Table", &table(subject, panels)));
    tabs.push(tab("Map", &space::map(panels)));
    tabs
}

fn flight(subject: &Subject, panels: &mut Panels) -> Value {
    let told = beside(log(panels), 58.0, metrics(panels));
    let picture = above(space::following(subject, panels), 66.0, told);
    let mut distances = vec![neighbours(subject, panels), leader_distances(subject, panels)];
    if subject.scenario.formation.uavs > LISTED_UAVS {
        distances.insert(0, slot_errors(subject, panels));
    }
    let inputs = stacked(vec![speeds(subject, panels), turn_rates(subject, panels)]);
    // The inputs have two limits each, and so the longer legends.
    let share = if distances.len() == 2 { 46.0 } else { 58.0 };
    beside(picture, 50.0, above(stacked(distances), share, inputs))
}

fn neighbours(subject: &Subject, panels: &mut Panels) -> Value {
    Plot::new("Distance to the next in the ring (m)")
        .level(subject.scenario.formation.spacing_m, "L")
        .uavs(subject, "state", "next_distance_m")
        .add_to(panels)
}

fn leader_distances(subject: &Subject, panels: &mut Panels) -> Value {
    Plot::new("Distance to the leader (m)")
        .level(subject.scenario.formation().radius_m(), "R")
        .uavs(subject, "state", "leader_distance_m")
        .add_to(panels)
}

fn slot_errors(subject: &Subject, panels: &mut Panels) -> Value {
    let plot = if subject.scenario.formation.uavs <= LISTED_UAVS {
        Plot::new("Distance from the slot (m)").uavs(subject, "state", "slot_error_m")
    } else {
        Plot::new("Distance from the slot, of all (m)")
            .line("/swarm/metrics.slot_error_max_m", "largest", palette::ALARM)
            .line("/swarm/metrics.slot_error_rms_m", "RMS", palette::CALM)
    };
    plot.add_to(panels)
}

fn speeds(subject: &Subject, panels: &mut Panels) -> Value {
    let limits = &subject.scenario.airframe;
    Plot::new("Speed (m/s)")
        .level(limits.speed_min_m_s, "v_min")
        .level(limits.speed_max_m_s, "v_max")
        .uavs(subject, "state", "speed_m_s")
        .within(limits.speed_min_m_s - 1.0, limits.speed_max_m_s + 1.0)
        .add_to(panels)
}

fn turn_rates(subject: &Subject, panels: &mut Panels) -> Value {
    let limit = subject.scenario.airframe.turn_rate_max_rad_s;
    Plot::new("Turn rate (rad/s)")
        .level(limit, "omega_max")
        .level(-limit, "-omega_max")
        .uavs(subject, "state", "turn_rate_rad_s")
        .within(-1.15 * limit, 1.15 * limit)
        .add_to(panels)
}

fn log(panels: &mut Panels) -> Value {
    panels.add("RosOut", "Log", json!({ "searchTerms": [], "minLogLevel": 1, "topicToRender": "/log" }))
}

fn metrics(panels: &mut Panels) -> Value {
    raw("/swarm/metrics", "Metrics", panels)
}

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

/// The paper's Figures 7 and 8: distance and repulsion, beside the places where they come from.
fn obstacles(subject: &Subject, panels: &mut Panels) -> Value {
    let farthest = subject.scenario.obstacles.iter().map(|one| one.braking_distance_m).fold(0.0, f64::max);
    let mut distances =
        Plot::new("Distance to the centre of the nearest obstacle (m)").within(0.0, 2.0 * farthest);
    for obstacle in subject.scenario.obstacles.iter().take(OBSTACLES) {
        distances = distances
            .level(obstacle.radius_m, &format!("R_obs of {}", obstacle.name))
            .level(obstacle.braking_distance_m, &format!("L_obs of {}", obstacle.name));
    }
    distances = distances.uavs(subject, "state", "obstacle_distance_m");
    let plots = vec![
        distances.add_to(panels),
        Plot::new("Repulsion of obstacles (m)")
            .uavs(subject, "control", "repulsion_m")
            .from(0.0)
            .add_to(panels),
        Plot::new("Clearance: the smallest distance to an edge (m)")
            .line("/swarm/metrics.clearance_m", "clearance", palette::CALM)
            .level(0.0, "edge")
            .within(-5.0, 2.0 * farthest)
            .add_to(panels),
    ];
    let close_ups = subject.scenario.obstacles.iter().take(OBSTACLES);
    let close_ups = close_ups.map(|one| space::above_obstacle(one, subject, panels)).collect();
    beside(stacked(plots), 58.0, stacked(close_ups))
}

fn faults(subject: &Subject, panels: &mut Panels) -> Value {
    let counts = Plot::new("What is wrong (number of processes or UAVs)")
        .line("/faults.lost", "lost", palette::colour(1))
        .line("/faults.frozen", "frozen", palette::colour(2))
        .line("/faults.failsafe", "in failsafe", palette::colour(3))
        .line("/faults.collided", "collided", palette::ALARM)
        .line("/swarm/metrics.ring_pieces", "pieces of the ring", palette::BRIGHT)
        .line("/swarm/metrics.views", "views of who lives", palette::CALM)
        .from(0.0)
        .add_to(panels);
    let told = beside(raw("/faults", "What is wrong now", panels), 45.0, log(panels));
    let plots = vec![
        Plot::new("Age of what is known of the previous one (s)")
            .uavs(subject, "control", "previous_age_s")
            .from(0.0)
            .add_to(panels),
        Plot::new("Age of what is known of the next one (s)")
            .uavs(subject, "control", "next_age_s")
            .from(0.0)
            .add_to(panels),
        Plot::new("Age of what is known of the leader (s)")
            .uavs(subject, "control", "leader_age_s")
            .from(0.0)
            .add_to(panels),
        Plot::new("Age of information in the swarm (s)")
            .line("/swarm/metrics.age_max_s", "largest", palette::ALARM)
            .line("/swarm/metrics.age_mean_s", "mean", palette::CALM)
            .from(0.0)
            .add_to(panels),
    ];
    let listed = subject.uavs.len().min(LISTED_MODES) as f64;
    let left = above(modes(subject, panels), 4.0 + 6.6 * listed, above(counts, 50.0, told));
    beside(left, 46.0, stacked(plots))
}

fn modes(subject: &Subject, panels: &mut Panels) -> Value {
    let mode = |uav: &u32| {
        json!({
            "value": format!("{}.mode", subject.topic(*uav, "state")),
            "label": format!("uav {uav}"),
            "timestampMethod": "receiveTime",
            "enabled": true,
        })
    };
    let paths: Vec<_> = subject.uavs.iter().take(LISTED_MODES).map(mode).collect();
    panels.add("StateTransitions", "Who flies each airframe", json!({ "paths": paths, "isSynced": true }))
}

fn timing(real_time: bool, panels: &mut Panels) -> Value {
    let mut plots = vec![
        Plot::new("Round trip of a tick, and its parts (us of wall-clock time)")
            .line("/timing.round_trip_us", "round trip", palette::BRIGHT)
            .line("/timing.wake_us", "wake", palette::colour(1))
            .line("/timing.read_us", "read", palette::colour(2))
            .line("/timing.compute_us", "compute", palette::colour(3))
            .line("/timing.return_us", "return", palette::colour(7))
            .from(0.0)
            .add_to(panels),
        Plot::new("Airframes by the command they flew on")
            .line("/timing.answered", "answered in time", palette::CALM)
            .line("/timing.reused", "on an older command", palette::colour(1))
            .from(0.0)
            .add_to(panels),
    ];
    if real_time {
        plots.push(
            Plot::new("Lateness of ticks against their deadlines (us)")
                .line("/timing.late_us", "late", palette::ALARM)
                .from(0.0)
                .add_to(panels),
        );
        plots.push(
            Plot::new("Deadlines missed by a period or more")
                .line("/timing.missed_deadlines", "missed", palette::ALARM)
                .from(0.0)
                .add_to(panels),
        );
    }
    stacked(plots)
}

fn table(subject: &Subject, panels: &mut Panels) -> Value {
    let swarm = panels.add("Table", "The swarm", json!({ "topicPath": "/swarm/state.uavs" }));
    let lyapunov = Plot::new("Lyapunov value V, Eq. 7 (m2), and its unexcused rises")
        .line("/swarm/metrics.lyapunov_m2", "V", palette::CALM)
        .line("/swarm/metrics.lyapunov_rises", "rises", palette::ALARM)
        .from(0.0)
        .add_to(panels);
    let order = Plot::new("Order of headings, share of saturated commands")
        .line("/swarm/metrics.order", "order", palette::CALM)
        .line("/swarm/metrics.saturated_share", "saturated", palette::ALARM)
        .within(0.0, 1.05)
        .add_to(panels);
    let closest = Plot::new("Closest two (m)")
        .line("/swarm/metrics.closest_adjacent_m", "ring neighbours", palette::CALM)
        .line("/swarm/metrics.closest_other_m", "all others", palette::ALARM)
        .from(0.0)
        .add_to(panels);
    let left = stacked(vec![slot_errors(subject, panels), closest]);
    let right = stacked(vec![lyapunov, order]);
    above(swarm, 36.0, beside(left, 37.0, beside(right, 59.0, metrics(panels))))
}
