//! Where in a recording we are.

use ratatui::{buffer::Buffer, layout::Rect, style::Style};
use ratelab::runtime::Time;

use super::{
    pane::{plain, put, row, width},
    theme::Theme,
};

/// A moment between the ends of a recording.
pub struct Scrubber {
    /// Where the recording begins.
    pub begins: Time,
    /// The moment that is shown.
    pub at: Time,
    /// Where it ends.
    pub ends: Time,
    /// When something happened.
    pub events: Vec<Time>,
    /// Whether it plays.
    pub playing: bool,
    /// How fast, against the run's own time.
    pub speed: f64,
}

/// Draws the moment as a place on a line, with marks where something happened.
pub fn render(scrubber: &Scrubber, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let line = row(area.intersection(buf.area), 0);
    let sign = if scrubber.playing {
        theme.glyph("▶", ">")
    } else {
        theme.glyph("⏸", "=")
    };
    let left = format!(" {sign} {:>8.3} s ", scrubber.at.as_secs_f64());
    let right = format!(
        " {:.3} s  {}× ",
        scrubber.ends.as_secs_f64(),
        scrubber.speed
    );
    let (left, right) = (plain(&left, theme), plain(&right, theme));
    put(&left, theme.strong(), 0, line, buf);
    let from = width(&left);
    let columns = usize::from(line.width).saturating_sub(from + width(&right));
    if columns == 0 {
        return;
    }
    let place = |at: Time| column(scrubber, at, columns);
    let here = place(scrubber.at);
    let (done, ahead) = (theme.glyph("━", "="), theme.glyph("─", "-"));
    put(&done.repeat(here), theme.active(), from, line, buf);
    put(
        &ahead.repeat(columns - here),
        theme.faint(),
        from + here,
        line,
        buf,
    );
    for at in scrubber.events.iter().filter(|at| **at >= scrubber.begins) {
        put(
            theme.glyph("◆", "*"),
            theme.strong(),
            from + place(*at),
            line,
            buf,
        );
    }
    put(
        theme.glyph("●", "O"),
        theme.active(),
        from + here,
        line,
        buf,
    );
    put(&right, Style::new(), from + columns, line, buf);
}

/// The column of `at` among `columns`.
fn column(scrubber: &Scrubber, at: Time, columns: usize) -> usize {
    let whole = scrubber.ends.since(scrubber.begins).as_secs_f64();
    let part = at.since(scrubber.begins).as_secs_f64();
    let share = if whole > 0.0 { part / whole } else { 1.0 };
    let last = columns - 1;
    ((share * last as f64).round() as usize).min(last)
}
