//! Topics, latency and nodes in figures.

use std::time::Duration;

use ratatui::{
    buffer::Buffer,
    layout::{Margin, Rect},
    style::Style,
    text::Span,
};

use super::{
    histogram,
    pane::{self, border, plain, put, row, rows},
    table::{self, TableCell, TableColumn, TableRow},
};
use crate::{
    dashboard::frame::{FrameData, LatencyData, NodeData, Quantiles, TopicData},
    theme::Theme,
};

/// Title of the pane.
const TITLE: &str = "4 figures";

/// Minimum width for latency in a column of its own, the width of that column, and the
/// blanks before it.
const WIDE: u16 = 100;
const LATENCY_COLUMNS: u16 = 40;
const GAP: u16 = 3;

/// Rows of a histogram: its bars, and the axis below them.
const LEAST_HISTOGRAM: usize = 3;
const BEST_HISTOGRAM: usize = 8;

/// Columns of topics. `avg` is over the whole run, `lately` counts drops in the last
/// second, `age` is the data age at each read.
pub(super) const TOPIC_COLUMNS: [TableColumn; 8] = [
    column("msg/s", 7, 0),
    column("avg", 7, 6),
    column("published", 9, 7),
    column("dropped", 7, 3),
    column("lately", 7, 1),
    column("depth", 5, 2),
    column("age p50 ms", 10, 4),
    column("p99 ms", 7, 5),
];

/// Columns of nodes.
pub(super) const NODE_COLUMNS: [TableColumn; 6] = [
    column("rate Hz", 9, 0),
    column("ticks", 8, 5),
    column("late p50 µs", 11, 2),
    column("p99 µs", 8, 3),
    column("tick p50 µs", 11, 4),
    column("overruns", 8, 1),
];

const fn column(head: &'static str, width: usize, rank: u8) -> TableColumn {
    TableColumn { head, width, rank }
}

/// Draws what fits: topics first, then latency, then nodes.
pub fn render(frame: &FrameData, theme: &Theme, focused: bool, area: Rect, buf: &mut Buffer) {
    let inner = border(TITLE, Span::default(), theme, focused, area, buf);
    // A blank column on each side, if there is room.
    let inner = inner.inner(Margin::new(u16::from(inner.width > 40), 0));
    match &frame.latency {
        Some(latency) if inner.width >= WIDE => side_by_side(frame, latency, theme, inner, buf),
        Some(latency) => stacked(frame, latency, theme, inner, buf),
        None => {
            let used = topics(&frame.topics, theme, inner, buf);
            let blank = usize::from(used + 2 + frame.nodes.len() <= usize::from(inner.height));
            let rest = rows(inner, used + blank, usize::MAX);
            nodes(&frame.nodes, theme, rest, buf);
        }
    }
}

fn side_by_side(
    frame: &FrameData,
    latency: &LatencyData,
    theme: &Theme,
    inner: Rect,
    buf: &mut Buffer,
) {
    let left = Rect {
        width: inner.width - LATENCY_COLUMNS - GAP,
        ..inner
    };
    let right = Rect {
        x: inner.x + left.width + GAP,
        width: LATENCY_COLUMNS,
        ..inner
    };
    let used = topics(&frame.topics, theme, left, buf);
    nodes(&frame.nodes, theme, rows(left, used + 1, usize::MAX), buf);
    let mut used = latency_figures(latency, theme, right, buf);
    used += reaction(frame, theme, rows(right, used, usize::MAX), buf);
    let bars = usize::from(inner.height)
        .saturating_sub(used + 1)
        .min(BEST_HISTOGRAM);
    if bars >= LEAST_HISTOGRAM {
        let place = rows(right, used + 1, bars);
        histogram::render(latency, theme, place, buf);
    }
}

fn stacked(frame: &FrameData, latency: &LatencyData, theme: &Theme, inner: Rect, buf: &mut Buffer) {
    let height = usize::from(inner.height);
    let mut used = topics(&frame.topics, theme, inner, buf);
    // Blank lines only if everything fits.
    let table = 1 + frame.nodes.len();
    let above = latency_rows(latency, inner) + usize::from(has_reaction(frame));
    let least = used + above + LEAST_HISTOGRAM + table;
    let blank = usize::from(least + 2 <= height);
    used += blank;
    used += latency_figures(latency, theme, rows(inner, used, usize::MAX), buf);
    used += reaction(frame, theme, rows(inner, used, usize::MAX), buf);
    let spare = height.saturating_sub(used + blank + table);
    let bars = spare.clamp(LEAST_HISTOGRAM, BEST_HISTOGRAM);
    if used + bars + table <= height {
        histogram::render(latency, theme, rows(inner, used, bars), buf);
        used += bars;
    }
    nodes(
        &frame.nodes,
        theme,
        rows(inner, used + blank, usize::MAX),
        buf,
    );
}

/// Draws the table of topics; returns its number of rows.
fn topics(topics: &[TopicData], theme: &Theme, area: Rect, buf: &mut Buffer) -> usize {
    let rows: Vec<TableRow> = topics.iter().map(topic_row).collect();
    table::render("topic", &TOPIC_COLUMNS, &rows, theme, area, buf);
    (1 + rows.len()).min(usize::from(area.height))
}

fn topic_row(topic: &TopicData) -> TableRow {
    let figures = vec![
        usual(format!("{:.1}", topic.per_second)),
        usual(format!("{:.1}", topic.average)),
        usual(count(topic.published)),
        usual(count(topic.dropped)),
        usual(count(topic.dropped_lately)),
        usual(count(topic.depth as u64)),
        usual(quantile(&topic.age, topic.age.p50, 1e3)),
        usual(quantile(&topic.age, topic.age.p99, 1e3)),
    ];
    (topic.name.to_string(), figures)
}

fn nodes(nodes: &[NodeData], theme: &Theme, area: Rect, buf: &mut Buffer) {
    let rows: Vec<TableRow> = nodes.iter().map(|node| node_row(node, theme)).collect();
    table::render("node", &NODE_COLUMNS, &rows, theme, area, buf);
}

fn node_row(node: &NodeData, theme: &Theme) -> TableRow {
    let overruns = if node.overruns > 0 {
        theme.strong()
    } else {
        Style::new()
    };
    let figures = vec![
        usual(rate(node.hz.get())),
        usual(count(node.ticks)),
        usual(quantile(&node.lateness, node.lateness.p50, 1e6)),
        usual(quantile(&node.lateness, node.lateness.p99, 1e6)),
        usual(quantile(&node.tick_time, node.tick_time.p50, 1e6)),
        (count(node.overruns), overruns),
    ];
    (node.name.to_string(), figures)
}

fn usual(text: String) -> TableCell {
    (text, Style::new())
}

/// A count in at most six columns.
fn count(count: u64) -> String {
    match count {
        0..1_000_000 => count.to_string(),
        1_000_000..10_000_000_000 => format!("{:.1}M", count as f64 / 1e6),
        _ => format!("{:.0e}", count as f64),
    }
}

/// A rate as set, to three decimals.
fn rate(hz: f64) -> String {
    pane::short(hz, 3)
}

/// `duration` in a unit of which a second has `scale`, or a dash without samples.
fn quantile(of: &Quantiles, duration: Duration, scale: f64) -> String {
    if of.count == 0 {
        return "-".to_owned();
    }
    let decimals = usize::from(scale < 1e6);
    format!("{:.decimals$}", duration.as_secs_f64() * scale)
}

/// Width of a latency figure with its name and unit, and the blanks after it.
const LATENCY_FIGURE: usize = 14;

/// The first column of the figures, and the number of figures per row.
fn latency_grid(latency: &LatencyData, area: Rect) -> (usize, usize) {
    let begin = pane::width(latency.name) + 2;
    let room = usize::from(area.width).saturating_sub(begin) + 2;
    (begin, (room / LATENCY_FIGURE).clamp(1, 4))
}

/// Draws the greatest push age and reaction time of late, which theory equates; returns
/// the number of rows.
fn reaction(frame: &FrameData, theme: &Theme, area: Rect, buf: &mut Buffer) -> usize {
    let reaction = frame.push.as_ref().and_then(|push| push.reaction);
    let Some((age, reaction)) = frame.age.zip(reaction) else {
        return 0;
    };
    let ms = |duration: Duration| duration.as_secs_f64() * 1e3;
    let (age, reaction) = (ms(age.greatest), ms(reaction));
    let texts = [
        format!("lately     push age up to {age:.1} ms, reaction time up to {reaction:.1} ms"),
        format!("lately  age {age:.1} ms, reaction {reaction:.1} ms"),
    ];
    let text = pane::fitting(texts, usize::from(area.width));
    put(&text, theme.faint(), 0, row(area, 0), buf);
    usize::from(!text.is_empty() && area.height > 0)
}

fn has_reaction(frame: &FrameData) -> bool {
    let push = frame.push.as_ref();
    frame.age.is_some() && push.is_some_and(|push| push.reaction.is_some())
}

fn latency_rows(latency: &LatencyData, area: Rect) -> usize {
    4_usize.div_ceil(latency_grid(latency, area).1)
}

/// Draws the figures of the latency; returns their number of rows.
fn latency_figures(latency: &LatencyData, theme: &Theme, area: Rect, buf: &mut Buffer) -> usize {
    let (begin, across) = latency_grid(latency, area);
    let name = plain(latency.name, theme);
    put(&name, theme.faint(), 0, row(area, 0), buf);
    let figures = &latency.figures;
    let some = |duration: Duration| (figures.count > 0).then_some(duration.as_secs_f64());
    let entries = [
        ("p50", some(figures.p50)),
        ("p99", some(figures.p99)),
        ("max", some(figures.max)),
        ("now", latency.newest),
    ];
    for (number, (name, seconds)) in entries.into_iter().enumerate() {
        let place = row(area, number / across);
        let x = begin + number % across * LATENCY_FIGURE;
        let text = match seconds {
            Some(seconds) => format!("{:>6.1} ms", seconds * 1e3),
            None => format!("{:>6} ms", "-"),
        };
        if x + 12 <= usize::from(area.width) {
            put(name, theme.faint(), x, place, buf);
            put(&text, Style::new(), x + 3, place, buf);
        }
    }
    latency_rows(latency, area).min(usize::from(area.height))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ratatui::buffer::Buffer;

    use super::{count, rate, render};
    use crate::{
        dashboard::{
            frame::{FrameData, PushData, PushSentence},
            view::{
                pane::testing::{POOR, RICH, screen, styled, text, torture},
                sample,
            },
        },
        theme::Theme,
    };

    fn pane(frame: &FrameData, width: u16, height: u16, theme: &Theme) -> Buffer {
        screen(width, height, |area, buf| {
            render(frame, theme, false, area, buf)
        })
    }

    #[test]
    fn latency_is_beside_the_tables_where_it_is_wide() {
        insta::assert_snapshot!(text(&pane(&sample::balanced(), 130, 12, &RICH)), @r"
        ┌4 figures───────────────────────────────────────────────────────────────────────────────────────────────────────────────────────┐
        │ topic      msg/s      avg  published  dropped   lately  depth  age p50 ms   p99 ms    sense→act  p50  20.3 ms  p99  40.5 ms    │
        │ /obs        50.0     50.0        320        0        0      1        10.0     20.0               max  42.9 ms  now  21.0 ms    │
        │ /action     50.0     50.0        320        0        0      1        10.0     20.0                                             │
        │ /state      50.0     50.0        321        0        0      1           -        -                ████                         │
        │                                                                                                   ████▇▇▇▇                     │
        │ node        rate Hz     ticks  late p50 µs    p99 µs  tick p50 µs  overruns                       ████████                     │
        │ sensor           50       320          450      2100            7         0                       ████████                     │
        │ policy           50       320          450      2100            7         0                   ████████████████                 │
        │ actuator         50       321          450      2100            7         0               ▁▁▁▁████████████████▆▆▆▆▁▁▁▁▁▁▁▁▁▁▁▁ │
        │                                                                                       0               ▲ period 20 ms    ≥45 ms │
        └────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────┘
        ");
    }

    #[test]
    fn topics_come_first_where_it_is_narrow() {
        insta::assert_snapshot!(text(&pane(&sample::balanced(), 60, 16, &POOR)), @r"
        +4 figures-------------------------------------------------+
        | topic      msg/s  dropped   lately  depth  age p50 ms    |
        | /obs        50.0        0        0      1        10.0    |
        | /action     50.0        0        0      1        10.0    |
        | /state      50.0        0        0      1           -    |
        | sense->act p50  20.3 ms  p99  40.5 ms  max  42.9 ms      |
        |            now  21.0 ms                                  |
        |             ########                                     |
        |             ########                                     |
        |     ####################################                 |
        | 0               ^ period 20 ms   >=45 ms                 |
        | node        rate Hz  late p50 us    p99 us  overruns     |
        | sensor           50          450      2100         0     |
        | policy           50          450      2100         0     |
        | actuator         50          450      2100         0     |
        +----------------------------------------------------------+
        ");
        insta::assert_snapshot!(text(&pane(&sample::fan_out(), 34, 8, &RICH)), @"
        ┌4 figures───────────────────────┐
        │topic     msg/s   lately  depth │
        │/image     60.0       45      4 │
        │/pose      15.0        0      1 │
        │/plan       7.5        0      1 │
        │sense→act  p50  20.3 ms         │
        │           p99  40.5 ms         │
        └────────────────────────────────┘
        ");
    }

    #[test]
    fn all_figures_fit_the_pane_of_a_screen_of_80x24() {
        let mut frame = sample::balanced();
        frame.age = Some(sample::age(10, 20));
        frame.push = Some(PushData {
            sentence: PushSentence(Vec::new()),
            reaction: Some(Duration::from_millis(20)),
            mean: Vec::new(),
        });
        let screen = text(&pane(&frame, 80, 12, &RICH));
        assert!(
            screen.contains("lately") && screen.contains("actuator"),
            "{screen}"
        );
    }

    #[test]
    fn losses_are_counted_without_an_alarm() {
        let buf = pane(&sample::fan_out(), 80, 12, &RICH);
        assert!(text(&buf).contains(" 45 "));
        assert_eq!(styled(&buf, RICH.alarm()), "");
    }

    #[test]
    fn figures_fit_their_columns() {
        assert_eq!(count(999_999), "999999");
        assert_eq!(count(12_345_678), "12.3M");
        assert_eq!(count(u64::MAX), "2e19");
        assert_eq!(
            [rate(50.0), rate(33.3), rate(0.001)],
            ["50", "33.3", "0.001"]
        );
    }

    #[test]
    fn any_size_will_do() {
        for frame in [sample::broken(), sample::chain(12), sample::chain(0)] {
            torture(|theme, area, buf| render(&frame, theme, true, area, buf));
        }
    }
}
