//! The traffic and the losses of each topic, and the event log.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Event, EventKind, Head, Time};
use ratelab_metrics::Rows;
use rerun::{RecordingStream, SerializedComponentColumn, TextLog, TextLogLevel};

use super::lines::{self, Line};
use crate::rrd::{
    columns,
    schema::{ContentDigest, EVENTS},
    timeline::{BatchStream, Written},
};

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

/// Samples all topics at the same moments of run time, whatever the batches.
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
    /// The messages that no sample has reached yet.
    ahead: VecDeque<Head>,
    /// Run times of the messages in the window.
    recent: VecDeque<Time>,
    /// Deliveries of messages in flight.
    in_flight: Vec<Time>,
    dropped: u64,
    /// Messages lost by the link.
    lost: usize,
}

impl TopicTraffic {
    /// Takes in the messages up to run time `now`; returns the number in the `window` that ends
    /// there.
    fn advance_to(&mut self, now: Time, window: Duration) -> usize {
        while let Some(head) = self.ahead.pop_front_if(|head| head.at <= now) {
            self.dropped = head.dropped;
            self.recent.push_back(head.at);
            match head.arrives {
                None => self.lost += 1,
                Some(at) => self.in_flight.push(at),
            }
        }
        self.in_flight.retain(|arrives| *arrives > now);
        let is_old = |at: &mut Time| now.since(*at) >= window;
        while self.recent.pop_front_if(is_old).is_some() {}
        self.recent.len()
    }
}

impl Traffic {
    /// Nothing was published yet on `topics`.
    pub fn new(topics: &[String]) -> Self {
        Self {
            topics: topics
                .iter()
                .map(|name| TopicTraffic {
                    name: name.clone(),
                    ahead: VecDeque::new(),
                    recent: VecDeque::new(),
                    in_flight: Vec::new(),
                    dropped: 0,
                    lost: 0,
                })
                .collect(),
            linked: false,
            links_begun: false,
            begun: None,
            next: Time::ZERO,
        }
    }

    /// Returns the names and looks of the lines.
    pub fn begin(&self, rec: &RecordingStream) -> Written {
        lines::begin(rec, PER_SECOND, &self.lines(&["msg/s"]))?;
        lines::begin(rec, DROPPED, &self.lines(&["dropped"]))
    }

    /// Returns a line of each topic for each of `units`.
    fn lines(&self, units: &[&str]) -> Vec<Line> {
        let count = self.topics.len();
        let looks = lines::series(count).zip(lines::widths(count));
        let lines = self
            .topics
            .iter()
            .zip(looks)
            .flat_map(|(topic, (colour, width))| {
                let names = units.iter().map(|unit| format!("{} ({unit})", topic.name));
                names.map(move |name| Line::new(name, colour, width))
            });
        lines.collect()
    }

    /// Takes in the messages of each topic.
    pub fn count(&mut self, topics: &[Rows]) {
        for (topic, messages) in self.topics.iter_mut().zip(topics) {
            let heads = messages.heads();
            topic.ahead.extend(heads);
            self.linked |= heads.iter().any(|head| head.arrives != Some(head.at));
        }
        let firsts = topics
            .iter()
            .filter_map(|messages| messages.heads().first());
        if self.begun.is_none()
            && let Some(first) = firsts.map(|head| head.at).min()
        {
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
                links.extend([topic.lost as f64, topic.in_flight.len() as f64]);
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

/// Logs `events`, each at the time at which it took effect, and adds them to `digest`.
pub fn add(stream: &BatchStream, events: &[Event], digest: &mut ContentDigest) -> Written {
    // A chunk sorts its rows by time, and events of different threads may be out of order.
    for ordered in events.chunk_by(|before, after| before.at <= after.at) {
        let times: Vec<Time> = ordered.iter().map(|event| event.at).collect();
        let json = ordered
            .iter()
            .map(|event| serde_json::to_string(event).unwrap_or_default())
            .inspect(|json| digest.add_event(json));
        let json = columns::texts(json)?;
        let levels = ordered.iter().map(|event| level(&event.what));
        let texts = columns_of(ordered.iter().map(text), levels)?;
        stream.send(EVENTS, &times, texts.chain([json]))?;
    }
    Ok(())
}

/// Logs the verdict of the run at run time `at`.
pub fn verdict(stream: &BatchStream, at: Time, text: &str, lost: bool) -> Written {
    let level = if lost {
        TextLogLevel::ERROR
    } else {
        TextLogLevel::INFO
    };
    stream.send(EVENTS, &[at], columns_of([text.to_owned()], [level])?)
}

fn columns_of(
    texts: impl IntoIterator<Item = String>,
    levels: impl IntoIterator<Item = &'static str>,
) -> Written<impl Iterator<Item = SerializedComponentColumn>> {
    let log = TextLog::update_fields().with_many_text(texts);
    Ok(log.with_many_level(levels).columns_of_unit_batches()?)
}

/// Returns the event without its time, which has a column of its own.
fn text(event: &Event) -> String {
    let text = event.to_string();
    match text.split_once(": ") {
        Some((_, what)) => what.to_owned(),
        None => text,
    }
}

fn level(what: &EventKind) -> &'static str {
    match what {
        EventKind::Applied { .. } | EventKind::Presence { present: true, .. } => TextLogLevel::INFO,
        EventKind::Refused { .. } | EventKind::Presence { .. } => TextLogLevel::WARN,
        EventKind::Ended { .. } | EventKind::Faulted { .. } | EventKind::Crashed { .. } => {
            TextLogLevel::ERROR
        }
    }
}
