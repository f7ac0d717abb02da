//! The name and the figures of a topic as text.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::{GraphView, text::count};
use crate::dashboard::{
    frame::TopicData,
    view::pane::{self, fitting},
};

/// Periods after which the next message is overdue.
const OVERDUE: f64 = 1.5;

/// One row of a label.
#[derive(Clone, Copy, Debug)]
pub(super) enum LabelRow {
    Name,
    Rate,
    RateAndDepth,
    Depth,
    Drops,
    Age,
    NameAndRate,
    Short,
}

/// Writes the figures of a topic.
pub(super) struct LabelWriter<'a> {
    /// The graph.
    pub(super) view: GraphView<'a>,
    /// The topic.
    pub(super) topic: &'a TopicData,
    /// Maximum width (columns).
    pub(super) room: usize,
}

impl LabelWriter<'_> {
    /// The text of one row.
    pub(super) fn line(&self, row: LabelRow) -> Line<'static> {
        let full_name = format!("{}{}", self.mark(""), self.topic.name);
        let name = |room| {
            let name = pane::clip(&full_name, room, self.view.theme);
            Span::styled(name, self.view.theme.strong())
        };
        match row {
            LabelRow::Name => Line::from(name(self.room)),
            LabelRow::Rate => Line::raw(self.rate()),
            LabelRow::Depth => Line::raw(format!("  {}", self.depth())),
            LabelRow::RateAndDepth => Line::raw(format!("{}  {}", self.rate(), self.depth())),
            LabelRow::Drops => {
                let dropped = count(self.topic.dropped);
                let texts = ["dropped", "drops", ""].map(|word| format!("  {dropped} {word}"));
                let texts = self.losses().into_iter().chain(texts);
                Line::raw(fitting(texts, self.room).trim_end().to_owned())
            }
            LabelRow::Age => self.age(),
            LabelRow::NameAndRate => {
                let rate = self.rate();
                match self.room.checked_sub(pane::width(&rate) + 1) {
                    Some(room) if room >= pane::width(&full_name) => {
                        Line::from_iter([name(room), Span::raw(format!(" {rate}"))])
                    }
                    _ => Line::from(name(self.room)),
                }
            }
            LabelRow::Short => {
                let drops = match self.topic.dropped {
                    0 => String::new(),
                    dropped => format!(" {}{}", self.view.theme.glyph("✖", "x"), count(dropped)),
                };
                let left = self.room.saturating_sub(pane::width(&drops));
                let rate = format!(" {:.0}/s", self.topic.per_second);
                let rate = match left.checked_sub(pane::width(&rate)) {
                    Some(least) if least >= pane::width(&full_name) => rate,
                    _ => String::new(),
                };
                let name = name(left.saturating_sub(pane::width(&rate)));
                Line::from_iter([name, Span::raw(rate), Span::raw(drops)])
            }
        }
    }

    /// Drops and losses, if the link lost or reordered messages.
    fn losses(&self) -> Vec<String> {
        let dropped = count(self.topic.dropped);
        let parts = [(self.topic.lost, "lost"), (self.topic.overtaken, "late")];
        let parts = parts.iter().filter(|(number, _)| *number > 0);
        let parts: Vec<String> = parts
            .map(|(n, word)| format!("{} {word}", count(*n)))
            .collect();
        match parts.join(" ") {
            none if none.is_empty() => Vec::new(),
            lost => vec![format!("  {dropped} dropped {lost}"), format!("  {lost}")],
        }
    }

    /// The name, cut to `room` columns.
    pub(super) fn name(&self, room: usize) -> String {
        pane::clip(&self.topic.name, room, self.view.theme)
    }

    /// The mark of a topic with the focus of the knob keys, or else `nothing`.
    pub(super) fn mark(&self, nothing: &'static str) -> &'static str {
        let mut marked = self.view.knobs.topics.iter();
        if marked.any(|topic| **topic == *self.topic.name) {
            self.view.theme.glyph("▸", ">")
        } else {
            nothing
        }
    }

    /// Messages per second, in a constant width of seven columns.
    pub(super) fn rate(&self) -> String {
        let rate = self.topic.per_second;
        let decimals = usize::from(rate < 999.95);
        format!("{rate:>5.decimals$}/s")
    }

    /// The depth of the queue.
    pub(super) fn depth(&self) -> String {
        format!("depth {:<3}", self.topic.depth)
    }

    /// The age of the newest message.
    pub(super) fn age(&self) -> Line<'static> {
        let Some(held) = self.topic.held else {
            return Line::default();
        };
        let text = match held.as_millis() {
            ms @ 0..=9_999 => format!("age {ms:>4} ms"),
            _ => format!("age {:>5.1} s", held.as_secs_f64().min(99_999.0)),
        };
        if self.overdue(held) {
            let glyph = self.view.theme.glyph("◷", "~");
            Line::raw(format!("{glyph} {text}"))
        } else {
            Line::raw(format!("  {text}"))
        }
    }

    fn overdue(&self, held: Duration) -> bool {
        let publishers = self.topic.publishers.iter();
        let nodes = publishers.filter_map(|n| self.view.frame.nodes.get(*n));
        let periods = nodes.map(|node| node.hz.period());
        let shortest = periods.min();
        shortest.is_some_and(|period| held.as_secs_f64() > OVERDUE * period.as_secs_f64())
    }
}
