//! The part of a recording that is made for the eye: what the viewer draws.
//!
//! Whole columns go in at once, and what belongs together is one entity: a
//! chunk of an entity costs a kilobyte or two whatever is in it.

mod events;
pub mod graph;
pub mod histogram;
pub mod lateness;
pub mod lines;
pub mod modes;
pub mod palette;
pub mod step_plots;
pub mod traffic;
pub mod world;

#[cfg(test)]
mod tests;

use ratelab::{
    cartpole::POLICY,
    runtime::{Snapshot, Time, telemetry::Event},
};
use rerun::{RecordingStream, RecordingStreamResult};

use self::{
    graph::GraphScene, histogram::Histogram, modes::Modes, step_plots::ControlPeriod,
    traffic::Traffic,
};
use super::progress::Progress;

/// What came since the last batch, each list in the order in which it came.
///
/// Nothing else may be missing up to the last of the control steps, so whoever
/// fills a batch takes those first and the events last.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// Control steps, and where they place things on the timelines.
    pub progress: &'a Progress<'a>,
    /// Per topic, when each message was published, and how many were lost
    /// unread by then.
    pub topics: &'a [(&'a str, &'a [(Time, u64)])],
    /// Commands and ends.
    pub events: &'a [Event],
}

/// Draws a run.
pub struct Scene {
    graph: GraphScene,
    period: ControlPeriod,
    traffic: Traffic,
    histogram: Histogram,
    modes: Modes,
}

impl Scene {
    /// A scene of the graph in `start`, taken before its run.
    pub fn new(start: &Snapshot) -> Self {
        let topics = start.topics.iter().map(|topic| topic.name.to_string());
        Self {
            graph: GraphScene::new(start),
            period: ControlPeriod::new(start.period(POLICY)),
            traffic: Traffic::new(topics),
            histogram: Histogram::new(),
            modes: Modes::new(start),
        }
    }

    /// Logs all that holds from the beginning of the run of the graph in `start`,
    /// which `progress` places.
    pub fn begin(
        &self,
        rec: &RecordingStream,
        start: &Snapshot,
        progress: &Progress<'_>,
    ) -> RecordingStreamResult<()> {
        lateness::begin(rec, start)?;
        world::begin(rec)?;
        step_plots::begin(rec)?;
        self.traffic.begin(rec)?;
        self.histogram.begin(rec)?;
        let beginning = progress.stamp(Time::ZERO);
        self.graph.begin(rec, &beginning)?;
        self.modes.begin(rec, &beginning)
    }

    /// Logs what came since the last batch.
    pub fn add(&mut self, rec: &RecordingStream, batch: &Batch<'_>) -> RecordingStreamResult<()> {
        let progress = batch.progress;
        self.period.learn(batch.events);
        if !progress.steps.is_empty() {
            let stamps = progress.at_steps();
            world::add(rec, &stamps, progress.steps)?;
            step_plots::add(rec, &stamps, progress.steps, &mut self.period)?;
        }
        for (topic, messages) in batch.topics {
            self.traffic.count(topic, messages);
        }
        if let Some(newest) = progress.steps.last() {
            self.traffic.sample(rec, progress, newest.stamp)?;
        }
        self.histogram.add(rec, progress)?;
        self.graph.add(rec, progress, batch.events)?;
        self.modes.add(rec, progress, batch.events)?;
        events::add(rec, progress, batch.events)
    }

    /// Logs how the run ended at run time `at`: the last samples, and `verdict`,
    /// as an error if the run was `lost`.
    pub fn finish(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress<'_>,
        at: Time,
        verdict: &str,
        lost: bool,
    ) -> RecordingStreamResult<()> {
        self.traffic.finish(rec, progress, at)?;
        self.histogram.finish(rec, progress, at)?;
        events::verdict(rec, &progress.stamp(at), verdict, lost)
    }
}
