//! Fuzz target that reads arbitrary bytes as a log. The reader must never panic or hang.
//!
//! Put a few small logs into `fuzz/corpus/reader` as seeds, then start `cargo +nightly fuzz run reader`.

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
