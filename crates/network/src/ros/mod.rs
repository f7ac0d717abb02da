//! ROS 2: the topics of a process as its nodes see them, by the conventions of rmw_zenoh.
//!
//! Joint states of the topics that the system names, and `/clock`. An action from a ROS node
//! passes the same checks as one from a process of our own.

mod cdr;
mod name;

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicI64, Ordering},
    },
    time::{SystemTime, UNIX_EPOCH},
};

use ratelab::{ForwardedTimes, Time};
use ratelab_experiment::Taps;
use ratelab_metrics::RowTap;
use ratelab_system::Joints;
use zenoh::{Wait, liveliness::LivelinessToken, pubsub::Publisher, qos::Priority, sample::Sample};

use self::{
    cdr::{JointState, Stamp, encode_clock},
    name::{Attachment, CLOCK, Entity, JOINT_STATE, PUBLISHER, SUBSCRIPTION, Type, key},
};
use crate::{
    error::NetworkError,
    inlet::Inlet,
    machine::{self, ClockMoment},
    net,
    outlet::{self, BACKLOG},
    packet,
    part::LocalPart,
    sender::Refusal,
    times::Recent,
};
use name::Publishers;

/// The side of a process that ROS sees.
pub(crate) struct Ros {
    part: Arc<LocalPart>,
    domain: u32,
    stamps: Arc<Stamps>,
    publishers: Arc<Publishers>,
    /// The keys of the topics that are read here.
    read: Vec<String>,
    /// The publishers of the topics that are published here.
    written: Vec<Arc<Out>>,
    /// Number of the next node or endpoint.
    next: u32,
    tokens: Vec<LivelinessToken>,
}

/// The newest stamps that were given out. A stamp comes back in the header of an action, and
/// the system clock may be set at any moment: so it is looked up and not computed, and the age
/// of the reading stays exact.
type Stamps = Recent<Stamp, Time>;

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
            stamp: system_now(),
            gid: self.gid,
        };
        let put = self.publisher.put(payload);
        let _ = put.attachment(attachment.encode()).wait();
    }
}

impl Ros {
    /// Shows the nodes in `domain` the topics of `part` that cross its border as `joints`, and
    /// takes theirs.
    pub(crate) fn begin(
        domain: u32,
        part: &Arc<LocalPart>,
        taps: &Taps,
        joints: &[Joints],
    ) -> Result<Self, NetworkError> {
        let mut ros = Self {
            part: part.clone(),
            domain,
            stamps: Arc::default(),
            publishers: Arc::new(Publishers {
                peers: part.peers.clone(),
                known: Mutex::default(),
            }),
            read: Vec::new(),
            written: Vec::new(),
            next: 0,
            tokens: Vec::new(),
        };
        for joints in joints {
            ros.cross(joints, taps)?;
        }
        ros.follow()?;
        Ok(ros)
    }

    /// Begins to publish a topic, and to read it, as far as its nodes are here.
    fn cross(&mut self, joints: &Joints, taps: &Taps) -> Result<(), NetworkError> {
        let part = self.part.clone();
        let mut topics = part.own.topology.topics.iter();
        let Some(topic) = topics.find(|topic| topic.name == joints.topic) else {
            return Ok(());
        };
        if let Some(node) = part.own.senders(topic).first()
            && let Some(tap) = taps.rows(&topic.name, BACKLOG)
        {
            self.publish(&node.name, joints, tap)?;
        }
        let inlet = part.inlets.iter().find(|inlet| inlet.name == topic.name);
        let (readers, _) = part.own.split(&topic.readers);
        match (readers.first(), inlet) {
            (Some(node), Some(inlet)) => self.subscribe(&node.name, joints, inlet),
            _ => Ok(()),
        }
    }

    fn number(&mut self) -> u32 {
        self.next += 1;
        self.next - 1
    }

    /// Shows a node.
    fn entity(&mut self, node: &str) -> Result<Entity, NetworkError> {
        let entity = Entity {
            domain: self.domain,
            session: self.part.own.session.clone(),
            number: self.number(),
            node: node.to_owned(),
        };
        self.declare(&entity.token())?;
        Ok(entity)
    }

    fn declare(&mut self, token: &str) -> Result<(), NetworkError> {
        let declared = net::be_present(&self.part.peers.session, token)?;
        self.tokens.push(declared);
        Ok(())
    }

    /// Returns a publisher of `node` on `topic`.
    fn out(&mut self, node: &Entity, topic: &str, of: Type) -> Result<Arc<Out>, NetworkError> {
        let token = node.endpoint(self.number(), PUBLISHER, topic, of);
        self.declare(&token)?;
        let key = key(self.domain, topic, of);
        Ok(Arc::new(Out {
            publisher: net::publisher(&self.part.peers.session, key, Priority::DEFAULT)?,
            gid: Attachment::gid(&token),
            seq: AtomicI64::new(1),
        }))
    }

    /// Follows the publishers, and tells the inlets which ones are gone.
    fn follow(&self) -> Result<(), NetworkError> {
        let all = format!("@ros2_lv/{}/*/*/*/MP/**", self.domain);
        let (publishers, inlets) = (self.publishers.clone(), self.part.inlets.clone());
        let note = move |token: &str, kind| {
            if let Some(gone) = publishers.note(token, kind) {
                inlets.iter().for_each(|inlet| inlet.sender().gone(gone));
            }
        };
        net::watch(&self.part.peers.session, (&all, "ROS nodes"), note)
    }

    /// Returns whether ROS nodes take the place of the others: they publish to all topics that are
    /// read here, and read one that is published here. One that only looks on does not.
    pub(crate) fn has_others(&self) -> bool {
        let mut read = self.read.iter();
        let acts = !self.read.is_empty() && read.all(|key| self.publishers.publish_to(key));
        let mut written = self.written.iter();
        acts && written.any(|out| net::is_heard(&out.publisher))
    }

    /// Publishes the messages of `node` on a topic as joint states, and the run time of each
    /// as `/clock`.
    fn publish(&mut self, node: &str, joints: &Joints, tap: RowTap) -> Result<(), NetworkError> {
        let entity = self.entity(node)?;
        let states = self.out(&entity, joints.topic, JOINT_STATE)?;
        let clock = self.out(&entity, "/clock", CLOCK)?;
        self.written.push(states.clone());
        let (joints, stamps, part) = (*joints, self.stamps.clone(), self.part.clone());
        let (times, thread) = (part.times.clone(), format!("ros {}", joints.topic));
        outlet::for_each(tap, thread, move |head, row| {
            let run = i64::try_from(head.at.as_nanos()).unwrap_or(i64::MAX);
            clock.put(encode_clock(Stamp::from_nanos(run)));
            let sensed = head.origin.unwrap_or(head.stamp);
            if let Some(values) = (joints.of_row)(row)
                && let Some(moment) = times.moment(sensed)
            {
                let message = JointState {
                    stamp: stamp(&stamps, sensed, moment),
                    frame_id: String::new(),
                    name: joints.names.iter().map(|&name| name.to_owned()).collect(),
                    values,
                };
                states.put(message.encode());
            }
        })
    }

    /// Takes joint states for `node` as messages of a topic.
    fn subscribe(
        &mut self,
        node: &str,
        joints: &Joints,
        inlet: &Arc<Inlet>,
    ) -> Result<(), NetworkError> {
        let entity = self.entity(node)?;
        let token = entity.endpoint(self.number(), SUBSCRIPTION, joints.topic, JOINT_STATE);
        self.declare(&token)?;
        let key = key(self.domain, joints.topic, JOINT_STATE);
        self.read.push(key.clone());
        let (joints, stamps) = (*joints, self.stamps.clone());
        let publishers = self.publishers.clone();
        inlet.begin(&self.part.peers.session, &key, move |inlet, sample| {
            let from = sample
                .attachment()
                .map(|bytes| bytes.to_bytes())
                .and_then(|bytes| Attachment::decode(&bytes))
                .ok_or(Refusal::Format)?;
            let (row, stamp) = read(&joints, sample)?;
            let seq = u64::try_from(from.seq).map_err(|_| Refusal::Format)?;
            // A stamp of ours is the time of a reading; any other is of an unknown clock.
            let origin = stamps.find(|known, _| *known == stamp);
            let at = inlet.check_sender(publishers.source(from.gid), seq)?;
            let times = ForwardedTimes {
                at,
                stamp: at,
                origin: origin.map(|(_, sensed)| sensed),
            };
            inlet.publish(&row, times).map(drop)
        })
    }
}

/// Returns the numbers and the stamp of a joint state from anybody.
fn read(joints: &Joints, sample: &Sample) -> Result<(Vec<f64>, Stamp), Refusal> {
    let payload = sample.payload().to_bytes();
    let message = JointState::decode(&payload).ok_or(Refusal::Format)?;
    let values = message.values;
    let row = (joints.to_row)(&values).ok_or_else(|| {
        if values.is_finite() {
            Refusal::Length
        } else {
            Refusal::NotFinite
        }
    })?;
    if packet::are_finite(&row) {
        Ok((row, message.stamp))
    } else {
        Err(Refusal::NotFinite)
    }
}

/// Returns the stamp of run time `sensed`, which is `moment` of our clock.
fn stamp(stamps: &Stamps, sensed: Time, moment: ClockMoment) -> Stamp {
    let known = stamps.find(|_, time| *time == sensed);
    known.map_or_else(
        || {
            let ago = machine::now().saturating_sub(moment.at);
            let stamp = Stamp::from_nanos(system_now().saturating_sub(ago));
            stamps.keep(stamp, sensed);
            stamp
        },
        |(stamp, _)| stamp,
    )
}

/// Returns the system clock (ns since 1970).
fn system_now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanos = since.unwrap_or_default().as_nanos();
    i64::try_from(nanos).unwrap_or(i64::MAX)
}
