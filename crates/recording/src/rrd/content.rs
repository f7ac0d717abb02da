//! Converts the chunks of a file to messages, ticks and events.

use std::collections::{BTreeMap, HashMap};

use ratelab::{Event, Executor, Time, Topology};
use ratelab_system::Setup;
use rerun::{EntityPath, log::Chunk};
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{
    columns::{self, MessageHalves},
    frames::MORE,
    schema::{
        CHECKPOINT, ContentDigest, END, EVENTS, ORIGIN, RowDigest, THREADS, UNTIL, node_entity,
        topic_entity,
    },
    thread_log::LogPieces,
};
use crate::{
    check::{DAMAGED_ROW, DescriptionError, check_graph},
    printable::make_printable,
    run::{FORMAT, Origin, RecordRow, Recording, RecordingEnd, Series},
};

/// A part of a recording, by its entity.
#[derive(Clone, Copy)]
enum RecordedPart {
    Topic(usize),
    Node(usize),
    Events,
    End,
    Checkpoint,
    Threads,
}

/// The content of a file from the description of its run on, so far.
pub struct Content {
    recording: Recording,
    parts: HashMap<EntityPath, RecordedPart>,
    /// What the threads of the real clock did.
    threads: LogPieces,
    /// The messages of topics whose halves are apart.
    halves: BTreeMap<usize, MessageHalves>,
    /// Run time up to which all of this is complete; `None` before the first checkpoint.
    until: Option<Time>,
    /// Run time up to which rows are undamaged, if one is damaged.
    sound: Option<Time>,
    digest: ContentDigest,
}

impl Content {
    /// Adds the content of `chunk` to `content`, if it is part of a ratelab recording. What is
    /// before the description of the run is ignored.
    ///
    /// # Errors
    /// [`DescriptionError`] if the recording's description of itself is not understood.
    pub fn add(content: &mut Option<Self>, chunk: &Chunk) -> Result<(), DescriptionError> {
        let path = chunk.entity_path().to_string();
        let describes = path.ends_with(&format!("__properties/{ORIGIN}"));
        match content {
            Some(content) if !describes || content.recording.outcome.is_some() => {
                content.add_chunk(chunk, describes);
            }
            _ if describes => *content = Self::begin(chunk)?.or(content.take()),
            _ => {}
        }
        Ok(())
    }

    /// Adds the content of `chunk`, unless the recording has ended.
    fn add_chunk(&mut self, chunk: &Chunk, describes: bool) {
        // Static chunks contain names and styles.
        let part = self.parts.get(chunk.entity_path());
        if let (Some(RecordedPart::Topic(of)), true) = (part, chunk.is_static()) {
            self.recording.fields[*of] = columns::read_names(chunk);
        }
        let timed_part = part.filter(|_| !chunk.is_static());
        if self.recording.outcome.is_some() {
            let more = timed_part.is_some() || (describes && !chunk.is_static());
            self.recording.damage = more.then_some(MORE).or(self.recording.damage);
        } else if let Some(timed_part) = timed_part
            && let Err(Damaged { after }) = self.add_part(chunk, *timed_part)
        {
            self.sound = Some(self.sound.map_or(after, |sound| sound.min(after)));
        }
    }

    /// Adds the rows of `chunk`, of a `part` of the recording.
    fn add_part(&mut self, chunk: &Chunk, part: RecordedPart) -> Result<(), Damaged> {
        let (run, digest) = (&mut self.recording.run, &mut self.digest);
        let topology = &self.recording.origin.topology;
        match part {
            RecordedPart::Topic(of) if MessageHalves::are_in(chunk) => {
                self.halves.entry(of).or_default().add(chunk);
                Ok(())
            }
            RecordedPart::Topic(of) => {
                add_rows(&mut run.topics[of], chunk, &mut digest.topics[of], topology)
            }
            RecordedPart::Node(of) => {
                add_rows(&mut run.ticks[of], chunk, &mut digest.nodes[of], topology)
            }
            RecordedPart::Events => add_events(&mut self.recording.events, chunk, digest),
            RecordedPart::End => self.end(chunk),
            RecordedPart::Checkpoint => self.check_in(chunk),
            RecordedPart::Threads => {
                self.threads.add(chunk);
                Ok(())
            }
        }
    }

    /// Returns the recording, if something in it is whole; `damage` is the defect that ends the
    /// file.
    pub fn whole(self, damage: Option<&'static str>) -> Option<Recording> {
        let mut recording = self.recording;
        recording.until = self.until?;
        let damaged_row = self.sound.map(|_| DAMAGED_ROW);
        recording.damage = damage.or(damaged_row).or(recording.damage);
        let end = recording.outcome.as_ref().map(|outcome| outcome.threads);
        let topology = &recording.origin.topology;
        recording.threads = self.threads.finish(topology, &recording.events, end);
        recording.check(self.sound);
        recording.find_ends();
        Some(recording)
    }

    /// Begins with the description of the run in `chunk`; `None` if it has none.
    fn begin(chunk: &Chunk) -> Result<Option<Self>, DescriptionError> {
        let Some(text) = columns::read_texts(chunk).into_iter().next() else {
            return Ok(None);
        };
        let described = text.ok_or(DescriptionError::Damaged)?;
        let mut json: Value =
            serde_json::from_str(&described).map_err(|_| DescriptionError::Damaged)?;
        // A graph file has lines; it is parsed, and not printed.
        let graph_file = json.get_mut("graph_file").map(Value::take);
        make_printable(&mut json);
        if let Some(described) = graph_file {
            json["graph_file"] = described;
        }
        let format = json.get("format").and_then(Value::as_u64);
        if let Some(format) = format.filter(|format| *format != u64::from(FORMAT)) {
            let (reads, why) = if format > u64::from(FORMAT) {
                ("reads up to", "a later one made it")
            } else {
                ("reads", "record it again")
            };
            return Err(DescriptionError::Format {
                found: format,
                reads,
                known: FORMAT,
                why,
            });
        }
        let origin = serde_json::from_value(json).ok();
        let origin: Origin = origin
            .filter(|origin| sets_nothing_twice(origin) && has_known_rules(origin))
            .ok_or(DescriptionError::Damaged)?;
        check_graph(&origin.topology)?;
        Ok(Some(Self {
            digest: ContentDigest::new(&described, &origin.topology),
            parts: parts(&origin.topology),
            recording: Recording::empty(origin),
            threads: LogPieces::default(),
            halves: BTreeMap::new(),
            until: None,
            sound: None,
        }))
    }

    /// Reads the end record.
    fn end(&mut self, chunk: &Chunk) -> Result<(), Damaged> {
        self.join()?;
        let (recording, after) = (&mut self.recording, self.until.unwrap_or_default());
        for text in columns::read_texts(chunk) {
            let end = text.unwrap_or_default();
            let exact = serde_json::from_str(&end).map_err(|_| Damaged { after })?;
            let outcome: RecordingEnd = json(&end).ok_or(Damaged { after })?;
            recording.altered = match outcome.digest {
                Some(digest) => digest != self.digest.with_end(&exact),
                None => recording.origin.digest,
            };
            self.until = Some(outcome.at);
            recording.outcome = Some(outcome);
        }
        Ok(())
    }

    /// Adds the messages whose halves were apart.
    fn join(&mut self) -> Result<(), Damaged> {
        for (of, halves) in std::mem::take(&mut self.halves) {
            let after = self.until.unwrap_or_default();
            let rows = halves.joined().ok_or(Damaged { after })?;
            let (topics, digests) = (&mut self.recording.run.topics, &mut self.digest.topics);
            let borrowed = rows.iter().map(|(head, payload)| (*head, &**payload));
            let topology = &self.recording.origin.topology;
            append(&mut topics[of], borrowed, &mut digests[of], topology)?;
        }
        Ok(())
    }

    /// Reads a checkpoint.
    fn check_in(&mut self, chunk: &Chunk) -> Result<(), Damaged> {
        for until in columns::cells(chunk, UNTIL) {
            let after = self.until.unwrap_or_default();
            self.until = Some(Time::from_nanos(until.flatten().ok_or(Damaged { after })?));
        }
        Ok(())
    }
}

/// Returns the parts of a recording of a graph with this `topology`.
fn parts(topology: &Topology) -> HashMap<EntityPath, RecordedPart> {
    let topics = topology
        .topics
        .iter()
        .map(|topic| topic_entity(&topic.name));
    let nodes = topology.nodes.iter().map(|node| node_entity(&node.name));
    let rows = topics
        .zip((0..).map(RecordedPart::Topic))
        .chain(nodes.zip((0..).map(RecordedPart::Node)));
    let others = [
        (EVENTS, RecordedPart::Events),
        (END, RecordedPart::End),
        (CHECKPOINT, RecordedPart::Checkpoint),
        (THREADS, RecordedPart::Threads),
    ]
    .map(|(entity, part)| (entity.into(), part));
    rows.chain(others).collect()
}

/// Returns whether every setting of a run occurs at most once.
fn sets_nothing_twice(origin: &Origin) -> bool {
    let setup = &origin.config.setup;
    setup.iter().cloned().collect::<Setup>() == *setup
}

fn has_known_rules(origin: &Origin) -> bool {
    let executor = |name: &String| name.parse::<Executor>().is_ok();
    origin
        .topology
        .nodes
        .iter()
        .all(|node| node.executor.as_ref().is_none_or(executor))
}

/// An impossible row, with the run time of the row before it.
struct Damaged {
    after: Time,
}

impl Damaged {
    fn behind<S: Series>(series: &S) -> Self {
        let after = series.newest().unwrap_or_default();
        Self { after }
    }
}

/// Adds the rows in `chunk`, in the order of their numbers: a chunk sorts them by time, which
/// several publishers of a topic do not keep to.
fn add_rows<S: Series>(
    series: &mut S,
    chunk: &Chunk,
    digest: &mut RowDigest,
    topology: &Topology,
) -> Result<(), Damaged> {
    let rows = columns::read::<S::Row>(chunk).into_iter();
    let payloads = if S::Row::HAS_PAYLOAD {
        columns::plotted(chunk)
    } else {
        vec![Some(&[][..]); chunk.num_rows()]
    };
    let mut rows: Vec<_> = rows
        .zip(payloads)
        .map_while(|(row, payload)| row.zip(payload))
        .collect();
    let whole = rows.len() == chunk.num_rows();
    rows.sort_by_key(|(row, _)| row.number());
    append(series, rows.into_iter(), digest, topology)?;
    if whole {
        Ok(())
    } else {
        Err(Damaged::behind(series))
    }
}

/// Adds `rows` with their payloads, in the order of their numbers.
fn append<'p, S: Series>(
    series: &mut S,
    rows: impl Iterator<Item = (S::Row, &'p [f64])>,
    digest: &mut RowDigest,
    topology: &Topology,
) -> Result<(), Damaged> {
    for (row, payload) in rows {
        digest.add(&row, payload);
        let last = series.rows().last();
        let sound =
            last.is_none_or(|last| row.follows(last)) && row.is_possible() && row.is_in(topology);
        if !sound || !series.add(row, payload) {
            return Err(Damaged::behind(series));
        }
    }
    Ok(())
}

/// Adds the events in `chunk`. Events of different threads may be slightly out of order.
fn add_events(
    events: &mut Vec<Event>,
    chunk: &Chunk,
    digest: &mut ContentDigest,
) -> Result<(), Damaged> {
    for text in columns::read_texts(chunk) {
        let after = events.last().map_or(Time::ZERO, |last| last.at);
        let event = text.ok_or(Damaged { after })?;
        digest.add_event(&event);
        events.push(json(&event).ok_or(Damaged { after })?);
    }
    Ok(())
}

/// Returns the value in `text`, safe for a terminal; `None` for an invalid one.
fn json<T: DeserializeOwned>(text: &str) -> Option<T> {
    let mut value = serde_json::from_str(text).ok()?;
    make_printable(&mut value);
    serde_json::from_value(value).ok()
}
