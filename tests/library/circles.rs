//! Nodes that wait for each other's first message for ever: they are named before the run, and no
//! others are.

use std::collections::BTreeSet;

use proptest::prelude::*;

use crate::support::*;

/// A node of a random graph.
#[derive(Clone, Debug)]
struct RandomNode {
    hz: u32,
    is_triggered: bool,
    /// The topics that it reads, by their numbers.
    inputs: BTreeSet<usize>,
    output: usize,
}

/// A node of a graph with so many topics.
fn node(topics: usize) -> impl Strategy<Value = RandomNode> {
    let inputs = proptest::collection::btree_set(0..topics, 0..3);
    (5..50_u32, any::<bool>(), inputs, 0..topics).prop_map(|(hz, is_triggered, inputs, output)| {
        RandomNode {
            is_triggered: is_triggered && !inputs.is_empty(),
            hz,
            inputs,
            output,
        }
    })
}

/// The graph file of `nodes`, which read only topics that one of them publishes.
fn text(nodes: &[RandomNode]) -> String {
    let published: BTreeSet<usize> = nodes.iter().map(|node| node.output).collect();
    let nodes = nodes.iter().enumerate().map(|(number, node)| {
        let inputs = node.inputs.intersection(&published);
        let inputs: Vec<String> = inputs.map(|topic| format!("\"/t{topic}\"")).collect();
        let inputs = inputs.join(", ");
        let release = if node.is_triggered && !inputs.is_empty() {
            format!("trigger = [{inputs}]")
        } else {
            format!("rate = {}\nreads = [{inputs}]", node.hz)
        };
        format!(
            "[node.n{number}]\n{release}\npublishes = [\"/t{}\"]\n",
            node.output
        )
    });
    format!("name = \"random\"\n{}", nodes.collect::<String>())
}

/// The nodes in the circles that are named before a run.
fn named(text: &str) -> Option<BTreeSet<String>> {
    let system = graph_system(text).ok()?;
    let warnings = system.warnings(&system.about().setup());
    let circles = warnings.iter().filter_map(|warning| {
        let (nodes, _) = warning
            .split_once(": each of these nodes waits")
            .or_else(|| warning.split_once(" never publishes: before its first message"))?;
        Some(nodes.split(" → "))
    });
    let names = circles.flatten().filter(|name| !name.starts_with('/'));
    Some(names.map(str::to_owned).collect())
}

/// The nodes behind `from`, by the topics that they read.
fn behind(graph: &Topology, from: BTreeSet<usize>) -> BTreeSet<usize> {
    let mut known = from;
    loop {
        let next = graph
            .topics
            .iter()
            .filter(|topic| topic.publishers.iter().any(|node| known.contains(node)));
        let next: Vec<usize> = next.flat_map(|topic| topic.readers.clone()).collect();
        let before = known.len();
        known.extend(next);
        if known.len() == before {
            return known;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn a_named_circle_is_silent_in_a_run_and_what_is_silent_is_behind_a_named_circle(
        nodes in (2..5_usize).prop_flat_map(|topics| proptest::collection::vec(node(topics), 2..7)),
    ) {
        let text = text(&nodes);
        // A circle of triggers alone is refused.
        let Some(named) = named(&text) else {
            return Ok(());
        };
        let experiment = Experiment::new(graph_system(&text).expect("a graph"), &config("until 3"));
        let experiment = experiment.expect("a graph");
        let topology = experiment.observer().topology();
        let summary = experiment.run().expect("a run");
        let index = |name: &String| topology.node(name).expect("a node");
        let named: BTreeSet<usize> = named.iter().map(index).collect();
        let is_silent = |node: &usize| {
            let topics = topology.topics.iter().zip(&summary.topics);
            let mut of_node = topics.filter(|(topic, _)| topic.publishers == [*node]);
            of_node.all(|(_, account)| account.published == 0)
        };
        for node in &named {
            let mut topics = topology.topics.iter().zip(&summary.topics);
            let sent = topics.any(|(topic, account)| {
                topic.publishers.contains(node)
                    && account.published > 0
                    && topic.publishers.iter().all(|publisher| named.contains(publisher))
            });
            prop_assert!(!sent, "{node} is named in\n{text}");
        }
        let silent = summary.topics.iter().zip(&topology.topics);
        let silent = silent.filter(|(account, topic)| {
            account.published == 0 && !topic.publishers.is_empty()
        });
        let behind = behind(&topology, named.clone());
        for (_, topic) in silent {
            for node in topic.publishers.iter().filter(|node| is_silent(node)) {
                prop_assert!(behind.contains(node), "{node} is silent in\n{text}");
            }
        }
    }
}

#[test]
fn a_circle_is_named_with_its_topics_and_what_helps() {
    let of = |text: &str| {
        let system = graph_system(text).expect(text);
        system.warnings(&system.about().setup())
    };
    let robot = "name = 'g'\nnode.robot = { rate = 100, reads = ['/cmd'], publishes = ['/state'] }\n\
                 node.control = { rate = 100, reads = ['/state'], publishes = ['/cmd'] }\n";
    assert_eq!(
        of(robot),
        [
            "robot → /state → control → /cmd → robot: each of these nodes waits for the first \
             message of the one before it, so none ever publishes; split one into a node that \
             publishes and a node that reads"
        ]
    );
    // Any other input is enough for a node at a rate, but not for a trigger.
    let camera = "node.camera = { rate = 5, publishes = ['/image'] }\n";
    let reads = robot.replace("['/cmd'], pub", "['/cmd', '/image'], pub");
    assert_eq!(of(&(reads.clone() + camera)), [""; 0]);
    let triggers = reads.replace("rate = 100, reads = ['/cmd'", "trigger = ['/cmd'");
    assert_eq!(of(&(triggers + camera)).len(), 1);
    let own = "name = 'g'\nnode.a = { rate = 9, reads = ['/a'], publishes = ['/a'] }\n";
    let told = of(own);
    assert!(
        told[0].contains("waits for one on /a, which only a publishes"),
        "{told:?}"
    );
}
