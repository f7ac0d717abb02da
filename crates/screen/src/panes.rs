//! The panes, the pages over them, and what part of both is visible.

use crossterm::event::{KeyCode, KeyEvent};

use crate::timeline::TimelineView;

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
        Self::ALL
            .iter()
            .cycle()
            .skip(self as usize + 1)
            .take(Self::ALL.len())
            .copied()
            .find(|pane| exist(*pane))
            .unwrap_or(self)
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

/// A page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Paragraphs, to be wrapped.
    pub text: String,
    /// In their place keys and their actions, the most important first, or words and their
    /// meanings: in two columns if one is too high.
    pub rows: Vec<(&'static str, &'static str)>,
    /// The text of the input line, if any.
    pub typed: Option<String>,
    /// Keys and their actions, below it.
    pub hint: &'static str,
    /// As spans of the bottom line of the screen.
    pub keys: &'static [(&'static str, &'static str)],
    /// Number of lines scrolled past.
    pub scroll: usize,
    /// Whether it is at the bottom, so that something of the area stays in sight, and not
    /// in the middle.
    pub aside: bool,
}

impl Page {
    /// Creates a page of paragraphs.
    pub fn text(title: impl Into<String>, text: String, hint: &'static str) -> Self {
        Self {
            title: title.into(),
            text,
            hint,
            ..Self::default()
        }
    }

    /// Creates a page of keys or words.
    pub fn rows(title: &str, rows: Vec<(&'static str, &'static str)>) -> Self {
        Self {
            title: title.to_owned(),
            rows,
            ..Self::default()
        }
    }
}
