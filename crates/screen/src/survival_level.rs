//! The share of successful runs, as a glyph and a colour.

use ratatui::style::Style;

use crate::theme::Theme;

/// Levels of the share of successful runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurvivalLevel {
    /// No finished runs.
    Unknown,
    /// No successful run.
    None,
    /// Less than a third.
    Few,
    /// About half.
    Half,
    /// More than two thirds.
    Most,
    /// All runs.
    All,
}

impl SurvivalLevel {
    /// Creates the level for `held` of `runs`.
    pub fn new(held: usize, runs: usize) -> Self {
        match (held, runs) {
            (_, 0) => Self::Unknown,
            (0, _) => Self::None,
            (held, runs) if held >= runs => Self::All,
            (held, runs) if 3 * held < runs => Self::Few,
            (held, runs) if 3 * held <= 2 * runs => Self::Half,
            _ => Self::Most,
        }
    }

    /// Darker for more.
    pub fn glyph(self, theme: &Theme) -> &'static str {
        match self {
            Self::Unknown => " ",
            Self::None => theme.glyph("·", "."),
            Self::Few => theme.glyph("░", "-"),
            Self::Half => theme.glyph("▒", "="),
            Self::Most => theme.glyph("▓", "+"),
            Self::All => theme.glyph("█", "#"),
        }
    }

    /// Returns the legend of the glyphs.
    pub fn key(good: &str, theme: &Theme) -> String {
        let glyph = |level: Self| level.glyph(theme);
        format!(
            "{} none {good}, {} {} {} some, {} all",
            glyph(Self::None),
            glyph(Self::Few),
            glyph(Self::Half),
            glyph(Self::Most),
            glyph(Self::All)
        )
    }

    /// Returns whether most runs were successful; `None` if unknown.
    pub fn is_good(self) -> Option<bool> {
        match self {
            Self::Unknown => None,
            Self::None | Self::Few => Some(false),
            Self::Half | Self::Most | Self::All => Some(true),
        }
    }

    /// Returns `text` in its colour, if there are colours: blue and orange of the sixteen, as in
    /// the dashboard.
    pub fn paint(self, text: &str, theme: &Theme) -> String {
        match self.is_good().filter(|_| theme.colour) {
            None => text.to_owned(),
            Some(true) => format!("\x1b[34m{text}\x1b[0m"),
            Some(false) => format!("\x1b[33m{text}\x1b[0m"),
        }
    }

    /// Returns a bar of `width` columns, as long as the share of `held` in `runs`; only none is
    /// empty, and only all is full.
    pub fn bar(held: usize, runs: usize, width: usize, theme: &Theme) -> String {
        let level = Self::new(held, runs);
        let full = match level {
            Self::Unknown | Self::None => 0,
            Self::All => width,
            _ => (held * width * 2 / runs).div_ceil(2).clamp(1, width - 1),
        };
        let rest = match level {
            Self::Unknown => " ",
            _ => theme.glyph("·", "."),
        };
        let text = level.glyph(theme).repeat(full) + &rest.repeat(width - full);
        level.paint(&text, theme)
    }

    /// Blue where most runs are successful, orange where most are lost.
    pub fn style(self, theme: &Theme) -> Style {
        match self.is_good() {
            None => theme.faint(),
            Some(true) => theme.good(),
            Some(false) => theme.alarm_line(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::SurvivalLevel::{self, *};

    #[test]
    fn only_all_is_all_and_only_none_is_none() {
        let levels = [0, 1, 66, 67, 100, 133, 134, 199, 200].map(|b| SurvivalLevel::new(b, 200));
        assert_eq!(levels, [None, Few, Few, Half, Half, Half, Most, Most, All]);
        assert_eq!(SurvivalLevel::new(0, 0), Unknown);
    }
}
