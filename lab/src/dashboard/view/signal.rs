//! A signal over the last seconds, and the push age.

use std::time::Duration;

use ratatui::{buffer::Buffer, layout::Rect, style::Style, text::Span};
use ratelab::{
    runtime::Time,
    system::{AgeLimits, Signal},
};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke},
    pane::{self, border, clamp, clip, put, row, rows, signed},
    theme::Theme,
};
use crate::dashboard::frame::Trace;

/// How much of the run is in sight (s).
const WINDOW_S: f64 = 10.0;

/// By how much more the axis reaches out, once or several times, where the signal
/// leaves its range: the scale stands still while all is well.
const WIDER: f64 = 1.5;

/// The widest axis in ranges of the signal.
const WIDEST: f64 = 1e6;

/// The longest unit that is written at the axis.
const LONGEST_UNIT: usize = 4;

/// Steps of the time axis (s); the first that leaves room for labels is taken.
const STEPS_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// Columns between the labels of the time.
const TIME_COLUMNS: f64 = 8.0;

/// Below this size there are no labels, only the line.
const LEAST: (u16, u16) = (30, 5);

/// The least height of two charts.
const TALL: u16 = 8;

/// What the lower chart shows.
const AGE_TITLE: &str = "age of the push (ms)";

/// The lowest end of the axis of ages (ms).
const LEAST_AGE_MS: f64 = 40.0;

/// Draws the trace up to `now`, and under it on the same axis of time the push age,
/// where there is room.
pub fn render(
    trace: &Trace,
    now: Time,
    theme: &Theme,
    focused: bool,
    area: Rect,
    buf: &mut Buffer,
) {
    let now = now.as_secs_f64();
    // When looking back, the trace knows more than is to be seen.
    let until_now = |points: &'_ [(f64, f64)]| points.partition_point(|point| point.0 <= now);
    let past = &trace.points[..until_now(&trace.points)];
    let ages = &trace.ages[..until_now(&trace.ages)];
    let title = format!("3 {}", trace.signal.name);
    let current = current(trace.signal, past, theme);
    let inner = border(&title, current, theme, focused, area, buf);
    if inner.is_empty() {
        return;
    }
    let two = !ages.is_empty() && inner.height >= TALL;
    let labelled = inner.width >= LEAST.0 && inner.height >= LEAST.1;
    let lower = usize::from(inner.height) / 2;
    let upper = usize::from(inner.height) - if two { lower } else { 0 };
    let levels = [signal_levels(trace.signal, theme), age_levels(trace.limits)];
    let widths = levels
        .iter()
        .flatten()
        .map(|level| pane::width(&level.label));
    let margin = if labelled {
        clamp(widths.max().unwrap_or(0) + 1)
    } else {
        0
    };
    let times = TimeAxis::new(now, inner.width - margin, theme);
    let [levels, age_levels] = levels;
    let range = reach(trace.signal, ends(past, times));
    let chart = Chart {
        edges: [labelled, labelled && !two],
        levels,
        margin,
        times,
    };
    let chart = chart.place(rows(inner, 0, upper), range, theme);
    let lost = |value: f64| trace.signal.is_lost_at(value);
    chart.axes(theme, buf);
    chart.marks(&trace.marks, now, theme, buf);
    chart.texts(&trace.marks, now, theme, buf);
    chart.ghost(&trace.ghost.points, theme, buf);
    chart.curve(past, lost, theme, buf);
    if two {
        let range = age_range(trace.limits, ends(ages, times)[1]);
        let chart = Chart {
            edges: [labelled; 2],
            levels: age_levels,
            margin,
            times,
        };
        let chart = chart.place(rows(inner, upper, lower), range, theme);
        chart.axes(theme, buf);
        chart.marks(&trace.marks, now, theme, buf);
        put(AGE_TITLE, theme.strong(), 0, chart.text_row, buf);
        chart.ghost(&trace.ghost.ages, theme, buf);
        chart.curve(ages, |_| false, theme, buf);
    }
}

/// The newest value, for the title.
fn current(signal: &Signal, past: &[(f64, f64)], theme: &Theme) -> Span<'static> {
    let Some(&(_, value)) = past.last() else {
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

/// The unit as it stands after a number.
fn unit(signal: &Signal, theme: &Theme) -> String {
    match signal.unit {
        "" => String::new(),
        "°" => theme.glyph("°", " deg").to_owned(),
        unit => format!(" {}", pane::plain(unit, theme)),
    }
}

/// A label of the axis, in as many digits as matter; without its unit if that is
/// long.
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

/// What stands at an axis, and how its line across the chart is dashed.
struct Level {
    at: f64,
    line: Option<(u32, u32, char)>,
    label: String,
}

/// The limits of a signal and zero; where a limit is out of sight, the end of the
/// range without a line.
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

/// The ages that the loop bears (ms).
fn age_levels(limits: AgeLimits) -> Vec<Level> {
    let falls = limits.falls.map(|limit| (limit, (2, 4, '-')));
    let grows = limits.swings().map(|limit| (limit, (1, 4, '.')));
    let level = |(limit, line): (Duration, _)| Level {
        at: limit.as_secs_f64() * 1e3,
        line: Some(line),
        label: format!("{:>3}", super::age::ms(limit)),
    };
    // Where both are on one row, the label is that of the last.
    grows.into_iter().chain(falls).map(level).collect()
}

/// The axis of ages up to `greatest` (ms).
fn age_range(limits: AgeLimits, greatest: f64) -> [f64; 2] {
    let limits = [limits.swings(), limits.falls].into_iter().flatten().max();
    let limit = limits.map_or(0.0, |limit| limit.as_secs_f64() * 1e3);
    [0.0, (limit * 4.0 / 3.0).max(greatest).max(LEAST_AGE_MS)]
}

/// The least and the greatest that is in sight.
fn ends(past: &[(f64, f64)], times: TimeAxis) -> [f64; 2] {
    let seen = past.iter().filter(|point| point.0 >= times.begin);
    seen.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], point| [least.min(point.1), most.max(point.1)],
    )
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

/// The run times in sight (s).
#[derive(Clone, Copy)]
struct TimeAxis {
    begin: f64,
    end: f64,
}

impl TimeAxis {
    /// The last seconds before `now` in so many columns.
    fn new(now: f64, columns: u16, theme: &Theme) -> Self {
        let dots = BrailleCanvas::dots(Rect::new(0, 0, columns, 1), theme).0;
        // Starting on a whole dot, the curve moves without changing its shape.
        let dot = WINDOW_S / (dots - 1.0).max(1.0);
        let begin = ((now - WINDOW_S).max(0.0) / dot).ceil() * dot;
        Self {
            begin,
            end: begin + WINDOW_S,
        }
    }
}

/// What a chart is like before it has a place.
struct Chart {
    /// Whether there is a row for texts above, and for times below.
    edges: [bool; 2],
    levels: Vec<Level>,
    /// Columns for the labels of the levels.
    margin: u16,
    times: TimeAxis,
}

/// Where things are in the pane.
struct PlacedChart {
    levels: Vec<Level>,
    canvas: BrailleCanvas,
    plot: Rect,
    /// Room for the texts of marks, for times, and for values.
    text_row: Rect,
    times: Rect,
    values: Rect,
    axis: TimeAxis,
}

impl Chart {
    fn place(self, inner: Rect, range: [f64; 2], theme: &Theme) -> PlacedChart {
        let right = Rect {
            x: inner.x + self.margin,
            width: inner.width - self.margin,
            ..inner
        };
        let [top, bottom] = self.edges.map(usize::from);
        let height = usize::from(inner.height).saturating_sub(top + bottom);
        let plot = rows(right, top, height);
        let axis = self.times;
        PlacedChart {
            levels: self.levels,
            canvas: BrailleCanvas::new(plot, [axis.begin, axis.end], range, theme),
            plot,
            text_row: rows(right, 0, top),
            times: rows(right, top + height, bottom),
            values: Rect {
                x: inner.x,
                width: self.margin,
                ..plot
            },
            axis,
        }
    }
}

impl PlacedChart {
    /// The limits, zero, and what the axes say.
    fn axes(&self, theme: &Theme, buf: &mut Buffer) {
        let pen = |ascii| Pen {
            style: theme.faint(),
            ascii,
        };
        for level in &self.levels {
            let Some(y) = self.canvas.row(level.at) else {
                continue;
            };
            if let Some((on, of, ascii)) = level.line {
                let line = self.canvas.level(level.at, on, of);
                self.canvas.draw(pen(ascii), line, buf);
            }
            let place = row(self.values, usize::from(y - self.plot.y));
            put(&level.label, theme.faint(), 0, place, buf);
        }
        self.time_axis(theme, buf);
    }

    fn time_axis(&self, theme: &Theme, buf: &mut Buffer) {
        let columns = f64::from(self.plot.width) / WINDOW_S;
        let fits = |step: &f64| step * columns >= TIME_COLUMNS;
        let step = STEPS_S.into_iter().find(fits).unwrap_or(WINDOW_S);
        let first = (self.axis.begin / step).ceil();
        for number in 0..=(WINDOW_S / step) as u32 {
            let time = (first + f64::from(number)) * step;
            let Some(column) = self.canvas.column(time) else {
                continue;
            };
            let text = format!("{time} s");
            // The number is under its place, the unit after it.
            let half = (pane::width(&text) - 2) / 2;
            let start = usize::from(column - self.plot.x).saturating_sub(half);
            if start + pane::width(&text) <= usize::from(self.times.width) {
                put(&text, theme.faint(), start, self.times, buf);
            }
        }
    }

    /// A vertical line where a knob was turned.
    fn marks(&self, marks: &[(f64, String)], now: f64, theme: &Theme, buf: &mut Buffer) {
        if self.text_row.is_empty() {
            return;
        }
        for (time, _) in marks.iter().filter(|mark| mark.0 <= now) {
            let pen = Pen {
                style: theme.faint(),
                ascii: ':',
            };
            self.canvas.draw(pen, self.canvas.upright(*time, 2, 4), buf);
        }
    }

    /// Texts of marks from the newest to the oldest, as far as they do not touch.
    fn texts(&self, marks: &[(f64, String)], now: f64, theme: &Theme, buf: &mut Buffer) {
        let mut free = usize::from(self.text_row.width);
        for (time, text) in marks.iter().rev().filter(|mark| mark.0 <= now) {
            let Some(column) = self.canvas.column(*time).filter(|_| free > 0) else {
                continue;
            };
            let text = clip(text, usize::from(self.text_row.width), theme);
            let wide = pane::width(&text);
            let column = usize::from(column - self.plot.x);
            // To the right of the line; to the left where the screen ends.
            let start = if column + wide <= free {
                Some(column)
            } else {
                (column + 1).checked_sub(wide)
            };
            if let Some(start) = start.filter(|start| start + wide <= free) {
                put(&text, theme.strong(), start, self.text_row, buf);
                free = start.saturating_sub(2);
            }
        }
    }

    /// The line through `past`, an alarm where a value is `lost`.
    /// The run before this one, also where this one has not come to yet.
    fn ghost(&self, points: &[(f64, f64)], theme: &Theme, buf: &mut Buffer) {
        let first = points.partition_point(|point| point.0 < self.axis.begin);
        let last = points.partition_point(|point| point.0 <= self.axis.end);
        let lines = points[first..last].windows(2);
        // Half of the strokes, so that it is no curve without colours as well.
        let lines = lines.step_by(2).map(|pair| {
            let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
            [x1, y1, x2, y2]
        });
        let pen = Pen {
            style: theme.faint(),
            ascii: ':',
        };
        self.canvas.draw(pen, lines, buf);
    }

    fn curve(
        &self,
        past: &[(f64, f64)],
        lost: impl Fn(f64) -> bool,
        theme: &Theme,
        buf: &mut Buffer,
    ) {
        let lines = past.windows(2).map(|pair| {
            let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
            [x1, y1, x2, y2]
        });
        let seen = lines.filter(|line| line[2] >= self.axis.begin);
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
    use ratelab::runtime::Time;

    use super::render;
    use crate::dashboard::{
        frame::Trace,
        view::{
            pane::testing::{POOR, RICH, screen, styled, text, torture},
            sample,
            theme::Theme,
        },
    };

    /// A pole that swings for twelve seconds and then tips over.
    fn long() -> Trace {
        let angle = |time: f64| 3.0 * (2.0 * time).sin() + 2.5 * (time - 12.0).max(0.0).powi(2);
        let points = (0..=720).map(|step| f64::from(step) * 0.02);
        let marks = [
            (5.2, "policy 25 Hz"),
            (5.9, "policy 10 Hz"),
            (13.9, "policy 5 Hz"),
        ];
        Trace {
            points: points.map(|time| (time, angle(time))).collect(),
            marks: marks.map(|(time, text)| (time, text.to_owned())).to_vec(),
            ..sample::trace()
        }
    }

    fn pane(trace: &Trace, millis: u64, size: (u16, u16), theme: &Theme) -> Buffer {
        let now = Time::from_nanos(millis * 1_000_000);
        screen(size.0, size.1, |area, buf| {
            render(trace, now, theme, false, area, buf)
        })
    }

    #[test]
    fn the_last_seconds_are_in_sight() {
        insta::assert_snapshot!(text(&pane(&long(), 14_400, (70, 14), &RICH)), @"
        ┌3 pole angle───────────────────────────────────────────── ✖ +12.89° ┐
        │              policy 10 Hz                            policy 5 Hz   │
        │+12° ⣀ ⣀ ⣀⡄⣀ ⣀⢠⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀ ⣀⢠⣀⣀⣤│
        │          ⡄   ⢠                                               ⣀⡤⢶⠋⠁ │
        │          ⡄   ⢠                                            ⢀⡴⠚⠁ ⢠   │
        │          ⡄   ⢠      ⣀⣀                 ⢀⣀⡀              ⢀⡴⠋    ⢠   │
        │     ⠲⢄⡀  ⡄   ⢠  ⣠⠴⠊⠉ ⠈⠉⠓⠦⣀         ⢀⡠⠖⠋⠉ ⠉⠙⠲⢤⡀        ⢀⡴⠋      ⢠   │
        │  0° ⠁ ⠙⠲⢥⣄⡀ ⣁⣠⠖⠋⠁   ⠁   ⠁⠈⠙⠢⣅⣀ ⢀⣁⡤⠖⠉⠁   ⠁   ⠁⠉⠓⠤⣁⡀ ⣀⣡⠔⠋ ⠁   ⠁  ⢠⠁  │
        │          ⡄⠉⠉ ⢠               ⠈⠉⠉                 ⠈⠉⠁           ⢠   │
        │          ⡄   ⢠                                                 ⢠   │
        │          ⡄   ⢠                                                 ⢠   │
        │−12° ⠉ ⠉ ⠉⡄⠉ ⠉⢠⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉ ⠉⢠⠉ ⠉│
        │               6 s         8 s         10 s        12 s         14 s│
        └────────────────────────────────────────────────────────────────────┘
        ");
        insta::assert_snapshot!(text(&pane(&long(), 14_400, (50, 10), &POOR)), @"
        +3 pole angle---------------------- ! +12.89 deg +
        |             policy 10 Hz         policy 5 Hz   |
        |+12 deg - : -:- - - - - - - - - - - - - - - :*X |
        |          :  :                           *****  |
        |        * :  : *******     *******     ***  :   |
        |  0 deg ******* .   .*******.   .*******.   :   |
        |          :  :                              :   |
        |-12 deg - : -:- - - - - - - - - - - - - - - : - |
        |             6 s     8 s    10 s    12 s    14 s|
        +------------------------------------------------+
        ");
    }

    #[test]
    fn what_was_later_is_not_shown_when_looking_back() {
        let buf = pane(&sample::trace(), 500, (50, 10), &RICH);
        insta::assert_snapshot!(text(&buf), @"
        ┌3 pole angle─────────────────────────    +1.62° ┐
        │      policy 5 Hz                               │
        │+12° ⠤⡄⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤ ⠤│
        │      ⡄                                         │
        │     ⣀⣄⡄                                        │
        │  0° ⠁⡄  ⠁   ⠁   ⠁   ⠁   ⠁   ⠁   ⠁   ⠁   ⠁   ⠁  │
        │      ⡄                                         │
        │−12° ⠒⡄⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒ ⠒│
        │     0 s     2 s      4 s     6 s      8 s      │
        └────────────────────────────────────────────────┘
        ");
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
        let small = pane(&sample::trace(), 840, (50, 10), &RICH);
        assert!(!text(&small).contains("age"));
    }

    #[test]
    fn any_size_and_any_trace_will_do() {
        let odd = Trace {
            points: vec![
                (0.0, f64::NAN),
                (0.1, 1e9),
                (0.2, f64::NEG_INFINITY),
                (0.3, -0.0),
            ],
            marks: vec![(0.1, "→".repeat(200)), (f64::NAN, String::new())],
            ..sample::trace()
        };
        let nothing = Trace {
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
