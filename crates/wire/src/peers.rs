//! The other processes of a run: who is there, what they run, how their clocks are.

use std::{
    cell::RefCell,
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use zenoh::{
    Session, Wait,
    query::{ConsolidationMode, Query, QueryTarget},
    sample::{Sample, SampleKind},
};

use crate::{
    clock::{self, ClockId},
    error::WireError,
    key::{Keys, Of},
    offset::{Offsets, RoundTrip},
    telemetry::Info,
};

/// Time between two round trips to another clock.
const PAUSE: Duration = Duration::from_millis(250);

/// The same while somebody has not answered yet.
const SHORT: Duration = Duration::from_millis(20);

/// The most rounds of that kind: a presence without a process behind it never answers.
const EAGER: u32 = 100;

/// Longest wait for a reply.
const PATIENCE: Duration = Duration::from_secs(1);

/// The most processes that take part at a time.
const MOST: usize = 64;

/// The most presences that are known at a time. Most of so many are of nobody: whoever may
/// connect can claim any number, which must not keep a process out that answers.
const MOST_PRESENCES: usize = 4096;

/// Called with the number of a process that is gone.
pub type WhenGone = Box<dyn Fn(u64) + Send + Sync>;

/// The other processes.
pub struct Peers {
    session: Session,
    keys: Keys,
    /// Our own number, and our nodes.
    own: u64,
    pub(crate) nodes: Vec<String>,
    known: Mutex<BTreeMap<u64, Option<Info>>>,
    /// Whether there were more than can be known.
    overflowed: AtomicBool,
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
        nodes: &[String],
        gone: WhenGone,
    ) -> Result<Arc<Self>, WireError> {
        let peers = Arc::new(Self {
            session: session.clone(),
            keys: keys.clone(),
            own,
            nodes: nodes.to_vec(),
            known: Mutex::default(),
            overflowed: AtomicBool::new(false),
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
            SampleKind::Put if known.len() < MOST_PRESENCES => {
                known.entry(incarnation).or_insert(None);
            }
            SampleKind::Put => self.overflowed.store(true, Ordering::Relaxed),
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

    /// The identities of the sessions of the processes that have answered, as zenoh prints
    /// them, and our own.
    pub fn sessions(&self) -> BTreeSet<String> {
        let others = self.infos().into_iter().map(|info| info.session);
        others.chain([self.session.zid().to_string()]).collect()
    }

    /// The processes that are present now.
    ///
    /// # Errors
    /// [`WireError`] if the connection fails.
    pub fn present(&self) -> Result<BTreeSet<u64>, WireError> {
        let found = self.session.liveliness().get(self.keys.processes());
        let found = found.timeout(PATIENCE).wait();
        let found = found.map_err(|why| WireError::network("cannot look for processes", &why))?;
        let found = found.iter().filter_map(|reply| reply.into_result().ok());
        let mut known = self.known();
        let present = found.filter_map(|sample| {
            let incarnation = self.keys.incarnation(sample.key_expr().as_str())?;
            (incarnation != self.own).then(|| {
                known.entry(incarnation).or_insert(None);
                incarnation
            })
        });
        Ok(present.take(MOST_PRESENCES).collect())
    }

    /// The processes whose part of the run has begun.
    pub fn running(&self) -> BTreeSet<u64> {
        let running = RefCell::new(BTreeSet::new());
        self.ask_all(Of::Info, |incarnation, reply| {
            let info = serde_json::from_slice::<Info>(reply).ok();
            if info.is_some_and(|info| info.zero.is_some()) {
                running.borrow_mut().insert(incarnation);
            }
        });
        running.into_inner()
    }

    /// The names of the other systems that have processes here.
    pub fn other_systems(&self) -> BTreeSet<String> {
        let found = self.session.liveliness().get(Keys::ALL).timeout(PATIENCE);
        let Ok(found) = found.wait() else {
            return BTreeSet::new();
        };
        let found = found.iter().filter_map(|reply| reply.into_result().ok());
        let names = found.filter_map(|sample| {
            let name = self.keys.other_system(sample.key_expr().as_str())?;
            Some(name.to_owned())
        });
        names.take(MOST).collect()
    }

    /// Asks all processes what runs in them, if one has not answered yet, and for the time, if
    /// one has another clock; to be called again and again.
    pub fn ask(&self, offsets: &Offsets) {
        let room = self.known().len() < MOST_PRESENCES;
        if room && self.overflowed.swap(false, Ordering::Relaxed) {
            // Those that came while there was no room.
            let _ = self.present();
        }
        if self.known().values().any(Option::is_none) {
            self.ask_all(Of::Info, |incarnation, reply| {
                if let Ok(info) = serde_json::from_slice::<Info>(reply) {
                    self.answered(incarnation, info);
                }
            });
        }
        let mut clocks = self.infos().into_iter().map(|info| info.clock);
        if clocks.any(|clock| clock != ClockId::here()) {
            self.ask_clocks(offsets);
        }
    }

    /// Notes what runs in a process.
    fn answered(&self, incarnation: u64, info: Info) {
        let mut known = self.known();
        let answered = known.values().flatten().count();
        if let Some(entry @ None) = known.get_mut(&incarnation)
            && answered < MOST
            && info.incarnation == incarnation
        {
            *entry = Some(info);
        }
    }

    fn ask_clocks(&self, offsets: &Offsets) {
        let left = clock::now();
        self.ask_all(Of::Clock, |incarnation, reply| {
            let returned = clock::now();
            let is_known = matches!(self.known().get(&incarnation), Some(Some(_)));
            if let Some((clock, arrived, answered)) = read_clock(reply)
                && is_known
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
        });
    }

    /// Asks all processes at once: one that does not answer keeps nobody waiting. Calls `take`
    /// for each answer as it comes.
    fn ask_all(&self, of: Of, take: impl Fn(u64, &[u8])) {
        let asked = self.session.get(self.keys.of_all(of));
        let asked = asked.target(QueryTarget::All).timeout(PATIENCE);
        let Ok(replies) = asked.consolidation(ConsolidationMode::None).wait() else {
            return;
        };
        let answers = replies.iter().filter_map(|reply| reply.into_result().ok());
        for answer in answers.take(MOST_PRESENCES) {
            if let Some(from) = self.keys.incarnation(answer.key_expr().as_str()) {
                take(from, &payload(&answer));
            }
        }
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
        Some(payload(&reply.into_result().ok()?))
    }

    /// Asks for as long as anybody else has these peers.
    pub fn ask_forever(self: &Arc<Self>, offsets: &Arc<Offsets>) -> Result<(), WireError> {
        let (peers, offsets) = (Arc::downgrade(self), offsets.clone());
        let thread = thread::Builder::new().name("peers".to_owned());
        let begun = thread.spawn(move || {
            let (mut before, mut rounds) = ((0, 0), 0);
            while let Some(peers) = peers.upgrade() {
                if peers.session.is_closed() {
                    return;
                }
                peers.ask(&offsets);
                let known = peers.known();
                let counts = (known.len(), known.values().flatten().count());
                drop(known);
                drop(peers);
                rounds = if counts == before { rounds + 1 } else { 0 };
                before = counts;
                let waiting = counts.0 == 0 || (counts.0 > counts.1 && rounds < EAGER);
                thread::sleep(if waiting { SHORT } else { PAUSE });
            }
        });
        let begun = begun.map(drop);
        begun.map_err(|why| WireError::network("cannot start a thread", &why))
    }
}

fn payload(sample: &Sample) -> Vec<u8> {
    sample.payload().to_bytes().into_owned()
}

/// Answers a query for our clock, which is at `key`.
pub(crate) fn answer_clock(query: &Query, key: &str) {
    let arrived = clock::now();
    let mut reply = ClockId::here().0.to_le_bytes().to_vec();
    reply.extend(arrived.to_le_bytes());
    reply.extend(clock::now().to_le_bytes());
    answer(query, key, reply);
}

/// Sends `reply` as that of `key`; nobody may wait for it any more.
pub(crate) fn answer(query: &Query, key: &str, reply: Vec<u8>) {
    let _ = query.reply(key.to_owned(), reply).wait();
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
