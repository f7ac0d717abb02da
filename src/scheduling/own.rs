//! A node with a thread of its own: it ticks as soon as it is due and free.

use super::{
    scheduler::Assignment,
    stage::{Moment, Stage},
};
use crate::{command::ClockKind, time::Time};

impl Stage {
    /// Plans what such a node has begun or may begin; its thread was asleep.
    pub(super) fn open_thread(&mut self, node: usize, now: Time) {
        let task = &self.tasks[node];
        match (task.running().map(|running| running.ends), task.starts()) {
            (Some(ends), _) => self.plan(now).end_at(node, ends),
            (None, Some(starts)) => self.plan(now).start_at(node, starts),
            (None, None) if task.is_triggered() => self.plan(now).add_waiting(node),
            (None, None) => self.arm(node, now, false),
        }
    }

    /// Plans the next start of such a node, if it is free: when it is due, or now if a message
    /// waits; late if its thread was `asleep`.
    #[inline]
    pub(super) fn arm(&mut self, node: usize, now: Time, asleep: bool) {
        let task = &self.tasks[node];
        if task.is_crashed() || task.is_occupied() {
            return;
        }
        let mut plan = self.plan(now);
        let starts = match plan.task(node).is_triggered() {
            false => plan.task(node).due(),
            true if plan.oldest(node).is_none() => return,
            true => {
                let late = asleep && plan.clock == ClockKind::Virtual;
                plan.task(node).plan_start(now, late)
            }
        };
        plan.start_at(node, starts);
    }

    /// Begins a tick of such a node, if it is due and free.
    #[inline]
    pub(super) fn start(&mut self, node: usize, moment: Moment) -> Option<Assignment> {
        let Moment { now, over, .. } = moment;
        let clock = self.plan(now).clock;
        let task = &mut self.tasks[node];
        if task.is_crashed() || task.running().is_some() {
            return None;
        }
        let due = match task.starts() {
            Some(starts) if starts > now || (over && task.is_triggered()) => return None,
            Some(_) => {
                if clock == ClockKind::Virtual {
                    task.overrun_until(now + Time::TICK);
                }
                let due = task.waited();
                match task.is_triggered() {
                    true => task.take(now),
                    false => due,
                }
            }
            None if task.due() > now => return None,
            None => {
                let due = task.take_due();
                let late = match clock {
                    ClockKind::Virtual => task.wait(due, now),
                    ClockKind::Real => None,
                };
                if let Some(starts) = late {
                    self.plan(now).start_at(node, starts);
                    return None;
                }
                Some(due)
            }
        };
        Some(self.begin(node, due, now))
    }
}
