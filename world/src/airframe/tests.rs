use super::*;
use proptest::prelude::*;

const START: StartState = StartState { position_m: [-40.0, 7.0], heading_deg: 20.0, speed_m_s: 15.0 };

fn airframe(failsafe: Failsafe) -> Airframe {
    let mut scenario = Scenario::default();
    scenario.airframe.failsafe = failsafe;
    Airframe::new(&scenario, UavId(3), &START)
}

fn command(tick: i64, speed_m_s: f64, turn_rate_rad_s: f64) -> Command {
    Command::new(Tick(tick), UavId(3), speed_m_s, turn_rate_rad_s)
}

#[test]
fn an_airframe_arrives_at_its_start_when_the_flight_begins() {
    let mut airframe = airframe(Failsafe::Loiter);
    airframe.step(Tick::APPROACH);
    assert!((airframe.pose().position - Point2::from(START.position_m)).norm() < 1e-12);
}

#[test]
fn stale_early_malformed_and_foreign_commands_are_refused() {
    let mut airframe = airframe(Failsafe::Loiter);
    assert_eq!(airframe.accept(&command(5, 15.0, 0.0), Tick(5)), Ok(()));
    assert_eq!(airframe.accept(&command(5, 15.0, 0.0), Tick(6)), Err(Refusal::Stale));
    assert_eq!(airframe.accept(&command(9, 15.0, 0.0), Tick(8)), Err(Refusal::FromTheFuture));
    assert_eq!(airframe.accept(&command(6, 15.0, 0.0), Tick(56)), Err(Refusal::Stale));
    assert_eq!(airframe.accept(&command(7, f64::NAN, 0.0), Tick(7)), Err(Refusal::NotFinite));
    let foreign = Command { uav: UavId(4), ..command(7, 15.0, 0.0) };
    assert_eq!(airframe.accept(&foreign, Tick(7)), Err(Refusal::NotItsOwn));
}

#[test]
fn the_first_command_may_be_of_the_tick_before_the_flight() {
    let mut airframe = airframe(Failsafe::Loiter);
    assert_eq!(airframe.accept(&command(-1, 15.0, 0.0), Tick::APPROACH), Ok(()));
    assert_eq!(airframe.accept(&command(-1, 15.0, 0.0), Tick::APPROACH), Err(Refusal::Stale));
}

/// An airframe in a wind of 6 m/s from the south.
fn in_wind(turbulence_m_s: f64) -> Airframe {
    let mut scenario = Scenario::default();
    (scenario.wind.mean_speed_m_s, scenario.wind.from_deg) = (6.0, -90.0);
    scenario.wind.turbulence_m_s = turbulence_m_s;
    Airframe::new(&scenario, UavId(3), &START)
}

#[test]
fn an_airframe_arrives_at_its_start_in_any_wind() {
    for turbulence_m_s in [0.0, 15.4] {
        let mut airframe = in_wind(turbulence_m_s);
        airframe.step(Tick::APPROACH);
        assert!((airframe.pose().position - Point2::from(START.position_m)).norm() < 1e-12);
    }
}

#[test]
fn a_steady_wind_makes_the_triangle_of_heading_course_and_drift() {
    let mut airframe = in_wind(0.0);
    airframe.step(Tick::APPROACH);
    for tick in 0..200 {
        airframe.accept(&command(tick, 20.0, 0.0), Tick(tick)).unwrap();
        airframe.step(Tick(tick));
    }
    // Two seconds: 40 m along the heading of 20 degrees, and 12 m to the north.
    let heading_rad = 20_f64.to_radians();
    let way = Vector2::new(40.0 * heading_rad.cos(), 40.0 * heading_rad.sin() + 12.0);
    assert!((airframe.pose().position - Point2::from(START.position_m) - way).norm() < 1e-9);
    assert!((airframe.pose().heading_rad - heading_rad).abs() < 1e-12 && airframe.rates() == (20.0, 0.0));
    assert!((airframe.wind_m_s() - Vector2::new(0.0, 6.0)).norm() < 1e-12);
}

#[test]
fn an_airframe_with_a_lag_approaches_its_command_and_its_failsafe() {
    let mut scenario = Scenario::default();
    (scenario.airframe.speed_lag_s, scenario.airframe.turn_lag_s) = (0.5, 0.2);
    let mut airframe = Airframe::new(&scenario, UavId(3), &START);
    for tick in 0..50 {
        airframe.accept(&command(tick, 25.0, 0.4), Tick(tick)).unwrap();
        airframe.step(Tick(tick));
    }
    let (speed_m_s, turn_rate_rad_s) = airframe.rates();
    assert!((speed_m_s - (25.0 - 10.0 * (-1.0_f64).exp())).abs() < 1e-9, "{speed_m_s}");
    assert!((turn_rate_rad_s - 0.4 * (1.0 - (-2.5_f64).exp())).abs() < 1e-9, "{turn_rate_rad_s}");
    // Nothing more comes. The failsafe takes over, and after ten time constants it loiters.
    for tick in 50..650 {
        airframe.step(Tick(tick));
    }
    let (speed_m_s, turn_rate_rad_s) = airframe.rates();
    assert!(airframe.mode() == FlightMode::LOITER && (speed_m_s - 12.0).abs() < 1e-3);
    assert!((turn_rate_rad_s - 0.25).abs() < 1e-6);
}

#[test]
fn a_broken_airframe_flies_what_is_left_and_is_whole_again_afterwards() {
    let fault =
        |failure| AirframeFault { number: 1, uav: UavId(3), begin: Tick(10), end: Some(Tick(20)), failure };
    let of_another = AirframeFault { uav: UavId(2), ..fault(AirframeFailure::Jammed(0.3)) };
    for (failure, broken) in [
        (AirframeFailure::Weak(14.0), (14.0, 0.1)),
        // It never flies slower than it can, nor turns faster.
        (AirframeFailure::Weak(5.0), (12.0, 0.1)),
        (AirframeFailure::Jammed(-0.2), (20.0, -0.2)),
        (AirframeFailure::Jammed(2.0), (20.0, 0.5)),
    ] {
        let mut airframe = airframe(Failsafe::Hold);
        let mut flown = Vec::new();
        for tick in (0..30).map(Tick) {
            airframe.accept(&command(tick.0, 20.0, 0.1), tick).unwrap();
            airframe.break_as(&[fault(failure), of_another], tick);
            airframe.step(tick);
            flown.push(airframe.rates());
        }
        assert_eq!([flown[9], flown[10], flown[19], flown[20]], [(20.0, 0.1), broken, broken, (20.0, 0.1)]);
    }
}

#[test]
fn an_airframe_that_circles_drifts_with_the_wind() {
    let mut airframe = in_wind(0.0);
    // The failsafe turns at 0.25 rad/s, so that a circle takes 8 pi s; 2513 ticks are that but for 3 ms.
    for tick in 0..100 {
        airframe.step(Tick(tick));
    }
    let before = airframe.pose().position;
    for tick in 100..2613 {
        airframe.step(Tick(tick));
    }
    let drift = airframe.pose().position - before;
    assert!((drift - Vector2::new(0.0, 6.0 * 25.13)).norm() < 0.1, "{drift}");
}

#[test]
fn a_withheld_command_changes_nothing() {
    for failsafe in [Failsafe::Loiter, Failsafe::Vanish] {
        let (mut airframe, mut silent) = (airframe(failsafe), airframe(failsafe));
        for tick in (0..100).map(Tick) {
            assert_eq!(airframe.accept(&Command::withheld(tick, UavId(3)), tick), Ok(()));
            assert_eq!(airframe.step(tick), silent.step(tick));
        }
        assert_eq!(airframe, silent);
    }
}

#[test]
fn a_late_command_is_still_flown() {
    let mut airframe = airframe(Failsafe::Loiter);
    assert_eq!(airframe.accept(&command(5, 20.0, 0.1), Tick(8)), Ok(()));
    assert_eq!(airframe.rates(), (20.0, 0.1));
}

#[test]
fn the_failsafe_takes_over_after_half_a_second_of_silence() {
    for (failsafe, mode, rates) in [
        (Failsafe::Loiter, FlightMode::LOITER, (12.0, 0.25)),
        (Failsafe::Hold, FlightMode::HOLD, (20.0, 0.0)),
        (Failsafe::Vanish, FlightMode::VANISHED, (20.0, 0.0)),
    ] {
        let mut airframe = airframe(failsafe);
        airframe.accept(&command(10, 20.0, 0.4), Tick(10)).unwrap();
        let taken_over_at = (10..200).find(|tick| airframe.step(Tick(*tick)));
        assert_eq!(taken_over_at, Some(60), "0.5 s at 100 Hz");
        assert_eq!((airframe.mode(), airframe.rates()), (mode, rates));
    }
}

#[test]
fn an_airframe_leaves_the_way_that_its_newest_command_says() {
    let rates = |paths: &[FailsafePath]| {
        let mut airframe = airframe(Failsafe::Loiter);
        for (tick, failsafe_path) in (0..).zip(paths) {
            let command = Command { failsafe_path: *failsafe_path, ..command(tick, 20.0, 0.0) };
            airframe.accept(&command, Tick(tick)).unwrap();
        }
        // The failsafe takes over after half a second; 15 degrees at 0.25 rad/s take another second.
        [0..100, 100..200, 200..400].map(|ticks| {
            ticks.for_each(|tick| _ = airframe.step(Tick(tick)));
            airframe.rates()
        })
    };
    let out_to_the_right = FailsafePath::new(-1, 2);
    // Fast on its way out, and slow on its circle.
    let leaves = [(25.0, -0.25), (25.0, 0.0), (12.0, -0.25)];
    assert_eq!(rates(&[FailsafePath::CIRCLE_LEFT, out_to_the_right]), leaves);
    for circles in [&[][..], &[out_to_the_right, FailsafePath::CIRCLE_LEFT]] {
        assert_eq!(rates(circles), [(12.0, 0.25); 3]);
    }
}

#[test]
fn a_new_command_ends_the_failsafe_unless_the_uav_has_vanished() {
    for (failsafe, answer) in [(Failsafe::Loiter, Ok(())), (Failsafe::Vanish, Err(Refusal::Vanished))] {
        let mut airframe = airframe(failsafe);
        for tick in 0..100 {
            airframe.step(Tick(tick));
        }
        assert_eq!(airframe.accept(&command(100, 15.0, 0.0), Tick(100)), answer);
        assert_eq!(airframe.mode() == FlightMode::COMMANDED, answer.is_ok());
    }
}

proptest! {
    #[test]
    fn an_airframe_keeps_its_limits_whatever_is_commanded(speed in any::<f64>(), turn_rate in any::<f64>()) {
        let mut airframe = airframe(Failsafe::Hold);
        let taken = airframe.accept(&command(0, speed, turn_rate), Tick(0));
        prop_assert_eq!(taken.is_ok(), speed.is_finite() && turn_rate.is_finite());
        airframe.step(Tick(0));
        let (speed, turn_rate) = airframe.rates();
        prop_assert!((12.0..=25.0).contains(&speed) && turn_rate.abs() <= 0.5);
        prop_assert!(airframe.pose().position.coords.norm() < 100.0);
    }
}
