//! The summary of a run, for programs.

use std::time::Duration;

use ratelab::{KnobKind, Time};
use ratelab_experiment::{Summary, sweep::CellResult};
use ratelab_metrics::{Distribution, NodeAccount, TopicAccount};
use ratelab_system::{
    FigureValue, KnobText, System, SystemFigure, WorldKind,
    names::{self, good, key},
};
use serde_json::{Map, Value, json};

use super::{
    Digits, ages, bag,
    text::{ReportContext, saw_the_wall},
};
use crate::summary::{has_set_times, was_late};

/// Returns the metrics by their keys.
///
/// Under the virtual clock they are independent of wall time, so the same run gives the
/// same bytes.
pub fn metrics(
    system: &dyn System,
    summary: &Summary,
    context: &ReportContext,
) -> Map<String, Value> {
    with_digits(Digits::Four, system, summary, context)
}

/// Returns the same metrics as they were measured, to be compared with limits: null where nothing
/// was measured.
pub fn measured(system: &dyn System, summary: &Summary) -> Map<String, Value> {
    let context = ReportContext::default();
    let mut metrics = with_digits(Digits::All, system, summary, &context);
    let latency = json!(summary.latency.mean_s().map(|mean| Digits::All.ms(mean)));
    metrics.insert("mean_latency_ms".to_owned(), latency);
    metrics
}

fn with_digits(
    digits: Digits,
    system: &dyn System,
    summary: &Summary,
    context: &ReportContext,
) -> Map<String, Value> {
    let mut metrics = keys(digits, system, summary, context);
    metrics.extend(system_keys(digits, system, summary));
    let bag = bag::json(digits, system, summary, context.readings.as_ref());
    metrics.extend(bag.map(|bag| ("bag".to_owned(), bag)));
    let phases = context.phases.iter();
    metrics.extend(phases.map(|phases| ("phases".to_owned(), phases.json())));
    if saw_the_wall(summary) {
        metrics.extend(wall_keys(digits, summary, context));
    }
    metrics
}

/// Metrics as JSON, all keys in order.
pub fn text(metrics: Map<String, Value>) -> String {
    format!("{:#}", Value::Object(metrics))
}

/// Returns the keys of every run.
fn keys(
    digits: Digits,
    system: &dyn System,
    summary: &Summary,
    context: &ReportContext,
) -> Map<String, Value> {
    let (config, knobs) = (&summary.config, KnobText(system.knobs().aliases()));
    let nodes = summary.nodes.iter().map(|of| node(digits, summary, of));
    let topics = summary.topics.iter().map(topic);
    let mut keys = object(json!({
        "break_bug": context.break_bug,
        "clock": config.clock.to_string(),
        "csv_rows_lost": context.csv_lost,
        "duration_s": digits.round(config.end.as_secs_f64()),
        "events": summary.events.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "knobs": knobs.lines(&config.knobs),
        "latency": milliseconds(digits, &summary.latency),
        "nodes": nodes.collect::<Map<_, _>>(),
        "seed": config.seed,
        "setup": config.setup.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "smoke": context.smoke,
        "system": system.name(),
        "topics": topics.collect::<Map<_, _>>(),
        "turned": knobs.lines(&summary.knobs()),
        "version": env!("CARGO_PKG_VERSION"),
        "world": config.world.name(),
    }));
    if let WorldKind::Own { step_ms } = config.world {
        keys.insert("world_step_ms".to_owned(), json!(step_ms.get()));
    }
    if let Some((_, cost)) = summary.cost.zip(system.judge().quadratic_cost()) {
        keys.insert("quadratic_cost_is_the_mean_of".to_owned(), json!(cost.sum));
    }
    if !summary.latencies.is_empty() {
        let latencies = summary
            .latencies
            .iter()
            .map(|(chain, of)| ((*chain).to_owned(), milliseconds(digits, of)));
        keys.insert("latencies".to_owned(), latencies.collect());
    }
    keys.extend(result(digits, &CellResult::new(system, summary)));
    keys
}

/// Returns the keys of a run that it has in a sweep as well.
pub fn result(digits: Digits, result: &CellResult) -> Map<String, Value> {
    let mut keys = object(json!({
        "cause_of_end": result.verdict.name(),
        "mean_latency_ms": digits.ms(result.mean_latency_s.unwrap_or(0.0)),
        "sim_time_s": digits.round(result.sim_time.as_secs_f64()),
        "steps": result.steps,
    }));
    if let Some(age) = result.push_age {
        let [run, late] = [age.run_s, age.late_s].map(|seconds| json!(digits.ms(seconds)));
        keys.insert("mean_push_age_ms".to_owned(), run);
        keys.insert("late_push_age_ms".to_owned(), late);
    }
    if !result.ages.is_empty() {
        keys.insert("age_parts".to_owned(), ages::json(&result.ages));
    }
    if let Some(mean) = result.cost {
        keys.insert("quadratic_cost".to_owned(), json!(mean));
    }
    add_figures(&mut keys, &result.figures);
    keys
}

/// Returns the figures of a system at the end of a run. Figures without a unit are shares: they are
/// not rounded, so that none looks like the limit that it misses.
pub fn finals(
    digits: Digits,
    system: &dyn System,
    at: Time,
    state: &[f64],
) -> impl Iterator<Item = (String, Value)> {
    system
        .judge()
        .finals_at(at, state)
        .into_iter()
        .flat_map(move |figure| {
            let with_unit = key(&format!("{} {}", figure.name, figure.unit));
            let value = if figure.unit.is_empty() {
                figure.value
            } else {
                digits.round(figure.value)
            };
            // The name alone goes with a later version.
            let names = [with_unit, figure.name.into_owned()];
            names.map(|name| (name, json!(value)))
        })
}

/// Adds the system's own `figures`, each block as an object.
fn add_figures(keys: &mut Map<String, Value>, figures: &[SystemFigure]) {
    for figure in figures {
        let value = match figure.value {
            FigureValue::Count(count) => json!(count),
            FigureValue::Number(number) => json!(number),
        };
        match figure.block {
            Some(block) => keys.entry(block).or_insert_with(|| json!({}))[figure.name] = value,
            None => drop(keys.insert(figure.name.to_owned(), value)),
        }
    }
}

/// Returns the keys that depend on the system: success, knobs, topics, and figures of the end of
/// the run.
fn system_keys(digits: Digits, system: &dyn System, summary: &Summary) -> Map<String, Value> {
    let good = (key(&good(system)), json!(!summary.verdict.is_lost()));
    let setup = &summary.config.setup;
    let aliases = names::shown(system, |alias| names::is_set(alias, setup))
        .into_iter()
        .map(|alias| {
            let text = alias.value(setup);
            let value = match value(alias.kind(), &text) {
                Value::Number(number) if number.is_f64() => {
                    json!(number.as_f64().map(|number| digits.round(number)))
                }
                value => value,
            };
            (key(alias.name), value)
        });
    let topics = summary
        .topics
        .iter()
        .filter(|topic| topic.is_read())
        .flat_map(|topic| {
            let counts = [("published", topic.published), ("dropped", topic.dropped())];
            counts.map(|(what, count)| (format!("{}_{what}", key(&topic.name)), json!(count)))
        });
    let finals = finals(digits, system, summary.sim_time, &summary.state);
    [good]
        .into_iter()
        .chain(aliases)
        .chain(topics)
        .chain(finals)
        .collect()
}

fn wall_keys(digits: Digits, summary: &Summary, context: &ReportContext) -> Map<String, Value> {
    let of_nodes = |figure: fn(&NodeAccount) -> &Distribution| {
        let figures = summary
            .nodes
            .iter()
            .map(|node| (node.name.to_string(), milliseconds(digits, figure(node))));
        figures.collect::<Map<_, _>>()
    };
    object(json!({
        "lateness": of_nodes(|node| &node.lateness),
        "realtime": context.realtime.as_ref().map(|asked| match asked {
            Ok(()) => "granted".to_owned(),
            Err(refusal) => refusal.to_string(),
        }),
        "tick_time": of_nodes(|node| &node.tick_time),
        "wall_time_s": digits.round(summary.wall_time.as_secs_f64()),
    }))
}

/// Returns the figures of a node, including the duration of its ticks where one is set, and its
/// lateness where it was late.
fn node(digits: Digits, summary: &Summary, node: &NodeAccount) -> (String, Value) {
    let mut figures = object(json!({
        "hz": digits.round(node.hz.get()),
        "overruns": node.overruns,
        "ticks": node.ticks,
    }));
    if has_set_times(summary, &node.name) {
        figures.extend(object(json!({
            "cost": milliseconds(digits, &node.tick_time),
            "lateness": milliseconds(digits, &node.lateness),
            "response": milliseconds(digits, &node.response),
        })));
    }
    if was_late(node) {
        figures.insert("lateness".to_owned(), milliseconds(digits, &node.lateness));
    }
    (node.name.to_string(), Value::Object(figures))
}

/// Returns what became of the messages of a topic.
fn topic(topic: &TopicAccount) -> (String, Value) {
    let figures = json!({
        "dropped": topic.dropped(),
        "in_flight": topic.in_flight(),
        "lost": topic.lost,
        "overtaken": topic.overtaken,
        "published": topic.published,
        "unmatched": topic.unmatched(),
    });
    (topic.name.to_string(), figures)
}

/// Returns a distribution in milliseconds; quantiles are accurate to 0.1 %.
fn milliseconds(digits: Digits, distribution: &Distribution) -> Value {
    let ms = |duration: Option<Duration>| duration.map(|of| digits.ms(of.as_secs_f64()));
    json!({
        "count": distribution.count(),
        "max_ms": ms(distribution.max()),
        "mean_ms": distribution.mean_s().map(|mean| digits.ms(mean)),
        "p50_ms": ms(distribution.quantile(0.5)),
        "p99_ms": ms(distribution.quantile(0.99)),
    })
}

/// This number of seconds in milliseconds.
pub fn ms(seconds: f64) -> f64 {
    Digits::Four.ms(seconds)
}

/// Converts a duration to milliseconds.
pub fn duration_ms(duration: Option<Duration>) -> Option<f64> {
    duration.map(|duration| ms(duration.as_secs_f64()))
}

/// Returns the members of the object `value`.
pub fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// Returns the value of a knob for programs.
pub fn value(kind: KnobKind, text: &str) -> Value {
    match kind {
        KnobKind::Depth => json!(text.parse::<usize>().ok()),
        KnobKind::Send => json!(text),
        _ => match text.parse::<f64>() {
            Ok(number) if number.is_finite() => json!(number),
            _ => json!(text),
        },
    }
}
