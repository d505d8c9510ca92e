//! Events in words, with the names that the scenario gives its obstacles.

use crate::Scenario;
use ringwing_flight::Event;

impl Scenario {
    /// The name of the obstacle with this index; an index out of range, from a damaged log, is shown as a number.
    pub fn obstacle_name(&self, index: u32) -> String {
        let named = self.obstacles.get(index as usize).map(|obstacle| obstacle.name.clone());
        named.unwrap_or_else(|| format!("obstacle {index}"))
    }

    /// `event` as a sentence for people.
    pub fn event_text(&self, event: &Event) -> String {
        event.text(|index| self.obstacle_name(index))
    }
}
