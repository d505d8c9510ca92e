//! Reads a log as any other program can: with the `mcap` crate and the names of the recorded fields only.

use ringwing_recorder::schema::{Faults, LinkCounts, UavControl, UavNotes, UavState};
use std::{collections::BTreeMap, fs, path::Path};

/// The messages of a log, topic by topic.
pub struct Log {
    /// The encoded messages of each topic, with their log times in nanoseconds.
    pub topics: BTreeMap<String, Vec<(u64, Vec<u8>)>>,
}

impl Log {
    /// Reads the log at `path`, which must be complete, with its footer.
    pub fn read(path: &Path) -> Self {
        let bytes = fs::read(path).expect("the log exists");
        mcap::read::footer(&bytes).expect("the log has a footer");
        let mut topics: BTreeMap<String, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
        for message in mcap::MessageStream::new(&bytes).expect("an MCAP file") {
            let message = message.expect("a readable message");
            let of_topic = topics.entry(message.channel.topic.clone()).or_default();
            of_topic.push((message.log_time, message.data.to_vec()));
        }
        Self { topics }
    }

    fn decoded<T: prost::Message + Default>(&self, topic: &str) -> Vec<T> {
        let messages = self.topics.get(topic).unwrap_or_else(|| panic!("no topic {topic}"));
        messages.iter().map(|(_, bytes)| T::decode(bytes.as_slice()).expect("decodes")).collect()
    }

    /// Every state of UAV `uav`.
    pub fn states(&self, uav: u32) -> Vec<UavState> {
        self.decoded(&format!("/uav/{uav:03}/state"))
    }

    /// Every command of UAV `uav`, with the terms of the law.
    pub fn controls(&self, uav: u32) -> Vec<UavControl> {
        self.decoded(&format!("/uav/{uav:03}/control"))
    }

    /// Everything that the controller of UAV `uav` noted.
    pub fn notes(&self, uav: u32) -> Vec<UavNotes> {
        self.decoded(&format!("/uav/{uav:03}/notes"))
    }

    /// Counts of the samples on links with faults: delivered, lost, and so on.
    pub fn links(&self) -> Vec<LinkCounts> {
        self.decoded("/links")
    }

    /// The messages of `/faults`.
    pub fn faults(&self) -> Vec<Faults> {
        self.decoded("/faults")
    }

    /// The lines of `/log`, each as `name: text`.
    pub fn lines(&self) -> Vec<String> {
        let lines: Vec<foxglove::messages::Log> = self.decoded_foxglove("/log");
        lines.into_iter().map(|line| format!("{}: {}", line.name, line.message)).collect()
    }

    fn decoded_foxglove<T: foxglove::Decode>(&self, topic: &str) -> Vec<T>
    where
        T::Error: std::fmt::Debug,
    {
        let messages = self.topics.get(topic).unwrap_or_else(|| panic!("no topic {topic}"));
        messages.iter().map(|(_, bytes)| T::decode(bytes.as_slice()).expect("decodes")).collect()
    }
}
