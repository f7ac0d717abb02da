//! Compares the recorded rows with those of the new run, one by one.

use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
};

use crossbeam_channel::Sender;
use ratelab::{Command, Time};

use super::{
    Identical,
    difference::{Difference, bits},
    order,
};
use crate::{
    columns::{ColumnForm, RecordColumn, RecordRow},
    recorded::Recording,
    series::Series,
};

/// Compares all series of one run at the same time, until one differs.
pub struct Comparison<'a> {
    /// The recorded run.
    pub recording: &'a Recording,
    /// Whether the rows that come are kept.
    keeps: bool,
    /// Whether the recording has rows to compare them with.
    compares: bool,
    /// Whether the recording goes on to the end of the run.
    pub complete: bool,
    /// Whether it was under the real clock, and can be executed again up to some moment
    /// only.
    cut: bool,
    /// Number of rows that the recorder may have lost.
    may_lack: u64,
    lacks: AtomicU64,
    /// When the last of its series had begun: those that are empty had, too.
    begun: Time,
    /// Number of ticks and of messages that are the same.
    same: [AtomicUsize; 2],
    /// The first difference of each series.
    differences: Mutex<Vec<Difference>>,
    /// Whether the run was to end early.
    stopped: AtomicBool,
    commands: Sender<Command>,
}

/// A recorded topic or node.
pub struct RecordedSeries<'a, S> {
    name: &'a str,
    fields: &'static [&'static str],
    series: &'a S,
}

impl<'a> Comparison<'a> {
    /// With `recording`, of a run that obeys `commands`. With `threads` it was under the real
    /// clock, and the recorder may have lost some.
    pub fn new(recording: &'a Recording, threads: bool, commands: Sender<Command>) -> Self {
        let topics = recording
            .topics
            .iter()
            .filter_map(|rows| rows.heads().first());
        let nodes = recording.ticks.iter().filter_map(|ticks| ticks.first());
        let firsts = topics.map(RecordRow::at).chain(nodes.map(RecordRow::at));
        Self {
            recording,
            keeps: false,
            compares: true,
            complete: order::is_complete(recording, threads),
            cut: threads && !order::is_whole(recording),
            may_lack: match &recording.outcome {
                Some(outcome) if threads => outcome.lost,
                // A file that was cut off lacks the number.
                None if threads => u64::MAX,
                _ => 0,
            },
            lacks: AtomicU64::new(0),
            begun: firsts.max().unwrap_or_default(),
            same: Default::default(),
            differences: Mutex::default(),
            stopped: AtomicBool::new(false),
            commands,
        }
    }

    /// Keeps the rows that come. A recording without any tick has nothing to compare them with.
    pub fn keeping(self) -> Self {
        Self {
            keeps: true,
            compares: self.recording.ticks.iter().any(|ticks| !ticks.is_empty()),
            ..self
        }
    }

    /// Compares what comes of `tap` with what was recorded, and ends the run if that is
    /// not the same. Returns the rows that are kept.
    pub fn check<S: Series>(&self, recorded: &RecordedSeries<'_, S>, tap: S::Tap) -> S {
        let mut kept = S::of(&tap);
        // The tap goes with the first difference: the run no longer waits for it.
        if let Some(difference) = self.difference(recorded, tap, &mut kept) {
            self.differences().push(difference);
            self.stop();
        }
        kept
    }

    /// Ends the run before its end.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
        let _ = self.commands.send(Command::Stop); // It may be over.
    }

    /// The earliest difference that was found.
    pub fn first_difference(&self) -> Option<Difference> {
        let differences = std::mem::take(&mut *self.differences());
        differences
            .into_iter()
            .min_by_key(|difference| difference.at)
    }

    fn differences(&self) -> MutexGuard<'_, Vec<Difference>> {
        self.differences
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// What is the same, of a run that ended at `now`.
    pub fn identical(&self, now: Time) -> Identical {
        let recording = self.recording;
        let topics = recording.topics.iter().filter(|rows| !rows.is_empty());
        let [ticks, messages] = [0, 1].map(|kind| self.same[kind].load(Ordering::Relaxed));
        let outcome = recording.outcome.as_ref();
        let digest = outcome.and_then(|outcome| outcome.digest);
        Identical {
            topics: topics.count(),
            messages,
            ticks,
            until: (self.cut || !recording.is_whole()).then(|| now.min(recording.until)),
            // A run that was never in a file needs none.
            without_digest: recording.bytes > 0 && digest.is_none(),
        }
    }

    /// Number of rows that the recorder lost.
    pub fn lacks(&self) -> u64 {
        self.lacks.load(Ordering::Relaxed)
    }

    fn difference<S: Series>(
        &self,
        recorded: &RecordedSeries<'_, S>,
        tap: S::Tap,
        kept: &mut S,
    ) -> Option<Difference> {
        let (rows, rare) = (recorded.series.rows(), recorded.has_rare());
        let (mut same, mut next) = (0, 0);
        while kept.wait(&tap) {
            while let Some(row) = kept.rows().get(next).filter(|_| self.compares) {
                let expected = rows.get(same);
                let unknown = self.is_before(rows, row) || self.was_lost(expected, row);
                if let Some(expected) = expected.filter(|_| !unknown) {
                    let payloads = [recorded.series.payload(same), kept.payload(next)];
                    let difference = recorded.compare(rare, [expected, row], payloads);
                    if difference.is_some() {
                        return difference;
                    }
                    same += 1;
                } else if !unknown && self.complete {
                    return Some(recorded.lone(row, false));
                }
                next += 1;
            }
            if !self.keeps {
                (*kept, next) = (S::of(&tap), 0);
            }
        }
        let kind = usize::from(S::Row::HAS_PAYLOAD);
        self.same[kind].fetch_add(same, Ordering::Relaxed);
        // A run that was ended because of another difference lacks what came after.
        let ended = self.cut || self.stopped.load(Ordering::Relaxed);
        let missing = rows.get(same).filter(|_| self.compares && !ended);
        missing.map(|row| recorded.lone(row, true))
    }

    /// Whether the recorder lost `row`, which came in place of the `expected` one.
    fn was_lost<R: RecordRow>(&self, expected: Option<&R>, row: &R) -> bool {
        let lost = expected.map_or(self.complete, |next| row.number() < next.number());
        let one = u64::from(self.may_lack > 0);
        lost && self.may_lack > self.lacks.fetch_add(one, Ordering::Relaxed)
    }

    /// Whether `row` came before the `recorded` ones: recordings may begin later than runs.
    fn is_before<R: RecordRow>(&self, recorded: &[R], row: &R) -> bool {
        match recorded.first() {
            Some(first) => row.number() < first.number(),
            None => row.at() < self.begun,
        }
    }
}

impl<'a, S: Series> RecordedSeries<'a, S> {
    /// What was recorded of the topic or node called `name`, whose payloads have these `fields`.
    pub fn new(name: &'a str, fields: &'static [&'static str], series: &'a S) -> Self {
        Self {
            name,
            fields,
            series,
        }
    }

    /// Whether a row has what is in no file where all lack it.
    fn has_rare(&self) -> bool {
        self.series.rows().iter().any(|row| {
            let mut cells = row.cells().into_iter().zip(S::Row::COLUMNS);
            cells.any(|(cell, column)| column.form == ColumnForm::Rare && cell.is_some())
        })
    }

    /// A row that is recorded and does not come, or else one that comes and is not recorded.
    fn lone(&self, row: &S::Row, is_recorded: bool) -> Difference {
        let [some, none] = [format!("a {}", S::Row::KIND), "none".to_owned()];
        match is_recorded {
            true => self.differs(row, "", some, none),
            false => self.differs(row, "", none, some),
        }
    }

    /// The first part in which a recorded row with its payload is not the computed one; also of
    /// what is `rare`.
    fn compare(&self, rare: bool, rows: [&S::Row; 2], payloads: [&[f64]; 2]) -> Option<Difference> {
        let [recorded, computed] = rows.map(RecordRow::cells);
        let columns = S::Row::COLUMNS.iter().enumerate();
        let mut columns = columns.filter(|(_, column)| rare || column.form != ColumnForm::Rare);
        let differs = |(index, column): &(usize, &RecordColumn)| {
            column.differs(recorded[*index], computed[*index])
        };
        if let Some((index, column)) = columns.find(differs) {
            let [one, other] = [&recorded, &computed].map(|cells| column.told(cells[index]));
            return Some(self.differs(rows[0], column.what, one, other));
        }
        let mut indices = 0..payloads[0].len().max(payloads[1].len());
        let values = |index: usize| payloads.map(|payload| payload.get(index).copied());
        let index = indices.find(|index| {
            let [one, other] = values(*index).map(|value| value.map(f64::to_bits));
            one != other
        })?;
        let field = self.fields.get(index).copied().unwrap_or("a number more");
        let [one, other] = values(index).map(|value| value.map_or("nothing".to_owned(), bits));
        Some(self.differs(rows[0], field, one, other))
    }

    fn differs(&self, row: &S::Row, part: &str, recorded: String, computed: String) -> Difference {
        let (number, comma) = (row.number(), if part.is_empty() { "" } else { ", " });
        let what = format!("{} {} {number}{comma}{part}", self.name, S::Row::KIND);
        Difference::new(row.at(), (what, recorded, computed))
    }
}
