//! Any bytes at all, read as a log: `cargo +nightly fuzz run reader`, best begun with small logs in `fuzz/corpus/reader`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ringwing_recorder::{Metrics, reader::Reader};
use std::{io::Cursor, path::Path};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut reader) = Reader::of(Path::new("fuzz.mcap"), Cursor::new(bytes)) else { return };
    let Ok(scenario) = reader.scenario() else {
        reader.ticks(3).for_each(drop);
        return;
    };
    let mut metrics = Metrics::new(&scenario);
    for tick in reader.ticks(scenario.formation.uavs) {
        metrics.observe(&tick.frame);
    }
    drop(metrics.summary());
});
