//! The end of a topic that a node publishes to.

use super::{
    message::Payload,
    outbox::Outbox,
    queue::{Bus, Publication},
};
use crate::{record::MessageId, sync::Arc, time::Time};

/// The end of a topic that a node publishes to.
///
/// ```
/// use ratelab::{Depth, Time, Topic};
///
/// let (obs, action) = (Topic::new("/obs", Depth::ONE), Topic::new("/action", Depth::ONE));
/// let (sensed, decided) = (Time::from_nanos(10), Time::from_nanos(30));
/// obs.publisher().publish(0.02, sensed, None);
///
/// // The origin of an action is the time of the reading behind it.
/// let reading = obs.subscribe().latest(decided).expect("published");
/// action.publisher().publish(-5.0 * reading.data, decided, Some(reading.sensed()));
/// assert_eq!(action.subscribe().latest(decided).expect("published").origin, Some(sensed));
/// ```
#[derive(Debug)]
pub struct Publisher<T> {
    pub(super) bus: Arc<Bus<T>>,
    pub(super) outbox: Option<Arc<Outbox>>,
}

impl<T: Payload> Publisher<T> {
    /// Publishes `data` at run time `now`, the stamp of the message. `origin` is the run time of the
    /// sensing that `data` was derived from, if any; see [`Message::sensed`](crate::Message::sensed).
    ///
    /// Never waits for a subscription: a full buffer evicts its oldest message. In a tick that
    /// takes time the message waits for the end of the tick, and is stamped then; without another
    /// origin it has the begin of the tick.
    pub fn publish(&self, data: T, now: Time, origin: Option<Time>) {
        self.publish_from(data, now, origin, None);
    }

    /// Publishes `data` as [`publish`](Self::publish) does, derived `from` this one message of all
    /// that the node has read. Without one it is derived from all that this tick has read.
    pub fn publish_from(&self, data: T, now: Time, origin: Option<Time>, from: Option<MessageId>) {
        let publication = Publication {
            from,
            ..self.publication(now, now, origin)
        };
        match &self.outbox {
            Some(outbox) if outbox.is_needed() => self.put(outbox, data, publication),
            _ => {
                self.bus.lock().publish(data, publication);
            }
        }
    }

    /// What the clock that the node stamps by shows at run time `now`.
    pub fn shows(&self, now: Time) -> Time {
        let outbox = self.outbox.as_ref().filter(|outbox| outbox.is_needed());
        outbox.map_or(now, |outbox| outbox.shows(now))
    }

    /// Publishes a message at run time `now` with another `stamp`, whatever the tick takes: one that
    /// arrives from another process, where it was published then. Returns its sequence number.
    pub fn forward(&self, data: T, now: Time, stamp: Time, origin: Option<Time>) -> u64 {
        let publication = self.publication(now, stamp, origin);
        self.bus.lock().publish(data, publication)
    }

    fn publication(&self, at: Time, stamp: Time, origin: Option<Time>) -> Publication {
        Publication {
            at,
            stamp,
            origin,
            by: self.outbox.as_ref().map(|outbox| outbox.tick()),
            from: None,
        }
    }

    /// Publishes through the outbox, needed by few nodes.
    #[cold]
    fn put(&self, outbox: &Outbox, data: T, publication: Publication) {
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
