//! The push age as a number and a bar.

use std::{cmp::Reverse, time::Duration};

use ratatui::{
    style::{Modifier, Style},
    text::Line,
};

use super::text::{line, width};
use crate::{
    age::{AgeData, PARTS, PushData, Strain, whole},
    theme::Theme,
};

/// Maximum and minimum width of the bar (columns).
const BAR: (usize, usize) = (40, 8);

/// Width from which the bar has room for numbers (columns).
const NUMBERED: usize = 20;

/// Ratio of the whole bar to the last limit.
const BEYOND: f64 = 4.0 / 3.0;

/// The age of a whole bar whose limits are hidden.
const UNLIMITED: Duration = Duration::from_millis(200);

/// Width below which the bar needs the room of a word.
const NARROW: usize = 60;

/// The line before the first push, and where pushes were looked at too rarely.
const NO_PUSH: &str = "push age  none: no push so far";
const NO_AGE: &str = "push age  not known over the last second";

/// Returns the number, a bar with a tick and a number at each limit, and the mean parts of the age,
/// in a line of `room` columns; without an age, why.
pub fn age_line(
    age: Option<&AgeData>,
    push: Option<&PushData>,
    room: usize,
    theme: &Theme,
) -> Line<'static> {
    let Some(age) = age else {
        let why = if push.is_some() { NO_AGE } else { NO_PUSH };
        return line([(format!(" {why}"), theme.strong())]);
    };
    let number = format!(" {}  ", number(age, room));
    let begin = width(&number);
    let (sign, word, style) = verdict(age.strain(), theme);
    // The bar is of what nobody predicted: parts are of the whole.
    let mean = push
        .filter(|_| age.unpredicted() == age.mean)
        .map(|push| &push.mean[..])
        .unwrap_or_default();
    let spent = spent(mean);
    let free = room.saturating_sub(begin + BAR.1 + 3);
    let fits = !spent.is_empty() && width(&spent) + 2 <= free;
    let verdict = format!("{sign} {}", if fits { &spent } else { word })
        .trim_start()
        .to_owned();
    let wide = room.saturating_sub(begin + width(&verdict) + 3).min(BAR.0);
    let mut parts = vec![(number, theme.strong())];
    let whole = if age.hidden {
        Some(UNLIMITED)
    } else {
        age.limit().map(|limit| limit.mul_f64(BEYOND))
    };
    match whole.filter(|_| wide >= BAR.1) {
        None => parts.push((verdict, style)),
        Some(whole) => {
            let scale = BarScale {
                cells_per_second: wide as f64 / whole.as_secs_f64(),
                width: wide,
            };
            let plain = style.remove_modifier(Modifier::REVERSED);
            let bar = bar(age.unpredicted(), mean, scale);
            let mut cells: Vec<(String, Style)> = bar
                .chars()
                .map(|glyph| (glyph.to_string(), plain))
                .collect();
            for (column, tick) in ticks(age, scale) {
                for (cell, glyph) in cells[column..].iter_mut().zip(tick.chars()) {
                    *cell = (glyph.to_string(), plain.patch(theme.strong()));
                }
            }
            parts.extend(cells);
            parts.extend([("  ".to_owned(), Style::new()), (verdict, style)]);
        }
    }
    line(parts)
}

/// Returns the parts of the push in force, in a line of `room` columns.
pub fn push_line(push: &PushData, room: usize) -> Line<'static> {
    let text = push.sentence.fitting(|text| width(text) < room);
    Line::raw(format!(" {text}"))
}

/// Returns the age, less what a plan knew of, and the limit, in a constant width for a line of
/// `room` columns.
fn number(age: &AgeData, room: usize) -> String {
    let name = if room < NARROW { "age" } else { "push age" };
    let rest = whole(age.unpredicted());
    let mean = match whole(age.mean) - rest {
        0 => rest.to_string(),
        predicted => format!("{} − {predicted} predicted = {rest:>2}", whole(age.mean)),
    };
    match age.limit_text(|limit| whole(limit).to_string()) {
        Some(limit) => format!("{name} {mean:>3} ms of {limit}"),
        None if age.hidden => format!("{name} {mean:>3} ms, limit ?"),
        None => format!("{name} {mean:>3} ms"),
    }
}

fn verdict(strain: Strain, theme: &Theme) -> (&'static str, &'static str, Style) {
    match strain {
        Strain::Unknown => ("", "limit unknown", theme.faint()),
        Strain::Hidden => ("", "the limit: exercise 6", theme.faint()),
        Strain::Borne => ("✓", "fresh enough", theme.good()),
        Strain::Swings => ("⚠", "swings", theme.alarm_line()),
        Strain::MayFall => ("⚠", "may fall", theme.alarm_line()),
        Strain::Falls => ("⚠", "falls", theme.alarm()),
    }
}

/// The scale of a bar of ages.
#[derive(Clone, Copy)]
struct BarScale {
    cells_per_second: f64,
    /// The greatest length (cells).
    width: usize,
}

/// Returns a tick for each limit of `age`, with its number before it if nothing is there and the bar
/// is wide, and the columns of both.
fn ticks(age: &AgeData, scale: BarScale) -> Vec<(usize, String)> {
    let limits = [age.limits.swings(), age.limits.may_fall, age.limits.falls]
        .into_iter()
        .flatten()
        .filter(|_| !age.hidden);
    let mut limits: Vec<Duration> = limits.collect();
    limits.sort_unstable();
    let mut free = 1;
    let ticks = limits.into_iter().map(|limit| {
        let column = ((limit.as_secs_f64() * scale.cells_per_second) as usize).min(scale.width - 1);
        let number = whole(limit).to_string();
        let has_room = scale.width >= NUMBERED;
        let start = column
            .checked_sub(number.len())
            .filter(|start| has_room && *start >= free);
        free = column + 2;
        match start {
            Some(start) => (start, number + "┊"),
            None => (column, "┊".to_owned()),
        }
    });
    ticks.collect()
}

/// Returns the parts of the age, the largest first, each with its glyph in the bar.
fn spent(mean: &[Duration]) -> String {
    // Rounded as running sums: their sum is the rounded age.
    let (mut sum, mut shown) = (Duration::ZERO, 0);
    let rounded = PARTS.iter().zip(mean).map(|(signs, took)| {
        sum += *took;
        let part = whole(sum) - shown;
        shown = whole(sum);
        (signs, part)
    });
    let mut parts: Vec<_> = rounded.filter(|(_, part)| *part > 0).collect();
    parts.sort_by_key(|(_, part)| Reverse(*part));
    parts
        .iter()
        .map(|([glyph, word], part)| format!("{glyph} {word} {part}"))
        .collect::<Vec<_>>()
        .join(" + ")
}

/// Returns a bar as long as the age with its parts in order.
fn bar(age: Duration, mean: &[Duration], scale: BarScale) -> String {
    let room = scale.width;
    let cells =
        |age: Duration| ((age.as_secs_f64() * scale.cells_per_second).round() as usize).min(room);
    let mut bar = String::new();
    let (mut sum, mut drawn) = (Duration::ZERO, 0);
    for ([glyph, _], took) in PARTS.iter().zip(mean) {
        sum += *took;
        let until = cells(sum.min(age)).max(drawn);
        bar += &glyph.repeat(until - drawn);
        drawn = until;
    }
    let rest = cells(age).max(drawn);
    bar + &"█".repeat(rest - drawn) + &"░".repeat(room - rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;

    fn shown(age: &AgeData, width: u16, theme: &Theme) -> Buffer {
        screen((width, 1), theme, |sheet| both(age, None, sheet))
    }

    fn both(age: &AgeData, push: Option<&PushData>, mut sheet: Sheet<'_>) {
        let (room, theme) = (sheet.width(), sheet.theme);
        let push_line = push.map(|push| push_line(push, room));
        let lines = [age_line(Some(age), push, room, theme)];
        sheet.lines(0, 0, lines.into_iter().chain(push_line));
    }

    #[test]
    fn the_parts_of_the_age_fill_the_bar_and_stand_beside_it() {
        let shown = |width, theme| {
            drawn((width, 2), theme, |sheet| {
                both(&sample::age(95, 200), Some(&sample::push()), sheet);
            })
        };
        insta::assert_snapshot!(shown(100, &RICH));
        insta::assert_snapshot!(shown(80, &POOR));
    }

    #[test]
    fn the_age_stands_beside_what_the_loop_bears() {
        let ages = [10, 65, 77, 95, 400].map(|mean| sample::age(mean, 2 * mean));
        let drawn = ages.map(|age| text(&shown(&age, 80, &RICH))).join("\n");
        insta::assert_snapshot!(drawn);
        insta::assert_snapshot!(text(&shown(&ages[3], 50, &POOR)));
    }

    #[test]
    fn a_limit_that_is_unknown_is_not_drawn() {
        let unknown = AgeData {
            limits: Default::default(),
            ..sample::age(95, 200)
        };
        let buf = shown(&unknown, 80, &RICH);
        let line = " push age  95 ms  limit unknown";
        assert_eq!(text(&buf), line);
        assert_eq!(styled(&buf, RICH.alarm_line()), "");
    }

    #[test]
    fn a_hidden_limit_has_a_question_mark_and_no_age_warns_by_it() {
        let hidden = [10, 80, 95].map(|mean| AgeData {
            hidden: true,
            ..sample::age(mean, mean)
        });
        let drawn = hidden.map(|age| shown(&age, 80, &RICH));
        insta::assert_snapshot!(drawn.each_ref().map(text).join("\n"));
        for buffer in &drawn {
            assert_eq!(styled(buffer, RICH.alarm_line()), "");
        }
    }

    #[test]
    fn only_an_age_beyond_a_limit_warns() {
        let warned = |mean| {
            let line = shown(&sample::age(mean, mean), 80, &RICH);
            styled(&line, RICH.alarm_line())
        };
        assert_eq!(warned(59), "");
        assert!(warned(60).ends_with("⚠ swings"));
        assert!(warned(74).ends_with("⚠ may fall"));
        assert!(warned(90).ends_with("⚠ may fall"));
        assert!(warned(91).ends_with("⚠ falls"));
    }

    #[test]
    fn any_size_will_do() {
        for mean in [0, 10, 95, 1_000_000] {
            torture(|sheet| both(&sample::age(mean, mean), Some(&sample::push()), sheet));
        }
    }
}
