//! The part of a recording that the viewer draws.
//!
//! Whole columns go in at once, and what belongs together is one entity: a
//! chunk of an entity costs a kilobyte or two, however small it is.

pub mod graph;
pub mod lanes;
pub mod latency;
pub mod lines;
pub mod picture;
pub mod signals;
pub mod traffic;

use std::sync::Arc;

use ratelab::{Event, Time};
use ratelab_metrics::{Rows, Snapshot};
use ratelab_system::System;
use rerun::{RecordingStream, SeriesPoints};

use self::{graph::GraphScene, latency::LatencyScene, picture::PictureScene, traffic::Traffic};
use super::{
    schema::node_entity,
    timeline::{BatchStream, Written},
};
use signals::Modes;

/// Size of a point.
const POINT: f32 = 1.5;

/// Draws a run.
pub struct Scene {
    system: Arc<dyn System>,
    /// Names of the topics.
    topics: Vec<String>,
    graph: GraphScene,
    picture: PictureScene,
    latency: Option<LatencyScene>,
    traffic: Traffic,
    modes: Modes,
}

impl Scene {
    /// Creates a scene of the graph of `system` in `start`, taken before its run.
    pub fn new(system: &Arc<dyn System>, start: &Snapshot) -> Self {
        let topics: Vec<String> = start
            .topics
            .iter()
            .map(|topic| topic.name.to_string())
            .collect();
        Self {
            system: system.clone(),
            graph: GraphScene::new(start),
            picture: PictureScene::new(system.clone()),
            latency: LatencyScene::new(&**system, start),
            traffic: Traffic::new(&topics),
            topics,
            modes: Modes::new(start),
        }
    }

    /// Logs all that holds from the beginning of the run of the graph in `start`.
    pub fn begin(&mut self, stream: &BatchStream, start: &Snapshot) -> Written {
        begin_lateness(&stream.rec, start)?;
        for topic in &self.topics {
            signals::begin(&stream.rec, &self.system.signals(), topic)?;
        }
        if let Some(latency) = &self.latency {
            latency.begin(&stream.rec)?;
        }
        self.traffic.begin(&stream.rec)?;
        self.graph.begin(stream)?;
        self.modes.begin(&stream.rec, start)
    }

    /// Logs the messages of each topic and the events that came since the last batch; nothing is
    /// missing up to run time `until`.
    pub fn add(
        &mut self,
        stream: &BatchStream,
        topics: &[Rows],
        events: &[Event],
        until: Time,
    ) -> Written {
        for (topic, rows) in self.topics.iter().zip(topics) {
            signals::add(stream, &self.system.signals(), topic, rows)?;
            if Some(&**topic) == self.system.states_topic() {
                self.picture.add(stream, rows)?;
            }
        }
        self.traffic.count(topics);
        if let Some(latency) = &mut self.latency {
            latency.add(stream, events)?;
        }
        self.traffic.sample(stream, until)?;
        self.graph.add(stream, events)?;
        self.modes.add(&stream.rec, events)
    }

    /// Logs how the run ended at run time `at`: the last samples, and `verdict`,
    /// as an error if the run was `lost`.
    pub fn finish(&mut self, stream: &BatchStream, at: Time, verdict: &str, lost: bool) -> Written {
        self.traffic.finish(stream, at)?;
        if let Some(latency) = &mut self.latency {
            latency.finish(stream, at)?;
        }
        traffic::verdict(stream, at, verdict, lost)
    }
}

/// Returns the names and colours of the points that show how late the ticks of each node began; the
/// ticks themselves are recorded for readers too. Virtual time is never late.
fn begin_lateness(rec: &RecordingStream, start: &Snapshot) -> Written {
    for (node, colour) in start.nodes.iter().zip(lines::series(start.nodes.len())) {
        let points = SeriesPoints::new()
            .with_names([format!("{} (µs late)", node.name)])
            .with_colors([colour])
            .with_marker_sizes([POINT]);
        rec.log_static(node_entity(&node.name), &points)?;
    }
    Ok(())
}
