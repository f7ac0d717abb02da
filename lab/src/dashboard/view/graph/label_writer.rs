//! The name and the figures of a topic in words.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::text::{count, fitting};
use crate::dashboard::{
    frame::{FrameData, TopicData},
    knob_focus::KnobFocus,
    view::{pane, theme::Theme},
};

/// A message is old if the next one is overdue by half a period.
const OVERDUE: f64 = 1.5;

/// One row of writing.
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

/// Puts the figures of a topic into words.
pub(super) struct LabelWriter<'a> {
    topic: &'a TopicData,
    frame: &'a FrameData,
    knobs: &'a KnobFocus,
    theme: &'a Theme,
    room: usize,
}

impl<'a> LabelWriter<'a> {
    /// What is needed to write at most `room` columns about `topic`.
    pub(super) fn new(
        topic: &'a TopicData,
        frame: &'a FrameData,
        knobs: &'a KnobFocus,
        theme: &'a Theme,
        room: usize,
    ) -> Self {
        Self {
            topic,
            frame,
            knobs,
            theme,
            room,
        }
    }

    /// The words and figures of one row.
    pub(super) fn line(&self, row: LabelRow) -> Line<'static> {
        let full_name = format!("{}{}", self.mark(""), self.topic.name);
        let name = |room| {
            let name = pane::clip(&full_name, room, self.theme);
            Span::styled(name, self.theme.strong())
        };
        match row {
            LabelRow::Name => Line::from(name(self.room)),
            LabelRow::Rate => Line::raw(self.rate()),
            LabelRow::Depth => Line::raw(format!("  {}", self.depth())),
            LabelRow::RateAndDepth => Line::raw(format!("{}  {}", self.rate(), self.depth())),
            LabelRow::Drops => {
                let count = count(self.topic.dropped);
                let texts = ["dropped", "drops", ""].map(|word| format!("  {count} {word}"));
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
                    dropped => format!(" {}{}", self.theme.glyph("✖", "x"), count(dropped)),
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

    /// The name, cut to `room` columns.
    pub(super) fn name(&self, room: usize) -> String {
        pane::clip(&self.topic.name, room, self.theme)
    }

    /// A mark if keys turn the depth, or else `nothing`.
    pub(super) fn mark(&self, nothing: &'static str) -> &'static str {
        let mut marked = self.knobs.topics.iter();
        if marked.any(|topic| **topic == *self.topic.name) {
            self.theme.glyph("▸", ">")
        } else {
            nothing
        }
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
            Line::raw(format!("{glyph} {text}"))
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
