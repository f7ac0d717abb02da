//! All events in virtual time but due ticks of nodes with a thread of their own.
//!
//! Within an instant: ticks end, messages arrive, timers of executors are due, then nodes
//! with a thread of their own begin, by priority, and at last executors pick, until nothing
//! is left to do at that instant.

use super::Scheduler;
use crate::runtime::{
    clock::ClockExit,
    command::Command,
    dispatch::{AgendaItem, Call, Phase, Place},
    node::{Fault, GO_ON, Tick},
    time::Time,
};

impl Scheduler<'_> {
    /// The next event of the dispatcher, if it comes before the next due tick.
    pub(super) fn dispatched(&self) -> Option<Place> {
        let place = self.graph.dispatcher.next()?;
        let due = self.queue.next().map(|node| {
            // Before a late start of the same node: that tick is skipped.
            let rank = self.graph.nodes[node].rank(node);
            Place::before(self.queue.next_at(), Phase::Starts, rank)
        });
        Some(place).filter(|place| due.is_none_or(|due| *place < due))
    }

    /// Processes the event of the dispatcher at `place`.
    pub(super) fn dispatch(&mut self, place: Place) -> Result<Option<ClockExit>, Fault> {
        let now = place.at.max(self.graph.now());
        self.last_tick = Some(now);
        self.graph.control.set_now(now);
        let happened = match place.phase {
            Phase::Picks => self.pick(now),
            phase => {
                let entry = self.graph.dispatcher.pop();
                entry.map(|(_, entry)| (entry.node, self.happen(phase, entry, now)))
            }
        };
        match happened {
            Some((node, outcome)) => self.conclude(node, now, outcome),
            None => Ok(None),
        }
    }

    /// Processes an event of a node.
    fn happen(&mut self, phase: Phase, entry: AgendaItem, now: Time) -> Tick {
        let (graph, node) = (&mut *self.graph, entry.node);
        let (dispatcher, nodes) = (&mut graph.dispatcher, &mut graph.nodes[..]);
        match phase {
            Phase::Ends => {
                let outcome = nodes[node].finish(now, now);
                dispatcher.ended(node, now, nodes);
                self.go_on(node, now, false);
                outcome
            }
            Phase::Arrives => {
                if !nodes[node].is_crashed() {
                    dispatcher.arrived(entry, now, nodes);
                    self.go_on(node, now, true);
                }
                GO_ON
            }
            Phase::Starts => {
                let waited = nodes[node].waited();
                let due = match nodes[node].is_triggered() {
                    true => nodes[node].take(now),
                    false => waited,
                };
                let outcome = due.map_or(GO_ON, |due| self.start(node, due, now));
                self.go_on(node, now, false);
                outcome
            }
            _ => {
                dispatcher.due(node, now, nodes);
                GO_ON
            }
        }
    }

    /// Has a triggered node with a thread of its own begin, if it is idle and a message
    /// waits: at once, or late if the thread was `asleep`.
    fn go_on(&mut self, index: usize, now: Time, asleep: bool) {
        let graph = &mut *self.graph;
        let node = &mut graph.nodes[index];
        if !node.has_thread() || node.is_occupied() || node.oldest(now).is_none() {
            return;
        }
        let starts = node.plan_start(now, asleep);
        graph.dispatcher.plan_start(index, starts, &graph.nodes);
    }

    /// Has an executor call its next callback.
    fn pick(&mut self, now: Time) -> Option<(usize, Tick)> {
        let graph = &mut *self.graph;
        let call = graph.dispatcher.pick(now, &mut graph.nodes)?;
        let node = call.node();
        let called = &mut graph.nodes[node];
        let due = match call {
            Call::Timer { .. } => called.call_timer(now),
            Call::Message { input, .. } => called.take_from(input, now),
            Call::Messages { .. } => called.take(now),
        };
        if let Call::Timer { .. } = call {
            graph.dispatcher.called(node, &graph.nodes);
        }
        let outcome = due.map_or(GO_ON, |due| self.start(node, due, now));
        let graph = &mut *self.graph;
        if graph.nodes[node].running().is_none() {
            graph.dispatcher.ended(node, now, &mut graph.nodes);
        }
        Some((node, outcome))
    }

    /// Has the dispatcher follow a command for a node.
    pub(super) fn tell_dispatcher(&mut self, command: &Command, at: Time) {
        let graph = &mut *self.graph;
        if let Command::Set(knob) = command
            && let Some(crashed) = knob.crashes()
            && let Ok(node) = graph.control.node_index(knob.target())
        {
            graph
                .dispatcher
                .changed(node, crashed, at, &mut graph.nodes);
        }
    }
}
