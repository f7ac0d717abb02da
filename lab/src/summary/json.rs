//! The summary of a run, for programs.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{KnobKind, Time};
use ratelab_experiment::{Summary, sweep::CellResult};
use ratelab_metrics::{Distribution, NodeAccount, TopicAccount};
use ratelab_system::{
    FigureValue, KnobText, System, SystemFigure, WorldKind,
    names::{self, good, key},
};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{
    Digits,
    ages::{self, AgeFigures, PhaseFigures, PhaseSpread},
    bag::{self, BagFigures},
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
    metrics.extend(object(&BesideFigures {
        bag: bag::figures(digits, system, summary, context.readings.as_ref()),
        phases: context.phases.as_ref().map(PhaseSpread::figures),
    }));
    if saw_the_wall(summary) {
        metrics.extend(object(&WallFigures::new(digits, summary, context)));
    }
    metrics
}

/// Metrics as JSON, all keys in order.
pub fn text(metrics: Map<String, Value>) -> String {
    format!("{:#}", Value::Object(metrics))
}

/// What other runs say of the run.
#[derive(Serialize)]
struct BesideFigures<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    bag: Option<BTreeMap<String, BagFigures>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phases: Option<PhaseFigures<'a>>,
}

/// The figures of every run.
#[derive(Serialize)]
struct RunFigures<'a> {
    break_bug: bool,
    clock: String,
    csv_rows_lost: u64,
    duration_s: f64,
    events: Vec<String>,
    knobs: Vec<String>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    latencies: BTreeMap<&'a str, Milliseconds>,
    latency: Milliseconds,
    nodes: BTreeMap<&'a str, NodeFigures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    quadratic_cost_is_the_mean_of: Option<&'static str>,
    #[serde(flatten)]
    result: Map<String, Value>,
    seed: u64,
    setup: Vec<String>,
    smoke: bool,
    system: &'a str,
    topics: BTreeMap<&'a str, TopicFigures>,
    turned: Vec<String>,
    version: &'static str,
    world: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    world_step_ms: Option<u64>,
}

fn keys(
    digits: Digits,
    system: &dyn System,
    summary: &Summary,
    context: &ReportContext,
) -> Map<String, Value> {
    let (config, knobs) = (&summary.config, KnobText(system.knobs().aliases()));
    let milliseconds = |of| Milliseconds::new(digits, of);
    object(&RunFigures {
        break_bug: context.break_bug,
        clock: config.clock.to_string(),
        csv_rows_lost: context.csv_lost,
        duration_s: digits.round(config.end.as_secs_f64()),
        events: summary.events.iter().map(ToString::to_string).collect(),
        knobs: knobs.lines(&config.knobs),
        latencies: (summary.latencies.iter())
            .map(|(chain, of)| (&**chain, milliseconds(of)))
            .collect(),
        latency: milliseconds(&summary.latency),
        nodes: (summary.nodes.iter())
            .map(|node| (&*node.name, NodeFigures::new(digits, summary, node)))
            .collect(),
        quadratic_cost_is_the_mean_of: (summary.cost)
            .and_then(|_| Some(system.judge().quadratic_cost()?.sum)),
        result: result(digits, &CellResult::new(system, summary)),
        seed: config.seed,
        setup: config.setup.iter().map(ToString::to_string).collect(),
        smoke: context.smoke,
        system: system.name(),
        topics: (summary.topics.iter())
            .map(|topic| (&*topic.name, TopicFigures::from(topic)))
            .collect(),
        turned: knobs.lines(&summary.knobs()),
        version: env!("CARGO_PKG_VERSION"),
        world: config.world.name(),
        world_step_ms: match config.world {
            WorldKind::Own { step_ms } => Some(step_ms.get()),
            _ => None,
        },
    })
}

/// The figures of a run that it has in a sweep as well.
#[derive(Serialize)]
struct ResultFigures<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    age_parts: Option<Vec<AgeFigures<'a>>>,
    cause_of_end: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    late_push_age_ms: Option<f64>,
    mean_latency_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_push_age_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    quadratic_cost: Option<f64>,
    sim_time_s: f64,
    steps: u64,
}

/// Returns the keys of a run that it has in a sweep as well.
pub fn result(digits: Digits, result: &CellResult) -> Map<String, Value> {
    let age = result.push_age.as_ref();
    let mut keys = object(&ResultFigures {
        age_parts: (!result.ages.is_empty()).then(|| ages::figures(&result.ages)),
        cause_of_end: result.verdict.name(),
        late_push_age_ms: age.map(|age| digits.ms(age.late_s)),
        mean_latency_ms: digits.ms(result.mean_latency_s.unwrap_or(0.0)),
        mean_push_age_ms: age.map(|age| digits.ms(age.run_s)),
        quadratic_cost: result.cost,
        sim_time_s: digits.round(result.sim_time.as_secs_f64()),
        steps: result.steps,
    });
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

/// The figures that the wall clock decides.
#[derive(Serialize)]
struct WallFigures<'a> {
    lateness: BTreeMap<&'a str, Milliseconds>,
    realtime: Option<String>,
    tick_time: BTreeMap<&'a str, Milliseconds>,
    wall_time_s: f64,
}

impl<'a> WallFigures<'a> {
    fn new(digits: Digits, summary: &'a Summary, context: &ReportContext) -> Self {
        let of_nodes = |figure: fn(&NodeAccount) -> &Distribution| {
            let nodes = summary.nodes.iter();
            nodes
                .map(|node| (&*node.name, Milliseconds::new(digits, figure(node))))
                .collect()
        };
        Self {
            lateness: of_nodes(|node| &node.lateness),
            realtime: context.realtime.as_ref().map(|asked| match asked {
                Ok(()) => "granted".to_owned(),
                Err(refusal) => refusal.to_string(),
            }),
            tick_time: of_nodes(|node| &node.tick_time),
            wall_time_s: digits.round(summary.wall_time.as_secs_f64()),
        }
    }
}

/// The figures of a node.
#[derive(Serialize)]
struct NodeFigures {
    /// The duration of its ticks, where one is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    cost: Option<Milliseconds>,
    hz: f64,
    /// Where a duration is set, or a tick was late.
    #[serde(skip_serializing_if = "Option::is_none")]
    lateness: Option<Milliseconds>,
    overruns: u64,
    /// From the message that caused a tick to the end of the tick, where a duration is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    response: Option<Milliseconds>,
    ticks: u64,
}

impl NodeFigures {
    fn new(digits: Digits, summary: &Summary, node: &NodeAccount) -> Self {
        let is_set = has_set_times(summary, &node.name);
        let times = |shown: bool, of| shown.then(|| Milliseconds::new(digits, of));
        Self {
            cost: times(is_set, &node.tick_time),
            hz: digits.round(node.hz.get()),
            lateness: times(is_set || was_late(node), &node.lateness),
            overruns: node.overruns,
            response: times(is_set, &node.response),
            ticks: node.ticks,
        }
    }
}

/// What became of the messages of a topic.
#[derive(Serialize)]
struct TopicFigures {
    dropped: u64,
    in_flight: u64,
    lost: u64,
    overtaken: u64,
    published: u64,
    unmatched: u64,
}

impl From<&TopicAccount> for TopicFigures {
    fn from(topic: &TopicAccount) -> Self {
        Self {
            dropped: topic.dropped(),
            in_flight: topic.in_flight(),
            lost: topic.lost,
            overtaken: topic.overtaken,
            published: topic.published,
            unmatched: topic.unmatched(),
        }
    }
}

/// A distribution in milliseconds; quantiles are accurate to 0.1 %.
#[derive(Serialize)]
struct Milliseconds {
    count: u64,
    max_ms: Option<f64>,
    mean_ms: Option<f64>,
    p50_ms: Option<f64>,
    p99_ms: Option<f64>,
}

impl Milliseconds {
    fn new(digits: Digits, distribution: &Distribution) -> Self {
        let ms = |duration: Option<Duration>| duration.map(|of| digits.ms(of.as_secs_f64()));
        Self {
            count: distribution.count(),
            max_ms: ms(distribution.max()),
            mean_ms: distribution.mean_s().map(|mean| digits.ms(mean)),
            p50_ms: ms(distribution.quantile(0.5)),
            p99_ms: ms(distribution.quantile(0.99)),
        }
    }
}

/// This number of seconds in milliseconds.
pub fn ms(seconds: f64) -> f64 {
    Digits::Four.ms(seconds)
}

/// Converts a duration to milliseconds.
pub fn duration_ms(duration: Option<Duration>) -> Option<f64> {
    duration.map(|duration| ms(duration.as_secs_f64()))
}

/// Returns the members of a `report`, sorted by name.
pub fn object(report: &impl Serialize) -> Map<String, Value> {
    match json!(report) {
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
