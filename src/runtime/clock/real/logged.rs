//! A node whose steps are timed by the wall, and logged.

use std::time::Duration;

use super::ThreadContext;
use crate::runtime::{
    clock::{
        steps::{self, Outcome, TickEnd},
        wall::Wall,
    },
    command::Command,
    reexecution::{Entry, Stream},
    scheduled_node::ScheduledNode,
    sync::Arc,
    time::Time,
};

/// A node with its index and the log of its steps, on whatever threads they are.
pub(super) struct LoggedNode<'g> {
    pub(super) index: usize,
    pub(super) node: &'g mut ScheduledNode,
    log: Arc<Stream>,
}

impl<'g> LoggedNode<'g> {
    pub(super) fn new(index: usize, node: &'g mut ScheduledNode, log: Arc<Stream>) -> Self {
        Self { index, node, log }
    }

    pub(super) fn name(&self) -> Arc<str> {
        self.node.entry.name.clone()
    }

    /// Has the node carry out a command.
    pub(super) fn obey(&mut self, context: &ThreadContext, command: &Command, at: Time) {
        let event = steps::obey_node(self.node, &context.state, command, at) as u64;
        self.log.note(Entry::Obey { at, event });
    }

    /// Has the tick at `at` take a message of this topic.
    pub(super) fn choose_input(&mut self, input: usize, at: Time) {
        self.node.choose_input(input);
        self.log.note(Entry::Choose { at, input });
    }

    /// Begins the next tick, at run time `began`; `None` if the messages are not yet the inputs
    /// of one. `passed` gives the limit before which due ticks count as missed, for a tick that
    /// ended at that run time.
    pub(super) fn tick(
        &mut self,
        context: &ThreadContext,
        wall: &Wall,
        began: Time,
        passed: impl FnOnce(Time) -> Time,
    ) -> Option<Outcome> {
        let Some(due) = steps::take_due(self.node, &context.state, began) else {
            self.log.note(Entry::Look { at: began });
            return None;
        };
        let mut entry = Entry::Start { began };
        let outcome = steps::tick(self.node, due, began, || {
            let ended = wall.now();
            let took: Duration = ended.since(began);
            let passed = passed(ended);
            entry = Entry::Tick {
                began,
                took,
                passed,
            };
            TickEnd { took, passed }
        });
        self.log.note(entry);
        Some(outcome)
    }

    /// Ends a tick that takes time. Ticks due before `passed` are missed.
    pub(super) fn finish(&mut self, context: &ThreadContext, ended: Time, passed: Time) -> Outcome {
        let outcome = steps::finish(self.node, &context.state, ended, passed);
        self.log.note(Entry::Finish { ended, passed });
        outcome
    }

    /// Ends the node's own thread. Ticks due before `before` are missed.
    pub(super) fn leave(&mut self, before: Time) {
        self.node.overrun_before(before);
        self.log.note(Entry::Leave { before });
    }
}
