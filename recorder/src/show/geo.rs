//! Converts local positions to latitude and longitude for the map panel: `/geo/leader` and `/geo/uavs`.
//!
//! The local frame is the plane tangent to the WGS 84 ellipsoid at the scenario's origin, x east and y north. The
//! conversion is exact, by way of earth-centred coordinates; the altitude is the scenario's everywhere. Never flattens
//! the earth by a degrees-per-metre factor, which is wrong far from the origin and near the poles.

use super::{
    circle,
    palette::{self, Rgb},
};
use crate::{clock::Clock, metrics::Frame};
use foxglove::messages::{GeoJson, LocationFix};
use nalgebra::{Point2, Point3, Vector2, Vector3};
use ringwing_flight::{IntruderId, LeaderState, Pose, Route, Tick, UavId, direction};
use ringwing_scenario::{IntruderSection, ObstacleSection, Scenario};
use serde_json::{Value, json};

/// Semi-major axis of the WGS 84 ellipsoid, metres.
const A_M: f64 = 6_378_137.0;
/// First eccentricity of the WGS 84 ellipsoid, squared.
const E2: f64 = 6.694_379_990_141_316e-3;
/// Iterations for the latitude. Each gains two to three digits, so fewer lose precision and more change nothing.
const ROUNDS: usize = 6;
/// Corners of the arrowhead that marks a UAV, in metres along its heading and to its left. RFC 7946 requires closed
/// polygons, whose last corner repeats the first, with counterclockwise corners.
const ARROWHEAD_M: [(f64, f64); 5] = [(8.0, 0.0), (-6.0, 5.0), (-3.0, 0.0), (-6.0, -5.0), (8.0, 0.0)];
/// Corners of an obstacle's outline. Fewer look angular; each costs about 30 bytes in every map message.
const OUTLINE_CORNERS: u32 = 24;
/// Most obstacles on the map. With more, their outlines would make up most of every map message.
const OBSTACLES: usize = 16;

/// A position on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Geodetic {
    /// Positive in the north.
    pub(crate) latitude_deg: f64,
    /// Positive in the east.
    pub(crate) longitude_deg: f64,
}

/// An obstacle on the map.
#[derive(Debug, Clone)]
enum MappedObstacle {
    /// It stands, so its map feature is computed once.
    Standing(Value),
    Moving(ObstacleSection, Route),
}

/// The plane tangent to the earth at the scenario's origin.
#[derive(Debug, Clone)]
pub(crate) struct Earth {
    /// The origin in earth-centred coordinates, metres.
    origin: Point3<f64>,
    east: Vector3<f64>,
    north: Vector3<f64>,
    altitude_m: f64,
    obstacles: Vec<MappedObstacle>,
    intruders: Vec<Route>,
}

impl Earth {
    /// The plane tangent to the earth at the origin of `scenario`, with its obstacles and intruders.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let georeference = &scenario.georeference;
        let (latitude, longitude) =
            (georeference.latitude_deg.to_radians(), georeference.longitude_deg.to_radians());
        let (sin_lat, cos_lat) = (libm::sin(latitude), libm::cos(latitude));
        let (sin_lon, cos_lon) = (libm::sin(longitude), libm::cos(longitude));
        // Radius of curvature in the prime vertical.
        let n = A_M / (1.0 - E2 * sin_lat * sin_lat).sqrt();
        let mut earth = Self {
            origin: Point3::new(n * cos_lat * cos_lon, n * cos_lat * sin_lon, n * (1.0 - E2) * sin_lat),
            east: Vector3::new(-sin_lon, cos_lon, 0.0),
            north: Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            altitude_m: georeference.altitude_m,
            obstacles: Vec::new(),
            intruders: scenario.intruders.iter().map(IntruderSection::route).collect(),
        };
        earth.obstacles =
            scenario.all_obstacles().iter().take(OBSTACLES).map(|obstacle| earth.mapped(obstacle)).collect();
        earth
    }

    fn mapped(&self, obstacle: &ObstacleSection) -> MappedObstacle {
        if obstacle.moves() {
            MappedObstacle::Moving(obstacle.clone(), obstacle.route())
        } else {
            MappedObstacle::Standing(self.obstacle_on_map(obstacle, obstacle.position_m.into()))
        }
    }

    /// Latitude and longitude of `place` in the plane.
    pub(crate) fn locate(&self, place: Point2<f64>) -> Geodetic {
        let point = self.origin + self.east * place.x + self.north * place.y;
        let from_axis = libm::hypot(point.x, point.y);
        // Fixed-point iteration for the geodetic latitude, from the value that is exact at height 0.
        let mut latitude = libm::atan2(point.z, from_axis * (1.0 - E2));
        for _ in 0..ROUNDS {
            let sin = libm::sin(latitude);
            let n = A_M / (1.0 - E2 * sin * sin).sqrt();
            latitude = libm::atan2(point.z + E2 * n * sin, from_axis);
        }
        Geodetic {
            latitude_deg: latitude.to_degrees(),
            longitude_deg: libm::atan2(point.y, point.x).to_degrees(),
        }
    }

    /// The leader's position for the map: `/geo/leader`.
    pub(crate) fn leader_fix(&self, leader: &LeaderState, clock: Clock) -> LocationFix {
        let Geodetic { latitude_deg, longitude_deg } = self.locate(leader.position_m.into());
        LocationFix {
            timestamp: Some(clock.timestamp(leader.tick.0)),
            frame_id: "map".into(),
            latitude: latitude_deg,
            longitude: longitude_deg,
            altitude: self.altitude_m,
            // The schema lets the colour be absent, but rerun's converter fails without it.
            color: Some(palette::BRIGHT.in_scene(1.0)),
            ..LocationFix::default()
        }
    }

    /// The obstacles, the intruders and the UAVs in the sky as map features: `/geo/uavs`.
    pub(crate) fn uavs_on_map(&self, frame: &Frame, clock: Clock) -> GeoJson {
        let time_s = Tick(frame.tick).seconds(clock.rate_hz());
        let obstacles = self.obstacles.iter().map(|obstacle| match obstacle {
            MappedObstacle::Standing(feature) => feature.clone(),
            MappedObstacle::Moving(one, route) => self.obstacle_on_map(one, route.at(time_s).pose.position),
        });
        let intruders = (1..).zip(&self.intruders).map(|(number, route)| {
            self.aircraft_on_map(&IntruderId(number).to_string(), &route.at(time_s).pose, palette::ALARM)
        });
        let uavs = frame.uavs.iter().filter_map(|uav| uav.state.as_ref()).map(|state| {
            let pose = Pose { position: state.position(), heading_rad: state.heading_rad };
            self.aircraft_on_map(&UavId(state.uav).to_string(), &pose, palette::colour(state.uav))
        });
        let features: Vec<Value> = obstacles.chain(intruders).chain(uavs).collect();
        GeoJson { geojson: json!({ "type": "FeatureCollection", "features": features }).to_string() }
    }

    /// An arrowhead along the heading. A point would appear as a pin, which hides its neighbours.
    fn aircraft_on_map(&self, name: &str, pose: &Pose, colour: Rgb) -> Value {
        let (place, ahead) = (pose.position, direction(pose.heading_rad));
        let left = Vector2::new(-ahead.y, ahead.x);
        let corner = |(along, across): (f64, f64)| self.coordinates(place + ahead * along + left * across);
        let outline: Vec<Value> = ARROWHEAD_M.into_iter().map(corner).collect();
        let colour = colour.hex();
        feature(
            name,
            &json!({ "type": "Polygon", "coordinates": [outline] }),
            &json!({ "color": colour, "fillColor": colour, "fillOpacity": 1.0, "opacity": 1.0, "weight": 1 }),
        )
    }

    fn obstacle_on_map(&self, obstacle: &ObstacleSection, centre: Point2<f64>) -> Value {
        let corners = circle::polygon(centre, obstacle.radius_m, OUTLINE_CORNERS);
        let mut outline: Vec<Value> = corners.map(|corner| self.coordinates(corner)).collect();
        // RFC 7946 wants closed polygons: the last corner repeats the first.
        outline.extend(outline.first().cloned());
        feature(
            &obstacle.name,
            &json!({ "type": "Polygon", "coordinates": [outline] }),
            &json!({ "color": palette::ALARM.hex() }),
        )
    }

    /// Longitude and latitude in degrees, rounded to a centimetre to shorten the text.
    fn coordinates(&self, place: Point2<f64>) -> Value {
        let Geodetic { latitude_deg, longitude_deg } = self.locate(place);
        let rounded = |degrees: f64| (degrees * 1e7).round() / 1e7;
        // RFC 7946 puts the longitude first.
        json!([rounded(longitude_deg), rounded(latitude_deg)])
    }
}

fn feature(name: &str, geometry: &Value, style: &Value) -> Value {
    json!({ "type": "Feature", "geometry": geometry, "properties": { "name": name, "style": style } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use proptest::prelude::*;
    use ringwing_scenario::GeoreferenceSection;

    /// The earth at `georeference`, with nothing on it.
    fn bare(georeference: GeoreferenceSection) -> Earth {
        Earth::new(&Scenario { georeference, ..Scenario::default() })
    }

    fn earth_with(obstacle: ObstacleSection) -> Earth {
        Earth::new(&Scenario {
            obstacles: vec![obstacle],
            intruders: vec![testing::intruder([0.0, 50.0])],
            ..Scenario::default()
        })
    }

    #[test]
    fn known_distances_give_known_angles() {
        // One degree of longitude on the equator, and a minute of latitude at 45 degrees.
        let equator = GeoreferenceSection { latitude_deg: 0.0, longitude_deg: 10.0, altitude_m: 0.0 };
        let east = bare(equator.clone()).locate(Point2::new(111.319_490_793, 0.0));
        assert!((east.longitude_deg - 10.001).abs() < 1e-9 && east.latitude_deg.abs() < 1e-12);
        let middle = GeoreferenceSection { latitude_deg: 45.0, ..equator };
        let north = bare(middle).locate(Point2::new(0.0, 1852.0));
        assert!((north.latitude_deg - 45.0 - 1.0 / 60.0).abs() < 5e-6, "{north:?}");
    }

    #[test]
    fn the_map_shows_obstacles_intruders_and_the_uavs_in_the_sky() {
        let scenario = testing::ring_of(3, 40.0);
        let mut frame = testing::at_rest(&scenario, 0);
        frame.uavs[1].state = None;
        let map: Value = serde_json::from_str(
            &earth_with(testing::obstacle([100.0, 0.0])).uavs_on_map(&frame, Clock::new(100)).geojson,
        )
        .unwrap();
        let names: Vec<_> =
            map["features"].as_array().unwrap().iter().map(|one| &one["properties"]["name"]).collect();
        assert_eq!(names, ["tower", "intruder 1", "uav 1", "uav 3"]);
        for (number, corners) in [(0, 25), (1, 5)] {
            let outline = map["features"][number]["geometry"]["coordinates"][0].as_array().unwrap();
            assert_eq!((outline.len(), outline.first()), (corners, outline.last()));
        }
    }

    #[test]
    fn an_obstacle_that_moves_is_where_it_is_on_the_map() {
        let drifting = ObstacleSection { velocity_m_s: [0.0, 111.0], ..testing::obstacle([0.0, 0.0]) };
        let earth = earth_with(drifting);
        let north_deg = |tick| {
            let frame = testing::at_rest(&testing::ring_of(3, 40.0), tick);
            let map: Value =
                serde_json::from_str(&earth.uavs_on_map(&frame, Clock::new(100)).geojson).unwrap();
            map["features"][0]["geometry"]["coordinates"][0][0][1].as_f64().unwrap()
        };
        // A thousandth of a degree of latitude is 111 m.
        assert!((north_deg(100) - north_deg(0) - 0.001).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn the_local_origin_is_at_the_georeference(latitude in -85.0..85.0_f64, longitude in -180.0..180.0_f64) {
            let georeference = GeoreferenceSection { latitude_deg: latitude, longitude_deg: longitude, altitude_m: 0.0 };
            let there = bare(georeference).locate(Point2::origin());
            prop_assert!((there.latitude_deg - latitude).abs() < 1e-9);
            prop_assert!((there.longitude_deg - longitude).abs() < 1e-9);
        }
    }
}
