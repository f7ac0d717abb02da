//! The keys of the panes, the same on every screen.

use crate::dashboard::{focus::Pane, overlay::OverlayContent};

/// Actions on the panes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaneAction {
    /// Focus the next pane.
    Next,
    /// Focus a pane.
    Focus(Pane),
    /// Give the focused pane the whole screen, or take it back.
    Zoom,
    /// Select the next push in the timeline, or the one before.
    Push(bool),
    /// Show a shorter stretch of the timeline, or a longer one.
    Span(bool),
    /// Open a page over the panes.
    Open(OverlayContent),
}
