//! What can still be read of a log, from its beginning to where it breaks off.
//!
//! Never fails: a record that is cut or damaged is where the log ends.

use mcap::{
    parse_record,
    records::Record,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use std::io::Read;

/// No record of ours comes near this; a longer one is damage.
const LONGEST_RECORD: usize = 64 << 20;

/// The readable records of the data section, in order.
pub(crate) struct Salvage<R> {
    reader: LinearReader,
    source: R,
}

impl<R: Read> Salvage<R> {
    /// Reads from `source`.
    pub(crate) fn new(source: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(LONGEST_RECORD);
        Self { reader: LinearReader::new_with_options(options), source }
    }
}

impl<R: Read> Iterator for Salvage<R> {
    type Item = Record<'static>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.reader.next_event()?.ok()? {
                LinearReadEvent::ReadRequest(need) => {
                    let got = self.source.read(self.reader.insert(need)).ok()?;
                    self.reader.notify_read(got);
                }
                LinearReadEvent::Record { opcode, data } => {
                    let record = parse_record(opcode, data).ok()?.into_owned();
                    return (!matches!(record, Record::DataEnd(_))).then_some(record);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{flight, place, record_and_die, slow_ring};
    use mcap::records::MessageHeader;
    use std::fs;

    #[derive(Debug, PartialEq)]
    enum Gist {
        Message(MessageHeader, Vec<u8>),
        Other(u8),
    }

    fn gist(file: &[u8]) -> Vec<Gist> {
        let gist = |record: Record<'static>| match record {
            Record::Message { header, data } => Gist::Message(header, data.into_owned()),
            other => Gist::Other(other.opcode()),
        };
        Salvage::new(file).map(gist).collect()
    }

    #[test]
    fn a_log_cut_anywhere_yields_its_beginning() {
        let (_folder, path) = place();
        let scenario = slow_ring();
        record_and_die(&path, &scenario, &flight(&scenario, 0..12));
        let file = fs::read(&path).unwrap();
        let whole = gist(&file);
        assert!(whole.iter().filter(|record| matches!(record, Gist::Message(..))).count() > 60);
        let mut longest = 0;
        for cut in 0..file.len() {
            let part = gist(&file[..cut]);
            assert_eq!(part[..], whole[..part.len()], "cut at byte {cut}");
            assert!(part.len() >= longest, "cut at byte {cut}");
            longest = part.len();
        }
        assert_eq!(longest, whole.len());
    }

    #[test]
    fn what_is_no_log_yields_nothing() {
        for noise in [b"".as_slice(), b"not a log at all", &[0; 4096], &[0xff; 4096]] {
            assert_eq!(Salvage::new(noise).count(), 0);
        }
    }
}
