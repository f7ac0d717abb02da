//! How much each topic carries, and how much of it is lost unread.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Head, Time};
use rerun::{RecordingStream, RecordingStreamResult};

use super::{
    lines::{self, Line},
    palette,
};
use crate::recording::plant_steps::PlantSteps;

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

/// One topic.
struct TopicTraffic {
    name: String,
    /// When messages were published, and how many were lost by then: those in
    /// the window first, then those that no sample has reached yet.
    messages: VecDeque<(Time, u64)>,
    /// How many of them are in the window.
    recent: usize,
    dropped: u64,
    link: LinkCounter,
}

/// The link of a topic.
#[derive(Default)]
struct LinkCounter {
    /// Run times at which messages were lost, those that no sample has reached yet.
    losses: VecDeque<Time>,
    lost: usize,
    /// Run times of release and delivery.
    flights: VecDeque<(Time, Time)>,
}

impl LinkCounter {
    /// Notes a message; returns whether the link did something to it.
    fn note(&mut self, head: &Head) -> bool {
        match head.arrives {
            Some(arrives) if arrives == head.at => return false,
            Some(arrives) => self.flights.push_back((head.at, arrives)),
            None => self.losses.push_back(head.at),
        }
        true
    }

    /// Messages lost by `now`, and in flight.
    fn advance_to(&mut self, now: Time) -> [f64; 2] {
        while self.losses.pop_front_if(|at| *at <= now).is_some() {
            self.lost += 1;
        }
        self.flights.retain(|(_, arrives)| *arrives > now);
        let in_flight = self.flights.iter().filter(|(at, _)| *at <= now).count();
        [self.lost as f64, in_flight as f64]
    }
}

impl Traffic {
    /// Nothing was published yet.
    pub fn new(topics: impl Iterator<Item = String>) -> Self {
        let topics = topics.map(|name| TopicTraffic {
            name,
            messages: VecDeque::new(),
            recent: 0,
            dropped: 0,
            link: LinkCounter::default(),
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
    pub fn begin(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        lines::begin(rec, PER_SECOND, &self.lines("msg/s"))?;
        lines::begin(rec, DROPPED, &self.lines("dropped"))
    }

    fn begin_links(&self, rec: &RecordingStream) -> RecordingStreamResult<()> {
        let pairs = self.lines("lost").into_iter().zip(self.lines("in flight"));
        let lines: Vec<Line> = pairs.flat_map(|(lost, flying)| [lost, flying]).collect();
        lines::begin(rec, LINKS, &lines)
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
            for head in messages {
                self.linked |= topic.link.note(head);
            }
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
        progress: &PlantSteps,
        until: Time,
    ) -> RecordingStreamResult<()> {
        let mut stamps = progress.stamps();
        let (mut rates, mut drops, mut links) = (Vec::new(), Vec::new(), Vec::new());
        let begun = self.begun.unwrap_or(until);
        while self.begun.is_some() && self.next <= until {
            let window = WINDOW.min(self.next.since(begun));
            stamps.push(self.next, progress.step_at(self.next));
            for topic in &mut self.topics {
                topic.advance_to(self.next, window);
                rates.push(topic.recent as f64 / window.as_secs_f64());
                drops.push(topic.dropped as f64);
                links.extend(topic.link.advance_to(self.next));
            }
            self.next = self.next + PERIOD;
        }
        let count = self.topics.len();
        lines::send(rec, PER_SECOND, &stamps, rates, count)?;
        lines::send(rec, DROPPED, &stamps, drops, count)?;
        if !self.linked {
            return Ok(());
        }
        if !std::mem::replace(&mut self.links_begun, true) {
            self.begin_links(rec)?;
        }
        lines::send(rec, LINKS, &stamps, links, 2 * count)
    }

    /// Logs how it was at the end, at run time `at`.
    pub fn finish(
        &mut self,
        rec: &RecordingStream,
        progress: &PlantSteps,
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

impl TopicTraffic {
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
    use ratelab::Head;

    use super::{Traffic, WINDOW};
    use crate::recording::tests::ms;

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
