//! A list of the topics without room for text on their lines.

use ratatui::{layout::Rect, style::Style};

use super::{
    route::Routes,
    text::{fitting, line, pad, width},
    topic_text::TopicText,
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
    let read = routes.all.iter().filter(|route| !route.dangles());
    let topics: Vec<&TopicData> = read.map(|route| &frame.topics[route.topic]).collect();
    let name = name_width(topics.iter().copied());
    topics.len().div_ceil(side_by_side(name, room))
}

/// Returns the number of entries about `topics` that fit into `area`.
pub(super) fn room(topics: &[TopicText<'_>], area: Rect) -> usize {
    let name = name_width(topics.iter().map(|text| text.topic));
    side_by_side(name, usize::from(area.width)) * usize::from(area.height)
}

fn name_width<'a>(topics: impl Iterator<Item = &'a TopicData>) -> usize {
    let names = topics.map(|topic| width(&topic.name));
    names.max().unwrap_or(0).min(LIST_NAME)
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
