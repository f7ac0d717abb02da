//! The cliff map: a column per rate, a row per seed, over the panes.

use std::ops::Range;

use ratatui::{
    style::{Modifier, Style},
    text::{Line, Span},
};
use ratelab::millis;

use super::{
    sheet::{Sheet, columns, rows},
    text::{clip, line, pad, width},
};
use crate::{
    cliff::{CliffMap, HeldRuns},
    theme::{SurvivalLevel, Theme},
};

/// Maximum number of visible rows of seeds.
const MAX_SEEDS: usize = 24;

/// Number of other rows: the total over all seeds, two lines about the cursor, and the legend.
const OTHERS: usize = 4;

/// Rows and columns of the box.
const BORDERS: usize = 2;

/// Title of the overlay.
const TITLE: &str = "cliff map";

/// Label of the cells of all seeds.
const ALL: &str = "all";

/// Draws `map` in the lower right corner.
pub fn render(map: &CliffMap, mut sheet: Sheet<'_>) {
    sheet.focused = true;
    let theme = sheet.theme;
    let grid = Grid::new(map, theme, (sheet.width(), sheet.height()));
    let right = columns(sheet.area, sheet.width() - grid.size.0, grid.size.0);
    let place = rows(right, sheet.height() - grid.size.1, grid.size.1);
    let mut cleared = sheet.part(place);
    cleared.clear();
    let (done, all) = (map.done(), map.runs());
    let progress = if done < all {
        format!("{done} of {all} runs")
    } else {
        format!("{all} runs of {} s", map.sweep.base.end.as_secs_f64())
    };
    // The progress has priority over the conditions.
    let room = cleared.width().saturating_sub(width(&progress) + 4);
    let name = clip(&title(map), room.max(TITLE.len()), theme);
    let mut pane = cleared.boxed(&name, Span::styled(progress, theme.faint()));
    let seeds = grid.seeds().map(|seed| grid.seed(seed));
    let lines = grid.axis().into_iter().chain([grid.all()]).chain(seeds);
    let said = said(map, theme).into_iter().map(Line::raw);
    pane.lines(0, 0, lines.chain(said));
}

fn title(map: &CliffMap) -> String {
    let mut parts = Vec::new();
    if let (Some(rows), Some(seed)) = (map.row_heading(), map.only_seed()) {
        parts.push(format!("{} by {rows}, seed {seed}", map.x.heading()));
    } else if !map.x.heading().ends_with(" Hz") {
        parts.push(map.x.heading());
    }
    parts.extend(Some(map.conditions()).filter(|conditions| !conditions.is_empty()));
    match parts.join(" | ") {
        none if none.is_empty() => TITLE.to_owned(),
        parts => format!("{TITLE}: {parts}"),
    }
}

/// Returns the result at the cursor, the results of all seeds at its rate, and the legend.
fn said(map: &CliffMap, theme: &Theme) -> Vec<String> {
    let (column, row) = map.at;
    let (x, y) = map.place();
    let run = match map.outcome(column, row) {
        None => "not run yet".to_owned(),
        Some(outcome) => {
            let latency = outcome.mean_latency_s.map_or(String::new(), |latency| {
                format!(", latency {} ms", millis::text(latency * 1e3))
            });
            format!("{}{latency}", outcome.verdict)
        }
    };
    let HeldRuns { held, finished } = map.survival(column);
    let word = map
        .sweep
        .system
        .verdicts()
        .into_iter()
        .map(|kind| kind.name.replace('_', " "))
        .next()
        .unwrap_or_default();
    let all = match map.only_seed() {
        None => Some(format!("{x}: {held} of {finished} seeds {word}")),
        Some(_) => None,
    };
    let here = format!("{x}, {y}: {run}");
    let legend = SurvivalLevel::key(&word, theme);
    [here].into_iter().chain(all).chain([legend]).collect()
}

/// The layout of the cells.
struct Grid<'a> {
    map: &'a CliffMap,
    theme: &'a Theme,
    /// Width and height of the whole overlay.
    size: (usize, usize),
    /// Columns before the cells.
    label: usize,
    /// Columns of a cell.
    cell: usize,
    /// Rows for the rates, which are written downwards.
    digits: usize,
}

impl<'a> Grid<'a> {
    /// Creates the layout for an area of some width and height.
    fn new(map: &'a CliffMap, theme: &'a Theme, area: (usize, usize)) -> Self {
        let labels = (0..map.rows.len()).map(|row| map.row_label(row).len());
        // A sign, the number, a blank.
        let label = labels.max().unwrap_or(0).max(ALL.len()) + 2;
        let rates = &map.columns;
        let digits = rates.iter().map(|rate| rate.text.len()).max().unwrap_or(1);
        let room = area.0.saturating_sub(label + BORDERS);
        let cell = if 2 * rates.len() <= room { 2 } else { 1 };
        let wide = label + cell * rates.len() + BORDERS;
        let high = digits + MAX_SEEDS.min(map.rows.len()) + OTHERS + BORDERS;
        Self {
            map,
            theme,
            size: (wide.min(area.0), high.min(area.1)),
            label,
            cell,
            digits,
        }
    }

    /// Returns the visible seeds, around the one at the cursor.
    fn seeds(&self) -> Range<usize> {
        let count = self.map.rows.len();
        let others = self.digits + OTHERS + BORDERS;
        let room = self.size.1.saturating_sub(others).min(count);
        let first = self.map.at.1.saturating_sub(room / 2).min(count - room);
        first..first + room
    }

    /// Returns the rates, written downwards, with the one at the cursor highlighted.
    fn axis(&self) -> Vec<Line<'static>> {
        let theme = self.theme;
        let heading = self.map.x.heading();
        let unit = heading.rsplit(' ').next().filter(|unit| unit.len() == 2);
        let rows = (0..self.digits).map(|row| {
            let unit_here = unit.filter(|_| row + 1 == self.digits).unwrap_or_default();
            let label = pad(&format!(" {unit_here}"), self.label, theme);
            let letters = self.map.columns.iter().enumerate().map(|(rate, value)| {
                let text = format!("{:>digits$}", value.text, digits = self.digits);
                let style = if rate == self.map.at.0 {
                    theme.strong().add_modifier(Modifier::REVERSED)
                } else {
                    theme.faint()
                };
                (pad(&text[row..=row], self.cell, theme), style)
            });
            line([(label, theme.faint())].into_iter().chain(letters))
        });
        rows.collect()
    }

    /// Returns the number of runs held over all seeds, by rate.
    fn all(&self) -> Line<'static> {
        let label = pad(&format!(" {ALL}"), self.label, self.theme);
        let columns = 0..self.map.columns.len();
        let survivals = columns.map(|rate| (self.map.survival(rate), false));
        self.row((label, self.theme.strong()), survivals)
    }

    /// Returns the runs of a seed.
    fn seed(&self, seed: usize) -> Line<'static> {
        let here = seed == self.map.at.1;
        let (mark, style) = if here {
            ("▸", self.theme.strong())
        } else {
            (" ", self.theme.faint())
        };
        let number = self.map.row_label(seed);
        let label = format!("{mark}{number:>digits$} ", digits = self.label - 2);
        let outcomes = (0..self.map.columns.len()).map(|rate| {
            let outcome = self.map.outcome(rate, seed);
            let held = outcome.is_some_and(|outcome| !outcome.is_lost());
            let survival = HeldRuns {
                held: held.into(),
                finished: outcome.is_some().into(),
            };
            (survival, here && rate == self.map.at.0)
        });
        self.row((label, style), outcomes)
    }

    /// Returns a label, and cells of runs, with the chosen one highlighted.
    fn row(
        &self,
        label: (String, Style),
        survivals: impl Iterator<Item = (HeldRuns, bool)>,
    ) -> Line<'static> {
        let cells = survivals.map(|(runs, chosen)| {
            let level = SurvivalLevel::new(runs.held, runs.finished);
            let style = if chosen {
                level.style(self.theme).add_modifier(Modifier::REVERSED)
            } else {
                level.style(self.theme)
            };
            (level.glyph(self.theme).repeat(self.cell), style)
        });
        line([label].into_iter().chain(cells))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cliff::tests::sample::half_filled, knobs::Direction, view::testing::*};

    fn shown(map: &CliffMap) -> String {
        drawn((80, 14), &RICH, |sheet| render(map, sheet))
    }

    #[test]
    fn rates_go_across_and_seeds_down() {
        insta::assert_snapshot!(shown(&half_filled()), @"
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
        │7 Hz, seed 103: BALANCED (pole up the whole run), latency 77.9 ms│
        │7 Hz: 34 of 100 seeds balanced                                   │
        │· none balanced, ░ ▒ ▓ some, █ all                               │
        └─────────────────────────────────────────────────────────────────┘
        ");
    }

    #[test]
    fn colour_tells_up_from_down_and_so_does_the_glyph() {
        let map = half_filled();
        let buf = screen((80, 14), &RICH, |sheet| render(&map, sheet));
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
        let shown = shown(&map);
        assert!(shown.contains("▸199"), "{shown}");
    }

    #[test]
    fn any_size_will_do() {
        let map = half_filled();
        torture(|sheet| render(&map, sheet));
    }
}
