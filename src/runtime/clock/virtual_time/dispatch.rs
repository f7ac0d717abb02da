//! Triggered nodes and executors in virtual time.
//!
//! Within an instant: ticks end, messages arrive, timers of executors are due, then nodes
//! with a thread of their own begin, by priority, and at last executors pick, until nothing
//! is left to do at that instant.

use super::{NodeEventKind, Scheduler};
use crate::runtime::{
    clock::ClockExit,
    command::Command,
    executor::{AgendaItem, Call, Phase, Place},
    node::{Fault, GO_ON, Tick},
    time::Time,
};

impl Scheduler<'_> {
    /// The next event of the dispatcher, if it comes before all others.
    pub(super) fn dispatched(&self) -> Option<Place> {
        let place = self.graph.dispatcher.as_ref()?.next()?;
        let other = self.queue.next().map(|event| {
            let phase = match event.kind {
                NodeEventKind::Ends => Phase::Ends,
                NodeEventKind::Starts | NodeEventKind::Due => Phase::Starts,
            };
            let rank = self.graph.nodes[event.node].rank(event.node);
            Place::after(event.at, phase, rank)
        });
        Some(place).filter(|place| other.is_none_or(|other| *place < other))
    }

    /// Processes the event of the dispatcher at `place`.
    pub(super) fn dispatch(&mut self, place: Place) -> Result<Option<ClockExit>, Fault> {
        let now = place.at.max(self.graph.now());
        self.last_tick = Some(now);
        self.graph.control.set_now(now);
        let (node, outcome) = match place.phase {
            Phase::Picks => match self.pick(now) {
                Some((node, outcome)) => (node, outcome),
                None => return Ok(None),
            },
            _ => {
                let Some(dispatcher) = &mut self.graph.dispatcher else {
                    return Ok(None);
                };
                let Some((_, entry)) = dispatcher.pop() else {
                    return Ok(None);
                };
                (entry.node, self.happen(place.phase, entry, now))
            }
        };
        self.conclude(node, now, outcome)
    }

    /// Processes an event of a node.
    fn happen(&mut self, phase: Phase, entry: AgendaItem, now: Time) -> Tick {
        let (graph, node) = (&mut *self.graph, entry.node);
        let Some(dispatcher) = &mut graph.dispatcher else {
            return GO_ON;
        };
        let nodes = &mut graph.nodes[..];
        match phase {
            Phase::Ends => {
                let outcome = nodes[node].finish(now, Time::ZERO);
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
                nodes[node].waited();
                let outcome = match nodes[node].take(now) {
                    Some(due) => self.start(node, due, now),
                    None => GO_ON,
                };
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
        let node = &mut self.graph.nodes[index];
        if !node.has_thread() || node.is_occupied() || node.oldest(now).is_none() {
            return;
        }
        let starts = node.plan_start(now, asleep);
        if let Some(dispatcher) = &mut self.graph.dispatcher {
            dispatcher.plan_start(index, starts, &self.graph.nodes);
        }
    }

    /// Has an executor call its next callback.
    fn pick(&mut self, now: Time) -> Option<(usize, Tick)> {
        let graph = &mut *self.graph;
        let call = graph.dispatcher.as_mut()?.pick(now, &mut graph.nodes)?;
        let node = call.node();
        let called = &mut graph.nodes[node];
        let due = match call {
            Call::Timer { .. } => called.call_timer(now),
            Call::Message { input, .. } => called.take_from(input, now),
            Call::Messages { .. } => called.take(now),
        };
        if let Call::Timer { .. } = call {
            graph.dispatcher.as_mut()?.called(node, &graph.nodes);
        }
        let outcome = due.map_or(GO_ON, |due| self.start(node, due, now));
        if self.graph.nodes[node].running().is_none() {
            let graph = &mut *self.graph;
            graph
                .dispatcher
                .as_mut()?
                .ended(node, now, &mut graph.nodes);
        }
        Some((node, outcome))
    }

    /// A tick of a triggered node or of one of an executor takes until `ends`.
    pub(super) fn began(&mut self, node: usize, ends: Time, now: Time) {
        let graph = &mut *self.graph;
        if let Some(dispatcher) = &mut graph.dispatcher {
            dispatcher.began(node, ends, now, &mut graph.nodes);
        }
    }

    /// Has the dispatcher follow a command for a node.
    pub(super) fn tell_dispatcher(&mut self, command: &Command, at: Time) {
        let graph = &mut *self.graph;
        let (Some(dispatcher), Command::Set(knob)) = (&mut graph.dispatcher, command) else {
            return;
        };
        let Some(crashed) = knob.crashes() else {
            return;
        };
        if let Ok(node) = graph.control.node_index(knob.target()) {
            dispatcher.changed(node, crashed, at, &mut graph.nodes);
        }
    }
}
