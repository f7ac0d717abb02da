//! What a match does with the messages that it takes: each is used once, discarded or waits.

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
