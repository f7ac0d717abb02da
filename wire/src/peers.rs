//! The other processes of a run: who is there, what they run, how their clocks are.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::Duration,
};

use serde::de::DeserializeOwned;
use zenoh::{
    Session, Wait,
    query::{ConsolidationMode, Query},
    sample::SampleKind,
};

use crate::{
    clock::{self, ClockId},
    key::{Keys, Of},
    offset::{Offsets, RoundTrip},
    session::WireError,
    telemetry::Info,
};

/// Time between two round trips to another clock.
const PAUSE: Duration = Duration::from_millis(250);

/// The same while somebody has not answered yet.
const SHORT: Duration = Duration::from_millis(20);

/// Longest wait for a reply.
const PATIENCE: Duration = Duration::from_secs(1);

/// The most processes that are known at a time.
const MOST: usize = 64;

/// Called with the number of a process that is gone.
pub type WhenGone = Box<dyn Fn(u64) + Send + Sync>;

/// The other processes.
pub struct Peers {
    session: Session,
    keys: Keys,
    /// Our own number.
    own: u64,
    known: Mutex<BTreeMap<u64, Option<Info>>>,
    gone: WhenGone,
}

impl Peers {
    /// Follows the processes that have a presence, from now on.
    ///
    /// # Errors
    /// [`WireError`] if the connection fails.
    pub fn follow(
        session: &Session,
        keys: &Keys,
        own: u64,
        gone: WhenGone,
    ) -> Result<Arc<Self>, WireError> {
        let peers = Arc::new(Self {
            session: session.clone(),
            keys: keys.clone(),
            own,
            known: Mutex::default(),
            gone,
        });
        let follower = Arc::downgrade(&peers);
        let liveliness = session.liveliness();
        let watched = liveliness.declare_subscriber(keys.processes());
        let watched = watched.history(true).callback(move |sample| {
            if let Some(peers) = follower.upgrade() {
                peers.note(sample.key_expr().as_str(), sample.kind());
            }
        });
        let begun = watched.background().wait();
        begun.map_err(|why| WireError::network("cannot watch for processes", &why))?;
        Ok(peers)
    }

    fn note(&self, key: &str, kind: SampleKind) {
        let Some(incarnation) = self.keys.incarnation(key).filter(|id| *id != self.own) else {
            return;
        };
        let mut known = self.known();
        match kind {
            SampleKind::Put if known.len() < MOST => {
                known.entry(incarnation).or_insert(None);
            }
            SampleKind::Put => {}
            SampleKind::Delete => {
                known.remove(&incarnation);
                drop(known);
                (self.gone)(incarnation);
            }
        }
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<u64, Option<Info>>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What runs in each process that has answered.
    pub fn infos(&self) -> Vec<Info> {
        self.known().values().flatten().cloned().collect()
    }

    /// Asks new processes what runs in them, and all other clocks for the time; to be
    /// called again and again.
    pub fn ask(&self, offsets: &Offsets) {
        let known: Vec<(u64, bool)> = self
            .known()
            .iter()
            .map(|(incarnation, info)| (*incarnation, info.is_some()))
            .collect();
        for (incarnation, is_known) in known {
            if !is_known && let Some(info) = self.get::<Info>(incarnation, Of::Info) {
                let mut known = self.known();
                if let Some(entry) = known.get_mut(&incarnation) {
                    *entry = Some(info);
                }
            }
            self.ask_clock(incarnation, offsets);
        }
    }

    /// Asks the process for its clock, unless it is ours.
    fn ask_clock(&self, incarnation: u64, offsets: &Offsets) {
        let known = self
            .known()
            .get(&incarnation)
            .and_then(Option::as_ref)
            .map(|info| info.clock);
        if known == Some(ClockId::here()) {
            return;
        }
        let left = clock::now();
        let Some(reply) = self.ask_bytes(incarnation, Of::Clock, Vec::new()) else {
            return;
        };
        let returned = clock::now();
        if let Some((clock, arrived, answered)) = read_clock(&reply)
            && clock != ClockId::here()
        {
            let trip = RoundTrip {
                left,
                arrived,
                answered,
                returned,
            };
            offsets.add(clock, trip);
        }
    }

    /// The answer of a process.
    pub fn get<T: DeserializeOwned>(&self, incarnation: u64, of: Of) -> Option<T> {
        let reply = self.ask_bytes(incarnation, of, Vec::new())?;
        serde_json::from_slice(&reply).ok()
    }

    /// The bytes of the answer of a process to `question`; `None` if it does not answer.
    pub fn ask_bytes(&self, incarnation: u64, of: Of, question: Vec<u8>) -> Option<Vec<u8>> {
        let key = self.keys.of(incarnation, of);
        let replies = self
            .session
            .get(key)
            .payload(question)
            .timeout(PATIENCE)
            .consolidation(ConsolidationMode::None)
            .wait()
            .ok()?;
        let reply = replies.recv().ok()?;
        let sample = reply.into_result().ok()?;
        Some(sample.payload().to_bytes().into_owned())
    }

    /// Asks for as long as anybody else has these peers.
    pub fn ask_forever(self: &Arc<Self>, offsets: &Arc<Offsets>) -> Result<(), WireError> {
        let (peers, offsets) = (Arc::downgrade(self), offsets.clone());
        let thread = thread::Builder::new().name("peers".to_owned());
        let begun = thread.spawn(move || {
            while let Some(peers) = peers.upgrade() {
                if peers.session.is_closed() {
                    return;
                }
                peers.ask(&offsets);
                let known = peers.known();
                let waiting = known.is_empty() || known.values().any(Option::is_none);
                drop(known);
                drop(peers);
                thread::sleep(if waiting { SHORT } else { PAUSE });
            }
        });
        let begun = begun.map(drop);
        begun.map_err(|why| WireError::network("cannot start a thread", &why))
    }
}

/// Answers a query for our clock.
pub(crate) fn answer_clock(query: &Query) {
    let arrived = clock::now();
    let mut reply = ClockId::here().0.to_le_bytes().to_vec();
    reply.extend(arrived.to_le_bytes());
    reply.extend(clock::now().to_le_bytes());
    answer(query, reply);
}

/// Sends `reply`; nobody may wait for it any more.
pub(crate) fn answer(query: &Query, reply: Vec<u8>) {
    let _ = query.reply(query.key_expr().clone(), reply).wait();
}

/// Declares that queries for `key` are answered by `reply`.
pub(crate) fn answers(
    session: &Session,
    key: &str,
    reply: impl Fn(Query) + Send + Sync + 'static,
) -> Result<(), WireError> {
    let declared = session.declare_queryable(key).callback(reply);
    let declared = declared.background().wait();
    declared.map_err(|why| WireError::network(&format!("cannot answer on {key}"), &why))
}

fn read_clock(reply: &[u8]) -> Option<(ClockId, i64, i64)> {
    let words: [[u8; 8]; 3] = [
        reply.get(..8)?.try_into().ok()?,
        reply.get(8..16)?.try_into().ok()?,
        reply.get(16..24)?.try_into().ok()?,
    ];
    let [clock, arrived, answered] = words;
    Some((
        ClockId(u64::from_le_bytes(clock)),
        i64::from_le_bytes(arrived),
        i64::from_le_bytes(answered),
    ))
}
