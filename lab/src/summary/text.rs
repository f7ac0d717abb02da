//! The summary of a run, for people.

use std::{iter, time::Duration};

use ratelab::{ClockKind, Command, Event, EventKind, Hz, Knob, KnobKind, millis};
use ratelab_experiment::{MeanPushAge, RunAge, Summary};
use ratelab_metrics::{Distribution, NodeAccount};
use ratelab_real_clock::RealtimeError;
use ratelab_recording::FinishedRecording;
use ratelab_system::{
    Alias, DataChain, KnobText, System, SystemFigure,
    names::{self, label, node_label, rate_alias, short_value},
    plant_topic,
};

use super::{
    ages::{self, PhaseSpread},
    bag,
    readings::OtherReadings,
};
use crate::summary::{self, was_late};
use ratelab_recording::printable::in_line;

/// Information for a report beside the summary.
#[derive(Default)]
pub struct ReportContext {
    /// Whether `--break` is set.
    pub break_bug: bool,
    /// Whether `--smoke` is set.
    pub smoke: bool,
    /// Result of `--realtime`; `None` if it is not set.
    pub realtime: Option<Result<(), RealtimeError>>,
    /// Number of rows lost by the CSV writer.
    pub csv_lost: u64,
    /// This run at other phases, if it was asked for.
    pub phases: Option<PhaseSpread>,
    /// This run by other readings of the bag, if the graph of one was changed.
    pub readings: Option<OtherReadings>,
    /// The reason why the end of the run is unknown, if it is.
    pub open: Option<String>,
    /// Whether an exercise asks for the cause that the summary would name.
    pub covered: bool,
}

/// Returns the summary as a few lines of text.
pub fn render(system: &dyn System, summary: &Summary, context: &ReportContext) -> String {
    let mut lines = known([
        ("clock", Some(clock(system, summary, context))),
        ("world", summary::world(system, summary)),
        ("rates", Some(rates(system, summary))),
        ("verdict", Some(verdict(system, summary, context))),
        ("topics", topics(summary)),
    ]);
    let silence = summary.silence();
    let chain_line = |chain: &DataChain| chain.line(summary.sim_time, &summary.chains, &silence);
    let chains = system.about().chains.iter().map(chain_line);
    lines.extend(chains.map(|text| ("chain", text)));
    lines.extend(bag::lines(system, summary, context.readings.as_ref()));
    lines.extend(known([("links", links(summary))]));
    lines.extend(latencies(system, summary));
    lines.extend(known([(
        "push age",
        summary.push_age().map(|age| push_age(system, summary, age)),
    )]));
    lines.extend(ages::lines(&summary.ages, |age| !is_told(summary, age)));
    lines.extend(context.phases.iter().flat_map(PhaseSpread::lines));
    let figures = &summary.figures;
    let first = figures.iter().position(|figure| figure.block.is_some());
    let (plain, blocked) = figures.split_at(first.unwrap_or(figures.len()));
    let block = blocked.first().and_then(|figure| figure.block);
    let shown = |figures: &[SystemFigure]| joined(figures.iter().filter_map(SystemFigure::shown));
    lines.extend(known([
        ("figures", shown(plain)),
        (block.unwrap_or_default(), shown(blocked)),
        ("quadratic", quadratic_cost(system, summary)),
    ]));
    lines.extend(times(summary));
    let knobs = KnobText(system.knobs().aliases());
    lines.extend(changes(knobs, &summary.events));
    let late: Vec<_> = summary
        .config
        .knobs
        .iter()
        .filter(|knob| knob.at > summary.sim_time)
        .cloned()
        .collect();
    let late = knobs.lines(&late).into_iter();
    lines.extend(late.map(|knob| ("not done", format!("{knob}: the run had ended"))));
    if context.csv_lost > 0 {
        let lost = format!("{} CSV rows: the disk was too slow", context.csv_lost);
        lines.push(("lost", lost));
    }
    self::lines(&lines)
}

/// Returns the duration and lateness of ticks: of all nodes if the run used wall time, otherwise of
/// nodes with configured timing, and of nodes that an executor made late without it.
fn times(summary: &Summary) -> Vec<(&'static str, String)> {
    let timed = |node: &NodeAccount| summary::has_set_times(summary, &node.name);
    let wall = saw_the_wall(summary);
    let late = |node: &NodeAccount| wall || was_late(node);
    let shown = |node: &NodeAccount| wall || timed(node) || was_late(node) || node.overruns > 0;
    let costly = |node: &NodeAccount| timed(node) && node.tick_time.count() > 0;
    let cost = |node: &NodeAccount| spread(&node.name, &node.tick_time);
    let overrun = |node: &NodeAccount| format!("{} {}", node.name, overruns(node));
    let response = |node: &NodeAccount| spread(&node.name, &node.response);
    known([
        ("lateness", each_node(summary, late, lateness)),
        ("cost", each_node(summary, costly, cost)),
        ("response", each_node(summary, costly, response)),
        ("overruns", each_node(summary, shown, overrun)),
    ])
}

/// Returns the rows with a text.
fn known<const N: usize>(rows: [(&'static str, Option<String>); N]) -> Vec<(&'static str, String)> {
    rows.into_iter()
        .filter_map(|(name, text)| Some((name, text?)))
        .collect()
}

/// Returns the mean age with what is known beside it; of a run of a second the last one is all of
/// it.
fn push_age(system: &dyn System, summary: &Summary, age: MeanPushAge) -> String {
    let [run, late] = [age.run_s, age.late_s].map(ms);
    let told = summary.ages.iter().find(|age| is_told(summary, age));
    let p99 = told
        .map(|age| format!(" (p99 {})", ms(ages::mean_and_p99_s(age)[1])))
        .unwrap_or_default();
    let late = if run == late {
        String::new()
    } else {
        format!(", in the last second {late}")
    };
    let first = system
        .latency()
        .map(|(_, meter)| format!("; {meter}: age when a push begins"));
    let source = told.map(ages::data_of).unwrap_or_default();
    format!("mean {run}{p99}{late}{source}{}", first.unwrap_or_default())
}

/// Returns whether `age` is the push age of the run, which has a line of its own.
fn is_told(summary: &Summary, age: &RunAge) -> bool {
    let mean = summary.push_age().map(|age| ms(age.run_s));
    let is_push = age.chain.is_none() && !age.is_beside;
    let is_whole = is_push && age.apart_from_ns.is_none();
    is_whole && mean.is_some_and(|mean| mean == ms(ages::mean_and_p99_s(age)[0]))
}

/// Returns what the states cost on average; a run with a fall counts until the fall.
fn quadratic_cost(system: &dyn System, summary: &Summary) -> Option<String> {
    let (mean, cost) = summary.cost.zip(system.judge().quadratic_cost())?;
    let until = if summary.verdict.is_lost() {
        " until then"
    } else {
        ""
    };
    Some(format!("cost {mean:.4}: the mean{until} of {}", cost.sum))
}

/// Returns a line with the `text` of `name`, made safe for a terminal.
pub fn line(name: &str, text: &str) -> String {
    format!("{name:<9} {}", in_line(text))
}

/// Such a line for each of `rows`.
pub fn lines(rows: &[(&str, String)]) -> String {
    let lines: Vec<String> = rows.iter().map(|(name, text)| line(name, text)).collect();
    lines.join("\n")
}

/// Returns a line with a text of the program itself, which may have several lines.
pub fn paragraph(name: &str, text: &str) -> String {
    format!("{name:<9} {text}")
}

/// Returns the commands of the run; the verdict covers its end. Knobs are printed in the format of
/// `--knobs`, to the nanosecond.
fn changes(knobs: KnobText, events: &[Event]) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    for events in events.chunk_by(|one, next| one.knob().is_some() == next.knob().is_some()) {
        let turned: Vec<_> = events.iter().filter_map(Event::knob).collect();
        lines.extend(knobs.lines(&turned).into_iter().map(|knob| ("knob", knob)));
        let others = events.iter().filter(|event| event.knob().is_none());
        lines.extend(others.filter_map(|event| match event.what {
            EventKind::Applied { .. } => Some(("command", event.to_string())),
            EventKind::Refused { .. } => Some(("refused", event.to_string())),
            EventKind::Presence { .. } => Some(("presence", event.to_string())),
            EventKind::Crashed { .. } => Some(("crashed", event.to_string())),
            EventKind::Ended { .. } | EventKind::Faulted { .. } => None,
        }));
    }
    lines
}

/// Returns whether any part of the run was under the real clock.
pub fn saw_the_wall(summary: &Summary) -> bool {
    let to_the_wall =
        |event: &Event| matches!(event.applied(), Some(Command::HandOver(ClockKind::Real)));
    summary.config.clock == ClockKind::Real || summary.events.iter().any(to_the_wall)
}

fn clock(system: &dyn System, summary: &Summary, context: &ReportContext) -> String {
    let config = &summary.config;
    let realtime = match &context.realtime {
        Some(Ok(())) => " with real-time priority",
        Some(Err(_)) => " (real-time priority refused)",
        None => "",
    };
    let shown = names::shown(system, |alias| names::is_set(alias, &config.setup));
    let messages: String = shown
        .into_iter()
        .filter(|alias| alias.kind() == KnobKind::Send)
        .map(|alias| {
            let value = short_value(system, alias, &config.setup);
            format!(" | {} {value}", label(alias.name))
        })
        .collect();
    let handed_over = summary
        .events
        .iter()
        .filter_map(|event| match event.applied() {
            Some(Command::HandOver(clock)) => Some(clock.to_string()),
            _ => None,
        });
    let mut clocks = vec![config.clock.to_string()];
    clocks.extend(handed_over);
    format!(
        "{}{realtime}{messages} | seed {}",
        in_turn(clocks),
        config.seed
    )
}

/// Returns the values of a setting in turn; of many the first and the last ones.
fn in_turn(mut values: Vec<String>) -> String {
    values.dedup();
    if values.len() > MAX_IN_TURN {
        let last = values.len() - 2;
        values.splice(2..last, ["…".to_owned()]);
    }
    values.join(" → ")
}

/// Maximum number of values in a line that are written in turn.
const MAX_IN_TURN: usize = 5;

fn aliases_of_kind(system: &dyn System, kind: KnobKind) -> impl Iterator<Item = &'static Alias> {
    system
        .knobs()
        .aliases()
        .iter()
        .filter(move |alias| alias.kind() == kind)
}

/// Returns the rates, each with the values that it had in turn, and the depths. Of a rate that went
/// up or down in steps it is where it turned.
fn rates(system: &dyn System, summary: &Summary) -> String {
    let setup = &summary.config.setup;
    let nodes = summary.nodes.iter().map(|node| {
        let name = node_label(system, &node.name);
        let alias = rate_alias(system, |of| *of == *node.name);
        let first: Option<Hz> = alias.and_then(|alias| alias.value(setup).parse().ok());
        let turned = summary
            .events
            .iter()
            .filter_map(Event::knob)
            .filter_map(|timed| match timed.knob {
                Knob::Rate { node: of, hz } if of == *node.name => Some(hz),
                _ => None,
            });
        let mut rates: Vec<Hz> = first
            .or(setup.rate(&node.name))
            .into_iter()
            .chain(turned)
            .chain([node.hz])
            .collect();
        rates.dedup();
        let turns = turns(&rates).map(|hz| hz.to_string());
        format!("{name} {}", in_turn(turns.collect()))
    });
    let depths = aliases_of_kind(system, KnobKind::Depth)
        .map(|alias| format!("{} {}", label(alias.name), alias.value(setup)));
    let named = |topic: &str| {
        aliases_of_kind(system, KnobKind::Depth)
            .flat_map(|alias| alias.knobs)
            .any(|(_, of)| *of == topic)
    };
    let others = setup.iter().filter_map(|knob| match knob {
        Knob::Depth { topic, depth } if !named(topic) => Some(format!("{topic} depth {depth}")),
        _ => None,
    });
    joined(nodes.chain(depths).chain(others)).unwrap_or_default()
}

/// Returns the ends of `rates`, and the rates at which they turned back.
fn turns(rates: &[Hz]) -> impl Iterator<Item = Hz> {
    let is_turn = |index: &usize| match index.checked_sub(1) {
        Some(before) if index + 1 < rates.len() => {
            let (before, after) = (rates[before].get(), rates[index + 1].get());
            (before < rates[*index].get()) != (rates[*index].get() < after)
        }
        _ => true,
    };
    (0..rates.len()).filter(is_turn).map(|index| rates[index])
}

fn verdict(system: &dyn System, summary: &Summary, context: &ReportContext) -> String {
    let steps = match plant_topic(system) {
        Some(_) => plant_steps(summary) + " in ",
        None => String::new(),
    };
    let sim = summary.sim_time.as_secs_f64();
    if let Some(why) = &context.open {
        return format!("open after {steps}{sim:.2} s sim: {why}");
    }
    let wall = summary.wall_time.as_secs_f64();
    format!(
        "{}: {steps}{sim:.2} s sim ({wall:.2} s wall)",
        summary.verdict
    )
}

/// Returns the number of steps of the plant, and when it stopped, if that was before the end.
fn plant_steps(summary: &Summary) -> String {
    let steps = format!("{} plant steps", summary.steps);
    match summary.last_step {
        Some(last) if summary.sim_time.since(last) > STILL => {
            format!("{steps}, the last at {last},")
        }
        _ => steps,
    }
}

/// Time without a step after which a plant stands still.
const STILL: Duration = Duration::from_millis(250);

fn topics(summary: &Summary) -> Option<String> {
    let read = summary.topics.iter().filter(|topic| topic.is_read());
    joined(read.map(|topic| {
        let per_second = topic.average(summary.sim_time);
        let dropped = topic.dropped();
        let unmatched = match topic.unmatched() {
            0 => String::new(),
            unmatched => format!(", {unmatched} unmatched"),
        };
        format!(
            "{} {per_second:.1} msg/s ({dropped} dropped{unmatched})",
            topic.name
        )
    }))
}

/// Returns what the links did to messages, where they did something.
fn links(summary: &Summary) -> Option<String> {
    let topics = summary.topics.iter().filter_map(|topic| {
        let figures: Vec<String> = [
            (topic.lost, "lost"),
            (topic.overtaken, "overtaken"),
            (topic.in_flight(), "in flight"),
        ]
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        (!figures.is_empty()).then(|| format!("{} {}", topic.name, figures.join(", ")))
    });
    joined(topics)
}

/// Returns the main latency, with the period of the main rate.
fn latency(system: &dyn System, summary: &Summary) -> Option<String> {
    let (_, meter) = system.latency()?;
    let text = latency_of(meter, &summary.latency);
    let period = rate_alias(system, |of| summary.node(of).is_some())
        .and_then(|alias| {
            let node = summary.node(alias.knobs.first()?.1)?;
            let period = ms(node.hz.period().as_secs_f64());
            Some(format!(" ({} period {period})", label(alias.name)))
        })
        .filter(|_| summary.latency.count() > 0);
    Some(text + &period.unwrap_or_default())
}

/// Returns the main latency, then the latencies of the other chains.
fn latencies(system: &dyn System, summary: &Summary) -> Vec<(&'static str, String)> {
    let others = summary
        .chain_latencies(system)
        .map(|(chain, latency)| latency_of(chain, latency));
    let texts = latency(system, summary).into_iter().chain(others);
    iter::once("latency")
        .chain(iter::repeat(""))
        .zip(texts)
        .collect()
}

/// Returns a latency in words.
fn latency_of(meter: &str, latency: &Distribution) -> String {
    let Some(mean) = latency.mean_s() else {
        return format!("{meter} was not measured");
    };
    format!(
        "{meter} mean {}, p50 {}, p99 {}, max {}",
        ms(mean),
        ms_or_dash(latency.quantile(0.5)),
        ms_or_dash(latency.quantile(0.99)),
        ms_or_dash(latency.max()),
    )
}

fn each_node(
    summary: &Summary,
    wanted: impl Fn(&NodeAccount) -> bool,
    tell: impl Fn(&NodeAccount) -> String,
) -> Option<String> {
    let nodes = summary.nodes.iter().filter(|node| wanted(node));
    joined(nodes.map(tell))
}

/// Joins `parts` to a line; `None` without parts.
fn joined(parts: impl Iterator<Item = String>) -> Option<String> {
    let parts: Vec<String> = parts.collect();
    (!parts.is_empty()).then(|| parts.join(" | "))
}

fn spread(name: &str, figures: &Distribution) -> String {
    let at = |quantile| ms_or_dash(figures.quantile(quantile));
    format!("{name} p50 {}, p99 {}", at(0.5), at(0.99))
}

fn lateness(node: &NodeAccount) -> String {
    let [p50, p99] = [0.5, 0.99].map(|quantile| {
        let late = node.lateness.quantile(quantile);
        late.map_or("-".to_owned(), |d| format!("{:.0}", d.as_secs_f64() * 1e6))
    });
    format!("{} p50 {p50} p99 {p99} µs", node.name)
}

/// Returns how many of the ticks that were due at `node` did not begin.
pub fn overruns(node: &NodeAccount) -> String {
    let due = node.ticks.saturating_add(node.overruns);
    format!("{} of {due}", node.overruns)
}

/// This number of seconds in milliseconds.
pub fn ms(seconds: f64) -> String {
    format!("{} ms", millis::text(seconds * 1e3))
}

/// Returns a duration in milliseconds, or a dash without one.
pub fn ms_or_dash(duration: Option<Duration>) -> String {
    duration.map_or("-".to_owned(), |duration| ms(duration.as_secs_f64()))
}

/// Returns the path of a recording.
pub fn recorded(recorded: &FinishedRecording) -> String {
    let lost = match recorded.lost {
        0 => String::new(),
        lost => format!(", {lost} more came too fast to be recorded"),
    };
    let hurried = if recorded.hurried {
        "; stopped, so the viewer has no timeline of it, and the file is not compacted"
    } else {
        ""
    };
    let text = format!(
        "{} ({}, {} messages{lost}{hurried})",
        recorded.path.display(),
        size(recorded.bytes),
        recorded.messages
    );
    line("recorded", &text)
}

/// Returns a number of bytes in words.
pub fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use ratelab::{Graph, Hz, Tick};
    use ratelab_metrics::Observer;

    use super::*;

    #[test]
    fn counts_of_an_altered_recording_are_printed_whatever_they_are() {
        let mut graph = Graph::new();
        let added = graph.node("policy", Hz::MAX, 0, |_| |_: &mut Tick| {});
        added.expect("a node");
        let mut node = Observer::new(&graph).snapshot().nodes.remove(0);
        (node.ticks, node.overruns) = (2, u64::MAX);
        let most = u64::MAX;
        assert_eq!(overruns(&node), format!("{most} of {most}"));
    }
}
