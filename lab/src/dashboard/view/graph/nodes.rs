//! The box of a node.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::{Line, Span},
    widgets::{Block, Widget},
};

use super::{GraphView, place::GraphLayout, text::count};
use crate::{
    dashboard::{
        frame::{Health, NodeData},
        view::pane::{self, fitting},
    },
    theme::Theme,
};

/// Minimum length of a row with a margin in a box.
const ROOM: usize = 14;

/// Draws the boxes of all visible nodes.
pub(super) fn draw(view: GraphView<'_>, layout: &GraphLayout, area: Rect, buf: &mut Buffer) {
    let theme = view.theme;
    let boxes = layout.boxes.iter();
    let boxes = boxes.map(|b| (&view.frame.nodes[b.node], b.rect));
    // All nodes have a rate or none: a single one would look like a mistake.
    let with_rate = boxes.clone().all(|(node, rect)| {
        let text = format!("{} {}", node.name, hz(node));
        pane::width(&text) <= pill_room(rect)
    });
    for (node, rect) in boxes {
        let rect = Rect {
            x: rect.x.saturating_add(area.x),
            y: rect.y.saturating_add(area.y),
            ..rect
        };
        let rect = rect.intersection(area);
        let mark = if *view.knobs.node == *node.name {
            theme.glyph("▸", ">")
        } else {
            " "
        };
        if rect.height < 3 {
            pill(node, mark, theme, with_rate, rect, buf);
        } else {
            full(node, mark, theme, rect, buf);
        }
    }
}

/// A node with name, rate, overruns, caption and tick marker; `mark` comes before the name.
fn full(node: &NodeData, mark: &str, theme: &Theme, rect: Rect, buf: &mut Buffer) {
    let room = usize::from(rect.width.saturating_sub(2));
    let name = match room.checked_sub(2) {
        Some(less) if pane::width(&node.name) <= less => format!("{mark}{} ", node.name),
        _ => format!("{}{}", mark.trim(), node.name),
    };
    let title = Span::styled(pane::clip(&name, room, theme), theme.strong());
    let block = Block::bordered().border_set(theme.border()).title(title);
    let mut inner = block.inner(rect);
    block.render(rect, buf);
    if room > ROOM {
        (inner.x, inner.width) = (inner.x + 1, inner.width - 2);
    }
    let room = usize::from(inner.width);
    let beneath = inner.height > 1;
    let mut lines = vec![rate(node, theme, room, !beneath || node.place.is_some())];
    if beneath {
        lines.push(overruns(node, theme, room));
    }
    lines.extend(node.caption.map(|text| caption(text, theme, room)));
    for (row, line) in lines.into_iter().enumerate() {
        line.render(pane::row(inner, row), buf);
    }
}

/// Width for name and rate of a node in one row.
fn pill_room(rect: Rect) -> usize {
    usize::from(rect.width.saturating_sub(4))
}

/// A node in one row.
fn pill(node: &NodeData, mark: &str, theme: &Theme, with_rate: bool, rect: Rect, buf: &mut Buffer) {
    let room = pill_room(rect);
    let beside = room.saturating_sub(pane::width(&node.name) + 1);
    let rate = match (node.health.word(beside), with_rate) {
        (Some(word), _) => word.to_owned(),
        (None, true) => hz(node),
        (None, false) => String::new(),
    };
    let left = room.saturating_sub(pane::width(&rate));
    let name = pane::clip(&node.name, left, theme);
    let blank = " ".repeat(left.saturating_sub(pane::width(&name)));
    let (glyph, style) = tick(node, theme);
    let spans = [
        Span::raw("["),
        Span::styled(glyph, style),
        Span::styled(mark, theme.strong()),
        Span::styled(name, theme.strong()),
        Span::raw(format!("{blank}{rate}]")),
    ];
    Line::from_iter(spans).render(rect, buf);
}

/// The tick marker and the rate, with overruns if they have no row of their own.
fn rate(node: &NodeData, theme: &Theme, room: usize, with_overruns: bool) -> Line<'static> {
    let (glyph, style) = tick(node, theme);
    let glyph = Span::styled(glyph, style);
    if let Some(word) = node.health.word(room.saturating_sub(1)) {
        let word = fitting(
            [format!(" {word}"), word.to_owned()],
            room.saturating_sub(1),
        );
        return Line::from_iter([glyph, Span::styled(word, theme.strong())]);
    }
    let hz = hz(node);
    let rate = fitting([format!(" {hz}"), hz], room.saturating_sub(1));
    let left = room.saturating_sub(1 + pane::width(&rate));
    let mut line = Line::from_iter([glyph, Span::raw(rate)]);
    if with_overruns && node.overruns > 0 {
        let text = format!("{} over", count(node.overruns));
        if pane::width(&text) < left {
            line.push_span(Span::raw(" "));
            line.push_span(Span::styled(text, theme.strong()));
        }
    }
    line
}

fn overruns(node: &NodeData, theme: &Theme, room: usize) -> Line<'static> {
    if let Some(place) = &node.place {
        let place = pane::clip(place, room, theme);
        return Line::from(Span::styled(place, theme.faint()));
    }
    let count = count(node.overruns);
    if node.overruns == 0 {
        let text = fitting(
            ["  0 overruns", "0 overruns", "0 over"].map(str::to_owned),
            room,
        );
        return Line::from(Span::styled(text, theme.faint()));
    }
    let unit = if node.overruns == 1 {
        "overrun"
    } else {
        "overruns"
    };
    let texts = [
        format!("  {count} {unit}"),
        format!("  {count} over"),
        format!("{count} over"),
        count,
    ];
    Line::from(Span::styled(fitting(texts, room), theme.strong()))
}

/// A caption, or its verb if that is all that fits.
fn caption(text: &str, theme: &Theme, room: usize) -> Line<'static> {
    let verb = text.split(' ').next().unwrap_or_default();
    let texts = [format!("  {text}"), text.to_owned(), format!("  {verb}")];
    Line::from(Span::styled(fitting(texts, room), theme.faint()))
}

fn tick(node: &NodeData, theme: &Theme) -> (&'static str, Style) {
    match node.health {
        Health::Works => {}
        Health::Crashed | Health::Gone => return (theme.glyph("✖", "x"), theme.strong()),
        Health::Hangs => return (theme.glyph("◔", "~"), theme.strong()),
    }
    if node.lit {
        (theme.glyph("●", "*"), theme.active())
    } else {
        (theme.glyph("○", "o"), theme.faint())
    }
}

/// The rate with as many digits as needed: "50 Hz", "7.5 Hz", "0.001 Hz".
fn hz(node: &NodeData) -> String {
    let hz = node.hz.get();
    let decimals = if hz >= 100.0 {
        1
    } else if hz >= 1.0 {
        2
    } else {
        3
    };
    format!("{} Hz", pane::short(hz, decimals))
}
