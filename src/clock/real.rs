//! Threads against the wall clock: one for each node, or those of its executor.

mod crew;
mod ends;
mod mailbox;
mod supervisor;
mod threads;

use std::io;

use crossbeam_channel::Sender;

use self::{
    crew::CrewThreads,
    ends::{Report, StretchEnd},
    mailbox::Wakeup,
    supervisor::Supervisor,
    threads::{crews_of, mailboxes, shares, threads},
};
use super::{Clock, ClockExit, note_end, obey::obey_at_rest};
use crate::{
    command::ClockKind,
    graph::Graph,
    inbox::{Inbox, Wait},
    journal::{End, Entry},
    node::Fault,
    realtime::{RealtimePriority, spare_cores},
    sync::{Arc, spawn_named, thread},
    time::Time,
};

/// Runs every node on a thread of its own, or on those of its executor.
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
/// use ratelab::{Clock, GO_ON, Graph, Hz, Inbox, RealClock, Time};
///
/// let mut graph = Graph::new();
/// graph.node("busy", Hz::new(100.0)?, 0, |_| |_| {
///     sleep(Duration::from_millis(25)); // Too slow for its rate.
///     GO_ON
/// })?;
/// let end = Time::from_secs_f64(0.1)?;
/// RealClock::default().run(&mut graph, &mut Inbox::default(), end)?; // About 4 ticks of 11.
/// assert!(graph.now() >= end);
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
    fn cores(&self) -> Option<usize> {
        self.realtime.as_ref().map(|_| spare_cores().len())
    }

    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault> {
        graph.cores = self.cores();
        if let Some((seat, why)) = graph.needs_virtual_time() {
            return Err(seat.fault(graph.now(), why.into()));
        }
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
    let log = graph.control.state.entries_of(SUPERVISOR);
    let Some(command) = inbox.receive(Wait::Forever) else {
        // All senders are gone, so nothing can end the pause.
        log.note_alone(Entry::Abandoned);
        return Some(ClockExit::Stopped);
    };
    let obeyed = obey_at_rest(graph, ClockKind::Real, &command, graph.now());
    let event = obeyed.event as u64;
    log.note_alone(Entry::Rest { event });
    obeyed.exit
}

/// Number of the supervisor's thread in the log; the nodes follow.
const SUPERVISOR: usize = 0;

/// What all threads have in common until the next pause or end.
struct ThreadContext {
    until: Time,
    realtime: Option<RealtimePriority>,
    reporter: Sender<Report>,
}

impl RealClock {
    /// Runs until the end or a pause; returns `None` for a pause.
    fn stretch(
        &self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<Option<ClockExit>, Fault> {
        let mailboxes = mailboxes(graph);
        let (reporter, reports) = crossbeam_channel::unbounded();
        let state = graph.control.state.clone();
        state.begin_threads(graph.seats.len());
        let log = state.entries_of(SUPERVISOR);
        let context = ThreadContext {
            until,
            realtime: self.realtime.clone(),
            reporter,
        };
        let now = graph.now();
        let shares = shares(graph);
        let crews = crews_of(graph, &mailboxes);
        let threads = threads(&crews, &mailboxes, shares);
        let mut supervisor = Supervisor {
            control: &mut graph.control,
            inbox,
            until,
            mailboxes: &mailboxes,
            reports,
            working: threads.iter().map(CrewThreads::count).sum(),
            log: log.clone(),
        };
        let noter = log.noter();
        let end = thread::scope(|scope| {
            for crew in &threads {
                let first = crew.first();
                for thread in 0..crew.count() {
                    let context = &context;
                    let run = move || crew.run(thread, context);
                    context.check(spawn_named(scope, &first.1, run), first.clone(), now);
                }
            }
            let end = supervisor.supervise();
            supervisor.control.state.set_zero(None);
            let stopped = supervisor.control.now();
            for mailbox in &mailboxes {
                mailbox.post(Wakeup::Stop(stopped));
            }
            end
        });
        let end = supervisor.settle(end);
        drop(noter);
        drop(threads);
        crews.put_back(graph);
        log.note_alone(Entry::End(end.end));
        end.exit(graph)
    }
}

impl ThreadContext {
    /// Reports a thread that the system refused.
    fn check(&self, spawned: io::Result<()>, (index, name): (usize, Arc<str>), at: Time) {
        if let Err(error) = spawned {
            let (node, cause) = (name.to_string(), error.into());
            let refused = StretchEnd {
                end: End::NoThread { node: index, at },
                fault: Some(Fault { node, at, cause }),
            };
            let _ = self.reporter.send(Some(refused));
        }
    }
}
