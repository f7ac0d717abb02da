//! What a match does with the messages that it takes: each is used once, discarded or waits; and
//! when a tick on a set is due.

use std::sync::Mutex;

use crate::{support::*, table::rows};

/// A node `sync` whose match has messages of two sensors.
const SYNC: &str = r#"
name = "g"
[node]
a = { rate = HZ_A, publishes = ["/a"] }
b = { rate = HZ_B, offset = 7, publishes = ["/b"] }
sync = { trigger = ["/a", "/b"], match = "MATCH", takes = TAKES, publishes = ["/s"] }
load = { rate = 5, takes = 60 }
[topic]
"/a" = { depth = 5, link = "LINK" }
"/b" = { depth = 5 }
"#;

#[test]
fn a_message_is_used_in_a_set_discarded_or_still_waits() {
    // Of each topic `queue` messages may wait in the match, and five in the topic's queue.
    for [a, b, matching, takes, link, executor, queue, discarded] in rows(
        "30 | 10 | each           | 0  | none         |          | 1  | /a
         30 | 10 | approximate:2  | 0  | none         |          | 2  | /a
         30 | 30 | approximate:3  | 0  | none         |          | 3  |
         30 | 10 | approximate:10 | 40 | delay:5..40  |          | 10 | /a
         30 | 30 | exact:10       | 0  | none         |          | 10 | /a,/b
         30 | 10 | each           | 20 | none         | single   | 1  | /a
         30 | 10 | approximate:10 | 20 | loss:0.2     | multi:2  | 10 | /a
         30 | 10 | each           | 20 | delay:5..40  | events   | 1  | /a
         30 | 10 | each           | 20 | none         | fixed-priority:1 | 1 | /a",
    ) {
        let case = format!("{a} {b} {matching} {takes} {link} {executor}");
        let values = [
            ("HZ_A", a),
            ("HZ_B", b),
            ("MATCH", matching),
            ("TAKES", takes),
            ("LINK", link),
        ];
        let values = values.into_iter();
        let text = values.fold(SYNC.to_owned(), |text, (name, value)| {
            text.replace(name, &value)
        });
        let executor = match &*executor {
            "" => String::new(),
            kind => format!("[executor.one]\nkind = \"{kind}\"\nnodes = [\"sync\", \"load\"]\n"),
        };
        let summary = run_graph(&(text + &executor), 20.0, "");
        let sets = summary.node("sync").expect("a node").ticks;
        let queue: u64 = queue.parse().expect("a number");
        for name in ["/a", "/b"] {
            let topic = summary.topic(name).expect("a topic");
            let delivered = topic.published - topic.lost - topic.in_flight();
            let known = sets + topic.unmatched() + topic.dropped() + topic.overtaken;
            let waiting = delivered.checked_sub(known);
            let waiting =
                waiting.unwrap_or_else(|| panic!("{case} {name}: {known} of {delivered}"));
            assert!(waiting <= queue + 5, "{case} {name}: {waiting} wait");
            let many = topic.unmatched() > 10;
            assert_eq!(
                many,
                discarded.contains(name),
                "{case} {name}: {}",
                topic.unmatched()
            );
        }
    }
}

/// When the ticks on sets of two topics were due, and the run times of the ticks of a sender, each
/// with a message on both topics.
fn sets_of_a_sender(
    matching: &str,
    executor: &str,
    clock: &mut dyn Clock,
    knobs: &str,
) -> [Vec<Time>; 2] {
    let mut graph = Graph::new();
    let topics = ["/a", "/b"].map(|name| Topic::new(name, depth(100)));
    let sent = Arc::new(Mutex::new(Vec::new()));
    let times = sent.clone();
    let sender = graph.node("sender", 100.0, 0, |wiring| {
        let [a, b] = topics.each_ref().map(|topic| wiring.publisher(topic));
        move |tick: &mut Tick| {
            let mut times = times.lock().expect("no panic");
            // Of those on /b two have one stamp.
            let number = times.len() as u64;
            tick.publish_stamped(&a, (), at_ms(10 * number));
            tick.publish_stamped(&b, (), at_ms(20 * (number / 2)));
            times.push(tick.now());
        }
    });
    sender.expect("a node");
    let matching: Match = matching.parse().expect(matching);
    let sync = graph.node("sync", matching, 1, |wiring| {
        let mut from = topics.each_ref().map(|topic| wiring.trigger(topic));
        move |tick: &mut Tick| {
            assert!(from.iter_mut().all(|topic| tick.read(topic).is_some()));
        }
    });
    sync.expect("a node");
    worker(&mut graph, "load", 80.0, 2, |_: &mut Tick| {});
    if !executor.is_empty() {
        let executor: Executor = executor.parse().expect(executor);
        let callbacks = ["sync", "load"].map(|name| Callback::new(name).with_deadline(ms(20)));
        graph.executor(executor, callbacks).expect("nodes");
    }
    let taps = TapHandle::new(&graph).ticks(4096);
    run_timed(clock, &mut graph, &at_once(knobs), at_ms(300));
    let dues = taps[1].items().try_iter().map(|tick| tick.due()).collect();
    let sent = sent.lock().expect("no panic").clone();
    [dues, sent]
}

#[test]
fn a_tick_on_a_set_is_due_when_the_message_was_delivered_that_completed_it() {
    // The ticks for each message on /b: of a pair of equal stamps for the first, for the second.
    for [matching, first, second] in rows(
        "each           | 1 | 1
         exact:10       | 1 | 0
         approximate:10 | 2 | 0",
    ) {
        let counts = [&first, &second].map(|count| count.parse().expect(count));
        let check = |executor: &str, clock: &mut dyn Clock, delay: u64, knobs: &str| {
            let [dues, sent] = sets_of_a_sender(&matching, executor, clock, knobs);
            let completed = sent.iter().enumerate().flat_map(|(number, at)| {
                // Nothing came before the first one.
                let count: usize = if number == 0 { 1 } else { counts[number % 2] };
                std::iter::repeat_n(*at + ms(delay), count)
            });
            let completed: Vec<Time> = completed.take(dues.len()).collect();
            assert_eq!(dues, completed, "{matching} {executor}");
            dues.len() > 5
        };
        let costs = "takes sync 4; takes load 3";
        let delayed = format!("{costs}; link /b delay:3");
        for executor in [
            "",
            "single",
            "multi:2",
            "events",
            "fixed-priority:1",
            "edf:1",
        ] {
            assert!(check(executor, &mut VirtualClock, 3, &delayed));
        }
        for executor in ["", "single", "multi:2", "events"] {
            // A busy machine may let a run pass without ticks.
            let mut runs = (0..20).map(|_| check(executor, &mut RealClock::default(), 0, costs));
            assert!(runs.any(|ticked| ticked), "{matching} {executor}");
        }
    }
}
