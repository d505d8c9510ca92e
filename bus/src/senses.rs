//! The board on which the world shows one UAV what it senses.
//!
//! Obstacles have an entry of their own, because most UAVs are far from all obstacles most of the time. The world and the
//! agent then touch two cache lines in a tick instead of eight, and each line that moves from one core to another takes time.
//!
//! Must never decide what a UAV senses.

use crate::{BoardAccess, BoardReader, BoardWriter, BusError, Stamps, services};
use ringwing_flight::{NearObstacles, OwnSenses, Pace, Sensed, Tick, UavId};
use std::ops::RangeInclusive;

/// The world's end.
pub struct SensesWriter {
    own: BoardWriter<OwnSenses>,
    obstacles: BoardWriter<NearObstacles>,
}

impl SensesWriter {
    /// The writing end of the board of `uav`.
    pub fn open(access: BoardAccess, uav: UavId, pace: Pace) -> Result<Self, BusError> {
        let own = services::own_senses(uav, pace).writer(access)?;
        Ok(Self { obstacles: own.beside(&services::near_obstacles(uav, pace))?, own })
    }

    /// Shows `sensed` as the value of its tick.
    pub fn post(&self, sensed: &Sensed, stamps: Stamps) {
        // Obstacles first: once the agent sees the rest, it may read them.
        if sensed.obstacle_count > 0 {
            self.obstacles.post(sensed.tick, NearObstacles(sensed.obstacles), stamps);
        }
        self.own.post(sensed.tick, sensed.own(), stamps);
    }
}

/// The agent's end.
pub struct SensesReader {
    own: BoardReader<OwnSenses>,
    obstacles: BoardReader<NearObstacles>,
}

impl SensesReader {
    /// The reading end of the board of `uav`.
    pub fn open(access: BoardAccess, uav: UavId, pace: Pace) -> Result<Self, BusError> {
        let own = services::own_senses(uav, pace).reader(access)?;
        Ok(Self { obstacles: own.beside(&services::near_obstacles(uav, pace))?, own })
    }

    /// Hands over what the world has shown in `ticks` and the board still keeps, oldest first.
    pub fn read(&self, ticks: RangeInclusive<Tick>, mut take: impl FnMut(&Sensed)) {
        // There is no newer board to look for: a run ends with its world.
        self.own.read(ticks, |own, _| {
            if own.obstacle_count == 0 {
                return take(&own.beside(&NearObstacles::NONE));
            }
            // If the obstacles were overwritten in between, this tick is missing like any other that is no longer kept.
            self.obstacles.read(own.tick..=own.tick, |near, _| take(&own.beside(near)));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DomainOwner, Services, create_node};
    use bytemuck::Zeroable;
    use ringwing_flight::{Part, SensedObstacle};
    use ringwing_scenario::Scenario;

    const UAV: UavId = UavId(2);

    fn sensed(tick: i64, obstacles: usize) -> Sensed {
        let mut sensed = Sensed { tick: Tick(tick), uav: UAV, speed_m_s: 15.0, ..Sensed::zeroed() };
        (sensed.position_age_ticks, sensed.obstacle_count) = (7, obstacles as u32);
        let obstacle = SensedObstacle { radius_m: 3.0, position_m: [tick as f64, 1.0], ..Default::default() };
        sensed.obstacles[..obstacles].fill(obstacle);
        sensed
    }

    #[test]
    fn what_a_uav_senses_arrives_whole_with_and_without_obstacles() {
        let (owner, gate) = DomainOwner::create("").unwrap();
        let node = create_node(owner.domain(), "test").unwrap();
        let _services = Services::create(&node, owner.domain(), &Scenario::default(), 8).unwrap();
        let access = BoardAccess { node: &node, gate: &gate };
        let writer = SensesWriter::open(access, UAV, Pace::Lockstep).unwrap();
        let reader = SensesReader::open(access, UAV, Pace::Lockstep).unwrap();
        let read = |ticks: RangeInclusive<i64>| {
            let mut all = Vec::new();
            reader.read(Tick(*ticks.start())..=Tick(*ticks.end()), |sensed| all.push(*sensed));
            all
        };
        // The entry of tick 2 is that of tick 0, whose obstacles stay on the board.
        for (tick, obstacles) in [(0, 2), (1, 8), (2, 0)] {
            writer.post(&sensed(tick, obstacles), Stamps::default());
            assert_eq!(read(tick..=tick), [sensed(tick, obstacles)]);
        }
        assert_eq!(read(0..=2), [sensed(1, 8), sensed(2, 0)], "two ticks are kept");
        assert_eq!(gate.incarnation(Part::World), 1);
    }
}
