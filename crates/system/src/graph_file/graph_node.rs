//! A node of a graph file while it runs.

use std::sync::Arc;

use ratelab::{Flow, MeterRecorder, Node, Publisher, Shared, Tick, TickResult, Time};
use ratelab_metrics::RowReader;

use super::HeaderStamp;
use crate::{ChainAges, ChainTracker, Numbers};

/// A node that reads, takes time and publishes.
pub(super) struct GraphNode {
    pub(super) inputs: Vec<NodeInput>,
    pub(super) outputs: Vec<Publisher<f64>>,
    pub(super) stamp: HeaderStamp,
    /// Whether it publishes only what it made of something new.
    pub(super) only_new: bool,
    /// Whether the present tick publishes.
    pub(super) published: bool,
    pub(super) ends: Option<ChainEnds>,
    /// The numbers of the message that it read last.
    pub(super) row: Vec<f64>,
}

/// An input, with what was read last.
pub(super) struct NodeInput {
    pub(super) reader: RowReader,
    /// Its header stamp; of a topic of a system, the time of the sensing behind it.
    pub(super) sensed: Option<Time>,
}

impl NodeInput {
    pub(super) fn new(reader: RowReader) -> Self {
        Self {
            reader,
            sensed: None,
        }
    }
}

/// The chains that end at a node.
pub(super) struct ChainEnds {
    pub(super) chains: Vec<ChainEnd>,
    pub(super) tracker: Arc<ChainTracker>,
    pub(super) ages: Arc<Shared<ChainAges>>,
    pub(super) publisher: Publisher<Numbers>,
    /// Whether the first chain of the file acts on the world: no system does.
    pub(super) acts: bool,
    /// When the present tick began.
    pub(super) began: Time,
}

/// The end of a chain.
pub(super) struct ChainEnd {
    pub(super) number: usize,
    /// The meter of its age at each output.
    pub(super) meter: MeterRecorder,
}

impl GraphNode {
    fn publish(&self, output: &Publisher<f64>, tick: &mut Tick) {
        let stamp = self.copied_stamp().unwrap_or_else(|| tick.stamp());
        tick.publish_stamped(output, stamp.as_nanos() as f64, stamp);
    }

    /// Returns the header stamp that it copies; `None` before there is one, and if it stamps by its
    /// clock.
    fn copied_stamp(&self) -> Option<Time> {
        match self.stamp {
            HeaderStamp::Now => None,
            HeaderStamp::Of(input) => self.inputs.get(input)?.sensed,
        }
    }
}

impl Node for GraphNode {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let mut is_new = false;
        for input in &mut self.inputs {
            if let Some(sensed) = (input.reader)(tick, &mut self.row) {
                is_new |= input.sensed != Some(sensed);
                input.sensed = Some(sensed);
            }
        }
        let mut inputs = self.inputs.iter();
        self.published = if self.only_new {
            is_new
        } else {
            self.inputs.is_empty() || inputs.any(|input| input.sensed.is_some())
        };
        if self.published {
            self.outputs
                .iter()
                .for_each(|output| self.publish(output, tick));
        }
        if let Some(ends) = &mut self.ends {
            ends.began = tick.now();
        }
        Ok(Flow::Continue)
    }

    /// Measures the chains when the messages of the tick are published.
    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let now = tick.now();
        let is_quiet = self.only_new && !self.published;
        let Some(ends) = self.ends.as_mut().filter(|_| !is_quiet) else {
            return Ok(Flow::Continue);
        };
        let (tracker, began) = (&ends.tracker, ends.began);
        let (mut outputs, mut first) = (Vec::new(), None);
        for end in &mut ends.chains {
            let begun = tracker.begun(end.number, began);
            if let Some(begun) = begun {
                end.meter.record(now.since(begun));
            }
            if end.number == 0 {
                first = begun;
            }
            outputs.push((end.number, begun));
        }
        if let Some(begun) = first.filter(|_| ends.acts) {
            tick.act_on(begun);
        }
        // The rows are in the order of their times, whichever node publishes them.
        let mut ages = ends.ages.lock();
        let row = ages.row(now, outputs);
        tick.publish_stamped(&ends.publisher, row, first);
        Ok(Flow::Continue)
    }
}
