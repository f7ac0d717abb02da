//! One thread per node against the wall clock.

use std::ops::ControlFlow;

use crossbeam_channel::{Receiver, Sender};

use super::{
    Clock, ClockExit,
    mailbox::{Mailbox, Wakeup},
    note_end, obey, obey_at_rest,
    realtime::{self, RealtimePriority},
    wall::Wall,
};
use crate::runtime::{
    command::{ClockKind, Command},
    graph::{ControlPlane, Graph},
    inbox::{Inbox, Received, Wait},
    node::{Fault, Tick},
    scheduled_node::ScheduledNode,
    sync::{Arc, atomic::Ordering, lock, spawn_named, thread},
    telemetry::Shared,
    time::Time,
};

/// Runs every node on a thread of its own.
///
/// Each thread sleeps to absolute deadlines and measures its lateness. A node that is
/// still busy when its next deadline passes has overrun: the periods it missed are
/// skipped and counted, without a burst of late ticks. The operating system decides the
/// order of nodes that are due together, so two runs always differ a little.
///
/// A pause ends all threads and stops run time; so does a handover.
///
/// ```
/// use std::{thread::sleep, time::Duration};
/// use ratelab::runtime::{Clock, GO_ON, Graph, Hz, Inbox, RealClock, Time};
///
/// let mut graph = Graph::new();
/// graph.node("busy", Hz::new(100.0)?, 0, |_| |_| {
///     sleep(Duration::from_millis(25)); // Too slow for its rate.
///     GO_ON
/// })?;
/// let end = Time::from_secs_f64(0.1)?;
/// RealClock::default().run(&mut graph, &mut Inbox::default(), end)?;
/// let busy = &graph.observer().snapshot().nodes[0];
/// assert!(busy.overruns > 0 && busy.ticks + busy.overruns == 11);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct RealClock {
    realtime: Option<RealtimePriority>,
}

impl RealClock {
    /// Creates a clock; with `realtime`, its threads run with real-time priority.
    pub fn new(realtime: Option<RealtimePriority>) -> Self {
        Self { realtime }
    }
}

impl Clock for RealClock {
    fn kind(&self) -> ClockKind {
        ClockKind::Real
    }

    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        graph.set_clock(ClockKind::Real);
        let end = loop {
            let end = if graph.control.status.paused {
                Ok(rest(graph, inbox))
            } else {
                self.stretch(graph, inbox, until)
            };
            if let Some(end) = end.transpose() {
                break end;
            }
        };
        note_end(graph, &end);
        end
    }
}

/// Carries out commands during a pause. Timed commands wait until run time goes on.
fn rest(graph: &mut Graph, inbox: &mut Inbox) -> Option<ClockExit> {
    match inbox.receive(Wait::Forever) {
        Some(command) => obey_at_rest(graph, ClockKind::Real, &command, graph.now()),
        // All senders are gone, so nothing can end the pause.
        None => Some(ClockExit::Stopped),
    }
}

/// The report of a node's thread when it ends.
enum Report {
    /// The node's last tick before the end of the run is over.
    Finished,
    /// The node ended the run.
    Ended(ClockExit),
    /// The node failed.
    Failed(Fault),
}

impl RealClock {
    /// Runs until the end or a pause; returns `None` for a pause.
    fn stretch(
        &self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<Option<ClockExit>, Fault> {
        let mailboxes: Vec<Mailbox> = graph.nodes.iter().map(|_| Mailbox::default()).collect();
        let (reporter, reports) = crossbeam_channel::unbounded();
        let mut supervisor = Supervisor {
            control: &mut graph.control,
            inbox,
            until,
            mailboxes: &mailboxes,
            reports,
            working: graph.nodes.iter().filter(|node| !node.entry.remote).count(),
        };
        let end = thread::scope(|scope| {
            let nodes = graph.nodes.iter_mut().zip(&mailboxes);
            for (node, mailbox) in nodes.filter(|(node, _)| !node.entry.remote) {
                let name = node.entry.name.clone();
                let worker = Worker {
                    node,
                    mailbox,
                    until,
                    shared: supervisor.control.shared.clone(),
                    realtime: self.realtime.clone(),
                    reporter: reporter.clone(),
                };
                if let Err(error) = spawn_named(scope, &name, move || worker.run()) {
                    let (node, at) = (name.to_string(), supervisor.control.now());
                    let cause = error.into();
                    let _ = reporter.send(Report::Failed(Fault { node, at, cause }));
                }
            }
            let end = supervisor.supervise();
            *lock(&supervisor.control.shared.zero) = None;
            let stopped = supervisor.control.now();
            for mailbox in &mailboxes {
                mailbox.post(Wakeup::Stop(stopped));
            }
            end
        });
        supervisor.settle(end)
    }
}

/// The calling thread: carries out commands and watches the nodes.
struct Supervisor<'a> {
    control: &'a mut ControlPlane,
    inbox: &'a mut Inbox,
    until: Time,
    mailboxes: &'a [Mailbox],
    reports: Receiver<Report>,
    /// Number of nodes with ticks left before the end.
    working: usize,
}

impl Supervisor<'_> {
    /// Starts the nodes; returns when they are to stop, with `None` for a pause.
    fn supervise(&mut self) -> Result<Option<ClockExit>, Fault> {
        let wall = Wall::starting_at(self.control.now());
        *lock(&self.control.shared.zero) = wall.zero();
        for mailbox in self.mailboxes {
            mailbox.post(Wakeup::Start(wall));
        }
        while self.working > 0 || wall.now() < self.until {
            match self.next_received(&wall) {
                Received::Command(command) => {
                    let at = wall.now();
                    let exit = self.obey(command, at);
                    if exit.is_some() || self.control.status.paused {
                        // A node may have begun a tick later than `at` already.
                        self.control.shared.advance_to(at);
                        return Ok(exit);
                    }
                }
                Received::Other(Report::Finished) => self.working -= 1,
                Received::Other(Report::Ended(exit)) => return Ok(Some(exit)),
                Received::Other(Report::Failed(fault)) => return Err(fault),
                Received::Timeout => {}
            }
        }
        self.control.set_now(self.until);
        Ok(Some(ClockExit::Completed))
    }

    /// A timed command that is due, or else whatever arrives before the next timed one.
    fn next_received(&mut self, wall: &Wall) -> Received<Report> {
        let now = wall.now();
        let timed = self.inbox.next_timed(self.until);
        if timed <= now
            && let Some(timed) = self.inbox.take_timed(self.until)
        {
            return Received::Command(timed.command);
        }
        let end = if now < self.until {
            self.until
        } else {
            Time::MAX
        };
        let deadline = wall.instant_of(timed.min(end));
        self.inbox.receive_or(&self.reports, deadline)
    }

    fn obey(&mut self, command: Command, at: Time) -> Option<ClockExit> {
        let Some(node) = command.node() else {
            return obey(self.control, ClockKind::Real, &command, at);
        };
        match self.control.local_index(node) {
            Ok(index) => self.mailboxes[index].post(Wakeup::Command(command)),
            Err(reason) => self.control.log().refused(at, &command, reason),
        }
        None
    }

    /// Combines the reason for the stop with the nodes' reports: a failure has priority,
    /// then an end.
    fn settle(self, end: Result<Option<ClockExit>, Fault>) -> Result<Option<ClockExit>, Fault> {
        let mut end = end?;
        for report in self.reports.try_iter() {
            match report {
                Report::Failed(fault) => return Err(fault),
                Report::Ended(exit) if !matches!(end, Some(ClockExit::Ended { .. })) => {
                    end = Some(exit)
                }
                Report::Ended(_) | Report::Finished => {}
            }
        }
        Ok(end)
    }
}

/// A node's thread.
struct Worker<'a> {
    node: &'a mut ScheduledNode,
    mailbox: &'a Mailbox,
    until: Time,
    shared: Arc<Shared>,
    realtime: Option<RealtimePriority>,
    reporter: Sender<Report>,
}

impl Worker<'_> {
    fn run(mut self) {
        realtime::prepare_thread(self.realtime.as_ref());
        if let Wakeup::Start(wall) = self.mailbox.wait()
            && let Some(report) = self.work(&wall)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = self.reporter.send(report);
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&mut self, wall: &Wall) -> Option<Report> {
        loop {
            let next = self.node.next_at();
            match self.wait_until(wall, next.min(self.until)) {
                Some(Wakeup::Stop(at)) => {
                    self.node.overrun_before(at.min(self.until) + Time::TICK);
                    return None;
                }
                Some(Wakeup::Start(_)) => {}
                Some(Wakeup::Command(command)) => self.obey(&command, wall.now()),
                None if next > self.until => {
                    self.node.overrun_before(self.until + Time::TICK);
                    return Some(Report::Finished);
                }
                None => {
                    let report = match self.node.running() {
                        Some(_) => self.finish(wall),
                        None => self.tick(wall),
                    };
                    if report.is_some() {
                        return report;
                    }
                }
            }
        }
    }

    /// Waits for a wake-up or run time `time`; busy-waits during a tick that keeps a core
    /// busy.
    fn wait_until(&self, wall: &Wall, time: Time) -> Option<Wakeup> {
        match self.node.running() {
            Some(running) if running.busy => self.mailbox.spin_until(wall, time),
            _ => self.mailbox.wait_until(wall, time),
        }
    }

    fn obey(&mut self, command: &Command, at: Time) {
        self.shared.advance_to(at);
        let answer = self.node.obey(command, at);
        self.shared.log.answered(at, command, answer);
    }

    fn tick(&mut self, wall: &Wall) -> Option<Report> {
        let began = wall.now();
        self.shared.advance_to(began);
        let lateness = Some(began.since(self.node.take_due()));
        if let Some(cost) = self.node.cost() {
            let started = self.node.start(began, cost, lateness);
            return match started {
                Ok(_) => None,
                Err(cause) => Some(Report::Failed(self.node.fault(began, cause))),
            };
        }
        self.node.entry.counters.busy.store(true, Ordering::Relaxed);
        let outcome = self.node.tick(began);
        self.node
            .entry
            .counters
            .busy
            .store(false, Ordering::Relaxed);
        let ended = wall.now();
        self.node.overrun_until(self.passed(began, ended));
        let took = Some(ended.since(began));
        self.node.note_tick(began, lateness, took, Some(began));
        self.report(began, outcome)
    }

    /// Ends a tick that takes time.
    fn finish(&mut self, wall: &Wall) -> Option<Report> {
        let ended = wall.now();
        self.shared.advance_to(ended);
        let outcome = self.node.finish(ended, self.passed(ended, ended));
        self.report(ended, outcome)
    }

    /// The limit before which due ticks count as missed, for a tick that ended at
    /// `ended`. Run time may have stopped or ended while the node was busy: only ticks
    /// due by then are missed.
    fn passed(&self, at: Time, ended: Time) -> Time {
        let stopped = self.mailbox.stop_requested().unwrap_or(Time::MAX);
        let last = stopped.max(at).min(self.until);
        ended.min(last + Time::TICK)
    }

    /// The report after a tick whose work was done at `at`, if there is one.
    fn report(&self, at: Time, outcome: Tick) -> Option<Report> {
        match outcome {
            Ok(ControlFlow::Continue(())) => None,
            Ok(ControlFlow::Break(())) => Some(Report::Ended(ClockExit::Ended {
                node: self.node.entry.name.to_string(),
                at,
            })),
            Err(cause) => Some(Report::Failed(self.node.fault(at, cause))),
        }
    }
}
