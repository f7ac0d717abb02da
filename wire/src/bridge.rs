//! One process of a run: the topics that cross its border, its presence, its answers.

use std::{
    process,
    sync::{Arc, Mutex},
    time::Duration,
};

use crossbeam_channel::{Receiver, bounded};
use ratelab::{
    experiment::{Config, Experiment, Taps},
    runtime::{Observer, telemetry::Topology},
    system::Joints,
};
use zenoh::{Session, Wait, liveliness::LivelinessToken};

use crate::{
    clock::ClockId,
    command::Commands,
    inlet::Inlet,
    key::{Keys, Of},
    machine,
    offset::Offsets,
    origins::Origins,
    outlet::{self, BACKLOG, Outlet},
    peers::{self, Peers},
    reporter::Reporter,
    ros::Ros,
    sender::Sender,
    session::{Settings, WireError},
    telemetry::{Arrival, Info},
    times::Times,
    watch::Watch,
};

/// Periods of silence after which a node counts as silent.
pub const SILENT_PERIODS: u32 = 5;

/// The same at the least, for fast nodes: the scheduler of a busy machine takes that long.
const LEAST_SILENCE: Duration = Duration::from_millis(50);

/// Arrivals that may wait for a dashboard.
const ARRIVALS: usize = 4096;

/// The part of a run in this process, connected to the others. Ends when it is dropped.
pub struct Bridge {
    session: Session,
    inlets: Arc<Vec<Arc<Inlet>>>,
    peers: Arc<Peers>,
    times: Arc<Times>,
    _ros: Option<Ros>,
    /// Whether ROS nodes subscribe, by topic.
    ros_readers: Vec<IsRead>,
    _presence: LivelinessToken,
    _watch: Watch,
    reporter: Option<Reporter>,
}

/// Tells whether somebody subscribes.
type IsRead = Box<dyn Fn() -> bool + Send + Sync>;

/// What is sent and received, before the run.
struct Border {
    incarnation: u64,
    keys: Keys,
    times: Arc<Times>,
    origins: Arc<Origins>,
    topology: Topology,
    here: Vec<String>,
}

impl Bridge {
    /// Connects `experiment`, of which the nodes named in `here` run in this process; with
    /// `ros` also to the nodes of ROS 2 in that domain. Waits for the other end, where this
    /// is the end that connects.
    ///
    /// # Errors
    /// [`WireError`] for invalid settings, for a topic that cannot cross the border, and
    /// for errors of the network.
    pub fn start(
        settings: &Settings,
        experiment: &Experiment,
        here: &[String],
        ros: Option<u32>,
    ) -> Result<Self, WireError> {
        let (observer, taps) = (experiment.observer(), experiment.taps());
        let offsets = Arc::<Offsets>::default();
        let times = Arc::new(Times::new(observer.clone(), offsets.clone()));
        let border = Border {
            incarnation: crate::random(),
            keys: Keys::new(experiment.system().name()),
            times: times.clone(),
            origins: Arc::default(),
            topology: observer.topology(),
            here: here.to_vec(),
        };
        let (arrivals, arrived) = bounded(ARRIVALS);
        let inlets = Arc::new(border.inlets(&taps, &arrivals)?);
        let session = settings.open()?;
        let (incarnation, keys) = (border.incarnation, border.keys.clone());
        let senders = inlets.clone();
        let gone = move |gone| senders.iter().for_each(|inlet| inlet.sender().gone(gone));
        let peers = Peers::follow(&session, &keys, incarnation, Box::new(gone))?;
        border.begin(&session, &taps, &inlets)?;
        let config = experiment.config().clone();
        let joints = experiment.system().joints();
        let ros = ros.map(|domain| border.ros(&session, domain, &taps, &inlets, joints));
        let (ros, ros_readers) = ros.transpose()?.unzip();
        let is_hub = border
            .topology
            .nodes
            .first()
            .is_some_and(|node| here.contains(&node.name));
        border.answer(&session, observer.clone(), config, is_hub)?;
        let commands = Commands::new(experiment, here, is_hub, &peers);
        commands.answer(&session, &keys, incarnation)?;
        let reporter = border.report(&session, &observer, taps, arrived, &inlets)?;
        let presence = keys.process(incarnation);
        let presence = session.liveliness().declare_token(presence).wait();
        let presence = presence.map_err(|why| WireError::network("cannot be present", &why))?;
        peers.ask_forever(&offsets)?;
        Ok(Self {
            _watch: Watch::begin(inlets.clone(), peers.clone(), observer, times.clone())?,
            session,
            inlets,
            peers,
            times,
            _ros: ros,
            ros_readers: ros_readers.unwrap_or_default(),
            _presence: presence,
            reporter: Some(reporter),
        })
    }

    /// The topics that arrive here.
    pub fn inlets(&self) -> &[Arc<Inlet>] {
        &self.inlets
    }

    /// What runs in the other processes whose clocks are known, so that their messages
    /// count.
    pub fn others(&self) -> Vec<Info> {
        let mut infos = self.peers.infos();
        infos.retain(|info| self.times.knows(info.clock));
        infos
    }

    /// Whether a ROS node subscribes to a topic of this process.
    pub fn has_ros_readers(&self) -> bool {
        self.ros_readers.iter().any(|is_read| is_read())
    }

    /// The clocks of all processes.
    pub fn times(&self) -> &Times {
        &self.times
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        // It sends once more.
        self.reporter = None;
        let _ = self.session.close().wait();
    }
}

impl Border {
    fn is_here(&self, node: usize) -> bool {
        self.here.contains(&self.topology.nodes[node].name)
    }

    /// The topics whose publishers run elsewhere, with readers here.
    fn inlets(
        &self,
        taps: &Taps,
        arrivals: &crossbeam_channel::Sender<Arrival>,
    ) -> Result<Vec<Arc<Inlet>>, WireError> {
        let mut inlets = Vec::new();
        for (index, topic) in self.topology.topics.iter().enumerate() {
            let (here, away): (Vec<usize>, Vec<usize>) = topic
                .publishers
                .iter()
                .partition(|node| self.is_here(**node));
            if away.is_empty() || !topic.readers.iter().any(|node| self.is_here(*node)) {
                continue;
            }
            let known = taps.topics().iter().find(|t| t.name() == topic.name);
            let refuse = |why: &str| Err(WireError::Setting(format!("{}: {why}", topic.name)));
            let Some(known) = known else {
                return refuse("its messages have no numbers, so they cannot leave a process");
            };
            if !here.is_empty() {
                return refuse("its publishers must run in one process");
            }
            for node in away {
                let node = &self.topology.nodes[node];
                let silence = node.hz.period() * SILENT_PERIODS;
                inlets.push(Arc::new(Inlet {
                    topic: index,
                    name: topic.name.clone(),
                    node: node.name.clone(),
                    patience: silence.max(LEAST_SILENCE),
                    refused: Default::default(),
                    width: known.fields().len(),
                    publish: known.inlet(),
                    sender: Mutex::new(Sender::default()),
                    times: self.times.clone(),
                    origins: self.origins.clone(),
                    arrivals: arrivals.clone(),
                }));
            }
        }
        Ok(inlets)
    }

    /// Begins to send and to receive.
    fn begin(
        &self,
        session: &Session,
        taps: &Taps,
        inlets: &[Arc<Inlet>],
    ) -> Result<(), WireError> {
        for inlet in inlets {
            inlet.begin(session, &self.keys.data(&inlet.node, &inlet.name))?;
        }
        for topic in &self.topology.topics {
            if topic.readers.iter().all(|node| self.is_here(*node)) {
                continue;
            }
            for &node in topic.publishers.iter().filter(|node| self.is_here(**node)) {
                let key = self.keys.data(&self.topology.nodes[node].name, &topic.name);
                let Some(tap) = taps.rows(&topic.name, BACKLOG) else {
                    continue;
                };
                let outlet = Outlet {
                    tap,
                    publisher: outlet::publisher(session, key)?,
                    incarnation: self.incarnation,
                    times: self.times.clone(),
                    origins: self.origins.clone(),
                };
                outlet.begin(&topic.name)?;
            }
        }
        Ok(())
    }

    /// Shows ROS the topics that cross the border as joint states.
    fn ros(
        &self,
        session: &Session,
        domain: u32,
        taps: &Taps,
        inlets: &Arc<Vec<Arc<Inlet>>>,
        joints: &[Joints],
    ) -> Result<(Ros, Vec<IsRead>), WireError> {
        let mut ros = Ros::new(session, domain, self.times.clone());
        let mut readers = Vec::new();
        for joints in joints {
            let mut topics = self.topology.topics.iter();
            let Some(topic) = topics.find(|topic| topic.name == joints.topic) else {
                continue;
            };
            let here = |nodes: &[usize]| nodes.iter().copied().find(|node| self.is_here(*node));
            let is_here = |node: &usize| self.is_here(*node);
            if let Some(node) = here(&topic.publishers)
                && !topic.readers.iter().all(is_here)
                && let Some(tap) = taps.rows(&topic.name, BACKLOG)
            {
                let name = &self.topology.nodes[node].name;
                readers.push(ros.publish(name, joints, tap)?);
            }
            let inlet = inlets.iter().find(|inlet| inlet.name == topic.name);
            if let (Some(node), Some(inlet)) = (here(&topic.readers), inlet) {
                ros.subscribe(&self.topology.nodes[node].name, joints, inlet)?;
            }
        }
        ros.follow(inlets.clone())?;
        Ok((ros, readers))
    }

    /// Answers what runs here, and what time it is.
    fn answer(
        &self,
        session: &Session,
        observer: Observer,
        config: Config,
        is_hub: bool,
    ) -> Result<(), WireError> {
        let clock = self.keys.of(self.incarnation, Of::Clock);
        peers::answers(session, &clock, |query| peers::answer_clock(&query))?;
        let info = Info {
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            incarnation: self.incarnation,
            host: machine::host(),
            pid: process::id(),
            is_hub,
            nodes: self.here.clone(),
            clock: ClockId::here(),
            zero: None,
            config,
            topology: self.topology.clone(),
            events: Vec::new(),
        };
        let times = self.times.clone();
        let key = self.keys.of(self.incarnation, Of::Info);
        peers::answers(session, &key, move |query| {
            let info = Info {
                zero: times.zero(),
                events: observer.events(0),
                ..info.clone()
            };
            peers::answer(&query, serde_json::to_vec(&info).unwrap_or_default());
        })
    }

    fn report(
        &self,
        session: &Session,
        observer: &Observer,
        taps: Taps,
        arrived: Receiver<Arrival>,
        inlets: &Arc<Vec<Arc<Inlet>>>,
    ) -> Result<Reporter, WireError> {
        let topics = self.topology.topics.iter().enumerate();
        let sent = topics.filter(|(_, topic)| {
            let mut publishers = topic.publishers.iter();
            publishers.any(|node| self.is_here(*node))
        });
        let sent = sent.map(|(index, topic)| (index, topic.name.clone()));
        let nodes = (0..self.topology.nodes.len()).filter(|node| self.is_here(*node));
        Reporter::begin(
            session,
            self.keys.of(self.incarnation, Of::Telemetry),
            crate::reporter::Sources {
                observer: observer.clone(),
                times: self.times.clone(),
                tap_handle: taps,
                sent: sent.collect(),
                nodes: nodes.collect(),
                arrived,
                inlets: inlets.clone(),
            },
        )
    }
}
