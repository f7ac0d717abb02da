//! The panes' controls, the same on every screen: which pane has the focus, what part of
//! the timeline is visible, and which page lies over the panes.

use crossterm::event::KeyEvent;
use ratelab::Time;
use ratelab_study::system::System;

use super::{
    explain,
    focus::Pane,
    frame::FrameData,
    keys::PaneAction,
    overlay::{self, Overlay, OverlayContent},
    sampler::{self, RunSource},
    timeline::TimelineView,
    view::{Page, ScreenState, glossary},
};

/// The state of the panes' controls.
#[derive(Clone, Copy, Debug)]
pub struct Panes {
    /// The focused pane.
    pub focus: Pane,
    /// Whether the focused pane has the whole screen.
    pub zoomed: bool,
    /// Position and zoom of the timeline.
    pub timeline: TimelineView,
    /// The page over the panes.
    pub overlay: Option<Overlay>,
}

impl Default for Panes {
    fn default() -> Self {
        Self {
            focus: Pane::Graph,
            zoomed: false,
            timeline: TimelineView::default(),
            overlay: None,
        }
    }
}

impl Panes {
    /// The controls after `action` on a `screen` of `run` at run time `now`.
    ///
    /// # Errors
    /// A notice, if there is no such pane.
    pub fn after(
        mut self,
        action: PaneAction,
        screen: Option<&ScreenState<'_>>,
        (run, now): (&impl RunSource, Time),
    ) -> Result<Self, &'static str> {
        let has = |pane| screen.is_some_and(|screen| screen.has(pane));
        match action {
            PaneAction::Next => self.focus = self.focus.next(has),
            PaneAction::Focus(pane) if has(pane) => self.focus = pane,
            PaneAction::Focus(_) => return Err("this system has nothing to show there"),
            PaneAction::Push(later) => sampler::select(run, &mut self.timeline, now, later),
            PaneAction::Span(closer) => self.timeline.zoom(closer),
            PaneAction::Zoom => self.zoomed = !self.zoomed,
            PaneAction::Open(content) => self.overlay = Some(Overlay::of(content)),
        }
        Ok(self)
    }

    /// Sends `key` to the page over the panes; returns whether there is one.
    pub fn scroll(&mut self, key: &KeyEvent) -> bool {
        let open = self.overlay;
        self.overlay = open.and_then(|overlay| overlay.after(key));
        open.is_some()
    }

    /// The page over the panes, if one is open: of the keys in `rows`, of words, or about the
    /// focused pane of `system`.
    pub fn page(
        &self,
        rows: impl FnOnce() -> Vec<(String, String)>,
        system: &dyn System,
        frame: &FrameData,
    ) -> Option<Page> {
        let Overlay { content, scroll } = self.overlay?;
        let owned = |(word, meaning): (&str, &str)| (word.to_owned(), meaning.to_owned());
        let page = match content {
            OverlayContent::Keys => Page::rows("keys", rows()),
            OverlayContent::Glossary => Page::rows("words", glossary().map(owned).collect()),
            OverlayContent::Explained => {
                let signal = sampler::signal(system).map(|signal| signal.name);
                let (title, text) = explain::explained(self.focus, signal, frame);
                Page::text(title, text, "any other key closes")
            }
        };
        Some(Page {
            keys: overlay::HINTS,
            scroll,
            ..page
        })
    }
}
