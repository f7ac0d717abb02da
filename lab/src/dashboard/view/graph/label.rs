//! Text about topics on their lines, where there is room.

use ratatui::{buffer::Buffer, layout::Rect, widgets::Widget};

use super::{
    GraphView,
    label_writer::{
        LabelRow::{self, *},
        LabelWriter,
    },
    list::List,
    place::GraphLayout,
    route::Route,
    text::NARROW,
    wires::{Wires, level},
};
use crate::dashboard::view::pane;

/// Minimum room for figures side by side on a line.
const WIDE: usize = 18;

/// Rows above and below a line, and the room they need; best first. The last row below
/// may be left out.
const WRITINGS: [(&[LabelRow], &[LabelRow], usize); 7] = [
    (&[Name, RateAndDepth], &[Drops, Age], WIDE),
    (&[Name, Rate], &[Drops, Depth, Age], NARROW),
    (&[NameAndRate], &[Drops, Depth, Age], NARROW),
    (&[NameAndRate, Drops], &[], NARROW),
    (&[], &[NameAndRate, Drops, Depth, Age], NARROW),
    (&[Short], &[], NARROW),
    (&[], &[Short], NARROW),
];

/// Writes the figures of topics.
pub(super) struct Labels<'a> {
    /// The graph.
    pub(super) view: GraphView<'a>,
    /// The places of its boxes.
    pub(super) layout: &'a GraphLayout,
    /// Its lines.
    pub(super) wires: &'a Wires,
    /// The inside of the pane.
    pub(super) area: Rect,
}

impl Labels<'_> {
    /// Writes as much as there is room for.
    pub(super) fn draw(&self, buf: &mut Buffer) {
        let mut rest = Vec::new();
        let (dangling_edges, read): (Vec<&Route>, Vec<&Route>) = self
            .layout
            .routes
            .all
            .iter()
            .partition(|route| route.dangles());
        for route in read {
            if !self.layout.roomy {
                self.tag(route, buf);
            }
            if !self.layout.roomy || !self.write(route, buf) {
                rest.push(self.view.topic(route.topic));
            }
        }
        let unnamed = dangling_edges
            .into_iter()
            .filter(|route| !self.name(route, buf));
        let unnamed: Vec<_> = unnamed.map(|r| self.view.topic(r.topic)).collect();
        let free = pane::rows(self.area, usize::from(self.layout.bottom), usize::MAX);
        // Topics without readers come last, and only if there is room for all.
        let all = [&rest[..], &unnamed[..]].concat();
        let list = if List::room(&all, free) >= all.len() {
            all
        } else {
            rest
        };
        if !list.is_empty() && blank(free, buf) {
            let list = List {
                view: self.view,
                topics: &list,
                area: free,
            };
            list.draw(buf);
        }
    }

    /// The beginning of the line of `route`, and its length up to the first bend.
    fn trunk(&self, route: &Route) -> Option<(u16, u16, u16)> {
        let node = *route.publishers.first()?;
        let row = self.layout.exit(route, node)?;
        let gap = self.layout.placed(node)?.column + 1;
        let [start, _] = *self.layout.gaps.get(gap)?;
        let room = self.wires.limit(gap).saturating_sub(start);
        Some((start, row, room))
    }

    /// The place of `width` columns in a row, behind the beginning of a line.
    fn place(&self, start: u16, row: u16, width: usize) -> Rect {
        Rect {
            x: self.area.x + start + 1,
            width: pane::clamp(width),
            ..pane::row(self.area, usize::from(row))
        }
    }

    /// Writes the name on a dangling edge.
    fn name(&self, route: &Route, buf: &mut Buffer) -> bool {
        let Some((start, row, _)) = self.trunk(route) else {
            return false;
        };
        let name = pane::plain(&self.view.topic(route.topic).name, self.view.theme);
        let texts = [format!(" {name} "), name.into_owned()];
        texts.iter().any(|text| {
            let place = self.place(start, row, pane::width(text));
            let line = filled(place, level(self.view.theme), buf);
            if line {
                pane::put(text, self.view.theme.strong(), 0, place, buf);
            }
            line
        })
    }

    /// Writes the name above or below the line of `route`, if there is room for it.
    fn tag(&self, route: &Route, buf: &mut Buffer) {
        let Some((start, row, room)) = self.trunk(route) else {
            return;
        };
        let name = pane::plain(&self.view.topic(route.topic).name, self.view.theme);
        let width = pane::width(&name);
        let rows = [row.checked_sub(1), Some(row + 1)].into_iter().flatten();
        let rows = rows.filter(|row| *row < self.layout.bottom);
        let mut places = rows.map(|row| self.place(start, row, width));
        let fits = width + 2 <= usize::from(room);
        let place = places.find(|place| fits && blank(*place, buf));
        if let Some(place) = place {
            pane::put(&name, self.view.theme.strong(), 0, place, buf);
        }
    }

    /// Writes above and below the line of `route`; returns whether there was room.
    fn write(&self, route: &Route, buf: &mut Buffer) -> bool {
        let topic = self.view.topic(route.topic);
        let Some((start, row, room)) = self.trunk(route) else {
            return false;
        };
        // One blank column at either end.
        let room = usize::from(room.saturating_sub(2));
        let at = |row: usize| self.place(start, pane::clamp(row), room);
        let row = usize::from(row);
        let free = |row: usize| row < usize::from(self.area.height) && blank(at(row), buf);
        let above = (0..row).rev().take_while(|row| free(*row)).count();
        let below = (row + 1..).take_while(|row| free(*row)).count();
        let fitting = WRITINGS.iter().find(|(up, down, least)| {
            let needed = down.len().min(1);
            up.len() <= above && needed <= below && *least <= room
        });
        let Some((up, down, _)) = fitting else {
            return false;
        };
        let rows = (row - up.len()..row).zip(*up);
        let rows = rows.chain((row + 1..=row + below).zip(*down));
        let view = self.view;
        let writer = LabelWriter { view, topic, room };
        for (row, what) in rows {
            writer.line(*what).render(at(row), buf);
        }
        true
    }
}

/// Whether `area` is not empty and has no drawing.
fn blank(area: Rect, buf: &Buffer) -> bool {
    filled(area, " ", buf)
}

fn filled(area: Rect, symbol: &str, buf: &Buffer) -> bool {
    let mut cells = area.positions().map(|at| buf.cell(at));
    !area.is_empty() && cells.all(|cell| cell.is_some_and(|cell| cell.symbol() == symbol))
}
