//! The traffic of a process with others, as lines of a report.

use std::time::Duration;

use ratelab_account::{Observer, TopicAccount};
use ratelab_wire::{Bridge, Inlet};

use crate::report::line;

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
    match counts.as_slice() {
        [] => "0 refused".to_owned(),
        some => format!("refused: {}", some.join(", ")),
    }
}

/// The messages that its link lost or that were evicted unread, and the ages of those that were read.
fn read(topic: &TopicAccount) -> String {
    let ages = topic.readers.iter().map(|read| &read.ages);
    let ages = ages.max_by_key(|ages| ages.count());
    let ms = |share| {
        let age: Option<Duration> = ages.and_then(|ages| ages.quantile(share));
        age.map(|age| age.as_secs_f64() * 1e3)
    };
    let link = match topic.lost {
        0 => String::new(),
        lost => format!(", {lost} by its link"),
    };
    let dropped = topic.dropped();
    match ms(0.5).zip(ms(0.99)) {
        Some((p50, p99)) => {
            format!("{link}, {dropped} dropped, age when read p50 {p50:.1} ms, p99 {p99:.1} ms")
        }
        None => format!("{link}, {dropped} dropped"),
    }
}
