//! The page over the panes: of keys, of words, about a pane, or of the exercises.

use super::App;
use crate::{
    explain::{Explained, explained},
    frame::FrameData,
    page::Page,
    panes::OverlayContent,
    run::{signal, signal_is_push_age},
    view::glossary,
};

/// The keys of a page over the panes, for the bottom line.
const HINTS: &[(&str, &str)] = &[
    ("↑ ↓ PgUp PgDn", "scroll"),
    ("Esc", "close"),
    ("any other key", "close"),
];

impl App {
    /// Returns the open page, if any.
    pub(super) fn page(&self, frame: &FrameData) -> Option<Page> {
        let Some((content, scroll)) = self.shown.panes.overlay else {
            let panel = self.course.panel.as_ref().filter(|_| self.is_live());
            return panel.map(|panel| panel.page());
        };
        let page = match content {
            OverlayContent::Keys => {
                Page::rows("keys", self.keys().rows(|need| self.has_what(need)))
            }
            OverlayContent::Glossary => {
                Page::rows("words", glossary(frame.plan.is_some()).collect())
            }
            OverlayContent::Explained => {
                let mut events = self.shown.events.iter();
                let signal = signal(self.system());
                let about = Explained {
                    signal: signal.as_ref().map(|signal| &*signal.name),
                    signal_is_push_age: signal_is_push_age(self.system()),
                    any_event: events.any(|event| event.at <= frame.now),
                };
                let (title, text) = explained(self.shown.panes.focus, about, frame);
                Page::text(title, text, "any other key closes")
            }
        };
        Some(Page {
            keys: HINTS,
            scroll,
            ..page
        })
    }
}
