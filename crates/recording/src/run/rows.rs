//! What a run gives row by row: the messages of its topics and the ticks of its nodes.

use ratelab::{Time, Topology};
use ratelab_metrics::{Rows, RunRow, Tap, TickRecord};

use super::series::Series;

/// The rows of a run, or of a part of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRows {
    /// The messages of the topics, in the order of the [`Topology`]; empty for topics that are
    /// not recorded.
    pub topics: Vec<Rows>,
    /// The ticks of the nodes, in the order of the [`Topology`].
    pub ticks: Vec<Vec<TickRecord>>,
}

impl RunRows {
    /// No rows of a graph with this `topology`.
    pub fn empty(topology: &Topology) -> Self {
        Self {
            topics: vec![Rows::default(); topology.topics.len()],
            ticks: vec![Vec::new(); topology.nodes.len()],
        }
    }

    /// Adds a row of a known topic or node. A message with another number of numbers is none of
    /// its topic.
    pub fn add(&mut self, row: RunRow) {
        match row {
            RunRow::Message(topic, head, numbers) => {
                let topic = self.topics.get_mut(topic);
                let _ = topic.is_some_and(|topic| topic.push(head, numbers));
            }
            RunRow::Tick(node, tick) => {
                if let Some(ticks) = self.ticks.get_mut(node) {
                    ticks.push(tick);
                }
            }
        }
    }

    /// Adds the rows that are in `tap` now, and no later ones: a run without pacing fills it as
    /// fast as it is emptied. Returns their number.
    pub fn receive(&mut self, tap: &Tap<RunRow>) -> usize {
        let there = tap.items().len();
        let rows = tap.items().try_iter().take(there);
        rows.for_each(|row| self.add(row));
        there
    }

    /// Takes the rows up to run time `until` out of these.
    pub fn take_until(&mut self, until: Time) -> Self {
        let topics = self.topics.iter_mut().map(|rows| rows.take_until(until));
        let ticks = self.ticks.iter_mut().map(|ticks| {
            let count = ticks.partition_point(|tick| tick.at <= until);
            let later = ticks.split_off(count);
            std::mem::replace(ticks, later)
        });
        Self {
            topics: topics.collect(),
            ticks: ticks.collect(),
        }
    }

    /// Returns the number of messages of each topic, and of ticks of each node.
    pub fn counts(&self) -> [Vec<u64>; 2] {
        let messages = self.topics.iter().map(|rows| rows.len() as u64);
        let ticks = self.ticks.iter().map(|ticks| ticks.len() as u64);
        [messages.collect(), ticks.collect()]
    }

    /// Returns the run time of the newest row; `None` without rows.
    pub fn newest(&self) -> Option<Time> {
        let messages = self.topics.iter().map(Series::newest);
        let rows = messages.chain(self.ticks.iter().map(Series::newest));
        rows.flatten().max()
    }
}
