//! What to measure, as the user says it, and whether that makes sense: all of it is known before anything starts.
//!
//! Never starts, reads or writes anything.

use super::result::{Case, Load, Subject, Wake};
use crate::{WrongUsage, placement::Placement};
use clap::ValueEnum;
use ringwing_scenario::{PAYLOAD_MAX_BYTES, UAVS_MAX};
use std::path::PathBuf;

/// What to measure.
#[derive(Debug, Clone, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(super) verb: Option<Verb>,
    /// Sizes of the swarm
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=i64::from(UAVS_MAX)))]
    uavs: Vec<u32>,
    /// Rates of paced loads in Hz
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1000))]
    rate: Vec<u32>,
    /// Each tick as soon as the one before is answered, or each at its time
    #[arg(long, value_name = "LOADS", value_delimiter = ',')]
    load: Vec<LoadKind>,
    /// How the swarm's processes wait: at the gate, spinning there, or on iceoryx2's own events
    #[arg(long, value_name = "WAYS", value_delimiter = ',', default_value = "gate")]
    wake: Vec<WakeKind>,
    /// Bytes sent each way in a tick beside the messages
    #[arg(long, value_name = "BYTES", value_delimiter = ',', default_value = "0", value_parser = clap::value_parser!(u32).range(..=i64::from(PAYLOAD_MAX_BYTES)))]
    payload: Vec<u32>,
    /// Fly the swarm without a recorder, with one that writes a log, or both
    #[arg(long, value_name = "OFF,ON", value_delimiter = ',', default_value = "off")]
    recorder: Vec<Switch>,
    /// What to compare with
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    transport: Vec<Transport>,
    #[command(flatten)]
    pub(super) placement: Placement,
    /// How often to measure each case
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: Option<u32>,
    /// How long each case runs before it is measured
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    warm_up: Option<f64>,
    /// How long each case is measured
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Seed of the order of the cases and of the flights
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub(super) seed: u64,
    /// Print the results as JSON
    #[arg(long)]
    pub(super) json: bool,
    /// Leave the results in this folder
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Leave the log of each recorded case's first flight there too, with `/timing`
    #[arg(long, requires = "out")]
    pub(super) mcap: bool,
    /// A first impression, in less than 30 s
    #[arg(long)]
    pub(super) quick: bool,
    /// Measure nothing: say what of this machine spoils a measurement
    #[arg(long, exclusive = true)]
    pub(super) doctor: bool,
}

/// What else there is to do with results.
#[derive(Debug, Clone, clap::Subcommand)]
pub(super) enum Verb {
    /// Show two results side by side, and which differences are more than their spread
    Compare(super::compare::Args),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoadKind {
    Closed,
    Paced,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WakeKind {
    Gate,
    Spin,
    Event,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Switch {
    Off,
    On,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Transport {
    Gate,
    Atomic,
    Futex,
    Pipe,
    PipePolled,
    UnixDatagram,
    Udp,
    Tcp,
    /// The swarm alone
    None,
}

/// What to measure, validated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axes {
    pub(super) uavs: Vec<u32>,
    pub(super) loads: Vec<Load>,
    pub(super) wakes: Vec<Wake>,
    pub(super) payloads: Vec<u32>,
    pub(super) recorders: Vec<bool>,
    pub(super) baselines: Vec<Subject>,
    pub(super) repeats: u32,
    pub(super) warm_up_s: f64,
    pub(super) measure_s: f64,
}

/// The longest warm-up, and the longest measurement of a case.
const LONGEST_S: f64 = 60.0;
const SHORTEST_S: f64 = 0.01;

impl Args {
    /// What to measure, or why that makes no sense.
    pub(super) fn axes(&self) -> Result<Axes, WrongUsage> {
        self.refuse_contradictions()?;
        let quick = self.quick;
        let or = |given: &[u32], quickly: &[u32], fully: &[u32]| {
            distinct(if !given.is_empty() {
                given
            } else if quick {
                quickly
            } else {
                fully
            })
        };
        Ok(Axes {
            uavs: or(&self.uavs, &[6], &[1, 6, 30, 100, 200]),
            loads: self.loads(&or(&self.rate, &[100], &[100])),
            wakes: distinct(&self.wake).into_iter().map(Wake::from).collect(),
            payloads: distinct(&self.payload),
            recorders: distinct(&self.recorder).into_iter().map(|on| on == Switch::On).collect(),
            baselines: self.baselines(),
            repeats: self.repeat.unwrap_or(if quick { 1 } else { 4 }),
            warm_up_s: seconds("--warm-up", self.warm_up, 0.0, if quick { 0.1 } else { 0.3 })?,
            measure_s: seconds("--seconds", self.seconds, SHORTEST_S, if quick { 0.4 } else { 2.0 })?,
        })
    }

    fn loads(&self, rates: &[u32]) -> Vec<Load> {
        let both = [LoadKind::Closed, LoadKind::Paced];
        let kinds = if self.load.is_empty() { both.to_vec() } else { distinct(&self.load) };
        let of_kind = |kind| match kind {
            LoadKind::Closed => vec![Load::Closed],
            LoadKind::Paced => rates.iter().copied().map(Load::Paced).collect(),
        };
        kinds.into_iter().flat_map(of_kind).collect()
    }

    fn baselines(&self) -> Vec<Subject> {
        let restless = |transport: &Transport| self.placement.priority.is_none() || !transport.is_restless();
        let chosen = if self.transport.is_empty() { Transport::value_variants() } else { &self.transport };
        distinct(chosen).iter().filter(|one| restless(one)).filter_map(|one| one.subject()).collect()
    }

    fn refuse_contradictions(&self) -> Result<(), WrongUsage> {
        let urgent = self.placement.priority.is_some();
        let refusals = [
            (
                !self.rate.is_empty() && !self.load.is_empty() && !self.load.contains(&LoadKind::Paced),
                "--rate is for paced loads: add --load paced, or leave --rate out",
            ),
            (
                self.transport.len() > 1 && self.transport.contains(&Transport::None),
                "--transport none goes with no other: name those to compare with, or none alone",
            ),
            (
                self.mcap && !self.recorder.contains(&Switch::On),
                "--mcap needs a flight that is recorded: add --recorder on",
            ),
            (
                urgent && self.wake.contains(&WakeKind::Spin),
                "--priority with --wake spin would take the processors from everybody else: leave one of them out",
            ),
            (
                urgent && self.transport.iter().any(|one| one.is_restless()),
                "--priority with a transport that never sleeps (atomic, pipe-polled) would take the processors from \
                 everybody else: leave one of them out",
            ),
        ];
        refusals.iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, why)| Err(WrongUsage((*why).into())))
    }
}

impl Transport {
    fn subject(self) -> Option<Subject> {
        Some(match self {
            Self::Gate => Subject::Gate,
            Self::Atomic => Subject::Atomic,
            Self::Futex => Subject::Futex,
            Self::Pipe => Subject::Pipe,
            Self::PipePolled => Subject::PipePolled,
            Self::UnixDatagram => Subject::UnixDatagram,
            Self::Udp => Subject::Udp,
            Self::Tcp => Subject::Tcp,
            Self::None => return None,
        })
    }

    fn is_restless(self) -> bool {
        matches!(self, Self::Atomic | Self::PipePolled)
    }
}

impl From<WakeKind> for Wake {
    fn from(kind: WakeKind) -> Self {
        match kind {
            WakeKind::Gate => Self::Gate,
            WakeKind::Spin => Self::Spin,
            WakeKind::Event => Self::Event,
        }
    }
}

/// Each value once, in the order given.
fn distinct<T: Clone + PartialEq>(values: &[T]) -> Vec<T> {
    let mut distinct: Vec<T> = Vec::new();
    for value in values {
        if !distinct.contains(value) {
            distinct.push(value.clone());
        }
    }
    distinct
}

fn seconds(flag: &str, given: Option<f64>, shortest: f64, otherwise: f64) -> Result<f64, WrongUsage> {
    match given {
        Some(seconds) if !(shortest..=LONGEST_S).contains(&seconds) => Err(WrongUsage(format!(
            "{flag} {seconds}: give a number of seconds from {shortest} to {LONGEST_S}"
        ))),
        given => Ok(given.unwrap_or(otherwise)),
    }
}

impl Axes {
    /// Every case there is on these axes, each once.
    pub(super) fn cases(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for load in &self.loads {
            for uavs in &self.uavs {
                for payload_bytes in &self.payloads {
                    cases.extend(self.flights(*load, *uavs, *payload_bytes));
                    let baselines = self.baselines.iter();
                    cases.extend(baselines.map(|subject| baseline(*subject, *load, *uavs, *payload_bytes)));
                }
            }
        }
        distinct(&cases)
    }

    fn flights(&self, load: Load, uavs: u32, payload_bytes: u32) -> impl Iterator<Item = Case> {
        let ways =
            self.wakes.iter().flat_map(|wake| self.recorders.iter().map(|recorder| (*wake, *recorder)));
        ways.map(move |(wake, recorder)| Case {
            subject: Subject::Swarm,
            load,
            uavs,
            wake,
            payload_bytes,
            recorder,
        })
    }
}

/// What carries no data knows no payload, and only two take turns.
fn baseline(subject: Subject, load: Load, uavs: u32, payload_bytes: u32) -> Case {
    let uavs = if subject == Subject::Atomic { 1 } else { uavs };
    let payload_bytes = if super::transport::carries_data(subject) { payload_bytes } else { 0 };
    Case { subject, load, uavs, wake: Wake::Gate, payload_bytes, recorder: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    fn axes(line: &str) -> Result<Axes, String> {
        let words = std::iter::once("bench").chain(line.split_whitespace());
        let command = Command::try_parse_from(words).map_err(|error| error.to_string())?;
        command.args.axes().map_err(|error| error.to_string())
    }

    #[test]
    fn every_case_on_the_axes_is_there_once() {
        let axes = axes("--uavs 1,6,6 --load closed,paced --rate 50,200 --wake gate,event --payload 0,64 --transport atomic,pipe")
            .unwrap();
        let cases = axes.cases();
        let count = |subject| cases.iter().filter(|case| case.subject == subject).count();
        // 3 loads, 2 sizes, 2 payloads, 2 ways to wait.
        assert_eq!(count(Subject::Swarm), 24);
        assert_eq!(count(Subject::Pipe), 12);
        // Only two take turns, and they carry nothing.
        assert_eq!(count(Subject::Atomic), 3);
        assert_eq!(cases.len(), 39);
    }

    #[test]
    fn without_a_word_it_is_the_full_benchmark() {
        let axes = axes("").unwrap();
        assert_eq!((axes.uavs.as_slice(), axes.repeats), (&[1, 6, 30, 100, 200][..], 4));
        assert_eq!(axes.loads, [Load::Closed, Load::Paced(100)]);
        assert_eq!(axes.baselines.len(), 8);
    }

    #[test]
    fn a_quick_one_takes_less_than_thirty_seconds() {
        let axes = axes("--quick").unwrap();
        let cases = axes.cases().len() as f64;
        // And as much again to start and to end.
        assert!(2.0 * cases * f64::from(axes.repeats) * (axes.warm_up_s + axes.measure_s) < 30.0);
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_what_to_do() {
        for (line, remedy) in [
            ("--uavs 0", "1..=1024"),
            ("--uavs six", "--uavs"),
            ("--rate 100 --load closed", "add --load paced"),
            ("--rate 0", "1..=1000"),
            ("--payload 65537", "0..=65536"),
            ("--transport none,pipe", "none alone"),
            ("--transport dds", "unix-datagram"),
            ("--mcap", "--out"),
            ("--mcap --out x", "add --recorder on"),
            ("--priority 0", "1..=99"),
            ("--priority 10 --wake spin", "leave one of them out"),
            ("--priority 10 --transport pipe-polled", "leave one of them out"),
            ("--repeat 0", "1..=1000"),
            ("--seconds 0", "from 0.01 to 60"),
            ("--seconds NaN", "from 0.01 to 60"),
            ("--warm-up -1", "--warm-up"),
            ("--warm-up 61", "from 0 to 60"),
            ("--doctor --quick", "--doctor"),
        ] {
            let error = axes(line).unwrap_err();
            assert!(error.contains(remedy), "{line}: {error}");
        }
    }
}
