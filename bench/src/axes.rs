//! What a benchmark measures: the axes, and the cases that they span.
//!
//! Must never read an option.

use crate::{
    case::{Carrier, Case, Load, Topology},
    peer_program::program::PeerProgram,
};
use ringwing_scenario::Wake;

/// What to measure, validated: the cases are all combinations.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axes {
    pub(crate) uavs: Vec<u32>,
    pub(crate) loads: Vec<Load>,
    pub(crate) wakes: Vec<Wake>,
    pub(crate) payloads: Vec<u32>,
    pub(crate) recorders: Vec<bool>,
    pub(crate) baselines: Vec<Carrier>,
    pub(crate) topologies: Vec<Topology>,
    pub(crate) programs: Vec<PeerProgram>,
    pub(crate) repeats: u32,
    pub(crate) warm_up_s: f64,
    pub(crate) measure_s: f64,
}

impl Axes {
    /// The program that is measured as `carrier`, if it is one of the user's.
    pub(crate) fn program(&self, carrier: &Carrier) -> Option<&PeerProgram> {
        self.programs.iter().find(|program| *carrier == Carrier::Peer(program.name.clone()))
    }

    /// All cases on these axes, without repetitions.
    pub(crate) fn cases(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for load in &self.loads {
            for uavs in &self.uavs {
                for payload_bytes in &self.payloads {
                    cases.extend(self.flights(*load, *uavs, *payload_bytes));
                    cases.extend(self.baselines_of(*load, *uavs, *payload_bytes));
                }
            }
        }
        distinct(&cases)
    }

    /// The swarm's cases of one size: only flights differ in how processes wait and whether they are recorded.
    fn flights(&self, load: Load, uavs: u32, payload_bytes: u32) -> impl Iterator<Item = Case> {
        let ways =
            self.wakes.iter().flat_map(|wake| self.recorders.iter().map(|recorder| (*wake, *recorder)));
        ways.map(move |(wake, recorder)| Case {
            carrier: Carrier::Swarm,
            topology: Topology::Hub,
            load,
            uavs,
            wake,
            payload_bytes,
            recorder,
        })
    }

    /// The cases of one size of all other carriers, each in the topologies that it has.
    fn baselines_of(&self, load: Load, uavs: u32, payload_bytes: u32) -> impl Iterator<Item = Case> {
        let carriers = self.baselines.iter();
        carriers.flat_map(move |carrier| {
            let topologies = self.topologies.iter().filter_map(|topology| in_topology(carrier, *topology));
            topologies.map(move |topology| baseline(carrier, topology, load, uavs, payload_bytes))
        })
    }
}

/// The topology in which `carrier` is measured where `asked` is wanted; `None` if it is not measured there.
pub(crate) fn in_topology(carrier: &Carrier, asked: Topology) -> Option<Topology> {
    if carrier.has(asked) {
        return Some(asked);
    }
    // A floor is the floor of both topologies, and the user named a program. Any other transport that has only a hub would
    // be compared with meshes.
    let has_no_choice = !carrier.carries_data() || matches!(carrier, Carrier::Peer(_));
    has_no_choice.then_some(Topology::Hub)
}

/// A case of another carrier. It drops the settings that the carrier cannot vary, so several combinations may become
/// the same case.
fn baseline(carrier: &Carrier, topology: Topology, load: Load, uavs: u32, payload_bytes: u32) -> Case {
    let uavs = if *carrier == Carrier::Atomic { 1 } else { uavs };
    let payload_bytes = if carrier.carries_data() { payload_bytes } else { 0 };
    let carrier = carrier.clone();
    Case { carrier, topology, load, uavs, wake: Wake::Gate, payload_bytes, recorder: false }
}

/// The values without repetitions, in their order.
pub(crate) fn distinct<T: Clone + PartialEq>(values: &[T]) -> Vec<T> {
    let mut distinct: Vec<T> = Vec::new();
    for value in values {
        if !distinct.contains(value) {
            distinct.push(value.clone());
        }
    }
    distinct
}
