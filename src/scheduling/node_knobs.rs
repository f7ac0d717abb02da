//! Knobs of nodes: some are of the node, all others of its schedule.

use super::{
    schedule::Schedule,
    timetable::{Member, SchedulerEvent},
};
use crate::{
    control::{
        command::KnobRefusal,
        knob::Knob,
        state::{EventKind, RunWriter},
    },
    node::{Fault, Flow, NodeCrash, NodeSlot, TickResult},
    record::NodeRecord,
    time::Time,
};

impl Schedule {
    /// Checks that a node has this knob.
    ///
    /// # Errors
    /// The reason, with a remedy.
    pub(crate) fn check(
        &self,
        node: usize,
        slot: &NodeSlot,
        knob: &Knob,
    ) -> Result<(), KnobRefusal> {
        slot.check(knob)?;
        match knob {
            Knob::Send { .. }
            | Knob::Parameter { .. }
            | Knob::Crash { .. }
            | Knob::Restart { .. } => Ok(()),
            knob => {
                let (task_set, member) = self.place(node);
                self.task_sets[task_set].scheduler.check(member, knob)
            }
        }
    }

    /// Sets a knob of a node at run time `now`; returns the one that was in force.
    ///
    /// # Errors
    /// The reason and a remedy.
    pub(crate) fn set(
        &mut self,
        node: usize,
        slot: &mut NodeSlot,
        knob: &Knob,
        now: Time,
    ) -> Result<Knob, KnobRefusal> {
        self.check(node, slot, knob)?;
        let (task_set, member) = self.place(node);
        match knob {
            Knob::Send { node, text } => {
                let before = slot.ask(|node| node.on_order(text))?;
                Ok(Knob::Send {
                    node: node.clone(),
                    text: before,
                })
            }
            Knob::Parameter { node, name, value } => {
                let before = slot.ask(|node| node.set_parameter(name, value, now))?;
                Ok(Knob::Parameter {
                    node: node.clone(),
                    name: name.clone(),
                    value: before,
                })
            }
            Knob::Crash { .. } => {
                let was = self.condition(node);
                self.crash(node, slot, now);
                Ok(was)
            }
            Knob::Restart { .. } => self.restart(node, slot, now),
            knob => self.with(task_set, now, false, |scheduler, timetable| {
                scheduler.set(member, knob, timetable)
            }),
        }
    }

    /// Stops the node's ticks. Messages that it holds back are lost.
    fn crash(&mut self, node: usize, slot: &mut NodeSlot, now: Time) {
        let (task_set, member) = self.place(node);
        self.send(task_set, SchedulerEvent::Crashed { member }, now, false);
        slot.abort();
        self.record(node, NodeRecord::Crashed);
    }

    fn restart(
        &mut self,
        node: usize,
        slot: &mut NodeSlot,
        now: Time,
    ) -> Result<Knob, KnobRefusal> {
        let (task_set, member) = self.place(node);
        let was = self.condition(node);
        // A node that is built once more crashes first, another one only once it has begun anew.
        if slot.again.is_some() {
            self.crash(node, slot, now);
        }
        slot.begin_anew()?;
        if !self.state(node, Time::ZERO).crashed {
            self.crash(node, slot, now);
        }
        self.record(node, NodeRecord::Restarted);
        self.send(task_set, SchedulerEvent::Restarted { member }, now, false);
        Ok(was)
    }

    /// Returns the outcome of a tick for the run, from the tick's own `outcome`. After a
    /// [`NodeCrash`] the node is crashed from the tick's begin on, the log has the cause, and the
    /// run goes on.
    ///
    /// # Errors
    /// [`Fault`] for any other failure of the tick.
    #[inline]
    pub(super) fn outlive(
        &mut self,
        slot: &mut NodeSlot,
        node: usize,
        at: Time,
        outcome: TickResult,
        state: &RunWriter,
    ) -> Result<Flow, Fault> {
        match outcome {
            Ok(flow) => Ok(flow),
            Err(cause) if cause.is::<NodeCrash>() => {
                self.crash(node, slot, at);
                let (node, cause) = (self.name(node), cause.to_string());
                state.note(at, EventKind::Crashed { node, cause });
                Ok(Flow::Continue)
            }
            Err(cause) => {
                let node = self.name(node);
                Err(Fault { node, at, cause })
            }
        }
    }

    fn name(&self, node: usize) -> String {
        self.member(node).name.to_string()
    }

    /// Returns the knob that brings a node to where it is: running or crashed.
    fn condition(&self, index: usize) -> Knob {
        let node = self.name(index);
        if self.state(index, Time::ZERO).crashed {
            Knob::Crash { node }
        } else {
            Knob::Restart { node }
        }
    }

    fn record(&self, node: usize, record: NodeRecord) {
        self.member(node).records.node(|| record);
    }

    fn member(&self, node: usize) -> &Member {
        let (task_set, member) = self.place(node);
        &self.task_sets[task_set].members[member]
    }
}
