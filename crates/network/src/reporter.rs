//! Sends dashboards what happens in this process. Without a dashboard it does nothing.

use std::{sync::Arc, time::Duration};

use crossbeam_channel::Receiver;
use ratelab::{Derived, MessageId, Time};
use ratelab_experiment::Taps;
use ratelab_metrics::{RowTap, Rows, Tap, TickRecord};
use zenoh::{Wait, pubsub::Publisher, qos::Priority};

use crate::{
    error::{Beat, NetworkError},
    key::Of,
    net,
    part::LocalPart,
    telemetry::{Batch, PublishedMessage, Read, SentMessage, SentTick, TopicCounts},
};

/// Time between two batches.
const PAUSE: Duration = Duration::from_millis(33);

/// Capacity of the taps between two batches.
const BACKLOG: usize = 1024;

/// The most items of a kind in a batch, so that it fits into a message.
const MOST: usize = 128;

/// What is reported.
pub(crate) struct Reporter {
    part: Arc<LocalPart>,
    taps: Taps,
    arrived: Receiver<(SentMessage, Time)>,
}

/// The taps while a dashboard is there.
struct Open {
    topics: Vec<(usize, RowTap, Rows)>,
    ticks: Vec<(usize, Tap<TickRecord>)>,
    events: usize,
    batches: u64,
}

impl Reporter {
    /// Reports until the result is dropped; then the rest of what happened.
    pub(crate) fn begin(
        part: &Arc<LocalPart>,
        taps: Taps,
        arrived: Receiver<(SentMessage, Time)>,
    ) -> Result<Beat, NetworkError> {
        let key = part
            .peers
            .keys
            .endpoint(part.own.incarnation, Of::TELEMETRY);
        let publisher = net::publisher(&part.peers.session, key, Priority::DataLow)?;
        let part = part.clone();
        let reporter = Self {
            part,
            taps,
            arrived,
        };
        let mut open = None;
        Beat::begin("telemetry", PAUSE, move || {
            reporter.report(&publisher, &mut open);
        })
    }

    fn report(&self, publisher: &Publisher<'static>, open: &mut Option<Open>) {
        if !net::is_heard(publisher) {
            *open = None;
            self.arrived.try_iter().for_each(drop);
            return;
        }
        let open = open.get_or_insert_with(|| self.open());
        if let Some(batch) = self.batch(open)
            && let Ok(bytes) = serde_json::to_vec(&batch)
        {
            let _ = publisher.put(bytes).wait();
        }
    }

    /// Taps the topics with a publisher here, and the nodes here.
    fn open(&self) -> Open {
        let graph = &self.part.own.topology;
        let topics = graph.topics.iter().enumerate();
        let topics = topics
            .filter(|(_, topic)| !self.part.own.split(&topic.publishers).0.is_empty())
            .filter_map(|(index, topic)| {
                let tap = self.taps.rows(&topic.name, BACKLOG)?;
                let rows = tap.rows();
                Some((index, tap, rows))
            });
        let ticks = self
            .taps
            .ticks(BACKLOG)
            .into_iter()
            .enumerate()
            .filter(|(node, _)| self.part.own.runs(&graph.nodes[*node].name));
        Open {
            topics: topics.collect(),
            ticks: ticks.collect(),
            events: 0,
            batches: 0,
        }
    }

    /// Returns what happened since the last batch; `None` before the run.
    fn batch(&self, open: &mut Open) -> Option<Batch> {
        let (now, zero) = (self.part.times.now()?, self.part.times.zero()?);
        let first_event = open.events;
        let mut events = self.part.times.observer.events(first_event);
        events.truncate(MOST);
        open.events += events.len();
        open.batches += 1;
        let ticks = open.ticks.iter().flat_map(|(node, tap)| {
            let ticks = tap.items().try_iter().take(MOST);
            ticks.map(|tick| (*node, self.tick(&tick)))
        });
        let mut sent = Vec::new();
        for (topic, tap, rows) in &mut open.topics {
            tap.take(rows);
            let newest = rows.iter().skip(rows.len().saturating_sub(MOST));
            sent.extend(newest.map(|(head, row)| {
                PublishedMessage {
                    topic: *topic,
                    seq: head.seq,
                    at: head.at,
                    origin: head.origin,
                    by: head.by.map(|by| (by.node, by.number)),
                    from: (head.from.message()).and_then(|from| self.sent_message(from)),
                    begins: head.from == Derived::Nothing,
                    row: row
                        .iter()
                        .map(|n| Some(*n).filter(|n| n.is_finite()))
                        .collect(),
                }
            }));
            rows.clear();
        }
        Some(Batch {
            number: open.batches,
            now,
            zero,
            first_event,
            events,
            ticks: ticks.collect(),
            sent,
            arrived: self.arrived.try_iter().take(4 * MOST).collect(),
            topics: self.counts(),
        })
    }

    /// Returns a tick, with the messages that it read as their senders number them.
    fn tick(&self, tick: &TickRecord) -> SentTick {
        let reads = tick.causes.reads.iter().filter_map(|read| {
            Some(Read {
                message: self.sent_message(read.message)?,
                reader: read.reader,
                newer: read.newest.saturating_sub(read.message.seq),
            })
        });
        SentTick::new(tick, reads.collect())
    }

    /// Returns a message of a topic here, as its sender numbers it.
    fn sent_message(&self, message: MessageId) -> Option<SentMessage> {
        let MessageId { topic, seq } = message;
        let own = &self.part.own;
        let is_own = !own
            .split(&own.topology.topics[topic].publishers)
            .0
            .is_empty();
        if is_own {
            let incarnation = own.incarnation;
            return Some(SentMessage {
                topic,
                incarnation,
                seq,
            });
        }
        self.part
            .inlets
            .iter()
            .filter(|inlet| inlet.topic == topic)
            .find_map(|inlet| inlet.sent_message(seq))
    }

    fn counts(&self) -> Vec<TopicCounts> {
        let topics = self.part.times.observer.snapshot().topics;
        let counts = topics.iter().enumerate().map(|(topic, view)| {
            let inlets = || self.part.inlets.iter().filter(|inlet| inlet.topic == topic);
            let lost = inlets().map(|inlet| inlet.sender().lost);
            TopicCounts {
                topic,
                dropped: view.dropped(),
                lost: lost.fold(0, u64::saturating_add),
                refused: inlets().map(|inlet| inlet.refused.hostile()).sum(),
            }
        });
        counts.collect()
    }
}
