//! A signal over the last seconds, the push age, and the newest plan as a strip of its actions.

use std::time::Duration;

use ratatui::text::{Line, Span};
use ratelab::Time;
use ratelab_system::{AgeLimits, Signal};

use super::{
    chart::{Columns, Level},
    sheet::{Sheet, rows},
    text::{line, plain, signed, width},
};
use crate::{
    age::whole,
    frame::{PlanData, SignalTrace},
    theme::Theme,
};

/// Factor by which the axis grows, once or repeatedly, when the signal leaves its range.
/// Within the range the scale is fixed.
const WIDER: f64 = 1.5;

/// Maximum width of the axis, in ranges of the signal.
const WIDEST: f64 = 1e6;

/// Maximum length of a unit at the axis.
const LONGEST_UNIT: usize = 4;

/// Minimum size of a chart with labels; a smaller one has the line alone.
const MIN_SIZE: (usize, usize) = (30, 5);

/// Minimum height for two charts, and for two with the range of a task in the upper one.
const TALL: usize = 7;
const TALL_WITH_TASK: usize = 16;

/// What the dashes in both charts are; beside the title of the lower one.
const GHOST_LEGEND: &str = "╌╌ last run";

/// Title of the lower chart.
const AGE_TITLE: &str = "push age (ms)";

/// Minimum upper end of the axis of ages (ms).
const MIN_AGE_MS: f64 = 40.0;

/// Draws the trace up to `now`, and below it the `newest` plan and the push age if there is
/// room.
pub fn render(trace: &SignalTrace, newest: Option<&PlanData>, now: Time, sheet: Sheet<'_>) {
    let (theme, now, signal) = (sheet.theme, now.as_secs_f64(), &trace.signal);
    // A trace may extend beyond a moment in the past.
    let until_now = |points: &'_ [(f64, f64)]| points.partition_point(|point| point.0 <= now);
    let past = &trace.points[..until_now(&trace.points)];
    let ages = &trace.ages[..until_now(&trace.ages)];
    let marks: Vec<_> = trace.marks.iter().filter(|mark| mark.0 <= now).collect();
    let title = format!("3 {}", signal.name);
    let mut pane = sheet.boxed(&title, current(signal, past, theme));
    if pane.area.is_empty() {
        return;
    }
    let below = pane.height().saturating_sub(PLAN_HEIGHT);
    let shown_plan = newest.filter(|_| below >= PLAN_HEIGHT);
    if let Some(shown_plan) = shown_plan {
        render_plan(shown_plan, pane.rows(below, PLAN_HEIGHT));
        pane.area = rows(pane.area, 0, below);
    }
    let height = pane.height();
    let labelled = pane.width() >= MIN_SIZE.0 && height >= MIN_SIZE.1;
    // A task is about the signal.
    let least = match trace.safe {
        Some(_) => TALL_WITH_TASK,
        None => TALL,
    };
    let two = !ages.is_empty() && height >= least;
    let upper = height - if two { height / 2 } else { 0 };
    let mut levels = signal_levels(signal);
    levels.extend(safe_levels(trace));
    let age_levels = age_levels(trace.limits);
    let widest = levels
        .iter()
        .chain(&age_levels)
        .map(|level| width(&plain(&level.label, theme)))
        .max();
    let margin = widest.filter(|_| labelled).map_or(0, |widest| widest + 1);
    let columns = Columns::new(now, pane.area, margin, theme);
    let range = reach(signal, columns.ends(past));
    let edges = [labelled, labelled && !two];
    let chart = columns.chart(rows(pane.area, 0, upper), edges, range);
    chart.axes(&levels, &mut pane);
    let marks = chart.texts(&marks, &mut pane);
    chart.marks(&marks, &mut pane);
    chart.ghost(&trace.ghost.points, &mut pane);
    chart.curve(past, |value| signal.is_lost_at(value), &mut pane);
    if two {
        let range = age_range(trace.limits, columns.ends(ages)[1]);
        let place = rows(pane.area, upper, height - upper);
        let chart = columns.chart(place, [labelled; 2], range);
        chart.axes(&age_levels, &mut pane);
        chart.marks(&marks, &mut pane);
        let mut title = pane.part(chart.text_row);
        title.line(0, 0, &age_title(trace, theme));
        chart.ghost(&trace.ghost.ages, &mut pane);
        chart.curve(ages, |_| false, &mut pane);
    }
}

/// Returns the title of the lower chart, with what the dashes are.
fn age_title(trace: &SignalTrace, theme: &Theme) -> Line<'static> {
    let ghost = Some(GHOST_LEGEND)
        .filter(|_| !trace.ghost.ages.is_empty())
        .map(|legend| (format!("  {legend}"), theme.faint()));
    let title = (AGE_TITLE.to_owned(), theme.strong());
    line([title].into_iter().chain(ghost))
}

/// Returns the newest value, for the title.
fn current(signal: &Signal, past: &[(f64, f64)], theme: &Theme) -> Span<'static> {
    let Some(&(_, value)) = past.last().filter(|(_, value)| !value.is_nan()) else {
        return Span::default();
    };
    let (sign, style) = if signal.is_lost_at(value) {
        ("✖", theme.alarm())
    } else {
        (" ", theme.strong())
    };
    let text = format!(" {sign}{}{} ", signed(value, 7, 2), unit(signal));
    Span::styled(text, style)
}

/// Returns the unit, to follow a number.
fn unit(signal: &Signal) -> String {
    match &*signal.unit {
        unit @ ("" | "°") => unit.to_owned(),
        unit => format!(" {unit}"),
    }
}

/// Returns a label of the axis, with as many digits as needed; a long one without its unit.
fn label(signal: &Signal, value: f64) -> String {
    let decimals = match value.abs() {
        0.0 | 10.0.. => 0,
        1.0.. => 1,
        _ => 2,
    };
    let text = match signed(value, 0, decimals) {
        _ if value == 0.0 => "0".to_owned(),
        text if text.contains('.') => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        text => text,
    };
    let unit = Some(unit(signal)).filter(|unit| width(unit) <= LONGEST_UNIT);
    format!("{text:>3}{}", unit.unwrap_or_default())
}

/// Returns the limits of a signal and zero; for a limit out of range, the end of the range without
/// a line.
fn signal_levels(signal: &Signal) -> Vec<Level> {
    let [low, high] = signal.range;
    let end = |side: usize| {
        let limit = signal.limits.map(|limits| limits[side]);
        match limit.filter(|limit| (low..=high).contains(limit)) {
            Some(limit) => (limit, Some(([2, 4], '-'))),
            None => (signal.range[side], None),
        }
    };
    let levels = [end(1), end(0), (0.0, Some(([1, 8], '.')))].into_iter();
    let level = |(at, line)| Level {
        at,
        line,
        label: label(signal, at),
    };
    levels.map(level).collect()
}

/// Returns the range of a task.
fn safe_levels(trace: &SignalTrace) -> impl Iterator<Item = Level> {
    let ends = trace.safe.into_iter().flatten();
    ends.map(|at| Level {
        at,
        line: Some(([1, 2], '=')),
        label: label(&trace.signal, at),
    })
}

/// Returns the age limits of the loop (ms).
fn age_levels(limits: AgeLimits) -> Vec<Level> {
    let falls = limits.falls.map(|limit| (limit, ([2, 4], '-')));
    let first = [limits.may_fall, limits.swings()]
        .into_iter()
        .flatten()
        .map(|limit| (limit, ([1, 4], '.')));
    let level = |(limit, line): (Duration, _)| Level {
        at: limit.as_secs_f64() * 1e3,
        line: Some(line),
        label: format!("{:>3}", whole(limit)),
    };
    // Where both are on one row, the label is that of the last one.
    first.chain(falls).map(level).collect()
}

/// Returns the axis of ages up to `greatest` (ms).
fn age_range(limits: AgeLimits, greatest: f64) -> [f64; 2] {
    let limits = [limits.swings(), limits.falls].into_iter().flatten().max();
    let limit = limits.map_or(0.0, |limit| limit.as_secs_f64() * 1e3);
    [0.0, (limit * 4.0 / 3.0).max(greatest).max(MIN_AGE_MS)]
}

/// Returns the axis of `signal`, wide enough for values from `least` to `greatest`.
fn reach(signal: &Signal, [least, greatest]: [f64; 2]) -> [f64; 2] {
    let [low, high] = signal.range;
    let (middle, half) = (f64::midpoint(low, high), (high - low) / 2.0);
    let needed = (greatest - middle).max(middle - least);
    let mut times = 1.0;
    while half * times < needed && times < WIDEST {
        times *= WIDER;
    }
    [middle - half * times, middle + half * times]
}

/// Number of rows.
const PLAN_HEIGHT: usize = 3;

/// Columns before the strip and after it.
const SIDES: [usize; 2] = [7, 14];

/// Actions from the least to the greatest: the greatest in full is the last sign.
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
const ASCII_LEVELS: [char; 8] = ['0', '1', '2', '3', '4', '5', '6', '7'];

/// Most doublings of the scale.
const DOUBLINGS: i32 = 4;

/// Marks of the moments at which the plan means what was played, at which it was taken, and
/// that is now.
const SAME: &str = "━";
const TAKEN: &str = "┴";
const NOW: &str = "▲";

/// Draws `plan`.
fn render_plan(plan: &PlanData, mut sheet: Sheet<'_>) {
    let theme = sheet.theme;
    let room = sheet.width().saturating_sub(SIDES[0] + SIDES[1]);
    let each = plan.actions.len().div_ceil(room.max(1)).max(1);
    let cells = plan.actions.len().div_ceil(each).min(room);
    for (row, name) in ["played", "plan"].into_iter().enumerate() {
        sheet.put(0, row, name, theme.faint());
    }
    let scale = scale(plan);
    for cell in 0..cells {
        let (x, first) = (SIDES[0] + cell, cell * each);
        let past = first <= plan.now;
        let (above, below) = if past {
            (theme.strong(), theme.faint())
        } else {
            (theme.faint(), theme.active())
        };
        let around = plan.around.get(first).copied().flatten();
        let glyph = |value: f64| level(value / scale, theme.ascii).to_string();
        sheet.put(x, 0, &around.map_or(" ".to_owned(), glyph), above);
        sheet.put(x, 1, &glyph(plan.actions[first]), below);
        if past && (first..first + each).all(|place| plan.is_as_played(place)) {
            sheet.put(x, 2, SAME, theme.good());
        }
    }
    let place = |at: usize| SIDES[0] + (at / each).min(cells.saturating_sub(1));
    sheet.put(place(plan.taken), 2, TAKEN, theme.strong());
    sheet.put(place(plan.now), 2, NOW, theme.active());
    let x = SIDES[0] + cells + 1;
    let scale = format!("{}={}", LEVELS[7], signed(scale, 0, 2));
    let (above, style) = match plan.stalls {
        0 => (scale, theme.faint()),
        1 => ("✖ 1 stall".to_owned(), theme.alarm_line()),
        stalls => (format!("✖ {stalls} stalls"), theme.alarm_line()),
    };
    sheet.put(x, 0, &above, style);
    sheet.put(x, 1, plan.kind, theme.faint());
    let (left, style) = if plan.left.is_zero() {
        ("✖ is over".to_owned(), theme.alarm_line())
    } else {
        (format!("{} ms left", plan.left.as_millis()), theme.strong())
    };
    sheet.put(x, 2, &left, style);
}

/// Returns the action that the last sign stands for: the greatest one, or so often half of it as
/// all actions allow.
fn scale(plan: &PlanData) -> f64 {
    let needed = plan
        .actions
        .iter()
        .chain(plan.around.iter().flatten())
        .fold(0.0, |most: f64, action| most.max(action.abs()));
    (0..=DOUBLINGS)
        .map(|times| plan.most / 2_f64.powi(times))
        .rfind(|scale| *scale >= needed)
        .unwrap_or(plan.most)
}

/// Returns the sign for `share` of the greatest action, −1 to 1.
fn level(share: f64, ascii: bool) -> char {
    let levels = if ascii { ASCII_LEVELS } else { LEVELS };
    let place = (share + 1.0) / 2.0 * levels.len() as f64;
    levels[(place as usize).min(levels.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;

    /// Returns a pole that swings for twelve seconds and then tips over.
    fn long() -> SignalTrace {
        let angle = |time: f64| 3.0 * (2.0 * time).sin() + 2.5 * (time - 12.0).max(0.0).powi(2);
        let points = (0..=720).map(|step| f64::from(step) * 0.02);
        let marks = [
            (5.2, "policy 25 Hz"),
            (5.9, "policy 10 Hz"),
            (13.9, "policy 5 Hz"),
        ];
        SignalTrace {
            points: points.map(|time| (time, angle(time))).collect(),
            marks: marks.map(|(time, text)| (time, text.to_owned())).to_vec(),
            ..sample::trace()
        }
    }

    fn pane(trace: &SignalTrace, millis: u64, size: (u16, u16), theme: &Theme) -> Buffer {
        let now = Time::from_nanos(millis * 1_000_000);
        screen(size, theme, |sheet| render(trace, None, now, sheet))
    }

    #[test]
    fn the_last_seconds_are_in_sight() {
        insta::assert_snapshot!(text(&pane(&long(), 14_400, (70, 14), &RICH)));
        insta::assert_snapshot!(text(&pane(&long(), 14_400, (50, 10), &POOR)));
    }

    #[test]
    fn what_was_later_is_not_shown_when_looking_back() {
        let buf = pane(&sample::trace(), 500, (50, 10), &RICH);
        insta::assert_snapshot!(text(&buf));
        assert_eq!(styled(&buf, RICH.alarm()), "");
    }

    #[test]
    fn beyond_the_limit_is_an_alarm() {
        let buf = pane(&long(), 14_400, (70, 14), &RICH);
        assert_eq!(styled(&buf, RICH.alarm()), " ✖ +12.89° ");
        assert!(!styled(&buf, RICH.good()).is_empty());
    }

    #[test]
    fn the_age_is_under_the_signal_where_there_is_room() {
        insta::assert_snapshot!(text(&pane(&sample::trace(), 840, (70, 20), &RICH)));
        insta::assert_snapshot!(text(&pane(&sample::trace(), 840, (50, 18), &POOR)));
        let small = pane(&sample::trace(), 840, (50, 8), &RICH);
        assert!(!text(&small).contains("age"));
    }

    #[test]
    fn any_size_and_any_trace_will_do() {
        let odd = SignalTrace {
            points: vec![
                (0.0, f64::NAN),
                (0.1, 1e9),
                (0.2, f64::NEG_INFINITY),
                (0.3, -0.0),
            ],
            marks: vec![(0.1, "→".repeat(200)), (f64::NAN, String::new())],
            ..sample::trace()
        };
        let nothing = SignalTrace {
            points: Vec::new(),
            ages: Vec::new(),
            marks: Vec::new(),
            ..sample::trace()
        };
        for trace in [odd, long(), nothing] {
            for now in [Time::ZERO, Time::from_nanos(14_400_000_000), Time::MAX] {
                torture(|sheet| render(&trace, None, now, sheet));
            }
        }
    }
}
