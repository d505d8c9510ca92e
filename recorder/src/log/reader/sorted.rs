//! Messages in the order of their times, for a log whose file has them in another order.
//!
//! Never holds the messages in memory, only where each one is: a log may be larger than the memory.

use super::topics::{Topic, Topics};
use crate::log::salvage::Salvage;
use mcap::records::{MessageHeader, Record};
use std::{
    fs::File,
    io::{self, BufWriter, Read, Seek, Write},
    os::unix::fs::FileExt,
    sync::Arc,
};

/// The messages of a log, sorted by log time. Those of one time keep the order of the file.
#[derive(Debug)]
pub(super) struct SortedMessages {
    /// The data of all messages, one after the other, in a file without a name.
    data: File,
    places: Vec<MessagePlace>,
    next: usize,
}

/// A message whose data are in the file.
#[derive(Debug)]
struct MessagePlace {
    topic: Arc<Topic>,
    header: MessageHeader,
    offset: u64,
    bytes: usize,
}

impl SortedMessages {
    /// Sorts the messages that `salvage` yields; fails if there is no room for a temporary copy of them.
    pub(super) fn of<R: Read + Seek>(salvage: &mut Salvage<R>) -> io::Result<Self> {
        let mut file = BufWriter::new(tempfile::tempfile()?);
        let (mut topics, mut places, mut offset) = (Topics::default(), Vec::new(), 0);
        for record in salvage {
            let Some(Record::Message { header, data }) = topics.take(record) else { continue };
            let Some(topic) = topics.of(header.channel_id) else { continue };
            file.write_all(&data)?;
            places.push(MessagePlace { topic: Arc::clone(topic), header, offset, bytes: data.len() });
            offset += data.len() as u64;
        }
        // A stable sort: the events of one tick stay in their order.
        places.sort_by_key(|place| place.header.log_time);
        Ok(Self { data: file.into_inner().map_err(io::IntoInnerError::into_error)?, places, next: 0 })
    }

    /// Starts again with the first message.
    pub(super) fn rewind(&mut self) {
        self.next = 0;
    }
}

impl Iterator for SortedMessages {
    type Item = (Arc<Topic>, MessageHeader, Vec<u8>);

    fn next(&mut self) -> Option<Self::Item> {
        let place = self.places.get(self.next)?;
        self.next += 1;
        let mut data = vec![0; place.bytes];
        // The copy was written a moment ago, so this fails only with the disk. A message without data counts as damaged.
        if self.data.read_exact_at(&mut data, place.offset).is_err() {
            data.clear();
        }
        Some((Arc::clone(&place.topic), place.header, data))
    }
}
