//! What lies over the panes until a key closes it: the keys, or what a pane shows.

use crossterm::event::{KeyCode, KeyEvent};

/// Rows that PgUp and PgDn move by.
const JUMP: usize = 8;

/// The keys of an overlay, for the bottom line.
pub const HINTS: &[(&str, &str)] = &[
    ("↑ ↓ PgUp PgDn", "scroll"),
    ("Esc", "close"),
    ("any other key", "close"),
];

/// An overlay that is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    /// The keys and what they do.
    Help {
        /// Rows above the first that is shown.
        scroll: usize,
    },
    /// What the pane in focus shows.
    Explained {
        /// Lines above the first that is shown.
        scroll: usize,
    },
}

impl Overlay {
    /// The same after `key`; `None` if that closes it.
    pub fn after(self, key: &KeyEvent) -> Option<Self> {
        let moved = |scroll: usize| match key.code {
            KeyCode::Down | KeyCode::Char('j') => Some(scroll.saturating_add(1)),
            KeyCode::Up | KeyCode::Char('k') => Some(scroll.saturating_sub(1)),
            KeyCode::PageDown => Some(scroll.saturating_add(JUMP)),
            KeyCode::PageUp => Some(scroll.saturating_sub(JUMP)),
            KeyCode::Home => Some(0),
            _ => None,
        };
        Some(match self {
            Self::Help { scroll } => Self::Help {
                scroll: moved(scroll)?,
            },
            Self::Explained { scroll } => Self::Explained {
                scroll: moved(scroll)?,
            },
        })
    }

    /// How far the help is scrolled, if that is open.
    pub fn help(self) -> Option<usize> {
        match self {
            Self::Help { scroll } => Some(scroll),
            Self::Explained { .. } => None,
        }
    }

    /// How far an explanation is scrolled, if that is open.
    pub fn explained(self) -> Option<usize> {
        match self {
            Self::Explained { scroll } => Some(scroll),
            Self::Help { .. } => None,
        }
    }
}
