//! What a run came to, for people.

use std::time::Duration;

use ratelab::{
    cartpole::{ACTUATOR, POLICY, SENSOR},
    experiment::{NodeSummary, Summary, TimedKnob, TopicSummary},
    runtime::{
        ClockKind, Command, Hz, Knob,
        telemetry::{Distribution, EventKind},
    },
};

use crate::recording::Recorded;

/// What is to be said of a run beside its summary.
#[derive(Default)]
pub struct ReportContext {
    /// `--break` was given.
    pub break_bug: bool,
    /// `--smoke` was given.
    pub smoke: bool,
    /// What became of `--realtime`; `None` if it was not given.
    pub realtime: Option<Result<(), String>>,
    /// Rows that the CSV writer lost.
    pub csv_lost: u64,
    /// Why it is not known how the run ended, if it is not.
    pub open: Option<String>,
}

/// The summary in a few lines.
pub fn text(summary: &Summary, context: &ReportContext) -> String {
    let mut lines = vec![
        ("clock", clock(summary, context)),
        ("rates", rates(summary)),
        ("verdict", verdict(summary, context)),
        ("topics", topics(summary)),
        ("latency", latency(summary)),
    ];
    if saw_the_wall(summary) {
        lines.push(("lateness", each_node(summary, lateness)));
        lines.push(("overruns", each_node(summary, overruns)));
    }
    lines.extend(changes(summary));
    let late = summary.config.knobs.iter();
    let late = late.filter(|knob| knob.at > summary.sim_time);
    lines.extend(late.map(|knob| ("not done", format!("{knob}: the run had ended"))));
    if context.csv_lost > 0 {
        let lost = format!("{} CSV rows: the disk was too slow", context.csv_lost);
        lines.push(("lost", lost));
    }
    let lines: Vec<String> = lines.iter().map(|(name, text)| line(name, text)).collect();
    lines.join("\n")
}

/// A line that says `text` of `name`.
pub fn line(name: &str, text: &str) -> String {
    format!("{name:<9} {text}")
}

/// The commands that were given; the verdict tells how it ended. Knobs are told
/// as `--knobs` reads them, to the nanosecond.
fn changes(summary: &Summary) -> impl Iterator<Item = (&'static str, String)> {
    let events = summary.events.iter();
    events.filter_map(|event| match (&event.what, TimedKnob::of(event)) {
        (_, Some(knob)) => Some(("knob", knob.to_string())),
        // The other half of the knob for queue depth.
        (
            EventKind::Applied {
                command: Command::Set(Knob::Depth { .. }),
                ..
            },
            _,
        ) => None,
        (EventKind::Applied { .. }, _) => Some(("command", event.to_string())),
        (EventKind::Refused { .. }, _) => Some(("refused", event.to_string())),
        (EventKind::Ended { .. } | EventKind::Faulted { .. }, _) => None,
    })
}

/// Whether the run was under the real clock at any time.
pub fn saw_the_wall(summary: &Summary) -> bool {
    let late = |node: &NodeSummary| node.lateness.count() > 0;
    summary.config.clock == ClockKind::Real || summary.nodes.iter().any(late)
}

fn clock(summary: &Summary, context: &ReportContext) -> String {
    let config = &summary.config;
    let realtime = match context.realtime {
        Some(Ok(())) => " with real-time priority",
        Some(Err(_)) => " (real-time priority refused)",
        None => "",
    };
    format!(
        "{}{realtime} | policy {} | seed {}",
        config.clock,
        config.policy.name(),
        config.seed
    )
}

/// The rates, from the first to the last where a knob was turned.
fn rates(summary: &Summary) -> String {
    let config = &summary.config;
    let last = |name: &str, first: Hz| summary.node(name).map_or(first, |node| node.hz);
    let rate = |name: &str, first: Hz| match last(name, first) {
        last if last == first => first.to_string(),
        last => format!("{first} → {last}"),
    };
    format!(
        "sensor {} | control {} | actuator {} | queue depth {}",
        rate(SENSOR, config.sensor_hz),
        rate(POLICY, config.control_hz),
        last(ACTUATOR, config.sensor_hz),
        config.queue_depth
    )
}

fn verdict(summary: &Summary, context: &ReportContext) -> String {
    if let Some(why) = &context.open {
        let steps = summary.steps;
        return format!("pole up after {steps} control steps: {why}");
    }
    format!(
        "{}: {} control steps in {:.2} s sim ({:.2} s wall)",
        summary.verdict,
        summary.steps,
        summary.sim_time.as_secs_f64(),
        summary.wall_time.as_secs_f64()
    )
}

fn topics(summary: &Summary) -> String {
    let topic = |topic: &TopicSummary| {
        format!(
            "{} {:.1} msg/s ({} dropped)",
            topic.name, topic.per_second, topic.dropped
        )
    };
    format!("{} | {}", topic(&summary.obs), topic(&summary.action))
}

fn latency(summary: &Summary) -> String {
    let latency = &summary.latency;
    let Some(mean) = latency.mean_s() else {
        return "no action was applied".to_owned();
    };
    let period = summary
        .node(POLICY)
        .map_or(summary.config.control_hz, |node| node.hz)
        .period();
    format!(
        "sense→act mean {:.1} ms, p50 {}, p99 {}, max {} (control period {})",
        mean * 1e3,
        ms(latency.quantile(0.5)),
        ms(latency.quantile(0.99)),
        ms(latency.max()),
        ms(Some(period))
    )
}

fn each_node(summary: &Summary, tell: fn(&NodeSummary) -> String) -> String {
    let told: Vec<String> = summary.nodes.iter().map(tell).collect();
    told.join(" | ")
}

fn lateness(node: &NodeSummary) -> String {
    let at = |quantile| us(&node.lateness, quantile);
    format!("{} p50 {} p99 {} µs", node.name, at(0.5), at(0.99))
}

fn overruns(node: &NodeSummary) -> String {
    format!(
        "{} {} of {}",
        node.name,
        node.overruns,
        node.ticks + node.overruns
    )
}

fn ms(duration: Option<Duration>) -> String {
    duration.map_or("-".to_owned(), |d| {
        format!("{:.1} ms", d.as_secs_f64() * 1e3)
    })
}

fn us(distribution: &Distribution, quantile: f64) -> String {
    let duration = distribution.quantile(quantile);
    duration.map_or("-".to_owned(), |d| format!("{:.0}", d.as_secs_f64() * 1e6))
}

/// Where a recording went.
pub fn recorded(recorded: &Recorded) -> String {
    let lost = match recorded.lost {
        0 => String::new(),
        lost => format!(", {lost} more came too fast to be recorded"),
    };
    let text = format!(
        "{} ({}, {} messages{lost})",
        recorded.path.display(),
        size(recorded.bytes),
        recorded.messages
    );
    line("recorded", &text)
}

/// A number of bytes in words.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}
