//! What happens to nodes in virtual time beside due ticks on threads of their own: late
//! starts, ends, messages that trigger them, and all that executors do.

use super::{
    agenda::{Agenda, AgendaItem, Phase, Place},
    events::EventOrder,
    preemptive::{Preemptive, Urgency},
    queue::{AtInstant, Call, CallbackQueue, Nodes},
    windows::WindowOrder,
};
use crate::runtime::{
    executor::{Callback, Executor},
    placement::Placement,
    scheduled_node::ScheduledNode,
    sync::Arc,
    time::Time,
    trigger::{Arrival, Arrivals, Wake},
};

/// These events, with the executors.
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
    /// Whether the graph was under the real clock since the last plan.
    behind: bool,
}

type VirtualQueue = dyn for<'a> CallbackQueue<AtInstant<'a>>;

/// An executor of a graph.
struct ExecutorState {
    kind: Executor,
    /// Its nodes, by their indices, in the order of registration.
    members: Vec<(usize, Callback)>,
    queue: Box<VirtualQueue>,
    /// Whether something has changed since its last look.
    attentive: bool,
}

impl Dispatcher {
    /// Adds an executor with its nodes, given by their indices, in the order of
    /// registration; returns where they tick.
    pub(crate) fn add(&mut self, kind: Executor, members: &[(usize, Callback)]) -> Placement {
        let Some(queue) = virtual_queue(kind, members) else {
            return Placement::Let;
        };
        let executor = self.executors.len();
        for (member, (node, _)) in members.iter().enumerate() {
            let len = self.of.len().max(node + 1);
            self.of.resize(len, None);
            self.timers.resize(len, None);
            self.of[*node] = Some((executor, member));
        }
        self.executors.push(ExecutorState {
            kind,
            members: members.to_vec(),
            queue,
            attentive: false,
        });
        Placement::Executor(executor)
    }

    /// Plans the due times of all timers, and what the nodes with threads of their own have
    /// begun or may begin: perhaps under the other clock, with messages `in_flight` then.
    pub(crate) fn prepare(
        &mut self,
        now: Time,
        nodes: &mut [ScheduledNode],
        in_flight: impl FnOnce() -> Vec<Arrival>,
    ) {
        if std::mem::take(&mut self.behind) {
            self.arrivals.forward_to(None);
            self.plan_arrivals(in_flight());
            (0..self.executors.len()).for_each(|executor| self.catch_up(executor, now, nodes));
        } else {
            let mut published = self.arrivals.take();
            published.retain(|arrival| arrival.at >= now);
            self.plan_arrivals(published);
        }
        for node in 0..nodes.len() {
            if nodes[node].has_thread() {
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

    /// Builds the queue of an executor anew, from what waits or runs of its nodes.
    fn catch_up(&mut self, executor: usize, now: Time, nodes: &mut [ScheduledNode]) {
        let known = &mut self.executors[executor];
        let Some(queue) = virtual_queue(known.kind, &known.members) else {
            return;
        };
        known.queue = queue;
        for member in 0..known.members.len() {
            let node = self.executors[executor].members[member].0;
            self.with(node, now, nodes, |queue, member, stage| {
                queue.take_over(member, stage);
            });
            self.add_waiting(node, now, nodes);
        }
    }

    /// Has the messages arrive at `now` that wait for a node.
    fn add_waiting(&mut self, node: usize, now: Time, nodes: &[ScheduledNode]) {
        for input in 0..nodes[node].inputs() {
            for _ in 0..nodes[node].waiting_in(input, now) {
                self.agenda.add_arrival(now, node, input);
            }
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
        let arrivals = self.arrivals.take();
        self.plan_arrivals(arrivals);
    }

    fn plan_arrivals(&mut self, arrivals: Vec<Arrival>) {
        for Arrival { at, node, input } in arrivals {
            self.agenda.add_arrival(at, node, input);
        }
    }

    /// Forgets all that is planned, for the other clock, and has `wake` get the arrivals from
    /// now on.
    pub(crate) fn leave(&mut self, wake: Arc<dyn Wake>) {
        self.behind = true;
        self.timers.fill(None);
        self.agenda = Agenda::default();
        self.arrivals.forward_to(Some(wake));
    }

    /// The executors, each with its nodes by their indices.
    pub(crate) fn executors(&self) -> impl Iterator<Item = (Executor, &[(usize, Callback)])> {
        let executors = self.executors.iter();
        executors.map(|executor| (executor.kind, &executor.members[..]))
    }

    /// The list of arrivals that nobody has looked at.
    pub(crate) fn arrivals(&self) -> &Arc<Arrivals> {
        &self.arrivals
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
        call: impl FnOnce(&mut VirtualQueue, usize, &mut AtInstant<'_>) -> R,
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
        Some(call)
    }

    /// The timer of a node was called.
    pub(crate) fn called(&mut self, node: usize, nodes: &[ScheduledNode]) {
        if self.timers[node].is_none() {
            self.plan_timer(node, &nodes[node]);
        }
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
        if crashed && !nodes[node].is_crashed() {
            self.add_waiting(node, now, nodes);
        }
    }
}

/// The queue of an executor in virtual time; `None` if each of its nodes has a core of its own.
fn virtual_queue(kind: Executor, members: &[(usize, Callback)]) -> Option<Box<VirtualQueue>> {
    let preemptive = |urgency, cores| {
        let tasks = members.iter().map(|(node, c)| (*node, c.deadline));
        Some(Box::new(Preemptive::new(urgency, cores, tasks)) as Box<VirtualQueue>)
    };
    match kind {
        Executor::Single => Some(Box::new(WindowOrder::new(members, 1))),
        Executor::Multi { threads } => Some(Box::new(WindowOrder::new(members, threads))),
        Executor::Events => Some(Box::new(EventOrder::new(members))),
        Executor::FixedPriority { cores } => preemptive(Urgency::Priority, cores),
        Executor::Edf { cores } => preemptive(Urgency::Deadline, cores),
        Executor::Let => None,
    }
}
