//! The recorded series of a run: tapped, and waiting to be written.

use ratelab::Time;
use ratelab_account::{Rows, TickRecord};
use rerun::{EntityPath, RecordingStream, RecordingStreamResult, SeriesLines};

use super::{
    columns::{self, RecordRow},
    digest::RowDigest,
    schema::{node_entity, topic_entity},
    series::Series,
    source::Source,
    timeline::BatchStream,
};

/// Capacity of a tap: minutes at 50 Hz, and more than any real clock produces within the
/// 50 ms between two checks.
pub const BACKLOG: usize = 16_384;

/// What is in tracks.
#[derive(Default)]
pub struct TapBacklog {
    /// Number of rows waiting to be written.
    pub waiting: usize,
    /// Run time of the newest of them.
    pub newest: Option<Time>,
    /// Number of rows lost because a tap was full.
    pub lost: u64,
}

/// The messages of a topic or the ticks of a node.
pub struct Track<S: Series> {
    /// Its index in the topology.
    pub index: usize,
    /// Number of rows written.
    pub written: u64,
    entity: EntityPath,
    tap: S::Tap,
    waiting: S,
}

impl<S: Series> Track<S> {
    fn new(index: usize, entity: EntityPath, tap: S::Tap) -> Self {
        Self {
            index,
            written: 0,
            entity,
            waiting: S::of(&tap),
            tap,
        }
    }

    fn backlog(&self) -> TapBacklog {
        TapBacklog {
            waiting: self.waiting.rows().len(),
            newest: self.waiting.newest(),
            lost: S::lost(&self.tap),
        }
    }

    /// Removes and returns the waiting rows up to run time `until`.
    pub fn take(&mut self, until: Time) -> S {
        let rows = self.waiting.take_until(until);
        self.written += rows.rows().len() as u64;
        rows
    }

    /// Writes `series`, and adds it to `digest`.
    pub fn write(
        &self,
        stream: &BatchStream<'_>,
        series: &S,
        digest: &mut RowDigest,
    ) -> RecordingStreamResult<()> {
        let rows = series.rows();
        if rows.is_empty() {
            return Ok(());
        }
        for (index, row) in rows.iter().enumerate() {
            digest.add(row, series.payload(index));
        }
        let mut columns = columns::write(rows)?;
        if S::Row::HAS_PAYLOAD {
            let payloads = (0..rows.len()).flat_map(|index| series.payload(index));
            let values = payloads.copied().collect();
            columns.push(columns::series(
                values,
                series.payload(0).len(),
                rows.len(),
            )?);
        }
        let times: Vec<Time> = rows.iter().map(RecordRow::at).collect();
        stream.send(self.entity.clone(), &times, columns)
    }
}

/// Taps on all topics and nodes.
pub struct AttachedTaps {
    /// The recorded topics.
    pub topics: Vec<Track<Rows>>,
    /// All nodes.
    pub nodes: Vec<Track<Vec<TickRecord>>>,
}

impl AttachedTaps {
    /// Attaches taps to `source`.
    pub fn new(source: &Source) -> Self {
        let (taps, topology) = (&source.taps, &source.origin.topology);
        let topics = topology.topics.iter().enumerate();
        let topics = topics.filter_map(|(index, topic)| {
            let tap = taps.rows(&topic.name, BACKLOG)?;
            Some(Track::new(index, topic_entity(&topic.name), tap))
        });
        let nodes = topology.nodes.iter().zip(taps.ticks(BACKLOG)).enumerate();
        let nodes =
            nodes.map(|(index, (node, tap))| Track::new(index, node_entity(&node.name), tap));
        Self {
            topics: topics.collect(),
            nodes: nodes.collect(),
        }
    }

    /// Writes the names of the numbers in messages.
    pub fn begin(&self, rec: &RecordingStream, source: &Source) -> RecordingStreamResult<()> {
        for track in &self.topics {
            let name = &source.origin.topology.topics[track.index].name;
            let fields = source.taps.fields(name).unwrap_or_default();
            let names = SeriesLines::new().with_names(fields.iter().copied());
            rec.log_static(track.entity.clone(), &names)?;
        }
        Ok(())
    }

    /// Empties the taps; returns the largest number of items in any of them.
    pub fn drain(&mut self) -> usize {
        fn most<S: Series>(tracks: &mut [Track<S>]) -> usize {
            let drained = tracks
                .iter_mut()
                .map(|track| track.waiting.receive(&track.tap));
            drained.max().unwrap_or(0)
        }
        most(&mut self.nodes).max(most(&mut self.topics))
    }

    /// What is in the tracks.
    pub fn backlog(&self) -> TapBacklog {
        let nodes = self.nodes.iter().map(Track::backlog);
        let all = nodes.chain(self.topics.iter().map(Track::backlog));
        all.fold(TapBacklog::default(), |sum, one| TapBacklog {
            waiting: sum.waiting + one.waiting,
            newest: sum.newest.max(one.newest),
            lost: sum.lost + one.lost,
        })
    }
}
