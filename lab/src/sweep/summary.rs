//! The figures of a sweep, by row.

use ratelab::millis;
use ratelab_experiment::sweep::{CellResult, Survival, Sweep, Swept};
use ratelab_system::names;
use serde_json::{Value, json};

use super::{
    columns::{self, Column, PartColumn},
    theory::{Edge, RowTheory},
};
use crate::{error::Error, summary::rounded};

/// All rows of a sweep, and its progress.
pub struct SweepSummary {
    /// The sweep.
    pub sweep: Sweep,
    /// The knob that changes fastest.
    pub main: Column,
    /// Whether the growth by linear theory is among its figures.
    pub theory: bool,
    /// A word for successful runs.
    pub good: String,
    /// The ages with their parts, if they are asked for.
    pub parts: Vec<PartColumn>,
    /// The rows, in the order of the sweep.
    rows: Vec<RowSummary>,
    /// Number of finished runs.
    pub runs: usize,
    /// Number of planned runs.
    pub cells: usize,
}

/// The runs of one combination of knobs, over all seeds.
#[derive(Clone, Debug)]
pub struct RowSummary {
    /// How many of them were not lost.
    pub survival: Survival,
    /// The value of the fastest knob, in short form.
    pub value: String,
    /// Mean over the runs of their mean latency (s).
    pub mean_latency_s: Option<f64>,
    /// Mean over the runs of their mean push age in the last second (s).
    pub push_age_s: Option<f64>,
    /// Mean over the runs that were not lost of the mean quadratic cost.
    pub cost: Option<f64>,
    /// The median run time of the loss (s); `None` without lost runs.
    pub lost_at_s: Option<f64>,
    /// What linear theory says.
    pub theory: RowTheory,
    /// Mean over the runs of each age and part in the sweep's columns (ms).
    pub parts: Vec<Option<f64>>,
}

/// The rows of a sweep in lines and columns: a line for each group, a column for each value of
/// the fastest knob.
pub struct SweepGrid<'s> {
    /// The name of that knob.
    pub heading: String,
    /// Its values.
    pub values: Vec<&'s str>,
    /// The groups, each with its name.
    pub groups: Vec<(String, &'s [RowSummary])>,
}

impl SweepGrid<'_> {
    /// Returns the width of the names and the heading (characters).
    pub fn wide(&self) -> usize {
        self.groups
            .iter()
            .map(|(name, _)| name)
            .chain([&self.heading])
            .map(|name| name.chars().count())
            .max()
            .unwrap_or(0)
    }
}

impl SweepSummary {
    /// Summarises a sweep; with the growth by linear theory, if it is `wanted`.
    ///
    /// # Errors
    /// [`Error`] if the theory fails, or the sweep has no axis.
    pub fn new(swept: &Swept, wanted: bool) -> Result<Self, Error> {
        let sweep = swept.sweep();
        let main = columns::main_knob(sweep)
            .ok_or_else(|| Error::BadInput("nothing is swept".to_owned()))?;
        let parts = columns::part_columns(swept.finished().map(|(_, outcome)| outcome));
        let mut finished = swept.finished();
        let rows = swept
            .survival()
            .map(|survival| {
                let group = finished.by_ref().take(survival.runs);
                let outcomes: Vec<&CellResult> = group.map(|(_, outcome)| outcome).collect();
                let lost = outcomes.iter().filter(|o| o.is_lost());
                let held = outcomes.iter().filter(|o| !o.is_lost());
                let said = wanted.then(|| RowTheory::predict(&sweep.config(&survival.cell)));
                Ok(RowSummary {
                    value: main.short(sweep, &survival.cell),
                    mean_latency_s: mean(outcomes.iter().filter_map(|o| o.mean_latency_s)),
                    push_age_s: mean(outcomes.iter().filter_map(|o| Some(o.push_age?.late_s))),
                    cost: mean(held.filter_map(|o| o.cost)),
                    lost_at_s: median(lost.map(|o| o.sim_time.as_secs_f64())),
                    theory: said.transpose()?.unwrap_or_default(),
                    parts: parts
                        .iter()
                        .map(|part| mean(outcomes.iter().filter_map(|o| part.value(o))))
                        .collect(),
                    survival,
                })
            })
            .collect::<Result<Vec<RowSummary>, Error>>()?;
        Ok(Self {
            runs: rows.iter().map(|row| row.survival.runs).sum(),
            cells: sweep.cells().unwrap_or(0),
            good: names::good(&*sweep.system),
            parts,
            theory: wanted,
            sweep: sweep.clone(),
            main,
            rows,
        })
    }

    /// Returns all rows.
    pub fn rows(&self) -> &[RowSummary] {
        &self.rows
    }

    /// Returns the edges that theory draws between neighbours.
    pub fn edges(&self) -> Vec<Edge> {
        let within = self
            .groups()
            .flat_map(|rows| rows.iter().zip(rows.iter().skip(1)));
        let between = self
            .groups()
            .zip(self.groups().skip(1))
            .filter(|_| self.is_plane())
            .flat_map(|(rows, next)| rows.iter().zip(next));
        within
            .chain(between)
            .filter_map(|(row, next)| row.edge(next))
            .collect()
    }

    /// Returns whether the groups differ in one thing only, so that groups that follow each other
    /// are neighbours.
    pub fn is_plane(&self) -> bool {
        self.sweep
            .axes
            .iter()
            .filter(|axis| axis.values.len() > 1)
            .filter(|axis| axis.name != self.main.name)
            .count()
            == 1
    }

    /// Returns the values that distinguish a group from the others.
    fn group_name(&self, rows: &[RowSummary]) -> String {
        let several = |column: &Column| column.count(&self.sweep) > 1;
        self.slower(rows, several, |_, value| value)
    }

    /// Returns the values of the slower knobs that are `wanted`, each as `told`, in a group.
    pub fn slower(
        &self,
        rows: &[RowSummary],
        wanted: impl Fn(&Column) -> bool,
        told: impl Fn(&Column, String) -> String,
    ) -> String {
        let Some(row) = rows.first() else {
            return String::new();
        };
        let parts = columns::knob_columns(&self.sweep)
            .into_iter()
            .filter(|column| column.name != self.main.name && wanted(column))
            .map(|column| {
                let value = column.short(&self.sweep, &row.survival.cell);
                column.tag(&told(&column, value))
            });
        parts.collect::<Vec<_>>().join(" ")
    }

    /// Returns the rows in lines and columns.
    pub fn grid(&self) -> SweepGrid<'_> {
        let groups = self.groups().map(|rows| (self.group_name(rows), rows));
        let values = self.groups().next().unwrap_or_default().iter();
        SweepGrid {
            heading: self.main.heading(),
            values: values.map(|row| row.value.as_str()).collect(),
            groups: groups.collect(),
        }
    }

    /// Groups of rows that differ only in the fastest knob.
    pub fn groups(&self) -> impl ExactSizeIterator<Item = &[RowSummary]> {
        self.rows.chunks(self.main.count(&self.sweep).max(1))
    }
}

impl RowSummary {
    /// Returns how many of its runs were successful, such as `3 of 10`.
    pub fn survival_text(&self) -> String {
        match self.survival.runs {
            0 => "-".to_owned(),
            runs => format!("{} of {runs}", self.survival.held),
        }
    }

    /// Returns the edge that theory draws between this row and the next.
    pub fn edge(&self, next: &Self) -> Option<Edge> {
        Edge::between(self.theory, next.theory)
    }

    /// Returns the value of the fastest knob, if it is a number.
    pub fn number(&self) -> f64 {
        self.value.parse().unwrap_or(f64::NAN)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns the median; the lower of the two middle values of an even number.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    values.get(middle).copied()
}

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
pub fn figures(summary: &SweepSummary) -> Vec<Figure> {
    let mut figures = vec![LATENCY, AGE, LOST];
    let cost = summary.sweep.system.judge().quadratic_cost();
    figures.extend(cost.map(|_| COST));
    figures.extend(theory_figures(summary));
    figures
}

/// Returns the figures of linear theory, if it is asked for: the growth, and what it has for
/// chunks.
pub fn theory_figures(summary: &SweepSummary) -> impl Iterator<Item = Figure> {
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
