//! What programs answered in a recorded run.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use ratelab::{Command, EventKind, Knob};
use ratelab_system::{AnswersOfNodes, RecordedAnswers, System};

use crate::run::Recording;

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
        let knobs = config.setup.iter().chain(timed).chain(turned);
        knobs.filter_map(|knob| match knob {
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
