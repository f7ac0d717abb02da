//! The records of a run, one after the other, for observers.
//!
//! A graph counts the messages of its topics and what readers lost of them. Other figures and copies
//! are left to the [`Sink`] that gets the records. Records of a topic come in the order of its
//! operations, records of a node in the order of its ticks.

use std::{
    any::Any,
    fmt,
    sync::{Arc, OnceLock},
    time::Duration,
};

use crate::{
    qos::Depth,
    time::{Hz, Time},
};

/// Gets the records of a run, on the threads of its nodes: it must be quick, and must not
/// publish, read or set a knob. Nodes and topics are named by their indices in the
/// [`Topology`](crate::Topology).
///
/// A camera takes 5 ms from reading to publishing, and a link of 3 ms carries its image to a detector that
/// the image triggers. These are all records of it:
///
/// ```
/// use std::sync::{Arc, Mutex};
/// use ratelab::{
///     Clock, Depth, Graph, Hz, Inbox, Match, NodeRecord, Release, Sink, Tick, Time, Topic,
///     TopicRecord, VirtualClock,
/// };
///
/// #[derive(Default)]
/// struct Lines(Mutex<Vec<String>>);
///
/// impl Lines {
///     fn add(&self, line: String) {
///         self.0.lock().unwrap().push(line);
///     }
/// }
///
/// impl Sink for Lines {
///     fn node(&self, node: usize, record: &NodeRecord) {
///         let name = ["camera", "detector"][node];
///         match record {
///             NodeRecord::Began(at) => self.add(format!("{name} began at {at}")),
///             NodeRecord::Ended => self.add(format!("{name} ended")),
///             NodeRecord::Ticked(times) => {
///                 let ends = times.ends.unwrap_or(Time::MAX);
///                 self.add(format!("{name} ticked from {} to {ends}", times.at));
///             }
///             other => self.add(format!("{name} {other:?}")),
///         }
///     }
///
///     fn topic(&self, _: usize, record: &TopicRecord<'_>) {
///         self.add(match record {
///             TopicRecord::Sent { head, .. } => {
///                 let arrives = head.arrives.unwrap_or(Time::MAX);
///                 format!("image sent at {}, arrives at {arrives}", head.at)
///             }
///             TopicRecord::Delivered { at, .. } => format!("image delivered at {at}"),
///             TopicRecord::Matched { .. } => "image matched".to_owned(),
///             TopicRecord::Read { age, .. } => format!("image read, {} ms old", age.as_millis()),
///             other => format!("image {other:?}"),
///         });
///     }
/// }
///
/// let (image, mut graph) = (Topic::new("/image", Depth::ONE), Graph::new());
/// graph.node("camera", Hz::new(10.0)?, 0, |wiring| {
///     let image = wiring.publisher(&image);
///     move |tick: &mut Tick| { tick.publish(&image, ()); }
/// })?;
/// graph.node("detector", Release::On(Match::Each), 1, |wiring| {
///     let mut image = wiring.trigger(&image);
///     move |tick: &mut Tick| { tick.read(&mut image); }
/// })?;
/// graph.set(&"takes camera 5".parse()?)?;
/// graph.set(&"link /image delay:3".parse()?)?;
/// let lines = Arc::new(Lines::default());
/// graph.sink_or(|| lines.clone());
/// VirtualClock.run(&mut graph, &mut Inbox::default(), Time::from_secs_f64(0.05)?)?;
///
/// assert_eq!(*lines.0.lock().unwrap(), [
///     "camera began at 0.000 s",
///     "image sent at 0.005 s, arrives at 0.008 s",
///     "camera ended",
///     "camera ticked from 0.000 s to 0.005 s",
///     "image delivered at 0.008 s",
///     "image matched",
///     "image read, 3 ms old",
///     "detector ticked from 0.008 s to 0.008 s",
/// ]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Sink: Any + Send + Sync {
    /// Takes a record of a node.
    fn node(&self, node: usize, record: &NodeRecord);

    /// Takes a record of a topic.
    fn topic(&self, topic: usize, record: &TopicRecord<'_>);
}

/// What a node did, or what happened to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NodeRecord {
    /// It begins a tick that takes run time, at this run time. Other ticks send
    /// [`NodeRecord::Ticked`] only.
    Began(Time),
    /// A tick that lasted is over.
    Ended,
    /// A tick with its measurements, once these are known.
    Ticked(TickTimes),
    /// So many ticks were due while it was busy, and were skipped: before the record of that tick.
    Skipped(u64),
    /// It has another rate.
    Rate(Hz),
    /// It crashed, and ticks no more.
    Crashed,
    /// It had crashed, and ticks again.
    Restarted,
    /// It has measured a duration.
    Measured {
        /// The measurement, by its place in the list of the node.
        meter: usize,
        /// The duration.
        sample: Duration,
    },
    /// It has acted on the world.
    Pushed(Push),
}

/// What happened on a topic.
#[derive(Clone, Copy, Debug)]
pub enum TopicRecord<'a> {
    /// A message was published. The drops and deliveries that it caused are recorded before it.
    Sent {
        /// The message without its payload.
        head: Head,
        /// Whether it goes through a link, and so is delivered later, or lost.
        link: bool,
        /// Its payload.
        payload: &'a dyn Any,
    },
    /// A link has delivered a message.
    Delivered {
        /// Sequence number of the message.
        seq: u64,
        /// Run time of its arrival.
        at: Time,
        /// Whether a newer one was there before, so that nobody reads this one.
        overtaken: bool,
    },
    /// A message was evicted before a reader had seen it.
    Dropped {
        /// The reader, by its place at the topic; `None` for a reader outside of the
        /// graph.
        reader: Option<usize>,
        /// Run time.
        at: Time,
    },
    /// A match has discarded messages that a reader had taken.
    Unmatched {
        /// The reader, by its place at the topic.
        reader: usize,
        /// Number of the messages.
        count: u64,
    },
    /// A node has read a message.
    Read {
        /// The reader, by its place at the topic.
        reader: usize,
        /// Number of the tick in which it read, counted from zero.
        tick: u64,
        /// Sequence number of the message.
        seq: u64,
        /// Sequence number of the newest message that was there.
        newest: u64,
        /// Run time since the stamp of the message.
        age: Duration,
    },
    /// A match has chosen a message for the next tick of a reader.
    Matched {
        /// The reader, by its place at the topic.
        reader: usize,
        /// Sequence number of the message.
        seq: u64,
        /// Whether a message of this topic completed the set.
        completes: bool,
    },
    /// It has another queue depth.
    Depth(Depth),
}

/// A message without its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Run time at which it was published.
    pub at: Time,
    /// The tick that published it; `None` for a publisher outside of the graph's nodes.
    pub by: Option<TickId>,
    /// The same time, as the clock of its node shows it.
    pub stamp: Time,
    /// Position in the topic's history, counted from zero.
    pub seq: u64,
    /// Time of the sensing that it was derived from, as the clock of the node that sensed shows it: the
    /// header stamp. `None` if the data begin with this message, and the tick that published it takes
    /// no time; after a tick that takes time, the begin of that tick.
    pub origin: Option<Time>,
    /// What it was derived from.
    pub from: Derived,
    /// Run time at which it is delivered; `None` if it is lost. A message that arrives after a
    /// newer one is never read.
    pub arrives: Option<Time>,
    /// Messages of the topic lost unread so far, over all subscriptions, including any that this
    /// message evicted.
    pub dropped: u64,
}

impl Head {
    /// Returns the time of the sensing that the message was derived from, by the clock of that stamp.
    #[inline]
    pub fn sensed(&self) -> Time {
        self.origin.unwrap_or(self.stamp)
    }
}

/// What a message was derived from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Derived {
    /// All that the node had read by then.
    #[default]
    Reads,
    /// This message alone.
    Message(MessageId),
    /// Nothing, whatever the node has read: its data begin with the tick.
    Nothing,
}

impl Derived {
    /// Returns the message, where it was derived from one alone.
    pub fn message(self) -> Option<MessageId> {
        match self {
            Self::Message(message) => Some(message),
            Self::Reads | Self::Nothing => None,
        }
    }
}

/// A tick of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TickId {
    /// Index of the node in the [`Topology`](crate::Topology).
    pub node: usize,
    /// Number of the tick, counted from zero.
    pub number: u64,
}

/// A message on a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MessageId {
    /// Index of the topic in the [`Topology`](crate::Topology).
    pub topic: usize,
    /// Sequence number of the message.
    pub seq: u64,
}

/// How a tick was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickTimes {
    /// Number of the tick, counted from zero.
    pub number: u64,
    /// Run time of its start.
    pub at: Time,
    /// Lateness of its start; `None` where that was not measured.
    pub lateness: Option<Duration>,
    /// Duration; `None` where it was not measured.
    pub took: Option<Duration>,
    /// Run time at which it published and acted; `None` if the run ended before.
    pub ends: Option<Time>,
}

/// An action applied to the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// Run time of the application.
    pub at: Time,
    /// Run time of the sensing behind it.
    pub sensed: Time,
}

/// Sends the records of a node or a topic to the sink of its graph. Uses the locks of `std`: the model
/// checker does not model sinks.
#[derive(Clone, Default)]
pub(crate) struct RecordSender {
    sink: Arc<OnceLock<Arc<dyn Sink>>>,
    /// Index of the node or topic.
    index: usize,
}

impl RecordSender {
    /// Returns the sender of node or topic number `index`.
    pub(crate) fn for_index(&self, index: usize) -> Self {
        let sink = self.sink.clone();
        Self { sink, index }
    }

    /// Returns the index of the node or topic.
    pub(crate) fn index(&self) -> usize {
        self.index
    }

    /// Returns whether anybody looks on.
    pub(crate) fn is_heard(&self) -> bool {
        self.sink.get().is_some()
    }

    /// Sends a record of this node, if anybody looks on.
    #[inline]
    pub(crate) fn node(&self, record: impl FnOnce() -> NodeRecord) {
        if let Some(sink) = self.sink.get() {
            sink.node(self.index, &record());
        }
    }

    /// Sends a record of this topic, if anybody looks on.
    #[inline]
    pub(crate) fn topic<'a>(&self, record: impl FnOnce() -> TopicRecord<'a>) {
        if let Some(sink) = self.sink.get() {
            sink.topic(self.index, &record());
        }
    }

    /// Returns the sink, or else what `make` returns from now on.
    pub(crate) fn sink_or(&self, make: impl FnOnce() -> Arc<dyn Sink>) -> Arc<dyn Sink> {
        self.sink.get_or_init(make).clone()
    }
}

impl fmt::Debug for RecordSender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "RecordSender({})", self.index)
    }
}

/// Takes the durations that a node measures; see [`Wiring::meter`](crate::Wiring::meter).
#[derive(Debug)]
pub struct MeterRecorder {
    pub(crate) records: RecordSender,
    /// Number of the measurement, in the list of the node.
    pub(crate) meter: usize,
}

impl MeterRecorder {
    /// Adds a sample.
    pub fn record(&mut self, sample: Duration) {
        let meter = self.meter;
        self.records.node(|| NodeRecord::Measured { meter, sample });
    }
}
