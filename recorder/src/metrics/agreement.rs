//! Whether the agents agree on who is alive.

use super::Frame;

/// Counts the different views of who is alive.
#[derive(Debug, Clone, Default)]
pub(super) struct AgreementWatch {
    views: u32,
    disagreed_at: Option<i64>,
}

impl AgreementWatch {
    /// Takes the next frame.
    pub(super) fn observe(&mut self, frame: &Frame) {
        self.views = views(frame);
        if self.views > 1 {
            self.disagreed_at = Some(frame.tick);
        }
    }

    /// Number of different views in the last frame: 1 where all agents agree, 0 where no agent has commanded.
    pub(super) fn views(&self) -> u32 {
        self.views
    }

    /// The last tick in which there was more than one.
    pub(super) fn disagreed_at(&self) -> Option<i64> {
        self.disagreed_at
    }
}

fn views(frame: &Frame) -> u32 {
    let view = || frame.controls().map(|control| control.lost_fingerprint);
    let is_first =
        |(place, fingerprint): &(usize, u64)| view().take(*place).all(|other| other != *fingerprint);
    match view().next() {
        // The fast path of almost every tick: the general search below compares each view with all previous ones.
        Some(first) if view().all(|other| other == first) => 1,
        _ => view().enumerate().filter(is_first).count() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use ringwing_flight::FlightMode;

    #[test]
    fn different_views_are_counted_among_the_uavs_that_fly_on_command() {
        let scenario = testing::ring_of(4, 40.0);
        let mut frame = testing::at_rest(&scenario, 7);
        let mut watch = AgreementWatch::default();
        watch.observe(&frame);
        assert_eq!((watch.views(), watch.disagreed_at()), (1, None));
        for (uav, fingerprint) in [(0, 5), (1, 9), (3, 5)] {
            frame.uavs[uav].control.as_mut().unwrap().lost_fingerprint = fingerprint;
        }
        watch.observe(&frame);
        assert_eq!((watch.views(), watch.disagreed_at()), (3, Some(7)));
        frame.uavs[1].state.as_mut().unwrap().mode = FlightMode::LOITER;
        frame.uavs[2].control = None;
        watch.observe(&frame);
        assert_eq!((watch.views(), watch.disagreed_at()), (1, Some(7)));
    }
}
