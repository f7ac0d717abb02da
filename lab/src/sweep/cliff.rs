//! Where the runs of a sweep are lost, as text: the position of the cliff, and the runs by their
//! age.

use std::collections::BTreeMap;

use ratelab::KnobKind;
use ratelab_experiment::sweep::{ByAge, Swept};
use ratelab_screen::{SurvivalLevel, Theme};
use ratelab_system::names::key;
use serde::Serialize;

use super::summary::{RowSummary, SweepSummary};
use crate::summary::{
    json,
    text::{line, ms},
};

/// Returns the lines for the rows of one group.
pub fn lines(summary: &SweepSummary, rows: &[RowSummary]) -> Vec<String> {
    let mut rows: Vec<&RowSummary> = rows.iter().filter(|row| row.survival.runs > 0).collect();
    if rows.len() < 2 || rows.iter().any(|row| row.number().is_nan()) {
        return Vec::new();
    }
    rows.sort_by(|a, b| a.number().total_cmp(&b.number()));
    let helps = rows[0].survival.share() <= rows[rows.len() - 1].survival.share();
    if !helps {
        rows.reverse();
    }
    let cliff = CliffWords { summary, helps };
    let mut lines = vec![line("cliff", &cliff.edges(&rows))];
    lines.extend(cliff.dip(&rows).map(|text| line("uneven", &text)));
    lines
}

/// The words for a quantity with an order.
struct CliffWords<'s> {
    summary: &'s SweepSummary,
    /// Whether more of it is better.
    helps: bool,
}

impl CliffWords<'_> {
    /// Returns what its values are called, and what is better.
    fn words(&self) -> (&'static str, &'static str) {
        match (self.summary.main.kind, self.helps) {
            (KnobKind::Rate, true) => ("rate", "faster"),
            (KnobKind::Rate, false) => ("rate", "slower"),
            (KnobKind::Depth, true) => ("depth", "deeper"),
            (KnobKind::Depth, false) => ("depth", "shallower"),
            (_, true) => ("value", "more"),
            (_, false) => ("value", "less"),
        }
    }

    fn at(&self, row: &RowSummary) -> String {
        self.summary.main.with_unit(&row.value)
    }

    /// Returns the values of the better or the worse end, as far as `row`.
    fn end(&self, better: bool, row: &RowSummary) -> String {
        if better == self.helps {
            format!("from {} on", self.at(row))
        } else {
            format!("up to {}", self.at(row))
        }
    }

    /// Returns the last value without successful runs, and the first from which on all are
    /// successful.
    fn edges(&self, rows: &[&RowSummary]) -> String {
        let (good, (noun, _)) = (&self.summary.good, self.words());
        let down = rows.iter().take_while(|row| row.survival.held == 0).count();
        let up = rows
            .iter()
            .rev()
            .take_while(|row| row.survival.held == row.survival.runs)
            .count();
        let last_down = down.checked_sub(1).map(|last| self.end(false, rows[last]));
        let first_up = (up > 0).then(|| self.end(true, rows[rows.len() - up]));
        let (higher, lowest, highest) = if self.helps {
            ("higher", "lowest", "highest")
        } else {
            ("lower", "highest", "lowest")
        };
        match (last_down, first_up) {
            _ if down == rows.len() => format!("none {good} at any of these {noun}s"),
            _ if up == rows.len() => format!("all {good} at each of these {noun}s"),
            (Some(down), Some(up)) => format!("none {good} {down}, all {up}"),
            (Some(down), None) => {
                format!("none {good} {down}, not all at any {higher} {noun} to the end")
            }
            (None, Some(up)) => format!("all {good} {up}"),
            (None, None) => format!("some {good} at the {lowest} {noun}, not all at the {highest}"),
        }
    }

    /// Returns the value at which most is lost by going to the next better one.
    fn dip(&self, rows: &[&RowSummary]) -> Option<String> {
        let drops = rows.windows(2).filter_map(|pair| {
            let drop = pair[0].survival.share()? - pair[1].survival.share()?;
            (drop > 0.0).then_some((drop, pair))
        });
        let (_, pair) = drops.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let [less, more] =
            [pair[0], pair[1]].map(|row| format!("{} at {}", row.survival_text(), self.at(row)));
        let (_, better) = self.words();
        Some(format!("{less}, then {more}: {better}, yet worse"))
    }
}

/// Bin widths to choose from (ms).
const WIDTHS_MS: [f64; 6] = [5.0, 10.0, 20.0, 50.0, 100.0, 1_000.0];

/// Maximum number of bins, if a width allows it.
const MAX_BINS: usize = 20;

/// Width of a bar (columns).
const BAR: usize = 24;

/// The quantity.
const AGE: &str = "mean push age in the last second of a run; of one that was lost, before it was";

/// The survival of a sweep, by age.
pub struct AgeTable {
    by_age: ByAge,
    width_s: f64,
    good: String,
    /// Number of runs without a push.
    without: usize,
}

impl AgeTable {
    /// Creates the table for the runs of `swept`.
    pub fn new(swept: &Swept, summary: &SweepSummary) -> Self {
        let by_age = ByAge::new(swept.finished().map(|(_, result)| result));
        let fits = |width: &f64| by_age.bins(width / 1e3).len() <= MAX_BINS;
        let width = WIDTHS_MS.into_iter().find(fits);
        Self {
            width_s: width.unwrap_or(WIDTHS_MS[WIDTHS_MS.len() - 1]) / 1e3,
            good: summary.good.clone(),
            without: summary.runs - by_age.len(),
            by_age,
        }
    }

    /// Returns a line for each bin, and a conclusion.
    pub fn lines(&self, theme: &Theme) -> Vec<String> {
        if self.by_age.is_empty() {
            return vec![line("age", "no run pushed: there is no age to count by")];
        }
        let bins = self.by_age.bins(self.width_s);
        let count = |held, runs| format!("{held} of {runs}");
        let wide = bins
            .iter()
            .map(|bin| count(bin.held, bin.runs).len())
            .max()
            .unwrap_or(0)
            .max(self.good.len());
        let mut lines = vec![format!("{:>9}  {:>wide$}", "age ms", self.good)];
        for bin in &bins {
            let range = format!("{:.0}..{:.0}", bin.from_s * 1e3, bin.to_s * 1e3);
            let bar = SurvivalLevel::bar(bin.held, bin.runs, BAR, theme);
            let count = count(bin.held, bin.runs);
            lines.push(format!("{range:>9}  {count:>wide$}  {bar}"));
        }
        lines.push(String::new());
        lines.push(line("age", AGE));
        lines.push(line("limit", &self.limit()));
        if self.without > 0 {
            let without = format!("{} runs that never pushed", self.without);
            lines.push(line("left out", &without));
        }
        lines
    }

    fn limit(&self) -> String {
        let good = &self.good;
        let (lost, held) = (self.by_age.youngest_lost_s(), self.by_age.oldest_held_s());
        let apart = lost.zip(held).is_some_and(|(lost, held)| held < lost);
        match (lost.map(ms), held.map(ms), self.by_age.split()) {
            (Some(lost), Some(held), _) if apart => {
                format!("all {good} up to {held}, none from {lost} on")
            }
            (Some(lost), Some(held), Some(split)) => format!(
                "all {good} below {lost}, none above {held}; {} parts them best: {} of {} runs \
                 are on its wrong side",
                ms(split.at_s),
                split.misjudged,
                self.by_age.len()
            ),
            (None, Some(held), _) => format!("all {good}, up to {held}"),
            (Some(lost), _, _) => format!("none {good}, from {lost} on"),
            (None, None, _) => "not known".to_owned(),
        }
    }

    /// Returns the table for programs.
    pub fn figures(&self) -> AgeTableFigures {
        let bins = self.by_age.bins(self.width_s).into_iter();
        let split = self.by_age.split();
        AgeTableFigures {
            bins: bins
                .map(|bin| BinFigures {
                    from_ms: json::ms(bin.from_s),
                    to_ms: json::ms(bin.to_s),
                    runs: bin.runs,
                    held: [(key(&self.good), bin.held)].into(),
                })
                .collect(),
            limit_ms: split.map(|split| json::ms(split.at_s)),
            misjudged: split.map(|split| split.misjudged),
            oldest_held_ms: self.by_age.oldest_held_s().map(json::ms),
            runs: self.by_age.len(),
            without_push: self.without,
            youngest_lost_ms: self.by_age.youngest_lost_s().map(json::ms),
        }
    }
}

/// The table for programs.
#[derive(Serialize)]
pub struct AgeTableFigures {
    bins: Vec<BinFigures>,
    limit_ms: Option<f64>,
    misjudged: Option<usize>,
    oldest_held_ms: Option<f64>,
    runs: usize,
    without_push: usize,
    youngest_lost_ms: Option<f64>,
}

/// The runs whose age is between two ages.
#[derive(Serialize)]
struct BinFigures {
    from_ms: f64,
    to_ms: f64,
    runs: usize,
    /// How many were not lost, by the word of the system for it.
    #[serde(flatten)]
    held: BTreeMap<String, usize>,
}
