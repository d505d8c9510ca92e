//! Reads arbitrary bytes as a log, which must never panic or hang.
//!
//! Start it with `cargo +nightly fuzz run reader`, with a few small logs in `fuzz/corpus/reader` as seeds.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ringwing_recorder::{Metrics, log::reader::Reader};
use std::{io::Cursor, path::Path};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut reader) = Reader::of(Path::new("fuzz.mcap"), Cursor::new(bytes)) else { return };
    let Ok(scenario) = reader.scenario() else {
        reader.for_each(drop);
        return;
    };
    let mut metrics = Metrics::new(&scenario);
    for tick in reader.ticks(&scenario) {
        metrics.observe(&tick.frame);
    }
    drop(metrics.summary());
});
