//! One process of a run: the topics that cross its border, its presence, its answers.

use std::{
    collections::BTreeSet,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::{Sender, bounded};
use ratelab::{Command, Time};
use ratelab_experiment::{Experiment, Taps};
use ratelab_system::Alias;
use zenoh::{Wait, liveliness::LivelinessToken};

use crate::{
    command::Commands,
    error::{Beat, NetworkError},
    inlet::Inlet,
    join::{self, difference},
    key::Of,
    net,
    outlet::{self, BACKLOG},
    part::{LocalPart, PartEnd},
    peers::{self, Peers},
    reporter::Reporter,
    ros::Ros,
    session::{SessionEnd, Settings},
    telemetry::Info,
    times::Times,
    watch::PresenceWatch,
};

/// Arrivals that may wait for a dashboard.
const ARRIVALS: usize = 4096;

/// Time between two looks for the other nodes.
const PAUSE: Duration = Duration::from_millis(10);

/// Time between two looks for processes that do not fit.
const SETTLED: Duration = Duration::from_secs(1);

/// The part of a run in this process, connected to the others. Ends when it is dropped.
pub struct Bridge {
    part: Arc<LocalPart>,
    aliases: &'static [Alias],
    ros: Option<Ros>,
    notice: fn(&str),
    _presence: LivelinessToken,
    /// Reports, and watches for silent nodes.
    beats: Vec<Beat>,
}

impl Bridge {
    /// Connects `experiment`, of which the nodes named in `here` run in this process; with
    /// `ros` also to the nodes of ROS 2 in that domain. Waits for the process that begins the
    /// run, unless this is the one; the notices of the settings have for what.
    ///
    /// # Errors
    /// [`NetworkError`] for invalid settings, for a topic that cannot cross the border, for a
    /// process that has a node of this one already or is set up differently, and for errors
    /// of the network.
    pub fn start(
        settings: &Settings,
        experiment: &Experiment,
        here: &[String],
        ros: Option<u32>,
    ) -> Result<Self, NetworkError> {
        let (system, taps, notice) = (experiment.system(), experiment.taps(), settings.notice);
        let (arrivals, arrived) = bounded(ARRIVALS);
        let part = LocalPart::connect(settings, experiment, here, &arrivals)?;
        let LocalPart { own, peers, .. } = &*part;
        let mute = join::check(own, peers, system.knobs().aliases(), &|| {
            notice(&waiting(peers))
        })?;
        send_and_receive(&part, &taps)?;
        let ros = ros
            .map(|domain| Ros::begin(domain, &part, &taps, system.robot().joints()))
            .transpose()?;
        answer(&part)?;
        Commands::answer(experiment, &part)?;
        let reporter = Reporter::begin(&part, taps, arrived)?;
        let presence = net::be_present(&peers.session, &peers.keys.process(own.incarnation))?;
        let mut bridge = Self {
            part: part.clone(),
            aliases: system.knobs().aliases(),
            ros,
            notice,
            _presence: presence,
            beats: vec![reporter],
        };
        join::check_again(own, peers, &mute)?;
        bridge.beats.push(PresenceWatch::begin(&part, notice)?);
        if let SessionEnd::Listen(addresses) = &settings.end {
            notice(&format!("listening on {}", addresses.join(", ")));
        }
        Ok(bridge)
    }

    /// Stops this part by its `commands` when the run has lasted until `end` in the process that begins
    /// it.
    ///
    /// # Errors
    /// [`NetworkError`] if no thread can be started.
    pub fn end_at(&mut self, end: Time, commands: Sender<Command>) -> Result<(), NetworkError> {
        self.beats.push(PartEnd::begin(&self.part, end, commands)?);
        Ok(())
    }

    /// Returns the topics that arrive here.
    pub fn inlets(&self) -> &[Arc<Inlet>] {
        &self.part.inlets
    }

    /// Returns what runs in the other processes whose clocks are known, so that their messages
    /// count, and that are set up as this one.
    pub fn others(&self) -> Vec<Info> {
        let mut infos = self.part.peers.infos();
        let is_alike = |info: &Info| difference(&self.part.own, info, self.aliases).is_none();
        let has_clock = |info: &Info| self.part.times.offsets.estimate(info.clock).is_some();
        infos.retain(|info| has_clock(info) && is_alike(info));
        infos
    }

    /// Returns whether the parts of these `others` have begun: from then on they are ready for
    /// ours.
    pub fn have_begun(&self, others: &[Info]) -> bool {
        let running = self.part.peers.running();
        others
            .iter()
            .all(|info| running.contains(&info.incarnation))
    }

    /// Where the run begins with this process: waits until each node runs somewhere, or a ROS
    /// node is there. The notices of the settings have for whom.
    pub fn wait_for_others(&self) {
        if !self.part.own.is_hub {
            return;
        }
        let all = &self.part.own.topology.nodes;
        let (mut looked, mut noted) = (Instant::now(), BTreeSet::new());
        loop {
            let others = self.others();
            let runs = |node: &str| others.iter().any(|info| info.runs(node));
            let missing: Vec<&str> = all
                .iter()
                .map(|node| &*node.name)
                .filter(|node| !self.part.own.runs(node))
                .filter(|node| !runs(node))
                .collect();
            let ready = missing.is_empty() && self.have_begun(&others);
            if ready || self.has_ros_nodes() {
                return (self.notice)("all nodes are there: the run begins");
            }
            let mut texts = Vec::new();
            if !missing.is_empty() {
                texts.push(format!("waiting for {}", missing.join(", ")));
            }
            if looked.elapsed() > SETTLED {
                texts.extend(self.misfits());
                looked = Instant::now();
            }
            for text in texts {
                if noted.insert(text.clone()) {
                    (self.notice)(&text);
                }
            }
            thread::sleep(PAUSE);
        }
    }

    /// Returns what keeps processes that are there out of the run: another setup, another graph.
    fn misfits(&self) -> Vec<String> {
        let differ = self.part.peers.infos().into_iter().filter_map(|info| {
            let why = difference(&self.part.own, &info, self.aliases)?;
            Some(format!("{}: {why}", info.place()))
        });
        differ.chain(other_systems(&self.part.peers)).collect()
    }

    /// Returns whether ROS nodes take the place of the other processes.
    pub fn has_ros_nodes(&self) -> bool {
        self.ros.as_ref().is_some_and(Ros::has_others)
    }

    /// Returns the clocks of all processes.
    pub fn times(&self) -> &Times {
        &self.part.times
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        // They report once more.
        self.beats.clear();
        let _ = self.part.peers.session.close().wait();
    }
}

/// Returns the text for a process that waits for the one that begins the run.
fn waiting(peers: &Peers) -> String {
    let others = other_systems(peers)
        .map(|others| format!("; {others}"))
        .unwrap_or_default();
    format!("waiting for the process that begins the run{others}")
}

/// Returns the text for processes of other graphs; `None` without such processes.
fn other_systems(peers: &Peers) -> Option<String> {
    let names: Vec<String> = peers.other_systems().into_iter().collect();
    let names = names.join(", ");
    (!names.is_empty()).then(|| {
        format!("there are processes of another graph, {names}: start all with the same graph")
    })
}

/// Begins to send and to receive.
fn send_and_receive(part: &LocalPart, taps: &Taps) -> Result<(), NetworkError> {
    let (session, keys) = (&part.peers.session, &part.peers.keys);
    for inlet in &part.inlets {
        let key = keys.data(&inlet.node, &inlet.name);
        inlet.begin(session, &key, |inlet, sample| {
            inlet.take(&sample.payload().to_bytes())
        })?;
    }
    for (index, topic) in part.own.topology.topics.iter().enumerate() {
        for node in part.own.senders(topic) {
            let mut known = taps.topics().iter();
            if let Some(known) = known.find(|known| known.name() == topic.name)
                && let Some(tap) = taps.rows(&topic.name, BACKLOG)
            {
                let key = keys.data(&node.name, &topic.name);
                outlet::send(part, key, &**known, tap, taps.chains(index))?;
            }
        }
    }
    Ok(())
}

/// Answers what runs here, and what time it is.
fn answer(part: &LocalPart) -> Result<(), NetworkError> {
    let (session, keys) = (&part.peers.session, &part.peers.keys);
    let key = keys.endpoint(part.own.incarnation, Of::CLOCK);
    net::answers(session, key, |question| question.answer(peers::clock()))?;
    let (own, times) = (part.own.clone(), part.times.clone());
    let key = keys.endpoint(part.own.incarnation, Of::INFO);
    net::answers(session, key, move |question| {
        let info = Info {
            zero: times.zero(),
            events: times.observer.events(0),
            ..own.clone()
        };
        question.answer(serde_json::to_vec(&info).unwrap_or_default());
    })
}
