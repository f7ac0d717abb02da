//! A signal over the last seconds, and the push age.

use std::time::Duration;

use ratatui::{buffer::Buffer, layout::Rect, style::Style, text::Span};
use ratelab::Time;
use ratelab_study::system::{AgeLimits, Signal};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke},
    pane::{self, border, clamp, clip, put, row, rows, signed},
};
use crate::{
    dashboard::frame::{SignalTrace, TRACE_S},
    theme::Theme,
};

/// Factor by which the axis grows, once or repeatedly, when the signal leaves its range.
/// Within the range the scale is fixed.
const WIDER: f64 = 1.5;

/// Maximum width of the axis, in ranges of the signal.
const WIDEST: f64 = 1e6;

/// Maximum length of a unit at the axis.
const LONGEST_UNIT: usize = 4;

/// Steps of the time axis (s); the first one with room for labels is used.
const STEPS_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// Columns between labels of the time axis.
const TIME_COLUMNS: f64 = 8.0;

/// Length of the dashes of the last run, and of the gaps between them (dots).
const GHOST_DASH: f64 = 3.0;

/// Minimum size of a chart with labels; a smaller one has the line alone.
const LEAST: (u16, u16) = (30, 5);

/// Minimum height for two charts.
const TALL: u16 = 8;

/// What the dashes in both charts are; beside the title of the lower one.
const GHOST_LEGEND: &str = "╌╌ last run";

/// Title of the lower chart.
const AGE_TITLE: &str = "age of the push (ms)";

/// Minimum upper end of the axis of ages (ms).
const LEAST_AGE_MS: f64 = 40.0;

/// Draws the trace up to `now`, and below it the push age if there is room.
pub fn render(
    trace: &SignalTrace,
    now: Time,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let now = now.as_secs_f64();
    // A trace may extend beyond a moment in the past.
    let until_now = |points: &'_ [(f64, f64)]| points.partition_point(|point| point.0 <= now);
    let past = &trace.points[..until_now(&trace.points)];
    let ages = &trace.ages[..until_now(&trace.ages)];
    let marks: Vec<_> = trace.marks.iter().filter(|mark| mark.0 <= now).collect();
    let title = format!("3 {}", trace.signal.name);
    let current = current(&trace.signal, past, theme);
    let inner = border(&title, current, theme, focused, area, buf);
    if inner.is_empty() {
        return;
    }
    // A task is about the signal.
    let least = if trace.safe.is_some() { 2 * TALL } else { TALL };
    let two = !ages.is_empty() && inner.height >= least;
    let labelled = inner.width >= LEAST.0 && inner.height >= LEAST.1;
    let lower = usize::from(inner.height) / 2;
    let upper = usize::from(inner.height) - if two { lower } else { 0 };
    let mut signal_levels = signal_levels(&trace.signal, theme);
    signal_levels.extend(safe_levels(trace, theme));
    let age_levels = age_levels(trace.limits);
    let levels = signal_levels.iter().chain(&age_levels);
    let widest = levels.map(|level| pane::width(&level.label)).max();
    let margin = if labelled {
        clamp(widest.unwrap_or(0) + 1)
    } else {
        0
    };
    let columns = Columns::new(now, inner, margin, theme);
    let range = reach(&trace.signal, columns.ends(past));
    let edges = [labelled, labelled && !two];
    let chart = columns.chart(rows(inner, 0, upper), edges, signal_levels, range);
    chart.axes(buf);
    let marks = chart.texts(&marks, buf);
    chart.marks(&marks, buf);
    chart.ghost(&trace.ghost.points, buf);
    chart.curve(past, |value| trace.signal.is_lost_at(value), buf);
    if two {
        let range = age_range(trace.limits, columns.ends(ages)[1]);
        let place = rows(inner, upper, lower);
        let chart = columns.chart(place, [labelled; 2], age_levels, range);
        chart.axes(buf);
        chart.marks(&marks, buf);
        put(AGE_TITLE, theme.strong(), 0, chart.text_row, buf);
        if !trace.ghost.ages.is_empty() {
            let legend = pane::plain(GHOST_LEGEND, theme);
            let after = pane::width(AGE_TITLE) + 2;
            put(&legend, theme.faint(), after, chart.text_row, buf);
        }
        chart.ghost(&trace.ghost.ages, buf);
        chart.curve(ages, |_| false, buf);
    }
}

/// The newest value, for the title.
fn current(signal: &Signal, past: &[(f64, f64)], theme: &Theme) -> Span<'static> {
    let Some(&(_, value)) = past.last().filter(|(_, value)| !value.is_nan()) else {
        return Span::default();
    };
    let unit = unit(signal, theme);
    let text = |glyph: &str| format!(" {glyph}{}{unit} ", signed(value, 7, 2, theme));
    if signal.is_lost_at(value) {
        Span::styled(text(theme.glyph("✖", "!")), theme.alarm())
    } else {
        Span::styled(text(" "), theme.strong())
    }
}

/// The unit, to follow a number.
fn unit(signal: &Signal, theme: &Theme) -> String {
    match signal.unit {
        "" => String::new(),
        "°" => theme.glyph("°", " deg").to_owned(),
        unit => format!(" {}", pane::plain(unit, theme)),
    }
}

/// A label of the axis, with as many digits as needed; a long one without its unit.
fn label(signal: &Signal, value: f64, theme: &Theme) -> String {
    let decimals = match value.abs() {
        0.0 => 0,
        10.0.. => 0,
        1.0.. => 1,
        _ => 2,
    };
    let text = if value == 0.0 {
        "0".to_owned()
    } else {
        signed(value, 0, decimals, theme)
    };
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    let unit = unit(signal, theme);
    let unit = if pane::width(&unit) <= LONGEST_UNIT {
        &unit
    } else {
        ""
    };
    format!("{text:>3}{unit}")
}

/// A labelled value, and the dashes of its line across the chart.
struct Level {
    at: f64,
    line: Option<(u32, u32, char)>,
    label: String,
}

/// The limits of a signal and zero; for a limit out of range, the end of the range
/// without a line.
fn signal_levels(signal: &Signal, theme: &Theme) -> Vec<Level> {
    let [low, high] = signal.range;
    let end = |side: usize| {
        let limit = signal.limits.map(|limits| limits[side]);
        match limit.filter(|limit| (low..=high).contains(limit)) {
            Some(limit) => (limit, Some((2, 4, '-'))),
            None => (signal.range[side], None),
        }
    };
    let levels = [end(1), end(0), (0.0, Some((1, 8, '.')))].into_iter();
    let level = |(at, line)| Level {
        at,
        line,
        label: label(signal, at, theme),
    };
    levels.map(level).collect()
}

/// The range of a task.
fn safe_levels(trace: &SignalTrace, theme: &Theme) -> impl Iterator<Item = Level> {
    let ends = trace.safe.into_iter().flatten();
    ends.map(|at| Level {
        at,
        line: Some((1, 2, '=')),
        label: label(&trace.signal, at, theme),
    })
}

/// The age limits of the loop (ms).
fn age_levels(limits: AgeLimits) -> Vec<Level> {
    let falls = limits.falls.map(|limit| (limit, (2, 4, '-')));
    let grows = limits.swings().map(|limit| (limit, (1, 4, '.')));
    let level = |(limit, line): (Duration, _)| Level {
        at: limit.as_secs_f64() * 1e3,
        line: Some(line),
        label: format!("{:>3}", super::age::ms(limit)),
    };
    // Where both are on one row, the label is that of the last one.
    grows.into_iter().chain(falls).map(level).collect()
}

/// The axis of ages up to `greatest` (ms).
fn age_range(limits: AgeLimits, greatest: f64) -> [f64; 2] {
    let limits = [limits.swings(), limits.falls].into_iter().flatten().max();
    let limit = limits.map_or(0.0, |limit| limit.as_secs_f64() * 1e3);
    [0.0, (limit * 4.0 / 3.0).max(greatest).max(LEAST_AGE_MS)]
}

/// The axis of `signal`, wide enough for values from `least` to `greatest`.
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

/// The line between two neighbouring points.
fn stroke(pair: &[(f64, f64)]) -> Stroke {
    let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
    [x1, y1, x2, y2]
}

/// The columns of all charts: labels of values, then the visible run times.
struct Columns<'t> {
    /// Columns for the labels.
    margin: u16,
    /// The first and the last run time (s).
    times: [f64; 2],
    theme: &'t Theme,
}

impl<'t> Columns<'t> {
    /// The last seconds before `now`, over the width of `inner`.
    fn new(now: f64, inner: Rect, margin: u16, theme: &'t Theme) -> Self {
        let width = inner.width - margin;
        let dots = BrailleCanvas::dots(Rect { width, ..inner }, theme).0;
        // A start on a whole dot keeps the shape of the moving curve.
        let dot = TRACE_S / (dots - 1.0).max(1.0);
        let begin = ((now - TRACE_S).max(0.0) / dot).ceil() * dot;
        Self {
            margin,
            times: [begin, begin + TRACE_S],
            theme,
        }
    }

    /// The minimum and maximum of the visible values.
    fn ends(&self, past: &[(f64, f64)]) -> [f64; 2] {
        let seen = past.iter().filter(|point| point.0 >= self.times[0]);
        seen.fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[least, most], point| [least.min(point.1), most.max(point.1)],
        )
    }

    /// A chart of values in `range` in `area`, with a row for texts above and one for
    /// times below as `edges` ask.
    fn chart(
        &self,
        area: Rect,
        edges: [bool; 2],
        levels: Vec<Level>,
        range: [f64; 2],
    ) -> Chart<'_> {
        let right = Rect {
            x: area.x + self.margin,
            width: area.width - self.margin,
            ..area
        };
        let [top, bottom] = edges.map(usize::from);
        let height = usize::from(area.height).saturating_sub(top + bottom);
        let plot = rows(right, top, height);
        Chart {
            columns: self,
            levels,
            canvas: BrailleCanvas::new(plot, self.times, range, self.theme),
            plot,
            text_row: rows(right, 0, top),
            times: rows(right, top + height, bottom),
            values: Rect {
                x: area.x,
                width: self.margin,
                ..plot
            },
        }
    }
}

/// A curve over time, with the places of its parts.
struct Chart<'a> {
    columns: &'a Columns<'a>,
    levels: Vec<Level>,
    canvas: BrailleCanvas,
    plot: Rect,
    /// Rows for the texts of marks and for times, and columns for values.
    text_row: Rect,
    times: Rect,
    values: Rect,
}

impl Chart<'_> {
    /// The levels with their labels, and the times.
    fn axes(&self, buf: &mut Buffer) {
        let style = self.columns.theme.faint();
        for level in &self.levels {
            let Some(y) = self.canvas.row(level.at) else {
                continue;
            };
            if let Some((on, of, ascii)) = level.line {
                let line = self.canvas.level(level.at, on, of);
                self.canvas.draw(Pen { style, ascii }, line, buf);
            }
            let place = row(self.values, usize::from(y - self.plot.y));
            put(&level.label, style, 0, place, buf);
        }
        self.time_axis(buf);
    }

    fn time_axis(&self, buf: &mut Buffer) {
        let style = self.columns.theme.faint();
        let columns = f64::from(self.plot.width) / TRACE_S;
        let fits = |step: &f64| step * columns >= TIME_COLUMNS;
        let step = STEPS_S.into_iter().find(fits).unwrap_or(TRACE_S);
        let first = (self.columns.times[0] / step).ceil();
        for number in 0..=(TRACE_S / step) as u32 {
            let time = (first + f64::from(number)) * step;
            let Some(column) = self.canvas.column(time) else {
                continue;
            };
            let text = format!("{time} s");
            // The number is below its place, with the unit after it.
            let half = (pane::width(&text) - 2) / 2;
            let start = usize::from(column - self.plot.x).saturating_sub(half);
            if start + pane::width(&text) <= usize::from(self.times.width) {
                put(&text, style, start, self.times, buf);
            }
        }
    }

    /// A vertical line at each turned knob.
    fn marks(&self, marks: &[&(f64, String)], buf: &mut Buffer) {
        if self.text_row.is_empty() {
            return;
        }
        let pen = Pen {
            style: self.columns.theme.faint(),
            ascii: ':',
        };
        for (time, _) in marks {
            self.canvas.draw(pen, self.canvas.upright(*time, 2, 4), buf);
        }
    }

    /// Texts of marks from the newest to the oldest, each at its own mark, if they do not
    /// touch. Returns the marks with a text; the others are dots in the same row.
    fn texts<'m>(&self, marks: &[&'m (f64, String)], buf: &mut Buffer) -> Vec<&'m (f64, String)> {
        let theme = self.columns.theme;
        let room = usize::from(self.text_row.width);
        let (mut free, mut named) = (room, Vec::new());
        for mark in marks.iter().rev() {
            let (time, text) = mark;
            let Some(column) = self.canvas.column(*time).filter(|_| free > 0) else {
                continue;
            };
            let text = clip(text, room, theme);
            let wide = pane::width(&text);
            let column = usize::from(column - self.plot.x);
            // To the right of the line, or to the left at the edge of the screen.
            let start = match column + wide <= free {
                true => Some(column),
                false if free == room => (column + 1).checked_sub(wide),
                false => None,
            };
            if let Some(start) = start {
                put(&text, theme.strong(), start, self.text_row, buf);
                free = start.saturating_sub(2);
                named.push(*mark);
            } else if column < free {
                put(
                    theme.glyph("·", "."),
                    theme.faint(),
                    column,
                    self.text_row,
                    buf,
                );
            }
        }
        named
    }

    /// The previous run, including its part after the present.
    fn ghost(&self, points: &[(f64, f64)], buf: &mut Buffer) {
        let first = points.partition_point(|point| point.0 < self.columns.times[0]);
        let last = points.partition_point(|point| point.0 <= self.columns.times[1]);
        // Dashes: a difference visible without colours.
        let dots = BrailleCanvas::dots(self.plot, self.columns.theme).0;
        let dash = TRACE_S / dots.max(1.0) * GHOST_DASH;
        let drawn = |pair: &&[(f64, f64)]| (pair[0].0 / dash).floor() % 2.0 == 0.0;
        let pairs = points[first..last].windows(2).filter(drawn);
        let lines = pairs.map(stroke);
        let pen = Pen {
            style: self.columns.theme.faint(),
            ascii: ':',
        };
        self.canvas.draw(pen, lines, buf);
    }

    /// The line through `past`, as an alarm at each value that is `lost`.
    fn curve(&self, past: &[(f64, f64)], lost: impl Fn(f64) -> bool, buf: &mut Buffer) {
        let theme = self.columns.theme;
        let lines = past.windows(2).map(stroke);
        let seen = lines.filter(|line| line[2] >= self.columns.times[0]);
        let beyond = |line: &Stroke| lost(line[1]) || lost(line[3]);
        let (bad, good): (Vec<Stroke>, Vec<Stroke>) = seen.partition(beyond);
        let pen = |style: Style, ascii| Pen { style, ascii };
        self.canvas.draw(pen(theme.good(), '*'), good, buf);
        self.canvas.draw(pen(theme.alarm_line(), 'X'), bad, buf);
    }
}

#[cfg(test)]
mod tests {
    use ratatui::buffer::Buffer;
    use ratelab::Time;

    use super::render;
    use crate::{
        dashboard::{
            frame::SignalTrace,
            view::{
                pane::testing::{POOR, RICH, screen, styled, text, torture},
                sample,
            },
        },
        theme::Theme,
    };

    /// A pole that swings for twelve seconds and then tips over.
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
        screen(size.0, size.1, |area, buf| {
            render(trace, now, theme, false, area, buf)
        })
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
        let small = pane(&sample::trace(), 840, (50, 9), &RICH);
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
                torture(|theme, area, buf| render(&trace, now, theme, true, area, buf));
            }
        }
    }
}
