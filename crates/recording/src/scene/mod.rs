//! The part of a recording that is made for the eye: what the viewer draws.
//!
//! Whole columns go in at once, and what belongs together is one entity: a
//! chunk of an entity costs a kilobyte or two, however small it is.

pub mod events;
pub mod graph;
pub mod histogram;
pub mod lanes;
pub mod latency;
pub mod lateness;
pub mod lines;
pub mod modes;
pub mod palette;
pub mod picture;
pub mod signals;
pub mod traffic;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use ratelab::{Event, Time};
use ratelab_account::{Rows, Snapshot};
use ratelab_study::system::System;
use rerun::RecordingStream;

use self::{graph::GraphScene, latency::LatencyScene, picture::PictureScene, traffic::Traffic};
use super::{
    recorded::Recording,
    timeline::{BatchStream, Written},
};

/// The news since the last batch, each list in the order of arrival.
pub struct SceneBatch<'a> {
    /// The messages of each topic, as in the graph.
    pub topics: &'a [Rows],
    /// Commands and ends.
    pub events: &'a [Event],
    /// Run time up to which nothing is missing.
    pub until: Time,
}

/// Logs the lanes of a complete `recording`.
pub fn add_lanes(rec: &RecordingStream, recording: &Recording) -> Written {
    modes::add(rec, recording)?;
    lanes::add(rec, recording)
}

/// Draws a run.
pub struct Scene {
    system: Arc<dyn System>,
    /// Names of the topics.
    topics: Vec<String>,
    graph: GraphScene,
    picture: PictureScene,
    latency: Option<LatencyScene>,
    traffic: Traffic,
}

impl Scene {
    /// A scene of the graph of `system` in `start`, taken before its run.
    pub fn new(system: &Arc<dyn System>, start: &Snapshot) -> Self {
        let topics = start.topics.iter().map(|topic| topic.name.to_string());
        let topics: Vec<String> = topics.collect();
        Self {
            system: system.clone(),
            graph: GraphScene::new(start),
            picture: PictureScene::new(system.clone()),
            latency: LatencyScene::new(&**system, start),
            traffic: Traffic::new(&topics),
            topics,
        }
    }

    /// Logs all that holds from the beginning of the run of the graph in `start`.
    pub fn begin(&self, stream: &BatchStream, start: &Snapshot) -> Written {
        lateness::begin(&stream.rec, start)?;
        for topic in &self.topics {
            signals::begin(&stream.rec, self.system.signals(), topic)?;
        }
        if let Some(latency) = &self.latency {
            latency.begin(&stream.rec)?;
        }
        self.traffic.begin(&stream.rec)?;
        self.graph.begin(stream)
    }

    /// Logs what came since the last batch.
    pub fn add(&mut self, stream: &BatchStream, batch: &SceneBatch<'_>) -> Written {
        let SceneBatch { topics, events, .. } = *batch;
        for (topic, rows) in self.topics.iter().zip(topics) {
            signals::add(stream, self.system.signals(), topic, rows)?;
            if Some(&**topic) == self.system.state() {
                self.picture.add(stream, rows)?;
            }
        }
        self.traffic.count(topics);
        if let Some(latency) = &mut self.latency {
            latency.add(stream, events)?;
        }
        self.traffic.sample(stream, batch.until)?;
        self.graph.add(stream, events)
    }

    /// Logs how the run ended at run time `at`: the last samples, and `verdict`,
    /// as an error if the run was `lost`.
    pub fn finish(&mut self, stream: &BatchStream, at: Time, verdict: &str, lost: bool) -> Written {
        self.traffic.finish(stream, at)?;
        if let Some(latency) = &mut self.latency {
            latency.finish(stream, at)?;
        }
        events::verdict(stream, at, verdict, lost)
    }
}
