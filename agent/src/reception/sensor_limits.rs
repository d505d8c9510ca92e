//! What the sensors of traffic do to every report: noise, delay and dropout, as the scenario says.
//!
//! They act like faults of the link from the sensors, for the whole flight. Never ends one of them: healing is for faults.

use ringwing_flight::Tick;
use ringwing_scenario::{
    Scenario,
    fault::{Delay, LinkImpairment, Links, Receiver, Sender, schedule::LinkFault},
};

/// The limits of `scenario`'s sensors of traffic; none if the sensors are perfect.
pub fn sensor_limits(scenario: &Scenario) -> Vec<LinkFault> {
    let sensing = &scenario.sensing;
    let noise = LinkImpairment::Noise {
        position_m: sensing.traffic_noise_m,
        heading_rad: sensing.traffic_noise_deg.to_radians(),
    };
    [
        (
            sensing.traffic_delay_s > 0.0,
            LinkImpairment::Delay(Delay::Constant { by_s: sensing.traffic_delay_s }),
        ),
        (sensing.traffic_loss > 0.0, LinkImpairment::Loss(sensing.traffic_loss)),
        (sensing.traffic_noise_m > 0.0 || sensing.traffic_noise_deg > 0.0, noise),
    ]
    .into_iter()
    .filter(|(acts, _)| *acts)
    .map(|(_, impairment)| LinkFault {
        // No fault of the flight has this number.
        number: 0,
        begin: Tick::APPROACH,
        end: None,
        links: Links::From(Sender::Traffic, Receiver::All),
        impairment,
        sentence: "limits of the sensors".into(),
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reception::{ImpairedLink, Route};
    use ringwing_flight::{LinkSource, SensedAircraft, Traffic, UavId};

    fn limited(limit: impl FnOnce(&mut Scenario)) -> ImpairedLink<Traffic> {
        let mut scenario = Scenario::default();
        limit(&mut scenario);
        let route = Route { source: LinkSource::TRAFFIC, to: UavId(1), latency_ticks: 0 };
        let mut link = ImpairedLink::new(route, 1, 100);
        link.set_faults(&sensor_limits(&scenario));
        link
    }

    /// A report of two aircraft at the origin.
    fn report(tick: i64) -> Traffic {
        let mut report = Traffic {
            tick: Tick(tick),
            uav: UavId(1),
            aircraft_count: 2,
            aircraft_omitted: 0,
            reserved: 0,
            aircraft: Default::default(),
        };
        report.aircraft_mut().fill(SensedAircraft { speed_m_s: 15.0, ..SensedAircraft::default() });
        report
    }

    fn arrived(link: &mut ImpairedLink<Traffic>, ticks: i64) -> Vec<(i64, Traffic)> {
        let mut arrived = Vec::new();
        for now in 0..ticks {
            link.offer(report(now));
            link.deliver(Tick(now), |traffic| arrived.push((now, traffic)));
        }
        arrived
    }

    #[test]
    fn perfect_sensors_have_no_limits() {
        assert!(limited(|_| ()).is_clear());
    }

    #[test]
    fn reports_arrive_late_and_some_never() {
        let mut link = limited(|s| {
            s.sensing.traffic_delay_s = 0.3;
            s.sensing.traffic_loss = 0.2;
        });
        let arrived = arrived(&mut link, 1000);
        assert!(arrived.iter().all(|(now, traffic)| now - traffic.tick.0 == 30));
        assert!((720..830).contains(&arrived.len()), "{}", arrived.len());
    }

    #[test]
    fn each_aircraft_has_its_own_error() {
        let mut link = limited(|s| s.sensing.traffic_noise_m = 2.0);
        let errors: Vec<[f64; 2]> = arrived(&mut link, 500)
            .iter()
            .flat_map(|(_, traffic)| traffic.aircraft().iter().map(|one| one.position_m))
            .collect();
        assert_ne!(errors[0], errors[1]);
        let mean_m2 = errors.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / errors.len() as f64;
        // Two coordinates with a variance of 4 m^2 each.
        assert!((mean_m2 - 8.0).abs() < 1.0, "{mean_m2}");
    }

    #[test]
    fn sensors_may_be_wrong_about_the_heading_alone() {
        let mut link = limited(|s| s.sensing.traffic_noise_deg = 3.0);
        let arrived = arrived(&mut link, 500);
        let aircraft: Vec<_> = arrived.iter().flat_map(|(_, traffic)| traffic.aircraft()).collect();
        assert!(aircraft.iter().all(|one| one.position_m == [0.0; 2]));
        let mean = aircraft.iter().map(|one| one.heading_rad.to_degrees().powi(2)).sum::<f64>() / 1000.0;
        assert!((mean - 9.0).abs() < 1.2, "a variance of {mean} deg^2");
    }
}
