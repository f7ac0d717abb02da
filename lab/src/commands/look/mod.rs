//! `ratelab look`: what the times in a bag say.

mod svg;
mod table;

use ratelab_bag::{
    Ages, Analysis, Bag, BagChain, BagNode, Kind, TimeQuantiles, TopicClock, quantile,
};
use serde_json::{Map, Value, json};

use crate::{
    cli::LookArgs,
    error::Error,
    output::{OutputKind, print_data, print_line},
    reading,
};
use ratelab_recording::printable::shown;

/// Prints what a bag says of its topics, clocks, nodes and chains.
pub fn look(args: &LookArgs) -> Result<(), Error> {
    let bag = reading::read_bag(&args.file)?;
    let analysis = Analysis::new(&bag);
    if let Some(path) = &args.svg {
        let drawing = svg::drawing(&bag, &analysis);
        let read = std::slice::from_ref(&args.file);
        OutputKind::Drawing.write("--svg", path, read, drawing.as_bytes())?;
    }
    if args.json {
        print_data(&format!("{:#}", value(&bag, &analysis)))?;
    } else {
        print_line(&table::text(&shown(&args.file), &bag, &analysis))?;
    }
    reading::if_damaged(&bag)
}

/// Returns the keys of a bag. Those of what is seldom there are left out without it.
fn value(bag: &Bag, analysis: &Analysis) -> Value {
    let name = |topic: usize| bag.topics[topic].name.clone();
    let names = |topics: &[usize]| topics.iter().map(|topic| name(*topic)).collect::<Vec<_>>();
    let topics = (0..bag.topics.len()).map(|place| (name(place), topic(bag, analysis, place)));
    let chains = analysis
        .chains
        .iter()
        .map(|chain| (name(chain.topic), chain_value(bag, analysis, chain)));
    let shared = analysis.shared.iter().map(|group| names(group));
    let mut all = json!({
        "bag": whole(bag, analysis),
        "chains": chains.collect::<Map<_, _>>(),
        "shared": shared.collect::<Vec<_>>(),
        "topics": topics.collect::<Map<_, _>>(),
    });
    if !analysis.guesses.is_empty() {
        let guesses = analysis.guesses.iter().map(|guess| {
            json!({
                "from": name(guess.parent),
                "r": rounded(guess.correlation, 2),
                "to": name(guess.child),
            })
        });
        all["guesses"] = guesses.collect();
    }
    all
}

/// Returns the keys of the whole bag.
fn whole(bag: &Bag, analysis: &Analysis) -> Value {
    let name = |topic: &usize| bag.topics[*topic].name.clone();
    let groups = analysis.clocks.groups.iter().map(|group| {
        json!({
            "drift_ppm": rounded(group.drift_ppm, 3),
            "offset_ms": ms(group.offset),
            "topics": group.topics.iter().map(name).collect::<Vec<_>>(),
        })
    });
    let stalls = analysis.pauses.iter().map(|pause| {
        let (at_s, length_ms) = (pause.at as f64 / 1e9, pause.length as f64 / 1e6);
        json!([rounded(at_s, 3), rounded(length_ms, 1)])
    });
    let filled = analysis
        .filled
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(topic, count)| (name(&topic), json!(count)));
    let mut whole = json!({
        "clock_groups": groups.collect::<Vec<_>>(),
        "filled": filled.collect::<Map<_, _>>(),
        "log_steps_back": bag.steps_back,
        "messages": bag.messages(),
        "recorder_stalls": stalls.collect::<Vec<_>>(),
        "span_s": rounded(bag.span() as f64 / 1e9, 3),
        "transport_least_ms": ms(analysis.clocks.least_transport),
    });
    if !bag.damage.is_empty() {
        let damage = bag.damage.iter().map(ToString::to_string);
        whole["damage"] = damage.collect();
    }
    whole
}

/// Returns the keys of a topic.
fn topic(bag: &Bag, analysis: &Analysis, place: usize) -> Value {
    let (topic, figures) = (&bag.topics[place], &analysis.figures[place]);
    let interval = figures.interval.unwrap_or_default();
    let mut keys = json!({
        "clock": clock(analysis.clocks.of_topics[place]),
        "gaps": figures.gaps.len(),
        "interval_ms": quantiles(interval, false),
        "jitter_ms": ms(figures.jitter),
        "n": topic.messages.len(),
        "publish_time": topic.publish_time().to_string(),
        "rate_hz": figures.rate_hz.map(|rate| rounded(rate, 3)),
        "stamps_repeated": figures.stamps_repeated,
    });
    if let Some(age) = figures.age {
        keys["age_ms"] = quantiles(age, true);
    }
    let lost = topic.lost.unwrap_or(0);
    for (key, count) in [
        ("order_breaks", topic.order_breaks as u64),
        ("stamps_zero", topic.stamps_zero as u64),
        ("lost_by_recorder", lost),
    ] {
        if count > 0 {
            keys[key] = json!(count);
        }
    }
    keys
}

/// Returns the name of a clock.
pub fn clock(clock: TopicClock) -> String {
    match clock {
        TopicClock::Log => "log".to_owned(),
        TopicClock::Recorder => "recorder".to_owned(),
        TopicClock::Group(number) => format!("clock {}", number + 1),
    }
}

/// Returns the keys of a chain and of the node at its end.
fn chain_value(bag: &Bag, analysis: &Analysis, chain: &BagChain) -> Value {
    let mut keys = analysis
        .node(chain.topic)
        .map_or(json!({}), |of| node(bag, of));
    if let Some(Ages {
        mean,
        p99,
        mean_published,
        p99_published,
        min_published,
    }) = chain.ages
    {
        keys["over_time"] = json!({"mean_ms": rounded(mean / 1e6, 3), "p99_ms": ms(p99)});
        keys["at_publication"] = json!({
            "mean_ms": rounded(mean_published / 1e6, 3),
            "min_ms": ms(min_published),
            "p99_ms": ms(p99_published),
        });
    }
    if chain.is_from_quickest {
        keys["from_quickest"] = json!(true);
    }
    if chain.rate_ppm != 0.0 {
        keys["stamps_drift_ppm"] = rounded(chain.rate_ppm, 0);
    }
    keys
}

/// Returns the keys of a node.
fn node(bag: &Bag, node: &BagNode) -> Value {
    let mut keys = json!({"kind": node.kind.name()});
    let Some(input) = &node.input else {
        return keys;
    };
    let name = |topic: usize| json!(bag.topics[topic].name);
    keys["parent"] = name(input.parent);
    keys["confidence"] = rounded(node.confidence, 2);
    keys["inputs_left_out"] = json!(input.triggered.left_out);
    if let Some(other) = input.other {
        keys["other"] = name(other);
    }
    match (node.kind, input.timed) {
        (Kind::Timer, Some(timed)) => {
            keys["timer"] = json!({
                "R": node.period.map(|period| rounded(period.sharpness, 4)),
                "holds": rounded(timed.holds, 4),
                "period_ms": rounded(timed.period / 1e6, 6),
                "read_phase_known_to_ms": rounded(timed.known_to / 1e6, 3),
                "spread_ms": ms(timed.spread),
            });
        }
        _ => {
            let mut costs = node.costs();
            let [p50, p99] = [500, 990].map(|permille| ms(quantile(&mut costs, permille)));
            keys["cost_ms"] = json!({"p50": p50, "p99": p99});
        }
    }
    keys
}

fn quantiles(of: TimeQuantiles, with_min: bool) -> Value {
    let mut keys = json!({"max": ms(of.max), "p50": ms(of.p50), "p99": ms(of.p99)});
    if with_min {
        keys["min"] = ms(of.min);
    }
    keys
}

/// `value` with so many digits behind the point, half away from zero.
fn rounded(value: f64, digits: i32) -> Value {
    let shift = 10_f64.powi(digits);
    json!((value * shift).round() / shift)
}

/// `ns` in milliseconds, to a microsecond.
fn ms(ns: i64) -> Value {
    json!(in_ms(ns))
}

/// `ns` in milliseconds, to a microsecond, half away from zero.
pub fn in_ms(ns: i64) -> f64 {
    let micros = ns.unsigned_abs().saturating_add(500) / 1_000;
    let ms = micros as f64 / 1e3;
    if ns < 0 { -ms } else { ms }
}
