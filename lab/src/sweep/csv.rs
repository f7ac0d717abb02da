//! One row per run.

use std::io::{self, BufWriter, Write};

use ratelab_study::{
    experiment::{
        Experiment,
        sweep::{Sweep, Swept},
    },
    system::names::key,
};

use super::{columns, parts};
use crate::{csv::row_of, error::Error, results::read_topics};

/// The names of the topics with readers, in the order of a summary.
///
/// # Errors
/// [`Error::Build`] if the graph cannot be built.
pub fn topics(sweep: &Sweep) -> Result<Vec<String>, Error> {
    let config = sweep.cell(0).map(|cell| sweep.config(&cell));
    let config = config.as_ref().unwrap_or(&sweep.base);
    Ok(read_topics(&Experiment::new(sweep.system.clone(), config)?))
}

/// How old what was done to the world was: on average over the run, and over its last
/// second.
const AGES: [&str; 2] = ["mean_push_age_s", "late_push_age_s"];

/// Names and units of the columns.
pub fn header(sweep: &Sweep, topics: &[String]) -> String {
    let knobs = columns::of(sweep)
        .into_iter()
        .map(|column| key(&column.name));
    let figures = [
        "seed",
        "cause_of_end",
        "steps",
        "sim_time_s",
        "mean_latency_s",
    ];
    let dropped = topics.iter().map(|topic| format!("{}_dropped", key(topic)));
    let finals = sweep.system.finals(&[]).into_iter();
    let finals = finals.map(|figure| key(&format!("{} {}", figure.name, figure.unit)));
    let cost = sweep.system.quadratic_cost().map(|_| "quadratic_cost");
    let late = AGES.into_iter().chain(cost).map(str::to_owned);
    let columns = knobs
        .chain(figures.map(str::to_owned))
        .chain(dropped)
        .chain(finals)
        .chain(late);
    columns.collect::<Vec<_>>().join(",")
}

/// Writes the finished runs below `header`, in the order of the sweep.
pub fn write(file: impl Write, header: &str, swept: &Swept) -> io::Result<()> {
    let (mut out, sweep) = (BufWriter::new(file), swept.sweep());
    let parts = parts::of(swept.finished().map(|(_, outcome)| outcome));
    let names = parts.iter().map(|part| format!(",{}", key(&part.name())));
    writeln!(out, "{header}{}", names.collect::<String>())?;
    let (knobs, cost) = (columns::of(sweep), sweep.system.quadratic_cost().is_some());
    for (cell, outcome) in swept.finished() {
        let mut row: Vec<String> = knobs.iter().map(|knob| knob.value(sweep, &cell)).collect();
        let latency = outcome.mean_latency_s.map(|latency| latency.to_string());
        row.extend([
            cell.seed.to_string(),
            outcome.verdict.name().to_owned(),
            outcome.steps.to_string(),
            outcome.sim_time.as_secs_f64().to_string(),
            latency.unwrap_or_default(),
        ]);
        row.extend(outcome.dropped.iter().map(ToString::to_string));
        let finals = sweep
            .system
            .finals_at(outcome.sim_time, &outcome.state)
            .into_iter();
        row.extend(finals.map(|figure| figure.value.to_string()));
        let age = outcome.push_age;
        let late = [age.map(|age| age.run_s), age.map(|age| age.late_s)];
        let late = late.into_iter().chain(cost.then_some(outcome.cost));
        row.extend(late.map(|figure| figure.map_or_else(String::new, |figure| figure.to_string())));
        let parts = parts.iter().map(|part| part.of(outcome));
        row.extend(parts.map(|ms| ms.map_or_else(String::new, |ms| ms.to_string())));
        writeln!(out, "{}", row_of(row))?;
    }
    out.flush()
}
