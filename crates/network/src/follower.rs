//! A dashboard's end of the connection: follows all processes of a run, gives commands.

use std::{
    collections::{BTreeMap, BTreeSet},
    process,
    sync::{Arc, Mutex},
};

use crossbeam_channel::{Receiver, bounded};
use ratelab::{Command, sync::lock};
use zenoh::{Wait, sample::SampleKind};

use crate::{
    error::NetworkError,
    key::{Keys, Of},
    machine::{self, ClockId},
    net,
    peers::Peers,
    session::Settings,
    telemetry::{Answer, Batch, Info, Order},
    times::Estimate,
};

/// Batches that may wait for the dashboard: ten seconds.
const BACKLOG: usize = 1024;

/// The most processes of other systems that are known at a time.
const MOST_STRANGERS: usize = 64;

/// The processes of other systems: the key of each, and the name of its system.
type Strangers = Mutex<BTreeMap<String, String>>;

/// Follows a run from outside. Ends when it is dropped.
pub struct Follower {
    peers: Arc<Peers>,
    batches: Receiver<(u64, Batch)>,
    strangers: Arc<Strangers>,
}

impl Follower {
    /// Connects to a run of the system called `system`. Waits for the process that listens.
    ///
    /// # Errors
    /// [`NetworkError`] for invalid settings and for errors of the network.
    pub fn connect(settings: &Settings, system: &str) -> Result<Self, NetworkError> {
        let (keys, own) = (Keys::new(system), machine::random());
        let session = settings.open()?;
        let gone = Box::new(|_| ());
        let peers = Peers::follow(&session, keys.clone(), own, &Arc::default(), gone)?;
        let (sender, batches) = bounded(BACKLOG);
        let all = keys.all_endpoints(Of::TELEMETRY);
        net::subscribe(&session, &all, move |sample| {
            let from = keys.incarnation(sample.key_expr().as_str());
            let batch = serde_json::from_slice(&sample.payload().to_bytes());
            if let (Some(from), Ok(batch)) = (from, batch) {
                // Where the dashboard is far behind, numbers show the gap.
                let _ = sender.try_send((from, batch));
            }
        })?;
        let strangers = Arc::<Strangers>::default();
        let (keys, known) = (peers.keys.clone(), strangers.clone());
        net::watch(&session, (Keys::ALL, "other systems"), move |key, kind| {
            let mut known = lock(&known);
            match (kind, keys.other_system(key)) {
                (SampleKind::Put, Some(system)) if known.len() < MOST_STRANGERS => {
                    known.insert(key.to_owned(), system.to_owned());
                }
                (SampleKind::Delete, _) => drop(known.remove(key)),
                _ => {}
            }
        })?;
        Ok(Self {
            peers,
            batches,
            strangers,
        })
    }

    /// Returns the names of the other systems that have processes there.
    pub fn other_systems(&self) -> BTreeSet<String> {
        lock(&self.strangers).values().cloned().collect()
    }

    /// Returns what runs in each process that is there.
    pub fn processes(&self) -> Vec<Info> {
        self.peers.infos()
    }

    /// Returns what happened since the last call, with the number of its process.
    pub fn batches(&self) -> impl Iterator<Item = (u64, Batch)> + '_ {
        self.batches.try_iter()
    }

    /// Returns how far `clock` is ahead of ours; `None` while unknown.
    pub fn estimate(&self, clock: ClockId) -> Option<Estimate> {
        self.peers.offsets.estimate(clock)
    }

    /// Returns what gives commands; each waits for the answer of the process that listens.
    pub fn commander(&self) -> impl Fn(Command) -> Answer + Send + use<> {
        let peers = self.peers.clone();
        let (pid, host) = (process::id(), machine::host());
        let name = format!("the dashboard in process {pid} on {host}");
        move |command| {
            let hub = peers
                .find(|info| info.is_hub)
                .ok_or("the process that listens is gone")?;
            let (by, name) = (peers.own, name.clone());
            let order = Order { by, name, command };
            peers.order(hub.incarnation, &order, "no answer")
        }
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        let _ = self.peers.session.close().wait();
    }
}
