//! A dashboard's end of the connection: follows all processes of a run, gives commands.

use std::{process, sync::Arc};

use crossbeam_channel::{Receiver, bounded};
use ratelab::Command;
use zenoh::{Session, Wait};

use crate::{
    error::WireError,
    key::{Keys, Of},
    machine::{self, ClockId},
    net,
    offset::{Estimate, Offsets},
    peers::Peers,
    session::Settings,
    telemetry::{Answer, Batch, Info, Order},
};

/// Batches that may wait for the dashboard: ten seconds.
const BACKLOG: usize = 1024;

/// Follows a run from outside. Ends when it is dropped.
pub struct Follower {
    session: Session,
    peers: Arc<Peers>,
    offsets: Arc<Offsets>,
    batches: Receiver<(u64, Batch)>,
}

impl Follower {
    /// Connects to a run of the system called `system`. Waits for the process that listens.
    ///
    /// # Errors
    /// [`WireError`] for invalid settings and for errors of the network.
    pub fn connect(settings: &Settings, system: &str) -> Result<Self, WireError> {
        let (keys, own) = (Keys::new(system), machine::random());
        let session = settings.open()?;
        let offsets = Arc::<Offsets>::default();
        let peers = Peers::follow(&session, keys.clone(), own, &offsets, Box::new(|_| ()))?;
        let (sender, batches) = bounded(BACKLOG);
        let all = keys.of_all(Of::TELEMETRY);
        net::subscribe(&session, &all, move |sample| {
            let from = keys.incarnation(sample.key_expr().as_str());
            let batch = serde_json::from_slice(&sample.payload().to_bytes());
            if let (Some(from), Ok(batch)) = (from, batch) {
                // Where the dashboard is far behind, numbers show the gap.
                let _ = sender.try_send((from, batch));
            }
        })?;
        Ok(Self {
            session,
            peers,
            offsets,
            batches,
        })
    }

    /// What runs in each process that is there.
    pub fn processes(&self) -> Vec<Info> {
        self.peers.infos()
    }

    /// What happened since the last call, with the number of its process.
    pub fn batches(&self) -> impl Iterator<Item = (u64, Batch)> + '_ {
        self.batches.try_iter()
    }

    /// How far `clock` is ahead of ours; `None` while unknown.
    pub fn estimate(&self, clock: ClockId) -> Option<Estimate> {
        self.offsets.estimate(clock)
    }

    /// Returns what gives commands; each waits for the answer of the process that listens.
    pub fn commander(&self) -> impl Fn(Command) -> Answer + Send + use<> {
        let peers = self.peers.clone();
        let (pid, host) = (process::id(), machine::host());
        let name = format!("the dashboard in process {pid} on {host}");
        move |command| {
            let hub = peers.find(|info| info.is_hub);
            let hub = hub.ok_or("the process that listens is gone")?;
            let (by, name) = (peers.own, name.clone());
            let order = Order { by, name, command };
            peers.order(hub.incarnation, &order, "no answer")
        }
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}
