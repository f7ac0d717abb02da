//! This process in a run: what runs here, the other processes, the topics that arrive, and its end.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use crossbeam_channel::Sender;
use ratelab::{Command, Time};
use ratelab_experiment::{Experiment, Taps};

use crate::{
    error::{Beat, NetworkError},
    inlet::Inlet,
    key::Keys,
    machine::{self, ClockMoment, Nanos},
    packet::RunTimes,
    peers::Peers,
    sender::Refused,
    session::Settings,
    telemetry::{Info, SentMessage},
    times::{Recent, Times},
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
        let mut own = Info::new(experiment, here);
        let wrong = own.has_wrong_clocks();
        let times = Arc::new(Times::new(
            experiment.observer(),
            experiment.run_writer(),
            Arc::clone(&offsets),
            wrong,
        ));
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

/// Returns the topics whose publishers run elsewhere, with readers here.
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

/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// The end of a part.
pub(crate) struct PartEnd {
    part: Arc<LocalPart>,
    /// Run time there.
    end: Time,
    commands: Sender<Command>,
    /// The process that listens, and run time zero there.
    hub: Option<(u64, ClockMoment)>,
    is_over: bool,
}

impl PartEnd {
    /// Stops the part by its `commands` at run time `end`.
    pub(crate) fn begin(
        part: &Arc<LocalPart>,
        end: Time,
        commands: Sender<Command>,
    ) -> Result<Beat, NetworkError> {
        let mut part_end = Self {
            part: part.clone(),
            end,
            commands,
            hub: None,
            is_over: false,
        };
        Beat::begin("end", PAUSE, move || part_end.look())
    }

    fn look(&mut self) {
        let end = Nanos::try_from(self.end.as_nanos()).unwrap_or(Nanos::MAX);
        if !self.is_over && self.passed().is_some_and(|passed| passed >= end) {
            self.is_over = true;
            // A run that has ended takes no command.
            let _ = self.commands.send(Command::Stop);
        }
    }

    /// Returns the run time of the process that listens; `None` before its run. One that is gone counts
    /// on, until another one takes its place.
    fn passed(&mut self) -> Option<Nanos> {
        let peers = &self.part.peers;
        if let Some(hub) = peers.find(|info| info.is_hub)
            && self.hub.is_none_or(|(known, _)| known != hub.incarnation)
        {
            self.hub = peers.zero_of(hub.incarnation).map(|at| {
                let clock = hub.clock;
                (hub.incarnation, ClockMoment { clock, at })
            });
        }
        let (_, zero) = self.hub?;
        let estimate = self.part.times.offsets.estimate(zero.clock)?;
        Some(machine::now().saturating_sub(estimate.ours(zero.at)))
    }
}
