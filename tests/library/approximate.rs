//! Messages with the closest stamps, against an independent model of message_filters.

use std::sync::{Arc, Mutex};

use crate::support::*;

/// The sets of a sequence of messages, of which one is published each millisecond; `executor`
/// calls the node, or a thread of its own.
fn sets(matching: Match, inputs: usize, messages: &[(usize, u64)], executor: &str) -> String {
    let (mut graph, messages) = (Graph::new(), messages.to_vec());
    let topics = (0..inputs).map(|input| Topic::new(format!("/t{input}"), depth(1000)));
    let topics: Vec<_> = topics.collect();
    let sender = graph.node("sender", 1000.0, 0, |wiring| {
        let to: Vec<_> = topics.iter().map(|topic| wiring.publisher(topic)).collect();
        let mut counts = vec![0u64; inputs];
        move |tick: &mut Tick| {
            let now = tick.now();
            let sent = (now.as_nanos() / 1_000_000).checked_sub(1);
            let message = sent.and_then(|index| messages.get(usize::try_from(index).ok()?));
            if let Some((topic, stamp)) = message {
                let stamp = Time::from_nanos(stamp * 1000);
                tick.publish_stamped(&to[*topic], counts[*topic], stamp);
                counts[*topic] += 1;
            }
        }
    });
    sender.expect("a node");
    let sets = Arc::new(Mutex::new(Vec::new()));
    let found = sets.clone();
    let matcher = graph.node("matcher", matching, 1, |wiring| {
        let mut from: Vec<_> = topics.iter().map(|topic| wiring.trigger(topic)).collect();
        move |tick: &mut Tick| {
            let now = tick.now();
            let read = from.iter_mut().map(|topic| {
                let message = tick.read(topic).expect("a message of each topic");
                message.data.to_string()
            });
            let read: Vec<_> = read.collect();
            let set = format!("{}:{}", now.as_nanos() / 1_000_000, read.join("+"));
            found.lock().expect("no panic").push(set);
        }
    });
    matcher.expect("a node");
    if !executor.is_empty() {
        let executor: Executor = executor.parse().expect(executor);
        let nodes = graph.executor(executor, [Callback::new("matcher")]);
        nodes.expect("nodes");
    }
    run_virtual(&mut graph, "", secs(0.1));
    let sets = sets.lock().expect("no panic");
    sets.join(",")
}

#[test]
fn approximate_time_finds_the_sets_of_an_independent_model() {
    // More of them: `python3 tests/golden/approximate.py 5000 > FILE`.
    let known = include_str!("../golden/approximate.txt");
    let cases = golden_blocks(known, "RATELAB_APPROXIMATE");
    for (number, case) in cases.iter().enumerate() {
        let (line, expected) = case.split_once('\n').expect("two lines");
        let fields = fields(line);
        let [inputs, queue, interval, messages] =
            ["topics", "queue", "interval", "messages"].map(|key| fields[key]);
        let interval = interval.parse::<f64>().map(|us| format!(":{}", us / 1e3));
        let text = format!("approximate:{queue}{}", interval.unwrap_or_default());
        let matching: Match = text.parse().expect(&text);
        assert_eq!(matching.to_string(), text);
        let message = |text: &str| {
            let (topic, stamp) = text.split_once(':').expect("two numbers");
            (topic.parse().expect(topic), stamp.parse().expect(stamp))
        };
        let messages: Vec<_> = messages.split(',').map(message).collect();
        let inputs = inputs.parse().expect(inputs);
        for executor in ["", "single", "multi:2", "events", "fixed-priority:1"] {
            let got = sets(matching, inputs, &messages, executor);
            let got = format!("sets={got}");
            assert_eq!(got, expected, "sequence {number}, {executor:?}: {line}");
        }
    }
}
