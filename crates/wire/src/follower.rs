//! A dashboard's end of the connection: follows all processes of a run, gives commands.

use std::{process, sync::Arc};

use crossbeam_channel::{Receiver, Sender, bounded};
use ratelab::Command;
use zenoh::{Session, Wait, sample::Sample};

use crate::{
    clock::ClockId,
    command::{Answer, Order},
    error::WireError,
    key::{Keys, Of},
    machine::host,
    offset::{Estimate, Offsets},
    peers::Peers,
    session::Settings,
    telemetry::{Batch, Info},
};

/// Batches that may wait for the dashboard: ten seconds.
const BACKLOG: usize = 1024;

/// Follows a run from outside. Ends when it is dropped.
pub struct Follower {
    session: Session,
    peers: Arc<Peers>,
    offsets: Arc<Offsets>,
    batches: Receiver<(u64, Batch)>,
    id: u64,
}

impl Follower {
    /// Connects to a run of the system called `system`. Waits for the process that listens.
    ///
    /// # Errors
    /// [`WireError`] for invalid settings and for errors of the network.
    pub fn connect(settings: &Settings, system: &str) -> Result<Self, WireError> {
        let (keys, id) = (Keys::new(system), crate::random());
        let session = settings.open()?;
        let offsets = Arc::<Offsets>::default();
        let peers = Peers::follow(&session, &keys, id, &[], Box::new(|_| ()))?;
        peers.ask_forever(&offsets)?;
        let (sender, batches) = bounded(BACKLOG);
        let all = keys.of_all(Of::Telemetry);
        let subscribed = session.declare_subscriber(&all).callback(move |sample| {
            receive(&keys, &sample, &sender);
        });
        let subscribed = subscribed.background().wait();
        subscribed.map_err(|why| WireError::network("cannot follow the run", &why))?;
        Ok(Self {
            session,
            peers,
            offsets,
            batches,
            id,
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
        let (peers, by) = (self.peers.clone(), self.id);
        let name = format!("the dashboard in process {} on {}", process::id(), host());
        move |command| {
            let infos = peers.infos();
            let hub = infos.iter().find(|info| info.is_hub);
            let hub = hub.ok_or("the process that listens is gone")?;
            let name = name.clone();
            let order = serde_json::to_vec(&Order { by, name, command });
            let order = order.map_err(|why| why.to_string())?;
            let reply = peers.ask_bytes(hub.incarnation, Of::Command, order);
            let reply = reply.ok_or("no answer")?;
            serde_json::from_slice(&reply).map_err(|why| format!("unknown answer: {why}"))?
        }
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}

/// Takes a batch, unless the dashboard is far behind: numbers show the gap.
fn receive(keys: &Keys, sample: &Sample, batches: &Sender<(u64, Batch)>) {
    let from = keys.incarnation(sample.key_expr().as_str());
    let batch = serde_json::from_slice(&sample.payload().to_bytes());
    if let (Some(from), Ok(batch)) = (from, batch) {
        let _ = batches.try_send((from, batch));
    }
}
