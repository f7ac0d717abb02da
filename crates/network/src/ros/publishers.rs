//! The publishers of ROS nodes, by their presence.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use ratelab::sync::lock;
use zenoh::sample::SampleKind;

use super::name::{Attachment, PublisherToken};
use crate::{
    peers::Peers,
    sender::MessageSource,
    session::{self, low_word},
};

/// The most publishers that are known at a time.
const MOST: usize = 4096;

/// The publishers that are there, by their identities. The processes of ratelab are among the
/// peers.
pub(crate) struct Publishers {
    pub(crate) peers: Arc<Peers>,
    pub(crate) known: Mutex<BTreeMap<[u8; 16], PublisherToken>>,
}

impl Publishers {
    /// Notes a publisher that is there or gone; returns the number of one that is gone.
    pub(crate) fn note(&self, token: &str, kind: SampleKind) -> Option<u64> {
        let gid = Attachment::gid(token);
        let mut known = lock(&self.known);
        if kind == SampleKind::Delete {
            known.remove(&gid);
            return Some(low_word(gid));
        }
        if let Some(publisher) = PublisherToken::parse(token)
            && known.len() < MOST
        {
            known.insert(gid, publisher);
        }
        None
    }

    /// The publisher with this identity, as the sender of a message.
    pub(crate) fn source(&self, gid: [u8; 16]) -> MessageSource {
        let known = lock(&self.known);
        let session = known.get(&gid).map(|publisher| publisher.session.parse());
        MessageSource {
            number: low_word(gid),
            process: session.and_then(Result::ok).map(session::number),
        }
    }

    /// Whether a ROS node publishes to the topic with this `key`.
    pub(crate) fn publish_to(&self, key: &str) -> bool {
        let ours = self.peers.sessions();
        let known = lock(&self.known);
        let mut publishers = known.values();
        publishers.any(|known| known.key == key && !ours.contains(&known.session))
    }
}
