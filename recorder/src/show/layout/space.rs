//! The 3D panels and the map.

use super::{ShownLog, panel::Panels};
use crate::{
    schema::topics,
    show::{palette, scene::obstacle_frame},
};
use nalgebra::Point2;
use ringwing_scenario::{ObstacleSection, Scenario};
use serde_json::{Map, Value, json};

/// Topics of the 3D panel. Viewers hide topics that a layout does not list.
const SCENES: [&str; 8] = [
    topics::ESTIMATE_SCENE,
    topics::FORMATION_SCENE,
    topics::OBSTACLE_SCENE,
    topics::PATH_SCENE,
    topics::RING_SCENE,
    topics::TRAIL_SCENE,
    topics::UAV_SCENE,
    topics::WIND_SCENE,
];
/// Distance of the camera as a multiple of the largest distance from the leader at the start. A smaller one cuts off the
/// last aircraft in the first view; a larger one makes the formed ring too small.
const START_VIEW: f64 = 2.6;
/// Places at which the extent of the leader's path is measured. Between fewer, a wide turn could leave the grid.
const EXTENT_PLACES: u32 = 200;
/// Most lines of the grid in each direction. More lines hide what lies on them.
const GRID_LINES: f64 = 120.0;

/// A 3D panel that follows the swarm, seen from behind and above.
pub(super) fn following(shown: &ShownLog, panels: &mut Panels) -> Value {
    // Far enough that the formation fits with a margin, and the whole swarm at the start.
    let radius_m = shown.scenario.reach_m();
    let camera = camera(radius_m.mul_add(3.6, 40.0).max(START_VIEW * shown.reach_m), 42.0, [0.0, 0.0]);
    let config = config(shown.scenario, "leader", "follow-position", &camera);
    panels.add("3D", "The swarm, following its leader", config)
}

/// A 3D panel that looks down on the `number`th obstacle from straight above, and follows it if it moves.
pub(super) fn above_obstacle(
    number: usize,
    obstacle: &ObstacleSection,
    shown: &ShownLog,
    panels: &mut Panels,
) -> Value {
    let above = |place_m| camera(4.5 * obstacle.braking_distance_m, 0.0, place_m);
    let config = if obstacle.moves() {
        config(shown.scenario, &obstacle_frame(number), "follow-position", &above([0.0; 2]))
    } else {
        config(shown.scenario, "map", "follow-none", &above(obstacle.position_m))
    };
    panels.add("3D", &format!("{} from above", obstacle.name), config)
}

/// The map panel, which follows the leader.
pub(super) fn map(panels: &mut Panels) -> Value {
    let config = json!({
        "disabledTopics": [],
        "followTopic": topics::LEADER_FIX,
        "layer": "map",
        "customTileUrl": "",
        "topicColors": { topics::LEADER_FIX: palette::ALARM.hex() },
        "zoomLevel": 16,
        "maxNativeZoom": 18,
    });
    panels.add("map", "Map (tiles need a network connection)", config)
}

/// A camera `distance_m` from `[x, y]`; without a tilt it looks straight down, north up, without perspective.
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

/// Settings of a 3D panel whose camera follows the coordinate frame `frame` in Foxglove's follow mode `mode`.
fn config(scenario: &Scenario, frame: &str, mode: &str, camera: &Value) -> Value {
    let shown = SCENES.iter().map(|topic| ((*topic).to_owned(), json!({ "visible": true })));
    let mut shown_topics: Map<String, Value> = shown.collect();
    shown_topics.insert(topics::LEADER_POSE.into(), leader_arrow(scenario));
    json!({
        "cameraState": camera,
        "followMode": mode,
        "followTf": frame,
        "scene": {
            "backgroundColor": "#15191f",
            "labelScaleFactor": 1,
            "ignoreColladaUpAxis": false,
            // `/tf` has a frame for each UAV; their axes and labels would hide the aircraft.
            "transforms": { "showLabel": false, "axisScale": 0, "lineWidth": 0, "labelSize": 0 },
        },
        "transforms": {},
        "topics": shown_topics,
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

/// A grid under the whole flight, with squares of the spacing L or a multiple of it.
fn grid(scenario: &Scenario) -> Value {
    let formation = scenario.formation();
    // The leader's path, with a margin around the formation.
    let (middle, way_m) = extent(scenario);
    let wanted_m = way_m + 12.0 * scenario.reach_m();
    // A multiple of L, so that distances can be read off the squares, and large enough to need no more than
    // `GRID_LINES`.
    let square_m = formation.spacing_m() * (wanted_m / formation.spacing_m() / GRID_LINES).ceil();
    let lines = (wanted_m / square_m).ceil();
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
        // Below the ground: in one plane with circles and links, the grid would flicker through them.
        "position": [middle.x, middle.y, -0.1],
        "rotation": [0, 0, 0],
        "order": 1,
    })
}

/// The middle of the leader's path and its largest extent, in metres.
fn extent(scenario: &Scenario) -> (Point2<f64>, f64) {
    let path = scenario.leader_path();
    let places: Vec<_> = path.places(scenario.time.duration_s, EXTENT_PLACES).collect();
    let bound = |pick: fn(f64, f64) -> f64, axis: usize| {
        places.iter().map(|place| place[axis]).fold(places[0][axis], pick)
    };
    let (low, high) = ([0, 1].map(|axis| bound(f64::min, axis)), [0, 1].map(|axis| bound(f64::max, axis)));
    let (low, high) = (Point2::from(low), Point2::from(high));
    (nalgebra::center(&low, &high), (high - low).norm())
}
