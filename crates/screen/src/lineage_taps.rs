//! The messages of a running run, and the chains behind its actions.

use std::mem;

use ratelab_experiment::Experiment;
use ratelab_metrics::{Lineage, Observer, Rows, RunRow, Tap};

use super::{
    run::{WatchedRows, watched},
    sameness::RunDigest,
};

/// Capacity of the tap between two frames: at full speed the virtual clock makes some
/// thousands of messages and ticks per frame.
const BACKLOG: usize = 1 << 17;

/// Messages and ticks kept per topic and node: twenty minutes at 50 Hz.
const KEPT: usize = 1 << 16;

/// Builds the lineage of a graph from a tap on all of it.
pub struct LineageTaps {
    /// The lineage as of the last update.
    pub lineage: Lineage,
    observer: Observer,
    /// Number of events already searched for knobs.
    events: usize,
    /// `None` once it is closed.
    tap: Option<Tap<RunRow>>,
    /// The new messages of the [`watched`] topics, each with the index of its topic.
    watched: Vec<(usize, WatchedRows)>,
    /// Digest of everything from the tap.
    pub digest: RunDigest,
}

impl LineageTaps {
    /// Attaches to `experiment` from its beginning.
    pub fn new(experiment: &Experiment) -> Self {
        let (observer, taps) = (experiment.observer(), experiment.taps());
        let (system, topology) = (experiment.system(), observer.topology());
        let watched = watched(&**system)
            .filter_map(|name| {
                let index = topology.topic(&name);
                let recorded = taps.topics().iter().find(|topic| topic.name() == name);
                Some((index?, (name, Rows::new(recorded?.fields().len()))))
            })
            .collect();
        let lineage = Lineage::new(topology, experiment.config().setup.iter()).keeping(KEPT);
        Self {
            lineage: lineage.along(system.about().latency_path()),
            observer,
            events: 0,
            tap: Some(taps.all(BACKLOG)),
            watched,
            digest: RunDigest::default(),
        }
    }

    /// Returns the lineage up to now.
    pub fn update(&mut self) -> &Lineage {
        let events = self.observer.events(self.events);
        self.events += events.len();
        events.iter().for_each(|event| self.lineage.event(event));
        // No later rows: a run without pacing fills the tap as fast as it is emptied.
        let items = self.tap.iter().map(Tap::items);
        for row in items.flat_map(|items| items.try_iter().take(items.len())) {
            match row {
                RunRow::Message(topic, head, row) => {
                    self.lineage.message(topic, &head);
                    self.digest.message(topic, &head, &row);
                    let mut watched = self.watched.iter_mut();
                    if let Some((_, (_, rows))) = watched.find(|(index, _)| *index == topic) {
                        let _ = rows.push(head, row); // Of the same width.
                    }
                }
                RunRow::Tick(node, tick) => {
                    self.digest.tick(node, &tick);
                    self.lineage.tick(node, tick);
                }
            }
        }
        self.lineage.settle();
        &self.lineage
    }

    /// Returns the messages on the [`watched`] topics since the last call.
    pub fn new_rows(&mut self) -> Vec<WatchedRows> {
        self.update();
        let new = self.watched.iter_mut().map(|(_, (name, rows))| {
            let none = Rows::new(rows.width());
            (name.clone(), mem::replace(rows, none))
        });
        new.collect()
    }

    /// Returns the number of messages and ticks lost because updates were too rare.
    pub fn lost(&self) -> u64 {
        self.tap.as_ref().map_or(0, Tap::lost)
    }

    /// Closes the tap, so that a run waiting for it can end.
    pub fn let_go(&mut self) {
        self.update();
        self.tap = None;
        self.watched.clear();
    }
}
