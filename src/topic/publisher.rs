//! The end of a topic that a node publishes to.

use super::{
    message::{Payload, SourceRank},
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
        self.send(
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
    pub(crate) fn send(&self, data: T, publication: Publication) -> u64 {
        self.bus.lock().publish(data, publication)
    }

    /// Returns a message to be sent later, at a run time and with a stamp.
    pub(crate) fn held(
        &self,
        data: T,
        publication: Publication,
    ) -> impl FnOnce(Time, Time) + Send + use<T> {
        let bus = self.bus.clone();
        let began = publication.stamp;
        move |at, stamp| {
            let sensed = (stamp != began).then_some(began);
            let publication = Publication {
                at,
                stamp,
                origin: publication.origin.or(sensed),
                ..publication
            };
            bus.lock().publish(data, publication);
        }
    }
}
