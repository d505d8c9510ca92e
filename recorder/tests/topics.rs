//! The README lists every topic of the log.

use ringwing_recorder::schema::topics::{self, UavTopic};

#[test]
fn the_readme_names_every_topic_of_the_log() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md");
    let readme = std::fs::read_to_string(path).unwrap();
    let of_uavs = [UavTopic::Control, UavTopic::State].map(|topic| topic.name(1, 6));
    for topic in topics::ALL.into_iter().chain(of_uavs.iter().map(String::as_str)) {
        assert!(readme.contains(&format!("`{topic}`")), "{topic} is not in the README");
    }
}
