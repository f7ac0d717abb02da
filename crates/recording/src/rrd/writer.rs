//! Writes in batches: large enough for a small file, and often enough to lose little in a
//! power cut.

use std::{
    fs, io,
    ops::ControlFlow,
    sync::Arc,
    time::{Duration, Instant, SystemTime},
};

use ratelab::{ClockKind, Command, Event, Head, Time, Topology};
use ratelab_metrics::{Observer, RunRow, Tap};
use ratelab_re_execution::RunLog;
use ratelab_system::System;
use rerun::{EntityPath, RecordingStream};

use super::{
    blueprint, columns,
    file::{LARGEST, RecordingFile, compact},
    scene::{Scene, lanes, traffic},
    schema::{CHECKPOINT, ContentDigest, END, RowDigest, UNTIL, node_entity, topic_entity},
    thread_log::ThreadTrack,
    timeline::{BatchStream, Written},
    viewer::Viewer,
};
use crate::{
    recorder::{BACKLOG, FinishedRecording, RunWriter, Source, StopReason},
    run::{RecordRow, Recording, RecordingEnd, RunRows, Series},
};

/// Wall time between two batches. A kill loses the messages since the last one.
const BATCH: Duration = Duration::from_millis(900);

/// Number of items that makes a batch at any time, for a run at full speed: the recording of one that
/// is stopped ends within a fraction of a second.
const LARGE_BATCH: usize = 16_384;

/// Writes batches to a file.
pub struct RecordingWriter {
    rec: RecordingStream,
    file: RecordingFile,
    is_overdue: fn() -> bool,
    waiting: RunRows,
    system: Arc<dyn System>,
    topology: Topology,
    observer: Observer,
    scene: Scene,
    threads: ThreadTrack,
    digest: ContentDigest,
    /// Wall time at which run time was zero, or would have been: pauses move it.
    epoch: Option<SystemTime>,
    events: usize,
    /// Number of steps of the plant.
    made: u64,
    /// Run time of the newest tick written.
    newest: Option<Time>,
    /// Run time of the newest message or event written: under the real clock it may be later
    /// than the end of the run.
    latest: Time,
    last_batch: Instant,
    /// Number of rows that came since then.
    new_rows: usize,
}

impl RecordingWriter {
    /// Writes the beginning of a recording.
    ///
    /// # Errors
    /// The first error of the file.
    pub fn start(
        file: RecordingFile,
        viewer: Option<&Viewer>,
        is_overdue: fn() -> bool,
        source: Source,
    ) -> io::Result<Self> {
        let rec = blueprint::begin(&file, viewer, &source).map_err(io::Error::other)?;
        let waiting = source.taps.empty_rows(&source.origin.topology);
        let json = serde_json::to_string(&source.origin).unwrap_or_default();
        // Without the handle to the taps, which would keep other taps open.
        let mut writer = Self {
            digest: ContentDigest::new(&json, &source.origin.topology),
            topology: source.origin.topology,
            rec,
            file,
            is_overdue,
            waiting,
            scene: Scene::new(&source.system, &source.start),
            threads: ThreadTrack::default(),
            system: source.system,
            observer: source.observer,
            epoch: None,
            events: 0,
            made: 0,
            newest: None,
            latest: Time::ZERO,
            last_batch: Instant::now(),
            new_rows: 0,
        };
        writer.anchor();
        let begun = writer.scene.begin(&writer.stream(&[]), &source.start);
        begun.map_err(io::Error::other)?;
        writer.batch(Time::MAX)?;
        Ok(writer)
    }

    /// Empties the tap while the run goes on; returns the run time up to which all rows have
    /// arrived. A tick arrives after its messages, and all rows before the newest have arrived
    /// when the tap is emptied once more.
    fn drain_before_newest(&mut self, tap: &Tap<RunRow>) -> Time {
        let newest = self.waiting.newest();
        self.waiting.receive(tap);
        newest.map_or(Time::ZERO, |newest| newest - Time::RESOLUTION)
    }

    /// Returns the end record.
    fn outcome(&self, reason: &StopReason, lost: u64) -> RecordingEnd {
        let rows = |series: &[RowDigest]| series.iter().map(|digest| digest.rows).collect();
        let end = reason.end(&*self.system, &self.observer);
        let mut outcome = RecordingEnd {
            at: end.at.max(self.newest.unwrap_or_default()).max(self.latest),
            messages: rows(&self.digest.topics),
            ticks: rows(&self.digest.nodes),
            lost,
            threads: self.threads.digest(),
            ..end
        };
        outcome.digest = Some(self.digest.with_end(&outcome));
        outcome
    }

    /// Writes the waiting items up to run time `until`.
    fn batch(&mut self, until: Time) -> io::Result<()> {
        (self.last_batch, self.new_rows) = (Instant::now(), 0);
        // The log has all that is in the ticks before, and mentions no later event.
        let threads = self.threads.take(&self.observer);
        let events = self.observer.events(self.events);
        self.events += events.len();
        let times = events.iter().map(|event| event.at);
        self.latest = times.fold(self.latest, Time::max);
        self.write_parts(until, &events)
            .and_then(|()| self.write_threads(&threads))
            .map_err(io::Error::other)?;
        self.flush()
    }

    /// Writes the items before an event that shifts wall time with the old epoch, and later
    /// items with the new one.
    fn write_parts(&mut self, until: Time, events: &[Event]) -> Written {
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

    /// Writes `pieces` of the threads' logs, and marks the run time up to which the file is
    /// complete, in case it is cut off later.
    fn write_threads(&mut self, pieces: &[(usize, Vec<u8>)]) -> Written {
        let (stream, newest) = (self.stream(&[]), self.newest.unwrap_or_default());
        self.threads.write(&stream, pieces, newest)?;
        let until = columns::numbers(UNTIL, self.newest.map(Time::as_nanos))?;
        stream.send(CHECKPOINT, self.newest.as_slice(), [until])
    }

    /// A pause stops run time, and another clock changes its speed, so after either the
    /// wall time is measured again: accurate to the time since the last tick, about 20
    /// ms.
    fn anchor(&mut self) {
        let observer = &self.observer;
        if observer.status().clock == ClockKind::Virtual {
            self.epoch = None;
        } else if self.epoch.is_none() {
            let now = Duration::from_nanos(observer.now().as_nanos());
            self.epoch = SystemTime::now().checked_sub(now);
        }
    }

    fn write(&mut self, until: Time, events: &[Event]) -> Written {
        let rows = self.waiting.take_ended(until);
        let topology = &self.topology;
        let states = self
            .system
            .states_topic()
            .and_then(|state| topology.topic(state));
        let stream = self.stream(states.map_or(&[], |states| rows.topics[states].heads()));
        let (made, digest) = (stream.made(), &mut self.digest);
        let topics = topology.topics.iter().zip(&rows.topics);
        for ((topic, messages), digest) in topics.zip(&mut digest.topics) {
            write_rows(messages, &stream, topic_entity(&topic.name), digest)?;
            self.latest = self.latest.max(messages.newest().unwrap_or_default());
        }
        let nodes = topology.nodes.iter().zip(&rows.ticks);
        for ((node, ticks), digest) in nodes.zip(&mut digest.nodes) {
            write_rows(ticks, &stream, node_entity(&node.name), digest)?;
            self.newest = self.newest.max(ticks.newest());
        }
        traffic::add(&stream, events, digest)?;
        let drawn_until = until.min(self.newest.unwrap_or_default());
        // If somebody waits for the end, the part for the viewer is left out.
        if !(self.is_overdue)() {
            self.scene.add(&stream, &rows.topics, events, drawn_until)?;
        }
        self.made = made;
        Ok(())
    }

    /// Adds the lanes of the timeline, which need the complete run. A large file has none, and
    /// the first ones only if the end is overdue.
    fn add_lanes(&self) -> Written {
        let path = self.file.path();
        let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST);
        let on_time = |_, _| {
            if (self.is_overdue)() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let read = || Recording::read_watched(&path, on_time).ok();
        let recording = small.then(read).flatten();
        let planning = self.system.robot().planning();
        recording.map_or(Ok(()), |recording| {
            lanes::add(&self.rec, &recording, planning, self.is_overdue)
        })
    }

    fn end(&mut self, outcome: &RecordingEnd, reason: &StopReason) -> Written {
        let (verdict, lost) = match reason {
            StopReason::Run(summary) => (summary.verdict.to_string(), summary.verdict.is_lost()),
            StopReason::Fault(fault) => (fault.clone(), true),
            StopReason::Off => ("the recording ends; the run went on".to_owned(), false),
        };
        let stream = self.stream(&[]);
        self.scene.finish(&stream, outcome.at, &verdict, lost)?;
        let json = serde_json::to_string(outcome).unwrap_or_default();
        stream.send(END, &[outcome.at], [columns::texts([json])?])
    }

    /// Returns the stream for a batch with these `steps` of the plant.
    fn stream<'a>(&self, steps: &'a [Head]) -> BatchStream<'a> {
        BatchStream {
            rec: self.rec.clone(),
            epoch: self.epoch,
            before: self.made,
            steps,
        }
    }

    fn flush(&self) -> io::Result<()> {
        // The error of the file is more informative than that of the stream.
        let _ = self.rec.flush_blocking();
        self.file.flush()
    }
}

impl RunWriter for RecordingWriter {
    /// Empties the tap, and writes a batch when one is due.
    fn look(&mut self, tap: &Tap<RunRow>) -> io::Result<bool> {
        let came = self.waiting.receive(tap);
        self.new_rows += came;
        if self.last_batch.elapsed() >= BATCH || self.new_rows >= LARGE_BATCH {
            let until = self.drain_before_newest(tap);
            self.batch(until)?;
        }
        Ok(came > BACKLOG / 8)
    }

    /// Writes the remaining data, and the end.
    fn complete(
        mut self: Box<Self>,
        tap: Tap<RunRow>,
        reason: &StopReason,
    ) -> io::Result<FinishedRecording> {
        self.waiting.receive(&tap);
        let goes_on = matches!(reason, StopReason::Off) && !self.observer.status().paused;
        let until = if goes_on {
            self.drain_before_newest(&tap)
        } else {
            Time::MAX
        };
        self.batch(until)?;
        let outcome = self.outcome(reason, tap.lost());
        self.end(&outcome, reason).map_err(io::Error::other)?;
        self.flush()?;
        self.add_lanes().map_err(io::Error::other)?;
        self.flush()?;
        // Nothing may follow the end of the file.
        self.rec.disconnect();
        // The run no longer waits for it.
        drop(tap);
        let bytes = self.file.complete()?;
        Ok(FinishedRecording {
            path: self.file.path(),
            // A file that cannot be compacted is still complete.
            bytes: compact(&self.file, self.is_overdue).unwrap_or(bytes),
            hurried: (self.is_overdue)(),
            messages: outcome.messages.iter().sum(),
            lost: outcome.lost,
            written_from_outside: RunLog::attach(&self.observer).written_from_outside(),
        })
    }
}

/// Writes the rows of `series` to `entity`, and adds them to `digest`.
fn write_rows<S: Series>(
    series: &S,
    stream: &BatchStream,
    entity: EntityPath,
    digest: &mut RowDigest,
) -> Written {
    let rows = series.rows();
    for (index, row) in rows.iter().enumerate() {
        digest.add(row, series.payload(index));
    }
    let mut columns = columns::write(rows)?;
    if S::Row::HAS_PAYLOAD && !rows.is_empty() {
        let payloads = (0..rows.len()).flat_map(|index| series.payload(index));
        let (values, width) = (payloads.copied().collect(), series.payload(0).len());
        columns.push(columns::series(values, width, rows.len())?);
    }
    let times: Vec<Time> = rows.iter().map(RecordRow::at).collect();
    stream.send(entity, &times, columns)
}

fn moves_the_wall(event: &Event) -> bool {
    matches!(
        event.applied(),
        Some(Command::Resume | Command::HandOver(_))
    )
}
