//! What a topic did, as the bag has it: rate, intervals, gaps, order, ages.

use crate::{
    bag::{BagTopic, NO_STAMP},
    numbers::{S, quantile, quantile_of_sorted, steps},
};

/// The fewest messages of a topic whose gaps count.
const MIN_COUNT: usize = 10;

/// A distribution of times (ns).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeQuantiles {
    /// The median.
    pub p50: i64,
    /// The 99th percentile.
    pub p99: i64,
    /// The greatest.
    pub max: i64,
    /// The least.
    pub min: i64,
}

impl TimeQuantiles {
    /// Creates the distribution of `values`; `None` of none.
    pub fn new(mut values: Vec<i64>) -> Option<Self> {
        Some(Self {
            p50: quantile(&mut values, 500),
            p99: quantile(&mut values, 990),
            max: values.iter().copied().max()?,
            min: values.iter().copied().min()?,
        })
    }
}

/// Why there was a gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GapVerdict {
    /// The messages exist and came late.
    Late,
    /// Nothing was sent, or it was lost before the recorder.
    Silent,
    /// There are no stamps to tell.
    Unknown,
}

/// A long time without a message of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The log time of the message before (ns).
    pub at: i64,
    /// Its length (ns).
    pub length: i64,
    /// Its reason.
    pub verdict: GapVerdict,
}

/// What a topic did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopicFigures {
    /// Messages per second; `None` of one message.
    pub rate_hz: Option<f64>,
    /// Between neighbours (ns).
    pub interval: Option<TimeQuantiles>,
    /// What lies between the 10th and the 90th percentile of the intervals (ns).
    pub jitter: i64,
    /// Bytes per second.
    pub bytes_per_s: Option<u64>,
    /// Pairs of neighbours with the same stamp.
    pub stamps_repeated: usize,
    /// Long times without a message.
    pub gaps: Vec<Gap>,
    /// From the stamp to the log time, clocks untouched (ns).
    pub age: Option<TimeQuantiles>,
    /// The most messages within a tenth of the median interval.
    pub burst: usize,
}

impl TopicFigures {
    /// Creates the figures of `topic`.
    pub fn new(topic: &BagTopic) -> Self {
        let messages = &topic.messages;
        let logs: Vec<i64> = messages.iter().map(|message| message.log).collect();
        let mut intervals = steps(&logs);
        let length: i64 = intervals.iter().sum();
        let ages = messages
            .iter()
            .filter(|message| message.stamp != NO_STAMP)
            .map(|message| message.log - message.stamp)
            .collect();
        let repeats = messages
            .windows(2)
            .filter(|pair| pair[0].stamp == pair[1].stamp && pair[0].stamp != NO_STAMP);
        let gaps = gaps(topic, &intervals);
        let bytes = u128::from(topic.bytes) * S.unsigned_abs() as u128;
        intervals.sort_unstable();
        let of = |permille| quantile_of_sorted(&intervals, permille);
        Self {
            rate_hz: (length > 0).then(|| intervals.len() as f64 / (length as f64 / S as f64)),
            jitter: of(900) - of(100),
            bytes_per_s: u64::try_from(bytes.checked_div(length as u128).unwrap_or(0)).ok(),
            stamps_repeated: repeats.count(),
            gaps,
            age: TimeQuantiles::new(ages),
            burst: burst(&logs, of(500) / 10),
            interval: TimeQuantiles::new(intervals),
        }
    }
}

/// Returns the gaps among `intervals`: more than three medians.
fn gaps(topic: &BagTopic, intervals: &[i64]) -> Vec<Gap> {
    if topic.messages.len() < MIN_COUNT {
        return Vec::new();
    }
    let usual = quantile(&mut intervals.to_vec(), 500);
    let long = |(_, length): &(usize, &i64)| **length > usual.saturating_mul(3);
    let gaps = intervals.iter().enumerate().filter(long);
    let gap = |(place, length): (usize, &i64)| {
        let [before, after] = [topic.messages[place], topic.messages[place + 1]];
        let verdict = if before.stamp == NO_STAMP || after.stamp == NO_STAMP {
            GapVerdict::Unknown
        } else if (after.stamp - before.stamp).saturating_mul(2) < *length {
            GapVerdict::Late
        } else {
            GapVerdict::Silent
        };
        Gap {
            at: before.log,
            length: *length,
            verdict,
        }
    };
    gaps.map(gap).collect()
}

/// Returns the most messages within a time as long as `window`.
fn burst(logs: &[i64], window: i64) -> usize {
    let (mut first, mut most) = (0, 0);
    for (place, log) in logs.iter().enumerate() {
        while log - logs[first] > window {
            first += 1;
        }
        most = most.max(place + 1 - first);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::{Gathering, RawMessage};

    const MS: i64 = 1_000_000;

    #[test]
    fn the_figures_of_ten_messages_are_those_counted_by_hand() {
        let logs = [0, 100, 200, 300, 400, 800, 802, 804, 900, 1000];
        let stamps = [-5, 95, 195, 295, 395, 495, 595, 695, 895, 995];
        let mut bag = Gathering::default();
        let topic = bag.topic("/a").expect("a place");
        bag.topic_mut(topic).has_stamps = true;
        for (log, stamp) in logs.into_iter().zip(stamps) {
            let [log, stamp] = [log, stamp].map(|ms: i64| 1_000 * S + ms * MS);
            let log = log.unsigned_abs();
            let [publish, sequence, length] = [0, 0, 10];
            bag.add(
                topic,
                RawMessage {
                    log,
                    publish,
                    stamp,
                    sequence: sequence as u32,
                    length,
                },
            );
        }
        let figures = TopicFigures::new(&bag.finish().topics[0]);
        assert_eq!(figures.rate_hz, Some(9.0));
        assert_eq!(figures.bytes_per_s, Some(100));
        let interval = figures.interval.expect("intervals");
        assert_eq!((interval.p50, interval.p99), (100 * MS, 400 * MS));
        assert_eq!(figures.jitter, 398 * MS);
        let gap = Gap {
            at: 400 * MS,
            length: 400 * MS,
            verdict: GapVerdict::Late,
        };
        assert_eq!(figures.gaps, [gap]);
        let age = figures.age.expect("ages");
        assert_eq!((age.p50, age.p99, age.max), (5 * MS, 305 * MS, 305 * MS));
        assert_eq!(figures.burst, 3);
    }
}
