//! Commands from dashboards: which process carries them out, and who may give them.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{Command, EventKind, Knob, sync::lock};
use ratelab_experiment::Experiment;
use ratelab_system::System;

use crate::{
    error::{self, NetworkError},
    key::Of,
    net::{self, Question},
    part::LocalPart,
    telemetry::{Answer, Info, Order},
};

/// Longest wait for the graph to answer.
const PATIENCE: Duration = Duration::from_millis(500);

/// Time without a command after which another dashboard may take the knobs.
const HELD: Duration = Duration::from_secs(10);

/// The most commands that are answered at once: others may send any number.
const MAX_ANSWERING: usize = 16;

/// The longest name of a dashboard in the log (characters).
const LONGEST_NAME: usize = 100;

/// Carries out the commands for this process. The process that listens passes on those for
/// the others, so that all dashboards ask the same one, and one of them holds the knobs.
pub(crate) struct Commands {
    system: Arc<dyn System>,
    commands: Sender<Command>,
    part: Arc<LocalPart>,
    /// Number and name of the dashboard that has the knobs, and when it used them last.
    holder: Mutex<Option<(u64, String, Instant)>>,
}

impl Commands {
    /// Answers commands for `part` of an experiment, for as long as the session is open.
    pub(crate) fn answer(
        experiment: &Experiment,
        part: &Arc<LocalPart>,
    ) -> Result<(), NetworkError> {
        let commands = Arc::new(Self {
            system: experiment.system().clone(),
            commands: experiment.commands(),
            part: part.clone(),
            holder: Mutex::default(),
        });
        let key = part.peers.keys.endpoint(part.own.incarnation, Of::COMMAND);
        let answering = Arc::new(AtomicUsize::new(0));
        net::answers(&part.peers.session, key, move |question| {
            if answering.fetch_add(1, Ordering::SeqCst) >= MAX_ANSWERING {
                answering.fetch_sub(1, Ordering::SeqCst);
                return respond(&question, &Err("busy: ask again".to_owned()));
            }
            let (commands, done) = (commands.clone(), answering.clone());
            // The graph takes its time, and the connection must not wait for it.
            let spawned = error::spawn("command", move || {
                commands.reply(&question);
                done.fetch_sub(1, Ordering::SeqCst);
            });
            // Without a thread the question is dropped, and whoever asked hears of no answer.
            if spawned.is_err() {
                answering.fetch_sub(1, Ordering::SeqCst);
            }
        })
    }

    fn reply(&self, question: &Question) {
        let answer: Answer = match serde_json::from_slice(&question.payload()) {
            Ok(order) => self.decide(&order),
            Err(_) => Err("no command: expected one of this version of ratelab".to_owned()),
        };
        respond(question, &answer);
    }

    fn decide(&self, order: &Order) -> Answer {
        if self.part.own.is_hub {
            self.take_knobs(order)?;
        }
        match &order.command {
            Command::Set(knob) if !knob.kind().is_of_topic() => self.at_its_node(order, knob),
            Command::Set(_) => self.everywhere(order),
            Command::Stop => {
                self.note_stop(order);
                self.everywhere(order)
            }
            _ => Err(
                "this run has several processes: it can be neither paused nor handed over".into(),
            ),
        }
    }

    /// Gives the knobs to whoever turns one, unless somebody else has them.
    fn take_knobs(&self, order: &Order) -> Answer {
        let mut holder = lock(&self.holder);
        if let Some((by, name, used)) = &*holder
            && *by != order.by
            && used.elapsed() < HELD
        {
            let held = HELD.as_secs();
            return Err(format!(
                "{name} holds the knobs: they are free {held} s after its last command"
            ));
        }
        *holder = Some((order.by, order.name.clone(), Instant::now()));
        Ok(())
    }

    /// Logs who stops the run, as far as he names himself.
    fn note_stop(&self, order: &Order) {
        let name: String = order.name.trim().chars().take(LONGEST_NAME).collect();
        let name = if name.is_empty() {
            "nobody named"
        } else {
            &name
        };
        let what = format!("the run is stopped by {name}");
        if let Some(node) = self.part.own.nodes.first() {
            let now = self.part.times.observer.now();
            self.part.times.run.note_presence(now, node, true, &what);
        }
    }

    /// Carries out a command for a topic in every process that has a part of it.
    fn everywhere(&self, order: &Order) -> Answer {
        let mut answer = Ok(());
        if self.part.own.is_hub {
            for info in self.part.peers.infos() {
                answer = answer.and(self.pass_on(order, &info));
            }
        }
        answer.and(self.obey(&order.command))
    }

    fn at_its_node(&self, order: &Order, knob: &Knob) -> Answer {
        let node = knob.target();
        if self.part.own.runs(node) {
            self.check(knob)?;
            return self.obey(&order.command);
        }
        let there = self.part.peers.find(|info| info.runs(node));
        match there.filter(|_| self.part.own.is_hub) {
            Some(info) => self.pass_on(order, &info),
            None => Err(format!("no process runs {node}")),
        }
    }

    fn pass_on(&self, order: &Order, to: &Info) -> Answer {
        let silent = "its process does not answer";
        self.part.peers.order(to.incarnation, order, silent)
    }

    /// Refuses values that are none, messages that a node here would refuse, and those that name
    /// a file here.
    fn check(&self, knob: &Knob) -> Answer {
        if let Knob::Send { node, text } = knob
            && self.system.knobs().file(node, text).is_some()
        {
            return Err(format!(
                "{text}: a file is named where it is, when {node} is started"
            ));
        }
        let config = &self.part.own.config;
        let resolved = (self.system).resolved(config.seed, &config.setup, knob.clone());
        resolved.map(drop)
    }

    /// Sends the command to the graph here, and waits for its answer in the event log.
    fn obey(&self, command: &Command) -> Answer {
        let first = self.part.times.observer.events(0).len();
        let sent = self.commands.send(command.clone());
        sent.map_err(|_| "the run is over".to_owned())?;
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            for event in self.part.times.observer.events(first) {
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

/// Sends `answer` to whoever asked.
fn respond(question: &Question, answer: &Answer) {
    question.answer(serde_json::to_vec(answer).unwrap_or_default());
}
