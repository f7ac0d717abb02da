//! Build it: Topic, Rate and Node from scratch.

use ratelab::{Depth, Time, Topic};

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, Measurement, Range, Table, Tolerance,
};

/// See [the module](self).
pub struct Build;

const BRIEF: Brief = Brief {
    number: 11,
    part: "",
    name: "build",
    title: "Build it",
    kind: ExerciseKind::Build,
    objective: "Write the three primitives yourself. The crate exercises/build has three empty \
                types, Topic, Rate and Node, and the tests that they must pass: cargo test -p \
                build-it. When all are green the cart-pole of the lab runs on your own runtime, \
                with the same bytes as in the lab. It takes Rust, a clone, and an hour or so. The \
                hardest line is the one that counts a drop, so begin with that: a topic with a \
                queue of two. Five messages are published, the newest is read, and three more are \
                published.",
    question: "How many messages were dropped?",
    quantity: "dropped",
    unit: "messages",
    tolerance: Tolerance::Exact,
    range: Range {
        least: 0.0,
        most: 8.0,
        whole: true,
    },
    choices: &[],
};

/// What happens to the topic: so many messages published, or one read.
const EVENTS: [TopicEvent; 3] = [
    TopicEvent::Publish(5),
    TopicEvent::Read,
    TopicEvent::Publish(3),
];

/// Depth of the queue.
const DEPTH: usize = 2;

enum TopicEvent {
    Publish(u32),
    Read,
}

/// The topic after an event.
struct TopicRow {
    event: String,
    published: u32,
    dropped: u64,
}

impl Exercise for Build {
    fn brief(&self) -> &'static Brief {
        &BRIEF
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let rows = rows()?;
        let mut table = Table::new(["event", "published", "dropped"]);
        for row in &rows {
            table.row([
                row.event.clone(),
                row.published.to_string(),
                row.dropped.to_string(),
            ]);
        }
        let dropped = rows.last().map_or(0, |row| row.dropped);
        let measurements = (1..).zip(&rows).map(|(number, row)| {
            let name = format!("after event {number}: dropped");
            Measurement::new(name, row.dropped as f64)
        });
        Ok(Findings {
            table,
            refuted: Vec::new(),
            answer: Answer::Exactly(dropped as f64),
            meaning: "A message is dropped when it leaves the full queue before the reader has \
                      caught up with it. To read the newest is to catch up with everything: what \
                      was passed over could have been read, and is no drop. So the two messages \
                      in the queue at the reading leave it uncounted, and only then do drops go \
                      on. Now write it: exercises/build/src/topic.rs, then rate.rs and node.rs; \
                      cargo test -p build-it is the judge, and then cargo run -p build-it \
                      --features lab -- 5 plays a run on your own runtime in the lab, and compares \
                      it with the lab's own."
                .to_owned(),
            measurements: measurements.collect(),
        })
    }
}

/// The events, done with the topic of the library.
fn rows() -> Result<Vec<TopicRow>, Failure> {
    let depth = Depth::new(DEPTH).map_err(|error| Failure::Unmeasured(error.to_string()))?;
    let topic = Topic::new("/numbers", depth);
    let (publisher, mut subscription) = (topic.publisher(), topic.subscribe());
    let mut published = 0;
    let rows = EVENTS.iter().map(|event| {
        let event = match event {
            TopicEvent::Publish(count) => {
                for _ in 0..*count {
                    publisher.publish(published, Time::ZERO, None);
                    published += 1;
                }
                format!("{count} published")
            }
            TopicEvent::Read => {
                let newest = subscription.latest(Time::ZERO).map(|newest| newest.data);
                format!("number {} read", newest.unwrap_or_default())
            }
        };
        TopicRow {
            event,
            published,
            dropped: subscription.dropped(),
        }
    });
    Ok(rows.collect())
}
