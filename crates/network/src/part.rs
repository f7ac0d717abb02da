//! This process in a run: what runs here, the other processes, the topics that arrive.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use crossbeam_channel::Sender;
use ratelab::Time;
use ratelab_experiment::{Experiment, Taps};

use crate::{
    error::NetworkError,
    inlet::Inlet,
    key::Keys,
    packet::RunTimes,
    peers::Peers,
    recent::Recent,
    refusal::Refused,
    session::Settings,
    telemetry::{Info, SentMessage},
    times::Times,
};

/// Periods of silence after which a node counts as silent.
const SILENT_PERIODS: u32 = 5;

/// The shortest silence that counts, for fast nodes: the scheduler of a busy machine takes that
/// long.
const LEAST_SILENCE: Duration = Duration::from_millis(50);

/// This process in a run.
pub(crate) struct LocalPart {
    /// What runs here.
    pub(crate) own: Info,
    /// The other processes.
    pub(crate) peers: Arc<Peers>,
    pub(crate) times: Arc<Times>,
    /// The topics that arrive here.
    pub(crate) inlets: Vec<Arc<Inlet>>,
}

impl LocalPart {
    /// Connects this process, of which nobody knows yet.
    pub(crate) fn connect(
        settings: &Settings,
        experiment: &Experiment,
        here: &[String],
        arrivals: &Sender<(SentMessage, Time)>,
    ) -> Result<Arc<Self>, NetworkError> {
        let offsets = Arc::default();
        let mut own = Info::of(experiment, here);
        let wrong = own.has_wrong_clocks();
        let times = Times::new(experiment.observer(), Arc::clone(&offsets), wrong);
        let times = Arc::new(times);
        let inlets = inlets(&own, &experiment.taps(), &times, arrivals)?;
        let session = settings.open()?;
        own.incarnation = settings.number(&session)?;
        own.session = session.zid().to_string();
        own.command.clone_from(&settings.command);
        let senders = inlets.clone();
        let gone = move |gone| senders.iter().for_each(|inlet| inlet.sender().gone(gone));
        let keys = Keys::new(experiment.system().name());
        let peers = Peers::follow(&session, keys, own.incarnation, &offsets, Box::new(gone))?;
        Ok(Arc::new(Self {
            own,
            peers,
            times,
            inlets,
        }))
    }
}

/// The topics whose publishers run elsewhere, with readers here.
fn inlets(
    own: &Info,
    taps: &Taps,
    times: &Arc<Times>,
    arrivals: &Sender<(SentMessage, Time)>,
) -> Result<Vec<Arc<Inlet>>, NetworkError> {
    let mut inlets = Vec::new();
    for (index, topic) in own.topology.topics.iter().enumerate() {
        let (here, away) = own.split(&topic.publishers);
        if away.is_empty() || own.split(&topic.readers).0.is_empty() {
            continue;
        }
        let known = taps.topics().iter().find(|t| t.name() == topic.name);
        let refuse = |why: &str| Err(NetworkError::Setting(format!("{}: {why}", topic.name)));
        let Some(known) = known else {
            return refuse("its messages have no numbers, so they cannot leave a process");
        };
        if !here.is_empty() {
            return refuse("its publishers must run in one process");
        }
        let chains = taps.chains(index);
        inlets.extend(away.into_iter().map(|node| {
            let silence = node.hz.period() * SILENT_PERIODS;
            Arc::new(Inlet {
                topic: index,
                name: topic.name.clone(),
                node: node.name.clone(),
                patience: silence.max(LEAST_SILENCE),
                refused: Refused::default(),
                width: known.fields().len(),
                run_times: RunTimes::among(known.fields(), chains.count()),
                chains: chains.clone(),
                numbers: Recent::default(),
                publish: known.inlet(),
                sender: Mutex::default(),
                times: times.clone(),
                arrivals: arrivals.clone(),
            })
        }));
    }
    Ok(inlets)
}
