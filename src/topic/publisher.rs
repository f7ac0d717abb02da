//! The end of a topic that a node publishes to.

use super::{
    message::{Payload, SourceRank},
    outbox::Outbox,
    queue::{Bus, Publication},
};
use crate::{record::Derived, sync::Arc, time::Time};

/// The end of a topic that a node publishes to, with [`Tick::publish`](crate::Tick::publish).
#[derive(Debug)]
pub struct Publisher<T> {
    pub(super) bus: Arc<Bus<T>>,
}

impl<T: Payload> Publisher<T> {
    /// Publishes a message at run time `now` with another `stamp` and the run time of the sensing
    /// behind it: one that arrives from another process, where it was published then. Returns its
    /// sequence number.
    pub fn forward(&self, data: T, now: Time, stamp: Time, origin: Option<Time>) -> u64 {
        self.send_now(
            data,
            Publication {
                at: now,
                stamp,
                origin,
                source: SourceRank::UNKNOWN,
                by: None,
                from: Derived::Reads,
            },
        )
    }

    /// Publishes a message; returns its sequence number.
    #[inline]
    pub(crate) fn send_now(&self, data: T, publication: Publication) -> u64 {
        self.bus.lock().publish(data, publication)
    }

    /// Publishes a message through the outbox, needed by few nodes.
    #[cold]
    pub(crate) fn send_through(&self, outbox: &Outbox, data: T, publication: Publication) {
        let (bus, began) = (self.bus.clone(), outbox.shows(publication.at));
        let publish = move |at, stamp| {
            let sensed = (stamp != began).then_some(began);
            let publication = Publication {
                at,
                stamp,
                origin: publication.origin.or(sensed),
                ..publication
            };
            bus.lock().publish(data, publication);
        };
        outbox.put(publication.at, Box::new(publish));
    }
}
