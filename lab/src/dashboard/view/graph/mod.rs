//! The running graph: nodes as boxes, and topics as lines from publishers to readers,
//! with messages on them.

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
use super::pane;
use crate::{
    dashboard::{
        frame::{FrameData, TopicData},
        knobs::KnobFocus,
    },
    theme::Theme,
};

/// A graph to draw.
#[derive(Clone, Copy)]
struct GraphView<'a> {
    frame: &'a FrameData,
    /// The node and the topics to mark.
    knobs: &'a KnobFocus,
    theme: &'a Theme,
}

impl<'a> GraphView<'a> {
    fn topic(&self, index: usize) -> &'a TopicData {
        &self.frame.topics[index]
    }
}

/// Draws the graph, with marks on the node and the topics in `knobs`.
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
    // If part of the area is off the screen, the layout does not fit.
    if inner.as_size() != inside.as_size() {
        return;
    }
    let view = GraphView {
        frame,
        knobs,
        theme,
    };
    nodes::draw(view, &layout, inner, buf);
    let wires = Wires::of(frame, &layout);
    wires.draw(view, inner, buf);
    let labels = Labels {
        view,
        layout: &layout,
        wires: &wires,
        area: inner,
    };
    labels.draw(buf);
}

#[cfg(test)]
mod tests;
