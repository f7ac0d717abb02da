//! Charts: curves over the last seconds, and histograms.

use std::iter::repeat_n;

use ratatui::{layout::Rect, style::Style, widgets::Sparkline};

use super::{
    canvas::{BrailleCanvas, Pen, Stroke},
    sheet::{Sheet, columns, rows},
    text::{clip, width},
};
use crate::{
    age::ms,
    frame::{LatencyData, TRACE_S},
    theme::Theme,
};

/// Steps of the time axis (s); the first one with room for labels is used.
const STEPS_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// Columns between labels of the time axis.
const TIME_COLUMNS: f64 = 8.0;

/// Length of the dashes of the last run, and of the gaps between them (dots).
const GHOST_DASH: f64 = 3.0;

/// A run time (s) with a short text.
pub type TextMark = (f64, String);

/// A labelled value, and its line across the chart: dots set and all dots of a dash, and the
/// sign in ASCII.
pub struct Level {
    /// The value.
    pub at: f64,
    /// Its line.
    pub line: Option<([u32; 2], char)>,
    /// Its label.
    pub label: String,
}

/// The columns of all charts: labels of values, then the visible run times.
pub struct Columns<'t> {
    /// Columns for the labels.
    margin: usize,
    /// The first and the last run time (s).
    times: [f64; 2],
    theme: &'t Theme,
}

impl<'t> Columns<'t> {
    /// Creates the last seconds before `now`, over the width of `area`.
    pub fn new(now: f64, area: Rect, margin: usize, theme: &'t Theme) -> Self {
        let dots = BrailleCanvas::dots(columns(area, margin, usize::MAX), theme).0;
        // A start on a whole dot keeps the shape of the moving curve.
        let dot = TRACE_S / (dots - 1.0).max(1.0);
        let begin = ((now - TRACE_S).max(0.0) / dot).ceil() * dot;
        let times = [begin, begin + TRACE_S];
        Self {
            margin,
            times,
            theme,
        }
    }

    /// Returns the minimum and maximum of the visible values.
    pub fn ends(&self, past: &[(f64, f64)]) -> [f64; 2] {
        past.iter().filter(|point| point.0 >= self.times[0]).fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[least, most], point| [least.min(point.1), most.max(point.1)],
        )
    }

    /// Returns a chart of values in `range` in `area`, with a row for texts above and one for times
    /// below as `edges` ask.
    pub fn chart(&self, area: Rect, edges: [bool; 2], range: [f64; 2]) -> Chart {
        let [top, bottom] = edges.map(usize::from);
        let height = usize::from(area.height).saturating_sub(top + bottom);
        let right = columns(area, self.margin, usize::MAX);
        let plot = rows(right, top, height);
        Chart {
            times: self.times,
            canvas: BrailleCanvas::new(plot, self.times, range, self.theme),
            plot,
            text_row: rows(right, 0, top),
            time_row: rows(right, top + height, bottom),
            values: rows(columns(area, 0, self.margin), top, height),
        }
    }
}

/// A curve over time, with the places of its parts.
pub struct Chart {
    times: [f64; 2],
    canvas: BrailleCanvas,
    plot: Rect,
    /// The row for the texts of marks.
    pub text_row: Rect,
    time_row: Rect,
    /// Columns for the labels of values.
    values: Rect,
}

impl Chart {
    /// The `levels` with their labels, and the times.
    pub fn axes(&self, levels: &[Level], sheet: &mut Sheet<'_>) {
        let style = sheet.theme.faint();
        for level in levels {
            let Some(y) = self.canvas.row(level.at) else {
                continue;
            };
            if let Some((dash, ascii)) = level.line {
                let line = self.canvas.level(level.at, dash);
                self.canvas.draw(Pen { style, ascii }, line, sheet.buf);
            }
            let row = usize::from(y - self.plot.y);
            sheet.part(self.values).put(0, row, &level.label, style);
        }
        self.time_axis(sheet.part(self.time_row));
    }

    fn time_axis(&self, mut row: Sheet<'_>) {
        let columns = f64::from(self.plot.width) / TRACE_S;
        let fits = |step: &f64| step * columns >= TIME_COLUMNS;
        let step = STEPS_S.into_iter().find(fits).unwrap_or(TRACE_S);
        let first = (self.times[0] / step).ceil();
        for number in 0..=(TRACE_S / step) as u32 {
            let time = (first + f64::from(number)) * step;
            let Some(column) = self.canvas.column(time) else {
                continue;
            };
            let text = format!("{time} s");
            // The number is below its place, with the unit after it.
            let half = (width(&text) - 2) / 2;
            let start = usize::from(column - self.plot.x).saturating_sub(half);
            if start + width(&text) <= row.width() {
                row.put(start, 0, &text, row.theme.faint());
            }
        }
    }

    /// A vertical line at each turned knob.
    pub fn marks(&self, marks: &[&TextMark], sheet: &mut Sheet<'_>) {
        let pen = faint_dashes(sheet.theme);
        for (time, _) in marks {
            self.canvas
                .draw(pen, self.canvas.upright(*time, [2, 4]), sheet.buf);
        }
    }

    /// Returns the texts of marks from the newest to the oldest, each at its own mark, if they do not
    /// touch. Returns the marks with a text; the others are `+` in the same row.
    pub fn texts<'m>(&self, marks: &[&'m TextMark], sheet: &mut Sheet<'_>) -> Vec<&'m TextMark> {
        if self.text_row.is_empty() {
            return Vec::new();
        }
        let mut row = sheet.part(self.text_row);
        let (theme, room) = (row.theme, row.width());
        let (mut free, mut named) = (room, Vec::new());
        for mark in marks.iter().rev() {
            let Some(column) = self.canvas.column(mark.0).filter(|_| free > 0) else {
                continue;
            };
            let text = clip(&mark.1, room, theme);
            let wide = width(&text);
            let column = usize::from(column - self.plot.x);
            // To the right of the line, or to the left at the edge of the screen.
            let start = if column + wide <= free {
                Some(column)
            } else if free == room {
                (column + 1).checked_sub(wide)
            } else {
                None
            };
            if let Some(start) = start {
                row.put(start, 0, &text, theme.strong());
                free = start.saturating_sub(2);
                named.push(*mark);
            } else if column < free {
                row.put(column, 0, "+", theme.faint());
            }
        }
        named
    }

    /// The previous run, including its part after the present.
    pub fn ghost(&self, points: &[(f64, f64)], sheet: &mut Sheet<'_>) {
        let first = points.partition_point(|point| point.0 < self.times[0]);
        let last = points.partition_point(|point| point.0 <= self.times[1]);
        // Dashes: a difference visible without colours.
        let dots = BrailleCanvas::dots(self.plot, sheet.theme).0;
        let dash = TRACE_S / dots.max(1.0) * GHOST_DASH;
        let drawn = |pair: &&[(f64, f64)]| (pair[0].0 / dash).floor() % 2.0 == 0.0;
        let pairs = points[first..last].windows(2).filter(drawn);
        let pen = faint_dashes(sheet.theme);
        self.canvas.draw(pen, pairs.map(stroke), sheet.buf);
    }

    /// Returns the line through `past`, as an alarm at each value that is `lost`.
    pub fn curve(&self, past: &[(f64, f64)], lost: impl Fn(f64) -> bool, sheet: &mut Sheet<'_>) {
        let theme = sheet.theme;
        let seen = past
            .windows(2)
            .map(stroke)
            .filter(|line| line[2] >= self.times[0]);
        let beyond = |line: &Stroke| lost(line[1]) || lost(line[3]);
        let (bad, good): (Vec<Stroke>, Vec<Stroke>) = seen.partition(beyond);
        let pen = |style: Style, ascii| Pen { style, ascii };
        self.canvas.draw(pen(theme.good(), '*'), good, sheet.buf);
        self.canvas
            .draw(pen(theme.alarm_line(), 'X'), bad, sheet.buf);
    }
}

/// Returns the line between two neighbouring points.
fn stroke(pair: &[(f64, f64)]) -> Stroke {
    let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
    [x1, y1, x2, y2]
}

fn faint_dashes(theme: &Theme) -> Pen {
    Pen {
        style: theme.faint(),
        ascii: ':',
    }
}

/// Maximum width of a bar (columns).
const WIDEST: usize = 4;

/// Draws latencies as bars, and below them the axis with the reference period.
pub fn histogram(latency: &LatencyData, mut sheet: Sheet<'_>) {
    let (room, height) = (sheet.width(), sheet.height().saturating_sub(1));
    if height == 0 || room < WIDEST || latency.bins.is_empty() {
        return;
    }
    // Bins share a bar if there are more bins than columns.
    let each = latency.bins.len().div_ceil(room);
    let bars: Vec<u64> = latency
        .bins
        .chunks(each)
        .map(|bins| bins.iter().sum())
        .collect();
    let wide = (room / bars.len()).min(WIDEST);
    let most = bars.iter().copied().max().unwrap_or(0).max(1);
    // A single sample is visible beside any number of others: as an eighth of a cell.
    let least = most.div_ceil(8 * height as u64);
    let bars: Vec<u64> = bars
        .iter()
        .map(|&bar| if bar > 0 { bar.max(least) } else { 0 })
        .flat_map(|bar| repeat_n(bar, wide))
        .collect();
    let used = bars.len();
    sheet
        .rows(0, height)
        .widget(Sparkline::default().data(bars).max(most));
    let per_column = latency.bin.as_secs_f64() * each as f64 / wide as f64;
    axis(latency, used, per_column, sheet.rows(height, 1));
}

/// The axis below bars of some columns, each of some seconds: zero, the period, and the
/// beginning of the last bar, if there is room beside the period.
fn axis(latency: &LatencyData, used: usize, per_column: f64, mut sheet: Sheet<'_>) {
    let (theme, room) = (sheet.theme, sheet.width());
    let last = latency.bin.as_secs_f64() * (latency.bins.len() - 1) as f64;
    let sign = if theme.ascii { ">=" } else { "≥" };
    let end = format!("{sign}{:.0} ms", last * 1e3);
    let wide = width(&end);
    let start = used.max(wide + 4).min(room).saturating_sub(wide);
    sheet.put(0, 0, "0", theme.faint());
    let column = latency.period.as_secs_f64() / per_column;
    // Beyond the last bar it has no column.
    let column = Some(column as usize).filter(|column| *column < used);
    let text = format!("period {}", ms(latency.period));
    let places = [(2, start.saturating_sub(1)), (2, room)];
    let taken = places
        .into_iter()
        .filter_map(|place| period(&text, column, place))
        .next()
        .map_or(1, |(at, text)| sheet.put(at, 0, &text, theme.strong()));
    if start > taken {
        sheet.put(start, 0, &end, theme.faint());
    }
}

/// Returns the label of the period below its `column` of the bars, between columns `from` and `to`,
/// and where it begins.
fn period(
    text: &str,
    column: Option<usize>,
    (from, to): (usize, usize),
) -> Option<(usize, String)> {
    let wide = width(text) + 1;
    match column {
        None => (from + wide < to).then(|| (to - wide, text.to_owned())),
        Some(column) if column >= from && column + 1 + wide <= to => {
            Some((column, format!("▲ {text}")))
        }
        Some(column) if column >= from + wide && column < to => {
            Some((column - wide, format!("{text} ▲")))
        }
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;
    use std::time::Duration;

    fn bars(latency: &LatencyData, size: (u16, u16), theme: &Theme) -> Buffer {
        screen(size, theme, |sheet| histogram(latency, sheet))
    }

    #[test]
    fn the_period_is_marked_under_the_bars() {
        let marked = styled(&bars(&sample::latency(), (40, 5), &RICH), RICH.strong());
        assert_eq!(marked, "▲ period 20 ms");
    }

    #[test]
    fn bins_share_a_bar_where_it_is_narrow() {
        insta::assert_snapshot!(text(&bars(&sample::latency(), (9, 4), &RICH)), @r"
     █▄
     ██
    ▁██▃▁
    0  ≥45 ms
    ");
        insta::assert_snapshot!(text(&bars(&sample::latency(), (30, 3), &POOR)), @r"
             ###---
       ___---######---____________
    0           ^ period 20 ms
    ");
    }

    #[test]
    fn a_period_out_of_sight_is_told() {
        let mut latency = sample::latency();
        latency.period = Duration::from_secs(1);
        insta::assert_snapshot!(text(&bars(&latency, (40, 3), &RICH)), @r"
                ████▅▅▅▅
        ▁▁▁▁▅▅▅▅████████▅▅▅▅▂▂▂▂▁▁▁▁▁▁▁▁▁▁▁▁
    0                 period 1000 ms  ≥45 ms
    ");
    }

    #[test]
    fn any_figures_will_do() {
        let odd = LatencyData {
            bins: vec![u64::MAX, 0, 1],
            ..LatencyData::default()
        };
        torture(|sheet| histogram(&odd, sheet));
        torture(|sheet| histogram(&LatencyData::default(), sheet));
    }
}
