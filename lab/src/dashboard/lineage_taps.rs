//! The chains behind the actions of a run under way.

use ratelab::{
    experiment::{Experiment, Taps},
    runtime::{Observer, RowTap, Rows, Tap, TickRecord, Time, telemetry::Lineage},
    system::Setup,
};

use super::sameness::RunDigest;

/// Messages and ticks that may wait for the next frame: at full speed the virtual clock
/// makes some thousands in the time of one.
const BACKLOG: usize = 16_384;

/// Messages and ticks kept of each topic and node: twenty minutes at 50 Hz.
const KEPT: usize = 1 << 16;

/// Follows who reads what in a graph, in what its taps hand out.
pub struct LineageTaps {
    lineage: Lineage,
    observer: Observer,
    /// Events that were looked at for knobs.
    events: usize,
    topics: Vec<(usize, RowTap, Rows)>,
    ticks: Vec<Tap<TickRecord>>,
    /// Of all that came out of the taps.
    digest: RunDigest,
}

impl LineageTaps {
    /// Follows `experiment` from its beginning.
    pub fn new(experiment: &Experiment) -> Self {
        let observer = experiment.observer();
        let (taps, setup) = (experiment.taps(), &experiment.config().setup);
        let mut lineage = Lineage::new(observer.topology()).keeping(KEPT);
        begin(&mut lineage, setup);
        Self {
            topics: topics(&taps, &lineage),
            ticks: taps.ticks(BACKLOG),
            lineage,
            observer,
            events: 0,
            digest: RunDigest::default(),
        }
    }

    /// All that happened until now.
    pub fn update(&mut self) -> &Lineage {
        let events = self.observer.events(self.events);
        self.events += events.len();
        for timed in events.iter().filter_map(|event| event.knob()) {
            self.lineage.knob(timed.at, &timed.knob);
        }
        // First the ticks: then all is there that was read in them.
        let ticks: Vec<Vec<TickRecord>> = self.ticks.iter().map(there).collect();
        for (topic, tap, rows) in &mut self.topics {
            tap.take(rows);
            let heads = rows.heads().iter();
            heads.for_each(|head| self.lineage.message(*topic, head));
            self.digest.messages(*topic, rows);
            rows.clear();
        }
        for (node, ticks) in ticks.into_iter().enumerate() {
            let ticks = ticks.into_iter();
            ticks.for_each(|tick| {
                self.digest.tick(node, &tick);
                self.lineage.tick(node, tick);
            });
        }
        self.lineage.settle();
        &self.lineage
    }

    /// All that happened until the last update.
    pub fn known(&self) -> &Lineage {
        &self.lineage
    }

    /// The digest of all that happened until the last update.
    pub fn digest(&self) -> &RunDigest {
        &self.digest
    }

    /// Lets a run end that waits for these taps.
    pub fn let_go(&mut self) {
        self.update();
        self.topics.clear();
        self.ticks.clear();
    }
}

/// Turns the knobs that were turned before a run.
fn begin(lineage: &mut Lineage, setup: &Setup) {
    let knobs = setup.iter();
    knobs.for_each(|knob| lineage.knob(Time::ZERO, knob));
}

/// Taps on the topics of a graph that carry numbers.
fn topics(taps: &Taps, lineage: &Lineage) -> Vec<(usize, RowTap, Rows)> {
    let names = lineage.topology().topics.iter().enumerate();
    let tapped = names.filter_map(|(index, topic)| {
        let tap = taps.rows(&topic.name, BACKLOG)?;
        let rows = tap.rows();
        Some((index, tap, rows))
    });
    tapped.collect()
}

/// What is in a tap, and no more than there is now: a run without pacing fills it as
/// fast.
fn there(tap: &Tap<TickRecord>) -> Vec<TickRecord> {
    let there = tap.items().len();
    tap.items().try_iter().take(there).collect()
}
