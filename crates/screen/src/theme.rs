//! Colours and glyphs: every state has both, so that each is enough alone.

use ratatui::style::{Color, Modifier, Style};

/// Colours and glyphs. Nearly everybody can distinguish blue and orange. All colours are
/// from the part of the 256 that looks the same in every terminal, for good contrast with
/// the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    /// Whether to use colours (`NO_COLOR`).
    pub colour: bool,
    /// Whether to use ASCII only (`--ascii`).
    pub ascii: bool,
    /// The background.
    pub look: Look,
}

/// The background that colours are made for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Look {
    /// For dark backgrounds.
    #[default]
    Dark,
    /// For light backgrounds.
    Light,
    /// High contrast: the terminal's own two colours, nothing faint.
    High,
}

impl Look {
    /// Returns the colours of good news, alarms, motion and references; `None` for the terminal's
    /// own colour.
    fn palette(self) -> [Option<u8>; 4] {
        match self {
            Self::Dark => [Some(75), Some(214), Some(80), Some(247)],
            Self::Light => [Some(25), Some(94), Some(23), Some(240)],
            Self::High => [None; 4],
        }
    }
}

impl Theme {
    /// Good news.
    pub fn good(&self) -> Style {
        self.coloured(0)
    }

    /// Returns an alarm. Also bold and reversed, for terminals without colours.
    pub fn alarm(&self) -> Style {
        self.coloured(1)
            .add_modifier(Modifier::BOLD | Modifier::REVERSED)
    }

    /// Returns an alarm in lines, which would become blocks if reversed.
    pub fn alarm_line(&self) -> Style {
        self.coloured(1).add_modifier(Modifier::BOLD)
    }

    /// Motion: a message in flight, a node that ticks.
    pub fn active(&self) -> Style {
        self.coloured(2).add_modifier(Modifier::BOLD)
    }

    /// References: axes, limits, hints.
    pub fn faint(&self) -> Style {
        match (self.colour, self.look) {
            (_, Look::High) => Style::new(),
            (true, _) => self.coloured(3),
            (false, _) => Style::new().add_modifier(Modifier::DIM),
        }
    }

    /// Titles and keys.
    pub fn strong(&self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    fn coloured(&self, of_palette: usize) -> Style {
        match self.look.palette()[of_palette].filter(|_| self.colour) {
            Some(colour) => Style::new().fg(Color::Indexed(colour)),
            None => Style::new(),
        }
    }

    /// Returns `glyph`, or `plain` in ASCII.
    pub fn glyph(&self, glyph: &'static str, plain: &'static str) -> &'static str {
        if self.ascii { plain } else { glyph }
    }
}

/// Returns the red, green and blue of the colour with this number, from the cube and the greys of
/// the 256 colours.
pub fn rgb(index: u8) -> [u8; 3] {
    let level = |step: u8| if step == 0 { 0 } else { 55 + 40 * step };
    match index {
        232.. => [8 + 10 * (index - 232); 3],
        16.. => {
            let cube = index - 16;
            [cube / 36, cube / 6 % 6, cube % 6].map(level)
        }
        _ => [0; 3],
    }
}

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
    use super::*;
    use SurvivalLevel::{self, *};

    /// Backgrounds of the usual terminals: xterm, Windows Terminal, GNOME (its own and
    /// Ubuntu's), macOS.
    const DARK: [[u8; 3]; 5] = [
        [0, 0, 0],
        [12, 12, 12],
        [23, 20, 33],
        [48, 10, 36],
        [30, 30, 30],
    ];
    const LIGHT: [[u8; 3]; 3] = [[255, 255, 255], [255, 255, 221], [242, 242, 242]];

    /// Returns the relative luminance of WCAG 2.
    fn luminance(colour: [u8; 3]) -> f64 {
        let [red, green, blue] = colour.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.040_45 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    fn contrast(one: [u8; 3], other: [u8; 3]) -> f64 {
        let (one, other) = (luminance(one), luminance(other));
        (one.max(other) + 0.05) / (one.min(other) + 0.05)
    }

    #[test]
    fn every_colour_can_be_read_on_the_usual_backgrounds() {
        for (look, backgrounds) in [(Look::Dark, &DARK[..]), (Look::Light, &LIGHT)] {
            for colour in look.palette().into_iter().flatten() {
                for background in backgrounds {
                    let contrast = contrast(rgb(colour), *background);
                    assert!(contrast >= 4.5, "{colour} on {background:?}: {contrast:.1}");
                }
            }
        }
        assert!((contrast([0; 3], [255; 3]) - 21.0).abs() < 1e-9);
    }

    #[test]
    fn high_contrast_has_no_colours_and_nothing_faint() {
        let theme = Theme {
            colour: true,
            ascii: false,
            look: Look::High,
        };
        for style in [theme.good(), theme.alarm(), theme.active(), theme.faint()] {
            assert!(style.fg.is_none());
            assert!(!style.add_modifier.contains(Modifier::DIM));
        }
    }

    #[test]
    fn only_all_is_all_and_only_none_is_none() {
        let levels = [0, 1, 66, 67, 100, 133, 134, 199, 200].map(|b| SurvivalLevel::new(b, 200));
        assert_eq!(levels, [None, Few, Few, Half, Half, Half, Most, Most, All]);
        assert_eq!(SurvivalLevel::new(0, 0), Unknown);
    }
}
