//! The gaps between columns that a topic passes through, for any width of them.
//!
//! Gap *g* is left of column *g*; the last one is right of all columns. A topic leaves a
//! publisher into the gap to its right and reaches a reader from the gap to its left. If
//! both are the same gap, that is the whole route. Otherwise the topic runs below all
//! boxes from gap to gap, in a lane: so do topics that skip a column and topics that lead
//! back.

use super::text::width;
use crate::frame::FrameData;

/// The route of a topic.
#[derive(Debug)]
pub(super) struct Route {
    /// Index of the topic.
    pub(super) topic: usize,
    /// Visible publishers.
    pub(super) publishers: Vec<usize>,
    /// Visible readers.
    pub(super) readers: Vec<usize>,
    /// Number of the lane below the boxes, if one is needed.
    pub(super) lane: Option<usize>,
    /// The gaps it passes through, in order.
    pub(super) gaps: Vec<usize>,
}

impl Route {
    /// Returns whether it dangles: its other end is not drawn.
    pub(super) fn dangles(&self) -> bool {
        self.readers.is_empty()
    }

    /// Returns whether it may go up or down in its gaps.
    fn bends(&self) -> bool {
        self.lane.is_some() || self.publishers.len() + self.readers.len() > 1
    }
}

/// The routes of all topics between the visible columns.
#[derive(Debug, Default)]
pub(super) struct Routes {
    /// One for each topic of a visible publisher.
    pub(super) all: Vec<Route>,
    /// Number of lanes below the boxes.
    pub(super) lanes: usize,
    /// Number of columns.
    columns: usize,
}

impl Routes {
    /// Finds the routes through `columns`.
    pub(super) fn find(frame: &FrameData, columns: &[Vec<usize>]) -> Self {
        let mut column = vec![None; frame.nodes.len()];
        for (number, members) in columns.iter().enumerate() {
            members.iter().for_each(|node| column[*node] = Some(number));
        }
        let mut routes = Self {
            columns: columns.len(),
            ..Self::default()
        };
        for (topic, view) in frame.topics.iter().enumerate() {
            let publishers = shown(&view.publishers, &column);
            let readers = shown(&view.readers, &column);
            if publishers.is_empty() {
                continue;
            }
            let exits = publishers.iter().filter_map(|n| column[*n]).map(|c| c + 1);
            let entries = readers.iter().filter_map(|n| column[*n]);
            let mut gaps: Vec<usize> = exits.chain(entries).collect();
            gaps.sort_unstable();
            gaps.dedup();
            routes.all.push(Route {
                topic,
                publishers,
                readers,
                lane: None,
                gaps,
            });
        }
        routes.assign_lanes();
        routes
    }

    /// Assigns to each topic that needs a lane the first one that is free along its whole
    /// route.
    fn assign_lanes(&mut self) {
        let mut wide: Vec<&mut Route> = self
            .all
            .iter_mut()
            .filter(|r| r.gaps.len() > 1 && !r.dangles())
            .collect();
        wide.sort_by_key(|route| route.gaps[0]);
        // The end of the occupied part of each lane.
        let mut ends: Vec<usize> = Vec::new();
        for route in wide {
            let (first, last) = (route.gaps[0], route.gaps[route.gaps.len() - 1]);
            let free = ends.iter().position(|end| *end < first);
            let lane = free.unwrap_or(ends.len());
            match free {
                Some(lane) => ends[lane] = last,
                None => ends.push(last),
            }
            route.lane = Some(lane);
        }
        self.lanes = ends.len();
    }

    /// Removes topics that need more than `most` lanes.
    pub(super) fn keep_lanes(&mut self, most: usize) {
        self.lanes = self.lanes.min(most);
        self.all
            .retain(|route| route.lane.is_none_or(|lane| lane < most));
    }

    /// Returns the topics that go up or down in gap `gap`.
    pub(super) fn bends_in(&self, gap: usize) -> usize {
        self.all
            .iter()
            .filter(|r| r.bends() && !r.dangles())
            .filter(|route| route.gaps.contains(&gap))
            .count()
    }

    /// Returns the maximum number of topics that go up or down in any gap between columns.
    pub(super) fn most_bends(&self) -> usize {
        let bends = (1..self.columns).map(|gap| self.bends_in(gap));
        // A topic alone in a gap may go straight.
        bends.filter(|bends| *bends > 1).max().unwrap_or(0)
    }

    /// Columns needed left and right of all boxes for topics that lead back.
    pub(super) fn margins(&self) -> [usize; 2] {
        [0, self.columns].map(|gap| match self.bends_in(gap) {
            0 => 0,
            bends => 2 * bends + 1,
        })
    }
}

/// Returns the length of a dangling edge with its name.
pub(super) fn dangling_width(name: &str) -> usize {
    width(name) + 4
}

/// Returns the length of such a line in `room` columns: with its name, with or without blanks
/// around it, or without.
pub(super) fn dangling_length(name: &str, room: usize) -> Option<usize> {
    let full = dangling_width(name);
    match room {
        0..2 => None,
        _ if room >= full => Some(full),
        _ if room >= full - 2 => Some(full - 2),
        _ => Some(room.min(4)),
    }
}

fn shown(nodes: &[usize], column: &[Option<usize>]) -> Vec<usize> {
    let mut nodes: Vec<usize> = nodes.to_vec();
    nodes.retain(|node| column.get(*node).copied().flatten().is_some());
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
