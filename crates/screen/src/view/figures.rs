//! Topics, latency and nodes in figures.

use std::time::Duration;

use ratatui::{
    style::Style,
    text::{Line, Span},
};
use ratelab::millis;

use super::{
    chart,
    sheet::{Sheet, columns},
    table::{self, TableColumn, column},
    text::{count, fitting, line, pad, plain, short, side_by_side, width},
};
use crate::{
    frame::{FrameData, LatencyData, NodeData, Quantiles, TopicData},
    theme::Theme,
};

/// Minimum width for latency in a column of its own, the width of that column, and the
/// blanks before it.
const WIDE: usize = 100;
const LATENCY_COLUMNS: usize = 40;
const GAP: usize = 3;

/// Rows of a histogram: its bars, and the axis below them.
const MIN_HISTOGRAM: usize = 3;
const BEST_HISTOGRAM: usize = 8;

/// Width of a latency figure with its name and unit, and the blanks after it.
const LATENCY_FIGURE: usize = 14;
const LATENCY_GAP: usize = 2;

/// Columns of topics. `avg` is over the whole run, `drops/s` counts drops in the last
/// second, `age` is the data age at each read.
pub(super) const TOPIC_COLUMNS: [TableColumn<TopicData>; 8] = [
    column("msg/s", 7, 0, |topic, _| rate(topic.per_second)),
    column("avg", 7, 6, |topic, _| rate(topic.average)),
    column("published", 9, 7, |topic, _| number(topic.published)),
    column("dropped", 7, 3, |topic, _| number(topic.dropped)),
    column("drops/s", 7, 1, |topic, _| number(topic.dropped_lately)),
    column("depth", 5, 2, |topic, _| number(topic.depth as u64)),
    column("age p50 ms", 10, 4, |topic, _| {
        ms(&topic.age, topic.age.p50)
    }),
    column("p99 ms", 7, 5, |topic, _| ms(&topic.age, topic.age.p99)),
];

/// Columns of nodes.
pub(super) const NODE_COLUMNS: [TableColumn<NodeData>; 6] = [
    column("rate Hz", 9, 0, |node, _| short(node.hz.get(), 3).into()),
    column("ticks", 8, 5, |node, _| number(node.ticks)),
    column("late p50 µs", 11, 2, |node, _| {
        late(&node.lateness, node.lateness.p50)
    }),
    column("p99 µs", 8, 3, |node, _| {
        late(&node.lateness, node.lateness.p99)
    }),
    column("tick p50 µs", 11, 4, |node, _| {
        us(&node.tick_time, node.tick_time.p50)
    }),
    column("overruns", 8, 1, |node, theme| match node.overruns {
        0 => number(0),
        some => number(some).style(theme.strong()),
    }),
];

/// Draws what fits: topics first, then latency, then nodes.
pub fn render(frame: &FrameData, sheet: Sheet<'_>) {
    let pane = sheet.boxed("4 figures", Span::default());
    // A blank column on each side, if there is room.
    let margin = usize::from(pane.width() > 40);
    let mut inside = pane.inset(margin);
    let height = inside.height();
    match &frame.latency {
        Some(latency) if inside.width() >= WIDE => side_by_side_with(frame, latency, inside),
        Some(latency) => stacked(frame, latency, inside),
        None => {
            let used = topics(frame, &mut inside);
            let blank = usize::from(used + 2 + frame.nodes.len() <= height);
            nodes(frame, inside.rows(used + blank, usize::MAX));
        }
    }
}

/// The tables on the left, the latency on the right.
fn side_by_side_with(frame: &FrameData, latency: &LatencyData, mut sheet: Sheet<'_>) {
    let left = sheet.width() - LATENCY_COLUMNS - GAP;
    let [left, right] = [(0, left), (left + GAP, LATENCY_COLUMNS)]
        .map(|(first, count)| columns(sheet.area, first, count));
    let mut tables = sheet.part(left);
    let used = topics(frame, &mut tables);
    nodes(frame, tables.rows(used + 1, usize::MAX));
    let mut beside = sheet.part(right);
    let lines = latency_lines(frame, latency, &beside);
    let used = lines.len();
    beside.lines(0, 0, lines);
    let bars = beside.height().saturating_sub(used + 1).min(BEST_HISTOGRAM);
    if bars >= MIN_HISTOGRAM {
        chart::histogram(latency, beside.rows(used + 1, bars));
    }
}

/// The tables, and the latency between them.
fn stacked(frame: &FrameData, latency: &LatencyData, mut sheet: Sheet<'_>) {
    let height = sheet.height();
    let mut used = topics(frame, &mut sheet);
    // Blank lines only if everything fits.
    let table = 1 + frame.nodes.len();
    let lines = latency_lines(frame, latency, &sheet);
    let least = used + lines.len() + MIN_HISTOGRAM + table;
    let blank = usize::from(least + 2 <= height);
    used += blank;
    let below = used + lines.len();
    sheet.lines(0, used, lines);
    used = below;
    let spare = height.saturating_sub(used + blank + table);
    let bars = spare.clamp(MIN_HISTOGRAM, BEST_HISTOGRAM);
    if used + bars + table <= height {
        chart::histogram(latency, sheet.rows(used, bars));
        used += bars;
    }
    nodes(frame, sheet.rows(used + blank, usize::MAX));
}

/// Draws the table of topics; returns its number of rows.
fn topics(frame: &FrameData, sheet: &mut Sheet<'_>) -> usize {
    let (topics, all) = (&frame.topics, sheet.rows(0, usize::MAX));
    table::render("topic", &TOPIC_COLUMNS, topics, |topic| &topic.name, all);
    (1 + topics.len()).min(sheet.height())
}

fn nodes(frame: &FrameData, sheet: Sheet<'_>) {
    table::render(
        "node",
        &NODE_COLUMNS,
        &frame.nodes,
        |node| &node.name,
        sheet,
    );
}

fn rate(per_second: f64) -> Span<'static> {
    format!("{per_second:.1}").into()
}

fn number(number: u64) -> Span<'static> {
    count(number, 6).into()
}

/// Returns a duration of a distribution in milliseconds, or a dash without samples.
fn ms(of: &Quantiles, duration: Duration) -> Span<'static> {
    quantile(of, millis::text(millis::to_millis(duration)))
}

/// Returns a duration of a distribution in microseconds, or a dash without samples.
fn us(of: &Quantiles, duration: Duration) -> Span<'static> {
    quantile(of, format!("{:.0}", duration.as_secs_f64() * 1e6))
}

/// Returns a lateness in microseconds, or a dash for a node none of whose ticks was late.
fn late(of: &Quantiles, lateness: Duration) -> Span<'static> {
    if of.max.is_zero() {
        "-".into()
    } else {
        us(of, lateness)
    }
}

fn quantile(of: &Quantiles, text: String) -> Span<'static> {
    match of.count {
        0 => "-".into(),
        _ => text.into(),
    }
}

/// Returns the figures of the latency, and below them the greatest push age and reaction time of
/// late, which theory equates.
fn latency_lines(
    frame: &FrameData,
    latency: &LatencyData,
    sheet: &Sheet<'_>,
) -> Vec<Line<'static>> {
    let (theme, room) = (sheet.theme, sheet.width());
    let name = plain(&latency.name, theme);
    let begin = width(&name) + 2;
    let room_beside = room.saturating_sub(begin);
    let across = ((room_beside + LATENCY_GAP) / LATENCY_FIGURE).clamp(1, 4);
    let figures = &latency.figures;
    let some = |duration: Duration| (figures.count > 0).then_some(duration.as_secs_f64());
    let entries = [
        ("p50", some(figures.p50)),
        ("p99", some(figures.p99)),
        ("max", some(figures.max)),
        ("now", latency.newest),
    ]
    .map(|(name, seconds)| {
        let ms = seconds.map_or("-".to_owned(), |seconds| millis::text(seconds * 1e3));
        line([
            (name.to_owned(), theme.faint()),
            (format!("{ms:>6} ms"), Style::new()),
        ])
    });
    let names = [&*name].into_iter().chain(["", "", ""]);
    let rows = entries.chunks(across).zip(names).map(|(entries, name)| {
        let cells = entries.iter().cloned();
        let entries = side_by_side(cells, LATENCY_GAP, room_beside, theme);
        let blank = pad("", begin - width(name), theme);
        let mut whole = line([(name.to_owned(), theme.faint()), (blank, Style::new())]);
        whole.spans.extend(entries.spans);
        whole
    });
    rows.chain(reaction(frame, room, theme)).collect()
}

fn reaction(frame: &FrameData, room: usize, theme: &Theme) -> Option<Line<'static>> {
    let reaction = frame.push.as_ref()?.reaction?;
    let ms = |duration: Duration| millis::text(millis::to_millis(duration));
    let (age, reaction) = (ms(frame.age?.greatest), ms(reaction));
    let texts = [
        format!("lately     push age up to {age} ms, reaction time up to {reaction} ms"),
        format!("lately  age {age} ms, reaction {reaction} ms"),
    ];
    Some(fitting(texts, room))
        .filter(|text| !text.is_empty())
        .map(|text| line([(text, theme.faint())]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::*;

    fn pane(frame: &FrameData, size: (u16, u16), theme: &Theme) -> String {
        drawn(size, theme, |sheet| render(frame, sheet))
    }

    #[test]
    fn latency_is_beside_the_tables_where_it_is_wide() {
        insta::assert_snapshot!(pane(&sample::balanced(), (130, 12), &RICH), @r"
        ┌4 figures───────────────────────────────────────────────────────────────────────────────────────────────────────────────────────┐
        │ topic      msg/s      avg  published  dropped  drops/s  depth  age p50 ms   p99 ms    sense→act  p50  20.3 ms  p99  40.5 ms    │
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
    fn all_figures_fit_the_pane_of_a_screen_of_80x24() {
        let mut frame = sample::balanced();
        frame.age = Some(sample::age(10, 20));
        frame.push = Some(sample::push());
        let screen = pane(&frame, (80, 12), &RICH);
        shows(&screen, &["lately", "actuator"]);
    }

    #[test]
    fn any_size_will_do() {
        for frame in [sample::broken(), sample::chain(12), sample::chain(0)] {
            torture(|sheet| render(&frame, sheet));
        }
    }
}
