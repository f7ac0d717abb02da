//! What is written, and when: in batches, so that a recording is small, and
//! often enough that little is lost with the power.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant, SystemTime},
};

use ratelab::{
    cartpole::{Action, ControlStep, Observation},
    experiment::{ACTION, OBS, STATE},
    runtime::{
        ClockKind, Command, Fields, Observer, Payload, Snapshot, TapMessage, TickRecord, Time,
        telemetry::{Event, EventKind},
    },
};
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use super::{
    blueprint, columns,
    file::RecordingFile,
    progress::Progress,
    properties,
    scene::{Batch, Scene},
    schema::{self, APPLICATION, CHECKPOINT, END, EVENTS, JSON, RecordingEnd, UNTIL},
    source::{Source, StopReason},
    timeline::Stamps,
    tracks::{TapQueue, name_fields, write_messages, write_ticks},
};

/// Wall time between two batches: a kill loses what came since the last.
const BATCH: Duration = Duration::from_millis(900);

/// Items that are a batch whatever the time: what a run flat out makes.
const LARGE_BATCH: usize = 100_000;

/// Items that a tap holds: minutes at 50 Hz, between two looks of 50 ms more
/// than any real clock makes.
const BACKLOG: usize = 16_384;

/// Taps on everything.
pub struct AttachedTaps {
    observations: TapQueue<TapMessage<Observation>>,
    actions: TapQueue<TapMessage<Action>>,
    steps: TapQueue<TapMessage<ControlStep>>,
    ticks: Vec<TapQueue<TickRecord>>,
}

impl AttachedTaps {
    /// Taps `source` from now on.
    pub fn new(source: &Source) -> Self {
        let taps = &source.taps;
        Self {
            observations: TapQueue::new(taps.observations(BACKLOG)),
            actions: TapQueue::new(taps.actions(BACKLOG)),
            steps: TapQueue::new(taps.steps(BACKLOG)),
            ticks: taps.ticks(BACKLOG).into_iter().map(TapQueue::new).collect(),
        }
    }
}

/// What was written.
pub struct Written {
    /// The file.
    pub file: RecordingFile,
    /// Size of the file.
    pub bytes: u64,
    /// Messages in it.
    pub messages: u64,
    /// Messages and ticks that came faster than they could be recorded.
    pub lost: u64,
}

/// Writes batches to a file.
pub struct RecordingWriter {
    rec: RecordingStream,
    file: RecordingFile,
    taps: AttachedTaps,
    observer: Observer,
    /// Entities of the nodes.
    nodes: Vec<String>,
    scene: Scene,
    /// Wall time at which run time was zero, or would have been: pauses move it.
    epoch: Option<SystemTime>,
    events: usize,
    /// Control steps that the plant has made.
    made: u64,
    /// Run time of the newest tick that is written.
    newest: Option<Time>,
    last_batch: Instant,
    lost: Arc<AtomicU64>,
}

impl RecordingWriter {
    /// Writes what a recording begins with.
    pub fn start(
        file: RecordingFile,
        taps: AttachedTaps,
        source: Source,
        lost: Arc<AtomicU64>,
    ) -> io::Result<Self> {
        let Source {
            origin,
            start,
            observer,
            ..
        } = source;
        let rec =
            begin(&file, &origin, &start, observer.status().clock).map_err(io::Error::other)?;
        let nodes = origin.topology.nodes.iter();
        let mut writer = Self {
            nodes: nodes.map(|node| schema::node_entity(&node.name)).collect(),
            rec,
            file,
            taps,
            observer,
            scene: Scene::new(&start),
            epoch: None,
            events: 0,
            made: 0,
            newest: None,
            last_batch: Instant::now(),
            lost,
        };
        writer.anchor();
        let scene = writer.scene.begin(&writer.rec, &start, &writer.now());
        scene.map_err(io::Error::other)?;
        writer.batch(Time::MAX)?;
        Ok(writer)
    }

    /// Takes what the taps hold, and writes it when it is time to. Says whether
    /// there is so much that it should look again at once.
    pub fn look(&mut self) -> io::Result<bool> {
        let fullest = self.drain();
        if self.last_batch.elapsed() >= BATCH || self.waiting() >= LARGE_BATCH {
            // Beyond the newest control step, others may be further than it is.
            self.batch(self.taps.steps.newest().unwrap_or(Time::MAX))?;
        }
        Ok(fullest > BACKLOG / 8)
    }

    /// Writes the rest, and the end.
    pub fn complete(mut self, reason: &StopReason) -> io::Result<Written> {
        self.drain();
        self.batch(Time::MAX)?;
        let outcome = RecordingEnd {
            at: self.observer.now().max(self.newest.unwrap_or(Time::ZERO)),
            clock: self.observer.status().clock,
            end: reason.mark(),
            messages: self.messages().to_vec(),
            ticks: self.taps.ticks.iter().map(|track| track.written).collect(),
            lost: self.count_lost(),
            dropped: reason.losses(&self.observer),
        };
        self.end(&outcome, reason).map_err(io::Error::other)?;
        self.flush()?;
        // Nothing may follow the end of the file.
        self.rec.disconnect();
        Ok(Written {
            bytes: self.file.complete()?,
            file: self.file,
            messages: outcome.messages.iter().sum(),
            lost: outcome.lost,
        })
    }

    fn messages(&self) -> [u64; 3] {
        let taps = &self.taps;
        [
            taps.observations.written,
            taps.actions.written,
            taps.steps.written,
        ]
    }

    /// Control steps first: whatever led to one is then in its tap already.
    fn drain(&mut self) -> usize {
        let taps = &mut self.taps;
        let messages = [
            taps.steps.drain(),
            taps.observations.drain(),
            taps.actions.drain(),
        ];
        let ticks = taps.ticks.iter_mut().map(TapQueue::drain);
        let fullest = messages.into_iter().chain(ticks).max().unwrap_or(0);
        self.count_lost();
        fullest
    }

    fn waiting(&self) -> usize {
        let taps = &self.taps;
        let ticks: usize = taps.ticks.iter().map(TapQueue::waiting).sum();
        taps.observations.waiting() + taps.actions.waiting() + taps.steps.waiting() + ticks
    }

    fn count_lost(&self) -> u64 {
        let taps = &self.taps;
        let ticks: u64 = taps.ticks.iter().map(TapQueue::lost).sum();
        let messages = taps.observations.lost() + taps.actions.lost() + taps.steps.lost();
        self.lost.store(messages + ticks, Ordering::Relaxed);
        messages + ticks
    }

    /// Writes what waits and is not later than `until`.
    fn batch(&mut self, until: Time) -> io::Result<()> {
        self.last_batch = Instant::now();
        let events = self.observer.events(self.events);
        self.events += events.len();
        self.write_parts(until, &events)
            .and_then(|()| self.checkpoint())
            .map_err(io::Error::other)?;
        self.flush()
    }

    /// Writes what came before an event that moves the wall by the old one, and
    /// what came after it by the new.
    fn write_parts(&mut self, until: Time, events: &[Event]) -> RecordingStreamResult<()> {
        let mut rest = events;
        while let Some(index) = rest.iter().position(moves_the_wall) {
            let (before, after) = rest.split_at(index + 1);
            self.write(before[index].at.min(until), before)?;
            self.epoch = None;
            rest = after;
        }
        self.anchor();
        self.write(until, rest)
    }

    /// Says up to where everything is in the file, should it be torn later.
    fn checkpoint(&self) -> RecordingStreamResult<()> {
        let Some(newest) = self.newest else {
            return Ok(());
        };
        let stamps = self.now().stamp(newest);
        let until = columns::numbers(UNTIL, [newest.as_nanos()])?;
        self.rec.send_columns(CHECKPOINT, stamps.columns(), [until])
    }

    /// Run time stands still at a pause and passes otherwise under another
    /// clock, so after either wall time is found anew: to the time since the
    /// last tick, some 20 ms.
    fn anchor(&mut self) {
        if self.observer.status().clock == ClockKind::Virtual {
            self.epoch = None;
        } else if self.epoch.is_none() {
            let now = Duration::from_nanos(self.observer.now().as_nanos());
            self.epoch = SystemTime::now().checked_sub(now);
        }
    }

    fn write(&mut self, until: Time, events: &[Event]) -> RecordingStreamResult<()> {
        let taps = &mut self.taps;
        let steps = taps.steps.take(until);
        let observations = taps.observations.take(until);
        let actions = taps.actions.take(until);
        let ticks: Vec<_> = taps.ticks.iter_mut().map(|t| t.take(until)).collect();
        let step_messages: Vec<_> = steps.iter().map(|step| step.message).collect();
        let progress = Progress {
            epoch: self.epoch,
            before: self.made,
            steps: &step_messages,
        };
        let rec = &self.rec;
        messages(rec, OBS, &observations, &progress)?;
        messages(rec, ACTION, &actions, &progress)?;
        messages(rec, STATE, &steps, &progress)?;
        for (entity, ticks) in self.nodes.iter().zip(&ticks) {
            let stamps = progress.stamps_of(ticks.iter().map(|tick| tick.at));
            write_ticks(rec, entity, ticks, &stamps)?;
        }
        write_events(rec, events, &progress)?;
        let batch = Batch {
            progress: &progress,
            topics: &[
                (OBS, &traffic(&observations)),
                (ACTION, &traffic(&actions)),
                (STATE, &traffic(&steps)),
            ],
            events,
        };
        self.scene.add(rec, &batch)?;
        let newest = ticks.iter().filter_map(|ticks| ticks.last());
        self.newest = newest.map(|tick| tick.at).max().max(self.newest);
        self.made = progress.step();
        Ok(())
    }

    fn end(&mut self, outcome: &RecordingEnd, reason: &StopReason) -> RecordingStreamResult<()> {
        let progress = self.now();
        let (verdict, lost) = match reason {
            StopReason::Run(summary) => {
                properties::send_summary(&self.rec, summary)?;
                (summary.verdict.to_string(), !summary.verdict.balanced())
            }
            StopReason::Fault(fault) => (fault.clone(), true),
            StopReason::Off => ("the recording ends; the run went on".to_owned(), false),
        };
        self.scene
            .finish(&self.rec, &progress, outcome.at, &verdict, lost)?;
        let json = serde_json::to_string(outcome).unwrap_or_default();
        let stamps = progress.stamp(outcome.at);
        self.rec
            .send_columns(END, stamps.columns(), [columns::texts(JSON, [json])?])
    }

    /// Where things are placed that happen after the last batch.
    fn now(&self) -> Progress<'static> {
        Progress {
            epoch: self.epoch,
            before: self.made,
            steps: &[],
        }
    }

    fn flush(&self) -> io::Result<()> {
        // The stream says less of what went wrong than the file does.
        let _ = self.rec.flush_blocking();
        self.file.flush()
    }
}

/// A stream to `file` with its layout and what it is of.
fn begin(
    file: &RecordingFile,
    origin: &schema::Origin,
    start: &Snapshot,
    clock: ClockKind,
) -> RecordingStreamResult<RecordingStream> {
    let config = &origin.config;
    let name = format!(
        "{} clock, {} policy at {}, seed {}",
        config.clock,
        config.policy.name(),
        config.control_hz,
        config.seed
    );
    let rec = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_name(name)
        .buffered()?;
    rec.set_sink(Box::new(file.clone()));
    // Nothing can be read without this, and columns overtake what is logged.
    properties::send_origin(&rec, origin)?;
    let _ = rec.flush_blocking();
    blueprint::send(&rec, start, clock)?;
    name_fields::<Observation>(&rec, &schema::topic_entity(OBS))?;
    name_fields::<Action>(&rec, &schema::topic_entity(ACTION))?;
    name_fields::<ControlStep>(&rec, &schema::topic_entity(STATE))?;
    Ok(rec)
}

fn messages<T: Fields + Payload>(
    rec: &RecordingStream,
    topic: &str,
    messages: &[TapMessage<T>],
    progress: &Progress<'_>,
) -> RecordingStreamResult<()> {
    let stamps = progress.stamps_of(messages.iter().map(|tapped| tapped.message.stamp));
    write_messages(rec, &schema::topic_entity(topic), messages, &stamps)
}

/// Events for readers; the scene tells them to people.
fn write_events(
    rec: &RecordingStream,
    events: &[Event],
    progress: &Progress<'_>,
) -> RecordingStreamResult<()> {
    if events.is_empty() {
        return Ok(());
    }
    let stamps: Stamps = progress.stamps_of(events.iter().map(|event| event.at));
    let texts = events
        .iter()
        .map(|event| serde_json::to_string(event).unwrap_or_default());
    rec.send_columns(EVENTS, stamps.columns(), [columns::texts(JSON, texts)?])
}

fn traffic<T>(messages: &[TapMessage<T>]) -> Vec<(Time, u64)> {
    let messages = messages.iter();
    messages
        .map(|tapped| (tapped.message.stamp, tapped.dropped))
        .collect()
}

fn moves_the_wall(event: &Event) -> bool {
    matches!(
        event.what,
        EventKind::Applied {
            command: Command::Resume | Command::HandOver(_),
            ..
        }
    )
}
