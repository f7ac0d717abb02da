//! The node graph: who publishes what to whom, at what rate and depth.

use ratelab::{Command, Event, Knob, Time};
use ratelab_metrics::Snapshot;
use rerun::{AsComponents, Color, GraphEdges, GraphNodes};

use super::lines::{BLUE, ORANGE};
use crate::rrd::timeline::{BatchStream, Written};

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
}

/// A node or a topic.
struct Vertex {
    name: String,
    /// Rate or depth.
    setting: String,
    colour: Color,
    place: [f32; 2],
}

impl GraphScene {
    /// Creates the graph as it is at the beginning: every vertex right of the vertices that lead to
    /// it, the first of a column on top.
    pub fn new(snapshot: &Snapshot) -> Self {
        let (first, mut edges) = (snapshot.nodes.len(), Vec::new());
        for (topic, index) in snapshot.topics.iter().zip(first..) {
            let readers = topic.readers.iter().map(|reader| reader.node);
            edges.extend(topic.publishers.iter().map(|&node| (node, index)));
            edges.extend(readers.map(|node| (index, node)));
        }
        let nodes = snapshot
            .nodes
            .iter()
            .map(|node| (&node.name, node.hz.to_string(), BLUE, 0.0));
        let topics = snapshot
            .topics
            .iter()
            .map(|topic| (&topic.name, depth(topic.depth.get()), ORANGE, TOPICS_BELOW));
        let columns = columns(&edges, first + snapshot.topics.len());
        let mut rows = vec![0.0; columns.len()];
        let vertices =
            nodes
                .chain(topics)
                .zip(columns)
                .map(|((name, setting, colour, below), column)| {
                    let place = [COLUMN * column as f32, ROW * rows[column] + below];
                    rows[column] += 1.0;
                    Vertex {
                        name: name.to_string(),
                        setting,
                        colour,
                        place,
                    }
                });
        Self {
            vertices: vertices.collect(),
            edges,
        }
    }

    /// Logs the graph at the beginning.
    pub fn begin(&self, stream: &BatchStream) -> Written {
        let names = |&(from, to): &(usize, usize)| {
            let name = |vertex: usize| self.vertices[vertex].name.as_str();
            (name(from), name(to))
        };
        let edges = GraphEdges::new(self.edges.iter().map(names)).with_directed_edges();
        let nodes = GraphNodes::new(self.vertices.iter().map(|vertex| vertex.name.as_str()))
            .with_colors(self.vertices.iter().map(|vertex| vertex.colour))
            .with_positions(self.vertices.iter().map(|vertex| vertex.place))
            .with_show_labels(true);
        stream
            .rec
            .log_static(GRAPH, &[&edges as &dyn AsComponents, &nodes])?;
        self.log(stream, &[Time::ZERO], self.labels().collect())
    }

    /// Logs the graph again after each of `events` that changed it, in one column.
    pub fn add(&mut self, stream: &BatchStream, events: &[Event]) -> Written {
        let (mut times, mut labels) = (Vec::new(), Vec::new());
        for event in events {
            if self.change(event) {
                times.push(event.at);
                labels.extend(self.labels());
            }
        }
        self.log(stream, &times, labels)
    }

    fn change(&mut self, event: &Event) -> bool {
        let (name, setting) = match event.applied() {
            Some(Command::Set(Knob::Rate { node, hz })) => (node, hz.to_string()),
            Some(Command::Set(Knob::Depth { topic, depth: deep })) => (topic, depth(deep.get())),
            _ => return false,
        };
        let vertex = self.vertices.iter_mut().find(|vertex| vertex.name == *name);
        vertex.map(|vertex| vertex.setting = setting).is_some()
    }

    /// Returns the labels of the vertices now.
    fn labels(&self) -> impl Iterator<Item = String> {
        self.vertices
            .iter()
            .map(|vertex| format!("{}\n{}", vertex.name, vertex.setting))
    }

    /// Logs `labels` of all vertices for each row.
    fn log(&self, stream: &BatchStream, times: &[Time], labels: Vec<String>) -> Written {
        let rows = std::iter::repeat_n(self.vertices.len(), times.len());
        let labels = GraphNodes::update_fields().with_labels(labels);
        stream.send(GRAPH, times, labels.columns(rows)?)
    }
}

/// Returns the column of each of `count` vertices: the longest way to it, loops aside.
fn columns(edges: &[(usize, usize)], count: usize) -> Vec<usize> {
    let mut columns = vec![0; count];
    for _ in 0..count {
        for &(from, to) in edges {
            let right = columns[from] + 1;
            if right > columns[to] && right < count {
                columns[to] = right;
            }
        }
    }
    columns
}

fn depth(depth: usize) -> String {
    format!("depth {depth}")
}
