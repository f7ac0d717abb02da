//! The traffic of a process with others, as lines of a report.

use ratelab_metrics::{Observer, TopicAccount};
use ratelab_network::{Bridge, Inlet};

use crate::summary::text::{line, ms};

/// A line for each topic that arrived here, with its counters of the run that `observer`
/// reads.
pub fn lines(bridge: &Bridge, observer: &Observer) -> Vec<String> {
    let snapshot = observer.snapshot();
    let lines = bridge.inlets().iter().map(|inlet| {
        let (name, node) = (&inlet.name, &inlet.node);
        let (lost, refused) = (inlet.sender().lost, refused(inlet));
        let read = snapshot.topic(name).map(read).unwrap_or_default();
        line(
            "wire",
            &format!("{name} from {node}: {lost} lost on the way, {refused}{read}"),
        )
    });
    lines.collect()
}

/// The refused messages by reason; those from before the run are none of it.
fn refused(inlet: &Inlet) -> String {
    let counts = inlet.refused.read().into_iter();
    let counts = counts.filter(|(why, _)| !why.is_harmless());
    let counts: Vec<String> = counts
        .map(|(why, count)| format!("{count} {why}"))
        .collect();
    if counts.is_empty() {
        "0 refused".to_owned()
    } else {
        format!("refused: {}", counts.join(", "))
    }
}

/// The messages that its link lost or that were evicted unread, and the ages of those that were read.
fn read(topic: &TopicAccount) -> String {
    let mut text = match topic.lost {
        0 => String::new(),
        lost => format!(", {lost} by its link"),
    };
    text += &format!(", {} dropped", topic.dropped());
    let ages = topic.readers.iter().map(|read| &read.ages);
    let ages = ages.max_by_key(|ages| ages.count());
    let at = |share| Some(ms(ages?.quantile(share)?.as_secs_f64()));
    if let (Some(p50), Some(p99)) = (at(0.5), at(0.99)) {
        text += &format!(", age when read p50 {p50}, p99 {p99}");
    }
    text
}
