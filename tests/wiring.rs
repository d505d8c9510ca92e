//! The connections of every process, read from the services of a live run.

use crate::harness::{Running, Swarm};
use iceoryx2::{
    node::{Node, NodeState, NodeView},
    prelude::{CallbackProgression, Config, FilePath, NodeBuilder, SemanticString, Service, ipc},
    service::port_factory::PortFactory,
};
use ringwing_bus::{Stamps, Wire};
use ringwing_flight::{
    Account, Command, EventMessage, FormationError, LeaderState, LinkCounts, Part, Payload, Roster, Sensed,
    TickTiming, UavId, UavState,
};
use rustix::process::Signal;
use std::collections::{BTreeMap, BTreeSet};

/// Names of the nodes that publish to a service, and of those that subscribe to it.
type Ends = (BTreeSet<String>, BTreeSet<String>);

/// Inspects a live run as iceoryx2's command line does, with the configuration file in the run's folder.
struct Inspector {
    config: Config,
    node: Node<ipc::Service>,
    names: BTreeMap<u128, String>,
}

impl Inspector {
    fn of(run: &Running) -> Self {
        let path = run.folder.join("config/iceoryx2.toml").display().to_string();
        let mut config = Config::from_file(&FilePath::new(path.as_bytes()).unwrap()).unwrap();
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        let node = NodeBuilder::new().config(&config).create::<ipc::Service>().unwrap();
        let mut names = BTreeMap::new();
        Node::<ipc::Service>::list(&config, |state| {
            if let NodeState::Alive(view) = state {
                let name = view.details().as_ref().map(|details| details.name().to_string());
                names.insert(view.id().value(), name.unwrap_or_default());
            }
            CallbackProgression::Continue
        })
        .unwrap();
        Self { config, node, names }
    }

    fn services(&self) -> BTreeSet<String> {
        let mut services = BTreeSet::new();
        ipc::Service::list(&self.config, |service| {
            services.insert(service.static_details.name().to_string());
            CallbackProgression::Continue
        })
        .unwrap();
        services
    }

    fn ends<T: Payload>(&self, service: &str) -> Ends {
        let builder = self.node.service_builder(&service.try_into().unwrap());
        let factory = builder.publish_subscribe::<Wire<T>>().user_header::<Stamps>().open().unwrap();
        let mut ends = Ends::default();
        factory.dynamic_config().list_publishers(|port| {
            ends.0.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        factory.dynamic_config().list_subscribers(|port| {
            ends.1.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        ends
    }

    fn all_ends(&self) -> BTreeMap<String, Ends> {
        let ends_of = |service: String| {
            let ends = match service.rsplit('/').next().unwrap() {
                "sensed" => self.ends::<Sensed>(&service),
                "command" => self.ends::<Command>(&service),
                "account" => self.ends::<Account>(&service),
                "state" if service.starts_with("uav/") => self.ends::<UavState>(&service),
                "state" => self.ends::<LeaderState>(&service),
                "links" => self.ends::<LinkCounts>(&service),
                "timing" => self.ends::<TickTiming>(&service),
                "events" => self.ends::<EventMessage>(&service),
                "roster" => self.ends::<Roster>(&service),
                "formation_error" => self.ends::<FormationError>(&service),
                other => panic!("unknown service {other}"),
            };
            (service, ends)
        };
        self.services().into_iter().map(ends_of).collect()
    }
}

fn set(names: &[String]) -> BTreeSet<String> {
    names.iter().cloned().collect()
}

#[test]
fn an_agent_is_connected_only_to_its_senses_its_ring_neighbours_and_the_leader() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600 --uavs 5").start();
    run.wait_for_second(0.1);
    let services = Inspector::of(&run).all_ends();
    assert_eq!(services.len(), 7 + 4 * 5, "{:?}", services.keys());
    for uav in 1..=5_u32 {
        let (previous, next) = ((uav + 3) % 5 + 1, uav % 5 + 1);
        let agent = format!("agent-{uav}");
        let of = |end: fn(&Ends) -> &BTreeSet<String>| -> BTreeSet<String> {
            let mine = services.iter().filter(|(_, ends)| end(ends).contains(&agent));
            mine.map(|(service, _)| service.clone()).collect()
        };
        let expected_inputs = set(&[
            format!("uav/{uav}/sensed"),
            format!("uav/{previous}/state"),
            format!("uav/{next}/state"),
            "leader/state".into(),
        ]);
        let expected_outputs = set(&["state", "command", "account"].map(|kind| format!("uav/{uav}/{kind}")));
        assert_eq!(of(|ends| &ends.1), expected_inputs, "{agent} subscribes");
        assert_eq!(of(|ends| &ends.0), expected_outputs, "{agent} publishes");
    }
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn after_a_loss_its_neighbours_subscribe_to_each_other_and_still_to_the_lost_uav() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600 --set law=resilient").start();
    run.wait_for_second(0.5);
    run.signal(Part::Agent(UavId(3)), Signal::KILL);
    run.wait_for_second(3.0);
    let services = Inspector::of(&run).all_ends();
    let listeners = |uav: u32| services[&format!("uav/{uav}/state")].1.clone();
    assert_eq!(listeners(3), set(&["agent-2".into(), "agent-4".into()]));
    assert_eq!(listeners(2), set(&["agent-1".into(), "agent-4".into()]));
    assert_eq!(listeners(4), set(&["agent-2".into(), "agent-5".into()]));
    assert_eq!(listeners(6), set(&["agent-1".into(), "agent-5".into()]));
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn the_leader_subscribes_to_nothing_and_the_recorder_publishes_only_to_the_launcher() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").start();
    run.wait_for_second(0.1);
    let services = Inspector::of(&run).all_ends();
    for (service, (publishers, subscribers)) in &services {
        assert!(!subscribers.contains("leader"), "the leader subscribes to {service}");
        if publishers.contains("recorder") {
            assert_eq!(service, "recorder/formation_error");
            assert_eq!(*subscribers, set(&["launcher".into()]));
        }
    }
    let listeners: BTreeSet<String> = services["leader/state"].1.clone();
    let mut expected: BTreeSet<String> = (1..=6).map(|uav| format!("agent-{uav}")).collect();
    expected.insert(Part::Recorder.node_name());
    assert_eq!(listeners, expected);
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}
