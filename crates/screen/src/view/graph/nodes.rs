//! The box of a node.

use ratatui::{
    style::Style,
    text::{Line, Span},
    widgets::Block,
};

use super::{
    GraphView,
    place::GraphLayout,
    text::{clip, count, fitting, line, pad, short, width},
    topic_text::COUNT,
};
use crate::{
    frame::{Health, NodeData},
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
