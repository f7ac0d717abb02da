//! Preemptive execution on virtual cores, by fixed priorities or by deadlines.
//!
//! As in the kernel of TrueTime (`63ae017`, `ttkernel.cpp:323-344`): jobs of a node that are
//! released while the one before is unfinished queue up with their release and deadline,
//! and of equals the first released comes first. A job reads when it begins, and publishes
//! when it has had its time on a core.

use std::{collections::BTreeSet, time::Duration};

use super::ordered::{Call, Callback, CallbackOrder, TaskSetView};
use crate::{
    scheduling::{agenda::Phase, task::Task},
    time::Time,
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

/// A node with its first job.
#[derive(Debug)]
struct CoreTask {
    /// Deadline relative to the release, if not that of its period.
    deadline: Option<Duration>,
    /// The place of the job; `None` without a job.
    key: Option<JobKey>,
}

/// The nodes of a preemptive executor.
#[derive(Debug)]
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
            key: None,
        });
        Self {
            urgency,
            cores,
            tasks: tasks.collect(),
            first: BTreeSet::new(),
        }
    }

    /// Finds the first job of a node again, unless that has begun.
    fn refresh(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        let (now, CoreTask { deadline, key }) = (task_set.timetable.now(), &self.tasks[member]);
        let task = &mut task_set.tasks[member];
        let next = match task.running {
            Some(_) if key.is_some() => return,
            // The job goes on with the next set of its message, in its place.
            None if key.is_some() && task.goes_on() => return,
            Some(running) => {
                task.suspend(now);
                Some((running.began, Time::MAX))
            }
            None => task.queued_timers().next().or_else(|| {
                let arrived = task.trigger.as_ref()?.oldest(now)?;
                Some((arrived, Time::MAX))
            }),
        };
        let key = next.map(|(released, period)| JobKey {
            urgency: match self.urgency {
                Urgency::Priority => task_set.timetable.priority(member).into(),
                Urgency::Deadline => deadline.map_or(period, |d| released + d).as_nanos(),
            },
            released,
            member,
        });
        self.set_key(member, key);
    }

    fn set_key(&mut self, member: usize, key: Option<JobKey>) {
        let before = std::mem::replace(&mut self.tasks[member].key, key);
        if before != key {
            before.map(|before| self.first.remove(&before));
            key.map(|key| self.first.insert(key));
        }
    }

    /// Returns the nodes with the most urgent jobs, one for each core.
    fn urgent(&self) -> Vec<usize> {
        let first = self.first.iter().take(self.cores);
        first.map(|key| key.member).collect()
    }
}

impl CallbackOrder for Preemptive {
    fn released(&mut self, call: Call, task_set: &mut TaskSetView<'_, '_>) {
        self.refresh(call.member(), task_set);
    }

    fn next(&mut self, task_set: &mut TaskSetView<'_, '_>) -> Option<Call> {
        let (now, urgent) = (task_set.timetable.now(), self.urgent());
        (0..self.tasks.len())
            .filter(|member| !urgent.contains(member))
            .for_each(|member| task_set.tasks[member].suspend(now));
        for member in urgent {
            let task = &mut task_set.tasks[member];
            if task.running.is_none() {
                return Some(match task.queued_timers().len() {
                    0 => Call::Messages { member },
                    _ => Call::Timer { member },
                });
            }
            if let Some(ends) = task.resume(now) {
                task_set.timetable.alarm(ends, Phase::End, member);
            }
        }
        None
    }

    fn called(&mut self, member: usize, task_set: &mut TaskSetView<'_, '_>) {
        self.refresh(member, task_set);
    }

    fn deadline(&self, member: usize, task: &Task, now: Time) -> Option<Time> {
        let CoreTask { deadline, key } = &self.tasks[member];
        let next = || match deadline {
            Some(deadline) => task.due().min(now) + *deadline,
            None => task.due_after_next(),
        };
        let known = key.map(|key| Time::from_nanos(key.urgency));
        (self.urgency == Urgency::Deadline).then(|| known.unwrap_or_else(next))
    }

    fn forget(&mut self, member: usize) {
        self.set_key(member, None);
    }
}
