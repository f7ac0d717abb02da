//! Writes in batches: large enough for a small file, and often enough to lose little in a
//! power cut.

use std::{
    fs, io,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant, SystemTime},
};

use ratelab::{ClockKind, Command, Event, Head, Time, Topology};
use ratelab_account::{Observer, Rows};
use ratelab_replay::RunLog;
use ratelab_study::system::System;
use rerun::RecordingStream;

use super::{
    columns,
    compact::{LARGEST, compact},
    digest::ContentDigest,
    file::RecordingFile,
    finished::{FinishedRecording, outside},
    properties,
    recorded::Recording,
    scene::{Scene, SceneBatch, lanes},
    schema::{CHECKPOINT, END, EVENTS, RecordingEnd, UNTIL},
    series::Series,
    source::{Source, StopReason},
    thread_log::ThreadTrack,
    timeline::{BatchStream, Written},
    tracks::{AttachedTaps, BACKLOG},
};

/// Wall time between two batches. A kill loses the messages since the last one.
const BATCH: Duration = Duration::from_millis(900);

/// Number of items that makes a batch at any time, for a run at full speed.
const LARGE_BATCH: usize = 100_000;

/// Writes batches to a file.
pub struct RecordingWriter {
    rec: RecordingStream,
    file: RecordingFile,
    taps: AttachedTaps,
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
    lost: Arc<AtomicU64>,
    notice: fn(&str),
    /// Number of writes from outside of the graph of which there was a notice.
    noticed: usize,
}

impl RecordingWriter {
    /// Writes the beginning of a recording.
    pub fn start(
        file: RecordingFile,
        taps: AttachedTaps,
        source: Source,
        lost: Arc<AtomicU64>,
    ) -> io::Result<Self> {
        let rec = properties::begin(&file, &taps, &source).map_err(io::Error::other)?;
        // Without its handle to the taps, which would keep other taps open.
        let Source {
            system,
            origin,
            start,
            observer,
            notice,
            ..
        } = source;
        let json = serde_json::to_string(&origin).unwrap_or_default();
        let mut writer = Self {
            digest: ContentDigest::new(&json, &origin.topology),
            topology: origin.topology,
            rec,
            file,
            taps,
            scene: Scene::new(&system, &start),
            threads: ThreadTrack::default(),
            system,
            observer,
            epoch: None,
            events: 0,
            made: 0,
            newest: None,
            latest: Time::ZERO,
            last_batch: Instant::now(),
            lost,
            notice,
            noticed: 0,
        };
        writer.anchor();
        let begun = writer.scene.begin(&writer.stream(&[]), &start);
        begun.map_err(io::Error::other)?;
        writer.batch(Time::MAX)?;
        Ok(writer)
    }

    /// Empties the taps, and writes a batch when one is due. Returns whether there is so
    /// much data that it should be called again at once.
    pub fn look(&mut self) -> io::Result<bool> {
        let fullest = self.drain();
        if self.last_batch.elapsed() >= BATCH || self.taps.waiting() >= LARGE_BATCH {
            let until = self.drain_before_newest();
            self.batch(until)?;
        }
        Ok(fullest > BACKLOG / 8)
    }

    /// Empties the taps while the run goes on; returns the run time up to which all items have
    /// arrived. A tick arrives after its messages, and all items before the newest have arrived
    /// when all taps are drained once more.
    fn drain_before_newest(&mut self) -> Time {
        let newest = self.taps.newest();
        self.drain();
        newest.map_or(Time::ZERO, |newest| newest - Time::RESOLUTION)
    }

    /// Writes the remaining data, and the end.
    pub fn complete(mut self, reason: &StopReason) -> io::Result<FinishedRecording> {
        self.drain();
        let goes_on = matches!(reason, StopReason::Off) && !self.observer.status().paused;
        let until = match goes_on {
            true => self.drain_before_newest(),
            false => Time::MAX,
        };
        self.batch(until)?;
        let outcome = self.outcome(reason);
        self.end(&outcome, reason).map_err(io::Error::other)?;
        self.flush()?;
        self.add_lanes().map_err(io::Error::other)?;
        self.flush()?;
        // Nothing may follow the end of the file.
        self.rec.disconnect();
        // The run no longer waits for them.
        drop(self.taps);
        let bytes = self.file.complete()?;
        Ok(FinishedRecording {
            path: self.file.path(),
            // A file that cannot be compacted is still complete.
            bytes: compact(&self.file).unwrap_or(bytes),
            messages: outcome.messages.iter().sum(),
            lost: outcome.lost,
            written_from_outside: RunLog::of(&self.observer).written_from_outside(),
        })
    }

    /// The end record.
    fn outcome(&self, reason: &StopReason) -> RecordingEnd {
        let observer = &self.observer;
        let mut messages = vec![0; self.topology.topics.len()];
        for track in &self.taps.topics {
            messages[track.index] = track.written;
        }
        let newest = self.newest.unwrap_or_default();
        let mut outcome = RecordingEnd {
            at: observer.now().max(newest).max(self.latest),
            clock: observer.status().clock,
            end: reason.status(&*self.system),
            messages,
            ticks: self.taps.nodes.iter().map(|track| track.written).collect(),
            lost: self.taps.lost(),
            dropped: reason.losses(observer),
            threads: self.threads.digest(),
            digest: None,
        };
        outcome.digest = Some(self.digest.with_end(&outcome));
        outcome
    }

    fn drain(&mut self) -> usize {
        let fullest = self.taps.drain();
        self.lost.store(self.taps.lost(), Ordering::Relaxed);
        // A notice of what a thread outside of the graph wrote to, once for each.
        let names = RunLog::of(&self.observer).written_from_outside();
        for name in names.iter().skip(self.noticed) {
            (self.notice)(&outside(name));
        }
        self.noticed = names.len();
        fullest
    }

    /// Writes the waiting items up to run time `until`.
    fn batch(&mut self, until: Time) -> io::Result<()> {
        self.last_batch = Instant::now();
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

    /// Writes the items before an event that shifts wall time with the old epoch, and
    /// those after it with the new one.
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
        let topics: Vec<Rows> = self.taps.topics.iter_mut().map(|t| t.take(until)).collect();
        let names = self
            .taps
            .topics
            .iter()
            .map(|t| &*self.topology.topics[t.index].name);
        let topics: Vec<(&str, Rows)> = names.zip(topics).collect();
        let state = self.system.state();
        let states = topics.iter().find(|(name, _)| Some(*name) == state);
        let stream = self.stream(states.map_or(&[], |(_, rows)| rows.heads()));
        let (made, digest) = (stream.made(), &mut self.digest);
        for (track, (_, rows)) in self.taps.topics.iter().zip(&topics) {
            track.write(&stream, rows, &mut digest.topics[track.index])?;
            self.latest = self.latest.max(rows.newest().unwrap_or_default());
        }
        for track in &mut self.taps.nodes {
            let ticks = track.take(until);
            track.write(&stream, &ticks, &mut digest.nodes[track.index])?;
            self.newest = self.newest.max(ticks.newest());
        }
        write_events(&stream, events, digest)?;
        let batch = SceneBatch {
            topics: &topics,
            events,
            until: until.min(self.newest.unwrap_or_default()),
        };
        self.scene.add(&stream, &batch)?;
        self.made = made;
        Ok(())
    }

    /// Adds the lanes of the timeline, which need the complete run. A large file has none.
    fn add_lanes(&self) -> Written {
        let path = self.file.path();
        let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST);
        let recording = small.then(|| Recording::read(&path).ok()).flatten();
        recording.map_or(Ok(()), |recording| lanes::add(&self.rec, &recording))
    }

    fn end(&mut self, outcome: &RecordingEnd, reason: &StopReason) -> Written {
        let (verdict, lost) = match reason {
            StopReason::Run(summary) => {
                properties::send_summary(&self.rec, &*self.system, summary)?;
                (summary.verdict.to_string(), summary.verdict.is_lost())
            }
            StopReason::Fault(fault) => (fault.clone(), true),
            StopReason::Off => ("the recording ends; the run went on".to_owned(), false),
        };
        let stream = self.stream(&[]);
        self.scene.finish(&stream, outcome.at, &verdict, lost)?;
        let json = serde_json::to_string(outcome).unwrap_or_default();
        stream.send(END, &[outcome.at], [columns::texts([json])?])
    }

    /// The stream for a batch with these `steps` of the plant.
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

/// Events for readers; the scene shows them to people.
fn write_events(stream: &BatchStream, events: &[Event], digest: &mut ContentDigest) -> Written {
    // A chunk sorts its rows by time, and events of different threads may be out of order.
    for ordered in events.chunk_by(|before, after| before.at <= after.at) {
        let times: Vec<Time> = ordered.iter().map(|event| event.at).collect();
        let texts = ordered
            .iter()
            .map(|event| serde_json::to_string(event).unwrap_or_default())
            .inspect(|json| digest.add_event(json));
        stream.send(EVENTS, &times, [columns::texts(texts)?])?;
    }
    Ok(())
}

fn moves_the_wall(event: &Event) -> bool {
    matches!(
        event.applied(),
        Some(Command::Resume | Command::HandOver(_))
    )
}

#[cfg(test)]
mod tests {
    use ratelab::EventKind;

    use super::*;
    use crate::tests::{chunks, stream};

    #[test]
    fn events_of_different_threads_keep_their_order() {
        let (rec, storage) = stream();
        let event = |at| Event {
            at: Time::from_nanos(at),
            what: EventKind::Ended {
                node: "actuator".to_owned(),
            },
        };
        let events = [3, 5, 4, 4, 9, 1].map(event);
        let stream = BatchStream {
            rec,
            epoch: None,
            before: 0,
            steps: &[],
        };
        let mut digest = ContentDigest::default();
        write_events(&stream, &events, &mut digest).expect("written");
        let messages = storage.take();
        let texts = chunks(&messages).flat_map(|chunk| columns::read_texts(&chunk));
        let texts = texts.map(|text| text.expect("JSON"));
        let read = texts.map(|text| serde_json::from_str::<Event>(&text).expect("an event"));
        let read: Vec<Event> = read.collect();
        assert_eq!(read, events);
    }
}
