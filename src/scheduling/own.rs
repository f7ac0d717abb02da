//! A node with a thread of its own: it ticks as soon as it is due and free.

use super::{
    agenda::Phase,
    task::Task,
    timetable::{SchedulerEvent, TaskState, Timetable},
};
use crate::{
    control::{
        command::{ClockKind, KnobRefusal},
        knob::{Knob, KnobKind, TickTiming},
    },
    node::{Job, JobKind},
    time::Time,
};

/// Runs a node as soon as it is released and free. What is due at its rate meanwhile is skipped or
/// waits, as its [`Overrun`](crate::Overrun) says; messages wait.
pub(crate) struct Own {
    pub(crate) task: Task,
    /// Whether a tick lasts to the end of its period: logical execution time.
    is_let: bool,
    /// A due tick that has not started yet.
    waiting: Option<Waiting>,
    /// Run time at which it last stopped waiting: its thread is awake, so that a tick that is due
    /// then is not late again.
    woke: Option<Time>,
    /// Whether it has heard of a message that it may not have taken.
    heard: bool,
}

/// What the thread of a node does as something happens to the node.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Thread {
    /// It sleeps, and wakes late where a lateness is set.
    Asleep,
    /// It works on the node, or has just done so.
    Awake,
}

/// A late tick.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    due: Time,
    starts: Time,
}

impl Own {
    pub(crate) fn new(task: Task) -> Self {
        Self {
            task,
            is_let: false,
            waiting: None,
            woke: None,
            heard: false,
        }
    }

    /// Creates a node whose ticks last to the end of their period.
    pub(crate) fn new_let(task: Task) -> Self {
        Self {
            is_let: true,
            ..Self::new(task)
        }
    }

    /// Returns the run time until which no other tick can start; `None` if it is free.
    fn busy_until(&self) -> Option<Time> {
        self.waiting
            .map(|waiting| waiting.starts + Time::RESOLUTION)
            .or(self.task.running.map(|running| running.ends))
    }

    /// Counts the due times before `end` that pass during the current tick.
    fn skip_while_busy(&mut self, end: Time, timetable: &Timetable<'_>) {
        if let Some(free) = self.busy_until() {
            self.task.skip_before(free.min(end), timetable);
        }
    }

    /// Plans what it has begun or may begin next: when it is due, or now if a message waits; late
    /// in virtual time if its `thread` sleeps.
    #[inline]
    fn arm(&mut self, thread: Thread, timetable: &mut Timetable<'_>) {
        let now = timetable.now();
        if self.task.crashed {
            return;
        }
        if let Some(running) = self.task.running {
            return timetable.alarm(running.ends, Phase::End, 0);
        }
        let is_virtual = timetable.clock() == ClockKind::Virtual;
        let waits = match &self.task.trigger {
            // The end of a tick comes before what arrives at the same instant.
            Some(_) if is_virtual && thread == Thread::Awake => self.heard,
            Some(trigger) => trigger.oldest(now).is_some(),
            None => false,
        };
        if waits && self.waiting.is_none() {
            let starts = match thread {
                Thread::Asleep if is_virtual => now + self.task.lateness(),
                _ => now,
            };
            self.waiting = Some(Waiting { due: now, starts });
        }
        let starts = self.waiting.map(|waiting| waiting.starts);
        timetable.alarm(starts.unwrap_or_else(|| self.task.due()), Phase::Start, 0);
    }

    /// Begins a tick, if it is due and free.
    #[inline]
    fn start(&mut self, timetable: &mut Timetable<'_>) -> Option<Job> {
        let now = timetable.now();
        if self.task.crashed || self.task.running.is_some() {
            return None;
        }
        let is_virtual = timetable.clock() == ClockKind::Virtual;
        let due = match self.waiting {
            Some(waiting) if waiting.starts > now => return None,
            Some(_) if timetable.is_over() && self.task.is_triggered() => return None,
            Some(waiting) => {
                if is_virtual {
                    self.task.skip_before(now + Time::RESOLUTION, timetable);
                }
                (self.waiting, self.woke) = (None, Some(now));
                match &mut self.task.trigger {
                    Some(trigger) => {
                        let due = trigger.take(now);
                        self.heard = trigger.oldest(now).is_some();
                        due
                    }
                    None => Some(waiting.due),
                }
            }
            None if self.task.due() > now => return None,
            None => {
                let due = self.task.take_due();
                self.task.skip_same_instant(due, timetable);
                // A thread that did not sleep when the tick was due does not wake late.
                if is_virtual && due == now && self.woke != Some(now) {
                    let starts = now + self.task.lateness();
                    if starts > now {
                        self.waiting = Some(Waiting { due, starts });
                        self.arm(Thread::Awake, timetable);
                        return None;
                    }
                }
                Some(due)
            }
        };
        if due.is_none() {
            self.arm(Thread::Awake, timetable);
        }
        due.map(|due| self.job(due, timetable))
    }

    /// Returns the begin of the tick that was `due`.
    #[inline]
    fn job(&mut self, due: Time, timetable: &Timetable<'_>) -> Job {
        let now = timetable.now();
        let is_virtual = timetable.clock() == ClockKind::Virtual;
        let is_timed = !self.task.is_triggered();
        let known = self.task.has_times && (now > due || !self.task.wakes.is_none());
        let lateness = (!is_virtual || !is_timed || known).then(|| now.since(due));
        let kind = if self.is_let {
            let free = now + self.task.draw_cost().unwrap_or_default();
            let takes = self.task.end_of_period(free).since(now);
            self.task.begins(takes)
        } else {
            self.task.next_job(timetable.clock())
        };
        Job::new(0, kind).with_lateness(lateness)
    }

    /// A job is done; ticks due before `missed_before` are missed.
    #[inline]
    fn done(&mut self, kind: JobKind, missed_before: Time, timetable: &mut Timetable<'_>) {
        match kind {
            JobKind::Begin => {
                self.task.begin(timetable.now());
            }
            JobKind::End => {
                let running = self.task.running.take();
                // The next tick begins where this one was to end.
                let ends = running.filter(|_| self.is_let).map(|running| running.ends);
                let missed_before = ends.map_or(missed_before, |ends| ends.min(missed_before));
                self.task.skip_before(missed_before, timetable);
            }
            JobKind::Tick { .. } => self.task.skip_before(missed_before, timetable),
        }
        self.arm(Thread::Awake, timetable);
    }
}

impl Own {
    /// Hears of an event; returns the job to be done now.
    #[inline]
    pub(crate) fn on(
        &mut self,
        event: SchedulerEvent,
        timetable: &mut Timetable<'_>,
    ) -> Option<Job> {
        let now = timetable.now();
        match event {
            SchedulerEvent::Alarm { phase, .. } => {
                return match phase {
                    Phase::End if self.task.is_over(now) => Some(Job::new(0, JobKind::End)),
                    Phase::Start => self.start(timetable),
                    _ => None,
                };
            }
            SchedulerEvent::Done { job, missed_before } => {
                self.done(job.kind, missed_before, timetable)
            }
            SchedulerEvent::Arrived { .. } | SchedulerEvent::Opened { .. } => {
                self.heard = true;
                self.arm(Thread::Asleep, timetable);
            }
            SchedulerEvent::Crashed { .. } => {
                self.skip_while_busy(now, timetable);
                self.task.crash();
                self.waiting = None;
            }
            SchedulerEvent::Restarted { .. } => {
                self.task.restart(now);
                self.arm(Thread::Asleep, timetable);
            }
            SchedulerEvent::Closed { missed_before } => {
                self.skip_while_busy(missed_before, timetable)
            }
            SchedulerEvent::Choose => {}
        }
        None
    }

    /// Returns where the node is in its schedule at run time `now`.
    pub(crate) fn state(&self, now: Time) -> TaskState {
        self.task.state(!self.task.is_triggered(), now)
    }

    /// Checks that the schedule has this knob.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), KnobRefusal> {
        self.task.check(knob, !self.is_let)
    }

    /// Sets a knob of the schedule; returns the one that was in force.
    pub(crate) fn set(
        &mut self,
        knob: &Knob,
        timetable: &mut Timetable<'_>,
    ) -> Result<Knob, KnobRefusal> {
        let now = timetable.now();
        let times = knob.kind().sets(TickTiming::Due);
        if times || knob.kind() == KnobKind::Late {
            self.skip_while_busy(now, timetable);
        }
        let free = self
            .busy_until()
            .filter(|_| !self.task.is_triggered())
            .map_or(now, |free| free.max(now));
        let before = self.task.set(0, knob, free, timetable)?;
        if times && self.busy_until().is_none() && !self.task.is_triggered() {
            self.arm(Thread::Awake, timetable);
        }
        Ok(before)
    }
}
