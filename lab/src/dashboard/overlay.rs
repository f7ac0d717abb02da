//! What lies over the panes until a key closes it: the keys, the glossary, or what a pane
//! shows.

use crossterm::event::{KeyCode, KeyEvent};

/// Rows that PgUp and PgDn move by.
pub const JUMP: usize = 10;

/// The keys of an overlay, for the bottom line.
pub const HINTS: &[(&str, &str)] = &[
    ("↑ ↓ PgUp PgDn", "scroll"),
    ("Esc", "close"),
    ("any other key", "close"),
];

/// What an overlay shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverlayContent {
    /// The keys and what they do.
    Keys,
    /// The words on the screen and what they mean.
    Glossary,
    /// What the pane in focus shows.
    Explained,
}

/// An overlay that is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overlay {
    /// What it shows.
    pub content: OverlayContent,
    /// Lines above the first that is shown.
    pub scroll: usize,
}

impl Overlay {
    /// An overlay from its first line on.
    pub fn of(content: OverlayContent) -> Self {
        Self { content, scroll: 0 }
    }

    /// The same after `key`; `None` if that closes it.
    pub fn after(self, key: &KeyEvent) -> Option<Self> {
        let code = match key.code {
            KeyCode::Char('j') => KeyCode::Down,
            KeyCode::Char('k') => KeyCode::Up,
            code => code,
        };
        let scroll = scrolled(self.scroll, code)?;
        Some(Self { scroll, ..self })
    }
}

/// The row after `row` for a key that moves; `None` for all others.
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
