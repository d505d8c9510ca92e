//! The text of an event, in which obstacles have the names of the scenario.

use crate::Scenario;
use ringwing_flight::{Collider, Event};

impl Scenario {
    /// The name of the obstacle with this index, counted from 0.
    ///
    /// A damaged log may hold an index that is too large: the text then shows the number.
    pub fn obstacle_name(&self, index: u32) -> String {
        let named = self.all_obstacles().into_iter().nth(index as usize).map(|obstacle| obstacle.name);
        named.unwrap_or_else(|| format!("obstacle {index}"))
    }

    /// The name of what a UAV collided with.
    pub fn collider_name(&self, with: Collider) -> String {
        with.name(|index| self.obstacle_name(index))
    }

    /// `event` as a sentence for people.
    pub fn event_text(&self, event: &Event) -> String {
        event.text(|index| self.obstacle_name(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::example_scenario;
    use ringwing_flight::{IntruderId, UavId};

    #[test]
    fn the_text_of_a_collision_names_the_intruder_or_the_obstacle_or_its_unknown_index() {
        let text = |with| {
            example_scenario().event_text(&Event::Collision { uav: UavId(3), with, position_m: [1.0, -2.0] })
        };
        assert_eq!(text(Collider::Intruder(IntruderId(1))), "uav 3 and intruder 1 at (1.0, -2.0) m");
        assert_eq!(text(Collider::Obstacle(0)), "uav 3 and Obstacle 1 at (1.0, -2.0) m");
        assert_eq!(text(Collider::Obstacle(7)), "uav 3 and obstacle 7 at (1.0, -2.0) m");
    }
}
