//! Executes a run again, with the recorded answers of programs.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::ControlFlow,
    sync::Arc,
    thread,
};

use ratelab::{Command, EventKind, Knob, Speed};
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::{Observer, RunRow};
use ratelab_re_execution::{Overlap, ReExecution, Watch};
use ratelab_system::{AnswersOfNodes, RecordedAnswers, System};

use super::{VerifyError, again, compare::Comparison, events};
use crate::{recorder::Tapped, run::Recording};

/// A run that is to be executed again.
pub struct Execution {
    recording: Arc<Recording>,
    system: Arc<dyn System>,
    experiment: Experiment,
    re_execution: Option<ReExecution>,
}

/// A run that was executed again.
pub struct Executed {
    /// Its recording, with every message and tick.
    pub recording: Arc<Recording>,
    /// Its ticks that overlap.
    pub overlaps: Vec<Overlap>,
}

impl Execution {
    /// Prepares to execute the run of `recording` again.
    ///
    /// # Errors
    /// [`VerifyError`] if it cannot be executed again.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Result<Self, VerifyError> {
        super::refuse_foreign(&recording, system)?;
        let re_execution = events::re_execution(&recording, &**system)?;
        let answers = recording.answers(&**system);
        let config = Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            end: recording.until,
            ..recording.origin.config.clone()
        };
        Ok(Self {
            experiment: again::prepare(&recording, system, config, answers, re_execution.as_ref())?,
            recording,
            system: system.clone(),
            re_execution,
        })
    }

    /// Reads the graph while it runs.
    pub fn observer(&self) -> Observer {
        self.experiment.observer()
    }

    /// Begins to execute the run up to the first `operations` of overlap number `overlap`, and
    /// holds it there; `None` for a run without overlaps.
    pub fn hold(self, overlap: usize, operations: usize) -> Option<Held> {
        let (experiment, mut re_execution) = (self.experiment, self.re_execution?);
        re_execution.hold(overlap, operations);
        let (observer, watch) = (experiment.observer(), re_execution.watch());
        // It ends with the hold.
        thread::spawn(move || drop(experiment.run_with(&mut re_execution)));
        Some(Held { observer, watch })
    }

    /// Executes the run. Its messages and ticks must be the recorded ones, if the recording
    /// has any.
    ///
    /// # Errors
    /// [`VerifyError`] if it is another run.
    pub fn run(self) -> Result<Executed, VerifyError> {
        let Self {
            recording,
            system,
            experiment,
            re_execution,
        } = self;
        let threads = re_execution.is_some();
        let overlaps = re_execution
            .as_ref()
            .map_or_else(Vec::new, ReExecution::overlaps);
        let taps = experiment.taps();
        let mut rows = taps.empty_rows(&recording.origin.topology);
        let mut comparison = Comparison::new(&recording, threads, &taps);
        drop(taps);
        // A recording without any tick has nothing to compare them with.
        let compares = recording.ticks.iter().any(|ticks| !ticks.is_empty());
        let keep = |row: RunRow| {
            let difference = compares.then(|| comparison.row(&row)).flatten();
            rows.add(row);
            difference
        };
        let ran = again::run_again(experiment, re_execution, keep, || ControlFlow::Continue(()));
        let missing = || comparison.missing().filter(|_| compares);
        let difference = ran.difference.or_else(missing);
        super::judge(&recording, &system, threads, difference, ran.diverged)?;
        let recording = Arc::new(recording.with_rows(rows));
        Ok(Executed {
            recording,
            overlaps,
        })
    }
}

/// A run that is executed again up to an operation, and held there until this is dropped.
pub struct Held {
    observer: Observer,
    watch: Arc<Watch>,
}

impl Held {
    /// Reads the graph as it is held.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Lets it go on to the first `operations` of the overlap.
    pub fn allow(&self, operations: usize) {
        self.watch.allow(operations);
    }

    /// Returns the number of operations done; `None` before all nodes are at rest there.
    pub fn done(&self) -> Option<usize> {
        self.watch.held()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.watch.end();
    }
}

impl Recording {
    /// Whoever makes a recording may name any file. That of a program is recorded in a form that
    /// starts none; this is one in another form, made by hand.
    pub fn program_in_disguise(&self, system: &dyn System) -> Option<&Knob> {
        let mut messages = self.messages_to_nodes();
        messages.find_map(|(knob, [node, text])| {
            let is_one = |looks| system.knobs().is_program(node, text, looks);
            (is_one(true) && !is_one(false)).then_some(knob)
        })
    }

    /// Returns the texts that its nodes were sent, each with the name of the node.
    fn messages_to_nodes(&self) -> impl Iterator<Item = (&Knob, [&str; 2])> {
        let config = &self.origin.config;
        let timed = config.knobs.iter().map(|timed| &timed.knob);
        let turned = self
            .events
            .iter()
            .filter_map(|event| match event.applied()? {
                Command::Set(knob) => Some(knob),
                _ => None,
            });
        config
            .setup
            .iter()
            .chain(timed)
            .chain(turned)
            .filter_map(|knob| match knob {
                Knob::Send { node, text } => Some((knob, [&**node, &**text])),
                _ => None,
            })
    }

    /// Returns what the programs behind its nodes answered. Nodes without a recorded tick have no
    /// answers.
    pub(super) fn answers(&self, system: &dyn System) -> AnswersOfNodes {
        let messages = self.messages_to_nodes();
        let programs =
            messages.filter(|(_, [node, text])| system.knobs().is_program(node, text, false));
        let nodes: BTreeSet<&str> = programs.map(|(_, [node, _])| node).collect();
        let answers = nodes
            .into_iter()
            .filter_map(|node| Some((node.to_owned(), Arc::new(self.answers_of(node)?))));
        answers.collect()
    }

    /// By the start of its tick the message that `node` published in it, or why it crashed.
    fn answers_of(&self, node: &str) -> Option<RecordedAnswers> {
        let graph = &self.origin.topology;
        let index = graph.node(node)?;
        let mut topics = graph.topics.iter();
        let topic = topics.position(|topic| topic.publishers == [index])?;
        let messages = self.topics.get(topic)?;
        let mut ticks = self.ticks.get(index)?.iter().peekable();
        ticks.peek()?;
        let mut answers = BTreeMap::new();
        for (number, head) in messages.heads().iter().enumerate() {
            // It is of the first tick that had not ended before it, and has no other.
            let is_before =
                |tick: &&ratelab_metrics::TickRecord| tick.ends.is_none_or(|ends| ends < head.at);
            while ticks.next_if(is_before).is_some() {}
            if let Some(tick) = ticks.next() {
                answers.insert(tick.at, Ok(messages.row(number).to_vec()));
            }
        }
        for event in &self.events {
            if let EventKind::Crashed {
                node: crashed,
                cause,
            } = &event.what
                && crashed == node
            {
                answers.insert(event.at, Err(cause.clone()));
            }
        }
        Some(answers)
    }
}
