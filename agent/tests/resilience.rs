//! What the resilient law is for, in flights of pilots alone.

mod flight;

use flight::{Flight, Weather, scenario};

#[test]
#[ignore = "explores"]
fn explore() {
    let clear = Weather::default();
    for (uavs, dead) in [
        (6, vec![1]),
        (6, vec![2]),
        (6, vec![3]),
        (6, vec![4]),
        (6, vec![5]),
        (6, vec![6]),
        (6, vec![2, 3]),
        (6, vec![1, 2]),
        (6, vec![4, 5]),
        (6, vec![2, 5]),
        (6, vec![1, 4]),
        (6, vec![1, 2, 3]),
        (6, vec![3, 4, 5]),
        (8, vec![1, 4, 6]),
        (8, vec![2, 3, 4]),
        (12, vec![1, 3, 5, 7, 9, 11]),
        (12, vec![1, 2, 3, 4, 5, 6]),
        (12, vec![4, 5, 6, 7, 8, 9]),
    ] {
        let mut flight = Flight::at_rest(scenario("resilient", &[&format!("uavs={uavs}")]), clear);
        flight.fly(5.0, |_| ());
        let before = flight.slot_error_max_m();
        dead.iter().for_each(|number| flight.kill(*number));
        let (whole, closest, all) = flight.whole_after(40.0, 0.05);
        flight.fly(0.0, |_| ());
        let end = flight.slot_error_max_m();
        print!(
            "n {uavs} dead {dead:?}: {before:.1e} whole {whole:.2} closest {closest:.1} all {all:.1} end {end:.1e}"
        );
        let mut flight = Flight::at_rest(scenario("resilient", &[&format!("uavs={uavs}")]), clear);
        flight.fly(5.0, |_| ());
        dead.iter().for_each(|number| flight.kill(*number));
        flight.fly(4.0, |_| ());
        dead.iter().for_each(|number| flight.restart(*number));
        let (whole, closest, all) = flight.whole_after(40.0, 0.05);
        println!(
            "; return whole {whole:.2} closest {closest:.1} all {all:.1} end {:.1e}",
            flight.slot_error_max_m()
        );
    }
}

#[test]
#[ignore = "explores"]
fn explore_delay() {
    for timeout in ["0.5", "1", "8"] {
        for delay_ticks in [0, 20, 50, 100, 200, 500] {
            let weather = Weather { delay_ticks, ..Weather::default() };
            let mut times = vec![];
            let mut ends = 0.0_f64;
            let mut closest = f64::INFINITY;
            for seed in 1..=10 {
                let scenario =
                    scenario("resilient", &[&format!("seed={seed}"), &format!("loss_timeout_s={timeout}")]);
                let mut flight = Flight::new(scenario, weather);
                let (whole, close, _) = flight.whole_after(90.0, 1.0);
                times.push(whole);
                closest = closest.min(close);
                ends = ends.max(flight.slot_error_max_m());
            }
            times.sort_by(f64::total_cmp);
            println!(
                "timeout {timeout} delay {delay_ticks}: median {:.1} max {:.1} end {ends:.1e} closest {closest:.1}",
                times[times.len() / 2],
                times[times.len() - 1]
            );
        }
    }
}

#[test]
#[ignore = "explores"]
fn explore_stuck() {
    for law in ["paper", "resilient", "resilient-L"] {
        for uavs in [3, 4, 6] {
            let mut times = vec![];
            let mut stuck = 0;
            for seed in 1..=100 {
                let (name, reach) = if law == "resilient-L" { ("resilient", "1") } else { (law, "0.5") };
                let scenario = scenario(
                    name,
                    &[
                        &format!("uavs={uavs}"),
                        &format!("seed={seed}"),
                        &format!("gain_reach_spacings={reach}"),
                    ],
                );
                let mut flight = Flight::new(scenario, Weather::default());
                let (whole, ..) = flight.whole_after(60.0, 1.0);
                times.push(whole);
                stuck += u32::from(flight.slot_error_max_m() > 1.0);
            }
            times.sort_by(f64::total_cmp);
            println!(
                "{law} n {uavs}: stuck {stuck} median {:.1} max {:.1}",
                times[times.len() / 2],
                times[times.len() - 1]
            );
        }
    }
}

#[test]
#[ignore = "explores"]
fn explore_storm() {
    for timeout in ["1", "2", "3"] {
        let weather = Weather {
            delay_ticks: 0,
            jitter_ticks: 10,
            loss: 30,
            duplicates: 20,
            outage_ticks: 100,
            between_ticks: 900,
        };
        let mut worst = 0.0_f64;
        let mut over = 0;
        for seed in 1..=10 {
            let scenario =
                scenario("resilient", &[&format!("seed={seed}"), &format!("loss_timeout_s={timeout}")]);
            let mut flight = Flight::at_rest(scenario, weather);
            let mut most = 0.0_f64;
            flight.fly(90.0, |flight| {
                let errors = flight.slot_errors_m();
                let rms =
                    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
                most = most.max(rms);
            });
            worst = worst.max(most);
            over += u32::from(most > 0.5);
        }
        println!("timeout {timeout}: worst rms {worst:.3} over {over}");
    }
}

#[test]
#[ignore = "explores"]
fn explore_half() {
    for first in 1..=12_u32 {
        let dead: Vec<u32> = (0..6).map(|k| (first - 1 + k) % 12 + 1).collect();
        let mut flight = Flight::at_rest(
            scenario(
                "resilient",
                &[
                    "uavs=12",
                    &format!("gain_reach_spacings={}", std::env::var("REACH").unwrap_or("0.5".into())),
                    &format!("slots_move_s={}", std::env::var("MOVE").unwrap_or("5".into())),
                ],
            ),
            Weather::default(),
        );
        flight.fly(5.0, |_| ());
        dead.iter().for_each(|number| flight.kill(*number));
        let trace = first == 1 && std::env::var("TRACE").is_ok();
        let mut flight2 = Flight::at_rest(
            scenario(
                "resilient",
                &[
                    "uavs=12",
                    &format!("gain_reach_spacings={}", std::env::var("REACH").unwrap_or("0.5".into())),
                    &format!("slots_move_s={}", std::env::var("MOVE").unwrap_or("5".into())),
                ],
            ),
            Weather::default(),
        );
        if trace {
            flight2.fly(5.0, |_| ());
            dead.iter().for_each(|number| flight2.kill(*number));
            for _ in 0..40 {
                flight2.fly(1.0, |_| ());
                let c = 15.0 * flight2.now.0 as f64 * 0.01;
                let e: Vec<_> = flight2
                    .living()
                    .zip(flight2.slot_errors_m())
                    .map(|(i, e)| {
                        let p = flight2.airframes[i].pose;
                        format!(
                            "{}:{e:.1} ({:.0},{:.0},{:.1})",
                            i + 1,
                            p.position.x - c,
                            p.position.y,
                            p.heading_rad
                        )
                    })
                    .collect();
                println!("{} {}", flight2.now, e.join(" "));
            }
        }
        let (whole, closest, all) = flight.whole_after(40.0, 0.05);
        println!("{dead:?} whole {whole:.2} closest {closest:.1} all {all:.1}");
    }
}
