//! What programs answered in a recorded run.

use std::{collections::BTreeMap, sync::Arc};

use ratelab::{Command, EventKind, Knob};
use ratelab_study::system::{AnswersOfNodes, RecordedAnswers, System};

use crate::recorded::Recording;

impl Recording {
    /// The programs that a message names, each with its node. Whoever makes a recording may name
    /// any: run again, it starts none that was not named here as well.
    pub fn programs<'a>(&'a self, system: &'a dyn System) -> impl Iterator<Item = &'a Knob> {
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
        knobs.filter(move |knob| match knob {
            Knob::Send { node, text } => system.is_program(node, text),
            _ => false,
        })
    }

    /// What the programs behind its nodes answered. Nodes without a recorded tick have no answers.
    pub(super) fn answers(&self, system: &dyn System) -> AnswersOfNodes {
        let nodes = self.programs(system).filter_map(|knob| {
            let node = knob.target();
            Some((node.to_owned(), Arc::new(self.answers_of(node)?)))
        });
        nodes.collect()
    }

    /// By the start of its tick the message that `node` published in it, or why it crashed.
    fn answers_of(&self, node: &str) -> Option<RecordedAnswers> {
        let graph = &self.origin.topology;
        let index = graph.nodes.iter().position(|known| known.name == node)?;
        let mut topics = graph.topics.iter();
        let topic = topics.position(|topic| topic.publishers == [index])?;
        let messages = self.topics.get(topic)?;
        let mut ticks = self.ticks.get(index)?.iter().peekable();
        ticks.peek()?;
        let mut answers = BTreeMap::new();
        for (number, head) in messages.heads().iter().enumerate() {
            // It is of the first tick that had not ended before it, and has no other.
            let is_before =
                |tick: &&ratelab_account::TickRecord| tick.ends.is_none_or(|ends| ends < head.at);
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
