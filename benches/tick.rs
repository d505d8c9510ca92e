//! What one agent step and one airframe step cost, without processes.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use ringwing_agent::Pilot;
use ringwing_flight::{Command, Sensed, Tick, UavId};
use ringwing_leader::Path;
use ringwing_scenario::{Scenario, Source, start};
use ringwing_world::{Airframe, Sky};
use std::hint::black_box;

fn scenario() -> Scenario {
    let source = Source::find("paper-4.2").expect("a preset");
    Scenario::read(&source, &[]).expect("a preset is valid")
}

/// A pilot that has heard everybody it listens to, and what it senses now, in reach of an obstacle.
fn informed_pilot(scenario: &Scenario) -> (Pilot, Sensed) {
    let mut scenario = scenario.clone();
    scenario.obstacles[1].position_m = [-30.0, 0.0];
    let mut sky = Sky::new(&scenario, &start::states(&scenario).expect("room for all"));
    let path = Path::new(&scenario);
    let mut pilots: Vec<Pilot> = UavId::all(6).map(|uav| Pilot::new(&scenario, uav)).collect();
    for (uav, pilot) in UavId::all(6).zip(&mut pilots) {
        pilot.receive_sensed(&sky.senses(uav).expect("it flies"));
    }
    let states: Vec<_> =
        pilots.iter_mut().filter_map(|pilot| pilot.fly(sky.now()).ok()).map(|one| one.state).collect();
    let mut pilot = pilots.swap_remove(0);
    pilot.receive_leader(&path.at(sky.now()));
    sky.step();
    for neighbour in [&states[5], &states[1]] {
        pilot.receive_state(neighbour, sky.now());
    }
    (pilot, sky.senses(UavId(1)).expect("it flies"))
}

fn agent_step(criterion: &mut Criterion) {
    let (mut pilot, senses) = informed_pilot(&scenario());
    criterion.bench_function("agent step: senses to decision", |bencher| {
        bencher.iter(|| {
            pilot.receive_sensed(black_box(&senses));
            pilot.fly(senses.tick)
        });
    });
}

/// What an agent under the resilient law does after its answer, in the first tick in which it plans how its airframe leaves the formation.
fn planning_step(criterion: &mut Criterion) {
    let mut scenario = scenario();
    scenario.control.ring_closes = true;
    let (pilot, senses) = informed_pilot(&scenario);
    criterion.bench_function(
        "agent after its answer: the first moments of a plan for the failsafe",
        |bencher| {
            let ready = || {
                let mut pilot = pilot.clone();
                pilot.receive_sensed(&senses);
                pilot.fly(senses.tick).expect("it has senses");
                pilot
            };
            bencher.iter_batched_ref(ready, Pilot::plan_ahead, BatchSize::SmallInput);
        },
    );
}

fn airframe_step(criterion: &mut Criterion) {
    let scenario = scenario();
    let starts = start::states(&scenario).expect("room for all");
    let mut airframe = Airframe::new(&scenario, UavId(1), &starts[0]);
    let mut command = Command::new(Tick(0), UavId(1), 17.0, 0.2);
    criterion.bench_function("airframe step: command to the next tick", |bencher| {
        bencher.iter(|| {
            let now = command.tick;
            let taken = airframe.accept(black_box(&command), now);
            airframe.step(now);
            command.tick = now.next();
            taken
        });
    });
}

criterion_group!(benches, agent_step, planning_step, airframe_step);
criterion_main!(benches);
