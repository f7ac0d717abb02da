//! Topics as lines: from publishers through the gaps to the readers, with moving
//! messages.

use std::collections::{BTreeMap, VecDeque};

use ratatui::{
    buffer::Buffer,
    layout::{Position, Rect},
    style::Style,
};

use super::{
    GraphView,
    place::GraphLayout,
    route::{Route, column_of},
    text,
};
use crate::{
    dashboard::{
        frame::{FrameData, TopicData},
        view::pane,
    },
    theme::Theme,
};

/// Distance between messages on a line (cells).
const EVERY: u64 = 6;

const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const UP: u8 = 4;
const DOWN: u8 = 8;

/// A cell of a line: its directions, and its distance from a publisher.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    to: u8,
    far: u64,
}

/// The line of one topic. Cells are row and column.
#[derive(Debug)]
struct Wire {
    topic: usize,
    pieces: BTreeMap<(u16, u16), Piece>,
    starts: Vec<(u16, u16)>,
    heads: Vec<(u16, u16)>,
}

/// The lines of all topics.
#[derive(Debug)]
pub(super) struct Wires {
    wires: Vec<Wire>,
    limits: Vec<u16>,
}

impl Wires {
    /// Finds the cells of all lines.
    pub(super) fn of(frame: &FrameData, layout: &GraphLayout) -> Self {
        let router = Router::new(frame, layout);
        let routes = layout.routes.all.iter().enumerate();
        let mut wires: Vec<Wire> = routes.map(|(n, route)| router.wire(n, route)).collect();
        wires.iter_mut().for_each(Wire::measure);
        let limits = (0..layout.gaps.len()).map(|gap| router.limit(gap));
        Self {
            wires,
            limits: limits.collect(),
        }
    }

    /// The end of the straight part of lines in gap `gap`.
    pub(super) fn limit(&self, gap: usize) -> u16 {
        self.limits.get(gap).copied().unwrap_or(0)
    }

    /// Draws all lines.
    pub(super) fn draw(&self, view: GraphView<'_>, area: Rect, buf: &mut Buffer) {
        for wire in &self.wires {
            wire.draw(view.topic(wire.topic), view.theme, area, buf);
        }
    }
}

impl Wire {
    fn horizontal(&mut self, row: u16, from: u16, to: u16) {
        let (from, to) = (from.min(to), from.max(to));
        self.pieces.entry((row, from)).or_default();
        for x in from..to {
            self.pieces.entry((row, x)).or_default().to |= RIGHT;
            self.pieces.entry((row, x + 1)).or_default().to |= LEFT;
        }
    }

    fn vertical(&mut self, column: u16, from: u16, to: u16) {
        for y in from.min(to)..from.max(to) {
            self.pieces.entry((y, column)).or_default().to |= DOWN;
            self.pieces.entry((y + 1, column)).or_default().to |= UP;
        }
    }

    /// Finds the distance of each cell from the nearest publisher.
    fn measure(&mut self) {
        for piece in self.pieces.values_mut() {
            piece.far = u64::MAX;
        }
        let mut next: VecDeque<_> = self.starts.iter().map(|start| (*start, 0)).collect();
        while let Some(((y, x), far)) = next.pop_front() {
            let Some(piece) = self.pieces.get_mut(&(y, x)) else {
                continue;
            };
            if piece.far <= far {
                continue;
            }
            piece.far = far;
            let to = piece.to;
            let around = [
                (LEFT, (y, x.saturating_sub(1))),
                (RIGHT, (y, x + 1)),
                (UP, (y.saturating_sub(1), x)),
                (DOWN, (y + 1, x)),
            ];
            let there = around.into_iter().filter(|(side, _)| to & side != 0);
            next.extend(there.map(|(_, cell)| (cell, far + 1)));
        }
    }

    fn draw(&self, topic: &TopicData, theme: &Theme, area: Rect, buf: &mut Buffer) {
        let line = Style::new();
        let marks = Marks::of(self, topic);
        let mut set = |(y, x): (u16, u16), glyph: &str, style: Style| {
            let at = Position::new(area.x.saturating_add(x), area.y.saturating_add(y));
            if let Some(cell) = buf.cell_mut(at).filter(|_| area.contains(at)) {
                // Where lines cross, the vertical one is in front, so that a crossing
                // does not look like a joint.
                let below = cell.symbol() == upright(theme) && glyph == level(theme);
                if !below {
                    cell.set_symbol(glyph).set_style(style);
                }
            }
        };
        for (at, piece) in &self.pieces {
            let straight = [LEFT | RIGHT, UP | DOWN].contains(&piece.to);
            let near = straight && piece.far != u64::MAX;
            match marks.at(piece.far).filter(|_| near) {
                Some(mark) => {
                    let (glyph, style) = mark.look(theme);
                    set(*at, glyph, style);
                }
                None => set(*at, joint(piece.to, theme), line),
            }
        }
        for head in &self.heads {
            set(*head, theme.glyph("►", ">"), line);
        }
    }
}

/// A message on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WireMark {
    UnderWay,
    /// Lost on the link.
    Lost,
    /// Dropped from the queue, unread.
    Dropped,
}

impl WireMark {
    fn look(self, theme: &Theme) -> (&'static str, Style) {
        match self {
            Self::UnderWay => (theme.glyph("•", "o"), theme.active()),
            Self::Lost => (theme.glyph("◌", "?"), Style::new()),
            Self::Dropped => (theme.glyph("✖", "x"), Style::new()),
        }
    }
}

/// The messages on one line.
enum Marks<'a> {
    /// Evenly spread over the line, at the publishing rate; the recent shares of lost and
    /// dropped messages appear over its whole length.
    Stream(&'a TopicData),
    /// One position per message, by distance from the publisher.
    Transit(BTreeMap<u64, WireMark>),
}

impl<'a> Marks<'a> {
    fn of(wire: &Wire, topic: &'a TopicData) -> Self {
        let Some(dots) = &topic.dots else {
            return Self::Stream(topic);
        };
        let ways = wire.pieces.values().map(|piece| piece.far);
        let longest = ways.filter(|far| *far != u64::MAX).max().unwrap_or(0);
        let marks = dots.iter().map(|dot| {
            // Between the first cell and the head of the line.
            let far = 1 + (dot.way * longest.saturating_sub(2) as f64) as u64;
            let mark = if dot.lost {
                WireMark::Lost
            } else {
                WireMark::UnderWay
            };
            (far, mark)
        });
        Self::Transit(marks.collect())
    }

    /// The message at distance `far` from the publisher.
    fn at(&self, far: u64) -> Option<WireMark> {
        let topic = match self {
            Self::Transit(marks) => return marks.get(&far).copied(),
            Self::Stream(topic) => topic,
        };
        if topic.published == 0 || far % EVERY != topic.published % EVERY {
            return None;
        }
        let message = ((topic.published as f64 - far as f64) / EVERY as f64).floor();
        let one_of = |share: f64| {
            let by = |message: f64| (message * share).floor();
            by(message + 1.0) > by(message)
        };
        Some(match () {
            () if one_of(topic.link_loss()) => WireMark::Lost,
            () if one_of(topic.loss()) => WireMark::Dropped,
            () => WireMark::UnderWay,
        })
    }
}

/// The glyph of a horizontal line.
pub(super) fn level(theme: &Theme) -> &'static str {
    theme.glyph("─", "-")
}

fn upright(theme: &Theme) -> &'static str {
    theme.glyph("│", "|")
}

fn joint(to: u8, theme: &Theme) -> &'static str {
    const SIDES: u8 = LEFT | RIGHT;
    const ENDS: u8 = UP | DOWN;
    if to & ENDS == 0 {
        return level(theme);
    }
    if to & SIDES == 0 {
        return upright(theme);
    }
    let glyph = match (to & SIDES, to & ENDS) {
        (LEFT, DOWN) => "┐",
        (LEFT, UP) => "┘",
        (RIGHT, DOWN) => "┌",
        (RIGHT, UP) => "└",
        (LEFT, _) => "┤",
        (RIGHT, _) => "├",
        (_, DOWN) => "┬",
        (_, UP) => "┴",
        _ => "┼",
    };
    theme.glyph(glyph, "+")
}

/// One topic in one gap: the rows at which it enters and leaves.
struct WirePassage {
    route: usize,
    from: Vec<u16>,
    to: Vec<u16>,
}

/// The places of vertical lines in each gap.
struct Router<'a> {
    frame: &'a FrameData,
    layout: &'a GraphLayout,
    /// Column of each node.
    column: Vec<Option<usize>>,
    /// Column at which route number `.1` goes up or down in gap number `.0`.
    tracks: BTreeMap<(usize, usize), u16>,
}

impl<'a> Router<'a> {
    fn new(frame: &'a FrameData, layout: &'a GraphLayout) -> Self {
        let mut columns = vec![Vec::new(); layout.gaps.len()];
        for placed in &layout.boxes {
            columns[placed.column].push(placed.node);
        }
        let mut router = Self {
            frame,
            layout,
            column: column_of(frame.nodes.len(), &columns),
            tracks: BTreeMap::new(),
        };
        for gap in 0..layout.gaps.len() {
            let order = in_order(router.bends(gap));
            for (place, route) in order.iter().enumerate() {
                let track = router.track(gap, place, order.len());
                router.tracks.insert((gap, *route), track);
            }
        }
        router
    }

    /// Rows at which `route` enters `gap`.
    fn from(&self, route: &Route, gap: usize) -> Vec<u16> {
        let before = |node: &&usize| self.column[**node] == gap.checked_sub(1);
        let there = route.publishers.iter().filter(before);
        there.filter_map(|n| self.layout.exit(route, *n)).collect()
    }

    /// Rows at which `route` leaves `gap` for its readers.
    fn to(&self, route: &Route, gap: usize) -> Vec<u16> {
        let behind = |node: &&usize| self.column[**node] == Some(gap);
        let there = route.readers.iter().filter(behind);
        there.filter_map(|n| self.layout.entry(route, *n)).collect()
    }

    /// The row of the lane of `route`, if it has one.
    fn lane(&self, route: &Route) -> Option<u16> {
        let lane = route.lane?;
        Some(self.layout.lanes + pane::clamp(lane))
    }

    /// The topics that go up or down in `gap`.
    fn bends(&self, gap: usize) -> Vec<WirePassage> {
        let routes = self.layout.routes.all.iter().enumerate();
        let here = routes.filter(|(_, r)| r.gaps.contains(&gap) && !r.dangles());
        let passages = here.map(|(number, route)| WirePassage {
            route: number,
            from: self.from(route, gap),
            to: self.to(route, gap),
        });
        let bent = |passage: &WirePassage| {
            let mut rows = passage.from.iter().chain(&passage.to);
            let first = rows.next();
            let lane = self.layout.routes.all[passage.route].lane;
            lane.is_some() || rows.any(|row| Some(row) != first)
        };
        passages.filter(bent).collect()
    }

    /// Column of track number `place` of `count`: close to the readers, with room for
    /// text before it.
    fn track(&self, gap: usize, place: usize, count: usize) -> u16 {
        let [start, end] = self.layout.gaps[gap];
        let room = usize::from(end - start);
        let step = if room > 2 * count + 1 { 2 } else { 1 };
        let back = 2 + step * (count - 1 - place);
        let back = back + usize::from(room > back + 2 && step == 2);
        end.saturating_sub(pane::clamp(back)).max(start)
    }

    /// The first column of `gap` with a vertical line, or the end of the gap.
    fn limit(&self, gap: usize) -> u16 {
        let tracks = self.tracks.range((gap, 0)..(gap + 1, 0)).map(|(_, x)| *x);
        tracks.min().unwrap_or(self.layout.gaps[gap][1])
    }

    fn wire(&self, number: usize, route: &Route) -> Wire {
        let mut wire = Wire {
            topic: route.topic,
            pieces: BTreeMap::new(),
            starts: Vec::new(),
            heads: Vec::new(),
        };
        let lane = self.lane(route);
        let mut turns = Vec::new();
        for gap in &route.gaps {
            if route.dangles() {
                self.dangling(&mut wire, route, *gap);
                continue;
            }
            let [start, end] = self.layout.gaps[*gap];
            let last = end.saturating_sub(1).max(start);
            let (from, to) = (self.from(route, *gap), self.to(route, *gap));
            let track = self.tracks.get(&(*gap, number)).copied();
            for row in &from {
                wire.horizontal(*row, start, track.unwrap_or(last));
                wire.starts.push((*row, start));
            }
            for row in &to {
                wire.horizontal(*row, track.unwrap_or(last), last);
                wire.heads.push((*row, last));
            }
            if let Some(track) = track {
                let rows = from.iter().chain(&to).chain(&lane);
                if let (Some(top), Some(end)) = (rows.clone().min(), rows.max()) {
                    wire.vertical(track, *top, *end);
                }
                turns.push(track);
            }
        }
        if let (Some(lane), Some(first), Some(last)) =
            (lane, turns.iter().min(), turns.iter().max())
        {
            wire.horizontal(lane, *first, *last);
        }
        wire
    }

    /// Whether a line out of the frame would overlap another one.
    fn taken(&self, route: &Route, gap: usize, row: u16) -> bool {
        let others = self.layout.routes.all.iter();
        let others = others.filter(|r| r.topic != route.topic);
        let mut before = others.filter(|r| !r.dangles() || r.topic < route.topic);
        before.any(|other| self.from(other, gap).contains(&row))
    }

    /// Whether a vertical line in `gap` meets `row`.
    fn is_crossed(&self, gap: usize, row: u16) -> bool {
        self.bends(gap).iter().any(|passage| {
            let lane = self.lane(&self.layout.routes.all[passage.route]);
            let rows = passage.from.iter().chain(&passage.to).chain(&lane);
            rows.clone().min() <= Some(&row) && rows.max() >= Some(&row)
        })
    }

    /// A short line out of the frame.
    fn dangling(&self, wire: &mut Wire, route: &Route, gap: usize) {
        let [start, end] = self.layout.gaps[gap];
        let name = &self.frame.topics[route.topic].name;
        for row in self.from(route, gap) {
            let end = match self.is_crossed(gap, row) {
                true => self.limit(gap),
                false => end,
            };
            let length = text::dangling(name, usize::from(end.saturating_sub(start)));
            let Some(length) = length.filter(|_| !self.taken(route, gap, row)) else {
                continue;
            };
            let last = start + pane::clamp(length) - 1;
            wire.horizontal(row, start, last);
            wire.heads.push((row, last));
        }
    }
}

/// The routes of `passages` from left to right: a route that enters on a row has to turn
/// before another one leaves on the same row.
fn in_order(mut passages: Vec<WirePassage>) -> Vec<usize> {
    let mut order = Vec::new();
    while !passages.is_empty() {
        let first = (0..passages.len()).find(|n| {
            let out = &passages[*n].to;
            let mut others = passages.iter().enumerate().filter(|(m, _)| m != n);
            !others.any(|(_, other)| other.from.iter().any(|row| out.contains(row)))
        });
        // In a cycle lines overlap for a few cells.
        order.push(passages.remove(first.unwrap_or(0)).route);
    }
    order
}
