//! Nodes that share the threads of an executor, in an order of its own.

use std::time::Duration;

use crate::{
    control::{
        command::KnobRefusal,
        knob::{Knob, TickTiming},
    },
    node::{Job, JobKind},
    scheduling::{
        agenda::Phase,
        task::Task,
        timetable::{SchedulerEvent, TaskState, Timetable},
    },
    time::Time,
};

/// A node given to an executor: its timer, or a subscription for each topic that triggers
/// it.
///
/// ```
/// use std::time::Duration;
/// use ratelab::Callback;
///
/// let camera = Callback::new("camera").in_group("sensors");
/// let control = Callback::new("control").with_deadline(Duration::from_millis(5));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Callback {
    pub(crate) node: String,
    /// The name of its mutually exclusive group, if it is in one.
    group: Option<String>,
    pub(crate) deadline: Option<Duration>,
}

impl Callback {
    /// Names the node called `node`, in a group of its own.
    pub fn new(node: impl Into<String>) -> Self {
        Self {
            node: node.into(),
            group: None,
            deadline: None,
        }
    }

    /// In the mutually exclusive group called `group`: of its nodes one ticks at a time.
    #[must_use]
    pub fn in_group(self, group: impl Into<String>) -> Self {
        let group = Some(group.into());
        Self { group, ..self }
    }

    /// Returns the name of its mutually exclusive group, if it is in one.
    pub fn group_name(&self) -> Option<&str> {
        self.group.as_deref()
    }

    /// In a reentrant group: its nodes tick beside each other. A node ticks once at a
    /// time all the same, because its state is its own: so each is as in a group of its own.
    #[must_use]
    pub fn in_reentrant_group(self) -> Self {
        let group = None;
        Self { group, ..self }
    }

    /// Returns its deadline relative to the release, if one is given.
    pub fn deadline(&self) -> Option<Duration> {
        self.deadline
    }

    /// With a deadline relative to its release; the period of a node at a rate if none is
    /// given.
    #[must_use]
    pub fn with_deadline(self, deadline: Duration) -> Self {
        let deadline = Some(deadline);
        Self { deadline, ..self }
    }
}

/// Decides which released callback is called now. Its nodes are known by their number in the
/// order of registration.
pub(crate) trait CallbackOrder: Send {
    /// Returns whether timers wait in line when they are due, instead of being called once, late.
    fn queues_timers(&self) -> bool {
        true
    }

    /// The timer of a node is due, once more where timers wait in line, or a message has arrived
    /// for it.
    fn released(&mut self, call: Call, task_set: &mut TaskSetView<'_, '_>);

    /// Returns the callback to call now; `None` without one, or without a free thread.
    fn next(&mut self, task_set: &mut TaskSetView<'_, '_>) -> Option<Call>;

    /// Takes note that a callback of a node was called: it takes run time, or is over. Where the message
    /// had more sets, the callback goes on with the next one before the executor takes another
    /// callback.
    fn called(&mut self, _member: usize, _task_set: &mut TaskSetView<'_, '_>) {}

    /// Deadline of the running tick of a node, or else of its next one, which is due at `now` at the
    /// latest if messages trigger it; `None` where no deadline decides.
    fn deadline(&self, _member: usize, _task: &Task, _now: Time) -> Option<Time> {
        None
    }

    /// Forgets all of a node.
    fn forget(&mut self, member: usize);

    /// Hears that the next due time of a node has changed. An order whose timers do not queue
    /// forgets that the timer is due.
    fn reschedule(&mut self, _member: usize) {}
}

/// A call of a node, in the order in which they come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Call {
    /// Its subscriptions, for the next set of the last message, or in turn until a set is complete.
    Messages { member: usize },
    /// The timer of a node.
    Timer { member: usize },
    /// One of its subscriptions, for one message.
    Message { member: usize, input: usize },
}

impl Call {
    pub(crate) fn member(self) -> usize {
        match self {
            Self::Timer { member } | Self::Message { member, .. } | Self::Messages { member } => {
                member
            }
        }
    }
}

/// The nodes at an instant, as an order sees them.
pub(crate) struct TaskSetView<'a, 't> {
    pub(crate) tasks: &'a mut [Task],
    /// The nodes that are being executed.
    pub(crate) running: &'a [usize],
    pub(crate) timetable: &'a mut Timetable<'t>,
}

/// The scheduler of an executor.
pub(crate) struct Ordered {
    pub(crate) tasks: Vec<Task>,
    /// The planned due time of each node's timer.
    releases: Vec<Time>,
    /// The nodes that are being executed.
    running: Vec<usize>,
    order: Box<dyn CallbackOrder>,
}

impl Ordered {
    pub(crate) fn new(tasks: Vec<Task>, order: Box<dyn CallbackOrder>) -> Self {
        Self {
            releases: vec![Time::MAX; tasks.len()],
            running: Vec::new(),
            tasks,
            order,
        }
    }

    /// Asks the order, or tells it what has happened.
    fn with_order<R>(
        &mut self,
        timetable: &mut Timetable<'_>,
        ask: impl FnOnce(&mut dyn CallbackOrder, &mut TaskSetView<'_, '_>) -> R,
    ) -> R {
        let mut task_set = TaskSetView {
            tasks: &mut self.tasks,
            running: &self.running,
            timetable,
        };
        ask(&mut *self.order, &mut task_set)
    }

    /// Tells the order of a callback that may be called from now on.
    fn released(&mut self, call: Call, timetable: &mut Timetable<'_>) {
        self.with_order(timetable, |order, task_set| order.released(call, task_set));
    }

    /// Plans the due time of the timer of a node.
    fn release(&mut self, member: usize, timetable: &mut Timetable<'_>) {
        let due = self.tasks[member].due();
        self.releases[member] = due;
        timetable.alarm(due, Phase::Timer, member);
    }

    /// Announces the messages that wait for a node.
    fn add_waiting(&mut self, member: usize, timetable: &mut Timetable<'_>) {
        let Some(trigger) = &self.tasks[member].trigger else {
            return;
        };
        for input in 0..trigger.inputs() {
            for _ in 0..trigger.waiting_in(input, timetable.now()) {
                timetable.arrive(member, input);
            }
        }
    }

    fn open(&mut self, anew: bool, timetable: &mut Timetable<'_>) {
        if anew {
            self.running.clear();
            for member in 0..self.tasks.len() {
                self.take_over(member, timetable);
            }
        }
        for member in 0..self.tasks.len() {
            self.order.reschedule(member);
            self.release(member, timetable);
        }
        timetable.choose();
    }

    /// Takes a node over as it is after a change of the clock.
    fn take_over(&mut self, member: usize, timetable: &mut Timetable<'_>) {
        self.order.forget(member);
        let waiting = self.tasks[member].queued_timers().len();
        for _ in 0..waiting {
            self.released(Call::Timer { member }, timetable);
        }
        if let Some(running) = self.tasks[member].running {
            self.running.push(member);
            timetable.alarm(running.ends, Phase::End, member);
        }
        self.with_order(timetable, |order, task_set| order.called(member, task_set));
        self.add_waiting(member, timetable);
    }

    /// The timer of a node is due.
    fn due(&mut self, member: usize, timetable: &mut Timetable<'_>) {
        if self.order.queues_timers() && !self.tasks[member].queue_timer() {
            timetable.record_skipped(member, 1);
        } else {
            self.released(Call::Timer { member }, timetable);
        }
    }

    /// The timer that was planned for a time is due.
    fn alarm(&mut self, member: usize, at: Time, timetable: &mut Timetable<'_>) {
        // It may have been planned anew since.
        if self.releases[member] > at {
            return;
        }
        self.releases[member] = Time::MAX;
        self.due(member, timetable);
        if self.order.queues_timers() {
            self.release(member, timetable);
        }
        timetable.choose();
    }

    /// Calls the next callback, if a thread is free.
    fn call(&mut self, timetable: &mut Timetable<'_>) -> Option<Job> {
        let now = timetable.now();
        let call = self.with_order(timetable, |order, task_set| order.next(task_set))?;
        timetable.choose();
        let member = call.member();
        self.running.push(member);
        let due = match (call, &mut self.tasks[member].trigger) {
            (Call::Message { input, .. }, Some(trigger)) => trigger.take_from(input, now),
            (Call::Messages { .. }, Some(trigger)) => trigger.take(now),
            _ => self.call_timer(member, timetable),
        };
        let Some(due) = due else {
            self.ended(member, timetable);
            return None;
        };
        let kind = self.tasks[member].next_job(timetable.clock());
        Some(Job::new(member, kind).with_lateness(Some(now.since(due))))
    }

    /// Due time of the timer that is called now. Where due times do not wait in line, due times that
    /// have passed, `now` included, are overruns (rcl `c19dab5`, `timer.c:298-319`).
    fn call_timer(&mut self, member: usize, timetable: &mut Timetable<'_>) -> Option<Time> {
        let (now, task) = (timetable.now(), &mut self.tasks[member]);
        if self.order.queues_timers() {
            return task.queued_timer();
        }
        let due = task.due();
        let called = (due <= now).then(|| {
            timetable.record_skipped(member, task.pass(now + Time::RESOLUTION));
            due
        });
        self.release(member, timetable);
        called
    }

    fn done(&mut self, job: Job, timetable: &mut Timetable<'_>) {
        let member = job.member();
        match job.kind {
            JobKind::Begin => {
                let ends = self.tasks[member].begin(timetable.now());
                timetable.alarm(ends, Phase::End, member);
                self.with_order(timetable, |order, task_set| order.called(member, task_set));
            }
            JobKind::Tick { .. } | JobKind::End => self.ended(member, timetable),
        }
        timetable.choose();
    }

    /// A callback of a node is over.
    fn ended(&mut self, member: usize, timetable: &mut Timetable<'_>) {
        self.tasks[member].running = None;
        self.running.retain(|runs| *runs != member);
        self.with_order(timetable, |order, task_set| order.called(member, task_set));
    }
}

impl Ordered {
    /// Hears of an event; returns the job to be done now.
    pub(crate) fn on(
        &mut self,
        event: SchedulerEvent,
        timetable: &mut Timetable<'_>,
    ) -> Option<Job> {
        match event {
            SchedulerEvent::Opened { anew } => self.open(anew, timetable),
            SchedulerEvent::Alarm { member, at, phase } => match phase {
                Phase::End if self.tasks[member].is_over(timetable.now()) => {
                    return Some(Job::new(member, JobKind::End));
                }
                Phase::Timer => self.alarm(member, at, timetable),
                _ => {}
            },
            SchedulerEvent::Arrived { member, .. } if self.tasks[member].crashed => {}
            SchedulerEvent::Arrived { member, input } => {
                self.released(Call::Message { member, input }, timetable);
                timetable.choose();
            }
            SchedulerEvent::Choose => return self.call(timetable),
            SchedulerEvent::Done { job, .. } => self.done(job, timetable),
            SchedulerEvent::Crashed { member } => {
                self.tasks[member].crash();
                self.running.retain(|runs| *runs != member);
                self.order.forget(member);
                self.release(member, timetable);
                timetable.choose();
            }
            SchedulerEvent::Restarted { member } => {
                self.tasks[member].restart(timetable.now());
                self.release(member, timetable);
                self.add_waiting(member, timetable);
                timetable.choose();
            }
            SchedulerEvent::Closed { .. } => {}
        }
        None
    }

    /// Returns where a node is in its schedule at run time `now`.
    pub(crate) fn state(&self, member: usize, now: Time) -> TaskState {
        let task = &self.tasks[member];
        let deadline = self.order.deadline(member, task, now);
        TaskState {
            deadline,
            ..task.state(false, now)
        }
    }

    /// Checks that the schedule of a node has this knob.
    pub(crate) fn check(&self, member: usize, knob: &Knob) -> Result<(), KnobRefusal> {
        self.tasks[member].check(knob, false)
    }

    /// Sets a knob of a node's schedule; returns the one that was in force.
    pub(crate) fn set(
        &mut self,
        member: usize,
        knob: &Knob,
        timetable: &mut Timetable<'_>,
    ) -> Result<Knob, KnobRefusal> {
        let now = timetable.now();
        let times = knob.kind().sets(TickTiming::Due);
        // Timers that were due before wait in line.
        while times && self.order.queues_timers() && self.tasks[member].due() < now {
            self.due(member, timetable);
        }
        let before = self.tasks[member].set(member, knob, now, timetable)?;
        if times {
            self.order.reschedule(member);
            self.release(member, timetable);
            timetable.choose();
        }
        Ok(before)
    }
}
