//! The pole's angle over the last seconds.

use ratatui::{buffer::Buffer, layout::Rect, style::Style, text::Span};
use ratelab::{cartpole::POLE_LIMIT_RAD, runtime::Time};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke},
    pane::{self, border, clamp, clip, put, row, rows, signed},
    theme::Theme,
};
use crate::dashboard::frame::Trace;

/// What the pane is called.
const TITLE: &str = "3 angle";

/// How much of the run is in sight (s).
const WINDOW_S: f64 = 10.0;

/// What the axis may reach to (degrees); the first that fits is taken, so that
/// the scale stands still while the pole is up.
const REACH_DEG: [f64; 6] = [14.0, 20.0, 30.0, 45.0, 90.0, 180.0];

/// Steps of the time axis (s); the first that leaves room for labels is taken.
const STEPS_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// Columns between the labels of the time.
const TIME_COLUMNS: f64 = 8.0;

/// Below this size there are no labels, only the line.
const LEAST: (u16, u16) = (30, 6);

/// Draws the trace up to `now`.
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
    let past = &trace.points[..trace.points.partition_point(|point| point.0 <= now)];
    let inner = border(TITLE, current(past, theme), theme, focused, area, buf);
    if inner.is_empty() {
        return;
    }
    let chart = Chart::new(past, now, theme, inner);
    chart.axes(theme, buf);
    chart.marks(&trace.marks, now, theme, buf);
    chart.curve(past, theme, buf);
}

/// The newest angle, for the title.
fn current(past: &[(f64, f64)], theme: &Theme) -> Span<'static> {
    let Some(&(_, angle)) = past.last() else {
        return Span::default();
    };
    let unit = theme.glyph("°", " deg");
    let text = |glyph: &str| format!(" {glyph}{}{unit} ", signed(angle, 7, 2, theme));
    if angle.abs() > limit() {
        Span::styled(text(theme.glyph("✖", "!")), theme.alarm())
    } else {
        Span::styled(text(" "), theme.strong())
    }
}

/// Where the pole is lost (degrees).
fn limit() -> f64 {
    POLE_LIMIT_RAD.to_degrees()
}

/// A label of the angle.
fn degrees(text: &str, theme: &Theme) -> String {
    let text = pane::plain(text, theme);
    format!("{text:>3}{}", theme.glyph("°", " deg"))
}

/// Where things are in the pane.
struct Chart {
    canvas: BrailleCanvas,
    plot: Rect,
    /// Room for the texts of marks, for times, and for angles.
    texts: Rect,
    times: Rect,
    angles: Rect,
    /// First and last run time in sight (s).
    span: (f64, f64),
}

impl Chart {
    fn new(past: &[(f64, f64)], now: f64, theme: &Theme, inner: Rect) -> Self {
        let labelled = u16::from(inner.width >= LEAST.0 && inner.height >= LEAST.1);
        let margin = labelled * clamp(pane::width(&degrees("+12", theme)) + 1);
        let right = Rect {
            x: inner.x + margin,
            width: inner.width - margin,
            ..inner
        };
        let edge = usize::from(labelled);
        let height = usize::from(inner.height) - 2 * edge;
        let plot = rows(right, edge, height);
        // Starting on a whole dot, the curve moves without changing its shape.
        let dot = WINDOW_S / (BrailleCanvas::dots(plot, theme).0 - 1.0).max(1.0);
        let begin = ((now - WINDOW_S).max(0.0) / dot).ceil() * dot;
        let span = (begin, begin + WINDOW_S);
        let seen = past.iter().filter(|point| point.0 >= begin);
        let largest = seen.fold(0.0_f64, |most, point| most.max(point.1.abs()));
        let reach = REACH_DEG.into_iter().find(|reach| largest <= *reach);
        let reach = reach.unwrap_or(REACH_DEG[5]);
        Self {
            canvas: BrailleCanvas::new(plot, [span.0, span.1], [-reach, reach], theme),
            plot,
            texts: rows(right, 0, edge),
            times: rows(right, edge + height, edge),
            angles: Rect {
                x: inner.x,
                width: margin,
                ..plot
            },
            span,
        }
    }

    /// The upright, the limits, and what the axes say.
    fn axes(&self, theme: &Theme, buf: &mut Buffer) {
        let pen = |ascii| Pen {
            style: theme.faint(),
            ascii,
        };
        for (angle, text) in [(limit(), "+12"), (-limit(), "−12"), (0.0, "0")] {
            let (on, of) = if angle == 0.0 { (1, 8) } else { (2, 4) };
            let line = self.canvas.level(angle, on, of);
            self.canvas
                .draw(pen(if angle == 0.0 { '.' } else { '-' }), line, buf);
            let Some(y) = self.canvas.row(angle) else {
                continue;
            };
            let place = row(self.angles, usize::from(y - self.plot.y));
            put(&degrees(text, theme), theme.faint(), 0, place, buf);
        }
        self.time_axis(theme, buf);
    }

    fn time_axis(&self, theme: &Theme, buf: &mut Buffer) {
        let columns = f64::from(self.plot.width) / WINDOW_S;
        let fits = |step: &f64| step * columns >= TIME_COLUMNS;
        let step = STEPS_S.into_iter().find(fits).unwrap_or(WINDOW_S);
        let first = (self.span.0 / step).ceil();
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

    /// A vertical line where a knob was turned; texts from the newest to the
    /// oldest, as far as they do not touch.
    fn marks(&self, marks: &[(f64, String)], now: f64, theme: &Theme, buf: &mut Buffer) {
        if self.texts.is_empty() {
            return;
        }
        let mut free = usize::from(self.texts.width);
        for (time, text) in marks.iter().rev().filter(|mark| mark.0 <= now) {
            let Some(column) = self.canvas.column(*time) else {
                continue;
            };
            let pen = Pen {
                style: theme.faint(),
                ascii: ':',
            };
            self.canvas.draw(pen, self.canvas.upright(*time, 2, 4), buf);
            let text = clip(text, usize::from(self.texts.width), theme);
            let wide = pane::width(&text);
            let column = usize::from(column - self.plot.x);
            // To the right of the line; to the left where the screen ends.
            let start = if column + wide <= free {
                Some(column)
            } else {
                (column + 1).checked_sub(wide)
            };
            if let Some(start) = start.filter(|start| start + wide <= free) {
                put(&text, theme.strong(), start, self.texts, buf);
                free = start.saturating_sub(2);
            }
        }
    }

    fn curve(&self, past: &[(f64, f64)], theme: &Theme, buf: &mut Buffer) {
        let lines = past.windows(2).map(|pair| {
            let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
            [x1, y1, x2, y2]
        });
        let seen = lines.filter(|line| line[2] >= self.span.0);
        let beyond = |line: &Stroke| line[1].abs().max(line[3].abs()) > limit();
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
        ┌3 angle────────────────────────────────────────────────── ✖ +12.89° ┐
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
        insta::assert_snapshot!(text(&pane(&long(), 14_400, (50, 10), &POOR)), @r"
        +3 angle--------------------------- ! +12.89 deg +
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
        insta::assert_snapshot!(text(&buf), @r"
        ┌3 angle──────────────────────────────    +1.62° ┐
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
    fn any_size_and_any_trace_will_do() {
        let odd = Trace {
            points: vec![
                (0.0, f64::NAN),
                (0.1, 1e9),
                (0.2, f64::NEG_INFINITY),
                (0.3, -0.0),
            ],
            marks: vec![(0.1, "→".repeat(200)), (f64::NAN, String::new())],
        };
        for trace in [odd, long(), Trace::default()] {
            for now in [Time::ZERO, Time::from_nanos(14_400_000_000), Time::MAX] {
                torture(|theme, area, buf| render(&trace, now, theme, true, area, buf));
            }
        }
    }
}
