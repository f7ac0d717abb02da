//! What a bag says, for people.

use ratelab_bag::{Analysis, Bag, BagChain, BagNode, GapVerdict, Kind, TopicClock, quantile};
use ratelab_experiment::Table;

use super::{clock, in_ms};
use crate::summary::text::{lines, size};
use ratelab_recording::printable::in_line;

/// The most rows of a kind.
const MAX_ROWS: usize = 40;

/// Returns the lines about the bag in the file called `file`.
pub fn text(file: &str, bag: &Bag, analysis: &Analysis) -> String {
    let mut head = vec![(
        "bag",
        format!(
            "{file}: {} messages of {} topics in {:.2} s",
            bag.messages(),
            bag.topics.len(),
            bag.span() as f64 / 1e9
        ),
    )];
    head.extend(clocks(bag, analysis));
    head.extend(stops(bag, analysis));
    let topics = topics(bag, analysis).lines().join("\n");
    let mut rest = nodes(bag, analysis);
    rest.extend(gaps(bag, analysis));
    rest.extend(
        bag.damage
            .iter()
            .take(MAX_ROWS)
            .map(|damage| ("damage", in_line(&damage.to_string()))),
    );
    format!("{}\n\n{topics}\n\n{}", lines(&head), lines(&rest))
}

/// Returns the name of a topic as it is printed.
fn name(bag: &Bag, topic: usize) -> String {
    in_line(&bag.topics[topic].name)
}

/// Returns the clocks.
fn clocks(bag: &Bag, analysis: &Analysis) -> Vec<(&'static str, String)> {
    let clocks = &analysis.clocks;
    let on = |wanted: TopicClock| clocks.of_topics.iter().filter(|of| **of == wanted).count();
    let mut rows = Vec::new();
    let (log, recorder) = (on(TopicClock::Log), on(TopicClock::Recorder));
    if recorder > 0 {
        let least = in_ms(clocks.least_transport);
        let text =
            format!("{recorder} topics on the clock of the recorder, fastest delivery {least} ms");
        rows.push(("clock", text));
    }
    if log > 0 {
        rows.push((
            "clock",
            format!("{log} topics by log times: the bag has no publish times of them"),
        ));
    }
    for (number, group) in clocks.groups.iter().enumerate() {
        let topics: Vec<String> = group
            .topics
            .iter()
            .take(MAX_ROWS)
            .map(|topic| name(bag, *topic))
            .collect();
        rows.push((
            "clock",
            format!(
                "{}: {:+} ms against the recorder, {:+.1} ppm: {}",
                clock(TopicClock::Group(number)),
                in_ms(group.offset),
                group.drift_ppm,
                topics.join(", ")
            ),
        ));
    }
    rows
}

/// Returns when the recorder stood still, and what it lost.
fn stops(bag: &Bag, analysis: &Analysis) -> Vec<(&'static str, String)> {
    let stalls = analysis.pauses.iter().take(MAX_ROWS).map(|pause| {
        let (at, length) = (pause.at as f64 / 1e9, in_ms(pause.length));
        (
            "stall",
            format!("the recorder stood still at {at:.3} s for {length:.1} ms"),
        )
    });
    let filled = analysis
        .filled
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(topic, count)| {
            let name = name(bag, topic);
            let text = format!("{count} messages of {name} that others used are not in the bag");
            ("lost", text)
        });
    let lost = bag.topics.iter().enumerate();
    let lost = lost.filter_map(|(topic, of)| Some((topic, of.lost.filter(|lost| *lost > 0)?)));
    let lost = lost.map(|(topic, count)| {
        let name = name(bag, topic);
        (
            "lost",
            format!("{count} messages of {name} by their numbers"),
        )
    });
    stalls.chain(filled).chain(lost).collect()
}

/// Returns a row of cells for each topic, below their titles.
fn topics(bag: &Bag, analysis: &Analysis) -> Table {
    let titles = [
        "topic", "messages", "Hz", "ms p50", "p99", "max", "jitter", "/s", "age p50", "p99",
        "gaps", "order",
    ];
    let mut rows = Vec::new();
    for (place, (topic, figures)) in bag.topics.iter().zip(&analysis.figures).enumerate() {
        let interval = figures.interval.unwrap_or_default();
        let times = [interval.p50, interval.p99, interval.max, figures.jitter];
        let mut row = vec![
            name(bag, place),
            topic.messages.len().to_string(),
            figures
                .rate_hz
                .map_or("-".to_owned(), |rate| format!("{rate:.2}")),
        ];
        row.extend(times.map(short_ms));
        row.push(figures.bytes_per_s.map_or("-".to_owned(), size));
        let age = |of: Option<i64>| of.map_or("-".to_owned(), short_ms);
        row.push(age(figures.age.map(|age| age.p50)));
        row.push(age(figures.age.map(|age| age.p99)));
        row.push(figures.gaps.len().to_string());
        row.push(topic.order_breaks.to_string());
        rows.push(row);
    }
    Table {
        headers: titles.map(str::to_owned).to_vec(),
        rows,
        named: true,
    }
}

/// `ns` in milliseconds, shorter where it is long.
fn short_ms(ns: i64) -> String {
    let ms = in_ms(ns);
    match ms.abs() {
        ..100.0 => format!("{ms:.2}"),
        ..10_000.0 => format!("{ms:.1}"),
        _ => format!("{ms:.0}"),
    }
}

/// Returns the nodes, their chains, twins, threads and guesses.
fn nodes(bag: &Bag, analysis: &Analysis) -> Vec<(&'static str, String)> {
    let mut rows = Vec::new();
    for chain in analysis.chains.iter().take(MAX_ROWS) {
        let node = analysis.node(chain.topic);
        rows.extend(node.map(|node| ("node", node_line(bag, analysis, node))));
    }
    rows.extend(
        analysis
            .chains
            .iter()
            .take(MAX_ROWS)
            .map(|of| ("age", chain(bag, of))),
    );
    for group in &analysis.shared {
        let topics: Vec<String> = group.iter().map(|topic| name(bag, *topic)).collect();
        rows.push((
            "thread",
            format!("one for the nodes of {}", topics.join(" and ")),
        ));
    }
    let bursts = bag
        .topics
        .iter()
        .zip(&analysis.figures)
        .enumerate()
        .filter(|(_, (topic, of))| of.burst >= 3 && topic.messages.len() >= 10);
    rows.extend(bursts.take(MAX_ROWS).map(|(place, (_, of))| {
        let within = short_ms(of.interval.unwrap_or_default().p50 / 10);
        let text = format!(
            "up to {} messages of {} within {within} ms",
            of.burst,
            name(bag, place)
        );
        ("burst", text)
    }));
    rows.extend(analysis.guesses.iter().take(MAX_ROWS).map(|guess| {
        let (from, to) = (name(bag, guess.parent), name(bag, guess.child));
        let r = guess.correlation;
        (
            "guess",
            format!("by timing alone {to} may follow {from} (r = {r:.2})"),
        )
    }));
    rows
}

/// Returns what a node is.
fn node_line(bag: &Bag, analysis: &Analysis, node: &BagNode) -> String {
    let twins: Vec<String> = analysis
        .relations
        .leaders
        .iter()
        .enumerate()
        .filter(|(topic, leader)| **leader == node.topic && *topic != node.topic)
        .map(|(topic, _)| name(bag, topic))
        .collect();
    let also = match &twins[..] {
        [] => String::new(),
        twins => format!(", together with {}", twins.join(", ")),
    };
    let topic = name(bag, node.topic);
    let Some(input) = &node.input else {
        return format!("{topic} begins here{also}");
    };
    let parent = name(bag, input.parent);
    let sure = format!("{:.0} % sure", node.confidence * 100.0);
    let what = match (node.kind, input.timed, input.other) {
        (Kind::Timer, Some(timed), _) => format!(
            "timer of {:.3} ms reads {parent} ({sure}; read phase known to within {:.2} ms)",
            timed.period / 1e6,
            timed.known_to / 1e6
        ),
        (_, _, Some(other)) => {
            format!(
                "triggered by {parent} and {} with one stamp ({sure})",
                name(bag, other)
            )
        }
        (Kind::Unknown, ..) => {
            format!("reads {parent}; neither trigger nor timer explains it ({sure})")
        }
        _ => format!("triggered by {parent} ({sure})"),
    };
    let mut costs = node.costs();
    let costs = match node.kind {
        Kind::Timer => String::new(),
        _ => {
            let [p50, p99] = [500, 990].map(|permille| short_ms(quantile(&mut costs, permille)));
            format!(", takes {p50} ms (p99 {p99})")
        }
    };
    format!("{topic} {what}{costs}{also}")
}

/// Returns the age of a chain.
fn chain(bag: &Bag, chain: &BagChain) -> String {
    let path: Vec<String> = chain.path.iter().map(|topic| name(bag, *topic)).collect();
    let Some(ages) = chain.ages else {
        return format!("{}: too few messages", path.join(" > "));
    };
    let mut text = format!(
        "{}: mean {:.1} ms, p99 {:.1} ms over time; {:.1} ms at publication",
        path.join(" > "),
        ages.mean / 1e6,
        in_ms(ages.p99),
        ages.mean_published / 1e6
    );
    if chain.is_from_quickest {
        text.push_str(", from the quickest: the stamps' clock is unknown");
    }
    if chain.rate_ppm != 0.0 {
        text.push_str(", with the other rate of the stamps' clock taken out");
    }
    text
}

/// Returns the longest gaps.
fn gaps(bag: &Bag, analysis: &Analysis) -> Vec<(&'static str, String)> {
    const SHOWN: usize = 10;
    let mut gaps: Vec<_> = analysis
        .figures
        .iter()
        .enumerate()
        .flat_map(|(topic, of)| of.gaps.iter().map(move |gap| (topic, *gap)))
        .collect();
    gaps.sort_by_key(|(topic, gap)| (std::cmp::Reverse(gap.length), *topic));
    let rows = gaps.into_iter().take(SHOWN).map(|(topic, gap)| {
        let verdict = match gap.verdict {
            GapVerdict::Late => "its messages came late",
            GapVerdict::Silent => "nothing was sent, or it was lost",
            GapVerdict::Unknown => "the cause is unknown without header stamps",
        };
        let (name, at, length) = (name(bag, topic), gap.at as f64 / 1e9, short_ms(gap.length));
        (
            "gap",
            format!("{name} at {at:.3} s for {length} ms: {verdict}"),
        )
    });
    rows.collect()
}
