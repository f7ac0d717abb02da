//! Build it: Topic, Rate and Node from scratch.

use ratelab::{Depth, Tick, Time, Topic};

use crate::framework::{Answer, Failure, Findings, Measurement, PredictionPlace, Table};

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

pub(crate) fn measure() -> Result<Findings, Failure> {
    let depth = Depth::new(DEPTH).map_err(|error| Failure::Unmeasured(error.to_string()))?;
    let topic = Topic::new("/numbers", depth);
    let (publisher, mut subscription) = (topic.publisher(), topic.subscribe());
    let (mut published, mut rows) = (0_u32, Vec::new());
    let mut tick = Tick::at(Time::ZERO);
    for event in EVENTS {
        let event = match event {
            TopicEvent::Publish(count) => {
                for _ in 0..count {
                    published += 1;
                    tick.publish(&publisher, published);
                }
                format!("{count} published")
            }
            TopicEvent::Read => {
                let newest = tick.read(&mut subscription).map(|newest| newest.data);
                format!("message {} read", newest.unwrap_or_default())
            }
        };
        rows.push((event, published, subscription.dropped()));
    }
    let measurements = (1..).zip(&rows).map(|(number, (_, _, dropped))| {
        let name = format!("after event {number}: dropped");
        Measurement::new(name, *dropped as f64)
    });
    Ok(Findings {
        table: Table::from_items(
            &rows,
            &[
                ("event", &|(event, _, _)| event.clone()),
                ("published", &|(_, published, _)| published.to_string()),
                ("dropped", &|(_, _, dropped)| dropped.to_string()),
            ],
        ),
        place: PredictionPlace::Row(EVENTS.len() - 1),
        answer: Answer::Exactly(subscription.dropped() as f64),
        meaning: MEANING.to_owned(),
        measurements: measurements.collect(),
    })
}

const MEANING: &str = "\
    A message is dropped when it leaves the full queue before the reader has caught up with it. To \
    read the newest is to catch up with everything: the reader could have read what it passed over, \
    so that is not a drop. The two messages in the queue at the reading leave it uncounted, and only \
    then do drops go on. Now write it: exercises/build/src/topic.rs, then rate.rs and node.rs; cargo \
    test -p build-it is the judge, and then cargo run -p build-it --features lab -- 5 plays a run \
    on your own runtime in the lab, and compares it with the lab's own.";
