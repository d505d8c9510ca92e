mod rewritten;

use super::*;
use crate::{
    Metrics,
    testing::{self, flight, place, record, record_and_die, slow_ring, small_log},
};
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::io::Cursor;

fn open(file: &[u8]) -> Result<Reader<Cursor<&[u8]>>, ReadError> {
    Reader::of(Path::new("a.mcap"), Cursor::new(file))
}

/// Reads and measures everything in a log; returns the number of ticks.
fn read(file: &[u8]) -> Option<(usize, Metrics)> {
    let mut reader = open(file).ok()?;
    let mut metrics = Metrics::new(&slow_ring());
    let mut ticks = 0;
    for tick in reader.ticks(&slow_ring()) {
        metrics.observe(&tick.frame);
        ticks += 1;
        assert!(ticks < 10_000, "the reader does not end");
    }
    // Must return or refuse, not panic.
    let _ = reader.scenario();
    Some((ticks, metrics))
}

#[test]
fn a_log_gives_back_its_flight() {
    let file = small_log(record);
    let mut reader = open(&file).unwrap();
    assert_eq!(reader.run().unwrap()["uavs"], "3");
    let ticks: Vec<_> = reader.ticks(&slow_ring()).collect();
    let frames: Vec<_> = ticks.iter().map(|tick| tick.frame.uavs.clone()).collect();
    let flown: Vec<_> = flight(&slow_ring(), 0..12).into_iter().map(|frame| frame.uavs).collect();
    assert_eq!(frames, flown);
    assert!(ticks[0].has_lines && !ticks[1].has_lines);
    assert!(ticks[0].leader.is_some());
    assert!(reader.has_ended() && reader.damages() == &LogDamages::default());
    assert_eq!(reader.result().unwrap()["ticks"], "12");
    assert_eq!(reader.scenario().unwrap().name, "synthetic");
}

#[test]
fn a_log_cut_at_any_byte_yields_its_beginning_or_a_clear_error() {
    // Every byte is cut in the tests of `salvage`; a reader takes longer.
    for (file, step) in [(small_log(record_and_die), 7), (small_log(record), 23)] {
        let mut most = 0;
        for cut in (0..file.len()).step_by(step) {
            let Some((ticks, _)) = read(&file[..cut]) else {
                assert!(cut < 8, "cut at byte {cut}");
                continue;
            };
            assert!(ticks >= most, "cut at byte {cut}");
            most = ticks;
        }
        assert_eq!(most, read(&file).unwrap().0);
    }
}

#[test]
fn flipped_bits_never_harm_the_reader() {
    let file = small_log(record);
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for _ in 0..500 {
        let mut broken = file.clone();
        for _ in 0..=random.next_u32() % 4 {
            let bit = random.next_u64() as usize % (8 * broken.len());
            broken[bit / 8] ^= 1 << (bit % 8);
        }
        drop(read(&broken));
    }
}

#[test]
fn extreme_numbers_never_harm_the_reader() {
    let file = small_log(record);
    let extremes = [[0xff; 8], [0; 8], [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]];
    for (at, extreme) in (0..file.len() - 8).step_by(17).zip(extremes.iter().cycle()) {
        let mut broken = file.clone();
        broken[at..at + 8].copy_from_slice(extreme);
        drop(read(&broken));
    }
}

#[test]
fn a_file_that_is_not_a_log_gets_a_clear_error() {
    for (file, expected) in [
        (b"".as_slice(), "is empty"),
        (b"dear diary", "is not an MCAP file"),
        (&mcap::MAGIC[..5], "cut off within its first 8 bytes"),
    ] {
        let error = open(file).err().unwrap().to_string();
        assert!(error.starts_with("log a.mcap: ") && error.contains(expected), "{error}");
    }
    for missing in ["/nowhere/run.mcap", "/tmp", "/dev/zero"] {
        let error = Reader::open(Path::new(missing)).err().unwrap().to_string();
        assert!(error.contains(missing) && error.contains("give a run's folder"), "{error}");
    }
}

#[test]
fn a_foreign_mcap_file_is_readable_but_has_no_scenario() {
    let mut file = Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut file).unwrap();
    let channel = writer.add_channel(0, "/uav/001/state", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    drop(writer);
    let mut reader = open(file.get_ref()).unwrap();
    assert!(reader.scenario().unwrap_err().to_string().contains("not a log of ringwing"));
    assert_eq!(reader.next().unwrap().data, b"{}");
}

#[test]
fn a_log_of_another_version_names_that_version() {
    let (_folder, path) = place();
    let scenario = slow_ring();
    let opening = crate::log::Opening { text: "wings = 3\n", ..testing::opening(&scenario) };
    drop(crate::log::LogWriter::create(&path, &opening).unwrap());
    let error = Reader::open(&path).unwrap().scenario().unwrap_err().to_string();
    assert!(error.contains("was written by ringwing") && error.contains("wings"), "{error}");
}
