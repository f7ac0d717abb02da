//! The panes and the pages over them: what has the focus, and what part of it is visible.

use crossterm::event::{KeyCode, KeyEvent};

use super::timeline::TimelineView;

/// A part of the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pane {
    /// The node graph.
    #[default]
    Graph,
    /// The plant, where the system has a picture of it.
    Plant,
    /// A signal over time, where the system has one.
    Signal,
    /// Topics, latency, nodes.
    Figures,
    /// Verdict and events.
    Events,
    /// Ticks and messages over a short stretch.
    Timeline,
}

impl Pane {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 6] = [
        Self::Graph,
        Self::Plant,
        Self::Signal,
        Self::Figures,
        Self::Events,
        Self::Timeline,
    ];

    /// Returns the next pane of the panes that `exist`.
    pub fn next(self, exist: impl Fn(Self) -> bool) -> Self {
        let mut after = Self::ALL
            .iter()
            .cycle()
            .skip(self as usize + 1)
            .take(Self::ALL.len())
            .copied();
        after.find(|pane| exist(*pane)).unwrap_or(self)
    }
}

/// The state of the panes' controls.
#[derive(Clone, Copy, Debug, Default)]
pub struct Panes {
    /// The focused pane.
    pub focus: Pane,
    /// Whether the focused pane has the whole screen.
    pub zoomed: bool,
    /// Position and zoom of the timeline.
    pub timeline: TimelineView,
    /// The page over the panes, and the number of its lines above the first that is shown.
    pub overlay: Option<(OverlayContent, usize)>,
}

/// What lies over the panes until a key closes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverlayContent {
    /// The keys and what they do.
    Keys,
    /// The words on the screen and what they mean.
    Glossary,
    /// What the pane in focus shows.
    Explained,
}

impl Panes {
    /// Sends `key` to the page over the panes; returns whether there is one.
    pub fn scroll(&mut self, key: &KeyEvent) -> bool {
        let Some((content, row)) = self.overlay else {
            return false;
        };
        let code = match key.code {
            KeyCode::Char('j') => KeyCode::Down,
            KeyCode::Char('k') => KeyCode::Up,
            code => code,
        };
        self.overlay = scrolled(row, code).map(|row| (content, row));
        true
    }
}

/// Rows that PgUp and PgDn move by.
pub const JUMP: usize = 10;

/// Returns the row after `row` for a key that moves; `None` for all others.
pub fn scrolled(row: usize, key: KeyCode) -> Option<usize> {
    Some(match key {
        KeyCode::Down => row.saturating_add(1),
        KeyCode::Up => row.saturating_sub(1),
        KeyCode::PageDown => row.saturating_add(JUMP),
        KeyCode::PageUp => row.saturating_sub(JUMP),
        KeyCode::Home => 0,
        _ => return None,
    })
}
