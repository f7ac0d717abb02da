//! Converts the chunks of a file to messages, ticks and events.

use ratelab::{Event, Head, Time};
use ratelab_account::{Rows, TickRecord};
use ratelab_effects::{Executor, Match};
use ratelab_study::system::Setup;
use rerun::log::Chunk;
use serde_json::Value;

use super::{
    digest::ContentDigest,
    frames::MORE,
    limits::check_graph,
    printable::make_printable,
    rows,
    schema::{
        CHECKPOINT, END, EVENTS, FORMAT, ORIGIN, Origin, RecordingEnd, THREADS, UNTIL, node_entity,
        topic_entity,
    },
    thread_log::Pieces,
};

/// The defect of a file with an impossible row.
pub const DAMAGED_ROW: &str = "a row in it is damaged";

/// The content of a file so far.
#[derive(Default)]
pub struct Content {
    /// The run. Until it is read, the rest of the file is ignored.
    pub origin: Option<Origin>,
    /// The messages of the topics.
    pub topics: Vec<Rows>,
    /// The ticks of the nodes.
    pub ticks: Vec<Vec<TickRecord>>,
    /// Commands and ends.
    pub events: Vec<Event>,
    /// What the threads of the real clock did.
    pub threads: Pieces,
    /// Run time up to which all of these are complete; `None` before the first
    /// checkpoint.
    pub until: Option<Time>,
    /// The end of the recording.
    pub outcome: Option<RecordingEnd>,
    /// Run time up to which rows are undamaged, if one is damaged.
    pub sound: Option<Time>,
    /// The defect of the file.
    pub damage: Option<&'static str>,
    /// Whether its digest is not that of its content.
    pub altered: bool,
    digest: ContentDigest,
}

impl Content {
    /// Adds the content of `chunk`, if it is part of a ratelab recording.
    ///
    /// # Errors
    /// A text, if the recording's description of itself is not understood.
    pub fn add(&mut self, chunk: &Chunk) -> Result<(), String> {
        let entity = chunk.entity_path();
        let describes = entity
            .to_string()
            .ends_with(&format!("__properties/{ORIGIN}"));
        if describes && self.outcome.is_none() {
            return self.begin(chunk);
        }
        let Some(origin) = &self.origin else {
            return Ok(());
        };
        // Static chunks contain styles.
        if chunk.is_static() {
            return Ok(());
        }
        let topology = &origin.topology;
        let digest = &mut self.digest;
        let (mut topics, mut nodes) = (topology.topics.iter(), topology.nodes.iter());
        let topic = topics.position(|topic| topic_entity(&topic.name) == *entity);
        let node = nodes.position(|node| node_entity(&node.name) == *entity);
        let ours = [EVENTS, END, CHECKPOINT, THREADS].contains(&&*entity.to_string());
        if self.outcome.is_some() && (describes || topic.is_some() || node.is_some() || ours) {
            self.damage = Some(MORE);
            return Ok(());
        }
        let sound = if let Some(index) = topic {
            let add = |head: &Head, values: &[f64]| digest.add_message(index, head, values);
            add_messages(&mut self.topics[index], chunk, add)
        } else if let Some(index) = node {
            let add = |tick: &TickRecord| digest.add_tick(index, tick);
            add_ticks(&mut self.ticks[index], chunk, add)
        } else {
            match entity.to_string().as_str() {
                EVENTS => add_events(&mut self.events, chunk, digest),
                END => self.end(chunk),
                CHECKPOINT => self.check_in(chunk),
                THREADS => {
                    self.threads.add(chunk);
                    Ok(())
                }
                _ => Ok(()),
            }
        };
        if let Err(Damaged { after }) = sound {
            self.damage = Some(DAMAGED_ROW);
            self.sound = Some(self.sound.map_or(after, |sound| sound.min(after)));
        }
        Ok(())
    }

    fn begin(&mut self, chunk: &Chunk) -> Result<(), String> {
        let damaged = || "what this recording says of itself is damaged".to_owned();
        let Some(text) = rows::texts(chunk).into_iter().next() else {
            return Ok(());
        };
        let text = text.ok_or_else(damaged)?;
        let mut json: Value = serde_json::from_str(&text).map_err(|_| damaged())?;
        // A graph file has lines; it is parsed, and not printed.
        let graph_file = json.get_mut("graph_file").map(Value::take);
        make_printable(&mut json);
        if let Some(text) = graph_file {
            json["graph_file"] = text;
        }
        let origin = match json.get("format").and_then(Value::as_u64) {
            Some(format) if format > u64::from(FORMAT) => {
                return Err(format!(
                    "this recording is of format {format}, this ratelab reads up to {FORMAT}: \
                     a later one made it"
                ));
            }
            Some(format) if format < u64::from(FORMAT) => {
                return Err(format!(
                    "this recording is of format {format}, this ratelab reads {FORMAT}: \
                     record it again"
                ));
            }
            _ => serde_json::from_value(json).ok(),
        };
        let origin: Origin = origin
            .filter(|origin| sets_nothing_twice(origin) && has_known_rules(origin))
            .ok_or_else(damaged)?;
        check_graph(&origin.topology)?;
        self.digest = ContentDigest::new(&text, &origin.topology);
        self.topics = vec![Rows::default(); origin.topology.topics.len()];
        self.ticks = vec![Vec::new(); origin.topology.nodes.len()];
        self.origin = Some(origin);
        Ok(())
    }

    /// Reads the end record.
    fn end(&mut self, chunk: &Chunk) -> Result<(), Damaged> {
        for text in rows::texts(chunk) {
            let after = self.until.unwrap_or_default();
            let text = text.ok_or(Damaged { after })?;
            let exact = serde_json::from_str(&text).map_err(|_| Damaged { after })?;
            let json = rows::json(Some(&text));
            let outcome = json.and_then(|json| serde_json::from_value(json).ok());
            let outcome: RecordingEnd = outcome.ok_or(Damaged { after })?;
            let digested = self.origin.as_ref().is_some_and(|origin| origin.digest);
            self.altered = match outcome.digest {
                Some(digest) => digest != self.digest.with_end(&exact),
                None => digested,
            };
            self.until = Some(outcome.at);
            self.outcome = Some(outcome);
        }
        Ok(())
    }

    /// Reads a checkpoint.
    fn check_in(&mut self, chunk: &Chunk) -> Result<(), Damaged> {
        for until in rows::numbers(chunk, UNTIL) {
            let after = self.until.unwrap_or_default();
            let until = until.flatten().ok_or(Damaged { after })?;
            self.until = Some(Time::from_nanos(until));
        }
        Ok(())
    }
}

/// Whether every setting of a run occurs at most once.
fn sets_nothing_twice(origin: &Origin) -> bool {
    let setup = &origin.config.setup;
    setup.iter().cloned().collect::<Setup>() == *setup
}

fn has_known_rules(origin: &Origin) -> bool {
    let executor = |name: &String| name.parse::<Executor>().is_ok();
    let mut nodes = origin.topology.nodes.iter();
    nodes.all(|node| {
        node.executor.as_ref().is_none_or(executor) && node.matching.parse::<Match>().is_ok()
    })
}

/// An impossible row, with the run time of the row before it.
struct Damaged {
    after: Time,
}

/// Adds the messages in `chunk`: numbers, run times and losses never decrease.
fn add_messages(
    messages: &mut Rows,
    chunk: &Chunk,
    mut note: impl FnMut(&Head, &[f64]),
) -> Result<(), Damaged> {
    for row in rows::messages(chunk) {
        let last = messages.heads().last().copied();
        let after = last.map_or(Time::ZERO, |last| last.at);
        let (head, values) = row.ok_or(Damaged { after })?;
        note(&head, values);
        let follows = last.is_none_or(|last| {
            head.seq > last.seq && head.at >= last.at && head.dropped >= last.dropped
        });
        if last.is_none() {
            *messages = Rows::new(values.len());
        }
        let sound = head.arrives.is_none_or(|arrives| arrives >= head.at);
        if !follows || !sound || !messages.push(head, values.iter().copied()) {
            return Err(Damaged { after });
        }
    }
    Ok(())
}

/// Adds the ticks in `chunk`: numbers, times and overruns never decrease.
fn add_ticks(
    ticks: &mut Vec<TickRecord>,
    chunk: &Chunk,
    mut note: impl FnMut(&TickRecord),
) -> Result<(), Damaged> {
    for row in rows::ticks(chunk) {
        let last = ticks.last();
        let after = last.map_or(Time::ZERO, |last| last.at);
        let tick = row.ok_or(Damaged { after })?;
        note(&tick);
        let follows = last.is_none_or(|last| {
            tick.number > last.number && tick.at >= last.at && tick.overruns >= last.overruns
        });
        let acted = tick.push.is_none_or(|push| push.at >= tick.at);
        if !(follows && acted) {
            return Err(Damaged { after });
        }
        ticks.push(tick);
    }
    Ok(())
}

/// Adds the events in `chunk`. Those of different threads may be slightly out of order.
fn add_events(
    events: &mut Vec<Event>,
    chunk: &Chunk,
    digest: &mut ContentDigest,
) -> Result<(), Damaged> {
    for text in rows::texts(chunk) {
        let after = events.last().map_or(Time::ZERO, |last| last.at);
        digest.add_event(text.as_deref().unwrap_or_default());
        let event = rows::json(text.as_deref());
        let event = event.and_then(|json| serde_json::from_value(json).ok());
        events.push(event.ok_or(Damaged { after })?);
    }
    Ok(())
}
