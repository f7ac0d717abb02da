//! Colours and glyphs: every state has both, so that neither is needed alone.

use ratatui::{
    style::{Color, Modifier, Style},
    symbols::border,
};

/// How things look. Blue and orange can be told apart by nearly everybody; both
/// are among the sixteen colours that every terminal has in some shade, and
/// nothing is said about the background, which may be light or dark.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    /// Whether colours are used at all (`NO_COLOR`).
    pub colour: bool,
    /// Whether only ASCII is used (`--ascii`).
    pub ascii: bool,
}

impl Theme {
    /// Good news.
    pub fn good(&self) -> Style {
        self.coloured(Color::Blue)
    }

    /// An alarm. Bold and reversed as well, for terminals without colours.
    pub fn alarm(&self) -> Style {
        self.coloured(Color::Yellow)
            .add_modifier(Modifier::BOLD | Modifier::REVERSED)
    }

    /// An alarm in lines: reversed they would turn into blocks.
    pub fn alarm_line(&self) -> Style {
        self.coloured(Color::Yellow).add_modifier(Modifier::BOLD)
    }

    /// Motion: a message on its way, a node that ticks.
    pub fn active(&self) -> Style {
        self.coloured(Color::Cyan).add_modifier(Modifier::BOLD)
    }

    /// References: axes, limits, hints.
    pub fn faint(&self) -> Style {
        Style::new().add_modifier(Modifier::DIM)
    }

    /// Titles and keys.
    pub fn strong(&self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    fn coloured(&self, colour: Color) -> Style {
        if self.colour {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    /// `glyph`, or `plain` where only ASCII is used.
    pub fn glyph(&self, glyph: &'static str, plain: &'static str) -> &'static str {
        if self.ascii { plain } else { glyph }
    }

    /// Lines of boxes.
    pub fn border(&self) -> border::Set<'static> {
        if self.ascii {
            ASCII_BORDER
        } else {
            border::PLAIN
        }
    }
}

/// A box that any terminal can draw.
const ASCII_BORDER: border::Set<'static> = border::Set {
    top_left: "+",
    top_right: "+",
    bottom_left: "+",
    bottom_right: "+",
    vertical_left: "|",
    vertical_right: "|",
    horizontal_top: "-",
    horizontal_bottom: "-",
};
