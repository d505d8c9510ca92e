use super::*;
use crate::testing::{record, record_and_die, small_log};
use mcap::records::MessageHeader;
use std::{io::Cursor, ops::Range};

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

/// Number of the records with this opcode that are no messages.
fn count(file: &[u8], opcode: u8) -> usize {
    gist(file).iter().filter(|record| **record == RecordGist::Other(opcode)).count()
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
    assert!(count(&file, op::CHANNEL) > 0 && count(&file, op::SCHEMA) > 0);
    assert_eq!((gist(&file).first(), count(&file, op::HEADER)), (Some(&RecordGist::Other(op::HEADER)), 1));
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
fn of_many_damages_the_first_are_listed_and_all_are_counted() {
    let mut damages = LogDamages::default();
    (0..150).for_each(|number| damages.add(10 * number, 3, "damaged"));
    assert_eq!((damages.listed.len(), damages.count, damages.bytes), (LISTED_DAMAGES, 150, 450));
    assert_eq!(damages.listed[99].offset, 990);
}

#[test]
fn a_damaged_chunk_is_skipped_and_reported() {
    let mut file = small_log(record);
    let (whole, second) = (gist(&file), chunks(&file)[1]);
    file[second + 80] ^= 4;
    let found = damages(&file);
    let length = u64::from_le_bytes(file[second + 1..][..8].try_into().unwrap());
    assert_eq!((found.count, found.bytes, found.listed[0].offset), (1, 9 + length, second as u64));
    assert!(found.listed[0].problem.contains("chunk"), "{found:?}");
    assert!(messages(&gist(&file)) < messages(&whole));
}

/// A record with this opcode.
fn record_of(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
}

/// `file` with more bytes at offset `at`.
fn inserted(file: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    [&file[..at], bytes, &file[at..]].concat()
}

/// A damage as offset, length and problem.
fn told(damage: &LogDamage) -> (usize, usize, &str) {
    (damage.offset as usize, damage.bytes as usize, &damage.problem)
}

#[test]
fn a_message_between_chunks_counts_unless_it_may_be_a_damaged_index() {
    let file = small_log(record);
    let (whole, second) = (gist(&file), chunks(&file)[1]);
    let known = whole.iter().find_map(|record| match record {
        RecordGist::Message(header, _) => Some(header.channel_id),
        RecordGist::Other(_) => None,
    });
    let with_message = |channel: u16, sequence: u32, publish_time: u64| {
        let (head, times) = ((channel.to_le_bytes(), sequence.to_le_bytes()), [7, publish_time]);
        let times = times.map(u64::to_le_bytes).concat();
        let body = [head.0.as_slice(), head.1.as_slice(), &times, &[0; 16]].concat();
        inserted(&file, second, &record_of(op::MESSAGE, &body))
    };
    let kept = |file: &[u8]| messages(&gist(file)) - messages(&whole);
    let known = known.unwrap();
    assert_eq!(kept(&with_message(known, 31, 5)), 1, "an index would state the length of its entries, 32");
    assert_eq!(kept(&with_message(known, 32, LONGEST_RECORD)), 1, "no chunk is as long as that");
    for doubtful in [with_message(known, 32, LONGEST_RECORD - 1), with_message(9999, 31, 5)] {
        assert_eq!(kept(&doubtful), 0);
        let expected = (second, 9 + 38, "a message that may be a damaged index");
        assert_eq!(damages(&doubtful).listed.iter().map(told).collect::<Vec<_>>(), [expected]);
    }
}

/// A file on a disk that cannot read some of its bytes.
struct DamagedDisk {
    file: Cursor<Vec<u8>>,
    bad: Range<u64>,
}

impl Read for DamagedDisk {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let at = self.file.position();
        if self.bad.contains(&at) {
            return Err(io::Error::other("bad sector"));
        }
        let most = if at < self.bad.start { self.bad.start - at } else { u64::MAX };
        self.file.by_ref().take(most).read(into)
    }
}

impl Seek for DamagedDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[test]
fn a_bad_sector_costs_the_chunk_that_it_hits() {
    let file = small_log(record);
    let (whole, chunks) = (gist(&file), chunks(&file));
    let (second, third) = (chunks[1], chunks[2]);
    let read = |bad: Range<usize>| {
        let bad = bad.start as u64..bad.end as u64;
        let mut salvage = Salvage::new(DamagedDisk { file: Cursor::new(file.clone()), bad });
        let messages = salvage.by_ref().filter(|record| matches!(record, Record::Message { .. })).count();
        assert!(messages < self::messages(&whole) && salvage.has_ended());
        (messages, salvage.damages().clone())
    };
    let (left, within) = read(second + 100..second + 110);
    let length = u64::from_le_bytes(file[second + 1..][..8].try_into().unwrap()) as usize;
    assert_eq!(
        within.listed.iter().map(told).collect::<Vec<_>>(),
        [(second, 9 + length, "cannot be read: bad sector")]
    );
    // Without its head, nothing says where the chunk ends, so the next one has to be searched for.
    let (left_without_head, at_head) = read(second..second + 1);
    assert_eq!(left_without_head, left);
    assert_eq!(
        at_head.listed.iter().map(told).collect::<Vec<_>>(),
        [(second, 0, "cannot be read: bad sector"), (second, third - second, "damaged")]
    );
}

#[test]
fn a_damaged_attachment_costs_nothing_else() {
    let file = small_log(record);
    let (whole, second) = (gist(&file), chunks(&file)[1]);
    // Two times, two empty names, three bytes of data and a checksum.
    let sound = [[0; 24].as_slice(), &3_u64.to_le_bytes(), b"abc"].concat();
    let with_checksum = |checksum: u32| {
        let body = [sound.as_slice(), &checksum.to_le_bytes()].concat();
        inserted(&file, second, &record_of(op::ATTACHMENT, &body))
    };
    let right = crc32fast::hash(&sound);
    for checksum in [0, right] {
        assert_eq!(gist(&with_checksum(checksum)).len(), whole.len() + 1, "{checksum}");
    }
    let broken = with_checksum(right ^ 1);
    assert_eq!(gist(&broken), whole);
    assert_eq!(told(&damages(&broken).listed[0]), (second, 9 + 39, "damaged"));
}

#[test]
fn a_damage_says_where_it_is_and_how_long() {
    let file = small_log(record);
    let (first, second) = (chunks(&file)[0], chunks(&file)[1]);
    // A chunk whose own length reaches into the next one: only the search finds that one.
    let mut longer = file.clone();
    longer[first + 1..][..8].copy_from_slice(&((second - first) as u64).to_le_bytes());
    assert_eq!(told(&damages(&longer).listed[0]), (first, second - first, "damaged"));
    assert_eq!(count(&longer, op::CHANNEL), count(&file, op::CHANNEL), "the summary repeats what is lost");
    let cut = &file[..second + 50];
    assert_eq!(told(&damages(cut).listed[0]), (second, 50, "cut off, or damaged up to the end"));
    let appended = inserted(&file, file.len(), b"ten bytes!");
    let problem = "more bytes after the end of the log, as if another file was appended";
    assert_eq!(told(&damages(&appended).listed[0]), (file.len(), 10, problem));
    let short_end = [MAGIC, &record_of(op::DATA_END, &[0; 3])].concat();
    let problem = "an incomplete end of the data section";
    assert_eq!(told(&damages(&short_end).listed[0]), (MAGIC.len(), 9 + 3, problem));
}

#[test]
fn a_cut_chunk_is_nothing_to_resume_at() {
    let file = small_log(record);
    let (first, second) = (chunks(&file)[0], chunks(&file)[1]);
    let length = u64::from_le_bytes(file[second + 1..][..8].try_into().unwrap()) as usize;
    // Only its last byte is missing.
    let mut cut = file[..second + 9 + length - 1].to_vec();
    cut[first + 1..][..8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    let expected = (first, cut.len() - first, "cut off, or damaged up to the end");
    assert_eq!(damages(&cut).listed.iter().map(told).collect::<Vec<_>>(), [expected]);
}

#[test]
fn an_index_whose_length_is_wrong_hides_no_chunk() {
    let file = small_log(record);
    let (first, second) = (chunks(&file)[0], chunks(&file)[1]);
    let length = u64::from_le_bytes(file[first + 1..][..8].try_into().unwrap()) as usize;
    let index = first + 9 + length;
    assert_eq!(file[index], op::MESSAGE_INDEX);
    let mut longer = file.clone();
    longer[index + 1..][..8].copy_from_slice(&((second - index) as u64).to_le_bytes());
    assert_eq!(messages(&gist(&longer)), messages(&gist(&file)));
    assert_eq!(told(&damages(&longer).listed[0]), (index, second - index, "damaged"));
}

#[test]
fn a_record_is_found_wherever_it_lies_in_the_windows_of_a_search() {
    let file = small_log(record);
    let rest = &file[chunks(&file)[0]..];
    let whole = messages(&gist(&file));
    for window in [1, 3] {
        for before_border in [0, 1, 8, 100] {
            let noise = window * SEARCH_BYTES - before_border;
            let file = [vec![0xff; noise].as_slice(), rest].concat();
            assert_eq!(messages(&gist(&file)), whole, "after {noise} bytes of noise");
            let problem = "the first bytes are not those of an MCAP file";
            assert_eq!(told(&damages(&file).listed[0]), (0, noise, problem));
        }
    }
}

#[test]
fn a_chunk_that_holds_more_or_less_than_it_claims_is_refused() {
    let records = [7; 100];
    let mut lz4 = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
    io::Write::write_all(&mut lz4, &records).unwrap();
    let packed = [
        ("", records.to_vec()),
        ("zstd", zstd::encode_all(records.as_slice(), 1).unwrap()),
        ("lz4", lz4.finish().0),
    ];
    for (compression, packed) in packed {
        let claiming = |size: u64| {
            let name = [(compression.len() as u32).to_le_bytes().as_slice(), compression.as_bytes()].concat();
            let sizes = [[0; 16].as_slice(), &size.to_le_bytes(), &[0; 4]].concat();
            let body = [sizes, name, (packed.len() as u64).to_le_bytes().to_vec(), packed.clone()].concat();
            Chunk::decompress(&body, LONGEST_RECORD).map(|_| ())
        };
        assert_eq!(claiming(100), Ok(()), "{compression}");
        assert_eq!(claiming(99), Err("a chunk of 100 bytes instead of 99".into()), "{compression}");
        assert_eq!(claiming(101), Err("a chunk of 100 bytes instead of 101".into()), "{compression}");
    }
}

#[test]
fn a_chunk_may_be_as_long_as_the_limit() {
    let file = small_log(record);
    let first = chunks(&file)[0];
    let head: [u64; 2] =
        [1, 9 + 16].map(|at| u64::from_le_bytes(file[first + at..][..8].try_into().unwrap()));
    let [length, size] = head;
    let body = &file[first + 9..][..length as usize];
    assert!(Chunk::decompress(body, size).is_ok());
    assert!(Chunk::decompress(body, size - 1).unwrap_err().contains("claims to hold"));
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
