//! Watches for nodes of other processes that fall silent.
//!
//! The age of their messages decides, not the connection: a process that hangs is connected.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use ratelab::Time;
use ratelab_account::Observer;

use crate::{error::WireError, inlet::Inlet, peers::Peers, times::Times};

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// Shortest time without a look after which this process counts as one that stood still.
const STOOD: Duration = Duration::from_millis(500);

/// Logs which nodes appear, fall silent, come back; until it is dropped.
pub struct PresenceWatch(Arc<AtomicBool>);

impl Drop for PresenceWatch {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// What is known of a node.
#[derive(Default)]
struct Presence {
    /// Whether it is there; `None` at the beginning.
    present: Option<bool>,
    /// Senders so far.
    starts: u64,
    silent_since: Option<Instant>,
}

impl PresenceWatch {
    pub(crate) fn begin(
        inlets: Arc<Vec<Arc<Inlet>>>,
        peers: Arc<Peers>,
        observer: Observer,
        times: Arc<Times>,
        notice: fn(&str),
    ) -> Result<Self, WireError> {
        let end = Arc::new(AtomicBool::new(false));
        let ended = end.clone();
        let thread = thread::Builder::new().name("watch".to_owned());
        let begun = thread.spawn(move || {
            let mut watched = Watched {
                known: BTreeMap::new(),
                looked: Instant::now(),
                inlets,
                peers,
                observer,
                times,
                notice,
            };
            while !ended.load(Ordering::Relaxed) {
                watched.look();
                thread::sleep(PAUSE);
            }
        });
        begun.map_err(|why| WireError::network("cannot start a thread", &why))?;
        Ok(Self(end))
    }
}

/// The nodes that are watched.
struct Watched {
    known: BTreeMap<String, Presence>,
    /// When it looked last.
    looked: Instant,
    inlets: Arc<Vec<Arc<Inlet>>>,
    peers: Arc<Peers>,
    observer: Observer,
    times: Arc<Times>,
    notice: fn(&str),
}

impl Watched {
    fn look(&mut self) {
        let stood = self.looked.elapsed();
        self.looked = Instant::now();
        let Some(now) = self.times.now() else {
            return;
        };
        let inlets = self.inlets.clone();
        let patience = inlets.iter().map(|inlet| inlet.patience).max();
        if patience.is_some_and(|patience| stood > patience.max(STOOD)) {
            // What came meanwhile is yet to be taken in: nobody else was silent for that.
            self.note_own(now, stood);
            thread::sleep(PAUSE);
            self.looked = Instant::now();
            inlets
                .iter()
                .for_each(|inlet| inlet.sender().excuse(Instant::now()));
            return;
        }
        for inlet in inlets.iter() {
            let presence = self.known.entry(inlet.node.clone()).or_default();
            let run = Duration::from_nanos(now.as_nanos());
            if let Some((present, what)) = presence.look(inlet, &self.peers, run) {
                self.note(now, &inlet.node, present, &what);
            }
        }
        for (clock, step) in self.times.take_steps() {
            let nodes = self.peers.infos().into_iter();
            let nodes = nodes.filter(|info| info.clock == clock);
            for node in nodes.flat_map(|info| info.nodes) {
                let here = self.known.get(&node).and_then(|known| known.present);
                let what = format!("its clock was set by {:+.4} s", step as f64 / 1e9);
                self.note(now, &node, here.unwrap_or(true), &what);
            }
        }
    }

    /// Notes that this process itself stood still.
    fn note_own(&self, now: Time, stood: Duration) {
        let what = format!("its process stood still for {:.2} s", stood.as_secs_f64());
        if let Some(node) = self.peers.nodes.first() {
            self.note(now, node, true, &what);
        }
    }

    fn note(&self, now: Time, node: &str, present: bool, what: &str) {
        self.observer.note_presence(now, node, present, what);
        (self.notice)(&format!("{now}: {node}: {what}"));
    }
}

impl Presence {
    /// What changed, if something did, in a run that has lasted for `run`.
    fn look(&mut self, inlet: &Inlet, peers: &Peers, run: Duration) -> Option<(bool, String)> {
        let now = Instant::now();
        let (silence, starts) = {
            let sender = inlet.sender();
            (sender.silence(now).unwrap_or(run), sender.starts)
        };
        let (first, again) = (self.starts == 0, starts > self.starts && self.starts > 0);
        let present = starts > 0 && silence <= inlet.patience;
        if !present && silence <= inlet.patience {
            return None;
        }
        let before = self.present.replace(present);
        self.starts = starts;
        match (before, present) {
            (Some(false), false) | (Some(true), true) if !again => None,
            (_, false) => {
                self.silent_since = now.checked_sub(silence);
                let limit = inlet.patience.as_millis();
                Some((false, format!("silent for {limit} ms")))
            }
            (_, true) => {
                let silent = self.silent_since.take();
                let gone = silent.map(|since| (now - since).saturating_sub(silence));
                let after = gone.map(|gone| format!(" after {:.2} s", gone.as_secs_f64()));
                let after = after.unwrap_or_default();
                Some((
                    true,
                    match (first, again) {
                        (true, _) => format!("here{after}{}", place(inlet, peers)),
                        (_, true) => format!("started again{after}"),
                        (_, false) => format!("back{after}"),
                    },
                ))
            }
        }
    }
}

/// Where the node runs, if that is known already.
fn place(inlet: &Inlet, peers: &Peers) -> String {
    let infos = peers.infos();
    let info = infos.iter().find(|info| info.nodes.contains(&inlet.node));
    info.map_or_else(String::new, |info| {
        format!(", in process {} on {}", info.pid, info.host)
    })
}
