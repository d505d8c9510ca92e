//! The connections of every process, read from the services of a live run.

use crate::harness::{Running, Swarm};
use iceoryx2::{
    node::{Node, NodeState, NodeView},
    prelude::{CallbackProgression, Config, FilePath, NodeBuilder, SemanticString, Service, ipc},
    service::{dynamic_config::publish_subscribe, port_factory::PortFactory},
};
use ringwing_bus::{Stamps, Wire};
use ringwing_flight::{
    EventMessage, FormationError, JournalEntry, JournalHeader, LinkCounts, Notes, Part, Payload, Roster,
    UavId,
};
use rustix::process::Signal;
use std::collections::{BTreeMap, BTreeSet};

/// How iceoryx2 stores the ports of a service.
type Bag = <ipc::Service as Service>::Bag;
/// Names of the nodes that write or publish to a service, and of those that read it or subscribe to it.
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
        // Otherwise the inspector itself would clean up after a killed process of the run.
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

    /// Who writes a blackboard, and who reads it.
    fn board_ends(&self, service: &str) -> Ends {
        let builder = self.node.service_builder(&service.try_into().unwrap());
        let factory = builder.blackboard_opener::<u32>().open().unwrap();
        let mut ends = Ends::default();
        factory.dynamic_config().list_writers(|port| {
            ends.0.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        factory.dynamic_config().list_readers(|port| {
            ends.1.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        ends
    }

    fn message_ends<T: Payload>(&self, service: &str) -> Ends {
        let builder = self.node.service_builder(&service.try_into().unwrap());
        let factory = builder.publish_subscribe::<Wire<T>>().user_header::<Stamps>().open().unwrap();
        self.channel_ends(factory.dynamic_config())
    }

    fn journal_ends(&self) -> Ends {
        let builder = self.node.service_builder(&"journal".try_into().unwrap());
        let builder = builder.publish_subscribe::<[Wire<JournalEntry>]>();
        let factory = builder.user_header::<Wire<JournalHeader>>().open().unwrap();
        self.channel_ends(factory.dynamic_config())
    }

    /// Who publishes to a service, and who subscribes to it.
    fn channel_ends(&self, service: &publish_subscribe::DynamicConfig<Bag>) -> Ends {
        let mut ends = Ends::default();
        service.list_publishers(|port| {
            ends.0.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        service.list_subscribers(|port| {
            ends.1.insert(self.names[&port.node_id.value()].clone());
            CallbackProgression::Continue
        });
        ends
    }

    fn all_ends(&self) -> BTreeMap<String, Ends> {
        let ends_of = |service: String| {
            let ends = match service.as_str() {
                "uav/links" => self.message_ends::<LinkCounts>(&service),
                "uav/notes" => self.message_ends::<Notes>(&service),
                "world/events" | "launcher/events" => self.message_ends::<EventMessage>(&service),
                "launcher/roster" => self.message_ends::<Roster>(&service),
                "recorder/formation_error" => self.message_ends::<FormationError>(&service),
                "journal" => self.journal_ends(),
                _ => self.board_ends(&service),
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
    // Each UAV has senses, states and commands. Without a filter there is no traffic, and accounts share a service
    // with commands.
    assert_eq!(services.len(), 7 + 3 * 5, "{:?}", services.keys());
    for uav in 1..=5_u32 {
        let (previous, next) = ((uav + 3) % 5 + 1, uav % 5 + 1);
        let agent = format!("agent-{uav}");
        let of = |end: fn(&Ends) -> &BTreeSet<String>| -> BTreeSet<String> {
            let mine = services.iter().filter(|(_, ends)| end(ends).contains(&agent));
            mine.map(|(service, _)| service.clone()).collect()
        };
        let expected_inputs = set(&[
            format!("uav/{uav}/sensed/1"),
            format!("uav/{previous}/state/1"),
            format!("uav/{next}/state/1"),
            "leader/state/1".into(),
        ]);
        let expected_outputs = set(&["state", "command"].map(|kind| format!("uav/{uav}/{kind}/1")));
        assert_eq!(of(|ends| &ends.1), expected_inputs, "{agent} reads");
        assert_eq!(of(|ends| &ends.0), expected_outputs, "{agent} writes");
    }
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn after_a_loss_its_neighbours_read_each_other_and_wait_at_the_board_of_a_successor() {
    let run = Swarm::fly("paper-4.1")
        .with("--real-time --duration 600 --set law=resilient --set collision_filter=true")
        .start();
    run.wait_for_second(0.5);
    run.signal(Part::Agent(UavId(3)), Signal::KILL);
    run.wait_for_second(3.0);
    let services = Inspector::of(&run).all_ends();
    for uav in 1..=6 {
        let ends = (set(&["world".into()]), set(&[format!("agent-{uav}")]));
        // The killed agent's end may linger until it is cleaned up.
        assert!(uav == 3 || services[&format!("uav/{uav}/traffic/1")] == ends, "the traffic of uav {uav}");
    }
    // The agent of UAV 3 is dead, and its neighbours wait at the board that its successor would open.
    let newest = |uav: u32| if uav == 3 { 2 } else { 1 };
    let listeners = |uav: u32| services[&format!("uav/{uav}/state/{}", newest(uav))].1.clone();
    assert_eq!(listeners(3), set(&["agent-2".into(), "agent-4".into()]));
    assert_eq!(listeners(2), set(&["agent-1".into(), "agent-4".into()]));
    assert_eq!(listeners(4), set(&["agent-2".into(), "agent-5".into()]));
    assert_eq!(listeners(6), set(&["agent-1".into(), "agent-5".into()]));
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn the_leader_reads_nothing_and_the_recorder_only_the_journal_links_and_events() {
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").start();
    run.wait_for_second(0.1);
    let services = Inspector::of(&run).all_ends();
    for (service, (writers, readers)) in &services {
        assert!(!readers.contains("leader"), "the leader reads {service}");
        if writers.contains("recorder") {
            assert_eq!(service, "recorder/formation_error");
            assert_eq!(*readers, set(&["launcher".into()]));
        }
        if readers.contains("recorder") {
            let is_for_the_log = ["journal", "uav/links", "world/events", "launcher/events"];
            assert!(is_for_the_log.contains(&service.as_str()), "the recorder reads {service}");
        }
        if let Some(uav) = service.strip_prefix("uav/").and_then(|rest| rest.strip_suffix("/command/1")) {
            assert_eq!(*writers, set(&[format!("agent-{uav}")]));
            assert_eq!(*readers, set(&["world".into()]), "{service}");
        }
    }
    let mut expected: BTreeSet<String> = (1..=6).map(|uav| format!("agent-{uav}")).collect();
    expected.insert(Part::World.node_name());
    assert_eq!(services["leader/state/1"].1, expected);
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn notes_go_from_the_controllers_that_make_some_to_the_recorder() {
    let agent = format!("3={}", crate::controllers::consensus());
    let run = Swarm::fly("paper-4.1").with("--real-time --duration 600").agent(&agent).start();
    run.wait_for_second(0.1);
    let services = Inspector::of(&run).all_ends();
    assert_eq!(services["uav/notes"], (set(&["agent-3".into()]), set(&["recorder".into()])));
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}

#[test]
fn a_viewer_reads_the_journal_links_and_events_and_writes_nothing() {
    let mut run = Swarm::fly("paper-4.1").with("--real-time --duration 600 --live=0").start();
    run.wait_for_line("live at ws://");
    run.wait_for_second(0.1);
    let services = Inspector::of(&run).all_ends();
    let of = |end: fn(&Ends) -> &BTreeSet<String>| -> BTreeSet<String> {
        let its = services.iter().filter(|(_, ends)| end(ends).contains("viewer"));
        its.map(|(service, _)| service.clone()).collect()
    };
    let read = ["journal", "uav/links", "world/events", "launcher/events"].map(String::from);
    assert_eq!(of(|ends| &ends.1), set(&read));
    assert_eq!(of(|ends| &ends.0), set(&[]));
    crate::harness::send(run.launcher(), Signal::INT);
    run.finish().assert_ended_with(1);
}
