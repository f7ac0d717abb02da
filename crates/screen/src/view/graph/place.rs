//! The layout: columns of boxes, the gaps between them, and the hidden nodes.

use ratatui::layout::{Rect, Size};

use super::{
    layers::layers,
    list::{self, NARROW},
    route::{Route, Routes, dangling_width},
    text::width,
};
use crate::{frame::FrameData, view::sheet::clamp};

/// Minimum width of a box: room for a rate.
const MIN_BOX: usize = 8;
/// Minimum length of a line: an end, a bend and an arrow.
const MIN_GAP: usize = 3;
/// Maximum width for names; longer ones are cut.
const LONGEST_NAME: usize = 16;
/// Minimum length of a line with figures side by side.
const WIDE_GAP: usize = 20;
/// Maximum space between the boxes of a column.
const MAX_SPACE: usize = 3;

/// A box.
#[derive(Debug)]
pub(super) struct PlacedBox {
    /// Index of the node.
    pub(super) node: usize,
    /// Number of its column.
    pub(super) column: usize,
    /// Its place, relative to the corner of the pane's inside.
    pub(super) rect: Rect,
}

/// An end of a topic at a box.
#[derive(Debug)]
pub(super) struct Port {
    /// Index of the topic.
    pub(super) topic: usize,
    /// Index of the node.
    pub(super) node: usize,
    /// Number of the gap.
    pub(super) gap: usize,
    /// The row.
    pub(super) row: u16,
}

/// The places of everything.
#[derive(Debug, Default)]
pub(super) struct GraphLayout {
    /// The visible nodes.
    pub(super) boxes: Vec<PlacedBox>,
    /// The routes of the visible topics.
    pub(super) routes: Routes,
    /// Where they leave their publishers.
    pub(super) exits: Vec<Port>,
    /// Where they reach their readers.
    pub(super) entries: Vec<Port>,
    /// First column and end of each gap.
    pub(super) gaps: Vec<[u16; 2]>,
    /// Row of the first lane.
    pub(super) lanes: u16,
    /// Whether gaps are wide enough for text on lines.
    pub(super) roomy: bool,
    /// First row below boxes and lanes.
    pub(super) bottom: u16,
    /// Number of hidden nodes.
    pub(super) hidden: usize,
}

impl GraphLayout {
    /// Lays out `frame` in an area of `size`.
    pub(super) fn new(frame: &FrameData, size: Size) -> Self {
        let room = [size.width, size.height].map(usize::from);
        let plan = AreaPlan::best(frame, &layers(frame), room);
        let nothing = Self {
            hidden: frame.nodes.len(),
            ..Self::default()
        };
        plan.map_or(nothing, |plan| plan.lay_out(frame, room))
    }
}

/// Returns the ends of `routes` at `boxes`. The topics of a box share the rows inside it, from the
/// top.
fn ports(boxes: &[PlacedBox], routes: &Routes, leaving: bool) -> Vec<Port> {
    let ports = boxes.iter().flat_map(|placed| {
        let is_here = |route: &&Route| {
            if leaving {
                route.publishers.contains(&placed.node)
            } else {
                route.readers.contains(&placed.node)
            }
        };
        let mut there: Vec<&Route> = routes.all.iter().filter(is_here).collect();
        // Topics with a lane come last, as lanes are at the bottom.
        there.sort_by_key(|route| (route.lane.is_some(), route.dangles()));
        let (rect, count) = (placed.rect, there.len());
        let rows = usize::from(rect.height.saturating_sub(2)).max(1);
        let first = rect.y + u16::from(rect.height > 2);
        there
            .into_iter()
            .enumerate()
            .map(move |(order, route)| Port {
                topic: route.topic,
                node: placed.node,
                gap: placed.column + usize::from(leaving),
                row: first + clamp(order * rows / count),
            })
    });
    ports.collect()
}

/// A way to use the area.
#[derive(Debug)]
struct AreaPlan {
    columns: Vec<Vec<usize>>,
    routes: Routes,
    look: BoxLook,
    /// Rows at the bottom for a list of topics.
    list: usize,
}

/// Sizes to choose from.
#[derive(Clone, Copy, Debug)]
struct BoxLook {
    /// Width of boxes if there is room, and the minimum.
    width: [usize; 2],
    height: usize,
    /// Minimum width of gaps.
    gap: usize,
    /// Whether lines have text; otherwise topics are listed.
    roomy: bool,
}

/// The looks from the most spacious to the tightest: the least width of a box, the columns
/// beside its name, the minimum width of gaps, and the height of a box.
const LOOKS: [[usize; 4]; 7] = [
    [18, 4, WIDE_GAP, 4],
    [15, 4, NARROW + 2, 4],
    [18, 4, WIDE_GAP, 3],
    [15, 4, NARROW + 2, 3],
    [15, 4, MIN_GAP, 4],
    [10, 2, MIN_GAP, 3],
    [0, 12, MIN_GAP, 1],
];

impl BoxLook {
    /// Creates a look for names of some width.
    fn new([least, beside, gap, height]: [usize; 4], name: usize) -> Self {
        let (width, roomy) = (least.max(name + beside), gap > MIN_GAP);
        Self {
            width: [width, if roomy { width } else { MIN_BOX }],
            height,
            gap,
            roomy,
        }
    }
}

impl AreaPlan {
    /// Finds the most spacious plan that shows everything, or else the one that shows most.
    fn best(frame: &FrameData, layers: &[Vec<usize>], room: [usize; 2]) -> Option<Self> {
        if layers.is_empty() || room[0] < MIN_BOX || room[1] == 0 {
            return None;
        }
        let name = frame
            .nodes
            .iter()
            .map(|node| width(&node.name))
            .max()
            .unwrap_or(0)
            .min(LONGEST_NAME);
        let captions = frame.nodes.iter().filter_map(|node| node.caption);
        let caption = captions.map(width).max();
        // With a row for captions, or for the verbs of captions.
        let captioned =
            caption.map(|caption| [[caption + 6, 4, WIDE_GAP, 5], [15, 4, NARROW + 2, 5]]);
        let looks = captioned.into_iter().flatten().chain(LOOKS);
        for look in looks.filter(|_| layers.len() <= room[0]) {
            let look = BoxLook::new(look, name);
            let mut plan = Self::new(frame, layers.to_vec(), look);
            if !look.roomy {
                plan.list = list::rows(frame, &plan.routes, room[0]);
            }
            if plan.fits(room) {
                return Some(plan);
            }
        }
        let parts = LOOKS[5..]
            .iter()
            .filter_map(|look| Self::part(frame, layers, BoxLook::new(*look, name), room));
        // The taller one comes first and wins a tie.
        parts.reduce(|a, b| if b.shown() > a.shown() { b } else { a })
    }

    fn new(frame: &FrameData, columns: Vec<Vec<usize>>, look: BoxLook) -> Self {
        Self {
            routes: Routes::find(frame, &columns),
            columns,
            look,
            list: 0,
        }
    }

    /// As much of the graph as fits, from the sources on.
    fn part(
        frame: &FrameData,
        layers: &[Vec<usize>],
        look: BoxLook,
        room: [usize; 2],
    ) -> Option<Self> {
        let most = (room[0] + look.gap) / (MIN_BOX + look.gap);
        (1..=most).rev().find_map(|count| {
            let rows = room[1] / look.height;
            let mut plan = Self::new(frame, columns(layers, count, rows), look);
            let lanes = plan.routes.lanes.min(room[1] / 2);
            if plan.tallest() * look.height + lanes > room[1] {
                let rows = (room[1] - lanes) / look.height;
                plan = Self::new(frame, columns(layers, count, rows), look);
            }
            plan.routes
                .keep_lanes(room[1].saturating_sub(plan.tallest() * look.height));
            let wanted = list::rows(frame, &plan.routes, room[0]);
            plan.list = wanted.min(room[1].saturating_sub(plan.rows()));
            (plan.shown() > 0 && plan.fits(room)).then_some(plan)
        })
    }

    fn shown(&self) -> usize {
        self.columns.iter().map(Vec::len).sum()
    }

    fn tallest(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Minimum number of rows for boxes and lanes.
    fn rows(&self) -> usize {
        self.tallest() * self.look.height + self.routes.lanes
    }

    fn least_gap(&self) -> usize {
        self.look.gap + 2 * self.routes.most_bends()
    }

    /// Columns left for boxes and gaps.
    fn across(&self, room: [usize; 2]) -> usize {
        room[0].saturating_sub(self.routes.margins().iter().sum())
    }

    fn fits(&self, room: [usize; 2]) -> bool {
        let count = self.columns.len();
        let least = count * self.look.width[1] + (count - 1) * self.least_gap();
        least <= self.across(room) && self.rows() + self.list <= room[1]
    }

    fn lay_out(self, frame: &FrameData, room: [usize; 2]) -> GraphLayout {
        let (width, gaps) = self.spread(frame, room);
        let height = self.look.height;
        let tallest = self.tallest();
        let spare = room[1] - self.list - self.rows();
        let space = (spare / tallest).min(MAX_SPACE);
        let stack = |count: usize| count * height + (count - 1) * space;
        let spare = spare - (tallest - 1) * space;
        let away = usize::from(self.routes.lanes > 0 && spare > 1);
        let top = (spare - away) / 2;
        let mut boxes = Vec::new();
        for (column, members) in self.columns.iter().enumerate() {
            let first = top + (stack(tallest) - stack(members.len())) / 2;
            for (row, node) in members.iter().enumerate() {
                let y = first + row * (height + space);
                let [x, y, w, h] = [gaps[column][1], y, width, height].map(clamp);
                let rect = Rect::new(x, y, w, h);
                boxes.push(PlacedBox {
                    node: *node,
                    column,
                    rect,
                });
            }
        }
        let lanes = top + stack(tallest) + away;
        GraphLayout {
            exits: ports(&boxes, &self.routes, true),
            entries: ports(&boxes, &self.routes, false),
            boxes,
            gaps: gaps.iter().map(|gap| gap.map(clamp)).collect(),
            lanes: clamp(lanes),
            roomy: self.look.roomy,
            bottom: clamp(lanes + self.routes.lanes),
            hidden: frame.nodes.len() - self.shown(),
            routes: self.routes,
        }
    }

    /// Returns the width of boxes, with the beginning and end of each gap.
    fn spread(&self, frame: &FrameData, room: [usize; 2]) -> (usize, Vec<[usize; 2]>) {
        let count = self.columns.len();
        let across = self.across(room);
        let least = (count - 1) * self.least_gap();
        let width = self.look.width[0].min((across - least) / count);
        let mut spare = across - count * width;
        let dangling = Some(self.dangling(frame))
            .filter(|dangling| spare >= least + dangling)
            .unwrap_or(0);
        spare -= dangling;
        let [left, right] = self.routes.margins();
        let mut at = left;
        let mut gaps = vec![[0, at]];
        if count == 1 {
            gaps[0][1] += spare / 2;
        }
        at = gaps[0][1] + width;
        for gap in 1..count {
            let part = spare / (count - 1) + usize::from(gap <= spare % (count - 1));
            gaps.push([at, at + part]);
            at += part + width;
        }
        gaps.push([at, (at + dangling.max(right)).min(room[0])]);
        (width, gaps)
    }

    /// Returns the width of a line out of the last column with its name.
    fn dangling(&self, frame: &FrameData) -> usize {
        let last = self.columns.len();
        self.routes
            .all
            .iter()
            .filter(|r| r.dangles() && r.gaps.contains(&last))
            .map(|r| dangling_width(&frame.topics[r.topic].name))
            .max()
            .unwrap_or(0)
    }
}

/// Spreads `layers` over at most `count` columns of at most `rows` nodes. A
/// layer with more nodes takes several columns.
fn columns(layers: &[Vec<usize>], count: usize, rows: usize) -> Vec<Vec<usize>> {
    let parts = layers.iter().flat_map(|layer| layer.chunks(rows.max(1)));
    let fitting = if rows == 0 { 0 } else { count };
    parts.take(fitting).map(<[usize]>::to_vec).collect()
}
