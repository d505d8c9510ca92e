//! Pictures of space: the 3D panel and the map.

use super::{Subject, panel::Panels};
use crate::palette;
use ringwing_scenario::{Obstacle, Scenario};
use serde_json::{Map, Value, json};

/// What the 3D panel shows; without being listed, a topic is not seen.
const SCENES: [&str; 5] =
    ["/scene/formation", "/scene/obstacles", "/scene/ring", "/scene/trails", "/scene/uavs"];
/// A grid of more lines than this hides what lies on it.
const GRID_LINES: f64 = 120.0;

/// The swarm from behind and above, wherever it goes.
pub(super) fn following(subject: &Subject, panels: &mut Panels) -> Value {
    let radius = subject.scenario.formation().radius_m();
    let camera = camera(radius.mul_add(3.6, 40.0), 42.0, [0.0, 0.0]);
    let config = config(subject.scenario, "leader", "follow-position", &camera);
    panels.add("3D", "The swarm, seen with its leader", config)
}

/// An obstacle from straight above.
pub(super) fn above_obstacle(obstacle: &Obstacle, subject: &Subject, panels: &mut Panels) -> Value {
    let camera = camera(4.5 * obstacle.braking_distance_m, 0.0, obstacle.position_m);
    let config = config(subject.scenario, "map", "follow-none", &camera);
    panels.add("3D", &format!("{} from above", obstacle.name), config)
}

/// Where on the earth it is.
pub(super) fn map(panels: &mut Panels) -> Value {
    let config = json!({
        "disabledTopics": [],
        "followTopic": "/geo/leader",
        "layer": "map",
        "customTileUrl": "",
        "topicColors": { "/geo/leader": palette::ALARM.hex() },
        "zoomLevel": 16,
        "maxNativeZoom": 18,
    });
    panels.add("map", "Map (its tiles need the network)", config)
}

fn camera(distance_m: f64, tilt_deg: f64, [x, y]: [f64; 2]) -> Value {
    json!({
        "perspective": tilt_deg > 0.0,
        "distance": distance_m,
        "phi": tilt_deg,
        "thetaOffset": if tilt_deg > 0.0 { 60.0 } else { 0.0 },
        "target": [0.0, 0.0, 0.0],
        "targetOffset": [x, y, 0.0],
        "targetOrientation": [0.0, 0.0, 0.0, 1.0],
        "fovy": 45.0,
        "near": 0.5,
        "far": 50_000.0,
    })
}

fn config(scenario: &Scenario, frame: &str, mode: &str, camera: &Value) -> Value {
    let shown = SCENES.iter().map(|topic| ((*topic).to_owned(), json!({ "visible": true })));
    let mut topics: Map<String, Value> = shown.collect();
    topics.insert("/leader/pose".into(), leader_arrow(scenario));
    json!({
        "cameraState": camera,
        "followMode": mode,
        "followTf": frame,
        "scene": {
            "backgroundColor": "#15191f",
            "labelScaleFactor": 1,
            "ignoreColladaUpAxis": false,
            "transforms": { "showLabel": false, "axisScale": 0, "lineWidth": 0, "labelSize": 0 },
        },
        "transforms": {},
        "topics": topics,
        "layers": { "grid": grid(scenario) },
        "publish": {},
        "imageMode": {},
    })
}

fn leader_arrow(scenario: &Scenario) -> Value {
    let length = 0.35 * scenario.formation.spacing_m;
    json!({
        "visible": true,
        "type": "arrow",
        "arrowScale": [length, length / 8.0, length / 8.0],
        "color": palette::BRIGHT.hex(),
    })
}

/// Squares of L, or of a multiple of it, under the whole flight.
fn grid(scenario: &Scenario) -> Value {
    let formation = scenario.formation();
    let way_m = scenario.leader.speed_m_s * scenario.time.duration_s;
    let wanted_m = way_m + 12.0 * formation.radius_m();
    let square_m = formation.spacing_m() * (wanted_m / formation.spacing_m() / GRID_LINES).ceil();
    let lines = (wanted_m / square_m).ceil();
    let ahead = ringwing_flight::direction(scenario.leader.heading_deg.to_radians()) * (way_m / 2.0);
    let [x, y] = scenario.leader.start_m;
    json!({
        "layerId": "foxglove.Grid",
        "instanceId": "grid",
        "label": format!("Grid of {square_m} m"),
        "frameId": "map",
        "visible": true,
        "size": lines * square_m,
        "divisions": lines,
        "lineWidth": 1,
        "color": "#5b657366",
        "position": [x + ahead.x, y + ahead.y, -0.1],
        "rotation": [0, 0, 0],
        "order": 1,
    })
}
