//! The cliff map: a column per rate, a row per seed, over the panes.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    style::{Modifier, Style},
    text::Span,
    widgets::{Clear, Widget},
};

use super::pane::{border, clamp, clip, put, row, width};
use crate::{dashboard::cliff::CliffMap, sweep::survival_level::SurvivalLevel, theme::Theme};

/// Maximum number of visible rows of seeds.
const MOST_SEEDS: usize = 24;

/// Number of other rows: the total over all seeds, and two lines about the cursor.
const OTHERS: usize = 3;

/// Title of the overlay.
const TITLE: &str = "cliff map";

/// Label of the cells of all seeds.
const ALL: &str = "all";

/// Draws `map` in the lower right corner of `area`.
pub fn render(map: &CliffMap, theme: &Theme, area: Rect, buf: &mut Buffer) {
    let grid = Grid::new(map, area.intersection(buf.area));
    Clear.render(grid.place, buf);
    let (done, all) = map.progress();
    let progress = if done < all {
        format!("{done} of {all} runs")
    } else {
        format!("{all} runs of {} s", map.sweep().base.end.as_secs_f64())
    };
    // The progress has priority over the conditions.
    let room = usize::from(grid.place.width).saturating_sub(width(&progress) + 4);
    let name = clip(&title(map), room.max(TITLE.len()), theme);
    let right = Span::styled(progress, theme.faint());
    let inner = border(&name, right, theme, true, grid.place, buf);
    grid.draw_axis(theme, inner, buf);
    grid.draw_all(theme, inner, buf);
    let seeds = grid.seeds();
    for (number, seed) in seeds.clone().enumerate() {
        let line = row(inner, grid.digits + 1 + number);
        grid.draw_seed(seed, theme, line, buf);
    }
    let below = grid.digits + 1 + seeds.len();
    for (number, text) in said(map, theme).iter().enumerate() {
        let text = clip(text, usize::from(inner.width), theme);
        put(&text, Style::new(), 0, row(inner, below + number), buf);
    }
}

fn title(map: &CliffMap) -> String {
    let mut parts = Vec::new();
    if let (Some(rows), Some(seed)) = (map.row_heading(), map.only_seed()) {
        parts.push(format!("{} by {rows}, seed {seed}", map.heading()));
    } else if !map.heading().ends_with(" Hz") {
        parts.push(map.heading());
    }
    parts.extend(Some(map.conditions()).filter(|conditions| !conditions.is_empty()));
    match parts.join(" | ") {
        none if none.is_empty() => TITLE.to_owned(),
        parts => format!("{TITLE}: {parts}"),
    }
}

/// The result at the cursor, and the results of all seeds at its rate.
fn said(map: &CliffMap, theme: &Theme) -> [String; 2] {
    let (column, row) = map.at();
    let (x, y) = map.place();
    let run = match map.outcome(column, row) {
        None => "not run yet".to_owned(),
        Some(outcome) => {
            let latency = outcome.mean_latency_s.map_or(String::new(), |latency| {
                format!(", latency {:.1} ms", latency * 1e3)
            });
            format!("{}{latency}", outcome.verdict)
        }
    };
    let (well, runs) = map.survival(column);
    let verdicts = map.sweep().system.verdicts().iter();
    let word = verdicts.map(|kind| kind.name.replace('_', " ")).next();
    let word = word.unwrap_or_default();
    let all = match map.only_seed() {
        None => format!("{x}: {well} of {runs} seeds {word}"),
        Some(_) => SurvivalLevel::key(&word, theme),
    };
    [format!("{x}, {y}: {run}"), all]
}

/// The layout of the cells.
struct Grid<'a> {
    map: &'a CliffMap,
    /// The whole overlay.
    place: Rect,
    /// Columns before the cells.
    label: usize,
    /// Columns of a cell.
    cell: usize,
    /// Rows for the rates, which are written downwards.
    digits: usize,
}

impl<'a> Grid<'a> {
    fn new(map: &'a CliffMap, area: Rect) -> Self {
        let rows = (0..map.row_count()).map(|row| map.row_label(row).len());
        // A sign, the number, a blank.
        let label = rows.max().unwrap_or(0).max(ALL.len()) + 2;
        let rates = map.columns();
        let labels = rates.iter().map(|rate| rate.text.len());
        let digits = labels.max().unwrap_or(1);
        let room = usize::from(area.width).saturating_sub(label + 2);
        let cell = if 2 * rates.len() <= room { 2 } else { 1 };
        let wide = label + cell * rates.len() + 2;
        let high = digits + MOST_SEEDS.min(map.row_count()) + OTHERS + 2;
        let (wide, high) = (clamp(wide).min(area.width), clamp(high).min(area.height));
        Self {
            map,
            place: Rect {
                x: area.right() - wide,
                y: area.bottom() - high,
                width: wide,
                height: high,
            },
            label,
            cell,
            digits,
        }
    }

    /// The visible seeds, around the one at the cursor.
    fn seeds(&self) -> std::ops::Range<usize> {
        let count = self.map.row_count();
        let room = usize::from(self.place.height.saturating_sub(2));
        let room = room.saturating_sub(self.digits + OTHERS).min(count);
        let first = self.map.at().1.saturating_sub(room / 2).min(count - room);
        first..first + room
    }

    /// The rates, written downwards, with the one at the cursor highlighted.
    fn draw_axis(&self, theme: &Theme, inner: Rect, buf: &mut Buffer) {
        let heading = self.map.heading();
        let unit = heading.rsplit(' ').next().filter(|unit| unit.len() == 2);
        let line = row(inner, self.digits.saturating_sub(1));
        put(unit.unwrap_or_default(), theme.faint(), 1, line, buf);
        for (rate, value) in self.map.columns().iter().enumerate() {
            let chosen = rate == self.map.at().0;
            let style = if chosen {
                theme.strong().add_modifier(Modifier::REVERSED)
            } else {
                theme.faint()
            };
            let text = format!("{:>width$}", value.text, width = self.digits);
            for (number, letter) in text.chars().enumerate() {
                let letter = format!("{letter:<cell$}", cell = self.cell);
                put(&letter, style, self.column(rate), row(inner, number), buf);
            }
        }
    }

    /// The number of runs held over all seeds, by rate.
    fn draw_all(&self, theme: &Theme, inner: Rect, buf: &mut Buffer) {
        let line = row(inner, self.digits);
        put(ALL, theme.strong(), 1, line, buf);
        for rate in 0..self.map.columns().len() {
            let (well, runs) = self.map.survival(rate);
            let level = SurvivalLevel::of(well, runs);
            self.put_cell(level, rate, false, theme, line, buf);
        }
    }

    fn draw_seed(&self, seed: usize, theme: &Theme, line: Rect, buf: &mut Buffer) {
        let here = seed == self.map.at().1;
        let number = self.map.row_label(seed);
        let style = if here { theme.strong() } else { theme.faint() };
        let start = (self.label - 1).saturating_sub(width(&number));
        put(&number, style, start, line, buf);
        if here {
            put(theme.glyph("▸", ">"), theme.strong(), 0, line, buf);
        }
        for rate in 0..self.map.columns().len() {
            let outcome = self.map.outcome(rate, seed);
            let well = outcome.map_or(0, |outcome| usize::from(!outcome.verdict.is_lost()));
            let level = SurvivalLevel::of(well, usize::from(outcome.is_some()));
            let chosen = here && rate == self.map.at().0;
            self.put_cell(level, rate, chosen, theme, line, buf);
        }
    }

    fn put_cell(
        &self,
        level: SurvivalLevel,
        rate: usize,
        chosen: bool,
        theme: &Theme,
        line: Rect,
        buf: &mut Buffer,
    ) {
        let mut style = level.style(theme);
        if chosen {
            style = style.add_modifier(Modifier::REVERSED);
        }
        let text = level.glyph(theme).repeat(self.cell);
        put(&text, style, self.column(rate), line, buf);
    }

    fn column(&self, rate: usize) -> usize {
        self.label + rate * self.cell
    }
}

#[cfg(test)]
mod tests {
    use super::render;
    use crate::{
        dashboard::{
            cliff::sample::half_filled,
            knobs::Direction,
            view::pane::testing::{POOR, RICH, screen, styled, text, torture},
        },
        theme::Theme,
    };

    fn drawn(width: u16, height: u16, theme: &Theme) -> ratatui::buffer::Buffer {
        let map = half_filled();
        screen(width, height, |area, buf| render(&map, theme, area, buf))
    }

    #[test]
    fn rates_go_across_and_seeds_down() {
        insta::assert_snapshot!(text(&drawn(80, 14, &RICH)), @"
        ┌cliff map───────────────────────────────────────1500 of 3000 runs┐
        │                       1 1 1 1 1 1 1 1 1 1 2 2 2 2 2 2 2 2 2 2 3 │
        │ Hz  1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 │
        │ all ··········▒▒▒▒████████████████                              │
        │ 100 ··········████████████████████                              │
        │ 101 ··············████████████████                              │
        │ 102 ··············████████████████                              │
        │▸103 ··········████████████████████                              │
        │ 104 ··············████████████████                              │
        │ 105 ··············████████████████                              │
        │ 106 ··········████████████████████                              │
        │7 Hz, seed 103: BALANCED (pole up the whole run), latency 77.9 ms│
        │7 Hz: 34 of 100 seeds balanced                                   │
        └─────────────────────────────────────────────────────────────────┘
        ");
    }

    #[test]
    fn where_it_is_narrow_a_cell_is_one_column() {
        insta::assert_snapshot!(text(&drawn(40, 10, &POOR)), @"
        +cliff map---------1500 of 3000 runs+
        |              111111111122222222223|
        | Hz  123456789012345678901234567890|
        | all .....==########               |
        | 102 .......########               |
        |>103 .....##########               |
        | 104 .......########               |
        |7 Hz, seed 103: BALANCED (pole u...|
        |7 Hz: 34 of 100 seeds balanced     |
        +-----------------------------------+
        ");
    }

    #[test]
    fn colour_tells_up_from_down_and_so_does_the_glyph() {
        let buf = drawn(80, 14, &RICH);
        let up = styled(&buf, RICH.good());
        assert!(up.chars().all(|glyph| "▒▓█".contains(glyph)), "{up}");
        let down = styled(&buf, RICH.alarm_line());
        assert!(down.chars().all(|glyph| "·░".contains(glyph)), "{down}");
    }

    #[test]
    fn the_place_stays_in_sight() {
        let mut map = half_filled();
        for _ in 0..200 {
            map.move_seed(Direction::Up);
        }
        let buf = screen(80, 14, |area, buf| render(&map, &RICH, area, buf));
        assert!(text(&buf).contains("▸199"), "{}", text(&buf));
    }

    #[test]
    fn any_size_will_do() {
        let map = half_filled();
        torture(|theme, area, buf| render(&map, theme, area, buf));
    }
}
