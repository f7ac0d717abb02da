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

use ratelab::runtime::Observer;

use crate::{inlet::Inlet, peers::Peers, session::WireError, times::Times};

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// Logs which nodes appear, fall silent, come back; until it is dropped.
pub struct Watch(Arc<AtomicBool>);

impl Drop for Watch {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// What is known of a node.
#[derive(Default)]
struct Presence {
    present: bool,
    /// Senders so far.
    starts: u64,
    silent_since: Option<Instant>,
}

impl Watch {
    pub(crate) fn begin(
        inlets: Arc<Vec<Arc<Inlet>>>,
        peers: Arc<Peers>,
        observer: Observer,
        times: Arc<Times>,
    ) -> Result<Self, WireError> {
        let end = Arc::new(AtomicBool::new(false));
        let ended = end.clone();
        let thread = thread::Builder::new().name("watch".to_owned());
        let begun = thread.spawn(move || {
            let mut known: BTreeMap<String, Presence> = BTreeMap::new();
            while !ended.load(Ordering::Relaxed) {
                for inlet in inlets.iter() {
                    let presence = known.entry(inlet.node.clone()).or_default();
                    let news = presence.look(inlet, &peers);
                    if let (Some((present, what)), Some(now)) = (news, times.now()) {
                        observer.note_presence(now, &inlet.node, present, &what);
                    }
                }
                thread::sleep(PAUSE);
            }
        });
        begun.map_err(|why| WireError::network("cannot start a thread", &why))?;
        Ok(Self(end))
    }
}

impl Presence {
    /// What changed, if something did.
    fn look(&mut self, inlet: &Inlet, peers: &Peers) -> Option<(bool, String)> {
        let now = Instant::now();
        let (silence, starts) = {
            let sender = inlet.sender();
            (sender.silence(now)?, sender.starts)
        };
        let again = starts > self.starts && self.starts > 0;
        let first = self.starts == 0;
        self.starts = starts;
        let silent = silence > inlet.patience;
        match (self.present, silent) {
            (true, true) => {
                self.present = false;
                self.silent_since = now.checked_sub(silence);
                let limit = inlet.patience.as_millis();
                Some((false, format!("silent for {limit} ms")))
            }
            (false, false) => {
                self.present = true;
                let gone = self.silent_since.take().map(|since| now - since - silence);
                let gone = gone.unwrap_or_default().as_secs_f64();
                Some((
                    true,
                    match (first, again) {
                        (true, _) => format!("here{}", place(inlet, peers)),
                        (_, true) => format!("started again, after {gone:.2} s"),
                        (_, false) => format!("back after {gone:.2} s"),
                    },
                ))
            }
            (true, false) if again => Some((true, "started again".to_owned())),
            _ => None,
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
