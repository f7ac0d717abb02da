//! Threads against the wall clock: one for each node, or those of its executor.

mod mailbox;
mod supervisor;
mod wall_thread;

use std::{
    collections::{BTreeSet, HashMap},
    io,
};

use crossbeam_channel::Sender;

use self::{
    mailbox::{Post, mailboxes},
    supervisor::{Report, StretchEnd, Supervisor},
    wall_thread::{Board, WallThread},
};
use super::{Clock, ClockExit, note_end, obey::obey_at_rest, task_sets::threads};
use crate::{
    command::ClockKind,
    graph::Graph,
    inbox::{Inbox, Wait},
    journal::{End, Entry},
    node::Fault,
    realtime::{CoreShare, RealtimePriority, spare_cores},
    scheduling::Threads,
    sync::{Arc, get_mut, spawn_named, thread},
    time::Time,
    trigger::Wake,
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
        if let Some((node, why)) = graph.needs_virtual_time() {
            let at = graph.now();
            return Err(get_mut(&mut graph.slots[node]).fault(at, why.into()));
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
        state.begin_threads(graph.slots.len());
        let log = state.entries_of(SUPERVISOR);
        let context = ThreadContext {
            until,
            realtime: self.realtime.clone(),
            reporter,
        };
        let (now, in_flight) = (graph.now(), graph.control.arrivals_after(graph.now()));
        let mut shares = shares(graph);
        let post = Arc::new(Post::new(graph, &mailboxes));
        let (task_sets, graph_left) = graph.apart_with(post.clone());
        in_flight.into_iter().for_each(|arrival| post.wake(arrival));
        let boards: Vec<Board> = task_sets
            .here()
            .map(|schedule| Board::new(mailboxes[schedule.first].clone()))
            .collect();
        let mut supervisor = Supervisor {
            graph: graph_left,
            inbox,
            until,
            mailboxes: &mailboxes,
            reports,
            working: task_sets.threads().count(),
            log: log.clone(),
        };
        let noter = log.noter();
        let end = thread::scope(|scope| {
            for (schedule, board) in task_sets.here().zip(&boards) {
                let (first, name) = (schedule.first, schedule.name());
                for (number, worker) in threads(schedule) {
                    let thread = WallThread {
                        worker,
                        board,
                        share: shares.remove(&first),
                        log: state.entries_of(SUPERVISOR + 1 + number),
                        context: &context,
                    };
                    let spawned = spawn_named(scope, &name, || thread.run());
                    context.check(spawned, (first, &name), now);
                }
            }
            let end = supervisor.supervise();
            supervisor.graph.control.state.set_zero(None);
            let stopped = supervisor.graph.control.now();
            for mailbox in &mailboxes {
                mailbox.post(|mail| mail.stopped = Some(stopped));
            }
            end
        });
        let end = supervisor.settle(end);
        drop((noter, boards, task_sets));
        log.note_alone(Entry::End(end.end));
        end.exit(graph)
    }
}

impl ThreadContext {
    /// Reports a thread that the system refused.
    fn check(&self, spawned: io::Result<()>, (node, name): (usize, &str), at: Time) {
        if let Err(error) = spawned {
            let (name, cause) = (name.to_owned(), error.into());
            let refused = StretchEnd {
                end: End::NoThread { node, at },
                fault: Some(Fault {
                    node: name,
                    at,
                    cause,
                }),
            };
            let _ = self.reporter.send(Some(refused));
        }
    }
}

/// The cores of each node whose executor takes it off them for others, by its index.
fn shares(graph: &Graph) -> HashMap<usize, CoreShare> {
    let (mut spare, mut shares) = (spare_cores(), HashMap::new());
    for task_set in graph.schedule.task_sets() {
        let threads = task_set
            .dispatch
            .as_ref()
            .map(|dispatch| dispatch.threads());
        let Some(Threads::Cores(cores)) = threads else {
            continue;
        };
        let cores = spare.split_off(spare.len().saturating_sub(cores));
        let here = || task_set.members.iter().filter(|member| !member.remote);
        let priorities: BTreeSet<u32> = here().map(|member| member.priority).collect();
        shares.extend(here().map(|member| {
            let rank = priorities.range(..member.priority).count();
            let cores = cores.clone();
            (member.node, CoreShare { rank, cores })
        }));
    }
    shares
}
