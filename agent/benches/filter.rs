//! What one step of the collision filter costs, with eight aircraft and eight obstacles near.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Point2, Vector2};
use ringwing_agent::{
    law::ControlInput,
    safety::{CollisionFilter, Surroundings},
};
use ringwing_flight::{AircraftId, Pose, SensedAircraft, SensedObstacle, Tick, Traffic, UavId, direction};
use ringwing_scenario::Scenario;
use std::{f64::consts::TAU, hint::black_box};

/// Eight bearings, and the places there on a circle around the origin.
fn around(radius_m: f64) -> [(f64, [f64; 2]); 8] {
    std::array::from_fn(|place| {
        let bearing_rad = (place as f64 + 0.5) / 8.0 * TAU;
        (bearing_rad, (direction(bearing_rad) * radius_m).into())
    })
}

/// Aircraft that fly towards the UAV from all sides.
fn traffic(tick: Tick) -> Traffic {
    let aircraft = |(bearing_rad, position_m)| SensedAircraft {
        position_m,
        heading_rad: ringwing_flight::wrap(bearing_rad + TAU / 2.0),
        speed_m_s: 15.0,
        turn_rate_rad_s: 0.0,
        who: AircraftId::uav(UavId(2)),
        is_answering: 1,
    };
    let aircraft = around(50.0).map(aircraft);
    Traffic { tick, uav: UavId(1), aircraft_count: 8, aircraft_omitted: 0, reserved: 0, aircraft }
}

/// A step in one tick after another: most only hold the course, and one in ten looks for a clear one. No course is clear here,
/// so that all of them are examined.
fn filter_step(criterion: &mut Criterion) {
    let mut filter = CollisionFilter::new(&Scenario::default(), UavId(1));
    let obstacle = |(_, position_m)| SensedObstacle {
        position_m,
        radius_m: 10.0,
        braking_distance_m: 30.0,
        velocity_m_s: [0.0; 2],
    };
    let obstacles = around(60.0).map(obstacle);
    let around = Surroundings { obstacles: &obstacles, swarm_rad_s: 0.0, wind_m_s: Vector2::zeros() };
    let own = Pose { position: Point2::origin(), heading_rad: 0.0 };
    let wish = ControlInput { speed_m_s: 15.0, turn_rate_rad_s: 0.0 };
    let mut now = Tick(0);
    criterion.bench_function("collision filter step: 8 aircraft, 8 obstacles", |bencher| {
        bencher.iter(|| {
            now = now.next();
            filter.receive(&traffic(now));
            filter.apply(now, black_box(&own), wish, |_, _| Vector2::new(15.0, 0.0), black_box(&around))
        });
    });
}

criterion_group!(benches, filter_step);
criterion_main!(benches);
