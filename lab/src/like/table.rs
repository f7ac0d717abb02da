//! A comparison of the recorded run with its model.

use std::{iter, time::Duration};

use ratelab_experiment::{Summary, Table};
use ratelab_metrics::Distribution;
use ratelab_system::System;
use serde_json::{Map, Value, json};

use super::Like;
use crate::summary::{
    json::{self, object},
    rounded,
    text::{line, ms, ms_or_dash, overruns},
};

/// The compared quantiles.
const QUANTILES: [(&str, f64); 4] = [("p10", 0.1), ("p50", 0.5), ("p90", 0.9), ("p99", 0.99)];

/// Returns the table, with one line per figure.
pub fn text(system: &dyn System, like: &Like, model: &Summary) -> String {
    let table = Table {
        headers: ["", "recorded", "virtual"].map(str::to_owned).to_vec(),
        rows: rows(system, [&like.recorded, model]),
        named: true,
    };
    let titles = ["like"].into_iter().chain(iter::repeat(""));
    let lines = titles
        .zip(table.lines())
        .map(|(title, text)| line(title, &text));
    lines.collect::<Vec<_>>().join("\n")
}

fn rows(system: &dyn System, runs: [&Summary; 2]) -> Vec<Vec<String>> {
    let row = |name: String, cell: &dyn Fn(&Summary) -> String| {
        let [recorded, model] = runs.map(cell);
        vec![name, recorded, model]
    };
    let mut rows = vec![row("verdict".to_owned(), &|run| {
        format!("{} {}", run.verdict.name(), run.sim_time)
    })];
    let [recorded, model] = runs.map(|run| {
        let main = system.latency().map(|(_, meter)| (meter, &run.latency));
        main.into_iter().chain(run.chain_latencies(system))
    });
    for ((meter, recorded), (_, model)) in recorded.zip(model) {
        let of = |name: &str, cell: &dyn Fn(&Distribution) -> Option<Duration>| {
            let [recorded, model] = [recorded, model].map(|latency| ms_or_dash(cell(latency)));
            vec![format!("{meter} {name}"), recorded, model]
        };
        for (name, quantile) in QUANTILES {
            rows.push(of(name, &|latency| latency.quantile(quantile)));
        }
        rows.push(of("max", &Distribution::max));
    }
    if runs.iter().any(|run| run.push_age().is_some()) {
        rows.push(row("push age mean".to_owned(), &|run| {
            run.push_age().map_or("-".to_owned(), |age| ms(age.run_s))
        }));
    }
    let nodes = runs[1].nodes.iter().map(|node| &node.name);
    rows.extend(nodes.map(|name| {
        row(format!("overruns {name}"), &|run| {
            run.node(name).map_or("-".to_owned(), overruns)
        })
    }));
    rows
}

/// Returns the comparison as JSON.
pub fn json(like: &Like, model: &Summary) -> Value {
    json!({
        "file": like.file.display().to_string(),
        "recorded": figures(&like.recorded),
        "virtual": figures(model),
    })
}

fn figures(run: &Summary) -> Map<String, Value> {
    let overruns = run
        .nodes
        .iter()
        .map(|node| (node.name.to_string(), json!(node.overruns)));
    let mut figures = object(json!({
        "cause_of_end": run.verdict.name(),
        "latency": latency(&run.latency),
        "mean_push_age_ms": run.push_age().map(|age| json::ms(age.run_s)),
        "overruns": overruns.collect::<Map<_, _>>(),
        "sim_time_s": rounded(run.sim_time.as_secs_f64()),
    }));
    if !run.latencies.is_empty() {
        let latencies = run
            .latencies
            .iter()
            .map(|(chain, of)| ((*chain).to_owned(), json!(latency(of))));
        figures.insert("latencies".to_owned(), latencies.collect());
    }
    figures
}

fn latency(latency: &Distribution) -> Map<String, Value> {
    let mut figures = object(json!({
        "count": latency.count(),
        "max_ms": json::duration_ms(latency.max()),
    }));
    figures.extend(QUANTILES.map(|(name, quantile)| {
        let ms = json::duration_ms(latency.quantile(quantile));
        (format!("{name}_ms"), json!(ms))
    }));
    figures
}
