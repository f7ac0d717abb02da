//! One thread per node against the wall clock.

use std::ops::ControlFlow;

use crossbeam_channel::{Receiver, Sender};

use super::{
    Clock, Exit,
    mailbox::{Mail, Mailbox},
    note_end, obey, obey_at_rest,
    realtime::{self, Realtime},
    wall::Wall,
};
use crate::runtime::{
    command::{ClockKind, Command},
    graph::{Graph, Plane},
    inbox::{Inbox, Wait, Word},
    node::Fault,
    slot::Slot,
    sync::{Arc, atomic::Ordering, spawn_named, thread},
    telemetry::Shared,
    time::Time,
};

/// Runs every node on a thread of its own.
///
/// Each thread sleeps to absolute deadlines and measures how late it woke. A
/// node that is still busy when its next deadline passes has overrun: the
/// periods it missed are skipped and counted, never made up for in a burst.
/// The order of nodes that are due together is the operating system's, so two
/// runs are never quite the same.
///
/// A pause brings all threads home and stops run time; so does handing over.
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
    realtime: Option<Realtime>,
}

impl RealClock {
    /// A clock whose threads run with real-time priority, if it was granted.
    pub fn new(realtime: Option<Realtime>) -> Self {
        Self { realtime }
    }
}

impl Clock for RealClock {
    fn kind(&self) -> ClockKind {
        ClockKind::Real
    }

    fn run(&mut self, graph: &mut Graph, inbox: &mut Inbox, until: Time) -> Result<Exit, Fault> {
        graph.plane.update(|status| status.clock = ClockKind::Real);
        graph.plane.patience.set(false);
        let end = loop {
            let end = if graph.plane.status.paused {
                Ok(rest(graph, inbox))
            } else {
                self.stretch(graph, inbox, until)
            };
            if let Some(end) = end.transpose() {
                break end;
            }
        };
        note_end(&graph.plane, &end);
        end
    }
}

/// Obeys commands while run time stands still. Timed ones wait with it.
fn rest(graph: &mut Graph, inbox: &mut Inbox) -> Option<Exit> {
    match inbox.receive(Wait::Forever) {
        Some(command) => obey_at_rest(graph, ClockKind::Real, &command, graph.now()),
        // Nobody is left who could end the pause.
        None => Some(Exit::Stopped),
    }
}

/// What a node's thread tells when it is done.
enum Report {
    /// It has ticked for the last time before the end of the run.
    Finished,
    /// It ended the run.
    Ended(Exit),
    /// It failed.
    Failed(Fault),
}

impl RealClock {
    /// Runs until the end or a pause; `None` means a pause.
    fn stretch(
        &self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<Option<Exit>, Fault> {
        let mailboxes: Vec<Mailbox> = graph.slots.iter().map(|_| Mailbox::default()).collect();
        let (reporter, reports) = crossbeam_channel::unbounded();
        let mut supervisor = Supervisor {
            plane: &mut graph.plane,
            inbox,
            until,
            mailboxes: &mailboxes,
            reports,
            working: graph.slots.len(),
        };
        let end = thread::scope(|scope| {
            for (slot, mailbox) in graph.slots.iter_mut().zip(&mailboxes) {
                let name = slot.entry.name.clone();
                let worker = Worker {
                    slot,
                    mailbox,
                    until,
                    shared: supervisor.plane.shared.clone(),
                    realtime: self.realtime.clone(),
                    reporter: reporter.clone(),
                };
                if let Err(error) = spawn_named(scope, &name, move || worker.run()) {
                    let (node, at) = (name.to_string(), supervisor.plane.now());
                    let cause = error.into();
                    let _ = reporter.send(Report::Failed(Fault { node, at, cause }));
                }
            }
            let end = supervisor.supervise();
            let stopped = supervisor.plane.now();
            for mailbox in &mailboxes {
                mailbox.post(Mail::Leave(stopped));
            }
            end
        });
        supervisor.settle(end)
    }
}

/// The thread that called the clock: obeys commands, watches the nodes.
struct Supervisor<'a> {
    plane: &'a mut Plane,
    inbox: &'a mut Inbox,
    until: Time,
    mailboxes: &'a [Mailbox],
    reports: Receiver<Report>,
    /// Nodes that are still to tick before the end.
    working: usize,
}

impl Supervisor<'_> {
    /// Lets the nodes begin; returns when they are to come home, with `None`
    /// for a pause.
    fn supervise(&mut self) -> Result<Option<Exit>, Fault> {
        let wall = Wall::starting_at(self.plane.now());
        for mailbox in self.mailboxes {
            mailbox.post(Mail::Begin(wall));
        }
        while self.working > 0 || wall.now() < self.until {
            match self.next_word(&wall) {
                Word::Command(command) => {
                    let at = wall.now();
                    let exit = self.obey(command, at);
                    if exit.is_some() || self.plane.status.paused {
                        // A node may have begun a tick after `at` already.
                        self.plane.shared.come_to(at);
                        return Ok(exit);
                    }
                }
                Word::Other(Report::Finished) => self.working -= 1,
                Word::Other(Report::Ended(exit)) => return Ok(Some(exit)),
                Word::Other(Report::Failed(fault)) => return Err(fault),
                Word::Silence => {}
            }
        }
        self.plane.set_now(self.until);
        Ok(Some(Exit::Completed))
    }

    /// A timed command that is due, else whatever comes before the next one.
    fn next_word(&mut self, wall: &Wall) -> Word<Report> {
        let now = wall.now();
        let timed = self.inbox.next_timed(self.until);
        if timed <= now
            && let Some(timed) = self.inbox.take_timed(self.until)
        {
            return Word::Command(timed.command);
        }
        let end = if now < self.until {
            self.until
        } else {
            Time::MAX
        };
        let deadline = wall.instant_of(timed.min(end));
        self.inbox.receive_or(&self.reports, deadline)
    }

    fn obey(&mut self, command: Command, at: Time) -> Option<Exit> {
        let Some(node) = command.node() else {
            return obey(self.plane, ClockKind::Real, &command, at);
        };
        match self.plane.node_index(node) {
            Ok(index) => self.mailboxes[index].post(Mail::Obey(command)),
            Err(reason) => self.plane.journal().refused(at, &command, reason),
        }
        None
    }

    /// What the nodes reported on their way home outweighs why they were
    /// called: a failure first, then an end.
    fn settle(self, end: Result<Option<Exit>, Fault>) -> Result<Option<Exit>, Fault> {
        let mut end = end?;
        for report in self.reports.try_iter() {
            match report {
                Report::Failed(fault) => return Err(fault),
                Report::Ended(exit) if !matches!(end, Some(Exit::Ended { .. })) => end = Some(exit),
                Report::Ended(_) | Report::Finished => {}
            }
        }
        Ok(end)
    }
}

/// A node's thread.
struct Worker<'a> {
    slot: &'a mut Slot,
    mailbox: &'a Mailbox,
    until: Time,
    shared: Arc<Shared>,
    realtime: Option<Realtime>,
    reporter: Sender<Report>,
}

impl Worker<'_> {
    fn run(mut self) {
        realtime::prepare_thread(self.realtime.as_ref());
        if let Mail::Begin(wall) = self.mailbox.wait()
            && let Some(report) = self.work(&wall)
        {
            // The supervisor holds the other end until all threads are home.
            let _ = self.reporter.send(report);
        }
    }

    /// Ticks until there is something to report, or the call to come home.
    fn work(&mut self, wall: &Wall) -> Option<Report> {
        loop {
            let due = self.slot.rate.due();
            match self.mailbox.wait_until(wall, due.min(self.until)) {
                Some(Mail::Leave(_)) => return None,
                Some(Mail::Begin(_)) => {}
                Some(Mail::Obey(command)) => self.obey(&command, wall.now()),
                None if due > self.until => return Some(Report::Finished),
                None => {
                    if let Some(report) = self.tick(wall, due) {
                        return Some(report);
                    }
                }
            }
        }
    }

    fn obey(&mut self, command: &Command, at: Time) {
        self.shared.come_to(at);
        let answer = self.slot.obey(command, at);
        self.shared.journal.answered(at, command, answer);
    }

    fn tick(&mut self, wall: &Wall, due: Time) -> Option<Report> {
        let began = wall.now();
        self.shared.come_to(began);
        self.slot.entry.busy.store(true, Ordering::Relaxed);
        let outcome = self.slot.tick(began);
        self.slot.entry.busy.store(false, Ordering::Relaxed);
        let ended = wall.now();
        // Run time may have stopped while the node was busy, or ended: what was
        // due by then is missed, and nothing after it.
        let stopped = self.mailbox.called_home().unwrap_or(Time::MAX);
        let last = stopped.max(began).min(self.until);
        self.slot.advance_past(ended.min(last + Time::TICK));
        let (lateness, took) = (began.since(due), ended.since(began));
        self.slot.note_tick(began, Some(lateness), Some(took));
        match outcome {
            Ok(ControlFlow::Continue(())) => None,
            Ok(ControlFlow::Break(())) => Some(Report::Ended(Exit::Ended {
                node: self.slot.entry.name.to_string(),
                at: began,
            })),
            Err(cause) => Some(Report::Failed(self.slot.fault(began, cause))),
        }
    }
}
