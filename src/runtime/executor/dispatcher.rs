//! The nodes that do more than tick at a rate on a thread of their own: those that
//! messages trigger, and those of executors.

use super::{
    agenda::{Agenda, AgendaItem, Phase, Place},
    callback::Callback,
    events::EventOrder,
    kind::Executor,
    preemptive::{Preemptive, Urgency},
    queue::{AtInstant, Call, CallbackQueue},
    windows::WindowOrder,
};
use crate::runtime::{
    placement::Placement,
    scheduled_node::ScheduledNode,
    sync::Arc,
    time::Time,
    trigger::{Arrival, Arrivals},
};

/// The events of these nodes under the virtual clock.
#[derive(Default)]
pub(crate) struct Dispatcher {
    agenda: Agenda,
    arrivals: Arc<Arrivals>,
    executors: Vec<ExecutorState>,
    /// The run time since which executors have something to look at.
    noticed: Time,
    /// The executor and number of each node that has one, by its index.
    of: Vec<Option<(usize, usize)>>,
    /// The planned due time of each node's timer under an executor.
    timers: Vec<Option<Place>>,
}

/// An executor of a graph.
struct ExecutorState {
    queue: Box<dyn CallbackQueue>,
    /// Whether something has changed since its last look.
    attentive: bool,
}

impl Dispatcher {
    pub(crate) fn new(arrivals: Arc<Arrivals>) -> Self {
        Self {
            arrivals,
            ..Self::default()
        }
    }

    /// Adds an executor with its nodes, given by their indices, in the order of
    /// registration; returns where they tick.
    pub(crate) fn add(&mut self, kind: Executor, members: &[(usize, Callback)]) -> Placement {
        let Some(queue) = queue_of(kind, members) else {
            return Placement::Let;
        };
        let executor = self.executors.len();
        for (member, (node, _)) in members.iter().enumerate() {
            let len = self.of.len().max(node + 1);
            self.of.resize(len, None);
            self.timers.resize(len, None);
            self.of[*node] = Some((executor, member));
        }
        let attentive = false;
        self.executors.push(ExecutorState { queue, attentive });
        Placement::Executor(executor)
    }

    /// Plans the due times of all timers, and what the nodes with threads of their own have
    /// begun or may begin: perhaps under the other clock.
    pub(crate) fn prepare(&mut self, now: Time, nodes: &mut [ScheduledNode]) {
        self.collect_from(now);
        for node in 0..nodes.len() {
            if nodes[node].is_triggered() && nodes[node].has_thread() {
                self.prepare_thread(node, now, nodes);
            }
        }
        self.prepare_timers(nodes);
    }

    fn prepare_thread(&mut self, node: usize, now: Time, nodes: &mut [ScheduledNode]) {
        self.agenda.forget(node);
        let known = &nodes[node];
        match known.running() {
            Some(running) => {
                let (ends, agenda) = (running.ends, &mut self.agenda);
                AtInstant { now, nodes, agenda }.plan_end(node, ends);
            }
            None if known.is_occupied() => self.plan_start(node, known.next_at(), nodes),
            None if known.oldest(now).is_some() => self.agenda.add_arrival(now, node, 0),
            None => {}
        }
    }

    fn prepare_timers(&mut self, nodes: &[ScheduledNode]) {
        for (node, known) in nodes.iter().enumerate().take(self.of.len()) {
            if let Some((executor, member)) = self.of[node] {
                self.executors[executor].queue.reschedule(member);
                self.plan_timer(node, known);
            }
        }
    }

    /// Plans the next due time of a node's timer.
    fn plan_timer(&mut self, node: usize, known: &ScheduledNode) {
        let Some((_, member)) = self.of[node] else {
            return;
        };
        if let Some(place) = self.timers[node].take() {
            self.agenda.remove(place);
        }
        let due = known.due();
        if due < Time::MAX {
            let rank = (0, member);
            self.timers[node] = Some(self.agenda.add(due, Phase::Released, rank, node));
        }
    }

    /// The first event; at the end of an instant, executors look for something to start.
    pub(crate) fn next(&self) -> Option<Place> {
        let attentive = self.executors.iter().any(|executor| executor.attentive);
        let picks = attentive.then(|| Place::after(self.noticed, Phase::Picks, (0, 0)));
        self.agenda.first().into_iter().chain(picks).min()
    }

    /// Removes the first event of the agenda.
    pub(crate) fn pop(&mut self) -> Option<(Place, AgendaItem)> {
        self.agenda.pop()
    }

    /// Plans the arrivals of the messages that were published since the last look.
    pub(crate) fn collect(&mut self) {
        self.collect_from(Time::ZERO);
    }

    /// Removes the arrivals to come, for the other clock.
    pub(crate) fn take_arrivals(&mut self) -> Vec<Arrival> {
        self.collect();
        std::mem::take(&mut self.agenda).arrivals()
    }

    /// The list of arrivals that nobody has looked at.
    pub(crate) fn arrivals(&self) -> &Arrivals {
        &self.arrivals
    }

    /// Plans those from `first` on.
    fn collect_from(&mut self, first: Time) {
        let arrivals = self.arrivals.take().into_iter();
        for arrival in arrivals.filter(|arrival| arrival.at >= first) {
            self.agenda
                .add_arrival(arrival.at, arrival.node, arrival.input);
        }
    }

    /// Plans the start of a tick on the node's own thread.
    pub(crate) fn plan_start(&mut self, node: usize, at: Time, nodes: &[ScheduledNode]) {
        let rank = nodes[node].rank(node);
        self.agenda.add(at, Phase::Starts, rank, node);
    }

    /// Calls a function of the node's executor.
    fn with<R>(
        &mut self,
        node: usize,
        now: Time,
        nodes: &mut [ScheduledNode],
        call: impl FnOnce(&mut dyn CallbackQueue, usize, &mut AtInstant<'_>) -> R,
    ) -> Option<R> {
        let (executor, member) = self.of.get(node).copied().flatten()?;
        let agenda = &mut self.agenda;
        let executor = &mut self.executors[executor];
        executor.attentive = true;
        self.noticed = now;
        let mut stage = AtInstant { now, nodes, agenda };
        Some(call(&mut *executor.queue, member, &mut stage))
    }

    /// The timer of a node is due.
    pub(crate) fn due(&mut self, node: usize, now: Time, nodes: &mut [ScheduledNode]) {
        self.timers[node] = None;
        let next = self.with(node, now, nodes, |queue, member, stage| {
            queue.due(member, stage)
        });
        if next.flatten().is_some() {
            self.plan_timer(node, &nodes[node]);
        }
    }

    /// A message has arrived for a node of an executor.
    pub(crate) fn arrived(&mut self, entry: AgendaItem, now: Time, nodes: &mut [ScheduledNode]) {
        let AgendaItem { node, input } = entry;
        self.with(node, now, nodes, |queue, member, stage| {
            queue.arrived(member, input, stage);
        });
    }

    /// The next callback to be called, of the first executor that has one.
    pub(crate) fn pick(&mut self, now: Time, nodes: &mut [ScheduledNode]) -> Option<Call> {
        let call = self.executors.iter_mut().find_map(|executor| {
            if !executor.attentive {
                return None;
            }
            let agenda = &mut self.agenda;
            let call = executor.queue.next(&mut AtInstant {
                now,
                nodes: &mut *nodes,
                agenda,
            });
            executor.attentive = call.is_some();
            call
        })?;
        if let Call::Timer { node, .. } = call
            && self.timers[node].is_none()
        {
            self.plan_timer(node, &nodes[node]);
        }
        Some(call)
    }

    /// A tick began that ends at `ends`.
    pub(crate) fn began(
        &mut self,
        node: usize,
        ends: Time,
        now: Time,
        nodes: &mut [ScheduledNode],
    ) {
        let known = self.with(node, now, nodes, |queue, member, stage| {
            queue.began(member, ends, stage);
        });
        if known.is_none() {
            let agenda = &mut self.agenda;
            AtInstant { now, nodes, agenda }.plan_end(node, ends);
        }
    }

    /// The callback of a node of an executor is over.
    pub(crate) fn ended(&mut self, node: usize, now: Time, nodes: &mut [ScheduledNode]) {
        self.with(node, now, nodes, |queue, member, stage| {
            queue.ended(member, stage);
        });
    }

    /// The due times of a node have changed, or it has `crashed` and perhaps begun again.
    pub(crate) fn changed(
        &mut self,
        node: usize,
        crashed: bool,
        now: Time,
        nodes: &mut [ScheduledNode],
    ) {
        if crashed {
            self.agenda.forget(node);
        }
        let known = self.with(node, now, nodes, |queue, member, _| match crashed {
            true => queue.forget(member),
            false => queue.reschedule(member),
        });
        if known.is_some() {
            self.plan_timer(node, &nodes[node]);
        }
        let again = crashed && !nodes[node].is_crashed();
        for input in 0..nodes[node].inputs() {
            if again && nodes[node].oldest_of(input, now).is_some() {
                self.agenda.add_arrival(now, node, input);
            }
        }
    }
}

/// The queue of an executor; `None` if each of its nodes has a core of its own.
fn queue_of(kind: Executor, members: &[(usize, Callback)]) -> Option<Box<dyn CallbackQueue>> {
    let nodes = members.iter().map(|(node, _)| *node).collect();
    let windows = |nodes, threads| {
        let callbacks = members.iter().map(|(_, callback)| callback);
        Box::new(WindowOrder::new(nodes, callbacks, threads))
    };
    let preemptive = |urgency, cores| {
        let tasks = members.iter().map(|(node, c)| (*node, c.deadline));
        Box::new(Preemptive::new(urgency, cores, tasks))
    };
    Some(match kind {
        Executor::Single => windows(nodes, 1),
        Executor::Multi { threads } => windows(nodes, threads),
        Executor::Events => Box::new(EventOrder::new(nodes)),
        Executor::FixedPriority { cores } => preemptive(Urgency::Priority, cores),
        Executor::Edf { cores } => preemptive(Urgency::Deadline, cores),
        Executor::Let => return None,
    })
}
