//! A run under the real clock: stretches of threads, between them pauses.

use std::{collections::HashMap, io};

use ratelab::{
    Clock, ClockExit, ClockKind, Fault, Graph, Inbox, RunError, Time,
    clock::{CoreClaim, ThreadGroup, Wait, note_end, obey_at_rest},
    journal::{End, Entry},
    sync::{Arc, spawn_named, thread},
};

use crate::{
    mailbox::Post,
    priority::{CoreShare, DeadlineRanks, RealtimePriority, spare_cores},
    supervisor::{Report, StretchEnd, Supervisor},
    wall_thread::{Board, ThreadContext, WallThread},
};

/// Runs every node on a thread of its own, or on the threads of its executor.
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
/// use ratelab::{Graph, Hz, Tick, Time};
/// use ratelab_real_clock::RealClock;
///
/// let mut graph = Graph::new();
/// graph.node("busy", Hz::new(100.0)?, 0, |_| |_: &mut Tick| {
///     sleep(Duration::from_millis(25)); // Too slow for its rate.
/// })?;
/// RealClock::default().run_to(&mut graph, 0.1)?; // About 4 ticks of 11.
/// assert!(graph.now() >= Time::from_secs_f64(0.1)?);
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

    /// Runs the graph on threads until the run time `end` (s), without commands.
    ///
    /// # Errors
    /// [`RunError`] for a number that is not a run time, and if a node failed.
    pub fn run_to(&mut self, graph: &mut Graph, end: f64) -> Result<ClockExit, RunError> {
        let end = Time::from_secs_f64(end)?;
        Ok(self.run(graph, &mut Inbox::default(), end)?)
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
        graph.set_cores(self.cores());
        if let Some(refusal) = graph.needs_virtual_time() {
            return Err(Fault {
                node: refusal.node,
                at: graph.now(),
                cause: refusal.why.into(),
            });
        }
        graph.set_clock(ClockKind::Real);
        let end = loop {
            let end = if graph.state().status().paused {
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
    let log = graph.run_writer().entries_of(SUPERVISOR);
    let Some(command) = inbox.receive(Wait::Forever) else {
        // All senders are gone, so nothing can end the pause.
        log.note_alone(Entry::Abandoned);
        return Some(ClockExit::Stopped);
    };
    let now = graph.now();
    let obeyed = obey_at_rest(graph, &command, now);
    let event = obeyed.event as u64;
    log.note_alone(Entry::Rest { event });
    obeyed.exit
}

/// Number of the supervisor's thread in the log; the nodes follow.
const SUPERVISOR: usize = 0;

impl RealClock {
    /// Runs until the end or a pause; returns `None` for a pause.
    fn stretch(
        &self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<Option<ClockExit>, Fault> {
        let (state, nodes) = (graph.run_writer(), graph.node_count());
        state.begin_threads(nodes);
        let log = state.entries_of(SUPERVISOR);
        let (reporter, reports) = crossbeam_channel::unbounded();
        let context = ThreadContext {
            until,
            realtime: self.realtime.clone(),
            reporter,
            state: state.clone(),
        };
        let (task_sets, supervision) = graph.apart();
        let groups = task_sets.groups();
        let boards: Vec<Board> = groups.iter().map(|_| Board::default()).collect();
        let post = Arc::new(Post::new(
            nodes,
            groups.iter().zip(boards.iter().map(|board| &board.mailbox)),
        ));
        task_sets.wake_by(post.clone());
        let mut supervisor = Supervisor {
            graph: supervision,
            state,
            inbox,
            until,
            post: &post,
            reports,
            working: groups.iter().map(|group| group.workers.len()).sum(),
            log: log.clone(),
        };
        let noter = log.noter();
        let end = thread::scope(|scope| {
            let (spare, taken) = (spare_cores(), HashMap::new());
            let mut shares = CoreShares { spare, taken };
            for (group, board) in groups.into_iter().zip(&boards) {
                let share = group.claim.map(|claim| shares.claim(claim, &group));
                context.spawn(scope, group, board, share);
            }
            supervisor.supervise()
        });
        let end = supervisor.settle(end);
        drop((noter, task_sets));
        log.note_alone(Entry::End(end.end));
        end.exit(graph)
    }
}

impl ThreadContext {
    /// Starts the threads of a task set.
    fn spawn<'scope>(
        &'scope self,
        scope: &'scope thread::Scope<'scope, '_>,
        group: ThreadGroup<'scope>,
        board: &'scope Board,
        share: Option<CoreShare>,
    ) {
        let ThreadGroup { name, workers, .. } = group;
        let first = workers.first().map(|(node, _)| *node);
        for (node, worker) in workers {
            let thread = WallThread {
                worker,
                board,
                share: share.clone(),
                log: self.state.entries_of(SUPERVISOR + 1 + node),
                context: self,
            };
            let spawned = spawn_named(scope, &name, || thread.run());
            self.check(spawned, first.unwrap_or(node), &name);
        }
    }

    /// Reports a thread that the system refused.
    fn check(&self, spawned: io::Result<()>, node: usize, name: &str) {
        if let Err(error) = spawned {
            let (at, name, cause) = (self.state.now(), name.to_owned(), error.into());
            let refused = StretchEnd {
                end: End::NoThread { node, at },
                fault: Some(Fault {
                    node: name,
                    at,
                    cause,
                }),
            };
            let _ = self.reporter.send(Report::Ends(refused));
        }
    }
}

/// The cores of executors whose nodes take turns by priority or deadline.
struct CoreShares {
    /// The cores that no executor has.
    spare: Vec<usize>,
    /// The cores of each executor, by its number, with its threads that have work.
    taken: HashMap<usize, (Vec<usize>, Arc<DeadlineRanks>)>,
}

impl CoreShares {
    /// Returns the share of the node in a `group` that claims some.
    fn claim(&mut self, claim: CoreClaim, group: &ThreadGroup<'_>) -> CoreShare {
        let left = self.spare.len().saturating_sub(claim.cores);
        let spare = &mut self.spare;
        let taken = self.taken.entry(claim.executor);
        let (cores, ranks) = taken.or_insert_with(|| (spare.split_off(left), Arc::default()));
        let by_deadline = group
            .workers
            .iter()
            .any(|(_, worker)| worker.deadline(Time::ZERO).is_some());
        CoreShare {
            rank: claim.rank,
            cores: cores.clone(),
            deadlines: by_deadline.then(|| ranks.clone()),
        }
    }
}
