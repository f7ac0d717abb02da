//! A topic with a reader in another process.

use std::{sync::Arc, thread};

use ratelab_account::RowTap;
use zenoh::{
    Session, Wait,
    pubsub::Publisher,
    qos::{CongestionControl, Priority},
};

use crate::{
    error::WireError,
    origins::Origins,
    packet::{self, PacketHead},
    times::Times,
};

/// Messages that may wait to be sent; more are lost, and counted by their reader.
pub const BACKLOG: usize = 64;

/// Sends every message of a tapped topic, on a thread of its own: a node never waits for
/// the network.
pub(crate) struct Outlet {
    pub(crate) tap: RowTap,
    pub(crate) publisher: Publisher<'static>,
    pub(crate) incarnation: u64,
    pub(crate) times: Arc<Times>,
    pub(crate) origins: Arc<Origins>,
}

/// A publisher on `key` that drops messages where the network is too slow: the next one is
/// newer.
pub(crate) fn publisher(session: &Session, key: String) -> Result<Publisher<'static>, WireError> {
    let what = format!("cannot publish to {key}");
    session
        .declare_publisher(key)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::RealTime)
        .wait()
        .map_err(|why| WireError::network(&what, &why))
}

impl Outlet {
    /// Sends until the topic is gone.
    pub(crate) fn begin(self, topic: &str) -> Result<(), WireError> {
        let thread = thread::Builder::new().name(format!("out {topic}"));
        let begun = thread.spawn(move || self.run());
        begun.map_or_else(
            |why| Err(WireError::network("cannot start a thread", &why)),
            |_| Ok(()),
        )
    }

    fn run(self) {
        let mut rows = self.tap.rows();
        while self.tap.wait(&mut rows) {
            for (head, row) in rows.iter() {
                let Some(stamp) = self.times.moment(head.stamp) else {
                    continue;
                };
                let origin = head.origin.and_then(|sensed| {
                    let original = self.origins.original(sensed);
                    original.or_else(|| self.times.moment(sensed))
                });
                let head = PacketHead {
                    incarnation: self.incarnation,
                    seq: head.seq,
                    stamp,
                    origin,
                };
                // A message that cannot be sent is lost, as its reader will see.
                let _ = self.publisher.put(packet::encode(&head, row)).wait();
            }
            rows.clear();
        }
    }
}
