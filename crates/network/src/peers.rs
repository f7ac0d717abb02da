//! The other processes of a run: who is there, what they run, how their clocks are.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use ratelab::sync::lock;
use zenoh::{
    Session, Wait,
    query::{ConsolidationMode, QueryTarget},
    sample::{Sample, SampleKind},
};

use crate::{
    error::{self, Attempted, NetworkError},
    key::{Keys, Of},
    machine::{self, ClockId, Nanos},
    net,
    telemetry::{Answer, Info, Order},
    times::{Offsets, RoundTrip},
};

/// Time between two round trips to another clock.
const PAUSE: Duration = Duration::from_millis(250);

/// Time between two round trips while somebody has not answered yet.
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
pub(crate) type WhenGone = Box<dyn Fn(u64) + Send + Sync>;

/// The other processes.
pub(crate) struct Peers {
    pub(crate) session: Session,
    pub(crate) keys: Keys,
    /// Our own number.
    pub(crate) own: u64,
    pub(crate) offsets: Arc<Offsets>,
    known: Mutex<BTreeMap<u64, Option<Info>>>,
    /// Whether there were more than can be known.
    overflowed: AtomicBool,
    gone: WhenGone,
}

impl Peers {
    /// Follows the processes that have a presence, and their clocks, from now on and for as
    /// long as somebody has these peers.
    pub(crate) fn follow(
        session: &Session,
        keys: Keys,
        own: u64,
        offsets: &Arc<Offsets>,
        gone: WhenGone,
    ) -> Result<Arc<Self>, NetworkError> {
        let peers = Arc::new(Self {
            session: session.clone(),
            keys,
            own,
            offsets: offsets.clone(),
            known: Mutex::default(),
            overflowed: AtomicBool::new(false),
            gone,
        });
        let follower = Arc::downgrade(&peers);
        let watched = peers.keys.processes();
        net::watch(session, (&watched, "processes"), move |key, kind| {
            if let Some(peers) = follower.upgrade() {
                peers.note(key, kind);
            }
        })?;
        let asking = Arc::downgrade(&peers);
        error::spawn("peers", move || {
            let (mut before, mut rounds) = ((0, 0), 0);
            while let Some(peers) = asking.upgrade()
                && !peers.session.is_closed()
            {
                let counts = peers.ask();
                drop(peers);
                rounds = if counts == before { rounds + 1 } else { 0 };
                before = counts;
                let (present, answered) = counts;
                let waits = present == 0 || (present > answered && rounds < EAGER);
                thread::sleep(if waits { SHORT } else { PAUSE });
            }
        })?;
        Ok(peers)
    }

    fn note(&self, key: &str, kind: SampleKind) {
        let Some(incarnation) = self.other(key) else {
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
        lock(&self.known)
    }

    /// Returns the process that a key is of, unless it is this one.
    fn other(&self, key: &str) -> Option<u64> {
        self.keys.incarnation(key).filter(|id| *id != self.own)
    }

    /// Returns what runs in each process that has answered.
    pub(crate) fn infos(&self) -> Vec<Info> {
        self.known().values().flatten().cloned().collect()
    }

    /// Returns the one of them that is wanted.
    pub(crate) fn find(&self, wanted: impl Fn(&Info) -> bool) -> Option<Info> {
        let known = self.known();
        let mut infos = known.values().flatten();
        infos.find(|info| wanted(info)).cloned()
    }

    /// Returns the identities of the sessions of the processes that have answered, as zenoh prints
    /// them, and our own.
    pub(crate) fn sessions(&self) -> BTreeSet<String> {
        self.infos()
            .into_iter()
            .map(|info| info.session)
            .chain([self.session.zid().to_string()])
            .collect()
    }

    /// Returns the processes that are present now.
    pub(crate) fn present(&self) -> Result<BTreeSet<u64>, NetworkError> {
        let tokens = self.tokens(&self.keys.processes())?;
        let present: Vec<u64> = tokens
            .filter_map(|token| self.other(&token))
            .take(MOST_PRESENCES)
            .collect();
        let mut known = self.known();
        for incarnation in present {
            known.entry(incarnation).or_insert(None);
        }
        // Zenoh leaves out of its answer whoever it has told to `note` since it was asked.
        Ok(known.keys().copied().collect())
    }

    /// Returns the names of the other systems that have processes here.
    pub(crate) fn other_systems(&self) -> BTreeSet<String> {
        let tokens = self.tokens(Keys::ALL).into_iter().flatten();
        let names = tokens.filter_map(|token| Some(self.keys.other_system(&token)?.to_owned()));
        names.take(MOST).collect()
    }

    /// Returns the tokens under `keys` that are there now.
    fn tokens(&self, keys: &str) -> Result<impl Iterator<Item = String> + use<>, NetworkError> {
        Ok(self
            .session
            .liveliness()
            .get(keys)
            .timeout(PATIENCE)
            .wait()
            .tried("cannot look for processes")?
            .into_iter()
            .filter_map(|reply| reply.into_result().ok())
            .map(|sample| sample.key_expr().to_string()))
    }

    /// Returns the processes whose part of the run has begun.
    pub(crate) fn running(&self) -> BTreeSet<u64> {
        let infos = self.ask_infos();
        infos
            .filter(|(_, info)| info.zero.is_some())
            .map(|(incarnation, _)| incarnation)
            .collect()
    }

    /// Returns the run time zero of a process, by its clock; `None` before its run.
    pub(crate) fn zero_of(&self, incarnation: u64) -> Option<Nanos> {
        self.ask_infos()
            .filter(|(from, _)| *from == incarnation)
            .find_map(|(_, info)| info.zero)
    }

    /// Asks all processes what runs in them, if one has not answered yet, and for the time, if
    /// one has another clock. Returns how many are present, and how many have answered.
    fn ask(&self) -> (usize, usize) {
        let room = self.known().len() < MOST_PRESENCES;
        if room && self.overflowed.swap(false, Ordering::Relaxed) {
            // Those that came while there was no room.
            let _ = self.present();
        }
        if self.known().values().any(Option::is_none) {
            for (incarnation, info) in self.ask_infos() {
                self.answered(incarnation, info);
            }
        }
        if self.find(|info| info.clock != ClockId::here()).is_some() {
            self.ask_clocks();
        }
        let known = self.known();
        (known.len(), known.values().flatten().count())
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

    fn ask_infos(&self) -> impl Iterator<Item = (u64, Info)> {
        let answers = self.ask_all(Of::INFO);
        answers.filter_map(|(from, reply)| Some((from, serde_json::from_slice(&reply).ok()?)))
    }

    fn ask_clocks(&self) {
        let left = machine::now();
        for (incarnation, reply) in self.ask_all(Of::CLOCK) {
            let returned = machine::now();
            let is_known = matches!(self.known().get(&incarnation), Some(Some(_)));
            if let Some([clock, arrived, answered]) = read_clock(&reply)
                && is_known
                && ClockId(clock) != ClockId::here()
            {
                let trip = RoundTrip {
                    left,
                    arrived: arrived.cast_signed(),
                    answered: answered.cast_signed(),
                    returned,
                };
                self.offsets.add(ClockId(clock), trip);
            }
        }
    }

    /// Asks all processes at once: one that does not answer keeps nobody waiting. Returns the
    /// answers as they come.
    fn ask_all(&self, of: Of) -> impl Iterator<Item = (u64, Vec<u8>)> {
        let asked = self
            .session
            .get(self.keys.all_endpoints(of))
            .target(QueryTarget::All)
            .timeout(PATIENCE);
        let replies = asked
            .consolidation(ConsolidationMode::None)
            .wait()
            .into_iter()
            .flatten();
        replies
            .filter_map(|reply| reply.into_result().ok())
            .take(MOST_PRESENCES)
            .filter_map(|answer| {
                let from = self.keys.incarnation(answer.key_expr().as_str())?;
                Some((from, payload(&answer)))
            })
    }

    /// Gives a command to process `to`; `silent` is the reason if it does not answer.
    pub(crate) fn order(&self, to: u64, order: &Order, silent: &str) -> Answer {
        let order = serde_json::to_vec(order).map_err(|why| why.to_string())?;
        let asked = self
            .session
            .get(self.keys.endpoint(to, Of::COMMAND))
            .payload(order)
            .timeout(PATIENCE);
        let replies = asked.consolidation(ConsolidationMode::None).wait();
        let reply = replies.ok().and_then(|replies| replies.recv().ok());
        let reply = reply.and_then(|reply| reply.into_result().ok());
        let reply = payload(&reply.ok_or(silent)?);
        serde_json::from_slice(&reply).map_err(|why| format!("unknown answer: {why}"))?
    }
}

fn payload(sample: &Sample) -> Vec<u8> {
    sample.payload().to_bytes().into_owned()
}

/// Returns the answer to a query for our clock: which it is, when the query arrived, and now.
pub(crate) fn clock() -> Vec<u8> {
    let arrived = machine::now();
    let clock = ClockId::here().0;
    let words = [
        clock,
        arrived.cast_unsigned(),
        machine::now().cast_unsigned(),
    ];
    words.map(u64::to_le_bytes).concat()
}

fn read_clock(reply: &[u8]) -> Option<[u64; 3]> {
    let (words, _) = reply.as_chunks();
    let words: Vec<u64> = words.iter().copied().map(u64::from_le_bytes).collect();
    words.first_chunk().copied()
}
