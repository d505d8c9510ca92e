//! Where the law would take the UAV over the next seconds.
//!
//! The leader flies on along its arc, the neighbours turn with it, the obstacles move straight, and the slots stay where
//! they are in the formation. All of it is seen from the air, which carries the UAV and its neighbours alike.
//!
//! Never changes the flight: the collision filter only asks what would happen.

use super::{
    gains::Gains, leader_estimate::EstimatedLeader, repulsion_of, slot_motion::SlotMotion, track::PeerTrack,
};
use crate::law::{Bond, Field, potential_forces};
use nalgebra::Vector2;
use ringwing_flight::{FormationFrame, Pose, SensedObstacle, chord, direction, turned};

/// The law as of one tick, to be asked for the forces of the next seconds.
#[derive(Debug, Clone)]
pub(crate) struct LawForecast {
    gains: Gains,
    field: Field,
    /// The ring neighbours. The gain of each is the share of G that its data are trusted with.
    trusted: [Option<Bond>; 2],
    neighbour_velocities: [Vector2<f64>; 2],
    leader: EstimatedLeader,
    frame: FormationFrame,
    /// Over the ground.
    slot_motion: SlotMotion,
    wind_m_s: Vector2<f64>,
}

impl LawForecast {
    /// The law in `field`, with the `trusted` neighbours on their `tracks` and the slot moving as `slot_motion` says, in still air.
    pub(super) fn new(
        gains: &Gains,
        field: &Field,
        trusted: [Option<Bond>; 2],
        tracks: [Option<&PeerTrack>; 2],
        leader: &EstimatedLeader,
        frame: FormationFrame,
        slot_motion: SlotMotion,
    ) -> Self {
        let velocity = |track: Option<&PeerTrack>| {
            track.map_or_else(Vector2::zeros, |track| direction(track.pose.heading_rad) * track.speed_m_s)
        };
        Self {
            gains: gains.clone(),
            field: *field,
            trusted,
            neighbour_velocities: tracks.map(velocity),
            leader: *leader,
            frame,
            slot_motion,
            wind_m_s: Vector2::zeros(),
        }
    }

    /// The same in air that moves at `wind_m_s`.
    pub(super) fn in_wind(self, wind_m_s: Vector2<f64>) -> Self {
        Self { wind_m_s, ..self }
    }

    /// The rate at which UAVs in their slots turn.
    pub(super) fn turn_rate_rad_s(&self) -> f64 {
        self.slot_motion.in_wind(self.wind_m_s).turn_rate_rad_s
    }

    /// The law's force on the UAV if it is at `own` after `after_s`, with places as they are in the air then.
    pub(super) fn force(&self, own: &Pose, after_s: f64, obstacles: &[SensedObstacle]) -> Vector2<f64> {
        let PeerTrack { speed_m_s, turn_rate_rad_s, .. } = self.leader.track;
        let here = self.leader.pose;
        let leader = here.after(speed_m_s, turn_rate_rad_s, after_s).carried(-self.wind_m_s, after_s);
        // The slot moves with the leader, and round it if the formation turns.
        let offset = self.field.slot - here.position;
        let turn_rad = self.frame.turn_rate_rad_s(turn_rate_rad_s) * after_s;
        let moved = leader.position - here.position;
        let slot = self.field.slot + moved + (turned(offset, turn_rad) - offset);
        let gain = self.gains.formation(&(own.position - slot));
        let bond = |place: usize| {
            let now = self.trusted[place]?;
            let point = now.point + chord(self.neighbour_velocities[place], self.turn_rate_rad_s(), after_s);
            Some(self.gains.bond(gain, Bond { point, ..now }, &own.position))
        };
        let field = Field {
            previous: bond(0),
            next: bond(1),
            centre: Bond { point: leader.position, gain, ..self.field.centre },
            slot,
            slot_gain: self.field.slot_gain,
        };
        let slot_velocity_m_s =
            turned(self.slot_motion.velocity_m_s, turn_rate_rad_s * after_s) - self.wind_m_s;
        let force = potential_forces(&field, &own.position).total();
        let formation = self.gains.limited(force, &(own.position - slot), &slot_velocity_m_s);
        let repulsion = repulsion_of(obstacles, self.gains.obstacle_m, &own.position, after_s, self.wind_m_s);
        slot_velocity_m_s - formation + repulsion
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use ringwing_flight::Tick;
    use ringwing_scenario::Scenario;

    #[test]
    fn a_uav_whose_gain_has_faded_to_nothing_has_a_forecast() {
        let mut scenario = Scenario::default();
        scenario.control.gain_fades = true;
        let gains = Gains::new(&scenario);
        let own = Pose { position: Point2::new(-2000.0, 0.0), heading_rad: 0.0 };
        let slot = Point2::origin();
        let gain = gains.formation(&(own.position - slot));
        assert_eq!(gain, 0.0, "so far away nothing is left");
        let bond = Bond { point: Point2::new(30.0, 20.0), rest_m: 40.0, gain };
        let field = Field { previous: Some(bond), next: Some(bond), centre: bond, slot, slot_gain: 1.0 };
        let track = PeerTrack { tick: Tick(0), pose: own, speed_m_s: 15.0, turn_rate_rad_s: 0.0 };
        let leader = EstimatedLeader { track, pose: own, frame_rad: 0.0 };
        let slot_motion = SlotMotion::straight(&leader);
        let tracks = [Some(&track); 2];
        let frame = FormationFrame::Fixed;
        let forecast = LawForecast::new(&gains, &field, [Some(bond); 2], tracks, &leader, frame, slot_motion);
        let force = forecast.force(&own, 1.0, &[]);
        assert!(force.iter().all(|component| component.is_finite()), "{force}");
    }

    #[test]
    fn a_uav_that_drifts_with_its_slot_is_asked_for_the_wind_triangle_now_and_later() {
        let gains = Gains::new(&Scenario::default());
        let wind_m_s = Vector2::new(0.0, -6.0);
        let leader_pose = Pose { position: Point2::origin(), heading_rad: 0.0 };
        let track = PeerTrack { tick: Tick(0), pose: leader_pose, speed_m_s: 15.0, turn_rate_rad_s: 0.0 };
        let leader = EstimatedLeader { track, pose: leader_pose, frame_rad: 0.0 };
        let slot = Point2::new(-40.0, 0.0);
        let centre = Bond { point: Point2::origin(), rest_m: 40.0, gain: 2.0 };
        let field = Field { previous: None, next: None, centre, slot, slot_gain: 1.0 };
        let (slot_motion, frame) = (SlotMotion::straight(&leader), FormationFrame::Fixed);
        let forecast = LawForecast::new(&gains, &field, [None; 2], [None; 2], &leader, frame, slot_motion)
            .in_wind(wind_m_s);
        for after_s in [0.0, 2.0] {
            // Seen from the air, the slot moves at 15 m/s to the east and 6 m/s to the north.
            let position = slot + Vector2::new(15.0, 6.0) * after_s;
            let force = forecast.force(&Pose { position, heading_rad: 0.4 }, after_s, &[]);
            assert!((force - Vector2::new(15.0, 6.0)).norm() < 1e-9, "{force}");
        }
    }
}
