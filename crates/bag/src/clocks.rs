//! The clocks that published, by how log and publish times drift apart; events on one clock.

use crate::{
    bag::{Bag, BagMessage, BagTopic, PublishTime},
    numbers::{MS, S, median_f64, nearest},
};

/// Transport that a clock of its own is not told from (ns): least and most.
const SAME_CLOCK: (i64, i64) = (-MS / 5, 5 * MS);

/// Clocks closer than this are one (ns, and slope).
const SAME_GROUP: (i64, f64) = (3 * MS, 5e-6);

/// The fewest messages whose clock is looked at.
const MIN_COUNT: usize = 10;

/// How a clock differs from the recorder's: it is `shift` and `slope` behind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mapping {
    /// What is added to its times (ns).
    pub shift: i64,
    /// What is added for each nanosecond since the first log time.
    pub slope: f64,
}

impl Mapping {
    /// `time` on the recorder's clock; the drift up to `at` is known.
    pub fn map(self, time: i64, at: i64) -> i64 {
        let drift = nearest(self.slope * at as f64);
        kept(time.saturating_add(self.shift).saturating_add(drift))
    }
}

/// The greatest time (ns): differences of two do not overflow.
const FAR: i64 = 1 << 62;

/// `time` within the times that are handled.
pub fn kept(time: i64) -> i64 {
    time.clamp(1 - FAR, FAR - 1)
}

/// A clock that is not the recorder's.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockGroup {
    /// The places of its topics.
    pub topics: Vec<usize>,
    /// Its offset against the recorder's clock (ns).
    pub offset: i64,
    /// Its drift (parts per million).
    pub drift_ppm: f64,
    /// From its times to times of the recorder.
    pub mapping: Mapping,
}

/// The clock of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopicClock {
    /// There are no publish times: the log's.
    Log,
    /// The recorder's.
    Recorder,
    /// That of a group.
    Group(usize),
}

/// The clocks of a bag.
#[derive(Clone, Debug, Default)]
pub struct Clocks {
    /// The clock of each topic.
    pub of_topics: Vec<TopicClock>,
    /// The clocks that are not the recorder's.
    pub groups: Vec<ClockGroup>,
    /// The quickest transport on the recorder's clock (ns).
    pub least_transport: i64,
}

/// How log and publish times of a topic lie to each other.
#[derive(Clone, Copy, Debug)]
struct ClockLine {
    topic: usize,
    slope: f64,
    least: i64,
}

impl Clocks {
    /// Finds the clocks of `bag`.
    pub fn new(bag: &Bag) -> Self {
        let mut of_topics = vec![TopicClock::Log; bag.topics.len()];
        let mut lines = Vec::new();
        for (topic, of) in bag.topics.iter().enumerate() {
            if of.publish_time() == PublishTime::Source {
                of_topics[topic] = TopicClock::Recorder;
                lines.extend(line(topic, of));
            }
        }
        let is_recorder = |line: &ClockLine| {
            line.slope == 0.0 && (SAME_CLOCK.0..=SAME_CLOCK.1).contains(&line.least)
        };
        let (on_recorder, mut others): (Vec<_>, Vec<_>) = lines.into_iter().partition(is_recorder);
        let least = on_recorder.iter().map(|line| line.least).min();
        let least_transport = least.unwrap_or(0).max(0);
        others.sort_by(|one, other| {
            let names = || {
                bag.topics[one.topic]
                    .name
                    .cmp(&bag.topics[other.topic].name)
            };
            one.least.cmp(&other.least).then_with(names)
        });
        let mut groups: Vec<Vec<ClockLine>> = Vec::new();
        for line in others {
            let is_near = |group: &&mut Vec<ClockLine>| {
                (line.least.saturating_sub(group[0].least)).abs() < SAME_GROUP.0
                    && (line.slope - group[0].slope).abs() < SAME_GROUP.1
            };
            match groups.iter_mut().find(is_near) {
                Some(group) => group.push(line),
                None => groups.push(vec![line]),
            }
        }
        let groups = groups.iter().enumerate().map(|(number, lines)| {
            let least = lines.iter().map(|line| line.least).min().unwrap_or(0);
            let (shift, slope) = (least.saturating_sub(least_transport), lines[0].slope);
            let topics: Vec<usize> = lines.iter().map(|line| line.topic).collect();
            for topic in &topics {
                of_topics[*topic] = TopicClock::Group(number);
            }
            ClockGroup {
                topics,
                offset: shift.saturating_neg(),
                // Not minus zero.
                drift_ppm: 0.0 - slope * 1e6,
                mapping: Mapping { shift, slope },
            }
        });
        let groups = groups.collect();
        Self {
            of_topics,
            groups,
            least_transport,
        }
    }

    /// From the clock of a topic to the recorder's.
    pub fn mapping(&self, topic: usize) -> Mapping {
        match self.of_topics[topic] {
            TopicClock::Group(group) => self.groups[group].mapping,
            TopicClock::Log | TopicClock::Recorder => Mapping::default(),
        }
    }

    /// Returns the time of each message of a topic on the recorder's clock (ns).
    pub fn events(&self, topic: usize, messages: &[BagMessage]) -> Vec<i64> {
        let mapping = self.mapping(topic);
        let has_source = self.of_topics[topic] != TopicClock::Log;
        let mut last = i64::MIN;
        let events = messages.iter().map(|message| {
            let time = if has_source {
                message.publish
            } else {
                message.log
            };
            last = last.max(mapping.map(time, message.log));
            last
        });
        events.collect()
    }
}

/// Returns how the times of a topic with enough messages lie to each other.
fn line(topic: usize, of: &BagTopic) -> Option<ClockLine> {
    if of.messages.len() < MIN_COUNT {
        return None;
    }
    let points: Vec<_> = of
        .messages
        .iter()
        .map(|message| (message.log, message.log - message.publish))
        .collect();
    let slope = slope(&points);
    let levels = points.iter().map(|(log, x)| {
        let drift = nearest(slope * *log as f64);
        x.saturating_sub(drift)
    });
    let least = levels.min()?;
    Some(ClockLine {
        topic,
        slope,
        least,
    })
}

/// Returns the slope of the least values per window, of points with a time and a value each; 0
/// below a millisecond over the whole.
pub fn slope(points: &[(i64, i64)]) -> f64 {
    const WINDOWS: i64 = 12;
    const MIN_WINDOWS: usize = 6;
    let (Some((first, _)), Some((last, _))) = (points.first(), points.last()) else {
        return 0.0;
    };
    let length = last - first;
    let window = (5 * S).max(length / WINDOWS);
    let mut least: Vec<(f64, f64)> = Vec::new();
    for points in
        points.chunk_by(|one, other| (one.0 - first) / window == (other.0 - first) / window)
    {
        if points.len() >= 3 {
            let number = (points[0].0 - first) / window;
            let middle = (*first + number * window) as f64 + window as f64 / 2.0;
            let value = points.iter().map(|(_, value)| *value).min();
            least.extend(value.map(|value| (middle, value as f64)));
        }
    }
    if least.len() < MIN_WINDOWS {
        return 0.0;
    }
    let pairs = least.iter().enumerate().flat_map(|(place, one)| {
        let others = least[place + 1..].iter();
        others.map(move |other| (other.1 - one.1) / (other.0 - one.0))
    });
    let slope = median_f64(pairs.collect());
    if slope.abs() * (length as f64) < MS as f64 {
        return 0.0;
    }
    slope
}
