//! The push age as a number and a bar.

use std::time::Duration;

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Modifier, Style},
};

use super::{
    pane::{self, put},
    theme::Theme,
};
use crate::dashboard::frame::{AgeData, Strain};

/// The widest bar, and the narrowest that can be read.
const BAR: (usize, usize) = (40, 8);

/// Parts of a cell that a bar fills.
const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];

/// Length of the whole bar, in last limits.
const BEYOND: f64 = 4.0 / 3.0;

/// Draws the number, a bar with a tick at each limit, and the result.
pub fn render(age: &AgeData, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let number = number(age);
    let (sign, word, style) = verdict(age.strain(), theme);
    let line = pane::row(area, 0);
    put(&number, theme.strong(), 1, line, buf);
    let begin = pane::width(&number) + 3;
    let verdict = format!("{sign} {word}");
    let room = usize::from(line.width);
    let wide = room
        .saturating_sub(begin + pane::width(&verdict) + 3)
        .min(BAR.0);
    let Some(limit) = age.limit().filter(|_| wide >= BAR.1) else {
        put(verdict.trim_start(), style, begin, line, buf);
        return;
    };
    let scale = wide as f64 / (limit.as_secs_f64() * BEYOND);
    let filled = bar(age.mean.as_secs_f64() * scale, wide, theme);
    let plain = style.remove_modifier(Modifier::REVERSED);
    put(&filled, plain, begin, line, buf);
    let ticks = [age.limits.swings(), age.limits.falls];
    for tick in ticks.into_iter().flatten() {
        let column = ((tick.as_secs_f64() * scale) as usize).min(wide - 1);
        let glyph = theme.glyph("┊", "|");
        put(glyph, theme.strong(), begin + column, line, buf);
    }
    put(&verdict, style, begin + wide + 2, line, buf);
}

/// The age and the limit, always equally wide.
fn number(age: &AgeData) -> String {
    let mean = ms(age.mean);
    match age.limit() {
        Some(limit) => format!("age {mean:>3} ms of {}", ms(limit)),
        None => format!("age {mean:>3} ms"),
    }
}

/// Whole milliseconds.
pub fn ms(duration: Duration) -> u128 {
    (duration.as_micros() + 500) / 1_000
}

fn verdict(strain: Strain, theme: &Theme) -> (&'static str, &'static str, Style) {
    match strain {
        Strain::Unknown => ("", "what this loop bears is unknown", theme.faint()),
        Strain::Borne => (theme.glyph("✓", "+"), "fresh enough", theme.good()),
        Strain::Swings => (theme.glyph("⚠", "!"), "swings", theme.alarm_line()),
        Strain::Falls => (theme.glyph("✖", "x"), "falls", theme.alarm()),
    }
}

/// A bar of `cells`, in `room` of them.
fn bar(cells: f64, room: usize, theme: &Theme) -> String {
    let whole = (cells as usize).min(room);
    let part = match whole < room && !theme.ascii {
        true => EIGHTHS[((cells - whole as f64) * 8.0) as usize % 8],
        false => "",
    };
    let rest = room - whole - pane::width(part);
    let [full, empty] = [theme.glyph("█", "#"), theme.glyph("░", ".")];
    format!("{}{part}{}", full.repeat(whole), empty.repeat(rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::view::{
        pane::testing::{POOR, RICH, screen, styled, text, torture},
        sample,
    };

    fn line(age: &AgeData, width: u16, theme: &Theme) -> Buffer {
        screen(width, 1, |area, buf| render(age, theme, area, buf))
    }

    #[test]
    fn the_age_stands_beside_what_the_loop_bears() {
        let ages = [10, 77, 95, 400].map(|mean| sample::age(mean, 2 * mean));
        let drawn = ages.map(|age| text(&line(&age, 80, &RICH))).join("\n");
        insta::assert_snapshot!(drawn);
        insta::assert_snapshot!(text(&line(&ages[2], 50, &POOR)));
    }

    #[test]
    fn a_limit_that_is_unknown_is_not_drawn() {
        let unknown = AgeData {
            limits: Default::default(),
            ..sample::age(95, 200)
        };
        let buf = line(&unknown, 80, &RICH);
        assert_eq!(text(&buf), " age  95 ms  what this loop bears is unknown");
        assert_eq!(styled(&buf, RICH.alarm_line()), "");
    }

    #[test]
    fn only_an_age_beyond_a_limit_warns() {
        let warned = |mean| {
            styled(
                &line(&sample::age(mean, mean), 80, &RICH),
                RICH.alarm_line(),
            )
        };
        assert_eq!(warned(59), "");
        assert!(warned(60).ends_with("⚠ swings"));
        assert!(warned(90).ends_with("✖ falls"));
    }

    #[test]
    fn any_size_will_do() {
        for mean in [0, 10, 95, 1_000_000] {
            torture(|theme, area, buf| render(&sample::age(mean, mean), theme, area, buf));
        }
    }
}
