//! One process of a run: the topics that cross its border, its presence, its answers.

use std::{
    process,
    sync::{Arc, Mutex},
    time::Duration,
};

use crossbeam_channel::{Receiver, bounded};
use ratelab::Topology;
use ratelab_account::Observer;
use ratelab_study::{
    experiment::{Config, Experiment, Taps},
    system::{Alias, Joints},
};
use zenoh::{Session, Wait, liveliness::LivelinessToken};

use crate::{
    clock::ClockId,
    command::Commands,
    error::WireError,
    inlet::Inlet,
    join::{self, difference},
    key::{Keys, Of},
    machine,
    offset::Offsets,
    origins::Origins,
    outlet::{self, BACKLOG, Outlet},
    peers::{self, Peers},
    reporter::Reporter,
    ros::Ros,
    sender::Sender,
    session::Settings,
    telemetry::{Info, ReceivedMessage},
    times::Times,
    watch::PresenceWatch,
};

/// Periods of silence after which a node counts as silent.
pub const SILENT_PERIODS: u32 = 5;

/// The same at the least, for fast nodes: the scheduler of a busy machine takes that long.
const LEAST_SILENCE: Duration = Duration::from_millis(50);

/// Arrivals that may wait for a dashboard.
const ARRIVALS: usize = 4096;

/// The part of a run in this process, connected to the others. Ends when it is dropped.
pub struct Bridge {
    own: Info,
    aliases: &'static [Alias],
    session: Session,
    inlets: Arc<Vec<Arc<Inlet>>>,
    peers: Arc<Peers>,
    times: Arc<Times>,
    ros: Option<Ros>,
    _presence: LivelinessToken,
    _watch: PresenceWatch,
    reporter: Option<Reporter>,
}

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
    /// `ros` also to the nodes of ROS 2 in that domain. Waits for the process that begins the
    /// run, unless this is the one; the notices of the settings have for what.
    ///
    /// # Errors
    /// [`WireError`] for invalid settings, for a topic that cannot cross the border, for a
    /// process that has a node of this one already or is set up differently, and for errors
    /// of the network.
    pub fn start(
        settings: &Settings,
        experiment: &Experiment,
        here: &[String],
        ros: Option<u32>,
    ) -> Result<Self, WireError> {
        let (observer, taps) = (experiment.observer(), experiment.taps());
        let offsets = Arc::<Offsets>::default();
        let times = Arc::new(Times::new(observer.clone(), offsets.clone()));
        let mut border = Border {
            incarnation: 0,
            keys: Keys::new(experiment.system().name()),
            times: times.clone(),
            origins: Arc::default(),
            topology: observer.topology(),
            here: here.to_vec(),
        };
        let (arrivals, arrived) = bounded(ARRIVALS);
        let inlets = Arc::new(border.inlets(&taps, &arrivals)?);
        let session = settings.open()?;
        border.incarnation = settings.number(&session)?;
        let own = border.info(&session, experiment.config().clone());
        let (incarnation, keys) = (border.incarnation, border.keys.clone());
        let senders = inlets.clone();
        let gone = move |gone| senders.iter().for_each(|inlet| inlet.sender().gone(gone));
        let peers = Peers::follow(&session, &keys, incarnation, here, Box::new(gone))?;
        peers.ask_forever(&offsets)?;
        let aliases = experiment.system().aliases();
        let mute = join::check(&own, &peers, aliases, &|| {
            (settings.notice)(&waiting(&peers))
        })?;
        border.begin(&session, &taps, &inlets)?;
        let joints = experiment.system().about().joints;
        let ros = ros.map(|domain| Ros::new(&session, domain, times.clone(), &peers));
        let ros = ros.map(|ros| border.show_ros(ros, &taps, &inlets, joints));
        let ros = ros.transpose()?;
        border.answer(&session, observer.clone(), &own)?;
        let commands = Commands::new(experiment, here, own.is_hub, &peers);
        commands.answer(&session, &keys, incarnation)?;
        let reporter = border.report(&session, &observer, taps, arrived, &inlets)?;
        let presence = keys.process(incarnation);
        let presence = session.liveliness().declare_token(presence).wait();
        let presence = presence.map_err(|why| WireError::network("cannot be present", &why))?;
        join::check_again(&own, &peers, &mute)?;
        Ok(Self {
            _watch: PresenceWatch::begin(
                inlets.clone(),
                peers.clone(),
                observer,
                times.clone(),
                settings.notice,
            )?,
            own,
            aliases,
            session,
            inlets,
            peers,
            times,
            ros,
            _presence: presence,
            reporter: Some(reporter),
        })
    }

    /// The topics that arrive here.
    pub fn inlets(&self) -> &[Arc<Inlet>] {
        &self.inlets
    }

    /// What runs in the other processes whose clocks are known, so that their messages
    /// count, and that are set up as this one.
    pub fn others(&self) -> Vec<Info> {
        let mut infos = self.peers.infos();
        let is_alike = |info: &Info| difference(&self.own, info, self.aliases).is_none();
        infos.retain(|info| self.times.knows(info.clock) && is_alike(info));
        infos
    }

    /// Whether the parts of these `others` have begun: from then on they are ready for ours.
    pub fn have_begun(&self, others: &[Info]) -> bool {
        let running = self.peers.running();
        let mut others = others.iter();
        others.all(|info| running.contains(&info.incarnation))
    }

    /// What keeps processes that are there out of the run: another setup, another graph.
    pub fn misfits(&self) -> Vec<String> {
        let infos = self.peers.infos().into_iter();
        let differ = infos.filter_map(|info| {
            let why = difference(&self.own, &info, self.aliases)?;
            Some(format!("{}: {why}", info.place()))
        });
        differ.chain(of_other_systems(&self.peers)).collect()
    }

    /// Whether ROS nodes take the place of the other processes.
    pub fn has_ros_nodes(&self) -> bool {
        self.ros.as_ref().is_some_and(Ros::has_others)
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

/// The text for a process that waits for the one that begins the run.
fn waiting(peers: &Peers) -> String {
    let mut texts = vec!["waiting for the process that begins the run".to_owned()];
    texts.extend(of_other_systems(peers));
    texts.join("; ")
}

/// The text for processes of other graphs, if there are any.
fn of_other_systems(peers: &Peers) -> Option<String> {
    let others = peers.other_systems();
    let names: Vec<String> = others.into_iter().collect();
    let names = names.join(", ");
    (!names.is_empty()).then(|| {
        format!("there are processes of another graph, {names}: start all with the same graph")
    })
}

impl Border {
    fn is_here(&self, node: usize) -> bool {
        self.here.contains(&self.topology.nodes[node].name)
    }

    /// The topics whose publishers run elsewhere, with readers here.
    fn inlets(
        &self,
        taps: &Taps,
        arrivals: &crossbeam_channel::Sender<ReceivedMessage>,
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
    fn show_ros(
        &self,
        mut ros: Ros,
        taps: &Taps,
        inlets: &Arc<Vec<Arc<Inlet>>>,
        joints: &[Joints],
    ) -> Result<Ros, WireError> {
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
                ros.publish(name, joints, tap)?;
            }
            let inlet = inlets.iter().find(|inlet| inlet.name == topic.name);
            if let (Some(node), Some(inlet)) = (here(&topic.readers), inlet) {
                ros.subscribe(&self.topology.nodes[node].name, joints, inlet)?;
            }
        }
        ros.follow(inlets.clone())?;
        Ok(ros)
    }

    /// What runs here.
    fn info(&self, session: &Session, config: Config) -> Info {
        let first = self.topology.nodes.first();
        Info {
            ratelab: env!("CARGO_PKG_VERSION").to_owned(),
            incarnation: self.incarnation,
            host: machine::host(),
            pid: process::id(),
            session: session.zid().to_string(),
            is_hub: first.is_some_and(|node| self.here.contains(&node.name)),
            nodes: self.here.clone(),
            clock: ClockId::here(),
            zero: None,
            config,
            topology: self.topology.clone(),
            events: Vec::new(),
        }
    }

    /// Answers what runs here, and what time it is.
    fn answer(&self, session: &Session, observer: Observer, own: &Info) -> Result<(), WireError> {
        let clock = self.keys.of(self.incarnation, Of::Clock);
        let at = clock.clone();
        peers::answers(session, &clock, move |query| {
            peers::answer_clock(&query, &at);
        })?;
        let (info, times) = (own.clone(), self.times.clone());
        let key = self.keys.of(self.incarnation, Of::Info);
        let at = key.clone();
        peers::answers(session, &key, move |query| {
            let info = Info {
                zero: times.zero(),
                events: observer.events(0),
                ..info.clone()
            };
            let reply = serde_json::to_vec(&info).unwrap_or_default();
            peers::answer(&query, &at, reply);
        })
    }

    fn report(
        &self,
        session: &Session,
        observer: &Observer,
        taps: Taps,
        arrived: Receiver<ReceivedMessage>,
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
