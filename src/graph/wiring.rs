//! How a node gets its ends of topics.

use super::control::WiredTopic;
use crate::{
    arrival::Arrivals,
    control::knob::KnobKind,
    node::{Ends, Fixed, LastTick},
    record::{MeterRecorder, RecordSender},
    sync::Arc,
    topic::{Intake, Payload, Publisher, Subscription, Topic},
};

/// Supplies a node with its ends of topics while it is being built, so that the graph
/// records all connections.
///
/// ```
/// use ratelab::{Depth, Graph, Hz, Tick, Topic};
///
/// let (range, alarm) = (Topic::new("/range", Depth::ONE), Topic::new("/alarm", Depth::ONE));
/// let mut graph = Graph::new();
/// graph.node("watch", Hz::new(20.0)?, 0, |wiring| {
///     let mut range = wiring.subscription::<f64>(&range);
///     let alarm = wiring.publisher(&alarm);
///     let mut age = wiring.meter("age when read");
///     move |tick: &mut Tick| {
///         if let Some(near) = tick.read(&mut range).filter(|range| range.data < 0.5) {
///             tick.publish(&alarm, ());
///             age.record(tick.now() - near.stamp);
///         }
///     }
/// })?;
/// let topics = graph.topology().topics;
/// assert_eq!((topics[0].name.as_str(), &topics[0].readers[..]), ("/range", &[0][..]));
/// assert_eq!((topics[1].name.as_str(), &topics[1].publishers[..]), ("/alarm", &[0][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Wiring<'g> {
    /// The topics of the graph.
    known: &'g [WiredTopic],
    /// The topics that are new with this node.
    pub(super) new: Vec<WiredTopic>,
    /// The topics that the node publishes to and reads from, in the order in which it took their
    /// ends, and the topics that trigger it; all by their indices.
    pub(super) publishes: Vec<usize>,
    pub(super) reads: Vec<usize>,
    pub(super) triggers: Vec<usize>,
    pub(super) intakes: Vec<Box<dyn Intake>>,
    pub(super) fixed: Fixed,
    pub(super) ends: Ends,
    /// Where messages that trigger the node are announced; `None` for a node that is built once
    /// more, with the ends that it had.
    arrivals: Option<&'g Arc<Arrivals>>,
}

impl<'g> Wiring<'g> {
    /// For a new node.
    pub(super) fn new(
        known: &'g [WiredTopic],
        arrivals: &'g Arc<Arrivals>,
        records: RecordSender,
    ) -> Self {
        let ends = Ends {
            records,
            ..Ends::default()
        };
        Self {
            known,
            arrivals: Some(arrivals),
            ..Self::again(ends)
        }
    }

    /// For a node that is built once more, with its former `ends`.
    pub(super) fn again(ends: Ends) -> Self {
        Self {
            known: &[],
            new: Vec::new(),
            publishes: Vec::new(),
            reads: Vec::new(),
            triggers: Vec::new(),
            intakes: Vec::new(),
            fixed: Fixed::default(),
            ends,
            arrivals: None,
        }
    }

    /// Returns whether the node is built once more, with the ends that it had.
    fn is_again(&self) -> bool {
        self.arrivals.is_none()
    }

    /// Connects the node as a publisher of `topic`.
    pub fn publisher<T: Payload>(&mut self, topic: &Topic<T>) -> Publisher<T> {
        if !self.is_again() {
            let index = self.index_of(topic);
            self.publishes.push(index);
        }
        topic.publisher()
    }

    /// Connects the node as a reader of `topic`.
    pub fn subscription<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        if self.is_again() {
            return match self.former_reader(topic) {
                Some(reader) => topic.subscribe_again(reader),
                // One more than it had: its reads are no node's in the records.
                None => topic.subscribe(),
            };
        }
        let subscription = topic.subscribe_as(Some(self.next_reader(topic)));
        self.subscribe(topic, &subscription);
        subscription
    }

    /// Connects the node as a reader of `topic`, whose messages trigger it; see
    /// [`Release::On`](crate::Release::On). Each message counts once: in a tick the subscription
    /// reads the one that the tick is for, whatever the read order of the topic.
    ///
    /// ```
    /// use ratelab::{Depth, Graph, Match, Tick, Topic};
    ///
    /// let (left, right) = (Topic::new("/left", Depth::ONE), Topic::new("/right", Depth::ONE));
    /// let mut graph = Graph::new();
    /// graph.node("stereo", "exact:10".parse::<Match>()?, 0, |wiring| {
    ///     let mut left = wiring.trigger::<u64>(&left);
    ///     let mut right = wiring.trigger::<u64>(&right);
    ///     move |tick: &mut Tick| {
    ///         let (left, right) = (tick.read(&mut left), tick.read(&mut right));
    ///         assert_eq!(left.map(|left| left.stamp), right.map(|right| right.stamp));
    ///     }
    /// })?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn trigger<T: Payload>(&mut self, topic: &Topic<T>) -> Subscription<T> {
        let Some(arrivals) = self.arrivals else {
            return self.subscription(topic);
        };
        let input = (self.ends.records.index(), self.intakes.len());
        let reader = self.next_reader(topic);
        let (subscription, intake) = topic.trigger(reader, input, arrivals);
        self.intakes.push(intake);
        self.subscribe(topic, &subscription);
        self.triggers.extend(self.reads.last());
        subscription
    }

    fn subscribe<T: Payload>(&mut self, topic: &Topic<T>, subscription: &Subscription<T>) {
        let reader = (topic.address(), subscription.reader);
        self.ends.readers.push(reader);
        let index = self.index_of(topic);
        self.reads.push(index);
    }

    /// Returns a duration that the node measures, shown under `name`. One that ends with an action
    /// is measured in [`Node::apply`](crate::Node::apply), when the tick is over.
    pub fn meter(&mut self, name: &str) -> MeterRecorder {
        let meters = &mut self.ends.meters;
        let known = meters.iter().position(|known| known == name);
        let meter = known.unwrap_or_else(|| {
            meters.push(name.to_owned());
            meters.len() - 1
        });
        let records = self.ends.records.clone();
        MeterRecorder { records, meter }
    }

    /// Tells the node how long its last tick took.
    pub fn last_tick(&mut self) -> LastTick {
        let known = self.ends.last_tick.get_or_insert_with(LastTick::new);
        known.clone()
    }

    /// Removes the knobs of these `kinds` from the node; the refusal shows the `reason`.
    pub fn fix(&mut self, kinds: impl IntoIterator<Item = KnobKind>, reason: &'static str) {
        let kinds = kinds.into_iter().collect();
        self.fixed = Fixed { kinds, reason };
    }

    /// Returns the next reader of `topic` that the former node had.
    fn former_reader<T: Payload>(&mut self, topic: &Topic<T>) -> Option<usize> {
        let address = topic.address();
        let mut readers = self.ends.readers.iter();
        let place = readers.position(|(known, _)| *known == address)?;
        Some(self.ends.readers.remove(place).1)
    }

    /// Returns the place of the next reader of `topic` among all.
    fn next_reader<T: Payload>(&self, topic: &Topic<T>) -> usize {
        let address = topic.address();
        let known = self.known.iter().find(|known| known.address == address);
        let own = self.ends.readers.iter().filter(|(own, _)| *own == address);
        known.map_or(0, |known| known.readers.len()) + own.count()
    }

    /// Returns the index of `topic`, which may be new to the graph.
    fn index_of<T: Payload>(&mut self, topic: &Topic<T>) -> usize {
        let address = topic.address();
        self.known
            .iter()
            .chain(&self.new)
            .position(|known| known.address == address)
            .unwrap_or_else(|| {
                self.new.push(WiredTopic::new(topic));
                self.known.len() + self.new.len() - 1
            })
    }
}
