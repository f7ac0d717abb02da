//! One thread per node against the wall clock.

use std::time::Duration;

use crossbeam_channel::{Receiver, Sender};

use super::{
    Clock, ClockExit,
    arrivals::{Inbound, begin_arrivals, end_arrivals},
    mailbox::{Mailbox, Wakeup},
    note_end,
    obey::obey_at_rest,
    realtime::{self, RealtimePriority},
    steps::{self, Outcome, TickEnd},
    wall::Wall,
};
use crate::runtime::{
    command::{ClockKind, Command},
    graph::{ControlPlane, Graph},
    inbox::{Inbox, Received, Wait},
    node::Fault,
    reexecution::{End, Entry, Noter, Stream},
    scheduled_node::ScheduledNode,
    sync::{Arc, lock, spawn_named, thread},
    telemetry::RunState,
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
        if let Some((node, why)) = graph.needs_virtual_time() {
            return Err(node.fault(graph.now(), why.into()));
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
    let log = graph.control.state.threads.stream(SUPERVISOR);
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

/// The report of a node's thread when it ends.
enum Report {
    /// The node's last tick before the end of the run is over.
    Finished,
    /// The node ended the run.
    Ended(NodeEnd),
    /// The node failed.
    Failed(NodeEnd, Fault),
    /// The node has no thread.
    NoThread(NodeEnd, Fault),
}

/// The node that ended the run, and the run time.
#[derive(Clone, Copy, PartialEq)]
struct NodeEnd {
    /// Its index.
    node: usize,
    at: Time,
}

/// The reason for the end of a stretch.
enum StretchEnd {
    Paused,
    Exit(ClockExit),
    Ended(NodeEnd),
    Failed(NodeEnd, Fault),
    NoThread(NodeEnd, Fault),
}

impl RealClock {
    /// Runs until the end or a pause; returns `None` for a pause.
    fn stretch(
        &self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<Option<ClockExit>, Fault> {
        let nodes = graph.nodes.iter();
        let mailboxes: Vec<Arc<Mailbox>> = nodes.map(|_| Arc::default()).collect();
        begin_arrivals(graph, &mailboxes);
        let (reporter, reports) = crossbeam_channel::unbounded();
        let state = graph.control.state.clone();
        let log = state.threads.begin(graph.nodes.len());
        let mut supervisor = Supervisor {
            control: &mut graph.control,
            inbox,
            until,
            mailboxes: &mailboxes,
            reports,
            working: graph.nodes.iter().filter(|node| !node.entry.remote).count(),
            log: log.clone(),
        };
        let noter = Noter::new();
        let end = thread::scope(|scope| {
            let nodes = graph.nodes.iter_mut().zip(&mailboxes).enumerate();
            for (index, (node, mailbox)) in nodes.filter(|(_, (node, _))| !node.entry.remote) {
                let name = node.entry.name.clone();
                let worker = Worker {
                    node,
                    index,
                    mailbox,
                    arrivals: Inbound::new(),
                    until,
                    state: state.clone(),
                    log: state.threads.stream(SUPERVISOR + 1 + index),
                    realtime: self.realtime.clone(),
                    reporter: reporter.clone(),
                };
                if let Err(error) = spawn_named(scope, &name, move || worker.run()) {
                    let (node, at) = (name.to_string(), supervisor.control.now());
                    let cause = error.into();
                    let fault = Fault { node, at, cause };
                    let end = NodeEnd { node: index, at };
                    let _ = reporter.send(Report::NoThread(end, fault));
                }
            }
            let end = supervisor.supervise();
            *lock(&supervisor.control.state.zero) = None;
            let stopped = supervisor.control.now();
            for mailbox in &mailboxes {
                mailbox.post(Wakeup::Stop(stopped));
            }
            end
        });
        let end = supervisor.settle(end);
        drop(noter);
        end_arrivals(graph, &mailboxes);
        log.note_alone(Entry::End(end.entry(until)));
        end.exit(graph)
    }
}

impl StretchEnd {
    fn entry(&self, until: Time) -> End {
        match self {
            Self::Paused => End::Paused,
            Self::Exit(ClockExit::Completed) => End::Completed { until },
            Self::Exit(ClockExit::HandedOver(_)) => End::HandedOver,
            Self::Exit(_) => End::Stopped,
            Self::Ended(NodeEnd { node, at }) => End::Ended {
                node: *node,
                at: *at,
            },
            Self::Failed(NodeEnd { node, at }, _) => End::Failed {
                node: *node,
                at: *at,
            },
            Self::NoThread(NodeEnd { node, at }, _) => End::NoThread {
                node: *node,
                at: *at,
            },
        }
    }

    fn exit(self, graph: &Graph) -> Result<Option<ClockExit>, Fault> {
        match self {
            Self::Paused => Ok(None),
            Self::Exit(exit) => Ok(Some(exit)),
            Self::Ended(NodeEnd { node, at }) => Ok(Some(ClockExit::Ended {
                node: graph.nodes[node].entry.name.to_string(),
                at,
            })),
            Self::Failed(_, fault) | Self::NoThread(_, fault) => Err(fault),
        }
    }
}

impl Report {
    /// The end of the stretch, if this is one.
    fn end(self) -> Option<StretchEnd> {
        match self {
            Self::Finished => None,
            Self::Ended(end) => Some(StretchEnd::Ended(end)),
            Self::Failed(end, fault) => Some(StretchEnd::Failed(end, fault)),
            Self::NoThread(end, fault) => Some(StretchEnd::NoThread(end, fault)),
        }
    }
}

/// The calling thread: carries out commands and watches the nodes.
struct Supervisor<'a> {
    control: &'a mut ControlPlane,
    inbox: &'a mut Inbox,
    until: Time,
    mailboxes: &'a [Arc<Mailbox>],
    reports: Receiver<Report>,
    /// Number of nodes with ticks left before the end.
    working: usize,
    log: Arc<Stream>,
}

impl Supervisor<'_> {
    /// Starts the nodes; returns when they are to stop.
    fn supervise(&mut self) -> StretchEnd {
        let wall = Wall::starting_at(self.control.now());
        *lock(&self.control.state.zero) = wall.zero();
        for mailbox in self.mailboxes {
            mailbox.post(Wakeup::Start(wall));
        }
        while self.working > 0 || wall.now() < self.until {
            match self.next_received(&wall) {
                Received::Command(command) => {
                    let exit = self.obey(command, wall.now());
                    if let Some(exit) = exit {
                        return StretchEnd::Exit(exit);
                    }
                    if self.control.status.paused {
                        return StretchEnd::Paused;
                    }
                }
                Received::Other(report) => match report.end() {
                    None => self.working -= 1,
                    Some(end) => return end,
                },
                Received::Timeout => {}
            }
        }
        self.control.set_now(self.until);
        StretchEnd::Exit(ClockExit::Completed)
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
        let node = command.node().map(|node| self.control.local_index(node));
        if let Some(Ok(index)) = node {
            self.mailboxes[index].post(Wakeup::Command(command));
            return None;
        }
        let obeyed = steps::supervise(self.control, &command, at);
        let event = obeyed.event as u64;
        self.log.note(Entry::Obey { at, event });
        obeyed.exit
    }

    /// Combines the reason for the stop with the nodes' reports: a failure has priority,
    /// then an end.
    fn settle(&self, end: StretchEnd) -> StretchEnd {
        let mut end = end;
        if matches!(end, StretchEnd::Failed(..) | StretchEnd::NoThread(..)) {
            return end;
        }
        for report in self.reports.try_iter() {
            match report {
                Report::Ended(node) if !matches!(end, StretchEnd::Ended(_)) => {
                    end = StretchEnd::Ended(node);
                }
                Report::Ended(_) | Report::Finished => {}
                Report::Failed(node, fault) => return StretchEnd::Failed(node, fault),
                Report::NoThread(node, fault) => return StretchEnd::NoThread(node, fault),
            }
        }
        end
    }
}

/// A node's thread.
struct Worker<'a> {
    node: &'a mut ScheduledNode,
    index: usize,
    mailbox: &'a Mailbox,
    arrivals: Inbound,
    until: Time,
    state: Arc<RunState>,
    log: Arc<Stream>,
    realtime: Option<RealtimePriority>,
    reporter: Sender<Report>,
}

impl Worker<'_> {
    fn run(mut self) {
        realtime::prepare_thread(self.realtime.as_ref());
        let _noter = Noter::new();
        if let Some(wall) = self.start()
            && let Some(report) = self.work(&wall)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = self.reporter.send(report);
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
    fn work(&mut self, wall: &Wall) -> Option<Report> {
        loop {
            let next = self.next_at(wall);
            match self.wait_until(wall, next.min(self.until)) {
                Some(Wakeup::Stop(at)) => {
                    self.leave(at.min(self.until) + Time::TICK);
                    return None;
                }
                Some(Wakeup::Start(_)) => {}
                Some(Wakeup::Arrival(arrival)) => self.arrivals.add(arrival, wall.now()),
                Some(Wakeup::Command(command)) => self.obey(&command, wall.now()),
                None if next > self.until => {
                    self.leave(self.until + Time::TICK);
                    return Some(Report::Finished);
                }
                None => {
                    let outcome = match self.node.running() {
                        Some(_) => self.finish(wall),
                        None => self.tick(wall),
                    };
                    if let Some(outcome) = outcome {
                        return Some(self.report(outcome));
                    }
                }
            }
        }
    }

    /// Time of the node's next event. A message that waits begins no tick after the end of
    /// the run.
    fn next_at(&self, wall: &Wall) -> Time {
        let node = &*self.node;
        if !node.is_triggered() || node.is_occupied() || node.is_crashed() {
            return node.next_at();
        }
        match self.arrivals.next_at() {
            next if next <= self.until && wall.now() > self.until => Time::MAX,
            next => next,
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

    fn leave(&mut self, before: Time) {
        self.node.overrun_before(before);
        self.log.note(Entry::Leave { before });
    }

    fn obey(&mut self, command: &Command, at: Time) {
        let event = steps::obey_node(self.node, &self.state, command, at) as u64;
        // A node that restarts finds what its queues still keep.
        self.arrivals.look_at_all();
        self.log.note(Entry::Obey { at, event });
    }

    fn tick(&mut self, wall: &Wall) -> Outcome {
        let began = wall.now();
        self.arrivals.pass(began);
        let Some(due) = steps::take_due(self.node, &self.state, began) else {
            self.arrivals.found_none();
            self.log.note(Entry::Look { at: began });
            return None;
        };
        self.arrivals.took_one();
        let (mailbox, until) = (self.mailbox, self.until);
        let mut entry = Entry::Start { began };
        let outcome = steps::tick(self.node, due, began, || {
            let ended = wall.now();
            let took: Duration = ended.since(began);
            let passed = passed(mailbox, until, began, ended);
            entry = Entry::Tick {
                began,
                took,
                passed,
            };
            TickEnd { took, passed }
        });
        self.log.note(entry);
        outcome
    }

    /// Ends a tick that takes time.
    fn finish(&mut self, wall: &Wall) -> Outcome {
        let ended = wall.now();
        // With logical execution time the next tick begins where this one ends.
        let running = self.node.running().filter(|_| self.node.is_let());
        let over = running.map_or(ended, |running| running.ends.min(ended));
        let passed = passed(self.mailbox, self.until, ended, over);
        let outcome = steps::finish(self.node, &self.state, ended, passed);
        self.log.note(Entry::Finish { ended, passed });
        outcome
    }

    /// The report after a tick that was the node's last one.
    fn report(&self, outcome: Result<Time, Fault>) -> Report {
        let node = self.index;
        match outcome {
            Ok(at) => Report::Ended(NodeEnd { node, at }),
            Err(fault) => Report::Failed(NodeEnd { node, at: fault.at }, fault),
        }
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
