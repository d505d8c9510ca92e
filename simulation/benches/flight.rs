//! How long a whole flight takes in one process, measures included.

#![expect(missing_docs, reason = "criterion's macro makes the entry point")]

use criterion::{Criterion, criterion_group, criterion_main};
use ringwing_scenario::{Scenario, Setting, Source};
use std::{hint::black_box, time::Duration};

fn flight(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("flight of 90 s");
    group.sample_size(10).measurement_time(Duration::from_secs(15));
    for uavs in [6, 200] {
        let settings = [Setting::of_flag("--uavs", "formation.uavs", uavs)];
        let source = Source::find("paper-4.2").expect("a preset");
        let scenario = Scenario::read(&source, &settings).expect("a valid scenario");
        group.bench_function(format!("{uavs} UAVs"), |bencher| {
            bencher.iter(|| ringwing_simulation::fly(black_box(&scenario)).expect("a flight"));
        });
    }
    group.finish();
}

criterion_group!(benches, flight);
criterion_main!(benches);
