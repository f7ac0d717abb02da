//! A bag as its messages' times, by topic.

use std::{collections::HashMap, fmt};

/// The stamp of a message without one.
pub const NO_STAMP: i64 = i64::MIN;

/// The most messages that are kept, which bounds the memory.
pub const MAX_MESSAGES: usize = 5_000_000;

/// The most topics that are kept.
pub const MAX_TOPICS: usize = 10_000;

/// The longest name of a topic that is kept (bytes).
const MAX_NAME: usize = 4_096;

/// Differences of times up to this one never overflow (ns).
const FAR: i64 = 1 << 61;

/// The times of one message (ns), counted from the first log time of the bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BagMessage {
    /// When the recorder got it.
    pub log: i64,
    /// When it was published.
    pub publish: i64,
    /// Its header stamp, or [`NO_STAMP`].
    pub stamp: i64,
}

/// A message as a file has it: times since 1970 (ns).
#[derive(Clone, Copy, Debug)]
pub struct RawMessage {
    /// The log time.
    pub log: u64,
    /// The publish time; 0 is none.
    pub publish: u64,
    /// The stamp; 0 is none.
    pub stamp: i64,
    /// The number of the message among those of its publisher; 0 is none.
    pub sequence: u32,
    /// Bytes of its data.
    pub length: u64,
}

/// What a topic has of publish times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PublishTime {
    /// None.
    None,
    /// The log time again.
    Log,
    /// That of the publisher.
    Source,
}

impl fmt::Display for PublishTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Log => "log",
            Self::Source => "source",
        })
    }
}

/// All messages of one name.
#[derive(Clone, Debug, Default)]
pub struct BagTopic {
    /// Its name.
    pub name: String,
    /// In the order of their log times.
    pub messages: Vec<BagMessage>,
    /// The bytes of all its data.
    pub bytes: u64,
    /// Messages with a log time below that of the message before, in their file.
    pub order_breaks: usize,
    /// Messages whose stamp is 0.
    pub stamps_zero: usize,
    /// Whether its messages have a field for a stamp.
    pub has_stamps: bool,
    /// Messages that the recorder lost, by their numbers; `None` without numbers.
    pub lost: Option<u64>,
    no_publish: usize,
    publish_is_log: usize,
    last: Option<u64>,
}

impl BagTopic {
    /// Returns what there is of publish times.
    pub fn publish_time(&self) -> PublishTime {
        let count = self.messages.len();
        if self.no_publish * 100 > count {
            PublishTime::None
        } else if self.publish_is_log * 100 >= count * 99 {
            PublishTime::Log
        } else {
            PublishTime::Source
        }
    }

    /// Returns the mean length of its messages (bytes).
    pub fn mean_length(&self) -> f64 {
        self.bytes as f64 / self.messages.len().max(1) as f64
    }
}

/// A part of a file that could not be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The file.
    pub file: String,
    /// Where and what.
    pub what: String,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.what)
    }
}

/// The messages of a recording of another system.
#[derive(Clone, Debug, Default)]
pub struct Bag {
    /// By name.
    pub topics: Vec<BagTopic>,
    /// The first log time since 1970 (ns), from which all times count.
    pub first_log: i64,
    /// Log times below the one before, over the whole bag.
    pub steps_back: usize,
    /// What could not be used.
    pub damage: Vec<Damage>,
}

impl Bag {
    /// Returns the number of all messages.
    pub fn messages(&self) -> usize {
        self.topics.iter().map(|topic| topic.messages.len()).sum()
    }

    /// From the first log time to the last (ns).
    pub fn span(&self) -> i64 {
        let last = |topic: &BagTopic| topic.messages.last().map(|message| message.log);
        self.topics.iter().filter_map(last).max().unwrap_or(0)
    }
}

/// Gathers the messages of all files into a bag.
#[derive(Debug, Default)]
pub struct Gathering {
    topics: Vec<BagTopic>,
    places: HashMap<String, usize>,
    messages: usize,
    last: Option<u64>,
    bag: Bag,
}

impl Gathering {
    /// Returns the place of the topic called `name`; `None` if there are too many, or it is too
    /// long.
    pub fn topic(&mut self, name: &str) -> Option<usize> {
        if let Some(place) = self.places.get(name) {
            return Some(*place);
        }
        let place = self.topics.len();
        if place >= MAX_TOPICS || name.len() > MAX_NAME {
            return None;
        }
        self.places.insert(name.to_owned(), place);
        self.topics.push(BagTopic {
            name: name.to_owned(),
            ..BagTopic::default()
        });
        Some(place)
    }

    /// Returns the topic at `place`.
    pub fn topic_mut(&mut self, place: usize) -> &mut BagTopic {
        &mut self.topics[place]
    }

    /// Begins a file: the order of log times counts within a file.
    pub fn begin_file(&mut self) {
        self.last = None;
        self.topics.iter_mut().for_each(|topic| topic.last = None);
    }

    /// Adds a message to the topic at `place`. Returns whether it could be kept.
    pub fn add(&mut self, place: usize, raw: RawMessage) -> bool {
        let Some(log) = time(raw.log) else {
            return false;
        };
        if self.messages >= MAX_MESSAGES {
            return false;
        }
        self.messages += 1;
        self.bag.steps_back += usize::from(self.last.is_some_and(|last| raw.log < last));
        self.last = Some(raw.log);
        let publish = time(raw.publish).unwrap_or(0);
        let topic = &mut self.topics[place];
        topic.order_breaks += usize::from(topic.last.is_some_and(|last| raw.log < last));
        topic.last = Some(raw.log);
        topic.no_publish += usize::from(publish == 0);
        topic.publish_is_log += usize::from(publish == log);
        topic.bytes = topic.bytes.saturating_add(raw.length);
        let has_stamp = raw.stamp != 0 && raw.stamp.abs() < FAR;
        topic.stamps_zero += usize::from(topic.has_stamps && raw.stamp == 0);
        topic.messages.push(BagMessage {
            log,
            publish,
            stamp: if has_stamp { raw.stamp } else { NO_STAMP },
        });
        true
    }

    /// Returns whether no more messages are kept.
    pub fn is_full(&self) -> bool {
        self.messages >= MAX_MESSAGES
    }

    /// Notes a part of `file` that could not be used.
    pub fn damaged(&mut self, file: &str, what: impl Into<String>) {
        const MOST: usize = 100;
        if self.bag.damage.len() < MOST {
            self.bag.damage.push(Damage {
                file: file.to_owned(),
                what: what.into(),
            });
        }
    }

    /// Returns the bag, with times from its first one.
    pub fn finish(self) -> Bag {
        let (mut bag, mut topics) = (self.bag, self.topics);
        topics.retain(|topic| !topic.messages.is_empty());
        topics.sort_by(|one, other| one.name.cmp(&other.name));
        let all = topics.iter().flat_map(|topic| &topic.messages);
        bag.first_log = all.map(|message| message.log).min().unwrap_or(0);
        for topic in &mut topics {
            topic.messages.shrink_to_fit();
            for message in &mut topic.messages {
                message.log -= bag.first_log;
                message.publish -= bag.first_log;
                if message.stamp != NO_STAMP {
                    message.stamp -= bag.first_log;
                }
            }
            if !topic.messages.is_sorted_by_key(|message| message.log) {
                topic.messages.sort_by_key(|message| message.log);
            }
        }
        bag.topics = topics;
        bag
    }
}

/// `time` as a signed one, if it is one that robots have.
fn time(time: u64) -> Option<i64> {
    i64::try_from(time).ok().filter(|time| *time < FAR)
}
