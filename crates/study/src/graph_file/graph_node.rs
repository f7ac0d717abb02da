//! A node of a graph file while it runs.

use std::sync::Arc;

use ratelab::{Flow, MeterRecorder, Node, Publisher, Shared, Tick, TickResult, Time};
use ratelab_account::RowReader;

use super::HeaderStamp;
use crate::system::{ChainAges, Numbers};

/// Where a node takes the beginning of a chain's data from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beginning {
    /// Its own tick: it is the first of the chain.
    Tick,
    /// A number of the message that it read last on an input.
    Number { input: usize, place: usize },
    /// The time of the sensing behind that message, of a topic of a system.
    Sensing { input: usize },
    /// Nowhere: the chain comes to this topic by another node.
    Elsewhere,
}

/// A node that reads, takes time and publishes.
pub(super) struct GraphNode {
    pub(super) inputs: Vec<NodeInput>,
    pub(super) outputs: Vec<Output>,
    pub(super) stamp: HeaderStamp,
    pub(super) ends: Option<ChainEnds>,
}

/// An input, with what was read last.
pub(super) struct NodeInput {
    pub(super) reader: RowReader,
    pub(super) row: Vec<f64>,
    /// Its header stamp; of a topic of a system, the time of the sensing behind it.
    pub(super) sensed: Option<Time>,
}

impl NodeInput {
    pub(super) fn new(reader: RowReader) -> Self {
        Self {
            reader,
            row: Vec::new(),
            sensed: None,
        }
    }
}

/// An output, with the beginnings of the chains through its topic.
pub(super) struct Output {
    pub(super) publisher: Publisher<Numbers>,
    pub(super) chains: Vec<Beginning>,
}

/// The chains that end at a node.
pub(super) struct ChainEnds {
    pub(super) chains: Vec<ChainEnd>,
    pub(super) ages: Arc<Shared<ChainAges>>,
    pub(super) publisher: Publisher<Numbers>,
    /// Whether the first chain of the file acts on the world: no system does.
    pub(super) acts: bool,
}

/// The end of a chain.
pub(super) struct ChainEnd {
    pub(super) number: usize,
    pub(super) beginning: Beginning,
    /// The meter of its age at each output.
    pub(super) meter: MeterRecorder,
    /// When the data of the current tick began.
    pub(super) begun: Option<Time>,
}

impl Beginning {
    /// When the data of a tick at `now` began, with what was read on the `inputs`.
    fn at(self, now: Time, inputs: &[NodeInput]) -> Option<Time> {
        match self {
            Self::Tick => Some(now),
            Self::Number { input, place } => {
                let nanos = inputs.get(input)?.row.get(place)?;
                (!nanos.is_nan()).then(|| Time::from_nanos(*nanos as u64))
            }
            Self::Sensing { input } => inputs.get(input)?.sensed,
            Self::Elsewhere => None,
        }
    }
}

impl GraphNode {
    fn publish(&self, output: &Output, tick: &mut Tick) {
        let stamp = self.copied_stamp().unwrap_or_else(|| tick.stamp());
        let nanos = |at: Option<Time>| at.map_or(f64::NAN, |at| at.as_nanos() as f64);
        let row = if output.chains.is_empty() {
            vec![nanos(Some(stamp))]
        } else {
            let chains = output.chains.iter();
            chains
                .map(|chain| nanos(chain.at(tick.now(), &self.inputs)))
                .collect()
        };
        tick.publish_stamped(&output.publisher, Numbers(row), stamp);
    }

    /// The header stamp that it copies; `None` before there is one, and if it stamps by its clock.
    fn copied_stamp(&self) -> Option<Time> {
        match self.stamp {
            HeaderStamp::Now => None,
            HeaderStamp::Of(input) => self.inputs.get(input)?.sensed,
        }
    }
}

impl Node for GraphNode {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        for input in &mut self.inputs {
            if let Some(sensed) = (input.reader)(tick, &mut input.row) {
                input.sensed = Some(sensed);
            }
        }
        let mut inputs = self.inputs.iter();
        if self.inputs.is_empty() || inputs.any(|input| input.sensed.is_some()) {
            let outputs = self.outputs.iter();
            outputs.for_each(|output| self.publish(output, tick));
        }
        let ends = self.ends.iter_mut().flat_map(|ends| &mut ends.chains);
        ends.for_each(|end| end.begun = end.beginning.at(tick.now(), &self.inputs));
        Ok(Flow::Continue)
    }

    /// Measures the chains when the messages of the tick are published.
    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let now = tick.now();
        let Some(ends) = &mut self.ends else {
            return Ok(Flow::Continue);
        };
        let mut first = None;
        for end in &mut ends.chains {
            if let Some(begun) = end.begun {
                end.meter.record(now.since(begun));
            }
            if end.number == 0 {
                first = end.begun;
            }
        }
        if let Some(begun) = first.filter(|_| ends.acts) {
            tick.act_on(begun);
        }
        // The rows are in the order of their times, whichever node publishes them.
        let mut ages = ends.ages.lock();
        let outputs = ends.chains.iter().map(|end| (end.number, end.begun));
        let row = ages.row(now, outputs);
        tick.publish_stamped(&ends.publisher, row, first);
        Ok(Flow::Continue)
    }
}
