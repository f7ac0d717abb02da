//! What the tests of panes have in common.

use ratatui::{layout::Rect, style::Style};

pub use super::sample;
use crate::theme::Look;
pub use crate::{theme::Theme, view::sheet::Sheet};
pub use ratatui::buffer::Buffer;

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

/// The output of `draw` on a screen of this size, without the focus.
pub fn screen((width, height): (u16, u16), theme: &Theme, draw: impl FnOnce(Sheet<'_>)) -> Buffer {
    let area = Rect::new(0, 0, width, height);
    let mut buf = Buffer::empty(area);
    draw(Sheet::new(theme, false, area, &mut buf));
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

/// The characters that `draw` writes on a screen of this size.
pub fn drawn(size: (u16, u16), theme: &Theme, draw: impl FnOnce(Sheet<'_>)) -> String {
    text(&screen(size, theme, draw))
}

/// Each of `parts` is in what was `drawn`.
#[track_caller]
pub fn shows(drawn: &str, parts: &[&str]) {
    for part in parts {
        assert!(drawn.contains(part), "no {part:?} in\n{drawn}");
    }
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
pub fn torture(draw: impl Fn(Sheet<'_>)) {
    // All small sizes, where space runs out, and some larger ones.
    let widths = (0..40).chain((40..=130).step_by(9));
    let heights = || (0..12).chain((12..=24).step_by(4));
    for size in widths.flat_map(|width| heights().map(move |height| (width, height))) {
        screen(size, &RICH, &draw);
        let poor = screen(size, &POOR, &draw);
        assert!(text(&poor).is_ascii(), "{}", text(&poor));
        let mut cells = poor.content.iter();
        assert!(cells.all(|cell| cell.fg == Default::default()));
    }
    let mut buf = Buffer::empty(Rect::new(0, 0, 20, 5));
    draw(Sheet::new(&RICH, true, Rect::new(10, 2, 60, 30), &mut buf));
}
