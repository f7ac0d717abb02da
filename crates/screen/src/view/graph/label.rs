//! Text about topics on their lines, where there is room.

use super::{
    list::{
        self,
        LabelRow::{self, *},
        NARROW,
    },
    route::Route,
    router::Router,
    text::{plain, width},
};
use crate::view::sheet::Sheet;

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

/// The figures of topics.
impl Router<'_> {
    /// Writes as much as there is room for.
    pub(super) fn label(&self, sheet: &mut Sheet<'_>) {
        let (mut rest, mut unnamed) = (Vec::new(), Vec::new());
        let routes = self.layout.routes.all.iter();
        let (dangling, read): (Vec<&Route>, Vec<&Route>) = routes.partition(|r| r.dangles());
        for route in read {
            if !self.layout.roomy {
                self.tag(route, sheet);
            }
            if !self.layout.roomy || !self.write(route, sheet) {
                rest.push(self.view.topic(route.topic));
            }
        }
        for route in dangling {
            if !self.name(route, sheet) {
                unnamed.push(self.view.topic(route.topic));
            }
        }
        let mut free = sheet.rows(usize::from(self.layout.bottom), usize::MAX);
        // Topics without readers come last, and only if there is room for all.
        let all = [&rest[..], &unnamed[..]].concat();
        let list = if list::room(&all, free.area) >= all.len() {
            all
        } else {
            rest
        };
        if free.shows(" ") {
            list::draw(&list, &mut free);
        }
    }

    /// Returns the first column and the row of the text about `route`, and the length of its line
    /// up to the first bend.
    fn trunk(&self, route: &Route) -> Option<(usize, usize, usize)> {
        let first = route.publishers.first()?;
        let exit = self
            .layout
            .exits
            .iter()
            .find(|exit| (exit.topic, exit.node) == (route.topic, *first))?;
        let [start, _] = *self.layout.gaps.get(exit.gap)?;
        let room = self.limit(exit.gap).saturating_sub(start);
        let [start, row, room] = [start, exit.row, room].map(usize::from);
        Some((start + 1, row, room))
    }

    /// Writes the name on a dangling edge.
    fn name(&self, route: &Route, sheet: &mut Sheet<'_>) -> bool {
        let Some((start, row, _)) = self.trunk(route) else {
            return false;
        };
        let name = plain(&self.view.topic(route.topic).topic.name, self.view.theme).into_owned();
        [format!(" {name} "), name].iter().any(|text| {
            let mut place = sheet.cells(start, row, width(text));
            let is_line = place.shows("─");
            if is_line {
                place.put(0, 0, text, self.view.theme.strong());
            }
            is_line
        })
    }

    /// Writes the name above or below the line of `route`, if there is room for it.
    fn tag(&self, route: &Route, sheet: &mut Sheet<'_>) {
        let Some((start, row, room)) = self.trunk(route) else {
            return;
        };
        let name = plain(&self.view.topic(route.topic).topic.name, self.view.theme);
        let wide = width(&name);
        let rows = [row.checked_sub(1), Some(row + 1)].into_iter().flatten();
        for row in rows.filter(|row| *row < usize::from(self.layout.bottom)) {
            let mut place = sheet.cells(start, row, wide);
            if wide + 2 <= room && place.shows(" ") {
                place.put(0, 0, &name, self.view.theme.strong());
                return;
            }
        }
    }

    /// Writes above and below the line of `route`; returns whether there was room.
    fn write(&self, route: &Route, sheet: &mut Sheet<'_>) -> bool {
        let topic = self.view.topic(route.topic);
        let Some((start, row, room)) = self.trunk(route) else {
            return false;
        };
        // One blank column at either end.
        let text_room = room.saturating_sub(2);
        let mut free = |row: &usize| sheet.cells(start, *row, text_room).shows(" ");
        let above = (0..row).rev().take_while(&mut free).count();
        let below = (row + 1..).take_while(free).count();
        let fitting = WRITINGS.iter().find(|(up, down, least)| {
            let needed = down.len().min(1);
            up.len() <= above && needed <= below && *least <= text_room
        });
        let Some((up, down, _)) = fitting else {
            return false;
        };
        let rows = (row - up.len()..row).zip(*up);
        for (row, what) in rows.chain((row + 1..=row + below).zip(*down)) {
            let line = topic.line(*what, text_room);
            sheet.cells(start, row, text_room).line(0, 0, &line);
        }
        true
    }
}
