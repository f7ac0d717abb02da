//! ROS 2: the topics of a process as its nodes see them, by the conventions of rmw_zenoh.
//!
//! Joint states of the topics that the system names, and `/clock`. An action from a ROS node
//! passes the same checks as one from a process of our own.

mod cdr;
mod name;
mod publishers;
mod stamps;

use std::{
    sync::{
        Arc,
        atomic::{AtomicI64, AtomicU32, Ordering},
    },
    thread,
};

use ratelab::{Head, Time};
use ratelab_account::RowTap;
use ratelab_study::system::{JointValues, Joints};
use zenoh::{
    Session, Wait,
    liveliness::LivelinessToken,
    pubsub::Publisher,
    qos::CongestionControl,
    sample::{Sample, SampleKind},
};

use self::{
    cdr::{JointState, Stamp, encode_clock},
    name::{Attachment, CLOCK, EndKind, Entity, JOINT_STATE, Type, key},
    publishers::Publishers,
    stamps::RosStamps,
};
use crate::{
    error::WireError, inlet::Inlet, peers::Peers, refusal::Refusal, sender::MessageSource,
    times::Times,
};

/// The side of a process that ROS sees.
pub(crate) struct Ros {
    session: Session,
    domain: u32,
    times: Arc<Times>,
    stamps: Arc<RosStamps>,
    publishers: Arc<Publishers>,
    /// The keys of the topics that are read here.
    read: Vec<String>,
    /// Whether ROS nodes subscribe to the topics that are published here.
    written: Vec<IsRead>,
    /// Number of the next node or endpoint.
    next: AtomicU32,
    tokens: Vec<LivelinessToken>,
}

/// Tells whether somebody subscribes.
type IsRead = Box<dyn Fn() -> bool + Send + Sync>;

/// A publisher with its presence.
struct Out {
    publisher: Publisher<'static>,
    gid: [u8; 16],
    seq: AtomicI64,
}

impl Out {
    fn put(&self, payload: Vec<u8>) {
        let attachment = Attachment {
            seq: self.seq.fetch_add(1, Ordering::Relaxed),
            stamp: stamps::system_now(),
            gid: self.gid,
        };
        let put = self.publisher.put(payload);
        let _ = put.attachment(attachment.encode()).wait();
    }
}

impl Ros {
    /// The side of a process in `domain`.
    pub(crate) fn new(
        session: &Session,
        domain: u32,
        times: Arc<Times>,
        peers: &Arc<Peers>,
    ) -> Self {
        Self {
            publishers: Publishers::new(peers),
            read: Vec::new(),
            written: Vec::new(),
            session: session.clone(),
            domain,
            times,
            stamps: Arc::default(),
            next: AtomicU32::new(0),
            tokens: Vec::new(),
        }
    }

    fn number(&self) -> u32 {
        self.next.fetch_add(1, Ordering::Relaxed)
    }

    fn entity(&self, node: &str) -> Entity {
        Entity {
            domain: self.domain,
            session: self.session.zid().to_string(),
            number: self.number(),
            node: node.to_owned(),
        }
    }

    fn declare(&mut self, token: &str) -> Result<(), WireError> {
        let declared = self.session.liveliness().declare_token(token).wait();
        let declared = declared.map_err(|why| WireError::network("cannot be present", &why))?;
        self.tokens.push(declared);
        Ok(())
    }

    /// A publisher of `node` on `topic`.
    fn out(&mut self, node: &Entity, topic: &str, of: Type) -> Result<Out, WireError> {
        let token = node.endpoint(self.number(), EndKind::Publisher, topic, of);
        self.declare(&token)?;
        let key = key(self.domain, topic, of);
        let what = format!("cannot publish to {key}");
        let publisher = self.session.declare_publisher(key);
        let publisher = publisher.congestion_control(CongestionControl::Drop).wait();
        Ok(Out {
            publisher: publisher.map_err(|why| WireError::network(&what, &why))?,
            gid: Attachment::gid(&token),
            seq: AtomicI64::new(1),
        })
    }

    /// Follows the publishers, and tells `inlets` of those that are gone.
    pub(crate) fn follow(&self, inlets: Arc<Vec<Arc<Inlet>>>) -> Result<(), WireError> {
        let all = format!("@ros2_lv/{}/*/*/*/MP/**", self.domain);
        let (liveliness, publishers) = (self.session.liveliness(), self.publishers.clone());
        let followed = liveliness.declare_subscriber(all).history(true);
        let followed = followed.callback(move |sample| {
            let gid = publishers.note(sample.key_expr().as_str(), sample.kind());
            if sample.kind() == SampleKind::Delete {
                let gone = publishers::number(gid);
                inlets.iter().for_each(|inlet| inlet.sender().gone(gone));
            }
        });
        let followed = followed.background().wait();
        followed.map_err(|why| WireError::network("cannot watch for ROS nodes", &why))
    }

    /// Whether ROS nodes take the place of the others: they publish to all topics that are
    /// read here, and read one that is published here. One that only looks on does not.
    pub(crate) fn has_others(&self) -> bool {
        let mut read = self.read.iter();
        let acts = !self.read.is_empty() && read.all(|key| self.publishers.publish_to(key));
        acts && self.written.iter().any(|is_read| is_read())
    }

    /// Publishes the messages of `node` on a topic as joint states, and the run time of each
    /// as `/clock`.
    pub(crate) fn publish(
        &mut self,
        node: &str,
        joints: &Joints,
        tap: RowTap,
    ) -> Result<(), WireError> {
        let entity = self.entity(node);
        self.declare(&entity.token())?;
        let states = Arc::new(self.out(&entity, joints.topic, JOINT_STATE)?);
        let clock = self.out(&entity, "/clock", CLOCK)?;
        let (joints, times, stamps) = (*joints, self.times.clone(), self.stamps.clone());
        let out = states.clone();
        let name = format!("ros {}", joints.topic);
        let begun = thread::Builder::new().name(name).spawn(move || {
            let mut rows = tap.rows();
            while tap.wait(&mut rows) {
                for (head, row) in rows.iter() {
                    let run = i64::try_from(head.at.as_nanos()).unwrap_or(i64::MAX);
                    clock.put(encode_clock(Stamp::from_nanos(run)));
                    if let Some(message) = joint_state(&joints, head, row, &times, &stamps) {
                        out.put(message.encode());
                    }
                }
                rows.clear();
            }
        });
        begun.map_err(|why| WireError::network("cannot start a thread", &why))?;
        self.written.push(Box::new(move || {
            let status = states.publisher.matching_status().wait();
            status.is_ok_and(|status| status.matching())
        }));
        Ok(())
    }

    /// Takes joint states for `node` as messages of a topic.
    pub(crate) fn subscribe(
        &mut self,
        node: &str,
        joints: &Joints,
        inlet: &Arc<Inlet>,
    ) -> Result<(), WireError> {
        let entity = self.entity(node);
        self.declare(&entity.token())?;
        let token = entity.endpoint(
            self.number(),
            EndKind::Subscription,
            joints.topic,
            JOINT_STATE,
        );
        self.declare(&token)?;
        let key = key(self.domain, joints.topic, JOINT_STATE);
        let what = format!("cannot subscribe to {key}");
        self.read.push(key.clone());
        let (joints, inlet, stamps) = (*joints, inlet.clone(), self.stamps.clone());
        let publishers = self.publishers.clone();
        let receive = move |sample: Sample| {
            let attachment = sample.attachment().map(|bytes| bytes.to_bytes());
            let taken = match attachment.and_then(|bytes| Attachment::decode(&bytes)) {
                Some(from) => {
                    let source = publishers.source(from.gid);
                    take(&joints, &inlet, &stamps, (source, from.seq), &sample)
                }
                None => Err(Refusal::Format),
            };
            if let Err(why) = taken {
                inlet.refused.count(why);
            }
        };
        let subscribed = self.session.declare_subscriber(key).callback(receive);
        let subscribed = subscribed.background().wait();
        subscribed.map_err(|why| WireError::network(&what, &why))
    }
}

/// A message as a joint state. Its stamp is the time of the sensing, by the system clock.
fn joint_state(
    joints: &Joints,
    head: &Head,
    row: &[f64],
    times: &Times,
    stamps: &RosStamps,
) -> Option<JointState> {
    let JointValues {
        position,
        velocity,
        effort,
    } = (joints.of_row)(row)?;
    let sensed = head.origin.unwrap_or(head.stamp);
    Some(JointState {
        stamp: stamps.stamp(sensed, times.moment(sensed)?),
        name: joints.names.iter().map(|&name| name.to_owned()).collect(),
        position,
        velocity,
        effort,
        ..JointState::default()
    })
}

/// Takes a joint state from anybody.
fn take(
    joints: &Joints,
    inlet: &Inlet,
    stamps: &RosStamps,
    (from, seq): (MessageSource, i64),
    sample: &Sample,
) -> Result<(), Refusal> {
    let payload = sample.payload().to_bytes();
    let message = JointState::decode(&payload).ok_or(Refusal::Format)?;
    let values = JointValues {
        position: message.position,
        velocity: message.velocity,
        effort: message.effort,
    };
    let row = (joints.to_row)(&values);
    let row = row.ok_or_else(|| match values.is_finite() {
        true => Refusal::Length,
        false => Refusal::NotFinite,
    })?;
    if row.iter().any(|number| !(*number as f32).is_finite()) {
        return Err(Refusal::NotFinite);
    }
    let seq = u64::try_from(seq).map_err(|_| Refusal::Format)?;
    // A stamp of ours is the time of a reading; any other is of an unknown clock.
    let origin: Option<Time> = stamps.sensed(message.stamp);
    let at = inlet.check_sender(from, seq)?;
    inlet.publish(&row, at, at, origin)
}
