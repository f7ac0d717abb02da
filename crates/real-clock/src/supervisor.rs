//! The calling thread: it carries out commands and watches the nodes.

use crossbeam_channel::Receiver;

use ratelab::{
    ClockExit, ClockKind, Command, Fault, Graph, Inbox, Time,
    clock::{Received, RunWriter, Supervision, Wall},
    journal::{End, Entries, Entry},
};

use crate::mailbox::Post;

/// The report of a thread that ends before it is told to: that its last tick before the end of the
/// run is over, or why the stretch ends.
pub(crate) type Report = Option<StretchEnd>;

/// The reason for the end of a stretch.
pub(crate) struct StretchEnd {
    pub(crate) end: End,
    /// The failure, if it was one.
    pub(crate) fault: Option<Fault>,
}

impl From<End> for StretchEnd {
    fn from(end: End) -> Self {
        let fault = None;
        Self { end, fault }
    }
}

impl StretchEnd {
    /// Creates the end after a tick that was the last one of node number `node`.
    pub(crate) fn after_tick(node: usize, outcome: Result<Time, Fault>) -> Self {
        match outcome {
            Ok(at) => End::Ended { node, at }.into(),
            Err(fault) => Self {
                end: End::Failed { node, at: fault.at },
                fault: Some(fault),
            },
        }
    }

    /// Returns what it is for the clock; `None` for a pause.
    pub(crate) fn exit(self, graph: &Graph) -> Result<Option<ClockExit>, Fault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        Ok(match self.end {
            End::Completed { .. } => Some(ClockExit::Completed),
            End::Ended { node, at } => Some(ClockExit::Ended {
                node: graph.topology().nodes.swap_remove(node).name,
                at,
            }),
            End::HandedOver => Some(ClockExit::HandedOver(ClockKind::Virtual)),
            End::Paused => None,
            _ => Some(ClockExit::Stopped),
        })
    }
}

/// The calling thread: carries out commands and watches the nodes.
pub(crate) struct Supervisor<'a> {
    pub(crate) graph: Supervision<'a>,
    pub(crate) state: RunWriter,
    pub(crate) inbox: &'a mut Inbox,
    pub(crate) until: Time,
    pub(crate) post: &'a Post,
    pub(crate) reports: Receiver<Report>,
    /// Number of threads with ticks left before the end.
    pub(crate) working: usize,
    pub(crate) log: Entries,
}

impl Supervisor<'_> {
    /// Starts the nodes, and stops them in the end.
    pub(crate) fn supervise(&mut self) -> StretchEnd {
        let wall = Wall::starting_at(self.state.now());
        self.state.set_zero(wall.zero());
        self.post.to_all(|mail| mail.wall = Some(wall));
        let end = self.watch(&wall);
        self.state.set_zero(None);
        let stopped = self.state.now();
        self.post.to_all(|mail| mail.stopped = Some(stopped));
        end
    }

    /// Carries out commands until the nodes are to stop.
    fn watch(&mut self, wall: &Wall) -> StretchEnd {
        while self.working > 0 || wall.now() < self.until {
            match self.next_received(wall) {
                Received::Command(command) => {
                    let exit = self.obey(command, wall.now());
                    match exit {
                        Some(ClockExit::HandedOver(_)) => return End::HandedOver.into(),
                        Some(_) => return End::Stopped.into(),
                        None if self.state.status().paused => return End::Paused.into(),
                        None => {}
                    }
                }
                Received::Other(None) => self.working -= 1,
                Received::Other(Some(end)) => return end,
                Received::Timeout => {}
            }
        }
        self.state.set_now(self.until);
        let until = self.until;
        End::Completed { until }.into()
    }

    /// Returns a timed command that is due, or else whatever arrives before the next timed one.
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
        if let Some(node) = self.graph.node_for(&command) {
            self.post
                .to(node, |mail| mail.commands.push((node, command)));
            return None;
        }
        let obeyed = self.graph.obey(&command, at);
        let event = obeyed.event as u64;
        self.log.note(Entry::Obey { at, event });
        obeyed.exit
    }

    /// Combines the reason for the stop with the nodes' reports: a failure has priority,
    /// then an end.
    pub(crate) fn settle(&self, mut end: StretchEnd) -> StretchEnd {
        for report in self.reports.try_iter().flatten() {
            if end.fault.is_some() {
                break;
            }
            if report.fault.is_some() || !matches!(end.end, End::Ended { .. }) {
                end = report;
            }
        }
        end
    }
}
