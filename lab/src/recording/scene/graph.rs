//! The node graph: who publishes what to whom, at what rate and depth.

use std::collections::VecDeque;

use ratelab::{Command, Event, Knob};
use ratelab_account::Snapshot;
use rerun::{AsComponents, Color, GraphEdges, GraphNodes, RecordingStream, RecordingStreamResult};

use super::palette::{BLUE, ORANGE};
use crate::recording::{plant_steps::PlantSteps, timeline::Stamps};

/// The node graph.
pub const GRAPH: &str = "graph";

/// Distance between two columns, and between rows.
const COLUMN: f32 = 85.0;
const ROW: f32 = 90.0;

/// How much lower topics are than nodes, so that labels have room.
const TOPICS_BELOW: f32 = 60.0;

/// Nodes and topics, and what is between them.
pub struct GraphScene {
    /// Nodes first, then topics.
    vertices: Vec<Vertex>,
    /// Who leads to whom, as indices of vertices.
    edges: Vec<(usize, usize)>,
    nodes: usize,
}

/// A node or a topic.
struct Vertex {
    name: String,
    /// Rate or depth.
    setting: String,
    place: [f32; 2],
}

impl GraphScene {
    /// The graph as it is at the beginning.
    pub fn new(snapshot: &Snapshot) -> Self {
        let vertex = |name: &str, setting: String| Vertex {
            name: name.to_owned(),
            setting,
            place: [0.0; 2],
        };
        let nodes = snapshot.nodes.iter();
        let nodes = nodes.map(|node| vertex(&node.name, node.hz.to_string()));
        let topics = snapshot.topics.iter();
        let topics = topics.map(|topic| vertex(&topic.name, depth(topic.depth.get())));
        let first = snapshot.nodes.len();
        let mut edges = Vec::new();
        for (index, topic) in snapshot.topics.iter().enumerate() {
            let readers = topic.readers.iter().map(|reader| reader.node);
            edges.extend(topic.publishers.iter().map(|&node| (node, first + index)));
            edges.extend(readers.map(|node| (first + index, node)));
        }
        let mut graph = Self {
            vertices: nodes.chain(topics).collect(),
            edges,
            nodes: first,
        };
        graph.place();
        graph
    }

    /// Every vertex right of those that lead to it, the first of a column on top.
    fn place(&mut self) {
        let columns = self.columns();
        let mut taken = VecDeque::from(vec![0; self.vertices.len() + 1]);
        for (index, vertex) in self.vertices.iter_mut().enumerate() {
            let column = columns[index];
            let below = if index < self.nodes {
                0.0
            } else {
                TOPICS_BELOW
            };
            vertex.place = [COLUMN * column as f32, ROW * taken[column] as f32 + below];
            taken[column] += 1;
        }
    }

    /// The column of each vertex: the longest way to it, loops aside.
    fn columns(&self) -> Vec<usize> {
        let mut columns = vec![0; self.vertices.len()];
        for _ in 0..self.vertices.len() {
            for &(from, to) in &self.edges {
                let right = columns[from] + 1;
                if right > columns[to] && right < self.vertices.len() {
                    columns[to] = right;
                }
            }
        }
        columns
    }

    /// Logs the graph at the beginning.
    pub fn begin(&self, rec: &RecordingStream, stamps: &Stamps) -> RecordingStreamResult<()> {
        let names = |&(from, to): &(usize, usize)| {
            let name = |vertex: usize| self.vertices[vertex].name.as_str();
            (name(from), name(to))
        };
        let edges = GraphEdges::new(self.edges.iter().map(names));
        let edges = edges.with_directed_edges();
        let colours = (0..self.vertices.len()).map(|vertex| self.colour(vertex));
        let nodes = GraphNodes::new(self.vertices.iter().map(|vertex| vertex.name.as_str()))
            .with_colors(colours)
            .with_positions(self.vertices.iter().map(|vertex| vertex.place))
            .with_show_labels(true);
        rec.log_static(GRAPH, &[&edges as &dyn AsComponents, &nodes])?;
        self.log(rec, stamps, self.labels().collect())
    }

    /// Logs the graph again after each of `events` that changed it, in one column.
    pub fn add(
        &mut self,
        rec: &RecordingStream,
        progress: &PlantSteps,
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
        let (name, setting) = match event.applied() {
            Some(Command::Set(Knob::Rate { node, hz })) => (node, hz.to_string()),
            Some(Command::Set(Knob::Depth { topic, depth: deep })) => (topic, depth(deep.get())),
            _ => return false,
        };
        let vertex = self.vertices.iter_mut().find(|vertex| vertex.name == *name);
        vertex.is_some_and(|vertex| {
            vertex.setting = setting;
            true
        })
    }

    /// The labels of the vertices now.
    fn labels(&self) -> impl Iterator<Item = String> {
        let vertices = self.vertices.iter();
        vertices.map(|vertex| format!("{}\n{}", vertex.name, vertex.setting))
    }

    /// Logs `labels`, those of all vertices for each row.
    fn log(
        &self,
        rec: &RecordingStream,
        stamps: &Stamps,
        labels: Vec<String>,
    ) -> RecordingStreamResult<()> {
        if stamps.is_empty() {
            return Ok(());
        }
        let rows = std::iter::repeat_n(self.vertices.len(), stamps.len());
        let labels = GraphNodes::update_fields().with_labels(labels);
        rec.send_columns(GRAPH, stamps.columns(), labels.columns(rows)?)
    }

    fn colour(&self, vertex: usize) -> Color {
        if vertex < self.nodes { BLUE } else { ORANGE }
    }
}

fn depth(depth: usize) -> String {
    format!("depth {depth}")
}
