//! The thread of a node that has one of its own.

use super::{
    Stretch,
    arrivals::Inbound,
    ends::Report,
    logged::LoggedNode,
    mailbox::{Mailbox, Wakeup},
};
use crate::runtime::{
    clock::{realtime, steps::Outcome, wall::Wall},
    reexecution::Noter,
    sync::Arc,
    time::Time,
};

/// A node with a thread of its own.
pub(super) struct Worker<'g> {
    logged: LoggedNode<'g>,
    mailbox: &'g Mailbox,
    arrivals: Inbound,
}

impl<'g> Worker<'g> {
    pub(super) fn new(logged: LoggedNode<'g>, mailbox: &'g Mailbox) -> Self {
        Self {
            logged,
            mailbox,
            arrivals: Inbound::new(),
        }
    }

    /// Index and name of the node.
    pub(super) fn node(&self) -> (usize, Arc<str>) {
        (self.logged.index, self.logged.name())
    }

    /// The thread.
    pub(super) fn run(mut self, stretch: &Stretch) {
        realtime::prepare_thread(stretch.realtime.as_ref());
        let _noter = Noter::new();
        if let Some(wall) = self.start()
            && let Some(report) = self.work(stretch, &wall)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = stretch.reporter.send(report);
        }
        self.arrivals.return_to(self.mailbox);
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
    fn work(&mut self, stretch: &Stretch, wall: &Wall) -> Option<Report> {
        loop {
            let next = self.next_at(stretch, wall);
            match self.wait_until(wall, next.min(stretch.until)) {
                Some(Wakeup::Stop(at)) => {
                    self.logged.leave(at.min(stretch.until) + Time::TICK);
                    return None;
                }
                Some(Wakeup::Start(_)) => {}
                Some(Wakeup::Arrival(arrival)) => self.arrivals.add(arrival, wall.now()),
                Some(Wakeup::Command(command)) => {
                    self.logged.obey(stretch, &command, wall.now());
                    // A node that restarts finds what its queues still keep.
                    self.arrivals.look_at_all();
                }
                None if next > stretch.until => {
                    self.logged.leave(stretch.until + Time::TICK);
                    return Some(Report::Finished);
                }
                None => {
                    let outcome = match self.logged.node.running() {
                        Some(_) => self.finish(stretch, wall),
                        None => self.tick(stretch, wall),
                    };
                    if let Some(outcome) = outcome {
                        return Some(Report::of(self.logged.index, outcome));
                    }
                }
            }
        }
    }

    /// Time of the node's next event. A message that waits begins no tick after the end of
    /// the run.
    fn next_at(&self, stretch: &Stretch, wall: &Wall) -> Time {
        let node = &*self.logged.node;
        if !node.is_triggered() || node.is_occupied() || node.is_crashed() {
            return node.next_at();
        }
        match self.arrivals.next_at() {
            next if next <= stretch.until && wall.now() > stretch.until => Time::MAX,
            next => next,
        }
    }

    /// Waits for a wake-up or run time `time`; busy-waits during a tick that keeps a core
    /// busy.
    fn wait_until(&self, wall: &Wall, time: Time) -> Option<Wakeup> {
        match self.logged.node.running() {
            Some(running) if running.busy => self.mailbox.spin_until(wall, time),
            _ => self.mailbox.wait_until(wall, time),
        }
    }

    fn tick(&mut self, stretch: &Stretch, wall: &Wall) -> Outcome {
        let began = wall.now();
        self.arrivals.pass(began);
        let mailbox = self.mailbox;
        let passed = |ended| passed(mailbox, stretch.until, began, ended);
        let ticked = self.logged.tick(stretch, wall, began, passed);
        match ticked {
            Some(_) => self.arrivals.took_one(),
            None => self.arrivals.found_none(),
        }
        ticked.flatten()
    }

    /// Ends a tick that takes time.
    fn finish(&mut self, stretch: &Stretch, wall: &Wall) -> Outcome {
        let ended = wall.now();
        let node = &*self.logged.node;
        // With logical execution time the next tick begins where this one ends.
        let running = node.running().filter(|_| node.is_let());
        let over = running.map_or(ended, |running| running.ends.min(ended));
        let passed = passed(self.mailbox, stretch.until, ended, over);
        self.logged.finish(stretch, ended, passed)
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
