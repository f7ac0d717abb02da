//! Follows the data of chains through the records of a run: when they began.
//!
//! A message names the tick that published it, and a read names the message. So the beginning of a
//! chain's data goes from message to message without being in one: the first node's tick begins
//! data, and every other node of the chain passes on what it read last on the topic before it.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard, OnceLock,
        atomic::{AtomicU64, Ordering},
    },
};

use ratelab::{Derived, Head, NodeRecord, Sink, Time, TopicRecord, Topology, sync::lock};

use super::DataChain;

/// The greatest number of messages of a topic that wait to be read and are known.
const MAX_UNREAD: usize = 1 << 16;

/// Messages that are kept after a newer one was read: a node may still work on one.
const KEPT_READ: usize = 256;

/// Knows for each chain of a graph when the data of its messages began.
#[derive(Debug, Default)]
pub struct ChainTracker(OnceLock<Followed>);

/// The chains by the indices of a graph.
#[derive(Debug)]
struct Followed {
    /// The steps of each chain.
    chains: Vec<Vec<ChainStep>>,
    /// The steps through each topic: chain, and place in it.
    topics: Vec<Vec<(usize, usize)>>,
    /// When the present tick of each node began (ns), where that lasts; otherwise [`NONE`].
    began: Vec<AtomicU64>,
    /// Held while a message of another process is published.
    forwards: Mutex<()>,
}

/// For a tick that does not last.
const NONE: u64 = u64::MAX;

/// A step of a chain: a node publishes to a topic, which the next node reads.
#[derive(Debug)]
struct ChainStep {
    topic: usize,
    from: usize,
    to: usize,
    /// The reader of the next node, by its place at the topic.
    reader: usize,
    data: Mutex<StepData>,
}

/// The data on the topic of a step.
#[derive(Debug, Default)]
struct StepData {
    /// Number of the oldest known message.
    first: u64,
    /// When the data of the known messages began.
    begun: VecDeque<Option<Time>>,
    /// When the data began that the next node read last.
    read: Option<Time>,
    /// When the data of the next message from another process began.
    outside: Option<Time>,
}

impl StepData {
    fn publish(&mut self, seq: u64, begun: Option<Time>) {
        if seq != self.first + self.begun.len() as u64 {
            self.begun.clear();
        }
        if self.begun.is_empty() {
            self.first = seq;
        }
        self.begun.push_back(begun);
        self.forget(self.begun.len().saturating_sub(MAX_UNREAD));
    }

    /// Returns when the data of message number `seq` began.
    fn begun_of(&self, seq: u64) -> Option<Time> {
        let place = usize::try_from(seq.checked_sub(self.first)?).ok()?;
        *self.begun.get(place)?
    }

    fn read(&mut self, seq: u64) {
        self.read = self.begun_of(seq);
        let before = usize::try_from(seq.saturating_sub(self.first)).unwrap_or(usize::MAX);
        // Nobody reads an older one than before.
        if before > 2 * KEPT_READ {
            self.forget(before.min(self.begun.len()).saturating_sub(KEPT_READ));
        }
    }

    fn forget(&mut self, count: usize) {
        self.begun.drain(..count);
        self.first += count as u64;
    }
}

impl ChainStep {
    fn data(&self) -> MutexGuard<'_, StepData> {
        lock(&self.data)
    }
}

impl Followed {
    fn new(chains: &[DataChain], topology: &Topology) -> Option<Self> {
        let mut topics = vec![Vec::new(); topology.topics.len()];
        let steps = chains.iter().enumerate().map(|(number, chain)| {
            let steps = chain.nodes.windows(2).zip(chain.topics()).enumerate().map(
                |(place, (nodes, topic))| {
                    let index = topology.topic(topic)?;
                    topics[index].push((number, place));
                    let (from, to) = (topology.node(&nodes[0])?, topology.node(&nodes[1])?);
                    let mut readers = topology.topics[index].readers.iter();
                    Some(ChainStep {
                        topic: index,
                        from,
                        to,
                        reader: readers.position(|reader| *reader == to)?,
                        data: Mutex::default(),
                    })
                },
            );
            steps.collect()
        });
        Some(Self {
            chains: steps.collect::<Option<_>>()?,
            topics,
            began: topology.nodes.iter().map(|_| NONE.into()).collect(),
            forwards: Mutex::default(),
        })
    }

    /// Returns the steps through a topic, each with its chain and its place there.
    fn through(&self, topic: usize) -> impl Iterator<Item = (usize, usize, &ChainStep)> {
        let steps = self.topics.get(topic).into_iter().flatten();
        steps.map(|(chain, place)| (*chain, *place, &self.chains[*chain][*place]))
    }

    /// Returns when the data of a new message on a step began.
    fn begun(&self, (chain, place): (usize, usize), head: &Head) -> Option<Time> {
        let step = &self.chains[chain][place];
        let by = head.by.filter(|by| by.node == step.from)?;
        let before = place
            .checked_sub(1)
            .map(|before| &self.chains[chain][before]);
        let Some(before) = before.filter(|_| head.from != Derived::Nothing) else {
            let began = self.began[by.node].load(Ordering::Relaxed);
            // Without a sensing they began as it was published.
            let is_at = head.origin.is_none() || began == NONE;
            return Some(if is_at {
                head.at
            } else {
                Time::from_nanos(began)
            });
        };
        let data = before.data();
        match head.from.message() {
            Some(from) if from.topic == before.topic => data.begun_of(from.seq),
            _ => data.read,
        }
    }

    fn publish(&self, topic: usize, head: &Head) {
        for (chain, place, step) in self.through(topic) {
            let known = self.begun((chain, place), head);
            let mut data = step.data();
            let outside = data.outside.take();
            let begun = match head.by {
                None => outside.or(head.origin),
                Some(_) => known,
            };
            data.publish(head.seq, begun);
        }
    }

    fn set_began(&self, node: usize, began: u64) {
        if let Some(known) = self.began.get(node) {
            known.store(began, Ordering::Relaxed);
        }
    }

    /// Forgets what a node has read, as it does itself when it is started again.
    fn restart(&self, node: usize) {
        self.set_began(node, NONE);
        let steps = self.chains.iter().flatten();
        let read = steps.filter(|step| step.to == node);
        read.for_each(|step| step.data().read = None);
    }
}

impl ChainTracker {
    /// Returns the chains through the topic with this index in the graph.
    pub fn through(self: &Arc<Self>, topic: usize) -> TopicChains {
        let tracker = Some(self.clone());
        TopicChains { tracker, topic }
    }

    /// Begins to follow these `chains` of a graph.
    pub(crate) fn follow(&self, chains: &[DataChain], topology: &Topology) {
        if let Some(followed) = Followed::new(chains, topology) {
            let _ = self.0.set(followed);
        }
    }

    /// Returns when the data began that the last node of chain number `chain` works on in a tick
    /// that `began` then; `None` before any.
    pub(crate) fn begun(&self, chain: usize, began: Time) -> Option<Time> {
        match self.0.get()?.chains.get(chain)?.last() {
            Some(last) => last.data().read,
            None => Some(began),
        }
    }
}

/// The chains through a topic on its way to other nodes, for messages that cross the border of a process.
#[derive(Clone, Debug, Default)]
pub struct TopicChains {
    tracker: Option<Arc<ChainTracker>>,
    /// Index of the topic.
    topic: usize,
}

impl TopicChains {
    fn followed(&self) -> Option<&Followed> {
        self.tracker.as_ref()?.0.get()
    }

    fn steps(&self) -> impl Iterator<Item = &ChainStep> {
        self.followed()
            .into_iter()
            .flat_map(|known| known.through(self.topic).map(|(_, _, step)| step))
    }

    /// Their number.
    pub fn count(&self) -> usize {
        self.steps().count()
    }

    /// Returns the run time at which the data of message number `seq` began, for each of them (ns);
    /// NaN where that is unknown.
    pub fn begun(&self, seq: u64) -> impl Iterator<Item = f64> {
        let begun = self.steps().map(move |step| step.data().begun_of(seq));
        begun.map(|at| at.map_or(f64::NAN, |at| at.as_nanos() as f64))
    }

    /// Publishes a message of another process, whose data have `begun` then for each of them (ns).
    pub fn forward<R>(&self, begun: &[f64], publish: impl FnOnce() -> R) -> R {
        let _turn = self.followed().map(|known| lock(&known.forwards));
        for (step, begun) in self.steps().zip(begun) {
            let is_known = !begun.is_nan();
            step.data().outside = is_known.then(|| Time::from_nanos(*begun as u64));
        }
        publish()
    }
}

impl Sink for ChainTracker {
    fn node(&self, node: usize, record: &NodeRecord) {
        let Some(known) = self.0.get() else {
            return;
        };
        match record {
            NodeRecord::Began(at) => known.set_began(node, at.as_nanos()),
            NodeRecord::Ended => known.set_began(node, NONE),
            NodeRecord::Crashed | NodeRecord::Restarted => known.restart(node),
            _ => {}
        }
    }

    fn topic(&self, topic: usize, record: &TopicRecord<'_>) {
        let Some(known) = self.0.get() else {
            return;
        };
        match record {
            TopicRecord::Sent { head, .. } => known.publish(topic, head),
            TopicRecord::Read { reader, seq, .. } => {
                known
                    .through(topic)
                    .filter(|step| step.2.reader == *reader)
                    .for_each(|(_, _, step)| step.data().read(*seq));
            }
            _ => {}
        }
    }
}
