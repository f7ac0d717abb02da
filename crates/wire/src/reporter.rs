//! Sends dashboards what happens in this process. Without a dashboard it does nothing.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam_channel::Receiver;
use ratelab_account::{Observer, RowTap, Rows, Tap, TickRecord};
use ratelab_study::experiment::Taps;
use zenoh::{
    Session, Wait,
    pubsub::Publisher,
    qos::{CongestionControl, Priority},
};

use crate::{
    error::WireError,
    inlet::Inlet,
    telemetry::{Batch, PublishedMessage, ReceivedMessage, TopicCounts},
    times::Times,
};

/// Time between two batches.
const PAUSE: Duration = Duration::from_millis(33);

/// Capacity of the taps between two batches.
const BACKLOG: usize = 1024;

/// The most items of a kind in a batch, so that it fits into a message.
const MOST: usize = 128;

/// Sends until it is dropped; then the rest of what happened.
pub struct Reporter {
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Reporter {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// What is reported.
pub(crate) struct Sources {
    pub(crate) observer: Observer,
    pub(crate) times: Arc<Times>,
    pub(crate) tap_handle: Taps,
    /// The topics with a publisher here.
    pub(crate) sent: Vec<(usize, String)>,
    /// The nodes here.
    pub(crate) nodes: Vec<usize>,
    pub(crate) arrived: Receiver<ReceivedMessage>,
    pub(crate) inlets: Arc<Vec<Arc<Inlet>>>,
}

/// The taps while a dashboard is there.
struct Open {
    topics: Vec<(usize, RowTap, Rows)>,
    ticks: Vec<(usize, Tap<TickRecord>)>,
    events: usize,
    batches: u64,
}

impl Reporter {
    pub(crate) fn begin(
        session: &Session,
        key: String,
        sources: Sources,
    ) -> Result<Self, WireError> {
        let what = format!("cannot publish to {key}");
        let publisher = session
            .declare_publisher(key)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataLow)
            .wait()
            .map_err(|why| WireError::network(&what, &why))?;
        let end = Arc::new(AtomicBool::new(false));
        let ended = end.clone();
        let thread = thread::Builder::new().name("telemetry".to_owned());
        let begun = thread.spawn(move || sources.report(&publisher, &ended));
        let thread = begun.map_err(|why| WireError::network("cannot start a thread", &why))?;
        Ok(Self {
            end,
            thread: Some(thread),
        })
    }
}

impl Sources {
    fn report(self, publisher: &Publisher<'static>, ended: &AtomicBool) {
        let mut open: Option<Open> = None;
        loop {
            let is_last = ended.load(Ordering::Relaxed);
            let status = publisher.matching_status().wait();
            if status.is_ok_and(|status| status.matching()) {
                let open = open.get_or_insert_with(|| self.open());
                if let Some(batch) = self.batch(open)
                    && let Ok(bytes) = serde_json::to_vec(&batch)
                {
                    let _ = publisher.put(bytes).wait();
                }
            } else {
                open = None;
                while self.arrived.try_recv().is_ok() {}
            }
            if is_last {
                return;
            }
            thread::park_timeout(PAUSE);
        }
    }

    fn open(&self) -> Open {
        let topics = self.sent.iter().filter_map(|(index, name)| {
            let tap = self.tap_handle.rows(name, BACKLOG)?;
            let rows = tap.rows();
            Some((*index, tap, rows))
        });
        let ticks = self.tap_handle.ticks(BACKLOG).into_iter().enumerate();
        Open {
            topics: topics.collect(),
            ticks: ticks
                .filter(|(node, _)| self.nodes.contains(node))
                .collect(),
            events: 0,
            batches: 0,
        }
    }

    /// What happened since the last batch; `None` before the run.
    fn batch(&self, open: &mut Open) -> Option<Batch> {
        let zero = self.times.zero()?;
        let events = self.observer.events(open.events);
        let first_event = open.events;
        open.events += events.len();
        open.batches += 1;
        let mut batch = Batch {
            number: open.batches,
            now: self.times.now()?,
            zero,
            first_event,
            events: events.into_iter().take(MOST).collect(),
            ..Batch::default()
        };
        open.events = first_event + batch.events.len();
        for (node, tap) in &open.ticks {
            let ticks = tap.items().try_iter().take(MOST);
            batch
                .ticks
                .extend(ticks.map(|tick| (*node, (&tick).into())));
        }
        for (topic, tap, rows) in &mut open.topics {
            tap.take(rows);
            let messages = rows
                .iter()
                .rev()
                .take(MOST)
                .map(|(head, row)| PublishedMessage {
                    topic: *topic,
                    seq: head.seq,
                    at: head.at,
                    origin: head.origin,
                    row: row
                        .iter()
                        .map(|n| Some(*n).filter(|n| n.is_finite()))
                        .collect(),
                });
            let mut messages: Vec<PublishedMessage> = messages.collect();
            messages.reverse();
            batch.sent.extend(messages);
            rows.clear();
        }
        batch.arrived = self.arrived.try_iter().take(4 * MOST).collect();
        batch.topics = self.counts();
        Some(batch)
    }

    fn counts(&self) -> Vec<TopicCounts> {
        let topics = self.observer.snapshot().topics;
        let counts = topics.iter().enumerate().map(|(topic, view)| {
            let inlets = self.inlets.iter().filter(|inlet| inlet.topic == topic);
            let (lost, refused) = inlets.fold((0, 0), |(lost, refused), inlet| {
                let more: u64 = inlet.sender().lost;
                (more.saturating_add(lost), refused + inlet.refused.hostile())
            });
            TopicCounts {
                topic,
                dropped: view.dropped(),
                lost,
                refused,
            }
        });
        counts.collect()
    }
}
