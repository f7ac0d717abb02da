//! How much each topic carries, and how much of it is lost unread.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Head, Time};
use rerun::RecordingStream;

use super::{
    lines::{self, Line},
    palette,
};
use crate::timeline::{BatchStream, Written};

/// Messages per second, a line per topic.
pub const PER_SECOND: &str = "plot/messages_per_second";

/// Messages lost unread so far, a line per topic.
pub const DROPPED: &str = "plot/dropped";

/// Messages lost by links so far, and in flight: two lines per topic. Nothing of runs
/// without a link.
pub const LINKS: &str = "plot/links";

/// Run time between two samples.
const PERIOD: Duration = Duration::from_millis(100);

/// The time over which messages are counted.
const WINDOW: Duration = Duration::from_secs(1);

/// Samples all topics at the same moments, which are those of run time, not of
/// any batch.
pub struct Traffic {
    topics: Vec<TopicTraffic>,
    /// Whether a link did something to a message.
    linked: bool,
    links_begun: bool,
    /// Run time of the first message; `None` before there is one.
    begun: Option<Time>,
    next: Time,
}

/// A topic.
struct TopicTraffic {
    name: String,
    /// The messages in the window, then those that no sample has reached yet.
    messages: VecDeque<Head>,
    dropped: u64,
    /// Messages to which the link did something: in flight, or not reached yet.
    linked: VecDeque<Head>,
    /// Messages lost by the link.
    lost: usize,
}

impl TopicTraffic {
    /// Takes in messages; returns whether the link did something to one.
    fn count(&mut self, heads: &[Head]) -> bool {
        self.messages.extend(heads);
        let before = self.linked.len();
        let linked = heads.iter().filter(|head| head.arrives != Some(head.at));
        self.linked.extend(linked);
        self.linked.len() > before
    }

    /// The number of messages in the `window` that ends with `now`. Sets the number of those
    /// dropped so far.
    fn advance_to(&mut self, now: Time, window: Duration) -> usize {
        let sent = self.messages.partition_point(|head| head.at <= now);
        let newest = sent
            .checked_sub(1)
            .and_then(|newest| self.messages.get(newest));
        self.dropped = newest.map_or(self.dropped, |head| head.dropped);
        let before = |head: &Head| head.at <= now && now.since(head.at) >= window;
        let old = self.messages.partition_point(before);
        self.messages.drain(..old);
        sent - old
    }

    /// Messages lost by the link until `now`, and in flight.
    fn advance_link_to(&mut self, now: Time) -> [usize; 2] {
        let is_over = |head: &Head| head.arrives.unwrap_or(head.at) <= now;
        let lost = self
            .linked
            .iter()
            .filter(|head| head.arrives.is_none() && is_over(head));
        self.lost += lost.count();
        self.linked.retain(|head| !is_over(head));
        let in_flight = self.linked.iter().filter(|head| head.at <= now).count();
        [self.lost, in_flight]
    }
}

impl Traffic {
    /// Nothing was published yet.
    pub fn new(topics: impl Iterator<Item = String>) -> Self {
        let topics = topics.map(|name| TopicTraffic {
            name,
            messages: VecDeque::new(),
            dropped: 0,
            linked: VecDeque::new(),
            lost: 0,
        });
        Self {
            topics: topics.collect(),
            linked: false,
            links_begun: false,
            begun: None,
            next: Time::ZERO,
        }
    }

    /// Names and looks of the lines.
    pub fn begin(&self, rec: &RecordingStream) -> Written {
        lines::begin(rec, PER_SECOND, &self.lines(&["msg/s"]))?;
        lines::begin(rec, DROPPED, &self.lines(&["dropped"]))
    }

    /// A line of each topic for each of `units`.
    fn lines(&self, units: &[&str]) -> Vec<Line> {
        let count = self.topics.len();
        let looks = palette::series(count).zip(palette::widths(count));
        let topics = self.topics.iter().zip(looks);
        let lines = topics.flat_map(|(topic, (colour, width))| {
            let names = units.iter().map(|unit| format!("{} ({unit})", topic.name));
            names.map(move |name| Line::new(name, colour, width))
        });
        lines.collect()
    }

    /// Takes in messages of the topic called `name`.
    pub fn count(&mut self, name: &str, messages: &[Head]) {
        let mut topics = self.topics.iter_mut();
        if let Some(topic) = topics.find(|topic| topic.name == name) {
            self.linked |= topic.count(messages);
        }
        let first = messages.first().map(|head| head.at);
        if let Some(first) = first.filter(|first| self.begun.is_none_or(|begun| *first < begun)) {
            self.begun = Some(first);
            self.next = Time::ZERO + PERIOD * (periods(first) + 1);
        }
    }

    /// Logs the samples that are due by `until`, up to which all messages are
    /// known.
    pub fn sample(&mut self, stream: &BatchStream, until: Time) -> Written {
        let (mut times, begun) = (Vec::new(), self.begun.unwrap_or(until));
        let (mut rates, mut drops, mut links) = (Vec::new(), Vec::new(), Vec::new());
        while self.begun.is_some() && self.next <= until {
            let window = WINDOW.min(self.next.since(begun));
            times.push(self.next);
            for topic in &mut self.topics {
                let sent = topic.advance_to(self.next, window);
                rates.push(sent as f64 / window.as_secs_f64());
                drops.push(topic.dropped as f64);
                links.extend(topic.advance_link_to(self.next).map(|count| count as f64));
            }
            self.next = self.next + PERIOD;
        }
        let count = self.topics.len();
        lines::send(stream, PER_SECOND, &times, rates, count)?;
        lines::send(stream, DROPPED, &times, drops, count)?;
        if !self.linked {
            return Ok(());
        }
        if !std::mem::replace(&mut self.links_begun, true) {
            lines::begin(&stream.rec, LINKS, &self.lines(&["lost", "in flight"]))?;
        }
        lines::send(stream, LINKS, &times, links, 2 * count)
    }

    /// Logs how it was at the end, at run time `at`.
    pub fn finish(&mut self, stream: &BatchStream, at: Time) -> Written {
        self.sample(stream, at)?;
        let sampled = self.next.since(at) == PERIOD;
        if sampled || self.begun.is_none_or(|begun| at <= begun) {
            return Ok(());
        }
        self.next = at;
        self.sample(stream, at)
    }
}

/// Whole periods that passed by `at`.
fn periods(at: Time) -> u32 {
    let whole = at.since(Time::ZERO).as_nanos() / PERIOD.as_nanos();
    u32::try_from(whole).unwrap_or(u32::MAX - 1)
}

#[cfg(test)]
mod tests {
    use ratelab::Head;

    use super::{Traffic, WINDOW};
    use crate::tests::ms;

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
        let topic = &mut traffic.topics[0];
        let mut seen = |at| (topic.advance_to(at, WINDOW), topic.dropped);
        assert_eq!(seen(ms(100)), (6, 2));
        // That of exactly a second ago is out, that of now is in.
        assert_eq!(seen(ms(1000)), (50, 25));
        assert_eq!(seen(ms(5010)), (50, 125));
        assert_eq!(seen(ms(10_500)), (24, 249));
        assert_eq!(seen(ms(60_000)), (0, 249));
    }
}
