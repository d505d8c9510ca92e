//! Everything one agent does in a tick: receive, fly, update its inputs.
//!
//! The agent's process and the simulation run this same code and only move samples, so they give the same flight to
//! the bit.
//!
//! Never knows ports, clocks, threads or waiting.

use crate::{
    pilot::{BuiltInLaw, Decision, Pilot, Steer, Undecided},
    reception::{Inputs, LinkReceiver, LinkSettings, Route, Sample, sensor_limits},
};
use ringwing_flight::{
    Account, Command, LeaderState, LinkCounts, LinkSource, Notes, Sensed, Tick, Traffic, UavId, UavState,
};
use ringwing_scenario::{Scenario, fault::schedule::LinkFault};

/// What an agent sends in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// For the agents that listen to this one. `None` when the command is withheld: the others must notice the silence.
    pub state: Option<UavState>,
    /// For the airframe. It is the answer to the tick.
    pub command: Command,
    /// For the log; `None` when the command is withheld.
    pub account: Option<Account>,
}

/// One UAV's agent, without its process.
///
/// A tick is [`receive`](Self::receive), [`fly`](Self::fly), [`update_inputs`](Self::update_inputs), in this order.
/// Send the answer only after the inputs are updated: it may end the tick, and the new inputs must be open for what
/// the others send in the next tick.
#[derive(Debug, Clone)]
pub struct UavAgent<S = BuiltInLaw> {
    uav: UavId,
    pilot: Pilot<S>,
    senses: LinkReceiver<Sensed>,
    /// `None` without a collision filter: then nobody sends it.
    traffic: Option<LinkReceiver<Traffic>>,
    /// Every UAV that was ever listened to: a link keeps its counts while its receiver is closed.
    neighbours: Vec<NeighbourInput>,
    leader: LinkReceiver<LeaderState>,
    links: LinkSettings,
    faults: Vec<LinkFault>,
    /// What the sensors of traffic do to every report, as if the link had these faults.
    sensor_limits: Vec<LinkFault>,
    last_tick: Tick,
}

/// The receiving end of another UAV's states.
#[derive(Debug, Clone)]
struct NeighbourInput {
    uav: UavId,
    receiver: LinkReceiver<UavState>,
}

impl UavAgent {
    /// The agent of `uav` in `scenario`, which has been validated, as it starts, with the built-in law. Its links have no
    /// faults yet.
    pub fn new(scenario: &Scenario, uav: UavId) -> Self {
        Self::steered_by(BuiltInLaw::new(scenario), scenario, uav)
    }
}

impl<S: Steer> UavAgent<S> {
    /// The agent of `uav` in `scenario`, which has been validated, as it starts. Its links have no faults yet.
    pub fn steered_by(steering: S, scenario: &Scenario, uav: UavId) -> Self {
        let links = LinkSettings::new(scenario);
        let route = |source, latency_ticks| Route { source, to: uav, latency_ticks };
        let sensor_limits = sensor_limits(scenario);
        let traffic = || LinkReceiver::new(route(LinkSource::TRAFFIC, 0), links, &sensor_limits);
        let mut agent = Self {
            uav,
            pilot: Pilot::steered_by(steering, scenario, uav),
            // The world sends senses and traffic before it opens the tick, so they arrive in it. The other UAVs and the
            // leader send while it is open.
            senses: LinkReceiver::new(route(LinkSource::OWN, 0), links, &[]),
            traffic: scenario.control.collision_filter.then(traffic),
            neighbours: Vec::new(),
            leader: LinkReceiver::new(route(LinkSource::LEADER, 1), links, &[]),
            links,
            faults: Vec::new(),
            sensor_limits,
            last_tick: Tick(scenario.last_tick()),
        };
        for other in agent.pilot.listened().to_vec() {
            agent.open(other);
        }
        agent
    }

    /// A copy to rehearse a tick with.
    pub fn rehearsal(&self) -> UavAgent<S::Rehearsal> {
        UavAgent {
            uav: self.uav,
            pilot: self.pilot.rehearsal(),
            senses: self.senses.clone(),
            traffic: self.traffic.clone(),
            neighbours: self.neighbours.clone(),
            leader: self.leader.clone(),
            links: self.links,
            faults: self.faults.clone(),
            sensor_limits: self.sensor_limits.clone(),
            last_tick: self.last_tick,
        }
    }

    /// Replaces the faults of all its links. Samples in flight stay in flight.
    pub fn set_faults(&mut self, faults: &[LinkFault]) {
        self.senses.set_faults(faults);
        if let Some(traffic) = &mut self.traffic {
            // The limits come first, so that a fault never changes what they draw.
            traffic.set_faults(&[&self.sensor_limits, faults].concat());
        }
        self.leader.set_faults(faults);
        self.neighbours.iter_mut().for_each(|input| input.receiver.set_faults(faults));
        self.faults = faults.to_vec();
    }

    /// Takes in the senses of `now`, and what the others and the leader sent until the tick before.
    pub fn receive<I: Inputs>(&mut self, now: Tick, inputs: &mut I) -> Result<(), I::Error> {
        let pilot = &mut self.pilot;
        self.senses.receive(
            now,
            |ticks, take| inputs.sensed(ticks, take),
            |sensed| pilot.receive_sensed(sensed),
        )?;
        if let Some(traffic) = &mut self.traffic {
            let take = |report: &Traffic| pilot.receive_traffic(report);
            traffic.receive(now, |ticks, take| inputs.traffic(ticks, take), take)?;
        }
        for NeighbourInput { uav, receiver } in &mut self.neighbours {
            let take = |state: &UavState| pilot.receive_state(state, now);
            receiver.receive(now, |ticks, take| inputs.state(*uav, ticks, take), take)?;
        }
        self.leader.receive(
            now,
            |ticks, take| inputs.leader(ticks, take),
            |state| pilot.receive_leader(state),
        )
    }

    /// The counts to report in `now`, between [`receive`](Self::receive) and [`fly`](Self::fly): those of the links
    /// with faults, once a simulated second and at the last tick; and once more for each fault of a link when it alters its
    /// first sample, and at the last tick.
    pub fn link_counts(&mut self, now: Tick) -> Vec<LinkCounts> {
        // Most flights have no link faults, and this is on the path of every tick.
        if self.faults.is_empty() && self.sensor_limits.is_empty() {
            return Vec::new();
        }
        let is_last = now == self.last_tick;
        let is_due = is_last || now.0 % i64::from(self.links.rate_hz) == 0;
        let mut reports = Vec::new();
        for input in &mut self.neighbours {
            report(&mut input.receiver, now, is_due, is_last, &mut reports);
        }
        report(&mut self.leader, now, is_due, is_last, &mut reports);
        report(&mut self.senses, now, is_due, is_last, &mut reports);
        if let Some(traffic) = &mut self.traffic {
            report(traffic, now, is_due, is_last, &mut reports);
        }
        reports
    }

    /// Decides what to send in `now`. A running agent answers every tick: if it does not know where its UAV is, or if its
    /// controller's wish is not a finite number, it withholds its command.
    pub fn fly(&mut self, now: Tick) -> Answer {
        let command = match self.pilot.fly(now) {
            Ok(Decision { state, command, account }) => {
                return Answer { state: Some(state), command, account: Some(account) };
            }
            Err(Undecided::NoSenses) => Command::withheld(now, self.uav),
            Err(Undecided::NotFinite) => Command::not_finite(now, self.uav),
        };
        Answer { state: None, command, account: None }
    }

    /// Does what no answer has to wait for. To be called once the tick is answered.
    pub fn plan_ahead(&mut self) {
        self.pilot.plan_ahead();
    }

    /// What its controller has noted for the log in `now`, which was flown last.
    pub fn notes(&self, now: Tick) -> Option<&Notes> {
        self.pilot.notes(now)
    }

    /// Opens and closes `inputs`, so that exactly the UAVs that the pilot now listens to are open.
    ///
    /// An input that closes loses what is in flight to it. One that opens is a newcomer in the next tick.
    pub fn update_inputs<I: Inputs>(&mut self, inputs: &mut I) -> Result<(), I::Error> {
        // Hardly any tick changes the list, so the usual one copies nothing.
        if self.is_up_to_date() {
            return Ok(());
        }
        let listened = self.pilot.listened().to_vec();
        for input in &mut self.neighbours {
            if input.receiver.is_open() && !listened.contains(&input.uav) {
                input.receiver.close();
                inputs.close_state(input.uav);
            }
        }
        for uav in listened {
            if !self.is_open(uav) {
                inputs.open_state(uav)?;
                self.open(uav);
            }
        }
        Ok(())
    }

    /// The UAVs that the pilot listens to.
    pub fn listened(&self) -> &[UavId] {
        self.pilot.listened()
    }

    /// Whether the open inputs are exactly those that the pilot listens to.
    fn is_up_to_date(&self) -> bool {
        let listened = self.pilot.listened();
        let mut open = self.neighbours.iter().filter(|input| input.receiver.is_open());
        open.clone().count() == listened.len() && open.all(|input| listened.contains(&input.uav))
    }

    fn is_open(&self, uav: UavId) -> bool {
        self.neighbours.iter().any(|input| input.uav == uav && input.receiver.is_open())
    }

    fn open(&mut self, uav: UavId) {
        if let Some(input) = self.neighbours.iter_mut().find(|input| input.uav == uav) {
            input.receiver.open();
            return;
        }
        let route = Route { source: LinkSource::uav(uav), to: self.uav, latency_ticks: 1 };
        let receiver = LinkReceiver::new(route, self.links, &self.faults);
        self.neighbours.push(NeighbourInput { uav, receiver });
    }
}

/// Adds to `reports` what the receiver of one link has to report.
fn report<T: Sample>(
    receiver: &mut LinkReceiver<T>,
    now: Tick,
    is_due: bool,
    is_last: bool,
    reports: &mut Vec<LinkCounts>,
) {
    reports.extend(receiver.counts(now).filter(|_| is_due));
    let news = receiver.news(now);
    // At the end once more for every fault: a recorder that was replaced meanwhile may have missed the first report.
    reports.extend(if is_last { receiver.all_acted(now) } else { news });
}

#[cfg(test)]
mod tests;
