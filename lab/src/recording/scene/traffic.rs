//! How much each topic carries, and how much of it is lost unread.

use std::{collections::VecDeque, time::Duration};

use ratelab::runtime::{Head, Time};
use rerun::{RecordingStream, RecordingStreamResult};

use super::{
    lines::{self, Line},
    palette,
};
use crate::recording::progress::Progress;

/// Messages per second, a line per topic.
pub const PER_SECOND: &str = "plot/messages_per_second";

/// Messages lost unread so far, a line per topic.
pub const DROPPED: &str = "plot/dropped";

/// Run time between two samples.
const PERIOD: Duration = Duration::from_millis(100);

/// The time over which messages are counted.
const WINDOW: Duration = Duration::from_secs(1);

/// Samples all topics at the same moments, which are those of run time, not of
/// any batch.
pub struct Traffic {
    topics: Vec<Counter>,
    /// Run time of the first message; `None` before there is one.
    begun: Option<Time>,
    next: Time,
}

/// One topic.
struct Counter {
    name: String,
    /// When messages were published, and how many were lost by then: those in
    /// the window first, then those that no sample has reached yet.
    messages: VecDeque<(Time, u64)>,
    /// How many of them are in the window.
    recent: usize,
    dropped: u64,
}

impl Traffic {
    /// Nothing was published yet.
    pub fn new(topics: impl Iterator<Item = String>) -> Self {
        let topics = topics.map(|name| Counter {
            name,
            messages: VecDeque::new(),
            recent: 0,
            dropped: 0,
        });
        Self {
            topics: topics.collect(),
            begun: None,
            next: Time::ZERO,
        }
    }

    /// Names and looks of the lines.
    pub fn begin(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        lines::begin(rec, PER_SECOND, &self.lines("msg/s"))?;
        lines::begin(rec, DROPPED, &self.lines("dropped"))
    }

    fn lines(&self, unit: &str) -> Vec<Line> {
        let count = self.topics.len();
        let looks = palette::series(count).zip(palette::widths(count));
        let topics = self.topics.iter().zip(looks);
        let lines = topics.map(|(topic, (colour, width))| {
            Line::new(format!("{} ({unit})", topic.name), colour, width)
        });
        lines.collect()
    }

    /// Takes in messages of the topic called `name`.
    pub fn count(&mut self, name: &str, messages: &[Head]) {
        let topic = self.topics.iter_mut().find(|topic| topic.name == name);
        if let Some(topic) = topic {
            let messages = messages.iter();
            topic
                .messages
                .extend(messages.map(|head| (head.at, head.dropped)));
        }
        let first = messages.first().map(|head| head.at);
        if let Some(first) = first.filter(|first| self.begun.is_none_or(|begun| *first < begun)) {
            self.begun = Some(first);
            self.next = Time::ZERO + PERIOD * (periods(first) + 1);
        }
    }

    /// Logs the samples that are due by `until`, up to which all messages are
    /// known.
    pub fn sample(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress,
        until: Time,
    ) -> RecordingStreamResult<()> {
        let mut stamps = progress.stamps();
        let (mut rates, mut drops) = (Vec::new(), Vec::new());
        let begun = self.begun.unwrap_or(until);
        while self.begun.is_some() && self.next <= until {
            let window = WINDOW.min(self.next.since(begun));
            stamps.push(self.next, progress.step_at(self.next));
            for topic in &mut self.topics {
                topic.advance_to(self.next, window);
                rates.push(topic.recent as f64 / window.as_secs_f64());
                drops.push(topic.dropped as f64);
            }
            self.next = self.next + PERIOD;
        }
        let count = self.topics.len();
        lines::send(rec, PER_SECOND, &stamps, rates, count)?;
        lines::send(rec, DROPPED, &stamps, drops, count)
    }

    /// Logs how it was at the end, at run time `at`.
    pub fn finish(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress,
        at: Time,
    ) -> RecordingStreamResult<()> {
        self.sample(rec, progress, at)?;
        let sampled = self.next.since(at) == PERIOD;
        if sampled || self.begun.is_none_or(|begun| at <= begun) {
            return Ok(());
        }
        self.next = at;
        self.sample(rec, progress, at)
    }
}

/// Whole periods that passed by `at`.
fn periods(at: Time) -> u32 {
    let whole = at.since(Time::ZERO).as_nanos() / PERIOD.as_nanos();
    u32::try_from(whole).unwrap_or(u32::MAX - 1)
}

impl Counter {
    /// Moves the window on, so that it ends with `now`.
    fn advance_to(&mut self, now: Time, window: Duration) {
        while let Some(&(stamp, dropped)) = self.messages.get(self.recent)
            && stamp <= now
        {
            self.dropped = dropped;
            self.recent += 1;
        }
        let old = |(stamp, _): &mut (Time, u64)| now.since(*stamp) >= window;
        while self.recent > 0 && self.messages.pop_front_if(old).is_some() {
            self.recent -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use ratelab::runtime::{Head, Time};

    use super::{Traffic, WINDOW};

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn the_second_before_is_counted() {
        let mut traffic = Traffic::new(std::iter::once("/obs".to_owned()));
        let head = |k| Head {
            at: ms(20 * k),
            stamp: ms(20 * k),
            seq: k,
            origin: None,
            arrives: Some(ms(20 * k)),
            dropped: k / 2,
        };
        let messages: Vec<_> = (0..500).map(head).collect();
        traffic.count("/obs", &messages);
        let counter = &mut traffic.topics[0];
        let mut seen = |at| {
            counter.advance_to(at, WINDOW);
            (counter.recent, counter.dropped)
        };
        assert_eq!(seen(ms(100)), (6, 2));
        // That of exactly a second ago is out, that of now is in.
        assert_eq!(seen(ms(1000)), (50, 25));
        assert_eq!(seen(ms(5010)), (50, 125));
        assert_eq!(seen(ms(10_500)), (24, 249));
        assert_eq!(seen(ms(60_000)), (0, 249));
    }
}
