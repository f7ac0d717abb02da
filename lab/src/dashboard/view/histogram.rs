//! A histogram of the latency.

use ratatui::{buffer::Buffer, layout::Rect, style::Style};

use super::pane::{self, clamp, put, row, rows};
use crate::{dashboard::frame::LatencyData, theme::Theme};

/// Bars of one cell, in eighths.
const EIGHTHS: [&str; 9] = [" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"];

/// Maximum width of a bar (columns).
const WIDEST: usize = 4;

/// Draws bars, and below them the axis with the reference period.
pub fn render(latency: &LatencyData, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let room = usize::from(area.width);
    if area.height < 2 || room < 4 || latency.bins.is_empty() {
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
    let height = usize::from(area.height) - 1;
    draw_bars(&bars, wide, theme, rows(area, 0, height), buf);
    let axis = BinAxis {
        latency,
        used: bars.len() * wide,
        per_column: latency.bin.as_secs_f64() * each as f64 / wide as f64,
    };
    axis.draw(theme, row(area, height), buf);
}

fn draw_bars(bars: &[u64], wide: usize, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let most = bars.iter().copied().max().unwrap_or(0).max(1);
    let full = u64::from(area.height) * 8;
    for (number, &bar) in bars.iter().enumerate() {
        // A single sample is visible beside any number of others.
        let eighths = scaled(bar, full, most).max(u64::from(bar > 0));
        for level in 0..area.height {
            let part = eighths.saturating_sub(u64::from(level) * 8).min(8) as usize;
            let glyph = match (part, theme.ascii) {
                (0, _) => continue,
                (_, true) => "#",
                (part, false) => EIGHTHS[part],
            };
            let place = row(area, usize::from(area.height - 1 - level));
            put(&glyph.repeat(wide), Style::new(), number * wide, place, buf);
        }
    }
}

/// `bar` in units in which `most` is `full`.
fn scaled(bar: u64, full: u64, most: u64) -> u64 {
    let exact = u128::from(bar) * u128::from(full) / u128::from(most);
    u64::try_from(exact).unwrap_or(full)
}

/// The axis under the bars.
struct BinAxis<'a> {
    latency: &'a LatencyData,
    /// Columns used by bars.
    used: usize,
    /// Seconds per column.
    per_column: f64,
}

impl BinAxis<'_> {
    /// Zero, the period, and the beginning of the last bar, if there is room beside the
    /// period.
    fn draw(&self, theme: &Theme, row: Rect, buf: &mut Buffer) {
        let last = self.latency.bin.as_secs_f64() * (self.latency.bins.len() - 1) as f64;
        let end = format!("{}{:.0} ms", theme.glyph("≥", ">="), last * 1e3);
        let wide = pane::width(&end);
        let room = usize::from(row.width);
        let start = self.used.max(wide + 4).min(room).saturating_sub(wide);
        put("0", theme.faint(), 0, row, buf);
        let before = (2, start.saturating_sub(1));
        let period = self
            .period(before, theme)
            .or_else(|| self.period((2, room), theme));
        let taken = period
            .as_ref()
            .map_or(0, |(at, text)| at + pane::width(text));
        if let Some((at, text)) = period {
            put(&text, theme.strong(), at, row, buf);
        }
        if start > taken.max(1) {
            put(&end, theme.faint(), start, row, buf);
        }
    }

    /// The label of the period and its column below the bars, between columns `from` and
    /// `to`.
    fn period(&self, (from, to): (usize, usize), theme: &Theme) -> Option<(usize, String)> {
        let period = self.latency.period.as_secs_f64();
        let text = format!("period {:.0} ms", period * 1e3);
        let wide = pane::width(&text) + 1;
        let column = (period / self.per_column).floor();
        // Beyond the last bar it has no column.
        if !(0.0..self.used as f64).contains(&column) {
            return (from + wide < to).then(|| (to - wide, text));
        }
        let column = usize::from(clamp(column as usize));
        let arrow = theme.glyph("▲", "^");
        if column >= from && column + 1 + wide <= to {
            Some((column, format!("{arrow} {text}")))
        } else if column >= from + wide && column < to {
            Some((column - wide, format!("{text} {arrow}")))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ratatui::buffer::Buffer;

    use super::render;
    use crate::{
        dashboard::{
            frame::LatencyData,
            view::{
                pane::testing::{POOR, RICH, screen, styled, text, torture},
                sample,
            },
        },
        theme::Theme,
    };

    fn bars(latency: &LatencyData, width: u16, height: u16, theme: &Theme) -> Buffer {
        screen(width, height, |area, buf| render(latency, theme, area, buf))
    }

    #[test]
    fn bars_stand_over_their_latency() {
        let buf = bars(&sample::latency(), 40, 5, &RICH);
        insta::assert_snapshot!(text(&buf), @r"
                    ████▂▂▂▂
                    ████████
                ▃▃▃▃████████▂▂▂▂
            ▁▁▁▁████████████████▄▄▄▄▁▁▁▁▁▁▁▁▁▁▁▁
        0               ▲ period 20 ms    ≥45 ms
        ");
        assert_eq!(styled(&buf, RICH.strong()), "▲ period 20 ms");
    }

    #[test]
    fn bins_share_a_bar_where_it_is_narrow() {
        insta::assert_snapshot!(text(&bars(&sample::latency(), 9, 4, &RICH)), @r"
         █▄
         ██
        ▁██▃▁
        0  ≥45 ms
        ");
        insta::assert_snapshot!(text(&bars(&sample::latency(), 30, 3, &POOR)), @r"
                 ######
           ###########################
        0           ^ period 20 ms
        ");
    }

    #[test]
    fn a_period_out_of_sight_is_told() {
        let mut latency = sample::latency();
        latency.period = Duration::from_secs(1);
        insta::assert_snapshot!(text(&bars(&latency, 40, 3, &RICH)), @r"
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
        torture(|theme, area, buf| render(&odd, theme, area, buf));
        torture(|theme, area, buf| render(&LatencyData::default(), theme, area, buf));
    }
}
