//! The graph as it runs: nodes as boxes, topics as lines with messages on
//! them. Laid out from who publishes and who reads, whatever the robot is.

mod label;
mod label_writer;
mod layers;
mod list;
mod nodes;
mod place;
mod route;
mod text;
mod wires;

use ratatui::{buffer::Buffer, layout::Rect, text::Span};

use self::{label::Labels, place::GraphLayout, wires::Wires};
use super::{pane, theme::Theme};
use crate::dashboard::{frame::FrameData, knob_focus::KnobFocus};

/// Draws the graph, with marks on what `knobs` are of.
pub fn render(
    frame: &FrameData,
    knobs: &KnobFocus,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let inside = Rect {
        width: area.width.saturating_sub(2),
        height: area.height.saturating_sub(2),
        ..area
    };
    let layout = GraphLayout::of(frame, inside.as_size());
    let more = match layout.hidden {
        0 => String::new(),
        hidden => format!(" +{hidden} more "),
    };
    let more = Span::styled(more, theme.faint());
    let inner = pane::border("1 graph", more, theme, focused, area, buf);
    // Part of the area may lie outside the screen, then nothing fits as planned.
    if inner.as_size() != inside.as_size() {
        return;
    }
    nodes::draw(frame, knobs, &layout, theme, inner, buf);
    let wires = Wires::of(frame, &layout);
    wires.draw(frame, theme, inner, buf);
    Labels::new(frame, knobs, theme, &layout, &wires, inner).draw(buf);
}

#[cfg(test)]
mod tests;
