//! Commands from dashboards: which process carries them out, and who may give them.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{Command, EventKind, Knob};
use ratelab_account::Observer;
use ratelab_study::{
    experiment::{Config, Experiment},
    system::System,
};
use serde::{Deserialize, Serialize};
use zenoh::{Session, query::Query};

use crate::{
    error::WireError,
    key::{Keys, Of},
    peers::{self, Peers},
};

/// Longest wait for the graph to answer.
const PATIENCE: Duration = Duration::from_millis(500);

/// Time without a command after which another dashboard may take the knobs.
const HELD: Duration = Duration::from_secs(10);

/// The longest name of a dashboard in the log (characters).
const LONGEST_NAME: usize = 100;

/// A command, and who gives it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Order {
    /// Number of the dashboard.
    pub by: u64,
    /// Name of the dashboard, for the others.
    pub name: String,
    /// The command.
    pub command: Command,
}

/// Whether a command was carried out: `Ok`, or the reason why not.
pub type Answer = Result<(), String>;

/// Carries out the commands for this process. The process that listens passes on those for
/// the others, so that all dashboards ask the same one, and one of them holds the knobs.
pub(crate) struct Commands {
    system: Arc<dyn System>,
    config: Config,
    observer: Observer,
    commands: Sender<Command>,
    here: Vec<String>,
    is_hub: bool,
    peers: Arc<Peers>,
    holder: Mutex<Option<(u64, String, Instant)>>,
}

impl Commands {
    pub(crate) fn new(
        experiment: &Experiment,
        here: &[String],
        is_hub: bool,
        peers: &Arc<Peers>,
    ) -> Arc<Self> {
        Arc::new(Self {
            system: experiment.system().clone(),
            config: experiment.config().clone(),
            observer: experiment.observer(),
            commands: experiment.commands(),
            here: here.to_vec(),
            is_hub,
            peers: peers.clone(),
            holder: Mutex::default(),
        })
    }

    /// Answers commands for as long as `session` is open.
    pub(crate) fn answer(
        self: Arc<Self>,
        session: &Session,
        keys: &Keys,
        own: u64,
    ) -> Result<(), WireError> {
        let key: Arc<str> = keys.of(own, Of::Command).into();
        peers::answers(session, &key.clone(), move |query| {
            let (commands, key) = (self.clone(), key.clone());
            // The graph takes its time, and the connection must not wait for it.
            thread::spawn(move || commands.reply(&query, &key));
        })
    }

    fn reply(&self, query: &Query, key: &str) {
        let order = query.payload().map(|order| order.to_bytes().into_owned());
        let order = order.and_then(|order| serde_json::from_slice(&order).ok());
        let answer: Answer = match order {
            Some(order) => self.decide(&order),
            None => Err("no command: expected one of this version of ratelab".to_owned()),
        };
        peers::answer(query, key, serde_json::to_vec(&answer).unwrap_or_default());
    }

    fn decide(&self, order: &Order) -> Answer {
        if self.is_hub {
            self.take_knobs(order)?;
        }
        let command = &order.command;
        let Command::Set(knob) = command else {
            return match command {
                Command::Stop => {
                    self.note_stop(order);
                    self.everywhere(order)
                }
                _ => Err("its nodes run in several processes, which share the wall's time".into()),
            };
        };
        match knob.kind().is_of_topic() {
            true => self.everywhere(order),
            false => self.at_its_node(order, knob),
        }
    }

    /// Gives the knobs to whoever turns one, unless somebody else has them.
    fn take_knobs(&self, order: &Order) -> Answer {
        let holder = self.holder.lock();
        let mut holder = holder.unwrap_or_else(PoisonError::into_inner);
        match &*holder {
            Some((by, name, used)) if *by != order.by && used.elapsed() < HELD => {
                let held = HELD.as_secs();
                Err(format!(
                    "{name} holds the knobs: they are free {held} s after its last command"
                ))
            }
            _ => {
                *holder = Some((order.by, order.name.clone(), Instant::now()));
                Ok(())
            }
        }
    }

    /// Logs who stops the run, as far as he names himself.
    fn note_stop(&self, order: &Order) {
        if let Some(node) = self.here.first() {
            let name: String = order.name.trim().chars().take(LONGEST_NAME).collect();
            let name = if name.is_empty() {
                "nobody named"
            } else {
                &name
            };
            let what = format!("the run is stopped by {name}");
            self.observer
                .note_presence(self.observer.now(), node, true, &what);
        }
    }

    /// A topic has a part in each process that reads it, and all of them stop.
    fn everywhere(&self, order: &Order) -> Answer {
        let mut answer = Ok(());
        if self.is_hub {
            for info in self.peers.infos() {
                answer = answer.and(self.pass_on(order, info.incarnation));
            }
        }
        answer.and(self.obey(&order.command))
    }

    fn at_its_node(&self, order: &Order, knob: &Knob) -> Answer {
        let node = knob.target();
        if self.here.iter().any(|here| here == node) {
            self.check(knob)?;
            return self.obey(&order.command);
        }
        let infos = self.peers.infos();
        let info = infos
            .iter()
            .find(|info| info.nodes.iter().any(|n| n == node));
        match info.filter(|_| self.is_hub) {
            Some(info) => self.pass_on(order, info.incarnation),
            None => Err(format!("no process runs {node}")),
        }
    }

    fn pass_on(&self, order: &Order, to: u64) -> Answer {
        let question = serde_json::to_vec(order).unwrap_or_default();
        let reply = self.peers.ask_bytes(to, Of::Command, question);
        let answer = reply.and_then(|reply| serde_json::from_slice(&reply).ok());
        answer.unwrap_or_else(|| Err("its process does not answer".to_owned()))
    }

    /// Refuses values that are none, messages that a node here would refuse, and those that name
    /// a file here.
    fn check(&self, knob: &Knob) -> Answer {
        let Knob::Send { node, text } = knob else {
            return ratelab_effects::checked(knob.clone()).map(drop);
        };
        if self.system.file(node, text).is_some() {
            return Err(format!(
                "{text}: a file is named where it is, when {node} is started"
            ));
        }
        let config = &self.config;
        let resolved = self.system.resolve(config.seed, &config.setup, node, text);
        resolved.map(drop)
    }

    /// Sends the command to the graph here, and waits for its answer in the event log.
    fn obey(&self, command: &Command) -> Answer {
        let first = self.observer.events(0).len();
        let sent = self.commands.send(command.clone());
        sent.map_err(|_| "the run is over".to_owned())?;
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            for event in self.observer.events(first) {
                match event.what {
                    EventKind::Applied { command: done, .. } if done == *command => return Ok(()),
                    EventKind::Refused {
                        command: done,
                        reason,
                    } if done == *command => return Err(reason),
                    _ => {}
                }
            }
            thread::sleep(Duration::from_millis(2));
        }
        Err("no answer from the graph in time".to_owned())
    }
}
