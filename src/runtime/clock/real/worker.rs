//! The thread of a node that has one of its own.

use std::time::Duration;

use super::{
    ThreadContext,
    arrivals::Inbound,
    ends::Report,
    logged::LoggedNode,
    mailbox::{Mailbox, Wakeup},
};
use crate::runtime::{
    clock::{steps::Outcome, wall::Wall},
    realtime::{self, CoreShare},
    reexecution::Noter,
    sync::Arc,
    time::Time,
};

/// A node with a thread of its own.
pub(super) struct Worker<'g> {
    logged: LoggedNode<'g>,
    mailbox: &'g Mailbox,
    arrivals: Inbound,
    /// The cores that it shares with the nodes of its executor.
    share: Option<CoreShare>,
    /// The time that the thread will have had on a core at the end of the tick.
    goal: Option<Duration>,
}

impl<'g> Worker<'g> {
    pub(super) fn new(
        logged: LoggedNode<'g>,
        mailbox: &'g Mailbox,
        share: Option<CoreShare>,
    ) -> Self {
        Self {
            logged,
            mailbox,
            arrivals: Inbound::new(),
            share,
            goal: None,
        }
    }

    /// Index and name of the node.
    pub(super) fn node(&self) -> (usize, Arc<str>) {
        (self.logged.index, self.logged.name())
    }

    /// The thread.
    pub(super) fn run(mut self, context: &ThreadContext) {
        realtime::prepare_thread(context.realtime.as_ref());
        if let Some(share) = &self.share {
            realtime::share_cores(share);
        }
        let _noter = Noter::new();
        if let Some(wall) = self.start()
            && let Some(report) = self.work(context, &wall)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = context.reporter.send(report);
        }
    }

    /// Waits for the start; `None` for a stop. Messages may arrive before it, of nodes that have
    /// started.
    fn start(&mut self) -> Option<Wall> {
        loop {
            match self.mailbox.wait() {
                Wakeup::Start(wall) => return Some(wall),
                Wakeup::Arrival(arrival) => self.arrivals.add(arrival, Time::ZERO),
                Wakeup::Command(_) | Wakeup::Stop(_) => return None,
            }
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&mut self, context: &ThreadContext, wall: &Wall) -> Option<Report> {
        self.plan_core_time(wall.now());
        loop {
            let next = self.next_at(context, wall);
            let woken = self.wait_until(wall, next.min(context.until));
            // A tick that needs time on a core may have had it by now.
            let next = match self.goal {
                Some(_) => self.next_at(context, wall),
                None => next,
            };
            match woken {
                Some(Wakeup::Stop(at)) => {
                    self.logged.leave(at.min(context.until) + Time::TICK);
                    return None;
                }
                Some(Wakeup::Start(_)) => {}
                Some(Wakeup::Arrival(arrival)) => self.arrivals.add(arrival, wall.now()),
                Some(Wakeup::Command(command)) => {
                    self.logged.obey(context, &command, wall.now());
                    // A node that restarts finds what its queues still keep.
                    self.arrivals.look_at_all();
                }
                None if next > context.until => {
                    self.logged.leave(context.until + Time::TICK);
                    return Some(Report::Finished);
                }
                None => {
                    let outcome = match self.logged.node.running() {
                        Some(_) => self.finish(context, wall),
                        None => self.tick(context, wall),
                    };
                    self.plan_core_time(wall.now());
                    if let Some(outcome) = outcome {
                        return Some(Report::of(self.logged.index, outcome));
                    }
                }
            }
        }
    }

    /// Time of the node's next event. A message that waits begins no tick after the end of
    /// the run.
    fn next_at(&self, context: &ThreadContext, wall: &Wall) -> Time {
        let node = &*self.logged.node;
        if let Some(goal) = self.goal.filter(|_| node.running().is_some()) {
            return match realtime::core_time() >= goal {
                true => Time::ZERO,
                false => Time::MAX,
            };
        }
        if node.queued_timers().len() > 0 && !node.is_occupied() {
            return match wall.now() > context.until {
                true => Time::MAX,
                false => Time::ZERO,
            };
        }
        if !node.is_triggered() || node.is_occupied() || node.is_crashed() {
            return node.next_at();
        }
        match self.arrivals.next_at() {
            next if next <= context.until && wall.now() > context.until => Time::MAX,
            next => next,
        }
    }

    /// Waits for a wake-up or run time `time`; busy-waits during a tick that keeps a core
    /// busy.
    fn wait_until(&self, wall: &Wall, time: Time) -> Option<Wakeup> {
        match self.logged.node.running() {
            Some(_) if let Some(goal) = self.goal => {
                let reached = || realtime::core_time() >= goal;
                self.mailbox.spin_until_or(wall, time, reached)
            }
            Some(running) if running.busy => self.mailbox.spin_until(wall, time),
            _ => self.mailbox.wait_until(wall, time),
        }
    }

    /// Plans the time on a core that the running tick needs from `now` on.
    fn plan_core_time(&mut self, now: Time) {
        let running = self.logged.node.running().filter(|_| self.share.is_some());
        self.goal = running.map(|running| realtime::core_time() + running.remaining(now));
    }

    fn tick(&mut self, context: &ThreadContext, wall: &Wall) -> Outcome {
        let began = wall.now();
        self.arrivals.pass(began);
        let mailbox = self.mailbox;
        let passed = |ended| passed(mailbox, context.until, began, ended);
        let ticked = self.logged.tick(context, wall, began, passed);
        match ticked {
            Some(_) => self.arrivals.took_one(),
            None => self.arrivals.found_none(),
        }
        ticked.flatten()
    }

    /// Ends a tick that takes time.
    fn finish(&mut self, context: &ThreadContext, wall: &Wall) -> Outcome {
        let ended = wall.now();
        let node = &*self.logged.node;
        // With logical execution time the next tick begins where this one ends.
        let running = node.running().filter(|_| node.is_let());
        let over = running.map_or(ended, |running| running.ends.min(ended));
        let passed = passed(self.mailbox, context.until, ended, over);
        self.logged.finish(context, ended, passed)
    }
}

/// The limit before which due ticks count as missed, for a tick at `at` that ended at
/// `ended`. Run time may have stopped or ended while the node was busy: only ticks due by
/// then are missed.
fn passed(mailbox: &Mailbox, until: Time, at: Time, ended: Time) -> Time {
    let stopped = mailbox.stop_requested().unwrap_or(Time::MAX);
    let last = stopped.max(at).min(until);
    ended.min(last + Time::TICK)
}
