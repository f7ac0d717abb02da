//! The calling thread: it carries out commands and watches the nodes.

use crossbeam_channel::Receiver;

use super::mailbox::Mailbox;
use crate::{
    clock::{ClockExit, Supervision, wall::Wall},
    command::{ClockKind, Command},
    graph::Graph,
    inbox::{Inbox, Received},
    journal::{End, Entries, Entry},
    node::Fault,
    sync::Arc,
    time::Time,
};

/// The report of a thread that ends before it is told to: that its last tick before the end of the
/// run is over, or why the stretch ends.
pub(super) type Report = Option<StretchEnd>;

/// The reason for the end of a stretch.
pub(super) struct StretchEnd {
    pub(super) end: End,
    /// The failure, if it was one.
    pub(super) fault: Option<Fault>,
}

impl From<End> for StretchEnd {
    fn from(end: End) -> Self {
        let fault = None;
        Self { end, fault }
    }
}

impl StretchEnd {
    /// The end after a tick that was the last one of node number `node`.
    pub(super) fn of(node: usize, outcome: Result<Time, Fault>) -> Self {
        match outcome {
            Ok(at) => End::Ended { node, at }.into(),
            Err(fault) => Self {
                end: End::Failed { node, at: fault.at },
                fault: Some(fault),
            },
        }
    }

    /// What it is for the clock; `None` for a pause.
    pub(super) fn exit(self, graph: &Graph) -> Result<Option<ClockExit>, Fault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        Ok(match self.end {
            End::Completed { .. } => Some(ClockExit::Completed),
            End::Ended { node, at } => Some(ClockExit::Ended {
                node: graph.control.name(node).to_owned(),
                at,
            }),
            End::HandedOver => Some(ClockExit::HandedOver(ClockKind::Virtual)),
            End::Paused => None,
            _ => Some(ClockExit::Stopped),
        })
    }
}

/// The calling thread: carries out commands and watches the nodes.
pub(super) struct Supervisor<'a> {
    pub(super) graph: Supervision<'a>,
    pub(super) inbox: &'a mut Inbox,
    pub(super) until: Time,
    pub(super) mailboxes: &'a [Arc<Mailbox>],
    pub(super) reports: Receiver<Report>,
    /// Number of threads with ticks left before the end.
    pub(super) working: usize,
    pub(super) log: Entries,
}

impl Supervisor<'_> {
    /// Starts the nodes; returns when they are to stop.
    pub(super) fn supervise(&mut self) -> StretchEnd {
        let wall = Wall::starting_at(self.graph.control.now());
        self.graph.control.state.set_zero(wall.zero());
        for mailbox in self.mailboxes {
            mailbox.post(|mail| mail.wall = Some(wall));
        }
        while self.working > 0 || wall.now() < self.until {
            match self.next_received(&wall) {
                Received::Command(command) => {
                    let exit = self.obey(command, wall.now());
                    match exit {
                        Some(ClockExit::HandedOver(_)) => return End::HandedOver.into(),
                        Some(_) => return End::Stopped.into(),
                        None if self.graph.control.status.paused => return End::Paused.into(),
                        None => {}
                    }
                }
                Received::Other(None) => self.working -= 1,
                Received::Other(Some(end)) => return end,
                Received::Timeout => {}
            }
        }
        self.graph.control.set_now(self.until);
        let until = self.until;
        End::Completed { until }.into()
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
        let node = command
            .node()
            .map(|node| self.graph.control.local_index(node));
        if let Some(Ok(index)) = node {
            self.mailboxes[index].post(|mail| mail.commands.push((index, command)));
            return None;
        }
        let obeyed = self.graph.obey(&command, at);
        let event = obeyed.event as u64;
        self.log.note(Entry::Obey { at, event });
        obeyed.exit
    }

    /// Combines the reason for the stop with the nodes' reports: a failure has priority,
    /// then an end.
    pub(super) fn settle(&self, mut end: StretchEnd) -> StretchEnd {
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
