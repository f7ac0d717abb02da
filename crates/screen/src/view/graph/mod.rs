//! The running graph: nodes as boxes, and topics as lines from publishers to readers,
//! with messages on them.

mod label;
mod layers;
mod list;
mod nodes;
mod place;
mod route;
mod router;

use ratatui::{layout::Size, text::Span};

use self::{place::GraphLayout, router::Router};
use super::{sheet::Sheet, text};
use crate::{frame::FrameData, knobs::KnobFocus, theme::Theme};
use list::TopicText;

/// A graph to draw.
#[derive(Clone, Copy)]
struct GraphView<'a> {
    frame: &'a FrameData,
    /// The node and the topics to mark.
    knobs: &'a KnobFocus,
    theme: &'a Theme,
}

impl<'a> GraphView<'a> {
    fn topic(self, index: usize) -> TopicText<'a> {
        TopicText {
            view: self,
            topic: &self.frame.topics[index],
        }
    }
}

/// Draws the graph, with marks on the node and the topics in `knobs`.
pub fn render(frame: &FrameData, knobs: &KnobFocus, sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let [width, height] = [sheet.area.width, sheet.area.height].map(|edge| edge.saturating_sub(2));
    let layout = GraphLayout::new(frame, Size::new(width, height));
    let more = match layout.hidden {
        0 => String::new(),
        hidden => format!(" +{hidden} more "),
    };
    let mut pane = sheet.boxed("1 graph", Span::styled(more, theme.faint()));
    let view = GraphView {
        frame,
        knobs,
        theme,
    };
    nodes::draw(view, &layout, &mut pane);
    let router = Router::new(view, &layout);
    nodes::draw_wires(frame, &router.wires(), &mut pane);
    router.label(&mut pane);
}

#[cfg(test)]
mod tests;
