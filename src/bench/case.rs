//! One measurement of one case, in a process of its own: flies the swarm, or lets a hub and its peers talk.
//!
//! Leaves the trace in a file; never computes a latency. Its children end with it, and it with the benchmark.

use super::{
    result::{Case, Load, Subject, Wake},
    transport::hub,
};
use crate::{
    launcher::{Plan, launch},
    placement::Placement,
};
use anyhow::bail;
use ringwing_bus::{Domain, DomainId, member::die_with};
use ringwing_scenario::{Scenario, start};
use ringwing_world::MeasureArgs;
use std::{collections::BTreeSet, path::Path, process::ExitCode};

/// Longest flight that a scenario can be; the measurement ends it before.
const FLIGHT_S: f64 = 24.0 * 3600.0;
/// Ticks of a closed loop are those of a flight at this rate.
const CLOSED_RATE_HZ: u32 = 100;

/// What to measure.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Args {
    /// The case, in JSON.
    #[arg(long, value_parser = parse)]
    case: Case,
    /// Seed of the flight.
    #[arg(long)]
    seed: u64,
    /// Domain of a hub and its peers; a flight has its own.
    #[arg(long)]
    domain: Option<DomainId>,
    #[command(flatten)]
    measure: MeasureArgs,
    #[command(flatten)]
    placement: Placement,
    /// The benchmark, to end with.
    #[arg(long)]
    launcher: u32,
}

/// Reads a case.
pub(super) fn parse(text: &str) -> Result<Case, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

/// A case as one argument.
pub(super) fn text(case: &Case) -> String {
    serde_json::to_string(case).expect("a case has only strings for keys")
}

/// Measures.
pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    die_with(args.launcher)?;
    if args.case.subject == Subject::Swarm {
        fly(args)?;
    } else if let Some(id) = &args.domain {
        hub::run(&args.case, &Domain::join(id)?, &args.measure, &args.placement)?;
    } else {
        bail!("a hub needs a --domain");
    }
    Ok(ExitCode::SUCCESS)
}

fn fly(args: &Args) -> anyhow::Result<()> {
    let folder = args.measure.measure_into.as_deref().and_then(Path::parent);
    let plan = Plan {
        scenario: scenario(&args.case, args.seed)?,
        out: folder.unwrap_or(Path::new(".")).to_owned(),
        record: args.case.recorder,
        timing: true,
        by_hand: BTreeSet::new(),
        quiet: true,
        recorder: args.case.recorder,
        measure: Some(args.measure.clone()),
        placement: args.placement.clone(),
    };
    let outcome = launch(&plan)?;
    match outcome.failures.first() {
        Some(failure) => bail!("{failure}"),
        None => Ok(()),
    }
}

/// The flight of `case`: from drawn places in a free sky, by the paper's law, longer than anybody measures.
pub(super) fn scenario(case: &Case, seed: u64) -> anyhow::Result<Scenario> {
    let mut scenario = Scenario { name: "bench".into(), seed, ..Scenario::default() };
    scenario.formation.uavs = case.uavs;
    scenario.time.duration_s = FLIGHT_S;
    scenario.time.real_time = case.load != Load::Closed;
    scenario.time.rate_hz = match case.load {
        Load::Closed => CLOSED_RATE_HZ,
        Load::Paced(rate_hz) => rate_hz,
    };
    scenario.ipc.wake = match case.wake {
        Wake::Gate => ringwing_scenario::Wake::Gate,
        Wake::Spin => ringwing_scenario::Wake::Spin,
        Wake::Event => ringwing_scenario::Wake::Event,
    };
    (scenario.ipc.payload_bytes, scenario.ipc.few_uavs) = (case.payload_bytes, case.uavs < 3);
    let scenario = Scenario::resolved(&scenario.to_toml())?;
    start::states(&scenario)?;
    Ok(scenario)
}
