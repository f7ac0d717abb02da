//! The order of nodes: layers from sources to sinks.

use std::collections::VecDeque;

use crate::frame::FrameData;

/// Returns the nodes of `frame` by layer: a node is one layer behind the last of its publishers.
/// Within a layer, a node is at about the height of its publishers, so that few lines cross.
///
/// In a cycle of nodes, the one that was added first comes first.
pub(super) fn layers(frame: &FrameData) -> Vec<Vec<usize>> {
    let flow = Layering::new(frame);
    let depths = flow.depths();
    let count = depths.iter().max().map_or(0, |deepest| deepest + 1);
    let mut layers = vec![Vec::new(); count];
    for (node, depth) in depths.iter().enumerate() {
        layers[*depth].push(node);
    }
    layers.retain(|layer| !layer.is_empty());
    flow.sort(&mut layers);
    layers
}

/// Nodes and topics as one graph: first all nodes, then all topics. Without vertices of
/// its own, a topic with many publishers and readers would be an edge for each pair of
/// them.
struct Layering {
    nodes: usize,
    into: Vec<Vec<usize>>,
    out: Vec<Vec<usize>>,
}

impl Layering {
    fn new(frame: &FrameData) -> Self {
        let nodes = frame.nodes.len();
        let all = nodes + frame.topics.len();
        let mut flow = Self {
            nodes,
            into: vec![Vec::new(); all],
            out: vec![Vec::new(); all],
        };
        for (topic, vertex) in frame.topics.iter().zip(nodes..) {
            for publisher in topic.publishers.iter().filter(|n| **n < nodes) {
                flow.join(*publisher, vertex);
            }
            // A topic without publishers is not an edge.
            if !flow.into[vertex].is_empty() {
                for reader in topic.readers.iter().filter(|n| **n < nodes) {
                    flow.join(vertex, *reader);
                }
            }
        }
        flow
    }

    fn join(&mut self, from: usize, to: usize) {
        self.out[from].push(to);
        self.into[to].push(from);
    }

    /// Returns the layer of each node: the longest path from a source.
    fn depths(&self) -> Vec<usize> {
        let all = self.into.len();
        let mut waiting: Vec<usize> = self.into.iter().map(Vec::len).collect();
        let mut depths = vec![0; all];
        let mut placed = vec![false; all];
        let mut ready: VecDeque<usize> = (0..all).filter(|v| waiting[*v] == 0).collect();
        let mut first = 0;
        loop {
            while let Some(vertex) = ready.pop_front() {
                placed[vertex] = true;
                for next in self.out[vertex].iter().copied().filter(|v| !placed[*v]) {
                    let step = usize::from(next < self.nodes);
                    depths[next] = depths[next].max(depths[vertex] + step);
                    waiting[next] -= 1;
                    if waiting[next] == 0 {
                        ready.push_back(next);
                    }
                }
            }
            while first < self.nodes && placed[first] {
                first += 1;
            }
            if first == self.nodes {
                break;
            }
            ready.push_back(self.on_circle(first, &placed));
        }
        depths.truncate(self.nodes);
        depths
    }

    /// Returns the first node of a cycle that `start` depends on, directly or indirectly.
    fn on_circle(&self, start: usize, placed: &[bool]) -> usize {
        let before = |v: usize| self.into[v].iter().copied().find(|u| !placed[*u]);
        let mut seen = vec![false; self.into.len()];
        let mut at = start;
        while !seen[at] {
            seen[at] = true;
            match before(at) {
                Some(source) => at = source,
                None => return start,
            }
        }
        let (end, mut first) = (at, usize::MAX);
        loop {
            first = first.min(at);
            match before(at) {
                Some(source) if source != end => at = source,
                _ => break first,
            }
        }
    }

    /// Sorts each layer by the mean position of the sources of its nodes.
    fn sort(&self, layers: &mut [Vec<usize>]) {
        let mut height: Vec<Option<f64>> = vec![None; self.nodes];
        for layer in layers {
            let rows = layer.len();
            let mut wanted: Vec<(f64, usize)> = layer
                .iter()
                .enumerate()
                .map(|(row, node)| {
                    let wanted = self.source_height(*node, &height);
                    (wanted.unwrap_or(relative(row, rows)), *node)
                })
                .collect();
            wanted.sort_by(|(a, n), (b, m)| a.total_cmp(b).then(n.cmp(m)));
            for (row, (_, node)) in wanted.into_iter().enumerate() {
                layer[row] = node;
                height[node] = Some(relative(row, rows));
            }
        }
    }

    fn source_height(&self, node: usize, height: &[Option<f64>]) -> Option<f64> {
        let sources = self.into[node].iter().flat_map(|topic| &self.into[*topic]);
        let known: Vec<f64> = sources.filter_map(|source| height[*source]).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    }
}

/// Returns the position of row `row` out of `rows`, from 0 (top) to 1.
fn relative(row: usize, rows: usize) -> f64 {
    (row as f64 + 0.5) / rows as f64
}

#[cfg(test)]
mod tests {
    use super::layers;
    use crate::view::sample;

    #[test]
    fn follows_the_messages() {
        assert_eq!(layers(&sample::balanced()), [[0], [1], [2]]);
        let fan_out = layers(&sample::fan_out());
        assert_eq!(fan_out, [vec![0, 1], vec![2], vec![3], vec![4]]);
        assert_eq!(layers(&sample::frame_data(vec![], vec![])).len(), 0);
    }

    #[test]
    fn a_circle_begins_with_the_node_added_first() {
        let node = |name| sample::node(name, 50.0, 1, false);
        let nodes = ["sink", "plant", "logic", "alone"].map(node).to_vec();
        let topics = vec![
            sample::topic("/state", 1.0, 1, &[1], &[2, 1]),
            sample::topic("/action", 1.0, 1, &[2], &[1, 0]),
            sample::topic("/nobody", 1.0, 1, &[], &[2]),
        ];
        let frame = sample::frame_data(nodes, topics);
        assert_eq!(layers(&frame), [vec![1, 3], vec![2], vec![0]]);
    }

    #[test]
    fn indices_of_nothing_are_ignored() {
        let topics = vec![sample::topic("/t", 1.0, 1, &[0, 7], &[9])];
        let frame = sample::frame_data(vec![sample::node("a", 1.0, 1, true)], topics);
        assert_eq!(layers(&frame), [[0]]);
    }
}
