//! The chains behind the actions of a running run.

use ratelab::Time;
use ratelab_account::{Lineage, Observer, RowTap, Rows, Tap, TickRecord};
use ratelab_study::experiment::{Experiment, Taps};

use super::sameness::RunDigest;

/// Capacity of a tap between two frames: at full speed the virtual clock makes some
/// thousands of messages and ticks per frame.
const BACKLOG: usize = 16_384;

/// Messages and ticks kept per topic and node: twenty minutes at 50 Hz.
const KEPT: usize = 1 << 16;

/// Builds the lineage of a graph from its taps.
pub struct LineageTaps {
    lineage: Lineage,
    observer: Observer,
    /// Number of events already searched for knobs.
    events: usize,
    topics: Vec<(usize, RowTap, Rows)>,
    ticks: Vec<Tap<TickRecord>>,
    /// Digest of everything from the taps.
    digest: RunDigest,
}

impl LineageTaps {
    /// Attaches to `experiment` from its beginning.
    pub fn new(experiment: &Experiment) -> Self {
        let observer = experiment.observer();
        let (taps, setup) = (experiment.taps(), &experiment.config().setup);
        let lineage = Lineage::new(observer.topology()).keeping(KEPT);
        let mut lineage = lineage.along(experiment.system().about().latency_path);
        let knobs = setup.iter();
        knobs.for_each(|knob| lineage.knob(Time::ZERO, knob));
        Self {
            topics: topics(&taps, &lineage),
            ticks: taps.ticks(BACKLOG),
            lineage,
            observer,
            events: 0,
            digest: RunDigest::default(),
        }
    }

    /// Returns the lineage up to now.
    pub fn update(&mut self) -> &Lineage {
        let events = self.observer.events(self.events);
        self.events += events.len();
        for timed in events.iter().filter_map(|event| event.knob()) {
            self.lineage.knob(timed.at, &timed.knob);
        }
        // First the ticks: the messages they read are then in the taps.
        let ticks: Vec<Vec<TickRecord>> = self.ticks.iter().map(there).collect();
        for (topic, tap, rows) in &mut self.topics {
            tap.take(rows);
            let heads = rows.heads().iter();
            heads.for_each(|head| self.lineage.message(*topic, head));
            self.digest.messages(*topic, rows);
            rows.clear();
        }
        for (node, ticks) in ticks.into_iter().enumerate() {
            for tick in ticks {
                self.digest.tick(node, &tick);
                self.lineage.tick(node, tick);
            }
        }
        self.lineage.settle();
        &self.lineage
    }

    /// The lineage as of the last update.
    pub fn known(&self) -> &Lineage {
        &self.lineage
    }

    /// The digest as of the last update.
    pub fn digest(&self) -> &RunDigest {
        &self.digest
    }

    /// Closes the taps, so that a run waiting for them can end.
    pub fn let_go(&mut self) {
        self.update();
        self.topics.clear();
        self.ticks.clear();
    }
}

/// Taps on the numeric topics of a graph.
fn topics(taps: &Taps, lineage: &Lineage) -> Vec<(usize, RowTap, Rows)> {
    let names = lineage.topology().topics.iter().enumerate();
    let tapped = names.filter_map(|(index, topic)| {
        let tap = taps.rows(&topic.name, BACKLOG)?;
        let rows = tap.rows();
        Some((index, tap, rows))
    });
    tapped.collect()
}

/// Takes the items now in a tap and no later ones: a run without pacing fills it as fast
/// as it is emptied.
fn there(tap: &Tap<TickRecord>) -> Vec<TickRecord> {
    let there = tap.items().len();
    tap.items().try_iter().take(there).collect()
}
