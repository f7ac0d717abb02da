//! The publishers of ROS nodes, by their presence.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use zenoh::sample::SampleKind;

use super::name::{Attachment, PublisherToken};
use crate::{peers::Peers, sender::MessageSource, session};

/// The most publishers that are known at a time.
const MOST: usize = 4096;

/// The publishers that are there, by their identities.
pub(crate) struct Publishers {
    peers: Arc<Peers>,
    known: Mutex<BTreeMap<[u8; 16], PublisherToken>>,
}

impl Publishers {
    /// Nobody yet. The processes of ratelab are among `peers`.
    pub(crate) fn new(peers: &Arc<Peers>) -> Arc<Self> {
        let peers = peers.clone();
        let known = Mutex::default();
        Arc::new(Self { peers, known })
    }

    /// Notes a publisher that is there or gone; returns its identity.
    pub(crate) fn note(&self, token: &str, kind: SampleKind) -> [u8; 16] {
        let gid = Attachment::gid(token);
        let mut known = self.known();
        match (kind, PublisherToken::parse(token)) {
            (SampleKind::Delete, _) => drop(known.remove(&gid)),
            (SampleKind::Put, Some(publisher)) if known.len() < MOST => {
                known.insert(gid, publisher);
            }
            (SampleKind::Put, _) => {}
        }
        gid
    }

    /// The publisher with this identity, as the sender of a message.
    pub(crate) fn source(&self, gid: [u8; 16]) -> MessageSource {
        let known = self.known();
        let session = known.get(&gid).map(|publisher| publisher.session.parse());
        let process = session.and_then(Result::ok).map(session::number);
        let number = number(gid);
        MessageSource { number, process }
    }

    /// Whether a ROS node publishes to the topic with this `key`.
    pub(crate) fn publish_to(&self, key: &str) -> bool {
        let ours = self.peers.sessions();
        let known = self.known();
        let mut publishers = known.values();
        publishers.any(|known| known.key == key && !ours.contains(&known.session))
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<[u8; 16], PublisherToken>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The number of a publisher, by its identity.
pub(crate) fn number(gid: [u8; 16]) -> u64 {
    let [number @ .., _, _, _, _, _, _, _, _] = gid;
    u64::from_le_bytes(number)
}
