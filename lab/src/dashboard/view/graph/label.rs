//! What is written about topics on their lines, where there is room.

use std::time::Duration;

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Modifier, Style},
    text::{Line, Span},
    widgets::Widget,
};

use super::{
    list::List,
    place::GraphLayout,
    route::Route,
    wires::{Wires, level},
};
use crate::dashboard::{
    frame::{FrameData, TopicData},
    view::{pane, theme::Theme},
};

/// The least room for writing on a line, and what writing side by side needs.
pub(super) const NARROW: usize = 13;
const WIDE: usize = 18;

/// A message is old if the next one is overdue by half a period.
const OVERDUE: f64 = 1.5;

/// One row of writing.
#[derive(Clone, Copy, Debug)]
enum LabelRow {
    Name,
    Rate,
    RateAndDepth,
    Depth,
    Drops,
    Age,
    NameAndRate,
    Short,
}

/// Rows above and below a line, and the room they need; best first. What is
/// last below may be left out.
const WRITINGS: [(&[LabelRow], &[LabelRow], usize); 7] = [
    (
        &[LabelRow::Name, LabelRow::RateAndDepth],
        &[LabelRow::Drops, LabelRow::Age],
        WIDE,
    ),
    (
        &[LabelRow::Name, LabelRow::Rate],
        &[LabelRow::Drops, LabelRow::Depth, LabelRow::Age],
        NARROW,
    ),
    (
        &[LabelRow::NameAndRate],
        &[LabelRow::Drops, LabelRow::Depth, LabelRow::Age],
        NARROW,
    ),
    (&[LabelRow::NameAndRate, LabelRow::Drops], &[], NARROW),
    (
        &[],
        &[
            LabelRow::NameAndRate,
            LabelRow::Drops,
            LabelRow::Depth,
            LabelRow::Age,
        ],
        NARROW,
    ),
    (&[LabelRow::Short], &[], NARROW),
    (&[], &[LabelRow::Short], NARROW),
];

/// The length of a dangling edge that carries its name.
pub(super) fn dangling_width(name: &str) -> usize {
    pane::width(name) + 4
}

/// The length of such a line in so many columns, with or without its name.
pub(super) fn dangling(name: &str, room: usize) -> Option<usize> {
    let full = dangling_width(name);
    if room >= full {
        Some(full)
    } else {
        (room >= 2).then_some(room.min(4))
    }
}

/// Writes about topics.
pub(super) struct Labels<'a> {
    frame: &'a FrameData,
    theme: &'a Theme,
    layout: &'a GraphLayout,
    wires: &'a Wires,
    area: Rect,
}

impl<'a> Labels<'a> {
    /// What is needed to write in `area`.
    pub(super) fn new(
        frame: &'a FrameData,
        theme: &'a Theme,
        layout: &'a GraphLayout,
        wires: &'a Wires,
        area: Rect,
    ) -> Self {
        Self {
            frame,
            theme,
            layout,
            wires,
            area,
        }
    }

    /// Writes where there is room.
    pub(super) fn draw(&self, buf: &mut Buffer) {
        let mut rest = Vec::new();
        let (dangling_edges, read): (Vec<&Route>, Vec<&Route>) = self
            .layout
            .routes
            .all
            .iter()
            .partition(|route| route.dangles());
        for route in read {
            if !self.layout.roomy || !self.write(route, buf) {
                rest.push(&self.frame.topics[route.topic]);
            }
        }
        let unnamed = dangling_edges
            .into_iter()
            .filter(|route| !self.name(route, buf));
        let unnamed: Vec<_> = unnamed.map(|r| &self.frame.topics[r.topic]).collect();
        let free = pane::rows(self.area, usize::from(self.layout.bottom), usize::MAX);
        // What nobody reads comes last, and only if that leaves out no other.
        let all = [&rest[..], &unnamed[..]].concat();
        let list = if List::room(&all, free) >= all.len() {
            all
        } else {
            rest
        };
        if !list.is_empty() && blank(free, buf) {
            List::new(&list, self.frame, self.theme, free).draw(buf);
        }
    }

    /// Where the line of `route` begins, and the room before it bends.
    fn trunk(&self, route: &Route) -> Option<(u16, u16, u16)> {
        let node = *route.publishers.first()?;
        let row = self.layout.exit(route, node)?;
        let gap = self.layout.placed(node)?.column + 1;
        let [start, _] = *self.layout.gaps.get(gap)?;
        let room = self.wires.limit(gap).saturating_sub(start);
        Some((start, row, room))
    }

    /// Writes the name into a dangling edge.
    fn name(&self, route: &Route, buf: &mut Buffer) -> bool {
        let name = &self.frame.topics[route.topic].name;
        let Some((start, row, room)) = self.trunk(route) else {
            return false;
        };
        if usize::from(room) < dangling_width(name) {
            return false;
        }
        let text = format!(" {} ", pane::plain(name, self.theme));
        let place = Rect {
            x: self.area.x + start + 1,
            width: pane::clamp(pane::width(&text)),
            ..pane::row(self.area, usize::from(row))
        };
        let line = filled(place, level(self.theme), buf);
        if line {
            pane::put(&text, self.theme.strong(), 0, place, buf);
        }
        line
    }

    /// Writes above and below the line of `route`; whether there was room.
    fn write(&self, route: &Route, buf: &mut Buffer) -> bool {
        let topic = &self.frame.topics[route.topic];
        let Some((start, row, room)) = self.trunk(route) else {
            return false;
        };
        // One column free at either end.
        let room = room.saturating_sub(2);
        let at = |row: usize| Rect {
            x: self.area.x + start + 1,
            width: room,
            ..pane::row(self.area, row)
        };
        let row = usize::from(row);
        let free = |row: usize| row < usize::from(self.area.height) && blank(at(row), buf);
        let above = (0..row).rev().take_while(|row| free(*row)).count();
        let below = (row + 1..).take_while(|row| free(*row)).count();
        let fitting = WRITINGS.iter().find(|(up, down, least)| {
            let needed = down.len().min(1);
            up.len() <= above && needed <= below && *least <= usize::from(room)
        });
        let Some((up, down, _)) = fitting else {
            return false;
        };
        let rows = (row - up.len()..row).zip(*up);
        let rows = rows.chain((row + 1..=row + below).zip(*down));
        let writer = LabelWriter::new(topic, self.frame, self.theme, usize::from(room));
        for (row, what) in rows {
            writer.line(*what).render(at(row), buf);
        }
        true
    }
}

/// Puts the figures of a topic into words.
pub(super) struct LabelWriter<'a> {
    topic: &'a TopicData,
    frame: &'a FrameData,
    theme: &'a Theme,
    room: usize,
}

impl<'a> LabelWriter<'a> {
    /// What is needed to write at most `room` columns about `topic`.
    pub(super) fn new(
        topic: &'a TopicData,
        frame: &'a FrameData,
        theme: &'a Theme,
        room: usize,
    ) -> Self {
        Self {
            topic,
            frame,
            theme,
            room,
        }
    }

    fn line(&self, row: LabelRow) -> Line<'static> {
        let name = |room| Span::styled(self.name(room), self.theme.strong());
        match row {
            LabelRow::Name => Line::from(name(self.room)),
            LabelRow::Rate => Line::raw(self.rate()),
            LabelRow::Depth => Line::raw(format!("  {}", self.depth())),
            LabelRow::RateAndDepth => Line::raw(format!("{}  {}", self.rate(), self.depth())),
            LabelRow::Drops => {
                let (glyph, style) = self.verdict();
                let count = count(self.topic.dropped);
                let texts = [
                    format!("{glyph} {count} dropped"),
                    format!("{glyph} {count} drops"),
                    format!("{glyph} {count}"),
                ];
                // Not a line in that style, which would be as long as the room.
                Line::from(Span::styled(fitting(texts, self.room), style))
            }
            LabelRow::Age => self.age(),
            LabelRow::NameAndRate => {
                let rate = self.rate();
                match self.room.checked_sub(pane::width(&rate) + 1) {
                    Some(room) if room >= pane::width(&self.topic.name) => {
                        Line::from_iter([name(room), Span::raw(format!(" {rate}"))])
                    }
                    _ => Line::from(name(self.room)),
                }
            }
            LabelRow::Short => {
                let (glyph, style) = self.verdict();
                let drops = format!(" {glyph}{}", count(self.topic.dropped));
                let left = self.room.saturating_sub(pane::width(&drops));
                let rate = format!(" {:.0}/s", self.topic.per_second);
                let rate = match left.checked_sub(pane::width(&rate)) {
                    Some(least) if least >= pane::width(&self.topic.name) => rate,
                    _ => String::new(),
                };
                let name = name(left.saturating_sub(pane::width(&rate)));
                Line::from_iter([name, Span::raw(rate), Span::styled(drops, style)])
            }
        }
    }

    /// The name, cut to `room` columns.
    pub(super) fn name(&self, room: usize) -> String {
        pane::clip(&self.topic.name, room, self.theme)
    }

    /// Messages per second, always seven columns wide.
    pub(super) fn rate(&self) -> String {
        let rate = self.topic.per_second;
        let decimals = usize::from(rate < 999.95);
        format!("{rate:>5.decimals$}/s")
    }

    /// The depth of the queue.
    pub(super) fn depth(&self) -> String {
        format!("depth {:<3}", self.topic.depth)
    }

    /// Glyph and style of the count of losses. Losses of the past are neither
    /// good nor alarming.
    pub(super) fn verdict(&self) -> (&'static str, Style) {
        if self.topic.alarming() {
            (self.theme.glyph("✖", "!"), self.theme.alarm())
        } else if self.topic.dropped == 0 {
            (self.theme.glyph("✓", "+"), self.theme.good())
        } else {
            (" ", Style::new())
        }
    }

    /// How old the message is that readers hold.
    pub(super) fn age(&self) -> Line<'static> {
        let Some(held) = self.topic.held else {
            return Line::default();
        };
        let text = match held.as_millis() {
            ms @ 0..=9_999 => format!("held {ms:>4} ms"),
            _ => format!("held {:>5.1} s", held.as_secs_f64().min(99_999.0)),
        };
        if self.overdue(held) {
            let glyph = self.theme.glyph("◷", "~");
            let style = self.theme.alarm().remove_modifier(Modifier::REVERSED);
            Line::from(Span::styled(format!("{glyph} {text}"), style))
        } else {
            Line::raw(format!("  {text}"))
        }
    }

    fn overdue(&self, held: Duration) -> bool {
        let publishers = self.topic.publishers.iter();
        let nodes = publishers.filter_map(|n| self.frame.nodes.get(*n));
        let periods = nodes.map(|node| node.hz.period());
        let shortest = periods.min();
        shortest.is_some_and(|period| held.as_secs_f64() > OVERDUE * period.as_secs_f64())
    }
}

/// Whether nothing is drawn in `area`, and there is an area.
fn blank(area: Rect, buf: &Buffer) -> bool {
    filled(area, " ", buf)
}

fn filled(area: Rect, symbol: &str, buf: &Buffer) -> bool {
    let mut cells = area.positions().map(|at| buf.cell(at));
    !area.is_empty() && cells.all(|cell| cell.is_some_and(|cell| cell.symbol() == symbol))
}

/// The first of `texts` that fits into `room`; nothing if none does.
pub(super) fn fitting<const N: usize>(texts: [String; N], room: usize) -> String {
    let mut fitting = texts.into_iter().filter(|text| pane::width(text) <= room);
    fitting.next().unwrap_or_default()
}

/// A count in at most five columns.
pub(super) fn count(count: u64) -> String {
    match count {
        0..100_000 => count.to_string(),
        100_000..10_000_000 => format!("{}k", count / 1_000),
        10_000_000..10_000_000_000 => format!("{}M", count / 1_000_000),
        _ => format!("{}G", (count / 1_000_000_000).min(9_999)),
    }
}
