//! Watches for nodes of other processes that fall silent.
//!
//! The age of their messages decides, not the connection: a process that hangs is connected.

use std::{
    collections::BTreeMap,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use ratelab::Time;

use crate::{
    error::{Beat, NetworkError},
    inlet::Inlet,
    part::LocalPart,
    peers::Peers,
};

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// Shortest time without a look after which this process counts as one that stood still.
const STOOD: Duration = Duration::from_millis(500);

/// The nodes that are watched.
pub(crate) struct PresenceWatch {
    known: BTreeMap<String, Presence>,
    /// When it looked last.
    looked: Instant,
    part: Arc<LocalPart>,
    notice: fn(&str),
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
    /// Logs which nodes appear, fall silent, come back, until the result is dropped.
    pub(crate) fn begin(part: &Arc<LocalPart>, notice: fn(&str)) -> Result<Beat, NetworkError> {
        let mut watch = Self {
            known: BTreeMap::new(),
            looked: Instant::now(),
            part: part.clone(),
            notice,
        };
        Beat::begin("watch", PAUSE, move || watch.look())
    }

    fn look(&mut self) {
        let stood = self.looked.elapsed();
        self.looked = Instant::now();
        let Some(now) = self.part.times.now() else {
            return;
        };
        let part = self.part.clone();
        let patience = part.inlets.iter().map(|inlet| inlet.patience).max();
        if patience.is_some_and(|patience| stood > patience.max(STOOD)) {
            return self.excuse(now, stood);
        }
        for inlet in &part.inlets {
            let presence = self.known.entry(inlet.node.clone()).or_default();
            let run = Duration::from_nanos(now.as_nanos());
            if let Some((present, what)) = presence.look(inlet, &part.peers, run) {
                self.note(now, &inlet.node, present, &what);
            }
        }
        for (clock, step) in self.part.times.offsets.take_steps() {
            let what = format!("its clock was set by {:+.4} s", step as f64 / 1e9);
            let set = part
                .peers
                .infos()
                .into_iter()
                .filter(|info| info.clock == clock);
            for node in set.flat_map(|info| info.nodes) {
                let present = self.known.get(&node).and_then(|known| known.present);
                self.note(now, &node, present.unwrap_or(true), &what);
            }
        }
    }

    /// Notes that this process itself `stood` still: nobody else was silent for that.
    fn excuse(&mut self, now: Time, stood: Duration) {
        let what = format!("its process stood still for {:.2} s", stood.as_secs_f64());
        if let Some(node) = self.part.own.nodes.first() {
            self.note(now, node, true, &what);
        }
        // What came meanwhile is yet to be taken in.
        thread::sleep(PAUSE);
        self.looked = Instant::now();
        for inlet in &self.part.inlets {
            inlet.sender().excuse(self.looked);
        }
    }

    fn note(&self, now: Time, node: &str, present: bool, what: &str) {
        let run = &self.part.times.run;
        run.note_presence(now, node, present, what);
        (self.notice)(&format!("{now}: {node}: {what}"));
    }
}

impl Presence {
    /// Returns what changed, if something did, in a run that has lasted for `run`.
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
        if before == Some(present) && !again {
            return None;
        }
        if !present {
            self.silent_since = now.checked_sub(silence);
            let limit = inlet.patience.as_millis();
            return Some((false, format!("silent for {limit} ms")));
        }
        let silent = self.silent_since.take();
        let gone = silent.map(|since| (now - since).saturating_sub(silence));
        let after = gone
            .map(|gone| format!(" after {:.2} s", gone.as_secs_f64()))
            .unwrap_or_default();
        let what = match (first, again) {
            (true, _) => {
                let there = peers.find(|info| info.runs(&inlet.node));
                let place = there.map(|info| format!(", in {}", info.process()));
                format!("here{after}{}", place.unwrap_or_default())
            }
            (_, true) => format!("started again{after}"),
            (_, false) => format!("back{after}"),
        };
        Some((true, what))
    }
}
