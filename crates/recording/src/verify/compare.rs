//! Compares the rows of a run with the recorded ones, in the order in which they come.

use ratelab::Time;
use ratelab_metrics::{Rows, RunRow, TickRecord};

use super::{
    Identical,
    difference::{Difference, bits},
    events,
};
use crate::{
    recorder::Tapped,
    run::{RecordColumn, RecordRow, Recording, Series},
};

/// Compares a run that is executed again with its recording, row by row.
pub struct Comparison<'a> {
    /// The recorded run.
    pub recording: &'a Recording,
    topics: Vec<RecordedSeries<'a, Rows>>,
    nodes: Vec<RecordedSeries<'a, Vec<TickRecord>>>,
    /// What may be missing in the recording.
    pub gaps: Gaps,
}

/// Which rows of a run may be missing in its recording.
pub struct Gaps {
    /// Whether the recording goes on to the end of the run.
    pub complete: bool,
    /// Whether it was under the real clock, and can be executed again up to some moment
    /// only.
    cut: bool,
    /// Number of rows that the recorder may have lost.
    may_lack: u64,
    /// Number of rows that it has lost so far.
    pub lacks: u64,
    /// When the last of its series had begun; empty series count as begun.
    begun: Time,
}

/// A recorded topic or node.
struct RecordedSeries<'a, S> {
    name: &'a str,
    /// Names of the numbers in its messages.
    fields: Vec<String>,
    series: &'a S,
    /// Whether a row has what is in no file where all lack it.
    rare: bool,
    /// Number of rows that are the same.
    same: usize,
}

impl<'a> Comparison<'a> {
    /// With `recording`, of a run that `tapped` copies. With `threads` it was under the real
    /// clock, and the recorder may have lost some.
    pub fn new(recording: &'a Recording, threads: bool, tapped: &dyn Tapped) -> Self {
        let topology = &recording.origin.topology;
        let topics = topology
            .topics
            .iter()
            .zip(&recording.topics)
            .map(|(topic, rows)| {
                let fields = tapped.fields(&topic.name).unwrap_or_default();
                RecordedSeries::new(&topic.name, fields, rows)
            });
        let nodes = recording
            .nodes()
            .map(|(node, ticks)| RecordedSeries::new(&node.name, &[], ticks));
        Self {
            recording,
            topics: topics.collect(),
            nodes: nodes.collect(),
            gaps: Gaps::find(recording, threads),
        }
    }

    /// Returns the first part in which a `row` that came is not the recorded one.
    pub fn row(&mut self, row: &RunRow) -> Option<Difference> {
        match row {
            RunRow::Message(topic, head, numbers) => {
                let recorded = self.topics.get_mut(*topic)?;
                recorded.check(&mut self.gaps, head, numbers)
            }
            RunRow::Tick(node, tick) => {
                let recorded = self.nodes.get_mut(*node)?;
                recorded.check(&mut self.gaps, tick, &[])
            }
        }
    }

    /// Returns the earliest recorded row that did not come.
    pub fn missing(&self) -> Option<Difference> {
        self.topics
            .iter()
            .filter_map(RecordedSeries::missing)
            .chain(self.nodes.iter().filter_map(RecordedSeries::missing))
            .filter(|_| !self.gaps.cut)
            .min_by_key(|difference| difference.at)
    }

    /// Returns what is the same, of a run that ended at `now`.
    pub fn identical(&self, now: Time) -> Identical {
        let recording = self.recording;
        let topics = recording.topics.iter().filter(|rows| !rows.is_empty());
        let outcome = recording.outcome.as_ref();
        let digest = outcome.and_then(|outcome| outcome.digest);
        Identical {
            topics: topics.count(),
            messages: self.topics.iter().map(|recorded| recorded.same).sum(),
            ticks: self.nodes.iter().map(|recorded| recorded.same).sum(),
            until: (self.gaps.cut || !recording.is_whole()).then(|| now.min(recording.until)),
            // A run that was never in a file needs none.
            without_digest: recording.bytes > 0 && digest.is_none(),
            made_by: None,
        }
    }
}

impl Gaps {
    fn find(recording: &Recording, threads: bool) -> Self {
        let topics = recording
            .topics
            .iter()
            .filter_map(|rows| rows.heads().first());
        let nodes = recording.ticks.iter().filter_map(|ticks| ticks.first());
        let firsts = topics.map(RecordRow::at).chain(nodes.map(RecordRow::at));
        let complete = if threads {
            events::is_whole(recording)
        } else {
            recording.end_of_run().is_some()
        };
        Self {
            complete,
            cut: threads && !complete,
            may_lack: match &recording.outcome {
                Some(outcome) if threads => outcome.lost,
                // A file that was cut off lacks the number.
                None if threads => u64::MAX,
                _ => 0,
            },
            lacks: 0,
            begun: firsts.max().unwrap_or_default(),
        }
    }

    /// Returns whether `row` came before the `recorded` ones: recordings may begin later than runs.
    fn has_before<R: RecordRow>(&self, recorded: &[R], row: &R) -> bool {
        match recorded.first() {
            Some(first) => row.number() < first.number(),
            None => row.at() < self.begun,
        }
    }

    /// Returns whether the recorder lost `row`, which came in place of the `expected` one.
    fn has_lost<R: RecordRow>(&mut self, expected: Option<&R>, row: &R) -> bool {
        let is_other = expected.map_or(self.complete, |next| row.number() < next.number());
        let lost = is_other && self.lacks < self.may_lack;
        self.lacks += u64::from(lost);
        lost
    }
}

impl<'a, S: Series> RecordedSeries<'a, S> {
    fn new(name: &'a str, fields: &[String], series: &'a S) -> Self {
        let rare = series.rows().iter().any(|row| {
            row.cells()
                .into_iter()
                .zip(S::Row::COLUMNS)
                .any(|(cell, column)| column.is_rare() && cell.is_some())
        });
        Self {
            name,
            fields: fields.to_vec(),
            series,
            rare,
            same: 0,
        }
    }

    /// Compares a row that came with the next recorded one, unless it is in one of the `gaps`.
    fn check(&mut self, gaps: &mut Gaps, row: &S::Row, payload: &[f64]) -> Option<Difference> {
        let rows = self.series.rows();
        let expected = rows.get(self.same);
        if gaps.has_before(rows, row) || gaps.has_lost(expected, row) {
            return None;
        }
        let Some(expected) = expected else {
            return gaps.complete.then(|| self.lone(row, false));
        };
        let payloads = [self.series.payload(self.same), payload];
        self.same += 1;
        self.compare([expected, row], payloads)
    }

    /// Returns the first recorded row that did not come.
    fn missing(&self) -> Option<Difference> {
        let row = self.series.rows().get(self.same)?;
        Some(self.lone(row, true))
    }

    /// Returns a row that is recorded and does not come, or else one that comes and is not
    /// recorded.
    fn lone(&self, row: &S::Row, is_recorded: bool) -> Difference {
        let mut values = [format!("a {}", S::Row::KIND), "none".to_owned()];
        if !is_recorded {
            values.reverse();
        }
        self.differs(row, "", values)
    }

    /// Returns the first part in which a recorded row with its payload is not the computed one.
    fn compare(&self, rows: [&S::Row; 2], payloads: [&[f64]; 2]) -> Option<Difference> {
        let [recorded, computed] = rows.map(RecordRow::cells);
        let mut columns = S::Row::COLUMNS
            .iter()
            .enumerate()
            .filter(|(_, column)| self.rare || !column.is_rare());
        let differs = |(index, column): &(usize, &RecordColumn)| {
            column.differs(recorded[*index], computed[*index])
        };
        if let Some((index, column)) = columns.find(differs) {
            let values = [&recorded, &computed].map(|cells| column.told(cells[index]));
            return Some(self.differs(rows[0], column.what, values));
        }
        let lists = rows.map(RecordRow::list);
        if let Some(list) = S::Row::LIST.filter(|_| lists[0] != lists[1]) {
            let values = lists.map(|list| format!("{list:?}"));
            return Some(self.differs(rows[0], list.what, values));
        }
        let mut indices = 0..payloads[0].len().max(payloads[1].len());
        let values = |index: usize| payloads.map(|payload| payload.get(index).copied());
        let index = indices.find(|index| {
            let [one, other] = values(*index).map(|value| value.map(f64::to_bits));
            one != other
        })?;
        let field = self
            .fields
            .get(index)
            .map_or("a number more", String::as_str);
        let values = values(index).map(|value| value.map_or("nothing".to_owned(), bits));
        Some(self.differs(rows[0], field, values))
    }

    fn differs(&self, row: &S::Row, part: &str, values: [String; 2]) -> Difference {
        let (number, comma) = (row.number(), if part.is_empty() { "" } else { ", " });
        let what = format!("{} {} {number}{comma}{part}", self.name, S::Row::KIND);
        Difference::new(row.at(), what, values)
    }
}
