//! Takes over the log of a recorder that died: moves everything readable into a fresh, whole log.
//!
//! The new file is called `<log>.part` until it holds everything that the old one did; then it replaces the old one in
//! one step, so that the most complete log is in its place at any moment. Must never touch a file that is not a log of
//! this flight.

use super::{
    LAYOUT, LogWriter, Opening, RESULT, RUN, SCENARIO, copy::RecordCopier, replay::Past, salvage::Salvage,
};
use crate::RecorderError;
use mcap::{
    MAGIC,
    records::{MessageHeader, Record},
};
use std::{
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};

/// Whether a dead recorder has left a log at `path`.
pub(crate) fn is_needed(path: &Path) -> bool {
    path.exists()
}

/// Makes a whole log of what the dead recorder left at `path`, and feeds its messages to `past`.
///
/// Refuses the log of another flight. While the flight has not `begun`, any log with messages belongs to another
/// flight.
pub(crate) fn take_over(
    path: &Path,
    opening: &Opening,
    begun: bool,
    past: &mut Past,
) -> Result<LogWriter, RecorderError> {
    // Before anything is created, so that a refusal leaves the folder as it was.
    check_is_of_this_flight(path, opening, begun)?;
    let mut takeover =
        Takeover { log: LogWriter::create(&part_of(path), opening)?, copier: RecordCopier::default(), past };
    for record in Salvage::new(open(path)?) {
        takeover.take(record)?;
    }
    takeover.past.end();
    let Takeover { mut log, past, .. } = takeover;
    if past.has_introduction {
        log.skip_introduction();
    }
    // Flush before the move: the file that replaces the old log must hold all that the old one held.
    log.flush()?;
    log.move_to(path)?;
    Ok(log)
}

fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

fn open(path: &Path) -> Result<BufReader<File>, RecorderError> {
    File::open(path).map(BufReader::new).map_err(RecorderError::log(path, "read"))
}

fn check_is_of_this_flight(path: &Path, opening: &Opening, begun: bool) -> Result<(), RecorderError> {
    let mut start = Vec::new();
    let magic = MAGIC.len() as u64;
    open(path)?.take(magic).read_to_end(&mut start).map_err(RecorderError::log(path, "read"))?;
    // A file shorter than the magic is not foreign: a recorder that dies before its first flush leaves an empty one.
    // In the search, `Some(None)` ends it without a problem.
    let problem = if MAGIC.starts_with(&start) {
        Salvage::new(open(path)?).find_map(|record| match record {
            Record::Attachment { header, data, .. } if header.name == SCENARIO => {
                (*data != *opening.text.as_bytes()).then_some(Some("this is the log of another scenario"))
            }
            // A log names its scenario before its first message.
            Record::Message { .. } => Some((!begun).then_some("this is the log of an earlier flight")),
            _ => None,
        })
    } else {
        Some(Some("this is not a log"))
    };
    match problem.flatten() {
        Some(problem) => Err(RecorderError::Foreign { path: path.to_owned(), problem }),
        None => Ok(()),
    }
}

/// A takeover in progress.
struct Takeover<'a> {
    log: LogWriter,
    copier: RecordCopier,
    past: &'a mut Past,
}

impl Takeover<'_> {
    fn take(&mut self, record: Record) -> Result<(), RecorderError> {
        match &record {
            Record::Message { header, data } => self.take_message(*header, data),
            // The new log writes these records itself.
            Record::Metadata(metadata) if [RUN, RESULT].contains(&metadata.name.as_str()) => Ok(()),
            Record::Attachment { header, .. } if [SCENARIO, LAYOUT].contains(&header.name.as_str()) => Ok(()),
            _ => self.log.extend(|writer| self.copier.copy(record, writer)),
        }
    }

    fn take_message(&mut self, header: MessageHeader, data: &[u8]) -> Result<(), RecorderError> {
        let sequence = header.sequence;
        // A message whose channel is lost is of no use to any reader.
        let Some((header, topic)) = self.copier.translate(header) else { return Ok(()) };
        self.past.learn(topic, sequence, data);
        self.log.copy(&header, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        process::recording::Recording,
        schema::topics,
        testing::{
            self, Seen, flight, messages, place, record, record_and_die, recording, ring_of, slow_ring,
        },
    };
    use foxglove::messages::Log as Line;
    use mcap::Summary;
    use prost::Message;
    use ringwing_scenario::Scenario;
    use std::fs;

    fn seen(path: &Path) -> Vec<Seen> {
        messages(&fs::read(path).unwrap())
    }

    fn undisturbed(scenario: &Scenario, ticks: std::ops::Range<i64>) -> Vec<Seen> {
        let (_folder, path) = place();
        record(&path, scenario, &flight(scenario, ticks));
        seen(&path)
    }

    fn was_logged(whole: &[Seen], message: &Seen) -> bool {
        whole.iter().any(|other| (&other.topic, other.tick) == (&message.topic, message.tick))
    }

    fn gaps(messages: &[Seen]) -> Vec<String> {
        let lines = messages.iter().filter(|message| message.topic == topics::LOG);
        let lines = lines.map(|message| Line::decode(&*message.data).unwrap());
        lines.filter(|line| line.name == "recorder.gap").map(|line| line.message).collect()
    }

    #[test]
    fn a_successor_continues_the_log_and_only_a_gap_is_missing() {
        let (_folder, path) = place();
        let scenario = ring_of(4, 40.0);
        record_and_die(&path, &scenario, &flight(&scenario, 0..472));
        record(&path, &scenario, &flight(&scenario, 480..700));
        let (taken_over, whole) = (seen(&path), undisturbed(&scenario, 0..700));
        assert_eq!(gaps(&taken_over), ["ticks 450 to 479 were lost with the recorder's predecessor"]);
        // A successor shows scenes and faults once more, its trails and counts lack the lost ticks, and the gap is an event.
        let depends_on_one_tick = |message: &&Seen| {
            ![topics::EVENTS, topics::FAULTS, "/scene/", topics::SWARM_METRICS]
                .iter()
                .any(|topic| message.topic.starts_with(topic))
        };
        let is_no_gap = |message: &&Seen| gaps(std::slice::from_ref(*message)).is_empty();
        let kept: Vec<_> = taken_over.iter().filter(depends_on_one_tick).filter(is_no_gap).collect();
        let was_kept = |message: &&Seen| !(450..480).contains(&message.tick);
        let expected: Vec<_> = whole.iter().filter(depends_on_one_tick).filter(was_kept).collect();
        assert_eq!(kept, expected);
        let shown_again: Vec<_> =
            taken_over.iter().filter(|message| message.tick == 480 && !was_logged(&whole, message)).collect();
        for topic in [
            topics::FAULTS,
            topics::FORMATION_SCENE,
            topics::OBSTACLE_SCENE,
            topics::PATH_SCENE,
            topics::UAV_SCENE,
        ] {
            assert!(shown_again.iter().any(|message| message.topic == topic), "{topic}");
        }
        assert!(!part_of(&path).exists());
    }

    #[test]
    fn a_successor_keeps_the_metrics_of_its_predecessor() {
        let (_folder, path) = place();
        let scenario = ring_of(4, 40.0);
        let frames = flight(&scenario, 0..700);
        record_and_die(&path, &scenario, &frames[..450]);
        let mut second = recording(&path, &scenario);
        testing::observe(&mut second, &frames[400..]);
        let (_folder, path) = place();
        let mut whole = recording(&path, &scenario);
        testing::observe(&mut whole, &frames);
        let report = second.report();
        // Formation, obstacles, path and UAVs are shown once more; faults are due there in any case.
        let messages = report.messages - 4;
        assert_eq!(crate::RecorderReport { messages, ..report }, whole.report());
    }

    #[test]
    fn recorders_may_die_one_after_the_other() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        record_and_die(&path, &scenario, &flight(&scenario, 0..120));
        record_and_die(&path, &scenario, &flight(&scenario, 110..290));
        record(&path, &scenario, &flight(&scenario, 290..320));
        let expected = [(100, 109), (250, 289)].map(|(first, last)| {
            format!("ticks {first} to {last} were lost with the recorder's predecessor")
        });
        assert_eq!(gaps(&seen(&path)), expected);
        let summary = Summary::read(&fs::read(&path).unwrap()).unwrap().unwrap();
        assert_eq!((summary.metadata_indexes.len(), summary.attachment_indexes.len()), (2, 2));
    }

    #[test]
    fn a_takeover_that_was_killed_starts_again() {
        let (_folder, path) = place();
        let scenario = ring_of(3, 40.0);
        record_and_die(&path, &scenario, &flight(&scenario, 0..200));
        let before = seen(&path);
        let old = fs::read(&path).unwrap();
        // Killed at the start, in the middle and at the end of the copy.
        for copied in [0, 300, old.len()] {
            fs::write(part_of(&path), &old[..copied]).unwrap();
            drop(recording(&path, &scenario));
            assert_eq!(seen(&path), before);
            assert!(!part_of(&path).exists());
            fs::write(&path, &old).unwrap();
        }
    }

    #[test]
    fn a_log_cut_anywhere_is_taken_over() {
        let (_folder, path) = place();
        let scenario = slow_ring();
        record_and_die(&path, &scenario, &flight(&scenario, 0..12));
        let (file, whole) = (fs::read(&path).unwrap(), seen(&path));
        for cut in (0..file.len()).step_by(97) {
            fs::write(&path, &file[..cut]).unwrap();
            std::mem::forget(recording(&path, &scenario));
            let kept = seen(&path);
            assert_eq!(kept[..], whole[..kept.len()], "cut at byte {cut}");
        }
    }

    #[test]
    fn a_file_that_is_not_a_log_of_this_flight_is_left_alone() {
        let (folder, path) = place();
        let scenario = ring_of(3, 40.0);
        let refused = |content: &[u8], text: &str, begun: bool| {
            fs::write(&path, content).unwrap();
            let opening = Opening { text, ..testing::opening(&scenario) };
            let error = Recording::begin(Some(&path), &opening, begun).err().unwrap();
            assert_eq!(fs::read(&path).unwrap(), content);
            assert!(!part_of(&path).exists());
            error.to_string()
        };
        assert!(refused(b"dear diary", testing::TEXT, true).contains("this is not a log"));
        let other = folder.path().join("other.mcap");
        record(&other, &scenario, &flight(&scenario, 0..10));
        let log = fs::read(other).unwrap();
        assert!(refused(&log, "name = \"other\"", true).contains("another scenario"));
        assert!(refused(&log, testing::TEXT, false).contains("an earlier flight"));
    }
}
