//! Header stamps in graph files: whose they are, which clock they show, and what `match` makes of
//! them; ages are by run time, whatever the stamps say.

use std::fmt::Write;

use crate::{support::*, table::rows};

/// The messages of each topic of a run of a graph file, and the ticks of each node.
struct Played {
    topics: Vec<(String, Rows)>,
    /// Those with the data ages of its chains.
    chains: Rows,
    ticks: Vec<Vec<TickRecord>>,
    /// Published, dropped, lost and unmatched messages of each topic.
    counts: Vec<[u64; 4]>,
}

fn played(text: &str, seconds: f64) -> Played {
    let system = graph_system(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let config = config(&format!("until {seconds}"));
    let experiment = Experiment::new(system, &config).expect("a graph");
    let taps = experiment.taps();
    let topology = experiment.observer().topology();
    let topics = topology.topics.clone().into_iter();
    let topics = topics.filter(|topic| topic.name != CHAINS);
    let of_topics: Vec<_> = topics
        .map(|topic| (taps.rows(&topic.name, ROOM).expect("numbers"), topic.name))
        .collect();
    let (of_nodes, of_chains) = (taps.ticks(ROOM), taps.rows(CHAINS, ROOM));
    let summary = experiment.run().expect("no fault");
    let count = |name: &str| {
        let topic = summary.topic(name).expect("a topic");
        [
            topic.published,
            topic.dropped(),
            topic.lost,
            topic.unmatched(),
        ]
    };
    // What a node at the end of a chain measures is of the chain, and so is the place of its topic
    // among all.
    let place =
        |topic: usize| topic - usize::from(topology.topic(CHAINS).is_some_and(|at| at < topic));
    let unmeasured = |mut tick: TickRecord| {
        let reads = tick.causes.reads.iter_mut();
        reads.for_each(|read| read.message.topic = place(read.message.topic));
        tick.causes.completed = tick.causes.completed.map(place);
        TickRecord { push: None, ..tick }
    };
    let ticks = of_nodes.iter();
    let ticks = ticks.map(|ticks| ticks.items().try_iter().map(unmeasured).collect());
    Played {
        counts: of_topics.iter().map(|(_, name)| count(name)).collect(),
        ticks: ticks.collect(),
        chains: of_chains.as_ref().map(taken).unwrap_or_default(),
        topics: of_topics
            .into_iter()
            .map(|(tap, name)| (name, taken(&tap)))
            .collect(),
    }
}

/// The messages of a topic.
fn taken(tap: &RowTap) -> Rows {
    let mut rows = tap.rows();
    tap.take(&mut rows);
    rows
}

impl Played {
    /// When the data of each chain began at the end of the tick that published this message of its last
    /// node (ns).
    fn begun(&self, sent: &Head) -> Vec<u64> {
        let mut ends = self.chains.iter();
        let end = ends.find(|(head, _)| head.by == sent.by);
        let (_, row) = end.expect("the ages of the tick");
        let ages = row[2..].iter().step_by(6);
        ages.map(|ms| sent.at.as_nanos() - (ms * 1e6).round() as u64)
            .collect()
    }
}

/// The graph files of the independent model, each with what it says of them.
fn cases() -> Vec<(String, String)> {
    // More of them: `python3 tests/golden/stamps.py 5000 > FILE`.
    let known = include_str!("../golden/stamps.txt");
    let cases = golden_blocks(known, "RATELAB_STAMPS").into_iter();
    let split = |case: String| {
        let (text, expected) = case.rsplit_once('\n').expect("a result");
        (format!("{text}\n"), expected.to_owned())
    };
    cases.map(split).collect()
}

#[test]
fn header_stamps_and_matches_are_those_of_an_independent_model() {
    for (number, (text, expected)) in cases().into_iter().enumerate() {
        let (mut lines, mut count) = (String::new(), 0);
        let mut played = played(&text, 3.0);
        // In the order of the file, in which the node with several triggers is last.
        let place = |topic: &str| text.find(&format!("publishes = [\"{topic}\"]"));
        played.topics.sort_by_key(|(topic, _)| place(topic));
        for (topic, rows) in &played.topics {
            for (head, row) in rows.iter() {
                let stamp = head.origin.expect("a header stamp").as_nanos();
                // No message has more than that.
                assert_eq!(row, [stamp as f64], "{topic} of graph {number}");
                write!(lines, "{topic} {} {stamp}", head.at.as_nanos()).expect("written");
                if topic == "/out" {
                    let begun = played.begun(head).into_iter();
                    begun.for_each(|begun| write!(lines, " {begun}").expect("written"));
                }
                lines.push('\n');
                count += 1;
            }
        }
        let got = format!("messages={count} hash={:016x}", fnv1a64(lines.as_bytes()));
        assert_eq!(got, expected, "graph {number}:\n{text}{lines}");
    }
}

/// Checks that two files of the same nodes have the same run, however many chains are in them.
fn runs_are_equal(one: &str, other: &str, seconds: f64) {
    let [one_run, other_run] = [one, other].map(|text| played(text, seconds));
    let pairs = one_run.topics.iter().zip(&other_run.topics);
    for ((name, rows), (other_name, other_rows)) in pairs {
        assert_eq!(name, other_name);
        assert_eq!(rows.heads(), other_rows.heads(), "{name}:\n{one}\n{other}");
    }
    assert_eq!(one_run.ticks, other_run.ticks, "{one}\n{other}");
    assert_eq!(one_run.counts, other_run.counts, "{one}\n{other}");
}

#[test]
fn a_run_does_not_depend_on_the_chains_of_its_file() {
    let cases = cases().into_iter().map(|(text, _)| (text, 3.0));
    let arm = (graph_text("arm", ""), 20.0);
    for (text, seconds) in cases.chain([arm]) {
        let (nodes, chains) = text.split_once("[chain]\n").expect("chains");
        let reversed: String = chains
            .lines()
            .rev()
            .map(|line| format!("{line}\n"))
            .collect();
        runs_are_equal(&text, nodes, seconds);
        runs_are_equal(&text, &format!("{nodes}[chain]\n{reversed}"), seconds);
    }
}

#[test]
fn a_match_compares_header_stamps_and_ages_are_by_run_time() {
    // Without an error both are read at once, and are up to 100 ms old. With the clock of b 30 ms
    // behind, b ticks at 30, 130, ... and shows 0, 100, ...: a is 30 ms old as they meet. Where its
    // stamps alone are wrong, b ticks at 0, 100, ...: by 30 ms no two are equal, but for two zeros,
    // as a clock stamps zero before zero; by 100 ms another pair meets. With 10 % of drift each
    // tenth stamp of b is one that a will have, up to 0.9 s later, so nine wait. A node that copies
    // has the stamp of what it read, first on its first topic.
    const LATE: &str = r#"["/a", "/b"], match → ["/late", "/b"], match; ["a", "/a", → ["a", "/a", "late", "/late","#;
    let table = r#"
        | 10 | ticks sync 101; one_mean_age 50.0; two_mean_age 50.0
        b = { → b = { clock = "-30 0",                | 10.03 | ticks sync 101; one_mean_age 80.0; one_greatest_age 130.0; two_mean_age 50.0
        b = { → b = { clock = "-100 0",               | 10.1  | ticks sync 101; one_mean_age 150.0; one_greatest_age 200.0; two_mean_age 50.0
        b = { → b = { stamp_clock = "-30 0",          | 10    | ticks sync 1; one_greatest_age 10000.0
        b = { → b = { stamp_clock = "30 0",           | 10    | ticks sync 0
        b = { → b = { stamp_clock = "-100 0",         | 10    | ticks sync 100; one_mean_age 149.0; one_greatest_age 200.0; two_mean_age 51.0
        b = { → b = { stamp_clock = "100 0",          | 10    | ticks sync 100; one_mean_age 50.0; two_mean_age 150.0
        b = { → b = { stamp_clock = "0 100000",       | 10    | ticks sync 10
        b = { → b = { clock = "-30 0", stamp_clock = "-30 0", | 10.03 | ticks sync 101; one_mean_age 80.0
        b = { → b = { clock = "-30 0", stamp_clock = "0 0",   | 10.03 | ticks sync 0
        b = { → b = { takes = 20,                     | 10.02 | ticks sync 101; one_mean_age 70.0; two_mean_age 70.0
        b = { → b = { takes = 20, stamp = "now",      | 10.02 | ticks sync 101
        LATE                                          | 10.04 | ticks sync 101; one_mean_age 90.0; two_mean_age 90.0
        LATE; late = { → late = { stamp = "/a",       | 10.04 | ticks sync 101; one_mean_age 90.0
        LATE; late = { → late = { stamp = "/x",       | 10.04 | ticks sync 0
        LATE; reads = ["/a", "/x"] → reads = ["/x", "/a"] | 10.04 | ticks sync 0
        LATE; reads = ["/a", "/x"] → reads = ["/x", "/a"], stamp = "/a" | 10.04 | ticks sync 101; one_mean_age 90.0
        LATE; late = { → late = { stamp = "now",      | 10.04 | ticks sync 0
        LATE; late = { → late = { stamp = "now", stamp_clock = "-40 0", | 10.04 | ticks sync 101; one_mean_age 90.0
        LATE; late = { → late = { stamp_clock = "-40 0", | 10.04 | ticks sync 101; one_mean_age 90.0
        LATE; late = { → late = { clock = "-40 0",    | 10.08 | ticks sync 101; one_mean_age 130.0
        LATE; rate = 10, offset = 40, reads = ["/a", "/x"] → trigger = ["/x"], reads = ["/a"] | 10.01 | ticks sync 0
        LATE; rate = 10, offset = 40, reads = ["/a", "/x"] → trigger = ["/x"], reads = ["/a"], stamp = "/a" | 10.01 | ticks sync 101; one_mean_age 60.0; two_mean_age 60.0
        "#;
    let rows = rows(table).map(|[changes, seconds, figures]: [String; 3]| {
        let changes = changes.replace("LATE", LATE);
        format!("stamps | {changes} | {seconds} | | {figures}\n")
    });
    check_graphs(&rows.collect::<String>());
}

#[test]
fn a_clock_for_stamps_is_turned_in_a_run_and_moves_no_tick() {
    let text = graph_text("stamps", "");
    let right = played(&text, 3.0);
    // From 1 s on 100 ms ahead: what b stamps then is what a has 100 ms later.
    let summary = run_graph(&text, 3.0, "1 stamp_clock b 100 0");
    check(
        "turned",
        &summary,
        "ticks a 31; ticks b 31; ticks sync 30; published /b 31",
    );
    let wrong = played(
        &text.replace("b = { rate", "b = { stamp_clock = \"7 40\", rate"),
        3.0,
    );
    let times = |played: &Played| -> Vec<Time> {
        let (_, rows) = played
            .topics
            .iter()
            .find(|(name, _)| name == "/b")
            .expect("/b");
        rows.heads().iter().map(|head| head.at).collect()
    };
    assert_eq!(times(&wrong), times(&right));
}
