//! Records a flight frame by frame: always its metrics, and its log if one is wanted.
//!
//! Must never know where frames come from: the same frames and events give the same log.

use crate::{
    RecorderError,
    flat::flattened,
    follower::Follower,
    log::{
        LogWriter, Opening,
        gap::{Gap, Gaps},
        replay::Past,
        takeover,
    },
    metrics::{FlightSummary, Frame, Moment, judge},
    process::refused_notes::RefusedNotes,
};
use ringwing_flight::{Event, GapCause, Tick, TickTiming, TimedEvent, WorldReport};
use ringwing_scenario::{Fault, Scenario};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::{collections::BTreeMap, path::Path, time::Duration};

/// The key of a log's result with the faults that were asked for during the flight, one sentence a line.
pub const ADDED_FAULTS: &str = "added_faults";

/// What the recorder leaves behind when the flight ends, for the verdict.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RecorderReport {
    /// The flight in numbers.
    pub summary: FlightSummary,
    /// The ticks that are missing from the log.
    pub gaps: Vec<Gap>,
    /// Number of messages in the log; 0 without a log.
    pub messages: u64,
    /// Why the log could not be written to its end, if it could not.
    pub problem: Option<String>,
    /// Notes that could not be recorded, as sentences: one for each UAV and reason.
    #[serde(default)]
    pub refused_notes: Vec<String>,
}

/// A recording in progress.
pub struct Recording {
    log: Option<LogWriter>,
    flight: Follower,
    gaps: Gaps,
    /// What the flight is judged by.
    scenario: Scenario,
    timing: bool,
    /// Why the ticks before the first frame are missing, if they are.
    first_cause: GapCause,
    /// Whether a frame has come.
    began: bool,
    /// The faults that were asked for during the flight. Events cut long sentences short, and these are whole.
    added_faults: Vec<Fault>,
    refused_notes: RefusedNotes,
}

impl Recording {
    /// Starts the log at `path`, or continues the log of a recorder that died. Without a path, the flight is only measured.
    ///
    /// While the flight has not `begun`, a log with messages belongs to another flight and is refused.
    pub fn begin(path: Option<&Path>, opening: &Opening, begun: bool) -> Result<Self, RecorderError> {
        let mut past = Past::new(opening.scenario);
        let log = match path {
            Some(path) if takeover::is_needed(path) => {
                Some(takeover::take_over(path, opening, begun, &mut past)?)
            }
            Some(path) => Some(LogWriter::create(path, opening)?),
            None => None,
        };
        // A successor misses what its predecessor had not flushed; a first recorder misses what flew before it was ready.
        let first_cause =
            if past.gaps.expected() > 0 { GapCause::LostWithPredecessor } else { GapCause::StartedLate };
        let refused_notes = RefusedNotes::after(&past.events);
        Ok(Self {
            log,
            flight: Follower::resuming(opening.scenario, past.metrics, past.viewer, past.events),
            gaps: past.gaps,
            scenario: opening.scenario.clone(),
            timing: opening.timing,
            first_cause,
            began: false,
            added_faults: Vec::new(),
            refused_notes,
        })
    }

    /// The first tick that is not recorded yet.
    pub(crate) fn expected(&self) -> i64 {
        self.gaps.expected()
    }

    /// The swarm in the last frame, if there was one.
    pub fn moment(&self) -> Option<&Moment> {
        self.began.then(|| self.flight.moment())
    }

    /// Takes an event; the log gets it with the frame of its tick, or with the next one if that has passed.
    pub fn log_event(&mut self, event: TimedEvent) {
        self.flight.take_event(event);
    }

    fn log_gap(&mut self, tick: i64, gap: Gap, cause: GapCause) {
        let (first_tick, last_tick) = (Tick(gap.first_tick), Tick(gap.last_tick));
        let event = Event::RecorderGap { first_tick, last_tick, cause };
        self.log_event(TimedEvent { tick: Tick(tick), event });
    }

    /// Takes the next frame.
    pub fn observe(&mut self, frame: &Frame, timing: Option<&TickTiming>) -> Result<(), RecorderError> {
        // Ticks that are missing before the first frame have another cause than those in mid-flight.
        let cause = if self.began { GapCause::FellBehind } else { self.first_cause };
        if let Some(gap) = self.gaps.pass(frame.tick) {
            self.log_gap(frame.tick, gap, cause);
        }
        self.began = true;
        for event in self.refused_notes.news(&frame.notes) {
            self.log_event(TimedEvent { tick: Tick(frame.tick), event });
        }
        let events = self.flight.observe(frame);
        self.flight.set_lost(self.gaps.lost());
        // Stop here without a log: only the log holds views, and making them takes longer than measuring.
        let Some(log) = &mut self.log else { return Ok(()) };
        let view = self.flight.view(frame, timing);
        log.write_frame(frame, timing, &events, &view)
    }

    /// Flushes the log if the last flush was more than `period` of wall-clock time ago.
    pub(crate) fn flush_if_older(&mut self, period: Duration) -> Result<(), RecorderError> {
        self.log.as_mut().map_or(Ok(()), |log| log.flush_if_older(period))
    }

    /// The report on the flight so far.
    pub fn report(&self) -> RecorderReport {
        RecorderReport {
            summary: self.flight.summary(),
            gaps: self.gaps.closed().to_vec(),
            messages: self.log.as_ref().map_or(0, LogWriter::messages),
            problem: None,
            refused_notes: self.refused_notes.sentences(),
        }
    }

    /// Ends the log with the verdict, the metrics and the report of the `world`; without a report the verdict is `failed`.
    pub fn finish(&mut self, world: Option<&WorldReport>) -> Result<(), RecorderError> {
        // A run that ends before its flight has no tick at all, and its last events are logged at tick 0.
        let last_tick = (self.gaps.expected() - 1).max(0);
        let events = self.flight.finish(last_tick);
        let result = self.result(&self.flight.summary(), world);
        let Some(log) = &mut self.log else { return Ok(()) };
        log.write_last_events(last_tick, &events)?;
        log.finish(result)
    }

    /// Takes the faults that were asked for during the flight, for the log's result.
    pub(crate) fn set_added_faults(&mut self, faults: Vec<Fault>) {
        self.added_faults = faults;
    }

    fn result(&self, summary: &FlightSummary, world: Option<&WorldReport>) -> BTreeMap<String, String> {
        let violations = judge(&self.scenario, summary, world.map(|world| world.collisions.len()));
        // A flight that did not reach its end has failed, even if it met every requirement until then.
        let verdict = match world {
            Some(world) if world.complete && violations.is_empty() => "passed",
            Some(world) if world.complete => "violated",
            _ => "failed",
        };
        let mut result = BTreeMap::from([
            ("verdict".to_owned(), verdict.to_owned()),
            ("violations".to_owned(), violations.join("; ")),
        ]);
        result.extend(texts("", summary));
        if !self.added_faults.is_empty() {
            let sentences: Vec<String> = self.added_faults.iter().map(Fault::to_string).collect();
            result.insert(ADDED_FAULTS.to_owned(), sentences.join("\n"));
        }
        if let Some(world) = world {
            result.extend(texts("world.", world));
        }
        if !self.timing {
            // These are wall-clock times: with them, equal flights would give different files.
            result.retain(|key, _| !key.starts_with("world.latency") && key != "world.late_max_us");
        }
        result
    }
}

/// The numbers and texts of `value` as metadata: each by its path after `prefix`.
fn texts(prefix: &str, value: &impl Serialize) -> impl Iterator<Item = (String, String)> {
    let leaves = flattened(&serde_json::to_value(value).unwrap_or_default());
    leaves.into_iter().map(move |(path, leaf)| {
        let text = if let Value::String(text) = leaf { text } else { leaf.to_string() };
        (format!("{prefix}{path}"), text)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        schema::{LoggedEvent, Note, UavNotes, topics},
        testing::{self, flight, messages, place, ring_of},
    };
    use foxglove::messages::Log;
    use prost::Message;
    use ringwing_flight::{Latency, Notes, UavId};

    fn lines(path: &Path) -> Vec<(u32, String)> {
        let seen = messages(&std::fs::read(path).unwrap());
        let logged = seen.iter().filter(|message| message.topic == topics::LOG);
        logged.map(|message| (message.tick, Log::decode(&*message.data).unwrap().message)).skip(1).collect()
    }

    fn world() -> WorldReport {
        WorldReport {
            last_tick: 9,
            complete: true,
            payload_hash: "00ff".into(),
            collisions: Vec::new(),
            failsafes: 0,
            refused_commands: 0,
            reused_commands: 0,
            missed_deadlines: 0,
            unanswered_ticks: 0,
            late_max_us: 0.5,
            latency: Some(Latency { p50_us: 1.0, p99_us: 2.0, max_us: 3.0 }),
        }
    }

    fn healed(tick: i64, sentence: &str) -> TimedEvent {
        TimedEvent { tick: Tick(tick), event: Event::FaultHealed { sentence: sentence.into() } }
    }

    #[test]
    fn events_are_logged_at_their_tick_for_programs_and_for_viewers() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut recording = testing::recording(&path, &scenario);
        for (tick, text) in [(5, "later"), (2, "sooner"), (30, "never reached")] {
            recording.log_event(healed(tick, text));
        }
        let last = TimedEvent { tick: Tick(10), event: Event::RunInterrupted };
        let text = last.event.text(|_| String::new());
        recording.log_event(last);
        testing::observe(&mut recording, &flight(&scenario, 0..10));
        recording.finish(None).unwrap();
        assert_eq!(lines(&path), [(2, "sooner".into()), (5, "later".into()), (9, text)]);
        let seen = messages(&std::fs::read(path).unwrap());
        let events = seen.iter().filter(|message| message.topic == topics::EVENTS);
        let events: Vec<_> = events.map(|message| LoggedEvent::decode(&*message.data).unwrap()).collect();
        assert_eq!(events.iter().map(|event| event.tick).collect::<Vec<_>>(), [2, 5, 10]);
        assert_eq!(events[0].event(), Some(healed(2, "sooner")));
    }

    #[test]
    fn a_successor_does_not_log_an_event_again() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut first = testing::recording(&path, &scenario);
        first.log_event(healed(2, "link 1->2 hold"));
        testing::observe(&mut first, &flight(&scenario, 0..51));
        std::mem::forget(first);
        let mut second = testing::recording(&path, &scenario);
        second.log_event(healed(2, "link 1->2 hold"));
        testing::observe(&mut second, &flight(&scenario, 50..60));
        second.finish(None).unwrap();
        assert_eq!(lines(&path), [(2, "link 1->2 hold".into())]);
    }

    #[test]
    fn lost_ticks_are_counted_and_logged_once() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut recording = testing::recording(&path, &scenario);
        let frames = [flight(&scenario, 1..4), flight(&scenario, 6..9)].concat();
        testing::observe(&mut recording, &frames);
        recording.finish(None).unwrap();
        assert_eq!((recording.report().summary.ticks_lost, recording.report().gaps.len()), (3, 2));
        let expected = [
            (1, "tick 0 was lost before the recorder joined"),
            (6, "ticks 4 to 5 were lost: the recorder fell behind"),
        ];
        assert_eq!(lines(&path), expected.map(|(tick, text)| (tick, text.to_owned())));
    }

    #[test]
    fn the_result_holds_no_wall_clock_without_timing() {
        let scenario = ring_of(3, 40.0);
        for timing in [false, true] {
            let opening = Opening { timing, ..testing::opening(&scenario) };
            let recording = Recording::begin(None, &opening, false).unwrap();
            let flown = FlightSummary { ticks: 10, commanded: 3, ..FlightSummary::default() };
            let result = recording.result(&flown, Some(&world()));
            assert_eq!(
                (result["verdict"].as_str(), result["world.payload_hash"].as_str()),
                ("passed", "00ff")
            );
            assert_eq!(result.contains_key("world.latency.p50_us"), timing);
            assert_eq!(result.contains_key("world.late_max_us"), timing);
            assert!(!result.contains_key("settling_s"));
        }
    }

    #[test]
    fn a_fault_that_a_live_run_heals_before_its_end_is_healed_once() {
        let (_folder, path) = place();
        let mut scenario = ring_of(3, 40.0);
        // 0.05 s to 0.2 s, and again from 0.3 s to 0.45 s.
        scenario.faults = ["at 0.05 s link 1->2 hold for 150 ms", "at 0.3 s link 1->2 hold for 150 ms"]
            .map(|s| s.parse().unwrap())
            .into();
        let mut recording = testing::recording(&path, &scenario);
        recording.log_event(healed(10, "link 1->2 hold for 150 ms"));
        testing::observe(&mut recording, &flight(&scenario, 0..60));
        recording.finish(None).unwrap();
        let ticks: Vec<u32> = lines(&path).into_iter().map(|(tick, _)| tick).collect();
        assert_eq!(ticks, [5, 10, 30, 45]);
    }

    #[test]
    fn notes_are_logged_of_the_uavs_that_have_some_and_a_refused_one_is_told_once() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut frames = flight(&scenario, 0..10);
        for frame in &mut frames[4..] {
            let mut notes = Notes::default().made_in(Tick(frame.tick), UavId(2));
            notes.set("gap_m", frame.tick as f64).unwrap();
            notes.set("not finite", 1.0).unwrap_err();
            frame.notes = vec![notes];
        }
        let mut recording = testing::recording(&path, &scenario);
        testing::observe(&mut recording, &frames);
        recording.finish(None).unwrap();
        let text = "the note \"not finite\" of uav 2 is not recorded: a name has 1 to 32 letters";
        let [line] = &lines(&path)[..] else { panic!("{:?}", lines(&path)) };
        assert!(line.0 == 4 && line.1.starts_with(text), "{line:?}");
        assert_eq!(recording.report().refused_notes, std::slice::from_ref(&line.1));
        let seen = messages(&std::fs::read(&path).unwrap());
        assert!(seen.is_sorted_by_key(|message| (message.log_time, message.topic.clone())));
        let notes: Vec<_> = seen.iter().filter(|message| message.topic.ends_with("/notes")).collect();
        assert!(notes.iter().all(|message| message.topic == "/uav/002/notes"));
        let values = notes.iter().map(|message| UavNotes::decode(&*message.data).unwrap());
        let expected = (4..10).map(|tick| UavNotes {
            tick,
            uav: 2,
            notes: vec![Note { name: "gap_m".into(), value: tick as f64 }],
        });
        assert!(values.eq(expected));
    }

    #[test]
    fn a_successor_continues_the_notes_on_their_topic() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let mut frames = flight(&scenario, 0..120);
        for frame in &mut frames {
            let mut notes = Notes::default().made_in(Tick(frame.tick), UavId(3));
            notes.set("gap_m", 1.0).unwrap();
            notes.set("", 1.0).unwrap_err();
            frame.notes = vec![notes];
        }
        testing::record_and_die(&path, &scenario, &frames[..60]);
        testing::record(&path, &scenario, &frames[60..]);
        let file = std::fs::read(&path).unwrap();
        let ticks = messages(&file).into_iter().filter(|seen| seen.topic == "/uav/003/notes");
        assert!(ticks.map(|message| message.tick).eq((0..50).chain(60..120)));
        let channels = mcap::Summary::read(&file).unwrap().unwrap().channels;
        assert_eq!(channels.values().filter(|channel| channel.topic == "/uav/003/notes").count(), 1);
        let refusals = lines(&path).into_iter().filter(|(_, line)| line.starts_with("the note"));
        assert_eq!(refusals.map(|(tick, _)| tick).collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn without_a_log_the_flight_is_measured_as_well() {
        let scenario = ring_of(3, 40.0);
        let mut recording = Recording::begin(None, &testing::opening(&scenario), false).unwrap();
        testing::observe(&mut recording, &flight(&scenario, 0..10));
        recording.finish(Some(&world())).unwrap();
        let report = recording.report();
        assert_eq!((report.summary.ticks, report.messages, report.problem), (10, 0, None));
    }
}
