//! Names of ROS, and the publishers that it announces.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use ratelab::sync::lock;
use xxhash_rust::xxh3::xxh3_128;
use zenoh::sample::SampleKind;

use crate::{
    peers::Peers,
    sender::MessageSource,
    session::{self, low_word},
};

/// A type of message, with its hash: another hash is another topic, without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Type {
    name: &'static str,
    hash: &'static str,
}

/// `sensor_msgs/msg/JointState` of Jazzy and Kilted.
pub const JOINT_STATE: Type = Type {
    name: "sensor_msgs::msg::dds_::JointState_",
    hash: "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
};

/// `rosgraph_msgs/msg/Clock` of Jazzy and Kilted.
pub const CLOCK: Type = Type {
    name: "rosgraph_msgs::msg::dds_::Clock_",
    hash: "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
};

/// Reliable, volatile, keep the last message: the rest is as by default.
const QOS: &str = "::,1:,:,:,,";

/// Length of the identity of a publisher (bytes).
const GID: u8 = 16;

/// Returns the key of a topic in a domain.
pub fn key(domain: u32, topic: &str, of: Type) -> String {
    let topic = topic.trim_start_matches('/');
    format!("{domain}/{topic}/{}/{}", of.name, of.hash)
}

/// The kind of an endpoint that publishes, in its token.
pub const PUBLISHER: &str = "MP";

/// The kind of one that subscribes.
pub const SUBSCRIPTION: &str = "MS";

/// A node and its endpoints, as ROS sees them.
#[derive(Clone, Debug)]
pub struct Entity {
    /// The domain.
    pub domain: u32,
    /// The session's identity, as zenoh prints it.
    pub session: String,
    /// Number of the node in the session.
    pub number: u32,
    /// Name of the node.
    pub node: String,
}

impl Entity {
    /// Returns the token of the node.
    pub fn token(&self) -> String {
        self.entity_token(self.number, "NN", "")
    }

    /// Returns the token of endpoint `number` of the node.
    pub fn endpoint(&self, number: u32, kind: &str, topic: &str, of: Type) -> String {
        let topic = topic.replace('/', "%");
        let Type { name, hash } = of;
        self.entity_token(number, kind, &format!("/{topic}/{name}/{hash}/{QOS}"))
    }

    fn entity_token(&self, number: u32, kind: &str, rest: &str) -> String {
        let Self {
            domain,
            session,
            number: own,
            node,
        } = self;
        format!("@ros2_lv/{domain}/{session}/{own}/{number}/{kind}/%/%/{node}{rest}")
    }
}

/// A publisher, as its token has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublisherToken {
    /// The session's identity, as zenoh prints it.
    pub session: String,
    /// The [`key`] of its topic.
    pub key: String,
}

impl PublisherToken {
    /// Reads a token; `None` for one of anything else.
    pub fn parse(token: &str) -> Option<Self> {
        let parts: Vec<&str> = token.split('/').collect();
        let ["@ros2_lv", domain, session, _, _, PUBLISHER, ref of @ ..] = parts[..] else {
            return None;
        };
        let [_, _, _, topic, name, hash, _] = of else {
            return None;
        };
        let topic = topic.trim_start_matches('%').replace('%', "/");
        Some(Self {
            session: session.to_owned(),
            key: format!("{domain}/{topic}/{name}/{hash}"),
        })
    }
}

/// What accompanies each message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Number of the message at its publisher, from one.
    pub seq: i64,
    /// When it was published (ns since 1970), by the publisher's system clock.
    pub stamp: i64,
    /// Identity of the publisher.
    pub gid: [u8; GID as usize],
}

impl Attachment {
    /// Returns the identity of the publisher with this `token`.
    pub fn gid(token: &str) -> [u8; GID as usize] {
        xxh3_128(token.as_bytes()).to_le_bytes()
    }

    /// Returns its bytes.
    pub fn encode(&self) -> Vec<u8> {
        let numbers = [self.seq, self.stamp].map(i64::to_le_bytes).concat();
        [&numbers[..], &[GID], &self.gid].concat()
    }

    /// Reads it from `bytes` of anybody; `None` if they are none.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (seq, rest) = bytes.split_first_chunk()?;
        let (stamp, rest) = rest.split_first_chunk()?;
        let gid = rest.strip_prefix(&[GID])?;
        Some(Self {
            seq: i64::from_le_bytes(*seq),
            stamp: i64::from_le_bytes(*stamp),
            gid: gid.try_into().ok()?,
        })
    }
}

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

    /// Returns the publisher with this identity, as the sender of a message.
    pub(crate) fn source(&self, gid: [u8; 16]) -> MessageSource {
        let known = lock(&self.known);
        let session = known.get(&gid).map(|publisher| publisher.session.parse());
        MessageSource {
            number: low_word(gid),
            process: session.and_then(Result::ok).map(session::number),
        }
    }

    /// Returns whether a ROS node publishes to the topic with this `key`.
    pub(crate) fn publish_to(&self, key: &str) -> bool {
        let ours = self.peers.sessions();
        let known = lock(&self.known);
        known
            .values()
            .any(|known| known.key == key && !ours.contains(&known.session))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_rmw_zenoh() {
        assert_eq!(
            key(7, "/obs", JOINT_STATE),
            "7/obs/sensor_msgs::msg::dds_::JointState_/RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
        );
        assert_eq!(
            key(0, "/robot/clock", CLOCK).split('/').nth(2),
            Some("clock")
        );
        let sensor = Entity {
            domain: 0,
            session: "ab12".to_owned(),
            number: 1,
            node: "sensor".to_owned(),
        };
        assert_eq!(sensor.token(), "@ros2_lv/0/ab12/1/1/NN/%/%/sensor");
        assert_eq!(
            sensor.endpoint(2, PUBLISHER, "/obs", JOINT_STATE),
            "@ros2_lv/0/ab12/1/2/MP/%/%/sensor/%obs/sensor_msgs::msg::dds_::JointState_/RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e/::,1:,:,:,,"
        );
    }

    #[test]
    fn attachments_are_thirty_three_bytes() {
        let attachment = Attachment {
            seq: 1,
            stamp: 2,
            gid: Attachment::gid("@ros2_lv/0/ab12/1/2/MP"),
        };
        let bytes = attachment.encode();
        assert_eq!(bytes.len(), 33);
        assert_eq!(Attachment::decode(&bytes), Some(attachment));
        assert_eq!(
            bytes[..17],
            [1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 16]
        );
        for length in 0..bytes.len() {
            assert_eq!(Attachment::decode(&bytes[..length]), None);
        }
        let mut other = bytes;
        other[16] = 15;
        assert_eq!(Attachment::decode(&other), None);
    }
}
