//! Topics as lines of cells, with moving messages.

use std::collections::{BTreeMap, VecDeque};

use ratatui::style::Style;

use crate::{
    frame::{Dot, FrameData, TopicData},
    theme::Theme,
    view::sheet::Sheet,
};

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
pub(super) fn draw(frame: &FrameData, wires: &[Wire], sheet: &mut Sheet<'_>) {
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
