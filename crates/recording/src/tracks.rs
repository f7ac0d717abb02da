//! The recorded series of a run: tapped, and waiting to be written.

use ratelab::Time;
use ratelab_account::{Rows, TickRecord};
use rerun::{EntityPath, RecordingStream, SeriesLines};

use super::{
    columns::{self, RecordRow},
    digest::RowDigest,
    schema::{node_entity, topic_entity},
    series::Series,
    source::Source,
    timeline::{BatchStream, Written},
};

/// Capacity of a tap: minutes at 50 Hz, and more than any real clock produces within the
/// 50 ms between two checks.
pub const BACKLOG: usize = 16_384;

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

    /// Removes and returns the waiting rows up to run time `until`.
    pub fn take(&mut self, until: Time) -> S {
        let rows = self.waiting.take_until(until);
        self.written += rows.rows().len() as u64;
        rows
    }

    /// Writes `series`, and adds it to `digest`.
    pub fn write(&self, stream: &BatchStream, series: &S, digest: &mut RowDigest) -> Written {
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
    pub fn begin(&self, rec: &RecordingStream, source: &Source) -> Written {
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

    /// Number of items waiting to be written.
    pub fn waiting(&self) -> usize {
        let nodes = self.nodes.iter().map(|track| track.waiting.len());
        nodes
            .chain(self.topics.iter().map(|track| track.waiting.len()))
            .sum()
    }

    /// Number of items lost because a tap was full.
    pub fn lost(&self) -> u64 {
        let nodes = self.nodes.iter().map(|track| track.tap.lost());
        nodes
            .chain(self.topics.iter().map(|track| track.tap.lost()))
            .sum()
    }

    /// Run time of the newest waiting item.
    pub fn newest(&self) -> Option<Time> {
        let nodes = self.nodes.iter().map(|track| track.waiting.newest());
        let topics = self.topics.iter().map(|track| track.waiting.newest());
        nodes.chain(topics).flatten().max()
    }
}
