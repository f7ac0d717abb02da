//! The one schedule: what happens to nodes next, whatever the clock.

use std::mem::take;

use super::{
    agenda::{Agenda, AgendaItem, Phase},
    dispatch::{Dispatch, Member},
    scheduler::{Assignment, AtInstant, Call, Job, Scheduler},
};
use crate::{
    command::ClockKind,
    sync::Arc,
    task::Task,
    time::Time,
    timing::Running,
    trigger::{Arrival, Arrivals, Wake},
};

/// Nodes as schedulers see them, with the events to come: all nodes of a graph in virtual time,
/// those of one thread or executor under the real clock. It decides what is to be done; whoever
/// asks does it.
pub(crate) struct Stage {
    pub(crate) tasks: Vec<Task>,
    crews: Vec<ExecutorState>,
    /// The crew of each node that has one, and its number there, by index.
    of: Vec<Option<(usize, usize)>>,
    agenda: Agenda,
    /// The planned due time of each node's timer under an executor.
    releases: Vec<Time>,
    arrivals: Arc<Arrivals>,
    /// The run time since which crews have something to look at.
    noticed: Time,
    clock: ClockKind,
    /// Whether the nodes have run elsewhere since it was opened.
    behind: bool,
}

/// An executor with its nodes.
struct ExecutorState {
    dispatch: Arc<dyn Dispatch>,
    members: Vec<Member>,
    scheduler: Box<dyn Scheduler>,
    /// Whether something has changed since its last look.
    attentive: bool,
}

/// A moment of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Run time.
    pub(crate) now: Time,
    /// The end of the run: later events do not happen.
    pub(crate) until: Time,
    /// Whether the end has passed, so that only those nodes tick that were due before.
    pub(crate) over: bool,
}

impl Default for Stage {
    fn default() -> Self {
        Self::new(ClockKind::Virtual, Vec::new())
    }
}

impl Stage {
    /// A stage for nodes with threads of their own.
    pub(crate) fn new(clock: ClockKind, tasks: Vec<Task>) -> Self {
        Self {
            of: vec![None; tasks.len()],
            releases: vec![Time::MAX; tasks.len()],
            tasks,
            crews: Vec::new(),
            agenda: Agenda::default(),
            arrivals: Arc::default(),
            noticed: Time::ZERO,
            clock,
            behind: true,
        }
    }

    /// Adds a node with a thread of its own.
    pub(crate) fn add(&mut self, task: Task) {
        self.tasks.push(task);
        self.of.push(None);
        self.releases.push(Time::MAX);
    }

    /// Adds an executor with its nodes; `false` if each of these has a core of its own.
    pub(crate) fn add_executor(
        &mut self,
        dispatch: Arc<dyn Dispatch>,
        members: Vec<Member>,
    ) -> bool {
        let Some(scheduler) = dispatch.scheduler(&members) else {
            return false;
        };
        for (place, member) in members.iter().enumerate() {
            self.of[member.node] = Some((self.crews.len(), place));
        }
        self.crews.push(ExecutorState {
            dispatch,
            members,
            scheduler,
            attentive: false,
        });
        true
    }

    /// The executors, each with its nodes by their indices.
    pub(crate) fn executors(&self) -> impl Iterator<Item = (&Arc<dyn Dispatch>, &[Member])> {
        let crews = self.crews.iter();
        crews.map(|crew| (&crew.dispatch, &crew.members[..]))
    }

    /// The list of arrivals that nobody has looked at.
    pub(crate) fn arrivals(&self) -> &Arc<Arrivals> {
        &self.arrivals
    }

    /// Forgets all that is planned: the nodes run elsewhere, and `wake` gets the arrivals from
    /// now on.
    pub(crate) fn leave(&mut self, wake: Arc<dyn Wake>) {
        self.behind = true;
        self.arrivals.forward_to(Some(wake));
        self.agenda = Agenda::default();
        self.releases.fill(Time::MAX);
    }

    /// Plans what its nodes have begun or may begin, at run time `now`; those that have run
    /// elsewhere with messages `in_flight`.
    pub(crate) fn open(&mut self, now: Time, in_flight: impl FnOnce() -> Vec<Arrival>) {
        if take(&mut self.behind) {
            self.arrivals.forward_to(None);
            self.plan_arrivals(in_flight());
            (0..self.crews.len()).for_each(|crew| self.catch_up(crew, now));
        } else {
            let mut published = self.arrivals.take();
            published.retain(|arrival| arrival.at >= now);
            self.plan_arrivals(published);
        }
        for node in 0..self.tasks.len() {
            match self.of[node] {
                None => self.open_thread(node, now),
                Some((crew, member)) => {
                    self.crews[crew].scheduler.reschedule(member);
                    self.plan(now).release(node, member);
                }
            }
        }
    }

    /// Builds the scheduler of a crew anew, from what waits or runs of its nodes.
    fn catch_up(&mut self, crew: usize, now: Time) {
        let known = &mut self.crews[crew];
        if let Some(scheduler) = known.dispatch.scheduler(&known.members) {
            known.scheduler = scheduler;
        }
        for member in 0..known.members.len() {
            let node = self.crews[crew].members[member].node;
            self.ask(node, now, |scheduler, member, plan| {
                scheduler.take_over(member, plan);
                plan.add_waiting(node);
            });
        }
    }

    /// Run time of the next event; [`Time::MAX`] without one.
    pub(crate) fn next_at(&self) -> Time {
        let next = self.agenda.next_at();
        match self.crews.iter().any(|crew| crew.attentive) {
            true => next.min(self.noticed),
            false => next,
        }
    }

    /// The next work at a moment.
    #[inline]
    pub(crate) fn look(&mut self, moment: Moment) -> Option<Assignment> {
        loop {
            let next = self.agenda.next_at();
            let work = if next <= moment.now && next <= moment.until {
                let entry = self.agenda.pop()?;
                self.happen(entry, moment)
            } else if moment.over || self.crews.is_empty() {
                return None;
            } else {
                return self.pick(moment.now);
            };
            if work.is_some() {
                return work;
            }
        }
    }

    /// Has an event happen.
    #[inline]
    fn happen(&mut self, entry: AgendaItem, moment: Moment) -> Option<Assignment> {
        let (node, now) = (entry.node as usize, moment.now);
        match entry.phase() {
            Phase::Start => return self.start(node, moment),
            Phase::End => {
                let running = self.tasks[node].running();
                let over = running.is_some_and(|running| running.ends <= now);
                return over.then(|| Assignment::of(node, Job::Finish));
            }
            Phase::Arrive if self.tasks[node].is_crashed() => {}
            Phase::Arrive if self.of[node].is_none() => self.arm(node, now, true),
            Phase::Arrive => {
                let input = entry.input as usize;
                self.ask(node, now, |scheduler, member, plan| {
                    scheduler.arrived(member, input, plan);
                });
            }
            Phase::Release => {
                // It may have been planned anew since.
                if self.releases[node] == entry.at {
                    self.releases[node] = Time::MAX;
                    self.ask(node, now, |scheduler, member, plan| {
                        scheduler.due(member, plan);
                        if plan.task(node).queues_timers() {
                            plan.release(node, member);
                        }
                    });
                }
            }
        }
        None
    }

    /// Has the first crew that has a callback to call do so.
    fn pick(&mut self, now: Time) -> Option<Assignment> {
        let call = (0..self.crews.len()).find_map(|index| {
            let (crew, mut plan) = self.crew(index, now);
            let call = crew.attentive.then(|| crew.scheduler.next(&mut plan));
            crew.attentive = call.flatten().is_some();
            call.flatten()
        })?;
        let node = call.node();
        let task = &mut self.tasks[node];
        let (due, input) = match call {
            Call::Timer { .. } => (task.call_timer(now), None),
            Call::Message { input, .. } => (task.take_from(input, now), Some(input)),
            Call::Messages { .. } => (task.take(now), None),
        };
        if let (Call::Timer { .. }, false) = (call, self.tasks[node].queues_timers())
            && let Some((_, member)) = self.of[node]
        {
            self.plan(now).release(node, member);
        }
        let work = self.begin(node, due, now);
        Some(Assignment { input, ..work })
    }

    /// Begins the tick that was `due`; without one the node is free again.
    pub(super) fn begin(&mut self, node: usize, due: Option<Time>, now: Time) -> Assignment {
        let Some(due) = due else {
            self.free(node, now);
            return Assignment::of(node, Job::Look);
        };
        let task = &mut self.tasks[node];
        let (lateness, cost, takes) = match self.clock {
            ClockKind::Virtual => {
                let (lateness, cost) = (task.lateness(due, now), task.cost());
                (lateness, cost, task.duration(now, cost))
            }
            ClockKind::Real => (Some(now.since(due)), None, task.takes(now)),
        };
        let job = match takes {
            Some(takes) => Job::Start { lateness, takes },
            None => Job::Tick { lateness, cost },
        };
        Assignment::of(node, job)
    }

    /// A tick is over at `now` that took no run time. Those due before `passed` were missed.
    #[inline]
    pub(crate) fn ticked(&mut self, node: usize, passed: Time, now: Time) {
        self.tasks[node].overrun_until(passed);
        self.free(node, now);
    }

    /// A tick has begun at `now` that takes run time.
    pub(crate) fn started(&mut self, node: usize, running: Running, now: Time) {
        let ends = running.ends;
        self.tasks[node].begin(running);
        let asked = self.ask(node, now, |scheduler, member, plan| {
            scheduler.began(member, ends, plan);
        });
        if asked.is_none() {
            self.plan(now).end_at(node, ends);
        }
    }

    /// The time before which due ticks are missed, if the running one is over at `ended`: with
    /// logical execution time the next tick begins where this one was to end.
    pub(crate) fn missed_before(&self, node: usize, ended: Time) -> Time {
        let task = &self.tasks[node];
        match task.running() {
            Some(running) if task.is_let() => running.ends.min(ended),
            _ => ended,
        }
    }

    /// Number of ticks that keep a core busy.
    pub(crate) fn busy(&self) -> usize {
        let running = self.tasks.iter().filter_map(Task::running);
        running.filter(|running| running.busy).count()
    }

    /// The work that ends the tick of a node now.
    pub(crate) fn finish(&self, node: usize) -> Option<Assignment> {
        self.tasks[node]
            .running()
            .map(|_| Assignment::of(node, Job::Finish))
    }

    /// That tick is over at `now`. Those due before `passed` were missed.
    pub(crate) fn finished(&mut self, node: usize, passed: Time, now: Time) -> Option<Running> {
        let task = &mut self.tasks[node];
        let running = task.end();
        task.overrun_until(passed);
        self.free(node, now);
        running
    }

    /// A node is free for another tick.
    #[inline]
    fn free(&mut self, node: usize, now: Time) {
        if self.of[node].is_none() {
            return self.arm(node, now, false);
        }
        self.ask(node, now, |scheduler, member, plan| {
            scheduler.ended(member, plan);
        });
    }

    /// The due times of a node have changed, or it has `crashed` and perhaps begun again.
    pub(crate) fn changed(&mut self, node: usize, crashed: bool, now: Time) {
        let asked = self.ask(node, now, |scheduler, member, plan| {
            match crashed {
                true => scheduler.forget(member),
                false => scheduler.reschedule(member),
            }
            plan.release(node, member);
        });
        let task = &self.tasks[node];
        if asked.is_none() && task.skips_ticks() && !task.is_occupied() {
            self.arm(node, now, false);
        }
        if crashed && !self.tasks[node].is_crashed() {
            self.plan(now).add_waiting(node);
        }
    }

    /// Adds the arrival of a message.
    pub(crate) fn add_arrival(&mut self, arrival: Arrival) {
        let Arrival { at, node, input } = arrival;
        self.agenda.add_arrival(at, node, input);
    }

    /// Plans the arrivals of the messages that were published since the last look.
    #[inline]
    pub(crate) fn collect(&mut self) {
        let arrivals = self.arrivals.take();
        self.plan_arrivals(arrivals);
    }

    fn plan_arrivals(&mut self, arrivals: Vec<Arrival>) {
        arrivals
            .into_iter()
            .for_each(|arrival| self.add_arrival(arrival));
    }

    pub(super) fn plan(&mut self, now: Time) -> AtInstant<'_> {
        AtInstant {
            now,
            clock: self.clock,
            tasks: &mut self.tasks,
            agenda: &mut self.agenda,
            releases: &mut self.releases,
        }
    }

    fn crew(&mut self, index: usize, now: Time) -> (&mut ExecutorState, AtInstant<'_>) {
        let plan = AtInstant {
            now,
            clock: self.clock,
            tasks: &mut self.tasks,
            agenda: &mut self.agenda,
            releases: &mut self.releases,
        };
        (&mut self.crews[index], plan)
    }

    /// Calls a function of the node's scheduler; `None` for a node with a thread of its own.
    fn ask<R>(
        &mut self,
        node: usize,
        now: Time,
        call: impl FnOnce(&mut dyn Scheduler, usize, &mut AtInstant<'_>) -> R,
    ) -> Option<R> {
        let (crew, member) = self.of[node]?;
        self.noticed = now;
        let (crew, mut plan) = self.crew(crew, now);
        crew.attentive = true;
        Some(call(&mut *crew.scheduler, member, &mut plan))
    }
}

impl Assignment {
    fn of(node: usize, job: Job) -> Self {
        let input = None;
        Self { node, input, job }
    }
}
