//! The boxes of nodes, and topics as lines of cells between them.

use std::collections::{BTreeMap, VecDeque};

use ratatui::{
    style::Style,
    text::{Line, Span},
    widgets::Block,
};

use super::{
    GraphView,
    list::COUNT,
    place::GraphLayout,
    text::{clip, count, fitting, line, pad, short, width},
};
use crate::{
    frame::{Dot, FrameData, Health, NodeData, TopicData},
    theme::Theme,
    view::sheet::Sheet,
};

/// Minimum length of a row with a margin in a box.
const ROOM: usize = 14;

/// Columns around name and rate of a node in one row.
const PILL: usize = 4;

/// Draws the boxes of all visible nodes.
pub(super) fn draw(view: GraphView<'_>, layout: &GraphLayout, sheet: &mut Sheet<'_>) {
    let boxes = layout
        .boxes
        .iter()
        .map(|placed| (&view.frame.nodes[placed.node], placed.rect));
    // All nodes have a rate or none: a single one would look like a mistake.
    let with_rate = boxes.clone().all(|(node, rect)| {
        let text = format!("{} {}", node.name, hz(node));
        width(&text) + PILL <= usize::from(rect.width)
    });
    for (node, mut rect) in boxes {
        (rect.x, rect.y) = (rect.x + sheet.area.x, rect.y + sheet.area.y);
        let mark = if *view.knobs.node == *node.name {
            "▸"
        } else {
            " "
        };
        let mut place = sheet.part(rect);
        if rect.height < 3 {
            place.line(0, 0, &pill(node, mark, &place, with_rate))
        } else {
            full(node, mark, place)
        }
    }
}

/// A node with name, rate, overruns, caption and tick marker; `mark` comes before the name.
fn full(node: &NodeData, mark: &str, mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let room = sheet.width().saturating_sub(2);
    let name = if width(&node.name) + 2 <= room {
        format!("{mark}{} ", node.name)
    } else {
        format!("{}{}", mark.trim(), node.name)
    };
    let title = Span::styled(clip(&name, room, theme), theme.strong());
    let block = Block::bordered().title(title);
    let inner = block.inner(sheet.area);
    sheet.widget(block);
    let mut inside = sheet.part(inner);
    let margin = usize::from(room > ROOM);
    let text_room = room.saturating_sub(2 * margin);
    let beneath = inside.height() > 1;
    let mut lines = vec![rate(
        node,
        theme,
        text_room,
        !beneath || node.place.is_some(),
    )];
    if beneath {
        lines.push(overruns(node, theme, text_room));
    }
    lines.extend(node.caption.map(|text| caption(text, theme, text_room)));
    inside.lines(margin, 0, lines);
}

/// Returns a node in one row.
fn pill(node: &NodeData, mark: &str, sheet: &Sheet<'_>, with_rate: bool) -> Line<'static> {
    let theme = sheet.theme;
    let room = sheet.width().saturating_sub(PILL);
    let beside = room.saturating_sub(width(&node.name) + 1);
    let rate = match (node.health.word(beside), with_rate) {
        (Some(word), _) => word.to_owned(),
        (None, true) => hz(node),
        (None, false) => String::new(),
    };
    let left = room.saturating_sub(width(&rate));
    let name = pad(&node.name, left, theme);
    let (glyph, style) = tick(node, theme);
    line([
        ("[".to_owned(), Style::new()),
        (glyph.to_owned(), style),
        (format!("{mark}{name}"), theme.strong()),
        (format!("{rate}]"), Style::new()),
    ])
}

/// Returns the tick marker and the rate, with overruns if they have no row of their own.
fn rate(node: &NodeData, theme: &Theme, room: usize, with_overruns: bool) -> Line<'static> {
    let (glyph, tick) = tick(node, theme);
    let text_room = room.saturating_sub(1);
    let (text, style) = match node.health.word(text_room) {
        Some(word) => (word.to_owned(), theme.strong()),
        None => (hz(node), Style::new()),
    };
    let text = fitting([format!(" {text}"), text], text_room);
    let over = format!(" {} over", count(node.overruns, COUNT));
    let told = with_overruns && node.overruns > 0 && node.health == Health::Works;
    let over = if told && width(&text) + width(&over) <= text_room {
        over
    } else {
        String::new()
    };
    line([
        (glyph.to_owned(), tick),
        (text, style),
        (over, theme.strong()),
    ])
}

fn overruns(node: &NodeData, theme: &Theme, room: usize) -> Line<'static> {
    if let Some(place) = &node.place {
        return line([(clip(place, room, theme), theme.faint())]);
    }
    let count = count(node.overruns, COUNT);
    let (unit, style) = match node.overruns {
        0 => ("overruns", theme.faint()),
        1 => ("overrun", theme.strong()),
        _ => ("overruns", theme.strong()),
    };
    let texts = [
        format!("  {count} {unit}"),
        format!("{count} {unit}"),
        format!("{count} over"),
        count,
    ];
    line([(fitting(texts, room), style)])
}

/// Returns a caption, or its verb if that is all that fits.
fn caption(text: &str, theme: &Theme, room: usize) -> Line<'static> {
    let verb = text.split(' ').next().unwrap_or_default();
    let texts = [format!("  {text}"), text.to_owned(), format!("  {verb}")];
    line([(fitting(texts, room), theme.faint())])
}

fn tick(node: &NodeData, theme: &Theme) -> (&'static str, Style) {
    match (node.health, node.lit) {
        (Health::Crashed | Health::Gone, _) => ("✖", theme.strong()),
        (Health::Hangs, _) => ("◔", theme.strong()),
        (Health::Works, true) => ("●", theme.active()),
        (Health::Works, false) => ("○", theme.faint()),
    }
}

/// Returns the rate with as many digits as needed: "50 Hz", "7.5 Hz", "0.001 Hz".
fn hz(node: &NodeData) -> String {
    let hz = node.hz.get();
    let decimals = match hz {
        100.0.. => 1,
        1.0.. => 2,
        _ => 3,
    };
    format!("{} Hz", short(hz, decimals))
}

/// Distance between messages on a line (cells).
const EVERY: u64 = 6;

const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const UP: u8 = 4;
const DOWN: u8 = 8;

/// The glyph of a cell, by its directions.
const JOINTS: [&str; 16] = [
    "─", "─", "─", "─", "│", "┘", "└", "┴", "│", "┐", "┌", "┬", "│", "┤", "├", "┼",
];

/// A cell of a line: its directions, and its distance from a publisher.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Piece {
    to: u8,
    far: Option<u64>,
}

/// The line of one topic. Cells are row and column.
#[derive(Debug, Default)]
pub(super) struct Wire {
    /// Index of the topic.
    pub(super) topic: usize,
    pub(super) pieces: BTreeMap<(u16, u16), Piece>,
    /// The cells at its publishers.
    pub(super) starts: Vec<(u16, u16)>,
    /// The cells at its readers.
    pub(super) heads: Vec<(u16, u16)>,
}

impl Wire {
    /// Adds a horizontal part.
    pub(super) fn horizontal(&mut self, row: u16, from: u16, to: u16) {
        let (from, to) = (from.min(to), from.max(to));
        self.pieces.entry((row, from)).or_default();
        for x in from..to {
            self.pieces.entry((row, x)).or_default().to |= RIGHT;
            self.pieces.entry((row, x + 1)).or_default().to |= LEFT;
        }
    }

    /// Adds a vertical part.
    pub(super) fn vertical(&mut self, column: u16, from: u16, to: u16) {
        for y in from.min(to)..from.max(to) {
            self.pieces.entry((y, column)).or_default().to |= DOWN;
            self.pieces.entry((y + 1, column)).or_default().to |= UP;
        }
    }

    /// Finds the distance of each cell from the nearest publisher.
    pub(super) fn measure(&mut self) {
        let mut next: VecDeque<_> = self.starts.iter().map(|start| (*start, 0)).collect();
        while let Some(((y, x), far)) = next.pop_front() {
            let Some(piece) = self
                .pieces
                .get_mut(&(y, x))
                .filter(|piece| piece.far.is_none())
            else {
                continue;
            };
            piece.far = Some(far);
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

    fn draw(&self, topic: &TopicData, sheet: &mut Sheet<'_>) {
        let theme = sheet.theme;
        let longest = self
            .pieces
            .values()
            .filter_map(|piece| piece.far)
            .max()
            .unwrap_or(0);
        for (at, piece) in &self.pieces {
            let straight = [LEFT | RIGHT, UP | DOWN].contains(&piece.to);
            let far = piece.far.filter(|_| straight);
            let message = far.and_then(|far| message(topic, (far, longest), theme));
            let joint = (JOINTS[usize::from(piece.to)], Style::new());
            let (glyph, style) = message.unwrap_or(joint);
            let mut cell = cell(sheet, *at);
            // Where lines cross, the vertical one is in front, so that a crossing does not
            // look like a joint.
            if glyph != "─" || !cell.shows("│") {
                cell.put(0, 0, glyph, style);
            }
        }
        for head in &self.heads {
            cell(sheet, *head).put(0, 0, "►", Style::new());
        }
    }
}

/// Draws the lines of all topics.
pub(super) fn draw_wires(frame: &FrameData, wires: &[Wire], sheet: &mut Sheet<'_>) {
    for wire in wires {
        wire.draw(&frame.topics[wire.topic], sheet);
    }
}

fn cell<'s>(sheet: &'s mut Sheet<'_>, (row, column): (u16, u16)) -> Sheet<'s> {
    sheet.cells(usize::from(column), usize::from(row), 1)
}

/// Returns the message at distance `far` from the publisher on a line of some length. Where the
/// link takes time, each message is in its place; elsewhere they are evenly spread, at the
/// publishing rate, and the recent shares of lost and dropped ones appear over the whole length.
fn message(
    topic: &TopicData,
    (far, longest): (u64, u64),
    theme: &Theme,
) -> Option<(&'static str, Style)> {
    let (under_way, lost) = (("•", theme.active()), ("◌", Style::new()));
    if let Some(dots) = &topic.dots {
        // Between the first cell and the head of the line.
        let way = longest.saturating_sub(2) as f64;
        let is_here = |dot: &&Dot| 1 + (dot.way * way) as u64 == far;
        let dot = dots.iter().rev().find(is_here)?;
        return Some(if dot.lost { lost } else { under_way });
    }
    if topic.published == 0 || far % EVERY != topic.published % EVERY {
        return None;
    }
    let message = ((topic.published as f64 - far as f64) / EVERY as f64).floor();
    let one_of = |share: f64| {
        let by = |message: f64| (message * share).floor();
        by(message + 1.0) > by(message)
    };
    Some(if one_of(topic.link_loss()) {
        lost
    } else if one_of(topic.loss()) {
        ("✖", Style::new())
    } else {
        under_way
    })
}
