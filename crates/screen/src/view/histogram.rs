//! A histogram of the latency.

use std::iter::repeat_n;

use ratatui::widgets::Sparkline;

use super::{sheet::Sheet, text::width};
use crate::{frame::LatencyData, millis::ms};

/// Maximum width of a bar (columns).
const WIDEST: usize = 4;

/// Draws bars, and below them the axis with the reference period.
pub fn render(latency: &LatencyData, mut sheet: Sheet<'_>) {
    let (room, height) = (sheet.width(), sheet.height().saturating_sub(1));
    if height == 0 || room < WIDEST || latency.bins.is_empty() {
        return;
    }
    // Bins share a bar if there are more bins than columns.
    let each = latency.bins.len().div_ceil(room);
    let bars = latency.bins.chunks(each).map(|bins| bins.iter().sum());
    let bars: Vec<u64> = bars.collect();
    let wide = (room / bars.len()).min(WIDEST);
    let most = bars.iter().copied().max().unwrap_or(0).max(1);
    // A single sample is visible beside any number of others: as an eighth of a cell.
    let least = most.div_ceil(8 * height as u64);
    let bars = bars
        .iter()
        .map(|&bar| if bar > 0 { bar.max(least) } else { 0 });
    let bars: Vec<u64> = bars.flat_map(|bar| repeat_n(bar, wide)).collect();
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
    let mut periods = places
        .into_iter()
        .filter_map(|place| period(&text, column, place));
    let taken = periods
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
    use std::time::Duration;

    use super::*;
    use crate::view::testing::*;

    fn bars(latency: &LatencyData, size: (u16, u16), theme: &Theme) -> Buffer {
        screen(size, theme, |sheet| render(latency, sheet))
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
        torture(|sheet| render(&odd, sheet));
        torture(|sheet| render(&LatencyData::default(), sheet));
    }
}
