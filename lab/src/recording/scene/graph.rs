//! The node graph: who publishes what to whom, at what rate and depth.

use std::collections::VecDeque;

use ratelab::runtime::{
    Command, Snapshot,
    telemetry::{Event, Happening},
};
use rerun::{AsComponents, Color, GraphEdges, GraphNodes, RecordingStream, RecordingStreamResult};

use super::palette::{BLUE, ORANGE};
use crate::recording::{progress::Progress, timeline::Stamps};

/// The node graph.
pub const GRAPH: &str = "graph";

/// Distance between two columns, and between rows.
const COLUMN: f32 = 85.0;
const ROW: f32 = 90.0;

/// How much lower topics are than nodes, so that labels have room.
const TOPICS_BELOW: f32 = 60.0;

/// Nodes and topics, and what is between them.
pub struct Wires {
    /// Nodes first, then topics.
    corners: Vec<Corner>,
    /// Who leads to whom, as indices of corners.
    edges: Vec<(usize, usize)>,
    nodes: usize,
}

/// A node or a topic.
struct Corner {
    name: String,
    /// Rate or depth.
    setting: String,
    place: [f32; 2],
}

impl Wires {
    /// The graph as it is at the beginning.
    pub fn new(snapshot: &Snapshot) -> Self {
        let corner = |name: &str, setting: String| Corner {
            name: name.to_owned(),
            setting,
            place: [0.0; 2],
        };
        let nodes = snapshot.nodes.iter();
        let nodes = nodes.map(|node| corner(&node.name, node.hz.to_string()));
        let topics = snapshot.topics.iter();
        let topics = topics.map(|topic| corner(&topic.name, depth(topic.depth)));
        let first = snapshot.nodes.len();
        let mut edges = Vec::new();
        for (index, topic) in snapshot.topics.iter().enumerate() {
            let readers = topic.subscriptions.iter().map(|reader| reader.node);
            edges.extend(topic.publishers.iter().map(|&node| (node, first + index)));
            edges.extend(readers.map(|node| (first + index, node)));
        }
        let mut wires = Self {
            corners: nodes.chain(topics).collect(),
            edges,
            nodes: first,
        };
        wires.place();
        wires
    }

    /// Every corner right of those that lead to it, the first of a column on top.
    fn place(&mut self) {
        let columns = self.columns();
        let mut taken = VecDeque::from(vec![0; self.corners.len() + 1]);
        for (index, corner) in self.corners.iter_mut().enumerate() {
            let column = columns[index];
            let below = if index < self.nodes {
                0.0
            } else {
                TOPICS_BELOW
            };
            corner.place = [COLUMN * column as f32, ROW * taken[column] as f32 + below];
            taken[column] += 1;
        }
    }

    /// The column of each corner: the longest way to it, loops aside.
    fn columns(&self) -> Vec<usize> {
        let mut columns = vec![0; self.corners.len()];
        for _ in 0..self.corners.len() {
            for &(from, to) in &self.edges {
                let right = columns[from] + 1;
                if right > columns[to] && right < self.corners.len() {
                    columns[to] = right;
                }
            }
        }
        columns
    }

    /// Logs how the graph is to begin with.
    pub fn begin(&self, rec: &RecordingStream, stamps: &Stamps) -> RecordingStreamResult<()> {
        let names = |&(from, to): &(usize, usize)| {
            let name = |corner: usize| self.corners[corner].name.as_str();
            (name(from), name(to))
        };
        let edges = GraphEdges::new(self.edges.iter().map(names));
        let edges = edges.with_directed_edges();
        let colours = (0..self.corners.len()).map(|corner| self.colour(corner));
        let nodes = GraphNodes::new(self.corners.iter().map(|corner| corner.name.as_str()))
            .with_colors(colours)
            .with_positions(self.corners.iter().map(|corner| corner.place))
            .with_show_labels(true);
        rec.log_static(GRAPH, &[&edges as &dyn AsComponents, &nodes])?;
        self.log(rec, stamps, self.labels().collect())
    }

    /// Logs the graph again after each of `events` that changed it, in one column.
    pub fn add(
        &mut self,
        rec: &RecordingStream,
        progress: &Progress,
        events: &[Event],
    ) -> RecordingStreamResult<()> {
        let mut stamps = progress.stamps();
        let mut labels = Vec::new();
        for event in events {
            if self.change(event) {
                stamps.push(event.at, progress.step_at(event.at));
                labels.extend(self.labels());
            }
        }
        self.log(rec, &stamps, labels)
    }

    fn change(&mut self, event: &Event) -> bool {
        let Happening::Applied { command, .. } = &event.what else {
            return false;
        };
        let (name, setting) = match command {
            Command::SetRate { node, hz } => (node, hz.to_string()),
            Command::SetDepth { topic, depth: deep } => (topic, depth(deep.get())),
            _ => return false,
        };
        let corner = self.corners.iter_mut().find(|corner| corner.name == *name);
        corner.is_some_and(|corner| {
            corner.setting = setting;
            true
        })
    }

    /// What stands at the corners now.
    fn labels(&self) -> impl Iterator<Item = String> {
        let corners = self.corners.iter();
        corners.map(|corner| format!("{}\n{}", corner.name, corner.setting))
    }

    /// Logs `labels`, those of all corners for each row.
    fn log(
        &self,
        rec: &RecordingStream,
        stamps: &Stamps,
        labels: Vec<String>,
    ) -> RecordingStreamResult<()> {
        if stamps.is_empty() {
            return Ok(());
        }
        let rows = std::iter::repeat_n(self.corners.len(), stamps.len());
        let labels = GraphNodes::update_fields().with_labels(labels);
        rec.send_columns(GRAPH, stamps.columns(), labels.columns(rows)?)
    }

    fn colour(&self, corner: usize) -> Color {
        if corner < self.nodes { BLUE } else { ORANGE }
    }
}

fn depth(depth: usize) -> String {
    format!("depth {depth}")
}
