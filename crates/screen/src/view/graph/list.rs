//! Topics as text: on their lines, or in a list without room for that.

use std::time::Duration;

use ratatui::{layout::Rect, style::Style, text::Line};

use super::{
    GraphView,
    route::Routes,
    text::{clip, count, fitting, line, pad, width},
};
use crate::{
    frame::{FrameData, TopicData},
    view::sheet::Sheet,
};

/// Maximum width of a name in the list.
const LIST_NAME: usize = 16;
/// Width of the figures after it, of the word after the figures, and of the age at the end.
const LIST_FIGURES: usize = 26;
const LIST_WORD: usize = 8;
const LIST_AGE: usize = 15;
/// Columns between entries of the list.
const LIST_SPACE: usize = 3;

/// Returns the number of rows of a list of the topics of `routes` in `room` columns.
pub(super) fn rows(frame: &FrameData, routes: &Routes, room: usize) -> usize {
    let topics: Vec<&TopicData> = routes
        .all
        .iter()
        .filter(|route| !route.dangles())
        .map(|route| &frame.topics[route.topic])
        .collect();
    let name = name_width(topics.iter().copied());
    topics.len().div_ceil(side_by_side(name, room))
}

/// Returns the number of entries about `topics` that fit into `area`.
pub(super) fn room(topics: &[TopicText<'_>], area: Rect) -> usize {
    let name = name_width(topics.iter().map(|text| text.topic));
    side_by_side(name, usize::from(area.width)) * usize::from(area.height)
}

fn name_width<'a>(topics: impl Iterator<Item = &'a TopicData>) -> usize {
    topics
        .map(|topic| width(&topic.name))
        .max()
        .unwrap_or(0)
        .min(LIST_NAME)
}

/// Returns the number of entries with names of this width beside each other.
fn side_by_side(name: usize, room: usize) -> usize {
    ((room + LIST_SPACE) / (name + LIST_FIGURES + LIST_SPACE)).max(1)
}

/// Writes as many `topics` side by side and below each other as there is room for.
pub(super) fn draw(topics: &[TopicText<'_>], sheet: &mut Sheet<'_>) {
    let name = name_width(topics.iter().map(|text| text.topic));
    let room = sheet.width();
    let across = side_by_side(name, room);
    let wide = (room + LIST_SPACE) / across - LIST_SPACE.min(room / across);
    let cells = across * sheet.height();
    for (number, topic) in topics.iter().take(cells).enumerate() {
        let x = number % across * (wide + LIST_SPACE);
        let mut cell = sheet.cells(x, number / across, wide);
        match topics.len() - number {
            left if number + 1 == cells && left > 1 => {
                let text = format!("+{left} topics");
                cell.put(0, 0, &text, cell.theme.faint());
            }
            _ => entry(topic, name, &mut cell),
        }
    }
}

fn entry(topic: &TopicText<'_>, name: usize, cell: &mut Sheet<'_>) {
    let (theme, room) = (cell.theme, cell.width());
    let full = name + LIST_FIGURES;
    let aged = room >= full + LIST_WORD + LIST_AGE;
    let depth = if room >= full {
        format!(" {}", topic.depth())
    } else {
        String::new()
    };
    let name = pad(&topic.topic.name, name, theme) + topic.mark(" ");
    let figures = format!("{}{depth} ", topic.rate());
    let used = width(&name) + width(&figures);
    let left = room.saturating_sub(used + if aged { LIST_AGE + 1 } else { 0 });
    let drops = fitting(topic.drops_in_words(), left);
    let whole = line([(name, theme.strong()), (figures + &drops, Style::new())]);
    cell.line(0, 0, &whole);
    if aged {
        let x = whole.width().max(full + LIST_WORD + 1);
        cell.put(x, 0, &topic.age(), Style::new());
    }
}

/// Periods after which the next message is overdue.
const OVERDUE: f64 = 1.5;

/// Minimum room for text on a line.
pub(super) const NARROW: usize = 13;

/// Maximum width of a count.
pub(super) const COUNT: usize = 5;

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

/// The figures of a topic in words.
#[derive(Clone, Copy)]
pub(super) struct TopicText<'a> {
    /// The graph.
    pub(super) view: GraphView<'a>,
    /// The topic.
    pub(super) topic: &'a TopicData,
}

impl TopicText<'_> {
    /// Returns the text of one row of a label, `room` columns wide.
    pub(super) fn line(&self, row: LabelRow, room: usize) -> Line<'static> {
        let strong = self.view.theme.strong();
        let name = format!("{}{}", self.mark(""), self.topic.name);
        match row {
            LabelRow::Name => line([(name, strong)]),
            LabelRow::Rate => Line::raw(self.rate()),
            LabelRow::Depth => Line::raw(format!("  {}", self.depth())),
            LabelRow::RateAndDepth => Line::raw(format!("{}  {}", self.rate(), self.depth())),
            LabelRow::Drops => Line::raw(self.drops(room)),
            LabelRow::Age => Line::raw(self.age()),
            LabelRow::NameAndRate => {
                let rate = format!(" {}", self.rate());
                let fits = width(&name) + width(&rate) <= room;
                let rate = if fits { rate } else { String::new() };
                line([(name, strong), (rate, Style::new())])
            }
            LabelRow::Short => {
                let drops = match self.topic.dropped {
                    0 => String::new(),
                    dropped => format!(" ✖{}", count(dropped, COUNT)),
                };
                let left = room.saturating_sub(width(&drops));
                let rate = format!(" {:.0}/s", self.topic.per_second);
                let fits = width(&name) + width(&rate) <= left;
                let rate = if fits { rate } else { String::new() };
                let name = clip(&name, left.saturating_sub(width(&rate)), self.view.theme);
                line([(name, strong), (rate + &drops, Style::new())])
            }
        }
    }

    /// Drops, with the losses of links and matches where there are any.
    fn drops(&self, room: usize) -> String {
        let dropped = count(self.topic.dropped, COUNT);
        let parts = [
            (self.topic.lost, "lost"),
            (self.topic.overtaken, "late"),
            (self.topic.unmatched, "unmatched"),
        ]
        .into_iter()
        .filter(|(number, _)| *number > 0)
        .map(|(number, word)| format!("{} {word}", count(number, COUNT)));
        let lost = parts.collect::<Vec<_>>().join(" ");
        let with_losses = [
            format!("  {dropped} dropped {lost}"),
            format!("  {lost}"),
            lost.clone(),
        ]
        .into_iter()
        .filter(|_| !lost.is_empty());
        let text = fitting(with_losses.chain(self.drops_in_words()), room);
        text.trim_end().to_owned()
    }

    /// Returns the drops in fewer and fewer columns, never as a number alone.
    pub(super) fn drops_in_words(&self) -> impl Iterator<Item = String> {
        let dropped = count(self.topic.dropped, COUNT);
        let short = (self.topic.dropped > 0).then(|| format!(" ✖{dropped}"));
        let words = [
            format!("  {dropped} dropped"),
            format!("  {dropped} drops"),
            format!(" {dropped} drops"),
        ];
        words.into_iter().chain(short)
    }

    /// Returns the mark of a topic with the focus of the knob keys, or else `nothing`.
    pub(super) fn mark(&self, nothing: &'static str) -> &'static str {
        let mut marked = self.view.knobs.topics.iter();
        if marked.any(|topic| **topic == *self.topic.name) {
            "▸"
        } else {
            nothing
        }
    }

    /// Returns messages per second, in a constant width of seven columns.
    pub(super) fn rate(&self) -> String {
        let rate = self.topic.per_second;
        let decimals = usize::from(rate < 999.95);
        format!("{rate:>5.decimals$}/s")
    }

    /// Returns the depth of the queue.
    pub(super) fn depth(&self) -> String {
        format!("depth {:<3}", self.topic.depth)
    }

    /// Returns the age of the newest message, marked where the next one is overdue.
    pub(super) fn age(&self) -> String {
        let Some(held) = self.topic.held else {
            return String::new();
        };
        let sign = if self.is_overdue(held) { "◷" } else { " " };
        match held.as_millis() {
            ms @ 0..=9_999 => format!("{sign} {ms:>4} ms ago"),
            _ => format!("{sign} {:>5.1} s ago", held.as_secs_f64().min(99_999.0)),
        }
    }

    fn is_overdue(&self, held: Duration) -> bool {
        let shortest = self
            .topic
            .publishers
            .iter()
            .filter_map(|node| self.view.frame.nodes.get(*node))
            .map(|node| node.hz.period())
            .min();
        shortest.is_some_and(|period| held.as_secs_f64() > OVERDUE * period.as_secs_f64())
    }
}
