//! The figures of a row: in a list, in Markdown, in JSON and as curves.

use ratelab::millis;
use serde_json::{Value, json};

use super::summary::{RowSummary, SweepSummary};
use crate::summary::rounded;

/// A figure of the runs of a row.
pub struct Figure {
    /// Its name, with the unit where a column has no other text for it.
    pub name: &'static str,
    /// The unit, where the name lacks it.
    pub unit: &'static str,
    /// Its key in JSON.
    pub key: &'static str,
    /// The figure; `None` if it is unknown.
    pub value: fn(&RowSummary) -> Option<f64>,
    /// Its digits, where it is known.
    digits: fn(f64) -> String,
}

/// Mean latency.
pub const LATENCY: Figure = Figure {
    name: "latency ms",
    unit: "",
    key: "mean_latency_ms",
    value: |row| row.mean_latency_s.map(|s| s * 1e3),
    digits: millis::text,
};

/// Mean push age.
pub const AGE: Figure = Figure {
    name: "push age",
    unit: " ms",
    key: "mean_late_push_age_ms",
    value: |row| row.push_age_s.map(|s| s * 1e3),
    digits: millis::text,
};

/// When the runs were lost.
const LOST: Figure = Figure {
    name: "lost at s",
    unit: "",
    key: "median_lost_at_s",
    value: |row| row.lost_at_s,
    digits: |s| format!("{s:.2}"),
};

/// The quadratic cost, with three digits that count.
const COST: Figure = Figure {
    name: "cost",
    unit: "",
    key: "mean_quadratic_cost",
    value: |row| row.cost,
    digits: |cost| match cost {
        ..0.1 => format!("{cost:.4}"),
        ..1.0 => format!("{cost:.3}"),
        _ => format!("{cost:.2}"),
    },
};

/// The growth of a small deviation by linear theory (1/s).
pub const GROWTH: Figure = Figure {
    name: "growth",
    unit: "",
    key: "growth_per_s",
    value: |row| row.theory.growth,
    digits: |growth| format!("{growth:+.2}"),
};

/// The share of starts that stand for ten seconds, by linear theory: of policies that answer
/// with chunks.
pub const STANDS: Figure = Figure {
    name: "stands",
    unit: "",
    key: "stands_by_theory",
    value: |row| row.theory.stands,
    digits: |share| format!("{share:.2}"),
};

/// Returns the figures of all rows, as far as the system has them and they are asked for.
pub fn all(summary: &SweepSummary) -> Vec<Figure> {
    let mut figures = vec![LATENCY, AGE, LOST];
    let cost = summary.sweep.system.judge().quadratic_cost();
    figures.extend(cost.map(|_| COST));
    figures.extend(theory(summary));
    figures
}

/// Returns the figures of linear theory, if it is asked for: the growth, and what it has for
/// chunks.
pub fn theory(summary: &SweepSummary) -> impl Iterator<Item = Figure> {
    let of_chunks = summary.rows().iter().any(|row| row.theory.stands.is_some());
    let figures = [Some(GROWTH), of_chunks.then_some(STANDS)];
    figures.into_iter().flatten().filter(|_| summary.theory)
}

/// Width of the narrowest column of a list.
const NARROWEST: usize = 6;

impl Figure {
    /// Returns the width of its column in a list.
    pub fn width(&self) -> usize {
        self.name.len().max(NARROWEST)
    }

    /// Returns the figure of `row` as text; without growth, whether deviations shrink for sure.
    pub fn text(&self, row: &RowSummary) -> String {
        let sure = row.theory.sure.filter(|_| self.key == GROWTH.key);
        match ((self.value)(row), sure) {
            (Some(value), _) => (self.digits)(value),
            (None, Some(true)) => "sure".to_owned(),
            (None, Some(false)) => "?".to_owned(),
            (None, None) => "-".to_owned(),
        }
    }

    /// Returns the figure of `row` for programs; a cost has more digits.
    pub fn json(&self, row: &RowSummary) -> Value {
        let value = (self.value)(row);
        if self.key == COST.key {
            json!(value)
        } else {
            json!(value.map(rounded))
        }
    }
}

/// Returns how many runs were successful.
pub fn count(row: &RowSummary) -> String {
    match row.survival.runs {
        0 => "-".to_owned(),
        runs => format!("{} of {runs}", row.survival.held),
    }
}
