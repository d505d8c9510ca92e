use super::*;
use crate::testing::{record, record_and_die, small_log};
use mcap::records::MessageHeader;
use std::io::Cursor;

#[derive(Debug, PartialEq)]
enum RecordGist {
    Message(MessageHeader, Vec<u8>),
    Other(u8),
}

fn gist(file: &[u8]) -> Vec<RecordGist> {
    let gist = |record: Record<'static>| match record {
        Record::Message { header, data } => RecordGist::Message(header, data.into_owned()),
        other => RecordGist::Other(other.opcode()),
    };
    Salvage::new(Cursor::new(file)).map(gist).collect()
}

fn messages(records: &[RecordGist]) -> usize {
    records.iter().filter(|record| matches!(record, RecordGist::Message(..))).count()
}

fn damages(file: &[u8]) -> LogDamages {
    let mut salvage = Salvage::new(Cursor::new(file));
    assert!(salvage.by_ref().count() < 10_000);
    salvage.damages().clone()
}

/// Offsets of the chunks of a log.
fn chunks(file: &[u8]) -> Vec<usize> {
    let (left, channels) = (|at: usize| (file.len() - at) as u64, BTreeSet::new());
    let landmarks = Landmarks { channels: &channels, has_chunks: true };
    let is_chunk = |at: &usize| file[*at] == op::CHUNK && landmarks.is_record(&file[*at..], left(*at));
    (0..file.len()).filter(is_chunk).collect()
}

#[test]
fn a_log_cut_anywhere_yields_its_beginning() {
    for (file, step) in [(small_log(record_and_die), 1), (small_log(record), 7)] {
        let whole = gist(&file);
        assert!(messages(&whole) > 60);
        let mut longest = 0;
        for cut in (0..file.len()).step_by(step).chain([file.len()]) {
            let part = gist(&file[..cut]);
            assert_eq!(part[..], whole[..part.len()], "cut at byte {cut}");
            assert!(part.len() >= longest, "cut at byte {cut}");
            longest = part.len();
        }
        assert_eq!(longest, whole.len());
    }
}

#[test]
fn a_file_that_is_not_a_log_yields_nothing() {
    for noise in [b"".as_slice(), b"not a log at all", &[0; 4096], &[0xff; 4096]] {
        assert_eq!(gist(noise), []);
    }
}

#[test]
fn a_whole_log_has_an_end_and_no_damage() {
    let file = small_log(record);
    let mut salvage = Salvage::new(Cursor::new(&file));
    assert!(salvage.by_ref().count() > 60);
    assert!(salvage.has_ended());
    assert_eq!(salvage.damages(), &LogDamages::default());
}

#[test]
fn a_flipped_bit_costs_at_most_one_chunk() {
    let file = small_log(record);
    let whole = gist(&file);
    let per_chunk = messages(&whole).div_ceil(chunks(&file).len() - 1) + 20;
    let data_end = file.len() - usize::from_le_bytes(file[file.len() - 28..][..8].try_into().unwrap());
    // A prime step reaches all bits of a byte and every part of the file.
    for bit in (64..8 * (file.len() - data_end)).step_by(101) {
        let mut broken = file.clone();
        broken[bit / 8] ^= 1 << (bit % 8);
        let left = gist(&broken);
        assert!(messages(&left) + per_chunk >= messages(&whole), "bit {bit}: {} left", messages(&left));
        let kept = left.iter().filter(|record| matches!(record, RecordGist::Message(..)));
        assert!(kept.into_iter().all(|record| whole.contains(record)), "bit {bit}");
    }
}

#[test]
fn a_damaged_chunk_is_skipped_and_reported() {
    let mut file = small_log(record);
    let (whole, second) = (gist(&file), chunks(&file)[1]);
    file[second + 80] ^= 4;
    let found = damages(&file);
    assert_eq!((found.count, found.listed[0].offset), (1, second as u64));
    assert!(found.listed[0].problem.contains("chunk"), "{found:?}");
    assert!(messages(&gist(&file)) < messages(&whole));
}

#[test]
fn a_chunk_that_claims_a_terabyte_costs_no_memory() {
    let mut file = small_log(record);
    let first = chunks(&file)[0];
    file[first + 9 + 16..][..8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert!(damages(&file).listed[0].problem.contains("claims to hold 1099511627776 bytes"));
    // A record whose own length is wrong: reading resumes at the next chunk.
    let mut file = small_log(record);
    file[first + 1..][..8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert_eq!(damages(&file).listed[0].problem, "damaged");
}
