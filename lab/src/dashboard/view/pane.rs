//! Parts shared by panes: the box around them, rows, and fitted text.

use std::borrow::Cow;

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::Style,
    text::{Line, Span},
    widgets::{Block, Widget},
};

use crate::{theme::Theme, wrap::options};

/// Draws the box of a pane and returns the area inside. `right` is left out if it would
/// touch the title.
pub fn border(
    title: &str,
    right: Span<'_>,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) -> Rect {
    let style = if focused {
        theme.strong()
    } else {
        theme.faint()
    };
    let room = usize::from(area.width.saturating_sub(2));
    let title = clip(title, room, theme);
    let both = Span::raw(&*title).width() + right.width() + 2;
    let mut block = Block::bordered()
        .border_set(theme.border())
        .border_style(theme.faint())
        .title(Span::styled(title, style));
    if right.width() > 0 && both <= room {
        block = block.title(Line::from(right).right_aligned());
    }
    let inner = block.inner(area);
    block.render(area, buf);
    inner.intersection(buf.area)
}

/// Row number `row` of `area`; empty beyond the last row.
pub fn row(area: Rect, row: usize) -> Rect {
    rows(area, row, 1)
}

/// At most `count` rows of `area`, from row `first` on.
pub fn rows(area: Rect, first: usize, count: usize) -> Rect {
    let first = clamp(first).min(area.height);
    let height = clamp(count).min(area.height - first);
    Rect {
        y: area.y + first,
        height,
        ..area
    }
}

/// `row` from column `x` on.
pub fn from(row: Rect, x: usize) -> Rect {
    let skip = clamp(x).min(row.width);
    Rect {
        x: row.x + skip,
        width: row.width - skip,
        ..row
    }
}

/// Draws `text` at column `x` of `row`, cut at the end of the row.
pub fn put(text: &str, style: Style, x: usize, row: Rect, buf: &mut Buffer) {
    // A span, as the style of a line would reach to the end of the row.
    Span::styled(text, style).render(from(row, x), buf);
}

/// Draws the first of `parts` that fit between columns `x` and `end` of `row`, with `gap`
/// blanks in between; returns the first column after them.
pub fn in_a_row<'a>(
    parts: impl IntoIterator<Item = Line<'a>>,
    gap: usize,
    (mut x, end): (usize, usize),
    row: Rect,
    buf: &mut Buffer,
) -> usize {
    for part in parts {
        let wide = part.width();
        if x + wide > end {
            break;
        }
        part.render(from(row, x), buf);
        x += wide + gap;
    }
    x
}

/// A length on the screen, which cannot exceed `u16`.
pub fn clamp(length: usize) -> u16 {
    u16::try_from(length).unwrap_or(u16::MAX)
}

/// A box of this size in the middle of `area`, limited to `area`.
pub fn centred(width: usize, height: usize, area: Rect) -> Rect {
    let width = clamp(width).min(area.width);
    let height = clamp(height).min(area.height);
    Rect {
        x: area.x + (area.width - width) / 2,
        y: area.y + (area.height - height) / 2,
        width,
        height,
    }
}

/// The end of `text`, in `room` characters.
pub fn tail(text: &str, room: usize) -> String {
    let hidden = text.chars().count().saturating_sub(room);
    text.chars().skip(hidden).collect()
}

/// `text` in lines of `room` columns, wrapped between words if possible.
pub fn broken(text: &str, room: usize) -> Vec<String> {
    let lines = textwrap::wrap(text, options(room)).into_iter();
    lines.map(Cow::into_owned).collect()
}

/// Width of `text` (columns).
pub fn width(text: &str) -> usize {
    Span::raw(text).width()
}

/// `text` cut to `room` columns, with a sign at the cut.
pub fn clip(text: &str, room: usize, theme: &Theme) -> String {
    let text = plain(text, theme);
    if width(&text) <= room {
        return text.into_owned();
    }
    let sign = theme.glyph("…", "...");
    let sign = &sign[..if width(sign) <= room { sign.len() } else { 0 }];
    let mut cut = String::new();
    for letter in text.chars() {
        cut.push(letter);
        if width(&cut) + width(sign) > room {
            cut.pop();
            break;
        }
    }
    cut + sign
}

/// The first of `texts` that fits into `room`; empty if none fits.
pub fn fitting(texts: impl IntoIterator<Item = String>, room: usize) -> String {
    let mut fitting = texts.into_iter().filter(|text| width(text) <= room);
    fitting.next().unwrap_or_default()
}

/// `value` with at most some `decimals`, one or more, and as many as needed.
pub fn short(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// `text` in ASCII if the theme asks for that: the program's own symbols by their usual
/// spellings, any other as a question mark.
pub fn plain<'a>(text: &'a str, theme: &Theme) -> Cow<'a, str> {
    if !theme.ascii || text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '×' => out.push('x'),
            '✖' => out.push('x'),
            '⚠' => out.push('!'),
            '±' => out.push_str("+-"),
            '→' => out.push_str("->"),
            '←' => out.push_str("<-"),
            '↑' => out.push_str("up"),
            '↓' => out.push_str("down"),
            '−' | '–' | '—' => out.push('-'),
            '┊' => out.push('|'),
            '╌' => out.push(':'),
            'µ' | 'μ' => out.push('u'),
            '°' => out.push_str(" deg"),
            '≥' => out.push_str(">="),
            '…' => out.push_str("..."),
            '“' | '”' => out.push('"'),
            '‘' | '’' => out.push('\''),
            other if other.is_ascii() => out.push(other),
            _ => out.push('?'),
        }
    }
    Cow::Owned(out)
}

/// A signed number in `room` columns with a minus sign as wide as a plus.
pub fn signed(value: f64, room: usize, decimals: usize, theme: &Theme) -> String {
    // A value that rounds to zero would otherwise flicker between +0 and −0.
    let scale = 10_f64.powi(i32::try_from(decimals).unwrap_or(0));
    let rounded = (value * scale).round() / scale + 0.0;
    let text = format!("{rounded:+room$.decimals$}");
    if theme.ascii {
        text
    } else {
        text.replace('-', "−")
    }
}

#[cfg(test)]
pub mod testing {
    //! Helpers for tests of panes.

    use ratatui::{buffer::Buffer, layout::Rect, style::Style};

    use super::Theme;
    use crate::theme::Look;

    /// Colours and Unicode.
    pub const RICH: Theme = Theme {
        colour: true,
        ascii: false,
        look: Look::Dark,
    };

    /// Neither colours nor Unicode.
    pub const POOR: Theme = Theme {
        colour: false,
        ascii: true,
        look: Look::Dark,
    };

    /// The output of `draw` on a screen of this size.
    pub fn screen(width: u16, height: u16, draw: impl FnOnce(Rect, &mut Buffer)) -> Buffer {
        let area = Rect::new(0, 0, width, height);
        let mut buf = Buffer::empty(area);
        draw(area, &mut buf);
        buf
    }

    /// The characters of a screen, without trailing blanks.
    pub fn text(buf: &Buffer) -> String {
        let width = usize::from(buf.area.width).max(1);
        let rows = buf.content.chunks(width).map(|row| {
            let row: String = row.iter().map(|cell| cell.symbol()).collect();
            row.trim_end().to_owned()
        });
        rows.collect::<Vec<_>>().join("\n")
    }

    /// The characters of all cells that have `style`.
    pub fn styled(buf: &Buffer, style: Style) -> String {
        let cells = buf.content.iter().filter(|cell| {
            (style.fg.is_none() || cell.style().fg == style.fg)
                && cell.modifier.contains(style.add_modifier)
        });
        cells.map(|cell| cell.symbol()).collect()
    }

    /// Draws at all sizes, including areas larger than the screen, and checks that POOR
    /// screens are ASCII without colour.
    pub fn torture(draw: impl Fn(&Theme, Rect, &mut Buffer)) {
        // All small sizes, where space runs out, and some larger ones.
        let widths = (0..40).chain((40..=130).step_by(9));
        let heights = || (0..12).chain((12..=24).step_by(4));
        for (width, height) in widths.flat_map(|w| heights().map(move |h| (w, h))) {
            screen(width, height, |area, buf| draw(&RICH, area, buf));
            let poor = screen(width, height, |area, buf| draw(&POOR, area, buf));
            assert!(text(&poor).is_ascii(), "{}", text(&poor));
            assert!(
                poor.content
                    .iter()
                    .all(|cell| cell.fg == Default::default())
            );
        }
        screen(20, 5, |_, buf| draw(&RICH, Rect::new(10, 2, 60, 30), buf));
    }
}

#[cfg(test)]
mod tests {
    use super::{
        clip, plain, signed,
        testing::{POOR, RICH},
    };

    #[test]
    fn cuts_are_marked_and_never_too_long() {
        assert_eq!(clip("/image_raw", 10, &RICH), "/image_raw");
        assert_eq!(clip("/image_raw", 6, &RICH), "/imag…");
        assert_eq!(clip("/image_raw", 6, &POOR), "/im...");
        assert_eq!(clip("/image_raw", 2, &POOR), "/i");
        assert_eq!(clip("/image_raw", 0, &RICH), "");
    }

    #[test]
    fn signs_have_ascii_spellings() {
        assert_eq!(plain("sense→act 3 µs 10×", &POOR), "sense->act 3 us 10x");
        assert_eq!(plain("日", &POOR), "?");
        assert_eq!(plain("日", &RICH), "日");
    }

    #[test]
    fn zero_has_one_sign() {
        assert_eq!(signed(-0.001, 6, 2, &RICH), " +0.00");
        assert_eq!(signed(-1.5, 6, 2, &RICH), " −1.50");
    }
}
