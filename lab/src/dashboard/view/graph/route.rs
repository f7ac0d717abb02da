//! Through which gaps between columns a topic goes, whatever their width.
//!
//! Gap *g* is the one left of column *g*; the last one is right of all. A
//! topic leaves a publisher into the gap to its right and reaches a reader from
//! the gap to its left. If that is one and the same gap, no more is needed. If
//! not, the topic runs below all boxes from gap to gap, in a lane: so do topics
//! that skip a column and topics that lead back.

use crate::dashboard::frame::FrameData;

/// The way of a topic.
#[derive(Debug)]
pub(super) struct Route {
    /// Index of the topic.
    pub(super) topic: usize,
    /// Publishers shown.
    pub(super) publishers: Vec<usize>,
    /// Readers shown.
    pub(super) readers: Vec<usize>,
    /// Number of the lane below the boxes, if one is needed.
    pub(super) lane: Option<usize>,
    /// Gaps that it touches, in order.
    pub(super) gaps: Vec<usize>,
}

impl Route {
    /// Whether it dangles: its other end is not drawn.
    pub(super) fn dangles(&self) -> bool {
        self.readers.is_empty()
    }

    /// Whether it may have to go up or down in the gaps it touches.
    fn bends(&self) -> bool {
        self.lane.is_some() || self.publishers.len() + self.readers.len() > 1
    }
}

/// The ways of all topics between the columns shown.
#[derive(Debug)]
pub(super) struct Routes {
    /// One for each topic that a node shown publishes.
    pub(super) all: Vec<Route>,
    /// How many rows below the boxes they need.
    pub(super) lanes: usize,
    /// How many columns there are.
    columns: usize,
}

impl Routes {
    /// Finds the ways through `columns`.
    pub(super) fn of(frame: &FrameData, columns: &[Vec<usize>]) -> Self {
        let column = column_of(frame.nodes.len(), columns);
        let mut routes = Self {
            all: Vec::new(),
            lanes: 0,
            columns: columns.len(),
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

    /// Gives each topic that needs a lane the first one that is free all along
    /// its way.
    fn assign_lanes(&mut self) {
        let wide = self
            .all
            .iter_mut()
            .filter(|r| r.gaps.len() > 1 && !r.dangles());
        let mut wide: Vec<&mut Route> = wide.collect();
        wide.sort_by_key(|route| route.gaps[0]);
        // Up to where each lane is taken.
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

    /// Leaves out topics that need more than `most` lanes.
    pub(super) fn keep_lanes(&mut self, most: usize) {
        self.lanes = self.lanes.min(most);
        self.all
            .retain(|route| route.lane.is_none_or(|lane| lane < most));
    }

    /// The topics that go up or down in gap `gap`.
    pub(super) fn bends_in(&self, gap: usize) -> usize {
        let here = self.all.iter().filter(|r| r.bends() && !r.dangles());
        here.filter(|route| route.gaps.contains(&gap)).count()
    }

    /// The most topics that go up or down in any gap between columns.
    pub(super) fn most_bends(&self) -> usize {
        (1..self.columns)
            .map(|gap| self.tracks(gap))
            .max()
            .unwrap_or(0)
    }

    /// How many bends have to have a place of their own in gap `gap`: a topic
    /// that has the gap for itself may well go straight.
    fn tracks(&self, gap: usize) -> usize {
        match self.bends_in(gap) {
            1 => 0,
            several => several,
        }
    }

    /// Columns needed left and right of all boxes for what leads back.
    pub(super) fn margins(&self) -> [usize; 2] {
        [0, self.columns].map(|gap| match self.bends_in(gap) {
            0 => 0,
            bends => 2 * bends + 1,
        })
    }
}

/// The column of each node; `None` for those that are not shown.
pub(super) fn column_of(nodes: usize, columns: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut column = vec![None; nodes];
    for (number, members) in columns.iter().enumerate() {
        for node in members {
            column[*node] = Some(number);
        }
    }
    column
}

fn shown(nodes: &[usize], column: &[Option<usize>]) -> Vec<usize> {
    let mut nodes: Vec<usize> = nodes.to_vec();
    nodes.retain(|node| column.get(*node).copied().flatten().is_some());
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
