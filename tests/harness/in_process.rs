//! A whole flight in one process, from the pure modules alone: what the processes must agree with, to the bit.

use ringwing_agent::{Decision, Pilot};
use ringwing_flight::{Event, LeaderState, Tick, UavId};
use ringwing_leader::Path;
use ringwing_scenario::{Scenario, start};
use ringwing_world::Sky;

/// A swarm, its leader and its sky.
pub struct Flight {
    count: u32,
    pilots: Vec<Pilot>,
    path: Path,
    /// The world's truth.
    pub sky: Sky,
    /// What was decided in the tick before.
    decisions: Vec<Option<Decision>>,
    led: Option<LeaderState>,
}

impl Flight {
    /// A flight of `scenario`, one tick before it begins.
    pub fn new(scenario: &Scenario) -> Self {
        let count = scenario.formation.uavs;
        Self {
            count,
            pilots: UavId::all(count).map(|uav| Pilot::new(scenario, uav)).collect(),
            path: Path::new(scenario),
            sky: Sky::new(scenario, &start::states(scenario).expect("the UAVs find room")),
            decisions: vec![None; count as usize],
            led: None,
        }
    }

    /// The leader's state at this moment.
    pub fn leader(&self) -> LeaderState {
        self.path.at(self.sky.now())
    }

    /// Lets everybody hear what was sent in the tick before, decide, and fly on to the next tick.
    pub fn step(&mut self) -> Vec<Event> {
        let now = self.sky.now();
        self.deliver();
        self.decisions = self.pilots.iter_mut().map(|pilot| pilot.fly(now)).collect();
        self.led = Some(self.path.at(now));
        for decision in self.decisions.iter().flatten() {
            self.sky.accept(decision.command.uav, &decision.command).expect("a pilot's command is taken");
        }
        self.sky.step()
    }

    fn deliver(&mut self) {
        let now = self.sky.now();
        for (uav, pilot) in UavId::all(self.count).zip(&mut self.pilots) {
            if let Some(senses) = self.sky.senses(uav) {
                pilot.receive_sensed(&senses);
            }
            for neighbour in pilot.listened().to_vec() {
                if let Some(decision) = &self.decisions[neighbour.index()] {
                    pilot.receive_state(&decision.state, now);
                }
            }
            if let Some(led) = &self.led {
                pilot.receive_leader(led);
            }
        }
    }

    /// Flies to tick `last`, showing each moment on the way to `see`.
    pub fn fly_to(&mut self, last: Tick, mut see: impl FnMut(&Self)) {
        while self.sky.now() < last {
            self.step();
            see(self);
        }
    }

    /// Each UAV's distance from its slot.
    pub fn slot_errors_m(&self, scenario: &Scenario) -> Vec<f64> {
        let (formation, leader) = (scenario.formation(), self.leader());
        let error = |airframe: &ringwing_world::Airframe| {
            let slot = formation.slot(airframe.uav().0, leader.position_m.into());
            (airframe.pose().position - slot).norm()
        };
        self.sky.airframes().iter().map(error).collect()
    }
}
