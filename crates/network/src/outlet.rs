//! A topic with a reader in another process.

use ratelab::Head;
use ratelab_metrics::{RecordedTopic, RowTap};
use ratelab_system::TopicChains;
use zenoh::{Wait, qos::Priority};

use crate::{
    error::{self, NetworkError},
    net,
    packet::{self, PacketHead, RunTimes},
    part::LocalPart,
};

/// Messages that may wait to be sent; more are lost, and counted by their reader.
pub(crate) const BACKLOG: usize = 64;

/// Calls `send` with each message of `tap`, on a thread of its own, until the topic is gone: a
/// node never waits for the network.
pub(crate) fn for_each(
    tap: RowTap,
    thread: String,
    send: impl Fn(&Head, &[f64]) + Send + 'static,
) -> Result<(), NetworkError> {
    let work = move || {
        let mut rows = tap.rows();
        while tap.wait(&mut rows) {
            rows.iter().for_each(|(head, row)| send(head, row));
            rows.clear();
        }
    };
    error::spawn(thread, work).map(drop)
}

/// Sends the messages of `tap` in our own format.
pub(crate) fn send(
    part: &LocalPart,
    key: String,
    topic: &dyn RecordedTopic,
    tap: RowTap,
    chains: TopicChains,
) -> Result<(), NetworkError> {
    let run_times = RunTimes::among(topic.fields(), chains.count());
    let publisher = net::publisher(&part.peers.session, key, Priority::RealTime)?;
    let (incarnation, times) = (part.own.incarnation, part.times.clone());
    for_each(tap, format!("out {}", topic.name()), move |head, row| {
        let Some(stamp) = times.moment(head.stamp) else {
            return;
        };
        let row = row.iter().copied().chain(chains.begun(head.seq));
        let row = run_times.sent(row.collect(), head.stamp);
        let head = PacketHead {
            incarnation,
            seq: head.seq,
            stamp,
            origin: head.origin.and_then(|sensed| times.origin(sensed)),
        };
        // A message that cannot be sent is lost, as its reader will see.
        let _ = publisher.put(packet::encode(&head, &row)).wait();
    })
}
