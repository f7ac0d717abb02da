//! A list of the topics without room for text on their lines.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    text::{Line, Span},
    widgets::Widget,
};

use super::{GraphView, label_writer::LabelWriter, route::Routes, text::count};
use crate::dashboard::{
    frame::{FrameData, TopicData},
    view::pane::{self, fitting},
};

/// Maximum width of a name in the list.
const LIST_NAME: usize = 16;
/// Width of the figures after it, of the word after those, and of the age at the end.
const LIST_FIGURES: usize = 26;
const LIST_WORD: usize = 8;
const LIST_AGE: usize = 15;
/// Columns between entries of the list.
const LIST_SPACE: usize = 3;

/// Number of rows of a list of the topics of `routes` in `room` columns.
pub(super) fn rows(frame: &FrameData, routes: &Routes, room: usize) -> usize {
    let read = routes.all.iter().filter(|route| !route.dangles());
    let topics: Vec<&TopicData> = read.map(|r| &frame.topics[r.topic]).collect();
    topics.len().div_ceil(List::side_by_side(&topics, room))
}

/// Topics side by side and below each other.
pub(super) struct List<'a> {
    /// The graph.
    pub(super) view: GraphView<'a>,
    /// The topics.
    pub(super) topics: &'a [&'a TopicData],
    /// The area of the list.
    pub(super) area: Rect,
}

impl List<'_> {
    fn name_width(topics: &[&TopicData]) -> usize {
        let names = topics.iter().map(|topic| pane::width(&topic.name));
        names.max().unwrap_or(0).min(LIST_NAME)
    }

    fn side_by_side(topics: &[&TopicData], room: usize) -> usize {
        let width = Self::name_width(topics) + LIST_FIGURES;
        ((room + LIST_SPACE) / (width + LIST_SPACE)).max(1)
    }

    /// Number of entries that fit into `area`.
    pub(super) fn room(topics: &[&TopicData], area: Rect) -> usize {
        Self::side_by_side(topics, usize::from(area.width)) * usize::from(area.height)
    }

    /// Draws as many entries as there is room for.
    pub(super) fn draw(&self, buf: &mut Buffer) {
        let room = usize::from(self.area.width);
        let across = Self::side_by_side(self.topics, room);
        let width = (room + LIST_SPACE) / across - LIST_SPACE.min(room / across);
        let cells = Self::room(self.topics, self.area);
        for (number, topic) in self.topics.iter().take(cells).enumerate() {
            let row = pane::row(self.area, number / across);
            let skip = number % across * (width + LIST_SPACE);
            let cell = Rect {
                x: row.x + pane::clamp(skip),
                width: pane::clamp(width),
                ..row
            };
            let cell = cell.intersection(self.area);
            let left = self.topics.len() - number;
            if number + 1 == cells && left > 1 {
                let text = format!("+{left} topics");
                pane::put(&text, self.view.theme.faint(), 0, cell, buf);
            } else {
                self.entry(topic, cell, buf);
            }
        }
    }

    fn entry(&self, topic: &TopicData, cell: Rect, buf: &mut Buffer) {
        let room = usize::from(cell.width);
        let (view, theme) = (self.view, self.view.theme);
        let writer = LabelWriter { view, topic, room };
        let name = Self::name_width(self.topics);
        let text = format!("{:name$}", writer.name(name));
        let full = name + LIST_FIGURES;
        let aged = room >= full + LIST_WORD + LIST_AGE;
        let depth = if room >= full {
            format!(" {}", writer.depth())
        } else {
            String::new()
        };
        let mut line = Line::from_iter([
            Span::styled(text, theme.strong()),
            Span::styled(writer.mark(" "), theme.strong()),
            Span::raw(format!("{}{depth} ", writer.rate())),
        ]);
        let left = room.saturating_sub(line.width() + if aged { LIST_AGE + 1 } else { 0 });
        let dropped = count(topic.dropped);
        let words = ["  {} dropped", "  {} drops", "  {}"];
        let drops = fitting(words.map(|text| text.replace("{}", &dropped)), left);
        line.push_span(Span::raw(drops));
        if aged {
            let blank = (full + LIST_WORD + 1).saturating_sub(line.width());
            line.push_span(Span::raw(" ".repeat(blank)));
            line.extend(writer.age());
        }
        line.render(cell, buf);
    }
}
