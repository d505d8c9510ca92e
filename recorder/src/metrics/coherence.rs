//! How well the swarm holds together: agreement of headings, pieces of the ring, ages of data, saturation.

use super::{Frame, UavFrame};

/// The swarm's coherence at one moment. A value that does not exist is absent.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Coherence {
    /// Agreement of headings: the length of the mean of their unit vectors, from 0 to 1. 1 when all headings are equal.
    pub order: Option<f64>,
    /// Number of connected pieces of the ring of UAVs that fly on command: 1 while it is whole.
    pub ring_pieces: u32,
    /// Share of this tick's commands that Eq. (12) cut.
    pub saturated_share: Option<f64>,
    /// Age of the oldest data, of a neighbour or the leader, that an agent used.
    pub age_max_s: Option<f64>,
    /// Mean age of the data that agents used.
    pub age_mean_s: Option<f64>,
}

impl Coherence {
    /// The swarm in `frame`, whose agents have `views` different views of who is alive.
    pub(super) fn of(frame: &Frame, views: u32) -> Self {
        let (age_max_s, age_mean_s) = ages(frame);
        Self {
            order: order(frame),
            // A ring that closes after a loss has no gaps as long as its agents agree on who is alive.
            ring_pieces: if frame.ring.closes() { views } else { ring_pieces(frame) },
            saturated_share: saturated_share(frame),
            age_max_s,
            age_mean_s,
        }
    }
}

fn order(frame: &Frame) -> Option<f64> {
    let headings = frame.all_commanded().map(|state| state.heading_rad);
    let (count, x, y) = headings.fold((0, 0.0, 0.0), |(count, x, y), heading| {
        // Both at once: the reduction of the angle, which they share, is half of the work.
        let (sin, cos) = libm::sincos(heading);
        (count + 1, x + cos, y + sin)
    });
    // Without a UAV this is 0 / 0, which is not finite either.
    Some(libm::hypot(x, y) / f64::from(count)).filter(|order| order.is_finite())
}

/// Counts pieces by missing links: the first cut leaves the ring in one piece, and each further cut adds one.
fn ring_pieces(frame: &Frame) -> u32 {
    let round = frame.round_the_ring();
    let neighbours = round.clone().zip(round.cycle().skip(1));
    let are_linked = |(one, next): &(&UavFrame, &UavFrame)| one.commanded().and(next.commanded()).is_some();
    let links = neighbours.filter(are_linked).count() as u32;
    let count = frame.all_commanded().count() as u32;
    // A ring without a cut has as many links as members: it is one piece, or none if nobody flies.
    if links == count { count.min(1) } else { count - links }
}

fn saturated_share(frame: &Frame) -> Option<f64> {
    let (all, cut) = frame.controls().fold((0, 0), |(all, cut), control| {
        (all + 1, cut + u32::from(control.speed_saturated || control.turn_rate_saturated))
    });
    (all > 0).then(|| f64::from(cut) / f64::from(all))
}

fn ages(frame: &Frame) -> (Option<f64>, Option<f64>) {
    let ages = frame
        .controls()
        .flat_map(|control| [control.previous_age_s, control.next_age_s, control.leader_age_s])
        .flatten();
    let (count, largest, sum) =
        ages.fold((0, 0.0_f64, 0.0), |(count, largest, sum), age| (count + 1, largest.max(age), sum + age));
    // Without data there is no age: 0 would say that the data are fresh.
    let some = |value: f64| (count > 0).then_some(value);
    (some(largest), some(sum / f64::from(count.max(1))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_rest, ring_of};
    use ringwing_flight::FlightMode;

    #[test]
    fn the_formation_at_rest_is_coherent() {
        let coherence = Coherence::of(&at_rest(&ring_of(5, 40.0), 3), 1);
        assert_eq!(
            (coherence.order, coherence.ring_pieces, coherence.saturated_share),
            (Some(1.0), 1, Some(0.0))
        );
        assert_eq!(
            (coherence.age_max_s, coherence.age_mean_s.map(|age| age < 0.011)),
            (Some(0.01), Some(true))
        );
    }

    #[test]
    fn a_ring_that_is_cut_twice_is_in_two_pieces() {
        let mut frame = at_rest(&ring_of(6, 40.0), 3);
        frame.uavs[0].state = None;
        assert_eq!(Coherence::of(&frame, 1).ring_pieces, 1);
        frame.uavs[3].state.as_mut().unwrap().mode = FlightMode::LOITER;
        assert_eq!(Coherence::of(&frame, 1).ring_pieces, 2);
        frame.uavs.iter_mut().for_each(|uav| uav.state = None);
        assert_eq!(Coherence::of(&frame, 1), Coherence::default());
    }

    #[test]
    fn equal_headings_agree_wherever_they_point() {
        let mut frame = at_rest(&ring_of(4, 40.0), 0);
        for heading_rad in [0.0, 1.0, std::f64::consts::FRAC_PI_2, -2.0] {
            for uav in &mut frame.uavs {
                uav.state.as_mut().unwrap().heading_rad = heading_rad;
            }
            let order = Coherence::of(&frame, 1).order.unwrap();
            assert!((order - 1.0).abs() < 1e-12, "{heading_rad}: {order}");
        }
    }

    #[test]
    fn ages_are_those_of_all_data_that_arrived() {
        let mut frame = at_rest(&ring_of(3, 40.0), 0);
        for uav in &mut frame.uavs {
            let control = uav.control.as_mut().unwrap();
            (control.previous_age_s, control.next_age_s, control.leader_age_s) = (None, Some(0.5), None);
        }
        frame.uavs[1].control.as_mut().unwrap().leader_age_s = Some(2.5);
        let coherence = Coherence::of(&frame, 1);
        assert_eq!((coherence.age_max_s, coherence.age_mean_s), (Some(2.5), Some(1.0)));
        frame.uavs.iter_mut().for_each(|uav| uav.control = None);
        let coherence = Coherence::of(&frame, 1);
        assert_eq!((coherence.age_max_s, coherence.age_mean_s), (None, None), "no data have no age");
    }

    #[test]
    fn opposite_headings_cancel() {
        let mut frame = at_rest(&ring_of(4, 40.0), 0);
        for uav in &mut frame.uavs[..2] {
            uav.state.as_mut().unwrap().heading_rad = std::f64::consts::PI;
        }
        frame.uavs[0].control.as_mut().unwrap().turn_rate_saturated = true;
        let coherence = Coherence::of(&frame, 1);
        assert!(coherence.order.unwrap() < 1e-12);
        assert_eq!(coherence.saturated_share, Some(0.25));
    }
}
