//! A live run, watched as an observer. What the user wishes goes to the run's launcher.
//!
//! Must never wait for an answer: the picture goes on meanwhile.

use super::{
    model::{Model, Pace},
    prompt::Wish,
};
use crate::launcher::PauseRequest;
use ringwing_bus::{DomainId, Observer};
use ringwing_recorder::Observation;
use ringwing_scenario::Scenario;
use std::{
    num::NonZeroU32,
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};

/// How the process is called in the run.
const NAME: &str = "watch";

/// A live run.
pub(super) struct LiveFeed {
    observer: Observer,
    observation: Observation,
    answers: (Sender<String>, Receiver<String>),
}

impl LiveFeed {
    /// Begins to watch the run `id`.
    pub(super) fn open(id: &DomainId) -> anyhow::Result<(Self, Scenario)> {
        let observer = Observer::join(id, NAME)?;
        let observation = Observation::begin(&observer)?;
        let scenario = observer.scenario().clone();
        Ok((Self { observer, observation, answers: channel() }, scenario))
    }

    /// Fetches what has come since the last call.
    pub(super) fn fetch(&mut self, model: &mut Model) -> Result<(), String> {
        let result = self.observation.fetch(|follower, seen| {
            let latency_us = seen.timing.map(|timing| timing.round_trip_ns as f64 / 1e3);
            model.take(seen.frame, follower.moment(), seen.events, latency_us);
        });
        // Do this even after an error: the ticks that came before it are shown.
        model.end_batch();
        // The gate knows of a hold at once, while no tick of a flight that stands would ever tell.
        model.set_pace(match self.observer.gate().held() {
            Some(tick) => Pace::Held { tick },
            None => Pace::Live,
        });
        for answer in self.answers.1.try_iter() {
            model.set_notice(&answer);
        }
        result.map_err(|error| error.to_string())
    }

    /// Whether the run is over, in whatever way.
    pub(super) fn is_over(&self) -> bool {
        self.observer.is_run_over()
    }

    /// Asks the run's launcher for what the user wishes.
    pub(super) fn ask(&mut self, wish: Wish, model: &mut Model) {
        let request = match wish {
            Wish::Toggle if model.is_standing() => PauseRequest::Resume.to_string(),
            Wish::Toggle => PauseRequest::Pause.to_string(),
            Wish::Step(ticks) => {
                PauseRequest::Step(NonZeroU32::new(ticks).unwrap_or(NonZeroU32::MIN)).to_string()
            }
            Wish::Fault(sentence) => sentence,
            Wish::Faster | Wish::Slower => {
                model.set_notice("a live flight has its own speed");
                return;
            }
        };
        let (domain, answers) = (self.observer.domain().clone(), self.answers.0.clone());
        // The answer comes when the fault acts, or when a step is flown. If the user quits before, nobody reads it.
        thread::spawn(move || {
            let answer =
                domain.ask(&request).map_or_else(|error| error.to_string(), |answer| answer.to_string());
            let _ = answers.send(answer);
        });
    }
}
