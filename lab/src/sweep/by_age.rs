//! The runs of a sweep by their age.

use std::collections::BTreeMap;

use ratelab_experiment::sweep::{ByAge, Swept};
use ratelab_screen::{SurvivalLevel, Theme};
use ratelab_system::names::key;
use serde::Serialize;

use super::summary::SweepSummary;
use crate::summary::{
    json,
    text::{line, ms},
};

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
