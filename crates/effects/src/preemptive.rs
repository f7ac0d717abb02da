//! Preemptive execution on virtual cores, by fixed priorities or by deadlines.
//!
//! As in the kernel of TrueTime (`63ae017`, `ttkernel.cpp:323-344`): jobs of a node that are
//! released while the one before is unfinished queue up with their release and deadline,
//! and of equals the first released comes first. A job reads when it begins, and publishes
//! when it has had its time on a core.

use std::{
    collections::{BTreeSet, VecDeque},
    time::Duration,
};

use ratelab::Time;

use super::{
    callback::Callback,
    ordered::{Call, CallbackOrder, TaskSetView},
};

/// What decides between jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Urgency {
    /// The priority of the node, lowest number first.
    Priority,
    /// The absolute deadline, earliest first.
    Deadline,
}

/// The place of a job in the order of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct JobKey {
    /// Priority, or deadline (ns).
    urgency: u64,
    released: Time,
    member: usize,
}

/// A job that has begun.
#[derive(Clone, Copy, Debug)]
struct CoreJob {
    key: JobKey,
    /// Time on a core that it still needs from `since` on.
    remaining: Duration,
    /// The run time since which it is on a core.
    on_core: Option<Time>,
}

/// A node with its jobs.
#[derive(Clone, Debug)]
struct CoreTask {
    /// Deadline relative to the release, if not that of its period.
    deadline: Option<Duration>,
    /// Releases of its timer that have not begun, each with the deadline.
    released: VecDeque<(Time, Time)>,
    job: Option<CoreJob>,
    /// The place of its first job, if it has one.
    key: Option<JobKey>,
}

/// The nodes of a preemptive executor.
#[derive(Clone, Debug)]
pub(super) struct Preemptive {
    urgency: Urgency,
    cores: usize,
    tasks: Vec<CoreTask>,
    /// The first job of each node that has one.
    first: BTreeSet<JobKey>,
}

impl Preemptive {
    pub(super) fn new(urgency: Urgency, cores: usize, callbacks: &[Callback]) -> Self {
        let tasks = callbacks.iter().map(|callback| CoreTask {
            deadline: callback.deadline,
            released: VecDeque::new(),
            job: None,
            key: None,
        });
        Self {
            urgency,
            cores,
            tasks: tasks.collect(),
            first: BTreeSet::new(),
        }
    }

    /// Finds the first job of a node again.
    fn refresh(&mut self, member: usize, task_set: &TaskSetView<'_, '_>) {
        let task = &self.tasks[member];
        let next = || {
            let arrived = || {
                let released = task_set.oldest(member)?;
                Some((released, released + task.deadline.unwrap_or(Duration::MAX)))
            };
            let (released, deadline) = task.released.front().copied().or_else(arrived)?;
            let urgency = match self.urgency {
                Urgency::Priority => task_set.priority(member).into(),
                Urgency::Deadline => deadline.as_nanos(),
            };
            Some(JobKey {
                urgency,
                released,
                member,
            })
        };
        let key = task.job.map(|job| job.key).or_else(next);
        self.set_key(member, key);
    }

    fn set_key(&mut self, member: usize, key: Option<JobKey>) {
        let before = std::mem::replace(&mut self.tasks[member].key, key);
        if before != key {
            before.map(|before| self.first.remove(&before));
            key.map(|key| self.first.insert(key));
        }
    }

    /// The nodes with the most urgent jobs, one for each core.
    fn urgent(&self) -> Vec<usize> {
        let first = self.first.iter().take(self.cores);
        first.map(|key| key.member).collect()
    }

    /// Takes the jobs off their cores that are not among the most urgent.
    fn preempt(&mut self, urgent: &[usize], task_set: &mut TaskSetView<'_, '_>) {
        for (member, task) in self.tasks.iter_mut().enumerate() {
            let Some(job) = &mut task.job else { continue };
            if let Some(since) = job.on_core.filter(|_| !urgent.contains(&member)) {
                job.remaining = job.remaining.saturating_sub(task_set.now().since(since));
                job.on_core = None;
                task_set.task(member).suspend(job.remaining);
            }
        }
    }

    /// Puts a job on a core; it ends there unless it is preempted.
    fn resume(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        let task = &mut self.tasks[member];
        if let Some(job) = &mut task.job {
            let ends = task_set.now() + job.remaining;
            job.on_core = Some(task_set.now());
            task_set.end_at(member, ends);
            task_set.task(member).resume(ends);
        }
    }
}

impl CallbackOrder for Preemptive {
    const QUEUES_TIMERS: bool = true;

    fn due(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        let task = &mut self.tasks[member];
        let released = task_set.task(member).due();
        if task_set.queue_timer(member) {
            let deadline = task.deadline.map(|deadline| released + deadline);
            let deadline = deadline.unwrap_or_else(|| task_set.task(member).due());
            task.released.push_back((released, deadline));
        }
        self.refresh(member, task_set);
    }

    fn arrived(&mut self, member: usize, _: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.refresh(member, task_set);
    }

    fn next(&mut self, task_set: &mut TaskSetView<'_, '_>) -> Option<Call> {
        let urgent = self.urgent();
        self.preempt(&urgent, task_set);
        for member in urgent {
            match self.tasks[member].job {
                Some(job) if job.on_core.is_some() => {}
                Some(_) => self.resume(member, task_set),
                None => {
                    let released = &mut self.tasks[member].released;
                    return Some(match released.pop_front() {
                        Some(_) => Call::Timer { member },
                        None => Call::Messages { member },
                    });
                }
            }
        }
        None
    }

    fn began(&mut self, member: usize, ends: Time, task_set: &mut TaskSetView<'_, '_>) {
        let task = &mut self.tasks[member];
        if let Some(key) = task.key {
            let remaining = ends.since(task_set.now());
            task.job = Some(CoreJob {
                key,
                remaining,
                on_core: None,
            });
            self.resume(member, task_set);
        }
    }

    fn ended(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.tasks[member].job = None;
        self.refresh(member, task_set);
    }

    /// Deadlines do not matter: under the real clock there is no `edf`.
    fn take_over(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        let task = &mut self.tasks[member];
        let (now, urgency) = (task_set.now(), task_set.priority(member).into());
        let known = task_set.task(member);
        let queued = known.queued_timers();
        task.released.extend(queued.map(|due| (due, Time::MAX)));
        task.job = known.running.map(|running| CoreJob {
            key: JobKey {
                urgency,
                released: running.began,
                member,
            },
            remaining: running.remaining(now),
            on_core: None,
        });
        self.refresh(member, task_set);
    }

    fn forget(&mut self, member: usize) {
        let task = &mut self.tasks[member];
        task.job = None;
        task.released.clear();
        self.set_key(member, None);
    }

    fn reschedule(&mut self, _: usize) {}
}
