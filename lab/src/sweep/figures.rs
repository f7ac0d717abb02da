//! The figures of a row: in a list, in Markdown, in JSON and as curves.

use serde_json::{Value, json};

use super::summary::{RowSummary, SweepSummary};
use crate::metrics::rounded;

/// A figure of the runs of a row.
pub struct Figure {
    /// Its name, with the unit where a column has no other text for it.
    pub name: &'static str,
    /// The unit, where the name lacks it.
    pub unit: &'static str,
    /// Width of its column in a list.
    pub width: usize,
    /// Its key in JSON.
    pub key: &'static str,
    /// The figure; `None` if it is unknown.
    pub value: fn(&RowSummary) -> Option<f64>,
    places: fn(f64) -> usize,
}

/// Mean latency.
pub const LATENCY: Figure = Figure {
    name: "latency ms",
    unit: "",
    width: 10,
    key: "mean_latency_ms",
    value: |row| row.mean_latency_s.map(|s| s * 1e3),
    places: |_| 1,
};

/// Mean push age.
pub const AGE: Figure = Figure {
    name: "push age",
    unit: " ms",
    width: 8,
    key: "mean_late_push_age_ms",
    value: |row| row.push_age_s.map(|s| s * 1e3),
    places: |_| 1,
};

/// When the runs were lost.
const LOST: Figure = Figure {
    name: "lost at s",
    unit: "",
    width: 9,
    key: "median_lost_at_s",
    value: |row| row.lost_at_s,
    places: |_| 2,
};

/// The quadratic cost, with three digits that count.
const COST: Figure = Figure {
    name: "cost",
    unit: "",
    width: 6,
    key: "mean_quadratic_cost",
    value: |row| row.cost,
    places: |cost| match cost {
        ..0.1 => 4,
        ..1.0 => 3,
        _ => 2,
    },
};

/// The figures of all rows, as far as the system has them.
pub fn of(summary: &SweepSummary) -> Vec<Figure> {
    let mut figures = vec![LATENCY, AGE, LOST];
    let cost = summary.sweep.system.quadratic_cost();
    figures.extend(cost.map(|_| COST));
    figures
}

impl Figure {
    /// The figure of `row` as text.
    pub fn text(&self, row: &RowSummary) -> String {
        (self.value)(row).map_or("-".to_owned(), |value| {
            format!("{value:.places$}", places = (self.places)(value))
        })
    }

    /// The figure of `row` for programs; a cost has more digits.
    pub fn json(&self, row: &RowSummary) -> Value {
        let value = (self.value)(row);
        match self.key == COST.key {
            true => json!(value),
            false => json!(value.map(rounded)),
        }
    }
}

/// How many runs were successful.
pub fn count(row: &RowSummary) -> String {
    match row.runs {
        0 => "-".to_owned(),
        runs => format!("{} of {runs}", row.held),
    }
}

/// A growth rate (1/s), or whether deviations shrink for sure.
pub fn growth(row: &RowSummary) -> String {
    match (row.theory.growth, row.theory.sure) {
        (Some(growth), _) => format!("{growth:+.2}"),
        (None, Some(true)) => "sure".to_owned(),
        (None, Some(false)) => "?".to_owned(),
        (None, None) => "-".to_owned(),
    }
}
