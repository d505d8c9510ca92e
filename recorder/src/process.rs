//! The recorder's process: fetches samples in batches, and tells the world how far it has come.
//!
//! Must never send anything that changes the flight. Its only message says how far the swarm is from its formation,
//! for the progress line.

mod assembly;
mod observation;
mod ports;
pub(crate) mod recording;
mod refused_notes;
mod turn;

use crate::{RecorderError, RecorderReport, clock::Clock, log::Opening, metrics::Frame};
use assembly::{Assembled, Assembly};
pub use observation::{Observation, Seen};
use ports::{FlightPorts, ProgressPort};
use recording::Recording;
use ringwing_bus::{Gate, Member, MemberArgs, report};
use ringwing_flight::{FormationError, Part, Tick, WorldReport};
use ringwing_scenario::{Fault, Scenario};
use std::{path::PathBuf, time::Duration};
use turn::Turn;

/// Records the flight of a run to one MCAP file, and measures it.
#[derive(Debug, Clone, clap::Args)]
pub struct RecorderArgs {
    /// Which run to record.
    #[command(flatten)]
    pub member: MemberArgs,
    /// The log to write; without it, the flight is only measured.
    ///
    /// If the file is a log of this flight whose recorder died, the new recorder continues it.
    #[arg(long, value_name = "PATH")]
    pub log: Option<PathBuf>,
    /// Keep wall-clock times out of the log: equal flights then make equal files, byte for byte.
    #[arg(long)]
    pub no_timing: bool,
    /// When the run was started, in UTC, for the log of a real-time run.
    #[arg(long, value_name = "TIME")]
    pub started_at: Option<String>,
}

/// How long to wait for a batch before fetching anyway. A longer wait delays the progress line and the end of the process; a
/// shorter one wakes the process for nothing.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Wall-clock time after which a real-time run flushes its log even if simulated time stands still. A longer period loses
/// more with a recorder that dies; a shorter one makes smaller chunks, which compress worse.
const FLUSH_PERIOD: Duration = Duration::from_secs(1);
/// Progress messages per simulated second; more than the terminal shows only cost time.
const PROGRESS_HZ: u32 = 20;

/// Records until the flight ends or the process is asked to stop.
pub fn run(args: &RecorderArgs) -> Result<(), RecorderError> {
    let member = Member::join(&args.member, Part::Recorder)?;
    let text = member.domain().scenario_text()?;
    let scenario = member.scenario();
    let (timing, started_at) = (!args.no_timing, args.started_at.as_deref());
    let opening = Opening { scenario, text: &text, timing, started_at };
    // Subscribe first: the flight may go on while a log is taken over.
    let ports = FlightPorts::of_recorder(member.node(), scenario, timing)?;
    let progress = ProgressPort::open(&member)?;
    let gate = member.domain().gate()?;
    let begun = has_begun(&gate);
    // What was sent before the ports were open never comes, and in lockstep the world would wait for it.
    if let Some(open) = gate.tick() {
        gate.set_recorded(open);
    }
    let mut recording_loop =
        RecordingLoop::new(Recording::begin(args.log.as_deref(), &opening, begun)?, progress, scenario);
    let gate = member.announce_ready()?;
    let outcome = recording_loop.record(&member, &gate, &ports).and_then(|()| recording_loop.finish(&member));
    let problem = outcome.as_ref().err().map(ToString::to_string);
    let report = RecorderReport { problem, ..recording_loop.recording.report() };
    member.domain().write_report(report::RECORDER, &report)?;
    outcome
}

fn has_begun(gate: &Gate) -> bool {
    gate.is_closed() || gate.tick().is_some()
}

/// Turns samples into frames and hands these to the recording, batch by batch.
struct RecordingLoop {
    recording: Recording,
    progress_port: ProgressPort,
    assembly: Assembly,
    /// The last frame; kept to reuse its memory, and because its ring goes on from tick to tick.
    frame: Frame,
    clock: Clock,
    real_time: bool,
    /// The progress interval of the last message sent.
    progress: i64,
}

impl RecordingLoop {
    fn new(recording: Recording, progress_port: ProgressPort, scenario: &Scenario) -> Self {
        Self {
            assembly: Assembly::new(scenario.formation.uavs, recording.expected()),
            recording,
            progress_port,
            frame: Frame::new(scenario),
            clock: Clock::new(scenario.time.rate_hz),
            real_time: scenario.time.real_time,
            progress: -1,
        }
    }

    fn record(&mut self, member: &Member, gate: &Gate, ports: &FlightPorts) -> Result<(), RecorderError> {
        let mut batch = 0;
        loop {
            batch = gate.wait_for_batch(batch, LONGEST_WAIT);
            // Ask before fetching, so that everything sent until now is fetched.
            let over = gate.is_closed() || member.stop().is_set();
            let recording = &mut self.recording;
            ports.fetch(&mut self.assembly, |event| recording.log_event(event))?;
            if let Some(newest) = self.assembly.newest() {
                gate.set_recorded(Tick(newest));
                self.write_before(if over { newest + 1 } else { self.complete_before(newest) })?;
            }
            self.send_progress()?;
            if over {
                return Ok(());
            }
            if self.real_time {
                self.recording.flush_if_older(FLUSH_PERIOD)?;
            }
        }
    }

    /// The first tick that may still get more data, given the `newest` tick in the journal. In real time an agent may be
    /// late by a quarter of a second.
    fn complete_before(&self, newest: i64) -> i64 {
        let patience = if self.real_time { i64::from(self.clock.rate_hz() / 4) } else { 0 };
        newest + 1 - patience
    }

    fn write_before(&mut self, end: i64) -> Result<(), RecorderError> {
        let mut turn = Turn::begin();
        while let Some(assembled) = self.assembly.take_before(end) {
            let Assembled { samples, timing, .. } = &assembled;
            self.frame.refill(samples, self.clock.rate_hz());
            self.recording.observe(&self.frame, timing.as_ref())?;
            self.assembly.recycle(assembled);
            turn.pass_if_over();
        }
        Ok(())
    }

    fn send_progress(&mut self) -> Result<(), RecorderError> {
        let Some(moment) = self.recording.moment() else { return Ok(()) };
        let interval = self.clock.interval(moment.tick, PROGRESS_HZ);
        if interval == self.progress {
            return Ok(());
        }
        self.progress = interval;
        self.progress_port.send(FormationError {
            tick: Tick(moment.tick),
            slot_error_max_m: moment.slot_error_max_m.unwrap_or_default(),
            commanded: moment.commanded,
            measured: moment.slot_error_max_m.is_some().into(),
        })
    }

    fn finish(&mut self, member: &Member) -> Result<(), RecorderError> {
        let world = member.domain().report::<WorldReport>(report::WORLD)?;
        let added = member.domain().report::<Vec<Fault>>(report::FAULTS)?;
        self.recording.set_added_faults(added.unwrap_or_default());
        self.recording.finish(world.as_ref())
    }
}
